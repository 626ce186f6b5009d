//! How sure a median, a ratio of medians, or any figure of lists of frames is.

use super::random::SplitMix64;
use super::stats::{finite, median_by_selection, percentile};

/// A figure and its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    pub estimate: f64,
    pub low: f64,
    pub high: f64,
}

/// The percentile bootstrap (Efron 1979), deterministic in its seed. Neighbouring frames are alike,
/// and resampling them one by one would give an interval that is too narrow; so runs of `block_len`
/// neighbours are resampled together (circular block bootstrap, Politis and Romano 1992). A
/// `block_len` of 1 is the ordinary bootstrap, right for values that do not depend on one another.
///
/// Its percentiles are then moved away from the estimate by two factors, both of which a bootstrap
/// of k = n/ℓ blocks of ℓ lacks, and without which it holds the truth too rarely:
///
/// - √(k/(k − 1)). A resample's mean is that of k block means B drawn from all n circular ones, so
///   that its variance is
///   (1/k) · mean (B − x̄)². That mean square is taken about the sample's own mean, not the true
///   one: mean (B − x̄)² =
///   mean (B − μ)² − (x̄ − μ)², in expectation var B − var x̄. Where values further apart than ℓ
///   depend little on one
///   another, var B = k var x̄, and what comes out is (1/k)(k − 1) var x̄, too small by 1 − 1/k. A
///   median is for many
///   values the mean of their influences, and inherits it.
/// - t/z: the 97.5th percentile of Student's distribution by that of the normal one. The spread is
///   itself estimated from k
///   blocks, and dividing by an estimate of k − 1 degrees of freedom makes Student's t of a normal
///   deviate. Several lists
///   bring the degrees of freedom of all, which is Welch's number where they vary alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bootstrap {
    pub n_resamples: usize,
    pub block_len: usize,
    pub seed: u64,
}

/// 2000 resamples leave 50 beyond each end of the interval, so that an end is known to about a
/// tenth of its width.
impl Default for Bootstrap {
    fn default() -> Self {
        Bootstrap { n_resamples: 2000, block_len: 1, seed: 0 }
    }
}

const INTERVAL_LOW: f64 = 0.025;
const INTERVAL_HIGH: f64 = 0.975;

impl Bootstrap {
    /// For frames in the order they ran, `n` of them: blocks of ⌈√n⌉. n^(1/3), which is best for
    /// faint correlation, is too short for a strong one. Of runs with realistic frame times
    /// (lognormal with 3 % noise under a first-order autoregression, one frame in twenty late) the
    /// interval of the ratio of medians held the truth, in % of 4000 trials:
    ///
    /// | n | ρ = 0 | 0.3 | 0.6 |
    /// |---|---|---|---|
    /// | 30 | 97.2 | 96.2 | 93.8 |
    /// | 60 | 96.6 | 95.8 | 93.7 |
    /// | 120 | 96.4 | 95.9 | 94.2 |
    /// | 240 | 96.1 | 95.5 | 94.1 |
    ///
    /// and that of one median 92.8 to 96.4 (`coverage_in_thousands_of_trials`).
    pub fn of_neighbours(n: usize) -> Self {
        let block_len = (n as f64).sqrt().ceil().max(1.0) as usize;
        Bootstrap { block_len, ..Bootstrap::default() }
    }

