//! Which boxes an action goes to. The one that was selected last is active (P, Fig. 3: drawn red):
//! gizmos stand on it, and a panel shows its numbers.

use std::collections::HashSet;
use std::sync::Arc;

/// Numbers of boxes in the order they were selected in, each once.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Selection {
    /// Shared with the steps that can be undone.
    boxes: Arc<[usize]>,
}

/// What becomes of what was selected before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    Replace,
    Add,
    /// Those that are selected no longer are, those that are not become so.
    Toggle,
    Remove,
}

impl Selection {
    /// The last of `boxes` becomes active; one that is named twice counts where it is named last.
    pub fn new(boxes: impl IntoIterator<Item = usize>) -> Self {
        let mut boxes: Vec<usize> = boxes.into_iter().collect();
        boxes.reverse();
        let mut seen = HashSet::new();
        boxes.retain(|i| seen.insert(*i));
        boxes.reverse();
        Selection { boxes: boxes.into() }
    }

    /// In the order they were selected in, the active one last.
    pub fn boxes(&self) -> &[usize] {
        &self.boxes
    }

    pub fn active(&self) -> Option<usize> {
        self.boxes.last().copied()
    }

    pub fn is_empty(&self) -> bool {
        self.boxes.is_empty()
    }

    pub fn contains(&self, i: usize) -> bool {
        self.boxes.contains(&i)
    }

    /// Of each of `n` boxes whether it is selected.
    pub fn mask(&self, n: usize) -> Vec<bool> {
        let mut mask = vec![false; n];
        self.boxes.iter().filter(|i| **i < n).for_each(|i| mask[*i] = true);
        mask
    }

    pub(super) fn with(&self, boxes: &[usize], how: How) -> Selection {
        let old = || self.boxes.iter().copied();
        let named: HashSet<usize> = boxes.iter().copied().collect();
        match how {
            How::Replace => Selection::new(boxes.iter().copied()),
            How::Add => Selection::new(old().chain(boxes.iter().copied())),
            How::Remove => Selection::new(old().filter(|i| !named.contains(i))),
            How::Toggle => {
                let was: HashSet<usize> = old().collect();
                let kept = old().filter(|i| !named.contains(i));
                Selection::new(kept.chain(boxes.iter().copied().filter(|i| !was.contains(i))))
            }
        }
    }

    /// The box `by` places after the active one among `n`, alone; from none the first forwards and
    /// the last backwards.
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
    fn the_last_is_active_whatever_the_way() {
        let s = Selection::new([3, 1, 3, 2, 1]);
        assert_eq!((s.boxes(), s.active()), ([3, 2, 1].as_slice(), Some(1)));
        assert_eq!(s.with(&[5, 3], How::Add).boxes(), [2, 1, 5, 3]);
        assert_eq!(s.with(&[1, 4], How::Toggle).boxes(), [3, 2, 4]);
        assert_eq!(s.with(&[1], How::Toggle).active(), Some(2));
        assert_eq!(s.with(&[3, 9], How::Remove).boxes(), [2, 1]);
        assert_eq!(s.with(&[], How::Replace).active(), None);
        assert_eq!(s.mask(3), [false, true, true]);
    }

    #[test]
    fn neighbours_go_round() {
        let of =
            |boxes: &[usize], by| Selection::new(boxes.iter().copied()).neighbour(3, by).active();
        assert_eq!([of(&[], 1), of(&[0, 2], 1), of(&[1], 1)], [Some(0), Some(0), Some(2)]);
        assert_eq!([of(&[], -1), of(&[0], -1), of(&[2], -1)], [Some(2), Some(2), Some(1)]);
        assert_eq!(Selection::new([1]).neighbour(0, 1), Selection::default());
    }
}
