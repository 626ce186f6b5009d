//! Sums over samples of a picture, their mean, and the order in which they are added: parts of a
//! picture sum to the same bits as the whole.

use super::error_estimate::root_mean_square;
use super::scene_light::RenderedPixels;

/// Number of values of a pixel in [`SampleSums`]: premultiplied linear R, G, B, A; the sum of their
/// squares; the quadrature error; the squared standard error of the random paths.
pub const N_VALUES: usize = 7;

/// Sums over samples. *Shape*: [pixel][[`N_VALUES`]].
#[derive(Debug, Clone, PartialEq)]
pub struct SampleSums {
    /// Number of samples summed.
    pub n_samples: u32,
    /// The sums.
    pub values: Vec<f64>,
}

/// A mean over samples.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanPicture {
    /// Premultiplied linear RGBA, in the order of the pixels.
    pub rgba: Vec<[f64; 4]>,
    /// Root mean square of the pixels' error estimates: quadrature, and one standard error of the
    /// mean.
    pub own_error: f64,
    /// Root mean square of the standard errors of all channels of all pixels, were the samples
    /// random: what they add to a picture's RMSE.
    pub random_error: f64,
    /// By pixel the variance of the mean, the sum over the channels, were the samples random.
    pub variances: Vec<f64>,
    /// Standard error of the mean over all pixels, were the samples random, as a share of it; 0 of
    /// a black picture.
    pub relative_error: f64,
}

impl SampleSums {
    pub(super) fn of_one(drawn: &RenderedPixels) -> SampleSums {
        let mut values = Vec::with_capacity(N_VALUES * drawn.rgba.len());
        for (rgba, error) in drawn.rgba.iter().zip(&drawn.errors) {
            let squares = rgba.iter().map(|v| v * v).sum();
            values.extend_from_slice(rgba);
            values.extend([squares, error.quadrature, error.chance * error.chance]);
        }
        SampleSums { n_samples: 1, values }
    }

    fn add(mut self, other: &SampleSums) -> SampleSums {
        self.values.iter_mut().zip(&other.values).for_each(|(a, b)| *a += b);
        self.n_samples += other.n_samples;
        self
    }

    /// Returns the mean of the samples with its error estimate.
    pub fn mean(&self) -> MeanPicture {
        let n = f64::from(self.n_samples);
        let rgba = |v: &[f64]| [v[0] / n, v[1] / n, v[2] / n, v[3] / n];
        // The spread of all channels together bounds that of each. Samples are spread more evenly
        // than random ones, so the mean is more accurate than this.
        let spread = |v: &[f64]| {
            let of_mean: f64 = rgba(v).iter().map(|c| c * c).sum();
            ((v[4] / n - of_mean).max(0.0) / (n - 1.0).max(1.0)).sqrt()
        };
        let error = |v: &[f64]| v[5] / n + spread(v).max(v[6].sqrt() / n);
        let pixels = || self.values.chunks_exact(N_VALUES);
        let sum = |k: usize| pixels().map(|v| v[k] / n).sum::<f64>();
        let all = (0..4).map(|k| sum(k).powi(2)).sum::<f64>().sqrt();
        let off = pixels().map(|v| spread(v).powi(2)).sum::<f64>().sqrt();
        MeanPicture {
            rgba: pixels().map(rgba).collect(),
            own_error: root_mean_square(pixels().map(error)),
            random_error: root_mean_square(pixels().map(|v| 0.5 * spread(v))),
            variances: pixels().map(|v| spread(v).powi(2)).collect(),
            relative_error: if all > 0.0 { off / all } else { 0.0 },
        }
    }

    /// Returns the values as f64 in little-endian order.
    pub fn bytes(&self) -> Vec<u8> {
        self.values.iter().flat_map(|v| v.to_le_bytes()).collect()
    }

    /// Reads sums from [`SampleSums::bytes`]; `None` if the length does not match.
    pub fn from_bytes(bytes: &[u8], n_pixels: usize, n_samples: u32) -> Option<SampleSums> {
        let value = |b: &[u8]| b.try_into().map(f64::from_le_bytes).ok();
        let is_whole = bytes.len() == 8 * N_VALUES * n_pixels;
        let values =
            is_whole.then(|| bytes.chunks_exact(8).map(value).collect::<Option<Vec<f64>>>())??;
        Some(SampleSums { n_samples, values })
    }
}

/// Sum of neighbouring ranges of samples as one fixed tree of pairs: (0 + 1) + (2 + 3), and so on.
/// Ranges whose length is a power of two, and that begin at a multiple of it, are nodes of that
/// tree. A sum put together from ranges in order therefore has the same bits as one that was never
/// cut. Rounding grows with the tree's height, not with the number of samples.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PairwiseSum {
    /// Sums of complete subtrees, each shorter than the one before it.
    open: Vec<SampleSums>,
}

impl PairwiseSum {
    /// Adds the next range. All ranges have one length, a power of two; the last may be shorter.
    pub fn push(&mut self, mut next: SampleSums) {
        while let Some(last) = self.open.pop_if(|last| last.n_samples == next.n_samples) {
            next = last.add(&next);
        }
        self.open.push(next);
    }

