//! The selected boxes. The box that was selected last is active: it is drawn red (P, Fig. 3), has
//! the handles, and its numbers are in the panel.

use std::collections::HashSet;
use std::sync::Arc;

/// Indices of boxes in the order of their selection, each once.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Selection {
    /// Shared with the history.
    boxes: Arc<[usize]>,
}

/// The effect of a selection on the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SelectionMode {
    /// Selects the boxes alone.
    Replace,
    /// Selects the boxes, too.
    Add,
    /// Selects the boxes that are not selected, and deselects the others.
    Toggle,
    /// Deselects the boxes.
    Remove,
}

impl Selection {
    /// Creates a selection whose last box is active. The last occurrence of a box counts.
    pub fn new(boxes: impl IntoIterator<Item = usize>) -> Self {
        let mut boxes: Vec<usize> = boxes.into_iter().collect();
        boxes.reverse();
        let mut seen = HashSet::new();
        boxes.retain(|i| seen.insert(*i));
        boxes.reverse();
        Selection { boxes: boxes.into() }
    }

    /// Returns the boxes in the order of their selection; the active one is last.
    pub fn boxes(&self) -> &[usize] {
        &self.boxes
    }

    /// Returns the active box.
    pub fn active(&self) -> Option<usize> {
        self.boxes.last().copied()
    }

    /// Returns whether no box is selected.
    pub fn is_empty(&self) -> bool {
        self.boxes.is_empty()
    }

    /// Returns whether box `i` is selected.
    pub fn contains(&self, i: usize) -> bool {
        self.boxes.contains(&i)
    }

    /// Returns for each of `n` boxes whether it is selected.
    pub fn mask(&self, n: usize) -> Vec<bool> {
        let mut mask = vec![false; n];
        self.boxes.iter().filter(|i| **i < n).for_each(|i| mask[*i] = true);
        mask
    }

    /// Returns the selection after `boxes` were selected.
    pub(super) fn with(&self, boxes: &[usize], mode: SelectionMode) -> Selection {
        let old = || self.boxes.iter().copied();
        let named: HashSet<usize> = boxes.iter().copied().collect();
        match mode {
            SelectionMode::Replace => Selection::new(boxes.iter().copied()),
            SelectionMode::Add => Selection::new(old().chain(boxes.iter().copied())),
            SelectionMode::Remove => Selection::new(old().filter(|i| !named.contains(i))),
            SelectionMode::Toggle => {
                let was: HashSet<usize> = old().collect();
                let kept = old().filter(|i| !named.contains(i));
                Selection::new(kept.chain(boxes.iter().copied().filter(|i| !was.contains(i))))
            }
        }
    }

    /// Returns the box `by` places after the active one, alone; the list of `n` boxes is cyclic.
    /// Without an active box it is the first one forwards, and the last one backwards.
    pub(super) fn neighbour(&self, n: usize, by: isize) -> Selection {
        let Ok(count) = isize::try_from(n) else { return Selection::default() };
        if count == 0 {
            return Selection::default();
        }
        let from = match self.active().and_then(|i| isize::try_from(i).ok()) {
            Some(i) => i,
            None if by > 0 => -1,
            None => 0,
        };
        Selection::new([(from + by).rem_euclid(count).unsigned_abs()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_selected_last_is_active() {
        let s = Selection::new([3, 1, 3, 2, 1]);
        assert_eq!((s.boxes(), s.active()), ([3, 2, 1].as_slice(), Some(1)));
        assert_eq!(s.with(&[5, 3], SelectionMode::Add).boxes(), [2, 1, 5, 3]);
        assert_eq!(s.with(&[1, 4], SelectionMode::Toggle).boxes(), [3, 2, 4]);
        assert_eq!(s.with(&[1], SelectionMode::Toggle).active(), Some(2));
        assert_eq!(s.with(&[3, 9], SelectionMode::Remove).boxes(), [2, 1]);
        assert_eq!(s.with(&[], SelectionMode::Replace).active(), None);
        assert_eq!(s.mask(3), [false, true, true]);
    }

    #[test]
    fn neighbours_are_cyclic() {
        let of =
            |boxes: &[usize], by| Selection::new(boxes.iter().copied()).neighbour(3, by).active();
        assert_eq!([of(&[], 1), of(&[0, 2], 1), of(&[1], 1)], [Some(0), Some(0), Some(2)]);
        assert_eq!([of(&[], -1), of(&[0], -1), of(&[2], -1)], [Some(2), Some(2), Some(1)]);
        assert_eq!(Selection::new([1]).neighbour(0, 1), Selection::default());
    }
}
