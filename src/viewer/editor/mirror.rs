//! Mirroring across a plane that is perpendicular to an axis. A box is its own mirror image, so
//! that only its centre moves; its particles are drawn by lot anew where it is a copy, and are not
//! mirrored.

use super::Axis;
use super::document::{Document, is_same};
use super::selection::Selection;
use super::viewport::bounds;
use crate::model::boxes::CloudBox;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// Where the coordinate is 0.
    Zero,
    /// Through the middle of what the selected boxes fill.
    Middle,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    Move,
    /// Images at the end of the list, which are selected then. A box that is its own image has
    /// none: two boxes in one place would have twice its particles.
    Copy,
}

pub(super) fn mirrored(
    document: &Document,
    selection: &Selection,
    axis: Axis,
    plane: Plane,
    outcome: Outcome,
) -> (Document, Selection) {
    let twice = match plane {
        Plane::Zero => 0.0,
        Plane::Middle => twice_the_middle(document, selection, axis),
    };
    let mut new = document.clone();
    match outcome {
        Outcome::Move => {
            selection
                .boxes()
                .iter()
                .for_each(|i| new.boxes[*i] = image(&document.boxes[*i], axis, twice));
            (new, selection.clone())
        }
        Outcome::Copy => {
            let images = selection
                .boxes()
                .iter()
                .map(|i| (document.boxes[*i], image(&document.boxes[*i], axis, twice)));
            let images: Vec<CloudBox> =
                images.filter(|(b, image)| !is_same(b, image)).map(|(_, image)| image).collect();
            if images.is_empty() {
                return (new, selection.clone());
            }
            let first = new.boxes.len();
            new.boxes.extend(images);
            let copies = Selection::new(first..new.boxes.len());
            (new, copies)
        }
    }
}

/// Low and high side together. Of one box it is twice its centre, to the bit, so that nothing
/// moves.
fn twice_the_middle(document: &Document, selection: &Selection, axis: Axis) -> f64 {
    let k = axis.index();
    match selection.boxes() {
        [i] => 2.0 * document.boxes[*i].center[k],
        several => bounds(several.iter().map(|i| &document.boxes[*i]))
            .map_or(0.0, |(low, high)| low[k] + high[k]),
    }
}

fn image(b: &CloudBox, axis: Axis, twice: f64) -> CloudBox {
    let mut image = *b;
    let c = &mut image.center[axis.index()];
    // 0 stays 0, where a minus would make it −0; across 0 the way back gives the same bits.
    if *c != 0.0 || twice != 0.0 {
        *c = twice - *c;
    }
    image
}