    /// Takes the sums of neighbouring ranges, the first from sample 0 on. `None` unless each has a
    /// power of two samples, less than the one before it. All have as many values.
    pub fn of_parts(open: Vec<SampleSums>) -> Option<PairwiseSum> {
        let is_shorter = |pair: &[SampleSums]| {
            pair[1].n_samples < pair[0].n_samples && pair[1].values.len() == pair[0].values.len()
        };
        let is_sum = open.iter().all(|part| part.n_samples.is_power_of_two())
            && open.windows(2).all(is_shorter);
        is_sum.then_some(PairwiseSum { open })
    }

    /// Returns the sums of neighbouring ranges, each shorter than the one before it.
    pub fn parts(&self) -> &[SampleSums] {
        &self.open
    }

    /// Returns the number of samples summed.
    pub fn n_samples(&self) -> u32 {
        self.open.iter().map(|part| part.n_samples).sum()
    }

    /// Returns the sum of all ranges if their number is a power of two: one complete tree.
    pub fn whole(&self) -> Option<&SampleSums> {
        if let [whole] = &self.open[..] { Some(whole) } else { None }
    }

    /// Returns the sum of all ranges; `None` if there were none.
    pub fn total(&self) -> Option<SampleSums> {
        let mut parts = self.open.iter().rev();
        let last = parts.next()?.clone();
        Some(parts.fold(last, SampleSums::add))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::philox::{philox4x32_10, uniform};

    fn sample(i: u32) -> SampleSums {
        // Of magnitudes so different that another order of additions shows.
        let words = philox4x32_10([7, 7], [i, 0, 0, 0]).map(uniform);
        let values = (0..N_VALUES)
            .map(|k| (words[k % 4] - 0.5) * 10f64.powi((words[(k + 1) % 4] * 17.0) as i32));
        SampleSums { n_samples: 1, values: values.collect() }
    }

    fn summed(parts: impl Iterator<Item = SampleSums>) -> SampleSums {
        let mut pairs = PairwiseSum::default();
        parts.for_each(|part| pairs.push(part));
        pairs.total().unwrap()
    }

    #[test]
    fn ranges_of_a_power_of_two_sum_to_the_bits_of_the_whole() {
        let mut n_differ = 0;
        for n in 1..=70u32 {
            let whole = summed((0..n).map(sample));
            for length in [1u32, 2, 4, 8, 16, 32, 64, 128] {
                let range = |k: u32| summed((k * length..n.min((k + 1) * length)).map(sample));
                assert_eq!(
                    summed((0..n.div_ceil(length)).map(range)),
                    whole,
                    "{n} in ranges of {length}"
                );
            }
            // So it has where it was put away on the way, and taken up again.
            let mut pairs = PairwiseSum::default();
            (0..n / 3).for_each(|i| pairs.push(sample(i)));
            let mut again = PairwiseSum::of_parts(pairs.parts().to_vec()).unwrap();
            assert_eq!(again.n_samples(), n / 3);
            (n / 3..n).for_each(|i| again.push(sample(i)));
            assert_eq!(again.total().unwrap(), whole);
            // One after another they are not the same bits, and neither are ranges of three.
            let in_turn = (0..n).map(sample).reduce(|a, b| a.add(&b)).unwrap();
            n_differ += usize::from(in_turn != whole);
            assert_eq!(in_turn.n_samples, whole.n_samples);
        }
        assert!(n_differ > 50, "{n_differ}");
    }

    #[test]
    fn means_and_their_errors_by_hand() {
        // Red 1 and 3: mean 2, squares 10, variance of the mean ((10/2) - 4)/1 = 1. Quadrature
        // 0.25.
        let of = |red: f64, chance: f64| SampleSums {
            n_samples: 1,
            values: vec![red, 0.0, 0.0, 0.0, red * red, 0.25, chance * chance],
        };
        let two = of(1.0, 0.0).add(&of(3.0, 0.0));
        let mean = MeanPicture {
            rgba: vec![[2.0, 0.0, 0.0, 0.0]],
            own_error: 1.25,
            random_error: 0.5,
            variances: vec![1.0],
            relative_error: 0.5,
        };
        assert_eq!(two.mean(), mean);
        // One sample has its own standard error alone; equal ones have what their paths say:
        // sqrt(0.5)/2 · 0.6.
        assert_eq!(of(1.0, 0.5).mean().own_error, 0.75);
        let equal = of(1.0, 0.6).add(&of(1.0, 0.6)).mean().own_error;
        assert!((equal - 0.25 - 0.6 / 2f64.sqrt()).abs() < 1e-15, "{equal}");
        let bytes = two.bytes();
        assert_eq!(SampleSums::from_bytes(&bytes, 1, 2), Some(two));
        assert_eq!(
            (SampleSums::from_bytes(&bytes, 2, 2), SampleSums::from_bytes(&bytes[1..], 1, 2)),
            (None, None)
        );
    }
}
