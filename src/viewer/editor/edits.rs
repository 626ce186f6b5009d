//! What becomes of the boxes: (document, selection, edit) → (document, selection). Numbers of a box
//! that an edit is not about keep their bits.

use glam::DVec3;

use super::Axis;
use super::action::{Edit, Refusal};
use super::document::{Document, volume};
use super::mirror::mirrored;
use super::selection::Selection;
use super::state::{Scaling, Settings};
use super::viewport::bounds;
use crate::model::boxes::CloudBox;

/// Unchecked: numbers may be beyond what a box file takes.
pub(super) fn edited(
    document: &Document,
    selection: &Selection,
    settings: &Settings,
    edit: &Edit,
) -> Result<(Document, Selection), Refusal> {
    let all =
        |change: &dyn Fn(&mut CloudBox)| Ok((each(document, selection, change), selection.clone()));
    match edit {
        Edit::Add(b) => {
            let mut new = document.clone();
            new.boxes.push(*b);
            Ok((new, Selection::new([document.boxes.len()])))
        }
        Edit::Duplicate => Ok(duplicated(document, selection)),
        Edit::Delete => Ok((deleted(document, selection), Selection::default())),
        Edit::Count(n) => all(&|b| b.n_particles = *n),
        Edit::Density(density) => {
            Ok((with_density(document, selection, *density)?, selection.clone()))
        }
        Edit::Extent(axis, v) => all(&|b| resize(b, *axis, *v, settings.scaling, 1.0)),
        Edit::Center(axis, v) => all(&|b| b.center[axis.index()] = *v),
        Edit::Radius(v) => all(&|b| b.radius_max = *v),
        Edit::MoveBy(offset) => all(&|b| b.center = shifted(b.center, *offset)),
        Edit::ScaleBy(factors) => Ok((scaled(document, selection, *factors), selection.clone())),
        Edit::Mirror { axis, plane, outcome } => {
            Ok(mirrored(document, selection, *axis, *plane, *outcome))
        }
        Edit::SnapToGrid => all(&|b| {
            b.center = settings.snap.place(b.center);
            b.extent = DVec3::from_array(b.extent.to_array().map(|v| settings.snap.size(v)));
        }),
        Edit::Seed(seed) => Ok((Document { seed: *seed, ..document.clone() }, selection.clone())),
    }
}

fn each(document: &Document, selection: &Selection, change: &dyn Fn(&mut CloudBox)) -> Document {
    let mut new = document.clone();
    selection.boxes().iter().for_each(|i| change(&mut new.boxes[*i]));
    new
}

/// In the order of the list; the active box's copy becomes active.
fn duplicated(document: &Document, selection: &Selection) -> (Document, Selection) {
    let mut new = document.clone();
    let first = new.boxes.len();
    let mut originals = selection.boxes().to_vec();
    originals.sort_unstable();
    new.boxes.extend(originals.iter().map(|i| document.boxes[*i]));
    // The order of selection is kept.
    let copy = |i: &usize| first + originals.partition_point(|original| original < i);
    let copies = Selection::new(selection.boxes().iter().map(copy));
    (new, copies)
}

fn deleted(document: &Document, selection: &Selection) -> Document {
    let mask = selection.mask(document.boxes.len());
    let kept = document.boxes.iter().zip(mask).filter(|(_, is_selected)| !is_selected);
    Document { boxes: kept.map(|(b, _)| *b).collect(), seed: document.seed }
}

fn with_density(
    document: &Document,
    selection: &Selection,
    density: f64,
) -> Result<Document, Refusal> {
    let mut new = document.clone();
    for i in selection.boxes() {
        let b = &mut new.boxes[*i];
        let volume = volume(b);
        if volume == 0.0 {
            return Err(Refusal(format!(
                "box {i} has no volume, so that no density gives it particles"
            )));
        }
        let n = (density * volume).round();
        if !(0.0..=f64::from(u32::MAX)).contains(&n) {
            let most = u32::MAX;
            return Err(Refusal(format!(
                "box {i}: density times volume: expected 0 to {most}, found {n}"
            )));
        }
        b.n_particles = n as u32;
    }
    Ok(new)
}

/// c + offset; −0 + 0 would be 0, so that what does not move keeps its bits.
pub(super) fn shifted(c: DVec3, offset: DVec3) -> DVec3 {
    let add = |c: f64, d: f64| if d == 0.0 { c } else { c + d };
    DVec3::new(add(c.x, offset.x), add(c.y, offset.y), add(c.z, offset.z))
}

/// Gives the edge along an axis its new length; the face on the side of `sign` moves, and the other
/// one too where scaling is symmetric.
pub(super) fn resize(b: &mut CloudBox, axis: Axis, length: f64, scaling: Scaling, sign: f64) {
    let k = axis.index();
    let more = length - b.extent[k];
    if more == 0.0 {
        return;
    }
    b.extent[k] = length;
    if scaling == Scaling::OppositeFace {
        b.center[k] += 0.5 * sign * more;
    }
}

/// The middle of what the selected boxes fill; of one box its centre, to the bit.
pub(super) fn middle(document: &Document, selection: &Selection) -> Option<DVec3> {
    match selection.boxes() {
        [i] => Some(document.boxes[*i].center),
        several => {
            let (low, high) = bounds(several.iter().map(|i| &document.boxes[*i]))?;
            Some(0.5 * (low + high))
        }
    }
}

/// Places and edges times `factors`, about the middle.
pub(super) fn scaled(document: &Document, selection: &Selection, factors: DVec3) -> Document {
    let Some(middle) = middle(document, selection) else { return document.clone() };
    each(document, selection, &|b| {
        for k in 0..3 {
            // Once is not a change, and m + (c − m) is not always c.
            if factors[k] != 1.0 {
                b.extent[k] *= factors[k];
                b.center[k] = shifted_from(middle[k], b.center[k], factors[k]);
            }
        }
    })
}

fn shifted_from(middle: f64, c: f64, factor: f64) -> f64 {
    if c == middle { c } else { middle + factor * (c - middle) }
}

#[cfg(test)]
mod tests;
