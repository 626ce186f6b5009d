//! The editor's state, and its change by an action.

use std::sync::Arc;

use glam::DVec3;

use super::action::{Action, DragAction, DragModifiers, Edit, Select, Setting};
use super::document::Document;
use super::drag::Drag;
use super::edits::edited;
use super::grid_snap::GridSnap;
use super::handles::{Handle, PlacedHandle, place_handles};
use super::history::History;
use super::selection::Selection;
use super::settings::Settings;
use super::snapshot::Snapshot;
use super::viewport::{Viewport, bounds};
use crate::model::boxes::CloudBox;

/// The state of the editor. Cloning is cheap, because documents are shared.
#[derive(Debug, Clone)]
pub struct Editor {
    now: Snapshot,
    settings: Settings,
    history: History,
    drag: Option<Drag>,
}

/// Share of the view's height that a new box has: large enough to see, small enough to place.
const NEW_SHARE: f64 = 0.1;
/// Shares of the view's height that a copied box may have. A smaller box is hard to pick, and a
/// larger one hides its surroundings.
const COPIED_SHARES: std::ops::RangeInclusive<f64> = 0.01..=0.7;

/// The box that is added to an empty document, in units of its edge: the most common one in P.
pub const NEW_BOX: CloudBox =
    CloudBox { n_particles: 10, extent: DVec3::ONE, center: DVec3::ZERO, radius_max: 2.0 };

/// Returns 1, 2 or 5 times a power of ten, whichever is nearest to `v` by its ratio; 1 where `v` is
/// no positive number.
fn round_number(v: f64) -> f64 {
    if !(v.is_finite() && v > 0.0) {
        return 1.0;
    }
    let power = v.log10().floor();
    let off = |k: f64| (v / (k * 10f64.powf(power))).ln().abs();
    let nearest = [1.0, 2.0, 5.0, 10.0].into_iter().min_by(|a, b| off(*a).total_cmp(&off(*b)));
    // Parsing gives the number nearest to the decimal one, where powf may be off by a bit.
    let written = format!("{}e{power}", nearest.unwrap_or(1.0));
    written.parse().unwrap_or(1.0)
}

impl Default for Editor {
    fn default() -> Self {
        Editor::new(Vec::new())
    }
}

impl Editor {
    /// Creates a state without selection and history.
    pub fn new(boxes: Vec<CloudBox>) -> Editor {
        Editor::with_settings(Document::new(boxes), Settings::default())
    }

    /// Creates a state without selection and history.
    pub fn with_settings(document: Document, settings: Settings) -> Editor {
        let now = Snapshot { document: document.into(), selection: Selection::default() };
        Editor { now, settings, history: History::default(), drag: None }
    }

    /// Returns the state after an action.
    ///
    /// # Errors
    /// A box file cannot hold the result, or the action does not fit a drag in progress.
    pub fn after(&self, action: &Action) -> Result<Editor, String> {
        let mut next = self.clone();
        match action {
            Action::Drag(drag) => next.drag(*drag)?,
            Action::Set(setting) => next.set(*setting)?,
            _ if self.drag.is_some() => {
                return Err("a drag is under way: end or cancel it first".to_owned());
            }
            Action::Edit(edit) => next.edit(edit)?,
            Action::Select(select) => next.now.selection = self.selected(select)?,
            Action::Undo => next.travel(History::undo),
            Action::Redo => next.travel(History::redo),
        }
        Ok(next)
    }

    fn edit(&mut self, edit: &Edit) -> Result<(), String> {
        let new = edited(&self.now, &self.settings, edit)?;
        new.document.check(self.document())?;
        // An edit without effect is no step, and keeps what can be redone.
        if !new.document.is_same(self.document()) {
            self.history.push(std::mem::replace(&mut self.now, new), edit.label());
        }
        Ok(())
    }

    fn travel(&mut self, to: impl Fn(&mut History, Snapshot) -> Option<Snapshot>) {
        if let Some(snapshot) = to(&mut self.history, self.now.clone()) {
            self.now = snapshot;
        }
    }

    fn selected(&self, select: &Select) -> Result<Selection, String> {
        let (n, selection) = (self.boxes().len(), self.selection());
        Ok(match select {
            Select::Boxes { boxes, mode } => {
                if let Some(i) = boxes.iter().find(|i| **i >= n) {
                    return Err(format!("box: expected a number below {n}, found {i}"));
                }
                selection.with(boxes, *mode)
            }
            // The active box stays active.
            Select::All => Selection::new((0..n).chain(selection.active())),
            Select::None => Selection::default(),
            Select::Next => selection.neighbour(n, true),
            Select::Previous => selection.neighbour(n, false),
        })
    }

