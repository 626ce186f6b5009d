//! A document with its selection, which edits and drags change together.

use std::sync::Arc;

use glam::DVec3;

use super::document::Document;
use super::selection::Selection;
use super::viewport::bounds;
use crate::model::boxes::CloudBox;

/// A document and its selection.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// The document, shared with the history.
    pub document: Arc<Document>,
    /// The selected boxes of the document.
    pub selection: Selection,
}

impl Snapshot {
    /// Returns the boxes, to be changed.
    pub(super) fn boxes_mut(&mut self) -> &mut Vec<CloudBox> {
        &mut Arc::make_mut(&mut self.document).boxes
    }

    /// Changes every selected box. `change` gets its index, too.
    pub(super) fn each(&mut self, mut change: impl FnMut(usize, &mut CloudBox)) {
        let Snapshot { document, selection } = self;
        let boxes = &mut Arc::make_mut(document).boxes;
        selection.boxes().iter().for_each(|i| change(*i, &mut boxes[*i]));
    }

    /// Returns the selected boxes in the order of their selection.
    pub(super) fn selected(&self) -> impl Iterator<Item = &CloudBox> {
        self.selection.boxes().iter().filter_map(|i| self.document.boxes.get(*i))
    }

    /// Returns the middle of the selected boxes' bounds. For one box it is exactly its centre.
    pub(super) fn middle(&self) -> Option<DVec3> {
        if let [i] = self.selection.boxes() {
            return Some(self.document.boxes[*i].center);
        }
        let (low, high) = bounds(self.selected())?;
        Some(0.5 * (low + high))
    }
}
