//! A drag of a handle, from the press of a button to its release.
//!
//! The document follows from the drag's beginning and the pointer's present place. The path between
//! them does not matter, so rounding does not accumulate.

use glam::DVec3;

use super::action::DragModifiers;
use super::axis::Axis;
use super::edits::{resize, scale, shifted};
use super::grid_snap::GridSnap;
use super::handles::Handle;
use super::ray::Ray;
use super::settings::{ScalingAnchor, Settings};
use super::snapshot::Snapshot;
use crate::io::bounds::LEAST_EXTENT;

/// A drag in progress.
#[derive(Debug, Clone)]
pub struct Drag {
    /// The handle that was pressed.
    pub pressed: Handle,
    /// The handle that is dragged: the pressed one, or its restriction to an axis.
    pub handle: Handle,
    /// Ray through the pointer at the beginning.
    pub start: Ray,
    /// View direction of the camera.
    pub forward: DVec3,
    /// Document and selection at the beginning.
    pub before: Snapshot,
    /// Ray through the pointer now.
    pub ray: Ray,
    /// Settings that held keys invert now.
    pub modifiers: DragModifiers,
}

/// Smallest distance from the middle at which scaling may start, as a part of the camera's
/// distance. Nearer to the middle, tiny movements would be large factors.
const MIN_DISTANCE: f64 = 1e-2;
/// Part of a drag's length below which a coordinate stays: it is rounding of the others.
const MIN_COMPONENT: f64 = 1e-9;
/// Step of snapped scale factors: fine enough to choose by hand, and easy to read as 10 %.
const FACTOR_STEP: f64 = 0.1;

impl Drag {
    /// Restricts the drag to `axis`, or lifts the restriction where it is that axis.
    pub fn constrained(mut self, axis: Axis) -> Drag {
        let along = match self.pressed {
            Handle::MoveAxis(_) | Handle::MoveView => Handle::MoveAxis(axis),
            Handle::ScaleAll | Handle::ScaleAxis(_) => Handle::ScaleAxis(axis),
            Handle::ScaleFace(..) => self.pressed,
        };
        self.handle = if self.handle == along { self.pressed } else { along };
        self
    }

    /// Returns the state at the pointer's place; `None` where the ray determines no place.
    pub fn after(&self, settings: &Settings) -> Option<Snapshot> {
        let mut new = self.before.clone();
        let active = *new.document.boxes.get(new.selection.active()?)?;
        let snap = (settings.snap.is_on != self.modifiers.snap).then_some(settings.snap);
        let along = |place: DVec3, axis: Axis| {
            let at = |ray: Ray| ray.nearest_on_axis(place, axis.unit());
            Some(at(self.ray)? - at(self.start)?)
        };
        match self.handle {
            Handle::MoveAxis(axis) => {
                move_by(&mut new, along(active.center, axis)? * axis.unit(), snap)
            }
            Handle::MoveView => {
                let at = |ray: Ray| ray.on_plane(active.center, self.forward);
                move_by(&mut new, at(self.ray)? - at(self.start)?, snap)
            }
            Handle::ScaleFace(axis, side) => {
                let face = active.center + 0.5 * side.sign() * active.extent * axis.unit();
                let outward = side.sign() * along(face, axis)?;
                let anchor = match self.modifiers.anchor {
                    true => settings.anchor.toggled(),
                    false => settings.anchor,
                };
                let growth = if anchor == ScalingAnchor::Center { 2.0 * outward } else { outward };
                if growth != 0.0 {
                    new.each(|_, b| {
                        let length = grown(b.extent[axis.index()], growth, snap);
                        resize(b, axis, length, anchor, side.sign());
                    });
                }
            }
            Handle::ScaleAll => scale(&mut new, DVec3::splat(self.factor(snap)?)),
            Handle::ScaleAxis(axis) => {
                let mut factors = DVec3::ONE;
                factors[axis.index()] = self.factor(snap)?;
                scale(&mut new, factors);
            }
        }
        Some(new)
    }

    /// Returns the pointer's distance from the middle, divided by that at the start. Distances are
    /// measured in the plane through the middle that faces the camera.
    fn factor(&self, snap: Option<GridSnap>) -> Option<f64> {
        let middle = self.before.middle()?;
        let distance = |ray: Ray| Some(ray.on_plane(middle, self.forward)?.distance(middle));
        let start = distance(self.start)?;
        if start <= MIN_DISTANCE * self.start.origin.distance(middle) {
            return None;
        }
        let factor = distance(self.ray)? / start;
        Some(snap.map_or(factor, |snap| GridSnap { step: FACTOR_STEP, ..snap }.size(factor)))
    }
}

/// Moves the selected boxes. The active box snaps to the grid, and the others keep their places
/// relative to it.
fn move_by(new: &mut Snapshot, mut offset: DVec3, snap: Option<GridSnap>) {
    let Some(i_active) = new.selection.active() else { return };
    let active = new.document.boxes[i_active].center;
    for k in 0..3 {
        if offset[k].abs() <= MIN_COMPONENT * offset.length() {
            offset[k] = 0.0;
        } else if let Some(snap) = snap {
            offset[k] = snap.coordinate(active[k] + offset[k]) - active[k];
        }
    }
    new.each(|i, b| {
        b.center = shifted(b.center, offset);
        if let Some(snap) = snap.filter(|_| i == i_active) {
            // In f64 c + (v − c) is not always v.
            for k in (0..3).filter(|k| offset[*k] != 0.0) {
                b.center[k] = snap.coordinate(b.center[k]);
            }
        }
    });
}

/// Returns a length after growth.
fn grown(length: f64, growth: f64, snap: Option<GridSnap>) -> f64 {
    let length = length + growth;
    match snap {
        Some(snap) => snap.size(length),
        // A face stops at the opposite one.
        None if length < LEAST_EXTENT => 0.0,
        None => length,
    }
}

#[cfg(test)]
mod tests;
