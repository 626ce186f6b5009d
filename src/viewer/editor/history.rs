//! Undo and redo.
//!
//! A step keeps the whole document as it was. Documents are small beside the particles drawn from
//! them, and undoing by arithmetic would not restore every bit.

use std::collections::VecDeque;

use super::snapshot::Snapshot;

/// Largest number of steps that are kept: more than a user takes back one by one.
pub const MAX_STEPS: usize = 1000;
/// Largest size of the kept documents, bytes: over ten of the largest documents, and little beside
/// a computer's memory. The last step is kept whatever its size.
pub const MAX_BYTES: usize = 256 << 20;

/// A state next to the present one, and the name of the change between them.
#[derive(Debug, Clone)]
struct Step {
    snapshot: Snapshot,
    label: &'static str,
}

/// Steps that can be undone and redone.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// The latest step is last.
    undo: VecDeque<Step>,
    /// The next step is last.
    redo: VecDeque<Step>,
}

impl History {
    /// Adds a step. Undone steps are dropped, and the oldest steps beyond the limits.
    pub(super) fn push(&mut self, before: Snapshot, label: &'static str) {
        self.redo.clear();
        self.undo.push_back(Step { snapshot: before, label });
        let mut n_bytes: usize = self.undo.iter().map(Step::n_bytes).sum();
        while self.undo.len() > 1 && (self.undo.len() > MAX_STEPS || n_bytes > MAX_BYTES) {
            n_bytes -= self.undo.pop_front().map_or(0, |step| step.n_bytes());
        }
    }

    /// Returns the state before the last step, and keeps `now` for [`History::redo`].
    pub(super) fn undo(&mut self, now: Snapshot) -> Option<Snapshot> {
        travel(&mut self.undo, &mut self.redo, now)
    }

    /// Returns the state after the step that was undone last, and keeps `now` for
    /// [`History::undo`].
    pub(super) fn redo(&mut self, now: Snapshot) -> Option<Snapshot> {
        travel(&mut self.redo, &mut self.undo, now)
    }

    /// Returns the name of the step that an undo takes back.
    pub fn undo_label(&self) -> Option<&'static str> {
        self.undo.back().map(|step| step.label)
    }

    /// Returns the name of the step that a redo repeats.
    pub fn redo_label(&self) -> Option<&'static str> {
        self.redo.back().map(|step| step.label)
    }

    /// Returns the number of steps that can be undone.
    pub fn n_undo(&self) -> usize {
        self.undo.len()
    }

    /// Returns the number of steps that can be redone.
    pub fn n_redo(&self) -> usize {
        self.redo.len()
    }
}

/// Takes the last step of `from`, and puts the same step with the state `now` at the end of `to`.
fn travel(from: &mut VecDeque<Step>, to: &mut VecDeque<Step>, now: Snapshot) -> Option<Snapshot> {
    let Step { snapshot, label } = from.pop_back()?;
    to.push_back(Step { snapshot: now, label });
    Some(snapshot)
}

impl Step {
    fn n_bytes(&self) -> usize {
        let Snapshot { document, selection } = &self.snapshot;
        size_of_val(document.boxes.as_slice()) + size_of_val(selection.boxes())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::document::Document;
    use super::super::fixtures::document;
    use super::super::selection::Selection;
    use super::*;
    use crate::model::boxes::CloudBox;

    fn snapshot(document: &Arc<Document>) -> Snapshot {
        Snapshot { document: document.clone(), selection: Selection::default() }
    }

    #[test]
    fn the_oldest_steps_beyond_the_limits_are_dropped() {
        let mut history = History::default();
        let small = Arc::new(document(1));
        (0..MAX_STEPS + 5).for_each(|_| history.push(snapshot(&small), "move"));
        assert_eq!(history.n_undo(), MAX_STEPS);
        // Two of these exceed the limit; one alone is kept.
        let n = (MAX_BYTES / size_of::<CloudBox>()) as u32 / 2 + 1;
        let large = Arc::new(document(n));
        history.push(snapshot(&large), "move");
        assert!(history.n_undo() > 1);
        history.push(snapshot(&large), "scale");
        assert_eq!((history.n_undo(), history.undo_label()), (1, Some("scale")));
    }
}
