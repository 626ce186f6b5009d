//! Statistics of a list of times.
//!
//! Percentiles are linear interpolations between order statistics ("type 7" of Hyndman and Fan
//! 1996, the default of NumPy and R): the p-th percentile of n sorted values lies at position
//! (n − 1) p, counted from 0. Values that are not finite are counted and left out.

use serde::{Deserialize, Serialize};

/// Statistics of a list of values, in the unit of the values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Number of finite values.
    pub n: usize,
    /// Number of values that are NaN or infinite and left out.
    pub n_not_finite: usize,
    /// Mean.
    pub mean: f64,
    /// Standard deviation with the divisor n − 1; none for a single value.
    pub sd: Option<f64>,
    /// Least value.
    pub min: f64,
    /// 1st percentile.
    pub p1: f64,
    /// 5th percentile.
    pub p5: f64,
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Greatest value.
    pub max: f64,
}

impl Summary {
    /// Computes the statistics; None if no value is finite.
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

/// Returns the percentile `p`, in [0, 1], of the finite values; None if there are none.
pub fn percentile(values: &[f64], p: f64) -> Option<f64> {
    let sorted = sorted_finite(values);
    if sorted.is_empty() { None } else { Some(percentile_of_sorted(&sorted, p)) }
}

/// Returns the median of the finite values; None if there are none.
pub fn median(values: &[f64]) -> Option<f64> {
    percentile(values, 0.5)
}

/// Returns the median by selection, which is faster than a sort for thousands of resamples.
/// `values` are finite and not empty; their order is lost.
pub(super) fn median_by_selection(values: &mut [f64]) -> f64 {
    let n = values.len();
    let (lower_part, &mut upper, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
    if n % 2 == 1 {
        return upper;
    }
    let lower = lower_part.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    lower + 0.5 * (upper - lower)
}

/// Returns the finite values in their order.
pub(super) fn finite(values: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|value| value.is_finite()).collect()
}

/// Returns the finite values in ascending order.
pub(super) fn sorted_finite(values: &[f64]) -> Vec<f64> {
    let mut sorted = finite(values);
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// Returns the percentile `p` of sorted values, of which there is at least one.
pub(super) fn percentile_of_sorted(sorted: &[f64], p: f64) -> f64 {
    let position = (sorted.len() - 1) as f64 * p.clamp(0.0, 1.0);
    let below = position.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (position - below as f64) * (sorted[above] - sorted[below])
}

/// Returns the least and the greatest value; None for no value.
pub fn extremes(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let ends = values.into_iter().map(|value| (value, value));
    ends.reduce(|(least, greatest), (value, _)| (least.min(value), greatest.max(value)))
}

/// Returns the mean; NaN for no value.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the standard deviation in two passes: E[x²] − E[x]² loses all digits if the spread is
/// small beside the mean, as with frame times.
fn standard_deviation(values: &[f64], mean: f64) -> f64 {
    let sum_of_squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    if values.len() < 2 { f64::NAN } else { (sum_of_squares / (values.len() - 1) as f64).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::random::{SplitMix64, normal};

    #[test]
    fn hand_worked_summary() {
        let summary = Summary::of(&[4.0, 1.0, 3.0, 2.0]).unwrap();
        assert_eq!((summary.n, summary.min, summary.max, summary.mean), (4, 1.0, 4.0, 2.5));
        // Squares of −1.5, −0.5, 0.5, 1.5 sum to 5; 5 / 3.
        assert_eq!(summary.sd, Some((5.0_f64 / 3.0).sqrt()));
        // Positions 3p: 0.03, 0.15, 1.5, 2.85, 2.97. Half an ulp each way of the product.
        let expected = [1.03, 1.15, 2.5, 3.85, 3.97];
        for (got, want) in
            [summary.p1, summary.p5, summary.p50, summary.p95, summary.p99].iter().zip(expected)
        {
            assert!((got - want).abs() < 1e-15 * 4.0, "{got} for {want}");
        }
    }

    #[test]
    fn percentiles_of_zero_to_hundred_are_themselves() {
        let values: Vec<f64> = (0..=100).rev().map(f64::from).collect();
        for (p, want) in
            [(0.0, 0.0), (0.01, 1.0), (0.5, 50.0), (0.95, 95.0), (0.99, 99.0), (1.0, 100.0)]
        {
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
    fn values_that_are_not_finite_are_counted_and_left_out() {
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
    fn percentiles_of_normal_values_are_those_of_the_distribution() {
        let summary = Summary::of(&normal(&mut SplitMix64(3), 100_000)).unwrap();
        // Five standard errors: sqrt(p (1 − p) / n) / density, 0.0040 at the median and 0.0118 at
        // p1 and p99.
        assert!(summary.p50.abs() < 5.0 * 0.0040);
        assert!(
            (summary.p99 - 2.3263).abs() < 5.0 * 0.0118
                && (summary.p1 + 2.3263).abs() < 5.0 * 0.0118
        );
        // The standard error of a normal sample's sd is sd / sqrt(2n) = 0.0022.
        assert!(summary.sd.is_some_and(|sd| (sd - 1.0).abs() < 5.0 * 0.0022));
    }

    #[test]
    fn selection_finds_the_median_that_sorting_finds() {
        for n in 1..40 {
            let values = normal(&mut SplitMix64(n), n as usize);
            assert_eq!(Some(median_by_selection(&mut values.clone())), median(&values));
        }
    }
}
