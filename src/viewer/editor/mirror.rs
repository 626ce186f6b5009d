//! Mirroring of boxes across a plane perpendicular to an axis.
//!
//! A box is its own mirror image, so only its centre moves. The particles of a mirrored copy are
//! new random ones.

use super::axis::Axis;
use super::document::{Document, is_same};
use super::selection::Selection;
use super::viewport::bounds;
use crate::model::boxes::CloudBox;

/// The plane of a mirror.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MirrorPlane {
    /// Coordinate 0.
    Zero,
    /// The middle of the selected boxes' bounds.
    Middle,
}

/// The use of the mirror images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MirrorResult {
    /// Images replace the boxes.
    Move,
    /// Images are appended and selected. A box that is its own image is left out, because two
    /// boxes in one place would double its particles.
    Copy,
}

pub(super) fn mirrored(
    document: &Document,
    selection: &Selection,
    axis: Axis,
    plane: MirrorPlane,
    result: MirrorResult,
) -> (Document, Selection) {
    let twice_plane = match plane {
        MirrorPlane::Zero => 0.0,
        MirrorPlane::Middle => twice_the_middle(document, selection, axis),
    };
    let mut new = document.clone();
    let image = |i: &usize| image(&document.boxes[*i], axis, twice_plane);
    match result {
        MirrorResult::Move => selection.boxes().iter().for_each(|i| new.boxes[*i] = image(i)),
        MirrorResult::Copy => {
            let images = selection.boxes().iter().map(|i| (i, image(i)));
            let images = images.filter(|(i, image)| !is_same(&document.boxes[**i], image));
            new.boxes.extend(images.map(|(_, image)| image));
            if new.boxes.len() > document.boxes.len() {
                let copies = Selection::new(document.boxes.len()..new.boxes.len());
                return (new, copies);
            }
        }
    }
    (new, selection.clone())
}

/// Returns the sum of the lower and the upper bound. For one box it is exactly twice the centre, so
/// that the box stays in place.
fn twice_the_middle(document: &Document, selection: &Selection, axis: Axis) -> f64 {
    let k = axis.index();
    match selection.boxes() {
        [i] => 2.0 * document.boxes[*i].center[k],
        several => bounds(several.iter().map(|i| &document.boxes[*i]))
            .map_or(0.0, |(low, high)| low[k] + high[k]),
    }
}

fn image(b: &CloudBox, axis: Axis, twice_plane: f64) -> CloudBox {
    let mut image = *b;
    let c = &mut image.center[axis.index()];
    // Across 0 the sign of 0 is kept, so that mirroring twice restores every bit.
    if *c != 0.0 || twice_plane != 0.0 {
        *c = twice_plane - *c;
    }
    image
}
