//! What a list of times says: a summary, and how sure the median or a ratio of medians is.
//!
//! Percentiles are linear interpolations between order statistics ("type 7" of Hyndman and Fan 1996, the default of
//! NumPy and R): the p-th of n sorted values lies at position (n − 1) p counted from 0. Values that are not finite
//! are counted and left out, never averaged in.

use serde::{Deserialize, Serialize};

/// All in the unit of the values. `sd` divides by n − 1; a single value has none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Finite values.
    pub n: usize,
    /// Values left out because they are NaN or infinite.
    pub n_not_finite: usize,
    pub mean: f64,
    pub sd: Option<f64>,
    pub min: f64,
    pub p1: f64,
    pub p5: f64,
    pub p50: f64,
    pub p95: f64,
    pub p99: f64,
    pub max: f64,
}

impl Summary {
    /// None when no value is finite.
    pub fn of(values: &[f64]) -> Option<Summary> {
        let sorted = sorted_finite(values);
        let (&min, &max) = (sorted.first()?, sorted.last()?);
        let mean = mean(&sorted);
        let at = |p| percentile_of_sorted(&sorted, p);
        Some(Summary {
            n: sorted.len(),
            n_not_finite: values.len() - sorted.len(),
            mean,
            sd: Some(standard_deviation(&sorted, mean)).filter(|sd| sd.is_finite()),
            min,
            p1: at(0.01),
            p5: at(0.05),
            p50: at(0.50),
            p95: at(0.95),
            p99: at(0.99),
            max,
        })
    }
}

/// The `p`-th percentile, p in [0, 1], of the finite values; None when there is none.
pub fn percentile(values: &[f64], p: f64) -> Option<f64> {
    let sorted = sorted_finite(values);
    if sorted.is_empty() { None } else { Some(percentile_of_sorted(&sorted, p)) }
}

pub fn median(values: &[f64]) -> Option<f64> {
    percentile(values, 0.5)
}

fn sorted_finite(values: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// `sorted` holds at least one value.
fn percentile_of_sorted(sorted: &[f64], p: f64) -> f64 {
    let position = (sorted.len() - 1) as f64 * p.clamp(0.0, 1.0);
    let below = position.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (position - below as f64) * (sorted[above] - sorted[below])
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Two passes: E[x²] − E[x]² loses every digit when the spread is small beside the mean, as frame times are.
fn standard_deviation(values: &[f64], mean: f64) -> f64 {
    let sum_of_squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    if values.len() < 2 { f64::NAN } else { (sum_of_squares / (values.len() - 1) as f64).sqrt() }
}

/// A figure and its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    pub estimate: f64,
    pub low: f64,
    pub high: f64,
}

/// The percentile bootstrap (Efron 1979), deterministic in its seed. Neighbouring frames are alike, and resampling
/// them one by one would give an interval that is too narrow; so runs of `block_len` neighbours are resampled
/// together (circular block bootstrap, Politis and Romano 1992). A `block_len` of 1 is the ordinary bootstrap, right
/// for values that do not depend on one another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bootstrap {
    pub n_resamples: usize,
    pub block_len: usize,
    pub seed: u64,
}

/// 2000 resamples leave 50 beyond each end of the interval, so that an end is known to about a tenth of its width.
impl Default for Bootstrap {
    fn default() -> Self {
        Bootstrap { n_resamples: 2000, block_len: 1, seed: 0 }
    }
}

const INTERVAL_LOW: f64 = 0.025;
const INTERVAL_HIGH: f64 = 0.975;

impl Bootstrap {
    /// The median of the finite values. None when there is none or no resample was asked for.
    pub fn median(&self, values: &[f64]) -> Option<Interval> {
        let values = finite(values);
        let estimate = median(&values)?;
        let mut random = SplitMix64(self.seed);
        let mut scratch = Vec::with_capacity(values.len());
        self.interval(estimate, || self.resampled_median(&values, &mut scratch, &mut random))
    }

    /// median(numerator) / median(denominator), each resampled on its own. None when either holds no finite value.
    /// A denominator whose median is not above zero has no ratio: None as well.
    pub fn ratio_of_medians(&self, numerator: &[f64], denominator: &[f64]) -> Option<Interval> {
        let (numerator, denominator) = (finite(numerator), finite(denominator));
        let (top, bottom) = (median(&numerator)?, median(&denominator)?);
        if bottom <= 0.0 {
            return None;
        }
        let mut random = SplitMix64(self.seed);
        let mut scratch = Vec::with_capacity(numerator.len().max(denominator.len()));
        self.interval(top / bottom, || {
            let top = self.resampled_median(&numerator, &mut scratch, &mut random);
            top / self.resampled_median(&denominator, &mut scratch, &mut random)
        })
    }

