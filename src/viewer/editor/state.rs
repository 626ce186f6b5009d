//! The editor's state and the one function that leads from each to the next.

use std::sync::Arc;

use glam::DVec3;

use super::Axis;
use super::action::{Action, Edit, Refusal, Select, Setting};
use super::document::{Document, Touched};
use super::drag::Drag;
use super::edits::edited;
use super::handles::{Handle, Placed, placed};
use super::history::{History, Snapshot};
use super::selection::Selection;
use super::snap::Snap;
use super::viewport::{Viewport, bounds};
use crate::model::boxes::CloudBox;

/// All that is edited, and what is needed to undo it. Cheap to clone: documents are shared.
#[derive(Debug, Clone)]
pub struct Editor {
    pub(super) document: Arc<Document>,
    pub(super) selection: Selection,
    pub(super) settings: Settings,
    pub(super) history: History,
    pub(super) drag: Option<Drag>,
}

/// Of the hand and the eye: no part of the document, and not undone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    pub view: View,
    pub snap: Snap,
    pub scaling: Scaling,
    pub axis: Axis,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum View {
    /// P, Figs. 3 and 5.
    #[default]
    Boxes,
    /// P, Figs. 4 and 6.
    Cloud,
    Both,
}

/// What stays where it is when an edge's length changes: by a face's handle, or by a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scaling {
    /// The centre.
    #[default]
    Symmetric,
    /// The other face; of a number that is typed, the low one.
    OppositeFace,
}

impl Scaling {
    pub fn other(self) -> Scaling {
        match self {
            Scaling::Symmetric => Scaling::OppositeFace,
            Scaling::OppositeFace => Scaling::Symmetric,
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            view: View::default(),
            snap: Snap::default(),
            scaling: Scaling::default(),
            axis: Axis::X,
        }
    }
}

/// P's commonest box.
pub const NEW_BOX: CloudBox =
    CloudBox { n_particles: 10, extent: DVec3::ONE, center: DVec3::ZERO, radius_max: 2.0 };

impl Editor {
    /// Nothing selected, nothing to undo.
    pub fn new(boxes: Vec<CloudBox>) -> Editor {
        Editor::of(Document::new(boxes), Settings::default())
    }

    pub fn of(document: Document, settings: Settings) -> Editor {
        let (selection, history) = (Selection::default(), History::default());
        Editor { document: document.into(), selection, settings, history, drag: None }
    }

    /// The state after an action, and the boxes whose particles are touched by it. An error changes
    /// nothing: an action that the box file's reader would not let pass, or one that does not fit
    /// into a drag that is under way.
    pub fn after(&self, action: &Action) -> Result<(Editor, Touched), Refusal> {
        let next = match action {
            Action::Drag(drag) => self.dragged(drag)?,
            Action::Set(setting) => self.set(*setting)?,
            _ if self.drag.is_some() => {
                return Err(Refusal("a drag is under way: end or cancel it first".to_owned()));
            }
            Action::Edit(edit) => self.edited(edit)?,
            Action::Select(select) => Editor { selection: self.selected(select)?, ..self.clone() },
            Action::Undo => self.travelled(History::undo),
            Action::Redo => self.travelled(History::redo),
        };
        let touched = Touched::between(&self.document, &next.document);
        Ok((next, touched))
    }

    fn snapshot(&self) -> Snapshot {
        Snapshot { document: self.document.clone(), selection: self.selection.clone() }
    }

    fn edited(&self, edit: &Edit) -> Result<Editor, Refusal> {
        let (document, selection) = edited(&self.document, &self.selection, &self.settings, edit)?;
        document.check(&self.document)?;
        // What changes nothing is no step, and loses no redo.
        if document.is_same(&self.document) {
            return Ok(self.clone());
        }
        let mut next = Editor { document: document.into(), selection, ..self.clone() };
        next.history.push(self.snapshot(), edit.label());
        Ok(next)
    }

    fn travelled(&self, way: impl Fn(&mut History, Snapshot) -> Option<Snapshot>) -> Editor {
        let mut next = self.clone();
        if let Some(Snapshot { document, selection }) = way(&mut next.history, self.snapshot()) {
            next.document = document;
            next.selection = selection;
        }
        next
    }

    fn selected(&self, select: &Select) -> Result<Selection, Refusal> {
        let n = self.document.boxes.len();
        Ok(match select {
            Select::Boxes { boxes, how } => {
                if let Some(i) = boxes.iter().find(|i| **i >= n) {
                    return Err(Refusal(format!("box: expected a number below {n}, found {i}")));
                }
                self.selection.with(boxes, *how)
            }
            // The active one stays so.
            Select::All => Selection::new((0..n).chain(self.selection.active())),
            Select::None => Selection::default(),
            Select::Next => self.selection.neighbour(n, 1),
            Select::Previous => self.selection.neighbour(n, -1),
        })
    }

    fn set(&self, setting: Setting) -> Result<Editor, Refusal> {
        let mut next = self.clone();
        let settings = &mut next.settings;
        match setting {
            Setting::View(view) => settings.view = view,
            Setting::Snap(snap) if !snap.is_possible() => {
                return Err(Refusal(format!(
                    "grid step: expected a number above 0, found {}",
                    snap.step
                )));
            }
            Setting::Snap(snap) => settings.snap = snap,
            Setting::Scaling(scaling) => settings.scaling = scaling,
            Setting::Axis(axis) => settings.axis = axis,
        }
        Ok(next)
    }
}

/// What can be seen of the state.
impl Editor {
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Shared, for who keeps it beyond the next action.
    pub fn shared_document(&self) -> Arc<Document> {
        self.document.clone()
    }

    pub fn boxes(&self) -> &[CloudBox] {
        &self.document.boxes
    }

    pub fn selection(&self) -> &Selection {
        &self.selection
    }

    /// The box that was selected last, drawn red (P, Fig. 3).
    pub fn active_box(&self) -> Option<(usize, &CloudBox)> {
        let i = self.selection.active()?;
        Some((i, self.document.boxes.get(i)?))
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    pub fn history(&self) -> &History {
        &self.history
    }

    /// What the hand holds.
    pub fn dragged_handle(&self) -> Option<Handle> {
        self.drag.as_ref().map(Drag::handle)
    }

    /// Those of the active box.
    pub fn handles(&self, view: &Viewport) -> Vec<Placed> {
        self.active_box().map_or_else(Vec::new, |(_, b)| placed(b, view))
    }

    /// A box to [`Edit::Add`] at a place, which goes to the grid where snapping is on. It is like
    /// the active box where there is one.
    pub fn new_box(&self, place: DVec3) -> CloudBox {
        let snap = self.settings.snap;
        let center = if snap.on { snap.place(place) } else { place };
        CloudBox { center, ..self.active_box().map_or(NEW_BOX, |(_, b)| *b) }
    }

    /// Least and greatest coordinates of what is selected, of everything where nothing is: what to
    /// look at.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        if self.selection.is_empty() {
            return bounds(self.boxes());
        }
        bounds(self.selection.boxes().iter().filter_map(|i| self.boxes().get(*i)))
    }
}

#[cfg(test)]
mod tests;
