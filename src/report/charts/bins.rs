//! Long runs drawn honestly: of neighbouring frames the least, the middle and the greatest, and
//! none left out.

use std::ops::RangeInclusive;

use crate::measure::stats::median;

/// Frames `first` to `last`, and every time that was taken of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    pub first: u32,
    pub last: u32,
    pub min: f64,
    pub median: f64,
    pub max: f64,
    pub n: usize,
}

impl Bin {
    pub fn middle(&self) -> f64 {
        0.5 * (f64::from(self.first) + f64::from(self.last))
    }
}

/// Of (frame, ms) pairs in any order, `n_most` bins at most of equally many frames of `range`.
/// Where there is room for all, a frame is a bin. What is not finite is left out; a bin without a
/// time is not there.
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
        Some(Bin {
            first: first as u32,
            last: last as u32,
            min: times.iter().copied().fold(f64::INFINITY, f64::min),
            median: median(&times)?,
            max: times.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            n: times.len(),
        })
    };
    times.into_iter().enumerate().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_frame_is_lost() {
        // One slow frame among a thousand shows as the greatest of its bin.
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
    fn a_frame_of_two_blocks_is_one_bin_of_two() {
        let found = bins(&[(4, 1.0), (5, 7.0), (4, 3.0), (5, f64::NAN), (9, 1.0)], 4..=6, 10);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].min, found[0].median, found[0].max, found[0].n), (1.0, 2.0, 3.0, 2));
        assert_eq!((found[1].median, found[1].n, found[1].middle()), (7.0, 1, 5.0));
        assert_eq!(bins(&[], 0..=0, 5), []);
        // The greatest number there is overflows nothing.
        assert_eq!(bins(&[(u32::MAX, 1.0)], 0..=u32::MAX, 3).len(), 1);
    }
}
