//! The numbers of submissions of a device that ended, and of those that did nothing.

use std::sync::atomic::{AtomicU64, Ordering};

/// The numbers of submissions that ended.
#[derive(Debug, Default)]
pub struct Executed {
    n: AtomicU64,
    n_missed: AtomicU64,
}

impl Executed {
    /// Counts a submission that ended, and whether the device did its work.
    pub fn add(&self, is_done: bool) {
        self.n.fetch_add(1, Ordering::Relaxed);
        self.n_missed.fetch_add(u64::from(!is_done), Ordering::Relaxed);
    }

    /// Returns the number of submissions that ended, and of those that did nothing.
    pub fn counts(&self) -> (u64, u64) {
        (self.n.load(Ordering::Relaxed), self.n_missed.load(Ordering::Relaxed))
    }
}
