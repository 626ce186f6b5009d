//! From the press of a button to its release. What a drag makes of the document follows from where
//! it began and where the pointer is now, never from the way between, so that no error adds up and
//! the way back leads back.

use glam::DVec3;

use super::action::{DragAction, Modifiers, Refusal};
use super::document::Document;
use super::edits::{middle, resize, scaled, shifted};
use super::handles::Handle;
use super::history::Snapshot;
use super::ray::Ray;
use super::snap::Snap;
use super::state::{Scaling, Settings};
use super::{Axis, Editor};
use crate::io::magnitude::LEAST_EXTENT;

#[derive(Debug, Clone)]
pub struct Drag {
    /// As it was taken hold of.
    free: Handle,
    /// As it is now, perhaps along one axis only.
    handle: Handle,
    began: Ray,
    forward: DVec3,
    before: Snapshot,
    now: (Ray, Modifiers),
}

/// Of the distance from the eye: a drag that begins nearer to the middle than this cannot scale by
/// the distance from it.
const LEAST_DISTANCE: f64 = 1e-2;
/// Coordinates that move by less than this part of the way do not move: rounding of a drag along
/// the others.
const STILL: f64 = 1e-9;
/// Factors snap to tenths.
const FACTOR_STEP: f64 = 0.1;

impl Drag {
    pub fn handle(&self) -> Handle {
        self.handle
    }

    /// The document as it was when the drag began.
    pub fn before(&self) -> &Document {
        &self.before.document
    }

    fn constrained(mut self, axis: Axis) -> Drag {
        let along = match self.free {
            Handle::MoveAxis(_) | Handle::MoveView => Handle::MoveAxis(axis),
            Handle::ScaleAll | Handle::ScaleAxis(_) => Handle::ScaleAxis(axis),
            Handle::ScaleFace(..) => self.free,
        };
        self.handle = if self.handle == along { self.free } else { along };
        self
    }

    /// None where the pointer says nothing about the handle: all stays as it is then.
    fn document(&self, settings: &Settings) -> Option<Document> {
        let Snapshot { document, selection } = &self.before;
        let active = document.boxes.get(selection.active()?)?;
        let (ray, modifiers) = self.now;
        let snap = (settings.snap.on != modifiers.snap).then_some(settings.snap);
        let along = |place: DVec3, axis: Axis| {
            let unit = axis.unit();
            Some(ray.nearest_on_axis(place, unit)? - self.began.nearest_on_axis(place, unit)?)
        };
        match self.handle {
            Handle::MoveAxis(axis) => {
                let offset = along(active.center, axis)? * axis.unit();
                Some(self.moved(active.center, offset, snap))
            }
            Handle::MoveView => {
                let at = |ray: Ray| ray.on_plane(active.center, self.forward);
                Some(self.moved(active.center, at(ray)? - at(self.began)?, snap))
            }
            Handle::ScaleFace(axis, side) => {
                let face = active.center + 0.5 * side.sign() * active.extent * axis.unit();
                let outwards = side.sign() * along(face, axis)?;
                let scaling =
                    if modifiers.scaling { settings.scaling.other() } else { settings.scaling };
                Some(self.grown(axis, outwards, scaling, side.sign(), snap))
            }
            Handle::ScaleAll => {
                Some(scaled(document, selection, DVec3::splat(self.factor(ray, snap)?)))
            }
            Handle::ScaleAxis(axis) => {
                let mut factors = DVec3::ONE;
                factors[axis.index()] = self.factor(ray, snap)?;
                Some(scaled(document, selection, factors))
            }
        }
    }

    /// The active box goes to the grid, the others keep their places relative to it.
    fn moved(&self, active: DVec3, offset: DVec3, snap: Option<Snap>) -> Document {
        let mut offset = offset;
        for k in 0..3 {
            if offset[k].abs() <= STILL * offset.length() {
                offset[k] = 0.0;
            } else if let Some(snap) = snap {
                offset[k] = snap.coordinate(active[k] + offset[k]) - active[k];
            }
        }
        let Snapshot { document, selection } = &self.before;
        let mut new = Document::clone(document);
        for i in selection.boxes() {
            let b = &mut new.boxes[*i];
            b.center = shifted(b.center, offset);
            if let (Some(snap), true) = (snap, Some(*i) == selection.active()) {
                // c + (v − c) is not always v.
                let on_grid = |k: usize| {
                    if offset[k] == 0.0 { b.center[k] } else { snap.coordinate(b.center[k]) }
                };
                b.center = DVec3::new(on_grid(0), on_grid(1), on_grid(2));
            }
        }
        new
    }

