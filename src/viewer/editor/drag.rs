//! A drag of a handle, from the press of a button to its release.
//!
//! The document follows from where the drag began and where the pointer is now, and not from the
//! path between, so that rounding does not accumulate.

use glam::DVec3;

use super::action::DragModifiers;
use super::axis::Axis;
use super::document::Document;
use super::edits::{middle, resize, scaled, shifted};
use super::grid_snap::GridSnap;
use super::handles::Handle;
use super::history::Snapshot;
use super::ray::Ray;
use super::settings::{ScalingAnchor, Settings};
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
    pub before: Snapshot,
    /// Ray through the pointer now.
    pub ray: Ray,
    pub modifiers: DragModifiers,
}

/// Least distance of the start from the middle, as a part of the distance from the camera, for
/// scaling by that distance.
const MIN_DISTANCE: f64 = 1e-2;
/// Part of a drag's length below which a coordinate stays: it is rounding of the others.
const MIN_COMPONENT: f64 = 1e-9;
/// Grid of snapped factors.
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

    /// Returns the document at the pointer's place; `None` where the ray determines no place.
    pub fn document(&self, settings: &Settings) -> Option<Document> {
        let Snapshot { document, selection } = &self.before;
        let active = document.boxes.get(selection.active()?)?;
        let snap = (settings.snap.is_on != self.modifiers.snap).then_some(settings.snap);
        let along = |place: DVec3, axis: Axis| {
            let at = |ray: Ray| ray.nearest_on_axis(place, axis.unit());
            Some(at(self.ray)? - at(self.start)?)
        };
        Some(match self.handle {
            Handle::MoveAxis(axis) => {
                self.moved(active.center, along(active.center, axis)? * axis.unit(), snap)
            }
            Handle::MoveView => {
                let at = |ray: Ray| ray.on_plane(active.center, self.forward);
                self.moved(active.center, at(self.ray)? - at(self.start)?, snap)
            }
            Handle::ScaleFace(axis, side) => {
                let face = active.center + 0.5 * side.sign() * active.extent * axis.unit();
                let outward = side.sign() * along(face, axis)?;
                let anchor = match self.modifiers.anchor {
                    true => settings.anchor.toggled(),
                    false => settings.anchor,
                };
                self.grown(axis, outward, anchor, side.sign(), snap)
            }
            Handle::ScaleAll => scaled(document, selection, DVec3::splat(self.factor(snap)?)),
            Handle::ScaleAxis(axis) => {
                let mut factors = DVec3::ONE;
                factors[axis.index()] = self.factor(snap)?;
                scaled(document, selection, factors)
            }
        })
    }

    /// Moves the selected boxes. The active box, whose centre is `active`, snaps to the grid, and
    /// the others keep their places relative to it.
    fn moved(&self, active: DVec3, mut offset: DVec3, snap: Option<GridSnap>) -> Document {
        for k in 0..3 {
            if offset[k].abs() <= MIN_COMPONENT * offset.length() {
                offset[k] = 0.0;
            } else if let Some(snap) = snap {
                offset[k] = snap.coordinate(active[k] + offset[k]) - active[k];
            }
        }
        let Snapshot { document, selection } = &self.before;
        let mut new = Document::clone(document);
        for i in selection.boxes() {
            let center = &mut new.boxes[*i].center;
            *center = shifted(*center, offset);
            if let (Some(snap), true) = (snap, Some(*i) == selection.active()) {
                // In f64 c + (v − c) is not always v.
                for k in (0..3).filter(|k| offset[*k] != 0.0) {
                    center[k] = snap.coordinate(center[k]);
                }
            }
        }
        new
    }

    /// Moves the face on the side of `sign` of every selected box outward.
    fn grown(
        &self,
        axis: Axis,
        outward: f64,
        anchor: ScalingAnchor,
        sign: f64,
        snap: Option<GridSnap>,
    ) -> Document {
        let Snapshot { document, selection } = &self.before;
        let mut new = Document::clone(document);
        if outward == 0.0 {
            return new;
        }
        let growth = if anchor == ScalingAnchor::Center { 2.0 * outward } else { outward };
        for i in selection.boxes() {
            let b = &mut new.boxes[*i];
            let length = b.extent[axis.index()] + growth;
            let length = match snap {
                Some(snap) => snap.size(length),
                // A face stops at the opposite one.
                None if length < LEAST_EXTENT => 0.0,
                None => length,
            };
            resize(b, axis, length, anchor, sign);
        }
        new
    }

    /// Returns the pointer's distance from the middle, divided by that at the start. Distances are
    /// measured in the plane through the middle that faces the camera.
    fn factor(&self, snap: Option<GridSnap>) -> Option<f64> {
        let middle = middle(&self.before.document, &self.before.selection)?;
        let distance = |ray: Ray| Some(ray.on_plane(middle, self.forward)?.distance(middle));
        let start = distance(self.start)?;
        if start <= MIN_DISTANCE * self.start.origin.distance(middle) {
            return None;
        }
        let factor = distance(self.ray)? / start;
        Some(snap.map_or(factor, |snap| GridSnap { step: FACTOR_STEP, ..snap }.size(factor)))
    }
}

#[cfg(test)]
mod tests;