    /// Of any `statistic` of N lists of `n_rows`, each resampled on its own: it is handed the rows
    /// drawn from each, which are as many as there are. Columns of one list stay together that way.
    /// None when no resample was asked for, or the statistic is not finite for the lists themselves
    /// or for a single resample: what has no bound must not seem to have one. None as well where a
    /// list is no longer than a block: all its resamples are itself.
    pub fn interval<const N: usize>(
        &self,
        n_rows: [usize; N],
        mut statistic: impl FnMut(&[Vec<usize>; N]) -> f64,
    ) -> Option<Interval> {
        let widening = self.widening(&n_rows)?;
        let estimate = statistic(&n_rows.map(|n| (0..n).collect()));
        let mut random = SplitMix64(self.seed);
        let mut estimates = Vec::with_capacity(self.n_resamples);
        let mut drawn = n_rows.map(Vec::with_capacity);
        for _ in 0..self.n_resamples {
            for (rows, n) in drawn.iter_mut().zip(n_rows) {
                self.draw(n, rows, &mut random);
            }
            estimates.push(statistic(&drawn));
        }
        if !estimate.is_finite() || estimates.iter().any(|e| !e.is_finite()) {
            return None;
        }
        let (low, high) =
            (percentile(&estimates, INTERVAL_LOW)?, percentile(&estimates, INTERVAL_HIGH)?);
        Some(Interval {
            estimate,
            low: estimate - widening * (estimate - low),
            high: estimate + widening * (high - estimate),
        })
    }

    /// What the interval of lists of `n_rows` is widened by (see [`Bootstrap`]); of lists of
    /// different lengths by what the shortest needs. None where one is no longer than a block.
    fn widening(&self, n_rows: &[usize]) -> Option<f64> {
        let n_blocks = n_rows.iter().map(|&n| n as f64 / self.block_len.max(1) as f64);
        let least = n_blocks.clone().fold(f64::INFINITY, f64::min);
        let degrees = n_blocks.map(|k| k - 1.0).sum();
        (least > 1.0).then(|| (least / (least - 1.0)).sqrt() * student_by_normal(degrees))
    }

    /// The median of the finite values. None when there is none or no resample was asked for.
    pub fn median(&self, values: &[f64]) -> Option<Interval> {
        let values = finite(values);
        self.interval([values.len()], |[rows]| median_of_rows(&values, rows))
    }

    /// median(numerator) / median(denominator), each resampled on its own. None when either holds
    /// no finite value. A denominator whose median is not above zero, as it is or in a resample,
    /// has no ratio: None as well.
    pub fn ratio_of_medians(&self, numerator: &[f64], denominator: &[f64]) -> Option<Interval> {
        let (numerator, denominator) = (finite(numerator), finite(denominator));
        let mut ratio = self.interval([numerator.len(), denominator.len()], |[top, bottom]| {
            let bottom = median_of_rows(&denominator, bottom);
            if bottom > 0.0 { median_of_rows(&numerator, top) / bottom } else { f64::NAN }
        })?;
        // Of very few values the widened interval may reach below what any ratio of such values can
        // be.
        if numerator.iter().all(|value| *value >= 0.0) {
            ratio.low = ratio.low.max(0.0);
        }
        Some(ratio)
    }

    /// `n` rows of 0 … n − 1, which are in the order of time: blocks are runs of it, and wrap
    /// around.
    fn draw(&self, n: usize, rows: &mut Vec<usize>, random: &mut SplitMix64) {
        let block_len = self.block_len.clamp(1, n);
        rows.clear();
        while rows.len() < n {
            let start = random.below(n);
            let wanted = block_len.min(n - rows.len());
            rows.extend((0..wanted).map(|i| (start + i) % n));
        }
    }
}

/// The 97.5th percentile of Student's distribution by that of the normal one: Abramowitz and Stegun
/// 26.7.5, which is within 1 % from two degrees of freedom on and within 0.05 % from four.
fn student_by_normal(degrees: f64) -> f64 {
    const Z: f64 = 1.959_963_984_540_054;
    let (z2, v) = (Z * Z, degrees);
    let terms = [
        (z2 + 1.0) / 4.0,
        ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0,
        (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0,
        ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) / 92_160.0,
    ];
    1.0 + terms.iter().rev().fold(0.0, |sum, term| (sum + term) / v)
}

/// The median of `values` at `rows`; NaN for no row. The values are finite.
pub fn median_of_rows(values: &[f64], rows: &[usize]) -> f64 {
    let mut drawn: Vec<f64> = rows.iter().map(|&row| values[row]).collect();
    if drawn.is_empty() { f64::NAN } else { median_by_selection(&mut drawn) }
}

#[cfg(test)]
mod tests;
