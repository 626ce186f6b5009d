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

    /// Returns the box after the active one, or the one before it, alone. The list of `n` boxes is
    /// cyclic. Without an active box it is the first box forwards, and the last one backwards.
    pub(super) fn neighbour(&self, n: usize, is_forward: bool) -> Selection {
        let i = match (self.active(), is_forward) {
            _ if n == 0 => return Selection::default(),
            (Some(i), true) => (i + 1) % n,
            (None, true) => 0,
            (active, false) => active.filter(|i| *i > 0).unwrap_or(n) - 1,
        };
        Selection::new([i])
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
        let of = |boxes: &[usize], is_forward| {
            Selection::new(boxes.iter().copied()).neighbour(3, is_forward).active()
        };
        let [after, before] = [true, false].map(|way| move |boxes: &[usize]| of(boxes, way));
        assert_eq!([after(&[]), after(&[0, 2]), after(&[1])], [Some(0), Some(0), Some(2)]);
        assert_eq!([before(&[]), before(&[0]), before(&[2])], [Some(2), Some(2), Some(1)]);
        assert_eq!(Selection::new([1]).neighbour(0, true), Selection::default());
    }
}
