//! Frame times of long runs, summarised over neighbouring frames by minimum, median and maximum.

use std::ops::RangeInclusive;

use crate::measure::stats::{extremes, median};

/// The summary of the times of frames `first` to `last`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// First frame.
    pub first: u32,
    /// Last frame.
    pub last: u32,
    /// Smallest time, ms.
    pub min: f64,
    /// Median time, ms.
    pub median: f64,
    /// Largest time, ms.
    pub max: f64,
    /// Number of times.
    pub n: usize,
}

impl Bin {
    /// Returns the middle of the frames.
    pub fn middle(&self) -> f64 {
        0.5 * (f64::from(self.first) + f64::from(self.last))
    }
}

/// Summarises (frame, ms) pairs in at most `n_most` bins of equally many frames of `range`. Times
/// that are not finite are ignored, and bins without times are left out.
pub fn bins(samples: &[(u32, f64)], range: RangeInclusive<u32>, n_most: usize) -> Vec<Bin> {
    let n_frames = u64::from(range.end().saturating_sub(*range.start())) + 1;
    let width = n_frames.div_ceil(n_most.max(1) as u64).max(1);
    let n_bins = n_frames.div_ceil(width) as usize;
    let mut times: Vec<Vec<f64>> = vec![Vec::new(); n_bins];
    for (frame, ms) in samples.iter().filter(|(frame, ms)| ms.is_finite() && range.contains(frame))
    {
        times[(u64::from(frame - range.start()) / width) as usize].push(*ms);
    }
    let of = |(i, times): (usize, Vec<f64>)| {
        let first = u64::from(*range.start()) + i as u64 * width;
        let last = (first + width - 1).min(u64::from(*range.end()));
        let (min, max) = extremes(times.iter().copied())?;
        Some(Bin {
            first: first as u32,
            last: last as u32,
            min,
            median: median(&times)?,
            max,
            n: times.len(),
        })
    };
    times.into_iter().enumerate().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_slowest_frame_of_a_bin() {
        // One slow frame among a thousand is the maximum of its bin.
        let mut samples: Vec<(u32, f64)> = (0..1000).map(|i| (i, 1.0 + f64::from(i % 3))).collect();
        samples[617].1 = 99.0;
        let bins = bins(&samples, 0..=999, 100);
        assert_eq!((bins.len(), bins.iter().map(|b| b.n).sum::<usize>()), (100, 1000));
        assert_eq!(
            bins.iter().filter(|b| b.max == 99.0).map(|b| (b.first, b.last)).collect::<Vec<_>>(),
            [(610, 619)]
        );
        assert!(bins.iter().all(|b| b.min == 1.0 && (1.5..=2.5).contains(&b.median)));
    }

    #[test]
    fn a_frame_timed_twice_is_one_bin() {
        let found = bins(&[(4, 1.0), (5, 7.0), (4, 3.0), (5, f64::NAN), (9, 1.0)], 4..=6, 10);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].min, found[0].median, found[0].max, found[0].n), (1.0, 2.0, 3.0, 2));
        assert_eq!((found[1].median, found[1].n, found[1].middle()), (7.0, 1, 5.0));
        assert_eq!(bins(&[], 0..=0, 5), []);
        // The largest frame number does not overflow.
        assert_eq!(bins(&[(u32::MAX, 1.0)], 0..=u32::MAX, 3).len(), 1);
    }
}
