//! A count of the device-local memory that nimbus has allocated.

use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes in use, and the most since the last [`MemoryCount::take`].
#[derive(Debug, Default)]
pub(super) struct MemoryCount {
    bytes: AtomicU64,
    peak: AtomicU64,
}

impl MemoryCount {
    /// Counts an allocation.
    pub fn add(&self, bytes: u64) {
        let now = self.bytes.fetch_add(bytes, Ordering::Relaxed) + bytes;
        self.peak.fetch_max(now, Ordering::Relaxed);
    }

    /// Counts a freed allocation.
    pub fn remove(&self, bytes: u64) {
        self.bytes.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Returns the bytes in use, and the most since the call before.
    pub fn take(&self) -> (u64, u64) {
        let now = self.bytes.load(Ordering::Relaxed);
        (now, self.peak.swap(now, Ordering::Relaxed).max(now))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_counts_from_the_reading_before() {
        let count = MemoryCount::default();
        assert_eq!(count.take(), (0, 0));
        count.add(100);
        count.add(50);
        count.remove(100);
        assert_eq!(count.take(), (50, 150));
        assert_eq!(count.take(), (50, 50));
        count.add(10);
        assert_eq!(count.take(), (60, 60));
        count.remove(60);
        assert_eq!(count.take(), (0, 60));
    }
}