    fn interval(&self, estimate: f64, mut resampled: impl FnMut() -> f64) -> Option<Interval> {
        let estimates: Vec<f64> = (0..self.n_resamples).map(|_| resampled()).collect();
        Some(Interval {
            estimate,
            low: percentile(&estimates, INTERVAL_LOW)?,
            high: percentile(&estimates, INTERVAL_HIGH)?,
        })
    }

    /// `values` is not empty and all finite. The order is the order in time: blocks are runs of it, and wrap around.
    fn resampled_median(&self, values: &[f64], scratch: &mut Vec<f64>, random: &mut SplitMix64) -> f64 {
        let n = values.len();
        let block_len = self.block_len.clamp(1, n);
        scratch.clear();
        while scratch.len() < n {
            let start = random.below(n);
            let wanted = block_len.min(n - scratch.len());
            scratch.extend((0..wanted).map(|i| values[(start + i) % n]));
        }
        // Selection, not a sort: this runs thousands of times.
        let (lower_part, &mut upper, _) = scratch.select_nth_unstable_by(n / 2, f64::total_cmp);
        if n % 2 == 1 {
            return upper;
        }
        let lower = lower_part.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        lower + 0.5 * (upper - lower)
    }
}

fn finite(values: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|value| value.is_finite()).collect()
}

