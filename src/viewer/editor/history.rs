//! Steps that can be undone and redone. A step keeps the whole document as it was: documents are
//! small beside what is drawn of them, and nothing has to be undone by arithmetic, which would not
//! give the same bits.

use std::collections::VecDeque;
use std::sync::Arc;

use super::document::Document;
use super::selection::Selection;

/// Steps that are kept at most.
pub const MOST_STEPS: usize = 1000;
/// What the kept documents may take, in bytes; the last step is kept however large.
pub const MOST_BYTES: usize = 256 << 20;

/// The document and what was selected of it.
#[derive(Debug, Clone)]
pub struct Snapshot {
    pub document: Arc<Document>,
    pub selection: Selection,
}

/// One state beside the present one, and what was done between the two.
#[derive(Debug, Clone)]
struct Step {
    snapshot: Snapshot,
    label: &'static str,
}

#[derive(Debug, Clone, Default)]
pub struct History {
    /// The latest last.
    undo: VecDeque<Step>,
    /// The next last.
    redo: Vec<Step>,
}

impl History {
    /// What was undone is forgotten, and so is the oldest where there is too much.
    pub(super) fn push(&mut self, before: Snapshot, label: &'static str) {
        self.redo.clear();
        self.undo.push_back(Step { snapshot: before, label });
        let mut n_bytes: usize = self.undo.iter().map(Step::n_bytes).sum();
        while self.undo.len() > 1 && (self.undo.len() > MOST_STEPS || n_bytes > MOST_BYTES) {
            n_bytes -= self.undo.pop_front().map_or(0, |step| step.n_bytes());
        }
    }

    /// The state before the last step; `now` is kept for [`History::redo`].
    pub(super) fn undo(&mut self, now: Snapshot) -> Option<Snapshot> {
        let step = self.undo.pop_back()?;
        self.redo.push(Step { snapshot: now, label: step.label });
        Some(step.snapshot)
    }

    pub(super) fn redo(&mut self, now: Snapshot) -> Option<Snapshot> {
        let step = self.redo.pop()?;
        self.undo.push_back(Step { snapshot: now, label: step.label });
        Some(step.snapshot)
    }

    /// What an undo would take back.
    pub fn undo_label(&self) -> Option<&'static str> {
        self.undo.back().map(|step| step.label)
    }

    pub fn redo_label(&self) -> Option<&'static str> {
        self.redo.last().map(|step| step.label)
    }

    pub fn n_undo(&self) -> usize {
        self.undo.len()
    }

    pub fn n_redo(&self) -> usize {
        self.redo.len()
    }
}

impl Step {
    fn n_bytes(&self) -> usize {
        let Snapshot { document, selection } = &self.snapshot;
        size_of_val(document.boxes.as_slice()) + size_of_val(selection.boxes())
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::document;
    use super::*;
    use crate::model::boxes::CloudBox;

    fn snapshot(document: &Arc<Document>) -> Snapshot {
        Snapshot { document: document.clone(), selection: Selection::default() }
    }

    #[test]
    fn no_more_steps_are_kept_than_there_is_room_for() {
        let mut history = History::default();
        let small = Arc::new(document(1));
        (0..MOST_STEPS + 5).for_each(|_| history.push(snapshot(&small), "move"));
        assert_eq!(history.n_undo(), MOST_STEPS);
        // Two of these are too much, and one by itself is kept.
        let n = (MOST_BYTES / size_of::<CloudBox>()) as u32 / 2 + 1;
        let large = Arc::new(document(n));
        history.push(snapshot(&large), "move");
        assert!(history.n_undo() > 1);
        history.push(snapshot(&large), "scale");
        assert_eq!((history.n_undo(), history.undo_label()), (1, Some("scale")));
    }
}