    fn set(&mut self, setting: Setting) -> Result<(), String> {
        let settings = &mut self.settings;
        match setting {
            Setting::Display(display) => settings.display = display,
            Setting::Snap(snap) if snap.is_valid() => settings.snap = snap,
            Setting::Snap(snap) => {
                let step = snap.step;
                return Err(format!("grid step: expected a number above 0, found {step}"));
            }
            Setting::Anchor(anchor) => settings.anchor = anchor,
            Setting::Axis(axis) => settings.axis = axis,
        }
        Ok(())
    }

    fn drag(&mut self, action: DragAction) -> Result<(), String> {
        let drag = match (action, self.drag.take()) {
            (DragAction::Begin { .. }, Some(_)) => {
                return Err("a drag is under way".to_owned());
            }
            (DragAction::Begin { .. }, None) if self.selection().is_empty() => {
                return Err("nothing is selected".to_owned());
            }
            (DragAction::Begin { handle, ray, forward }, None) => Drag {
                pressed: handle,
                handle,
                start: ray,
                forward,
                before: self.now.clone(),
                ray,
                modifiers: DragModifiers::default(),
            },
            // After a cancelled drag the pointer still moves, and the button is released later.
            (_, None) => return Ok(()),
            (DragAction::To { ray, modifiers }, Some(drag)) => Drag { ray, modifiers, ..drag },
            (DragAction::Constrain(axis), Some(drag)) => drag.constrained(axis),
            (DragAction::Cancel, Some(drag)) => {
                self.now = drag.before;
                return Ok(());
            }
            (DragAction::End, Some(drag)) => {
                if !self.document().is_same(&drag.before.document) {
                    self.history.push(drag.before, drag.handle.label());
                }
                return Ok(());
            }
        };
        if let Some(new) = drag.after(&self.settings) {
            new.document.check(&drag.before.document)?;
            self.now = new;
        }
        self.drag = Some(drag);
        Ok(())
    }

    /// Returns the document.
    pub fn document(&self) -> &Document {
        &self.now.document
    }

    /// Returns the document for keeping beyond the next action.
    pub fn shared_document(&self) -> Arc<Document> {
        self.now.document.clone()
    }

    /// Returns the document's boxes.
    pub fn boxes(&self) -> &[CloudBox] {
        &self.now.document.boxes
    }

    /// Returns the selection.
    pub fn selection(&self) -> &Selection {
        &self.now.selection
    }

    /// Returns the box that was selected last, with its index.
    pub fn active_box(&self) -> Option<(usize, &CloudBox)> {
        let i = self.selection().active()?;
        Some((i, self.boxes().get(i)?))
    }

    /// Returns the settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the history.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Returns the handle that is dragged.
    pub fn dragged_handle(&self) -> Option<Handle> {
        self.drag.as_ref().map(|drag| drag.handle)
    }

    /// Returns the handles of the active box.
    pub fn handles(&self, view: &Viewport) -> Vec<PlacedHandle> {
        self.active_box().map_or_else(Vec::new, |(_, b)| place_handles(b, view))
    }

    /// Returns a box to add at `place`, or at the nearest grid point where snapping is on.
    ///
    /// `view_height` is the height of the view there, scene units. The box copies the active one
    /// where that has a size to work with in this view. Else it is a cube of about a tenth of the
    /// view. Its coordinates have only the digits that show.
    pub fn new_box(&self, place: DVec3, view_height: f64) -> CloudBox {
        let edge = round_number(NEW_SHARE * view_height);
        let fits = |b: &CloudBox| COPIED_SHARES.contains(&(b.extent.max_element() / view_height));
        let active = self.active_box().map(|(_, b)| *b).filter(fits);
        let new = active.unwrap_or(CloudBox {
            extent: edge * NEW_BOX.extent,
            radius_max: edge * NEW_BOX.radius_max,
            ..NEW_BOX
        });
        let snap = self.settings.snap;
        let fine = GridSnap { is_on: true, step: round_number(0.01 * edge) };
        let center = if snap.is_on { snap.place(place) } else { fine.place(place) };
        CloudBox { center, ..new }
    }

    /// Returns the lower and upper bounds of the selected boxes, or of all boxes where none is
    /// selected.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        if self.selection().is_empty() {
            return bounds(self.boxes());
        }
        bounds(self.now.selected())
    }
}

#[cfg(test)]
mod tests;