/// Steele, Lea and Flood 2014. Its own, because this room imports nothing of ours.
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, n) by the high half of a product; the bias is below n / 2⁶⁴.
    fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.next()) * n as u128) >> 64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Standard normal values by Box and Muller.
    fn normal(random: &mut SplitMix64, n: usize) -> Vec<f64> {
        let mut uniform = || (random.next() >> 11) as f64 / (1u64 << 53) as f64;
        (0..n).map(|_| (-2.0 * (1.0 - uniform()).ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()).collect()
    }

    #[test]
    fn splitmix_gives_the_published_sequence() {
        // The first outputs for seed 1234567 (Rosetta Code, "Pseudo-random numbers/Splitmix64").
        let mut random = SplitMix64(1_234_567);
        assert_eq!(random.next(), 6_457_827_717_110_365_317);
        assert_eq!(random.next(), 3_203_168_211_198_807_973);
    }

    #[test]
    fn hand_worked_summary() {
        let summary = Summary::of(&[4.0, 1.0, 3.0, 2.0]).unwrap();
        assert_eq!((summary.n, summary.min, summary.max, summary.mean), (4, 1.0, 4.0, 2.5));
        // Squares of −1.5, −0.5, 0.5, 1.5 sum to 5; 5 / 3.
        assert_eq!(summary.sd, Some((5.0_f64 / 3.0).sqrt()));
        // Positions 3p: 0.03, 0.15, 1.5, 2.85, 2.97. Half an ulp each way of the product.
        let expected = [1.03, 1.15, 2.5, 3.85, 3.97];
        for (got, want) in [summary.p1, summary.p5, summary.p50, summary.p95, summary.p99].iter().zip(expected) {
            assert!((got - want).abs() < 1e-15 * 4.0, "{got} for {want}");
        }
    }

    #[test]
    fn percentiles_of_zero_to_hundred_are_themselves() {
        let values: Vec<f64> = (0..=100).rev().map(f64::from).collect();
        for (p, want) in [(0.0, 0.0), (0.01, 1.0), (0.5, 50.0), (0.95, 95.0), (0.99, 99.0), (1.0, 100.0)] {
            assert!((percentile(&values, p).unwrap() - want).abs() < 1e-12);
        }
    }

    #[test]
    fn one_value_has_no_spread_and_none_has_no_summary() {
        let one = Summary::of(&[7.0]).unwrap();
        assert_eq!(one.sd, None);
        assert_eq!((one.p1, one.p50, one.p99), (7.0, 7.0, 7.0));
        assert_eq!(Summary::of(&[]), None);
        assert_eq!(Summary::of(&[f64::NAN]), None);
    }

    #[test]
    fn what_is_not_finite_is_counted_and_left_out() {
        let summary = Summary::of(&[1.0, f64::NAN, 3.0, f64::INFINITY]).unwrap();
        assert_eq!((summary.n, summary.n_not_finite, summary.mean, summary.max), (2, 2, 2.0, 3.0));
    }

    #[test]
    fn a_small_spread_on_a_large_mean_survives() {
        // E[x²] − E[x]² in f64 would give 0 or a negative number here.
        let summary = Summary::of(&[1e9, 1e9 + 1.0, 1e9 + 2.0]).unwrap();
        assert_eq!(summary.sd, Some(1.0));
    }

    #[test]
    fn normal_percentiles_are_where_they_should_be() {
        let summary = Summary::of(&normal(&mut SplitMix64(3), 100_000)).unwrap();
        // Five standard errors: sqrt(p (1 − p) / n) / density, 0.0040 at the median and 0.0118 at p1 and p99.
        assert!(summary.p50.abs() < 5.0 * 0.0040);
        assert!((summary.p99 - 2.3263).abs() < 5.0 * 0.0118 && (summary.p1 + 2.3263).abs() < 5.0 * 0.0118);
        // The standard error of a normal sample's sd is sd / sqrt(2n) = 0.0022.
        assert!(summary.sd.is_some_and(|sd| (sd - 1.0).abs() < 5.0 * 0.0022));
    }

    #[test]
    fn the_bootstrap_repeats_and_its_seed_matters() {
        let values = normal(&mut SplitMix64(5), 101);
        // Few resamples: the ends of many are order statistics of the sample, which two seeds may well share.
        let bootstrap = Bootstrap { n_resamples: 10, ..Bootstrap::default() };
        let first = bootstrap.median(&values).unwrap();
        assert_eq!(Some(first), bootstrap.median(&values));
        assert_ne!(Some(first), Bootstrap { seed: 1, ..bootstrap }.median(&values));
        assert!(first.low <= first.estimate && first.estimate <= first.high);
        assert_eq!(Some(first.estimate), median(&values));
    }

    #[test]
    fn constant_values_leave_no_doubt() {
        let ratio = Bootstrap::default().ratio_of_medians(&[3.0; 8], &[2.0; 5]).unwrap();
        assert_eq!((ratio.estimate, ratio.low, ratio.high), (1.5, 1.5, 1.5));
        assert_eq!(Bootstrap::default().ratio_of_medians(&[1.0], &[0.0]), None);
        assert_eq!(Bootstrap::default().median(&[f64::NAN]), None);
    }

    /// How many of `n_trials` intervals hold the truth.
    fn coverage(n_trials: usize, mut holds: impl FnMut(u64) -> bool) -> f64 {
        (0..n_trials as u64).filter(|&seed| holds(seed)).count() as f64 / n_trials as f64
    }

    #[test]
    fn the_interval_covers_the_truth_about_as_often_as_it_says() {
        // 95 % nominal; the standard error over 400 trials is 1.1 %, and the percentile bootstrap of a median is known
        // to be a little off at n = 60. Outside 91–99 % it would be wrong, not unlucky.
        let mut random = SplitMix64(11);
        let of_median = coverage(400, |seed| {
            let values = normal(&mut random, 60);
            let interval = Bootstrap { n_resamples: 400, block_len: 1, seed }.median(&values).unwrap();
            interval.low <= 0.0 && 0.0 <= interval.high
        });
        assert!((0.91..=0.99).contains(&of_median), "{of_median}");
        let of_ratio = coverage(400, |seed| {
            let slow: Vec<f64> = normal(&mut random, 60).iter().map(|z| 20.0 + z).collect();
            let fast: Vec<f64> = normal(&mut random, 60).iter().map(|z| 10.0 + z).collect();
            let bootstrap = Bootstrap { n_resamples: 400, block_len: 1, seed };
            let interval = bootstrap.ratio_of_medians(&slow, &fast).unwrap();
            interval.low <= 2.0 && 2.0 <= interval.high
        });
        assert!((0.91..=0.99).contains(&of_ratio), "{of_ratio}");
    }

    #[test]
    fn blocks_widen_the_interval_of_correlated_values() {
        // First-order autoregression with ρ = 0.9: the true interval is wider by about sqrt((1 + ρ)/(1 − ρ)) = 4.4.
        let mut values = normal(&mut SplitMix64(13), 2000);
        for i in 1..values.len() {
            values[i] += 0.9 * values[i - 1];
        }
        let width = |block_len| {
            let interval = Bootstrap { block_len, ..Bootstrap::default() }.median(&values).unwrap();
            interval.high - interval.low
        };
        assert!(width(50) > 2.0 * width(1), "{} against {}", width(50), width(1));
    }
}
