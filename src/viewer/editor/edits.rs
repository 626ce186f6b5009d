//! Changes of the document: (document and selection, edit) → (document and selection).
//!
//! Values that an edit does not set keep their bits.

use std::sync::Arc;

use glam::DVec3;

use super::action::{Edit, MirrorPlane, MirrorResult};
use super::axis::Axis;
use super::document::{is_same, volume};
use super::selection::Selection;
use super::settings::{ScalingAnchor, Settings};
use super::snapshot::Snapshot;
use crate::model::boxes::CloudBox;

/// Returns document and selection after `edit`. The caller checks that a box file can hold them.
///
/// # Errors
/// A density cannot be reached by any number of particles.
pub(super) fn edited(
    before: &Snapshot,
    settings: &Settings,
    edit: &Edit,
) -> Result<Snapshot, String> {
    let mut new = before.clone();
    let n = new.document.boxes.len();
    match *edit {
        Edit::Add(b) => {
            new.boxes_mut().push(b);
            new.selection = Selection::new([n]);
        }
        Edit::Duplicate => duplicate(&mut new),
        Edit::Delete => {
            let mut mask = new.selection.mask(n).into_iter();
            new.boxes_mut().retain(|_| mask.next() == Some(false));
            new.selection = Selection::default();
        }
        Edit::Count(n_particles) => new.each(|_, b| b.n_particles = n_particles),
        Edit::Density(density) => set_density(&mut new, density)?,
        Edit::Extent(axis, v) => new.each(|_, b| resize(b, axis, v, settings.anchor, 1.0)),
        Edit::Center(axis, v) => new.each(|_, b| b.center[axis.index()] = v),
        Edit::Radius(v) => new.each(|_, b| b.radius_max = v),
        Edit::MoveBy(offset) => new.each(|_, b| b.center = shifted(b.center, offset)),
        Edit::Mirror { axis, plane, result } => mirror(&mut new, axis, plane, result),
        Edit::Seed(seed) => Arc::make_mut(&mut new.document).seed = seed,
    }
    Ok(new)
}

/// Appends copies in the order of the list. They are selected in the order of their originals.
fn duplicate(new: &mut Snapshot) {
    let first = new.document.boxes.len();
    let mut originals = new.selection.boxes().to_vec();
    originals.sort_unstable();
    let copy = |i: &usize| first + originals.partition_point(|original| original < i);
    new.selection = Selection::new(new.selection.boxes().iter().map(copy));
    let boxes = new.boxes_mut();
    originals.iter().for_each(|i| boxes.push(boxes[*i]));
}

fn set_density(new: &mut Snapshot, density: f64) -> Result<(), String> {
    for i in new.selection.clone().boxes() {
        let b = &mut new.boxes_mut()[*i];
        if volume(b) == 0.0 {
            return Err(format!("box {i} has no volume, so that no density gives it particles"));
        }
        let (n, max) = ((density * volume(b)).round(), u32::MAX);
        if !(0.0..=f64::from(max)).contains(&n) {
            let expected = format!("expected 0 to {max}, found {n}");
            return Err(format!("box {i}: density times volume: {expected}"));
        }
        b.n_particles = n as u32;
    }
    Ok(())
}

/// Mirrors the selected boxes. A box is its own mirror image, so only its centre moves. The
/// particles of a mirrored copy are new random ones.
fn mirror(new: &mut Snapshot, axis: Axis, plane: MirrorPlane, result: MirrorResult) {
    let k = axis.index();
    let twice_plane = match plane {
        MirrorPlane::Zero => 0.0,
        // For one box exactly twice its centre, so that it stays in place.
        MirrorPlane::Middle => new.middle().map_or(0.0, |middle| 2.0 * middle[k]),
    };
    let image = |mut b: CloudBox| {
        // Across 0 the sign of 0 is kept, so that mirroring twice restores every bit.
        if b.center[k] != 0.0 || twice_plane != 0.0 {
            b.center[k] = twice_plane - b.center[k];
        }
        b
    };
    if result == MirrorResult::Move {
        return new.each(|_, b| *b = image(*b));
    }
    let originals = new.selected().filter(|b| !is_same(b, &image(**b)));
    let images: Vec<CloudBox> = originals.map(|b| image(*b)).collect();
    if !images.is_empty() {
        let first = new.document.boxes.len();
        new.selection = Selection::new(first..first + images.len());
        new.boxes_mut().extend(images);
    }
}

/// Returns c + offset. A component without offset keeps its bits: −0 + 0 would lose the sign.
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

/// Scales the selected boxes, and the distances between them, about their middle.
pub(super) fn scale(new: &mut Snapshot, factors: DVec3) {
    let Some(middle) = new.middle() else { return };
    new.each(|_, b| {
        for k in 0..3 {
            // Rounding must not change a box by the factor 1, nor a centre in the middle.
            if factors[k] != 1.0 {
                b.extent[k] *= factors[k];
                if b.center[k] != middle[k] {
                    b.center[k] = middle[k] + factors[k] * (b.center[k] - middle[k]);
                }
            }
        }
    });
}

#[cfg(test)]
mod tests;
