//! Changes of the document: (document, selection, edit) → (document, selection).
//!
//! Values that an edit does not set keep their bits.

use glam::DVec3;

use super::action::Edit;
use super::axis::Axis;
use super::document::{Document, volume};
use super::history::Snapshot;
use super::mirror::mirrored;
use super::refusal::Refusal;
use super::selection::Selection;
use super::settings::{ScalingAnchor, Settings};
use super::viewport::bounds;
use crate::model::boxes::CloudBox;

/// Returns document and selection after `edit`. The caller checks that a box file can hold them.
///
/// # Errors
/// A density cannot be reached by any number of particles.
pub(super) fn edited(
    before: &Snapshot,
    settings: &Settings,
    edit: &Edit,
) -> Result<(Document, Selection), Refusal> {
    let Snapshot { document, selection } = before;
    let all =
        |change: &dyn Fn(&mut CloudBox)| Ok((each(document, selection, change), selection.clone()));
    match edit {
        Edit::Add(b) => {
            let mut new = Document::clone(document);
            new.boxes.push(*b);
            Ok((new, Selection::new([document.boxes.len()])))
        }
        Edit::Duplicate => Ok(duplicated(document, selection)),
        Edit::Delete => {
            let mask = selection.mask(document.boxes.len());
            let kept = document.boxes.iter().zip(mask).filter(|(_, is_selected)| !is_selected);
            let boxes = kept.map(|(b, _)| *b).collect();
            Ok((Document { boxes, ..**document }, Selection::default()))
        }
        Edit::Count(n) => all(&|b| b.n_particles = *n),
        Edit::Density(density) => {
            Ok((with_density(document, selection, *density)?, selection.clone()))
        }
        Edit::Extent(axis, v) => all(&|b| resize(b, *axis, *v, settings.anchor, 1.0)),
        Edit::Center(axis, v) => all(&|b| b.center[axis.index()] = *v),
        Edit::Radius(v) => all(&|b| b.radius_max = *v),
        Edit::MoveBy(offset) => all(&|b| b.center = shifted(b.center, *offset)),
        Edit::Mirror { axis, plane, result } => {
            Ok(mirrored(document, selection, *axis, *plane, *result))
        }
        Edit::Seed(seed) => {
            Ok((Document { seed: *seed, boxes: document.boxes.clone() }, selection.clone()))
        }
    }
}

fn each(document: &Document, selection: &Selection, change: &dyn Fn(&mut CloudBox)) -> Document {
    let mut new = document.clone();
    selection.boxes().iter().for_each(|i| change(&mut new.boxes[*i]));
    new
}

/// Appends copies in the order of the list. They are selected in the order of their originals.
fn duplicated(document: &Document, selection: &Selection) -> (Document, Selection) {
    let mut new = document.clone();
    let first = new.boxes.len();
    let mut originals = selection.boxes().to_vec();
    originals.sort_unstable();
    new.boxes.extend(originals.iter().map(|i| document.boxes[*i]));
    let copy = |i: &usize| first + originals.partition_point(|original| original < i);
    let copies = Selection::new(selection.boxes().iter().map(copy));
    (new, copies)
}

fn with_density(
    document: &Document,
    selection: &Selection,
    density: f64,
) -> Result<Document, Refusal> {
    let mut new = document.clone();
    for i in selection.boxes() {
        let b = &mut new.boxes[*i];
        if volume(b) == 0.0 {
            return Err(Refusal(format!(
                "box {i} has no volume, so that no density gives it particles"
            )));
        }
        let (n, max) = ((density * volume(b)).round(), u32::MAX);
        if !(0.0..=f64::from(max)).contains(&n) {
            return Err(Refusal(format!(
                "box {i}: density times volume: expected 0 to {max}, found {n}"
            )));
        }
        b.n_particles = n as u32;
    }
    Ok(new)
}

/// Returns c + offset. A component without offset keeps its bits, where −0 + 0 would be 0.
pub(super) fn shifted(c: DVec3, offset: DVec3) -> DVec3 {
    let add = |c: f64, d: f64| if d == 0.0 { c } else { c + d };
    DVec3::new(add(c.x, offset.x), add(c.y, offset.y), add(c.z, offset.z))
}

/// Sets the length of a box along an axis. The face on the side of `sign` moves, and also the other
/// face where the anchor is the centre.
pub(super) fn resize(b: &mut CloudBox, axis: Axis, length: f64, anchor: ScalingAnchor, sign: f64) {
    let k = axis.index();
    let growth = length - b.extent[k];
    if growth == 0.0 {
        return;
    }
    b.extent[k] = length;
    if anchor == ScalingAnchor::OppositeFace {
        b.center[k] += 0.5 * sign * growth;
    }
}

/// Returns the middle of the selected boxes' bounds. For one box it is exactly its centre.
pub(super) fn middle(document: &Document, selection: &Selection) -> Option<DVec3> {
    match selection.boxes() {
        [i] => Some(document.boxes[*i].center),
        several => {
            let (low, high) = bounds(several.iter().map(|i| &document.boxes[*i]))?;
            Some(0.5 * (low + high))
        }
    }
}

/// Scales the selected boxes, and the distances between them, about their middle.
pub(super) fn scaled(document: &Document, selection: &Selection, factors: DVec3) -> Document {
    let Some(middle) = middle(document, selection) else { return document.clone() };
    each(document, selection, &|b| {
        for k in 0..3 {
            // Rounding must not change a box by the factor 1, nor a centre in the middle.
            if factors[k] != 1.0 {
                b.extent[k] *= factors[k];
                if b.center[k] != middle[k] {
                    b.center[k] = middle[k] + factors[k] * (b.center[k] - middle[k]);
                }
            }
        }
    })
}

#[cfg(test)]
mod tests;