    /// The face of every selected box that looks where the dragged one does goes outwards by as
    /// much.
    fn grown(
        &self,
        axis: Axis,
        outwards: f64,
        scaling: Scaling,
        sign: f64,
        snap: Option<Snap>,
    ) -> Document {
        let Snapshot { document, selection } = &self.before;
        let mut new = Document::clone(document);
        if outwards == 0.0 {
            return new;
        }
        let more = if scaling == Scaling::Symmetric { 2.0 * outwards } else { outwards };
        for i in selection.boxes() {
            let b = &mut new.boxes[*i];
            let length = b.extent[axis.index()] + more;
            // Faces meet and do not pass each other.
            let length = snap
                .map_or(if length < LEAST_EXTENT { 0.0 } else { length }, |snap| snap.size(length));
            resize(b, axis, length, scaling, sign);
        }
        new
    }

    /// The pointer's distance from the middle over that at the beginning, in the plane that the
    /// camera looks at.
    fn factor(&self, ray: Ray, snap: Option<Snap>) -> Option<f64> {
        let middle = middle(&self.before.document, &self.before.selection)?;
        let distance = |ray: Ray| Some(ray.on_plane(middle, self.forward)?.distance(middle));
        let began = distance(self.began)?;
        if began <= LEAST_DISTANCE * self.began.origin.distance(middle) {
            return None;
        }
        let factor = distance(ray)? / began;
        Some(snap.map_or(factor, |snap| Snap { step: FACTOR_STEP, ..snap }.size(factor)))
    }
}

impl Editor {
    pub(super) fn dragged(&self, action: &DragAction) -> Result<Editor, Refusal> {
        if let DragAction::Begin { handle, ray, forward } = *action {
            return self.begun(handle, ray, forward);
        }
        // After an Escape the button is still to be released, and the pointer still moves.
        let Some(drag) = self.drag.clone() else { return Ok(self.clone()) };
        match *action {
            DragAction::Begin { .. } => Ok(self.clone()),
            DragAction::To { ray, modifiers } => {
                self.with_drag(Drag { now: (ray, modifiers), ..drag })
            }
            DragAction::Constrain(axis) => self.with_drag(drag.constrained(axis)),
            DragAction::Cancel => {
                let Snapshot { document, selection } = drag.before;
                Ok(Editor { document, selection, drag: None, ..self.clone() })
            }
            DragAction::End => {
                let mut editor = Editor { drag: None, ..self.clone() };
                if !self.document.is_same(drag.before()) {
                    editor.history.push(drag.before, drag.handle.label());
                }
                Ok(editor)
            }
        }
    }

    fn begun(&self, handle: Handle, ray: Ray, forward: DVec3) -> Result<Editor, Refusal> {
        if self.drag.is_some() {
            return Err(Refusal("a drag is under way".to_owned()));
        }
        if self.selection.is_empty() {
            return Err(Refusal("nothing is selected".to_owned()));
        }
        let before =
            Snapshot { document: self.document.clone(), selection: self.selection.clone() };
        let now = (ray, Modifiers::default());
        let drag = Drag { free: handle, handle, began: ray, forward, before, now };
        Ok(Editor { drag: Some(drag), ..self.clone() })
    }

    fn with_drag(&self, drag: Drag) -> Result<Editor, Refusal> {
        let document = match drag.document(&self.settings) {
            Some(document) => {
                document.check(drag.before())?;
                document.into()
            }
            None => self.document.clone(),
        };
        Ok(Editor { document, drag: Some(drag), ..self.clone() })
    }
}

#[cfg(test)]
mod tests;
