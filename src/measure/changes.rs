//! Finds where the level of a short series changes.
//!
//! The values of a segment scatter about one level, with the same noise in all segments. For every
//! number of changes the best division is the one with the least sum of squared deviations from the
//! levels, which dynamic programming finds (Bellman 1961; Jackson et al. 2005). Of these divisions
//! the one with the most changes is taken in which every change is beyond noise:
//!
//! - Student's t of the two levels, with the noise of the whole division, is so great that a series
//!   without a change has one like it, at any place, once in a thousand (Bonferroni).
//! - Without the value that speaks most for it, chance is still below one in a thousand. One slow
//!   run is no change.
//! - The noise is at least the errors of the values, and at least what neighbouring values differ
//!   by, as a division with many changes has too little noise left.
//!
//! A segment has at least three values.

use super::bootstrap::Interval;
use super::stats::median;
use super::student::{student_95, student_tail};

/// Least number of values of a segment.
pub const LEAST_SEGMENT: usize = 3;
/// Most values that are searched, the last ones: a search takes time with their square.
pub const MOST_VALUES: usize = 2000;
/// Most changes.
const MOST_CHANGES: usize = 20;
/// The chance of a change in a series that has none.
const FALSE_ALARMS: f64 = 1e-3;
/// The greatest chance of the t that remains without the value that speaks most for a change.
const ALONE: f64 = 1e-3;
/// Twice the logarithm of the likelihood ratio of two places of a change that the data do not tell
/// apart: the 95th percentile of χ² with one degree of freedom.
const CHI2_95: f64 = 3.841;
/// The standard deviation of normal values divided by the median of their absolute values.
const SD_BY_MEDIAN: f64 = 1.4826;

/// A change of level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// The first value after it.
    pub at: usize,
    /// The places that it may as well have, the first and the last: a 95 % interval of `at`.
    pub places: [usize; 2],
    /// Level after less level before, with its 95 % interval.
    pub by: Interval,
    /// The chance of a t as great at one place without a change.
    pub p: f64,
}

/// Returns the changes of a series, in order. `errors` are the standard errors of the values, 0
/// where they are not known; there are as many as values, of which the last [`MOST_VALUES`] count.
pub fn changes(values: &[f64], errors: &[f64]) -> Vec<Change> {
    let skipped = values.len().saturating_sub(MOST_VALUES);
    let (values, errors) = (&values[skipped..], errors.get(skipped..).unwrap_or(&[]));
    let sums = Sums::new(values);
    let least_variance = errors.iter().map(|e| e * e).sum::<f64>() / values.len().max(1) as f64;
    let least_variance = least_variance.max(variance_of_steps(values));
    for division in divisions(&sums).into_iter().rev() {
        let n_levels = division.len() as f64 + 1.0;
        let degrees = values.len() as f64 - n_levels;
        let bounds: Vec<usize> =
            std::iter::once(0).chain(division).chain(std::iter::once(values.len())).collect();
        let squares: f64 = bounds.windows(2).map(|w| sums.squares(w[0], w[1])).sum();
        let noise = Noise { variance: (squares / degrees).max(least_variance), degrees };
        let found: Option<Vec<Change>> =
            bounds.windows(3).map(|w| noise.change(values, &sums, [w[0], w[1], w[2]])).collect();
        if let Some(mut found) = found {
            for change in &mut found {
                change.at += skipped;
                change.places = change.places.map(|place| place + skipped);
            }
            return found;
        }
    }
    Vec::new()
}

/// Returns the variance of the noise from the differences of neighbours, which changes of level
/// touch rarely.
fn variance_of_steps(values: &[f64]) -> f64 {
    let steps: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    median(&steps).map_or(0.0, |step| (SD_BY_MEDIAN * step).powi(2) / 2.0)
}

/// Sums of the first values and of their squares, from which those of any segment follow.
struct Sums {
    of: Vec<[f64; 2]>,
}

impl Sums {
    fn new(values: &[f64]) -> Sums {
        // About the first value, so that no digits are lost to a large level.
        let base = values.first().copied().unwrap_or(0.0);
        let mut of = vec![[0.0; 2]];
        let mut sum = [0.0; 2];
        for value in values {
            let v = value - base;
            sum = [sum[0] + v, sum[1] + v * v];
            of.push(sum);
        }
        Sums { of }
    }

    /// Returns the squared deviations of a segment from its mean.
    fn squares(&self, begin: usize, end: usize) -> f64 {
        let n = (end - begin) as f64;
        let [sum, squares] = [0, 1].map(|k| self.of[end][k] - self.of[begin][k]);
        (squares - sum * sum / n).max(0.0)
    }
}

/// Returns the best divisions into 2, 3, … segments, each as the first values of all segments but
/// the first.
fn divisions(sums: &Sums) -> Vec<Vec<usize>> {
    let n = sums.of.len() - 1;
    let most = (n / LEAST_SEGMENT).saturating_sub(1).min(MOST_CHANGES);
    // costs[k][end]: the least squares of the first `end` values in k + 1 segments, and the begin
    // of the last of these.
    let one = |end: usize| match end >= LEAST_SEGMENT {
        true => (sums.squares(0, end), 0),
        false => (f64::INFINITY, 0),
    };
    let mut costs: Vec<Vec<(f64, usize)>> = vec![(0..=n).map(one).collect()];
    for k in 0..most {
        let best = |end: usize| {
            let begins = (k + 1) * LEAST_SEGMENT..(end + 1).saturating_sub(LEAST_SEGMENT);
            begins
                .map(|begin| (costs[k][begin].0 + sums.squares(begin, end), begin))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap_or((f64::INFINITY, 0))
        };
        let next = (0..=n).map(best).collect();
        costs.push(next);
    }
    let division = |n_changes: usize| {
        let mut end = n;
        let mut begins: Vec<usize> = (1..=n_changes)
            .rev()
            .map(|k| {
                end = costs[k][end].1;
                end
            })
            .collect();
        begins.reverse();
        begins
    };
    (1..=most).map(division).collect()
}

/// The noise of a division.
struct Noise {
    variance: f64,
    degrees: f64,
}

impl Noise {
    /// Returns the change between two segments, given by their ends, if it is beyond noise.
    fn change(&self, values: &[f64], sums: &Sums, [begin, at, end]: [usize; 3]) -> Option<Change> {
        let (before, after) = (&values[begin..at], &values[at..end]);
        let by = mean(after)? - mean(before)?;
        // Without the value that speaks most for the change: the highest of the upper segment or
        // the lowest of the lower one, of the shorter of both.
        let is_short = after.len() <= before.len();
        let short = if is_short { after } else { before };
        let is_upper = (by > 0.0) == is_short;
        let extreme = short.iter().copied().reduce(if is_upper { f64::max } else { f64::min })?;
        let rest = (mean(short)? * short.len() as f64 - extreme) / (short.len() as f64 - 1.0);
        let without = if is_short { rest - mean(before)? } else { mean(after)? - rest };
        let long = before.len().max(after.len());
        let p = self.tail(by, before.len(), after.len());
        let p_without = self.tail(without, short.len() - 1, long);
        let is_kept = without.signum() == by.signum();
        let most = FALSE_ALARMS / values.len() as f64;
        if !(is_kept && p < most && p_without < ALONE) {
            return None;
        }
        let half = student_95(self.degrees) * self.error(before.len(), after.len());
        // The squares grow by the variance times χ² at a place that the data do not tell apart.
        let least = sums.squares(begin, at) + sums.squares(at, end);
        let is_alike = |k: &usize| {
            let squares = sums.squares(begin, *k) + sums.squares(*k, end);
            squares - least <= CHI2_95 * self.variance
        };
        let mut alike = (begin + 1..end).filter(is_alike);
        let first = alike.clone().next().unwrap_or(at);
        let last = alike.next_back().unwrap_or(at);
        let by = Interval { estimate: by, low: by - half, high: by + half };
        Some(Change { at, places: [first.min(at), last.max(at)], by, p })
    }

    fn error(&self, n_before: usize, n_after: usize) -> f64 {
        (self.variance * (1.0 / n_before as f64 + 1.0 / n_after as f64)).sqrt()
    }

    fn tail(&self, difference: f64, n_before: usize, n_after: usize) -> f64 {
        let error = self.error(n_before, n_after);
        let t = if difference == 0.0 { 0.0 } else { difference / error };
        student_tail(t, self.degrees)
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::random::{SplitMix64, normal};

    #[test]
    fn a_hand_worked_change() {
        // Levels 1 and 3, deviations of 0.1 from them: squares 0.08 with eight degrees of freedom,
        // variance 0.01. Of nine steps the median is 0.1: (1.4826 · 0.1)²/2 = 0.01099 is more.
        // Standard error √(0.01099 · 2/5) = 0.0663; t of eight degrees is 2.306.
        let values = [1.1, 1.0, 0.9, 1.0, 1.0, 3.1, 3.0, 2.9, 3.0, 3.0];
        let all = changes(&values, &[0.0; 10]);
        assert_eq!(all.len(), 1);
        assert_eq!((all[0].at, all[0].places), (5, [5, 5]));
        assert!((all[0].by.estimate - 2.0).abs() < 1e-12);
        assert!((all[0].by.high - 2.1529).abs() < 1e-3, "{}", all[0].by.high);
    }

    #[test]
    fn one_or_two_slow_runs_are_no_change() {
        for n_slow in 1..3 {
            let mut values = vec![0.0; 20];
            values.iter_mut().enumerate().for_each(|(i, v)| *v = 0.001 * (i % 3) as f64);
            values[8..8 + n_slow].fill(0.3);
            assert_eq!(changes(&values, &[0.0; 20]), [], "{n_slow} slow runs");
        }
    }

    #[test]
    fn short_and_constant_series_have_no_change() {
        for n in 0..6 {
            let values: Vec<f64> = (0..n).map(|i| f64::from(i / 3)).collect();
            assert_eq!(changes(&values, &vec![0.0; n as usize]), []);
        }
        assert_eq!(changes(&[2.5; 30], &[0.0; 30]), []);
        // Without noise any difference is a change, unless the errors of the values allow for it.
        let step = [vec![1.0; 5], vec![1.01; 5]].concat();
        assert_eq!(changes(&step, &[0.0; 10]).len(), 1);
        assert_eq!(changes(&step, &[0.05; 10]), []);
        assert_eq!(changes(&step, &[]).len(), 1);
    }

    #[test]
    fn several_changes_are_found_in_order() {
        let mut random = SplitMix64(12);
        let levels = [0.0, 0.05, 0.02, 0.06];
        let values: Vec<f64> = levels
            .iter()
            .flat_map(|level| normal(&mut random, 9).into_iter().map(move |z| level + 0.004 * z))
            .collect();
        let found = changes(&values, &[0.0; 36]);
        assert_eq!(found.iter().map(|c| c.at).collect::<Vec<_>>(), [9, 18, 27]);
        for (change, pair) in found.iter().zip(levels.windows(2)) {
            let by = pair[1] - pair[0];
            assert!(change.by.low < by && by < change.by.high, "{change:?}");
        }
    }

    /// A series of runs with noise `sd`, of which one is slow by 5 %.
    fn series(random: &mut SplitMix64, n: usize, sd: f64) -> Vec<f64> {
        let mut values: Vec<f64> = normal(random, n).into_iter().map(|z| sd * z).collect();
        values[random.below(n)] += 0.05;
        values
    }

    #[test]
    fn no_change_is_found_in_two_hundred_series_without_one() {
        let mut random = SplitMix64(8);
        for i in 0..200 {
            let n = 6 + random.below(60);
            let sd = [0.002, 0.005, 0.01, 0.03][i % 4];
            let values = series(&mut random, n, sd);
            for end in LEAST_SEGMENT..=n {
                // As a user sees it, night after night.
                let found = changes(&values[..end], &vec![0.0; end]);
                assert_eq!(found, [], "series {i}, {end} of {n} runs, noise {sd}");
            }
        }
    }

    #[test]
    fn a_change_of_three_percent_is_found_within_three_runs() {
        // Shares of 200 series that have 12 to 40 runs before the change.
        let found = [0.003, 0.005, 0.007, 0.01].map(|sd| {
            let mut random = SplitMix64(9);
            let is_found = |_: &usize| {
                let at = 12 + random.below(29);
                let noise = normal(&mut random, at + 3);
                let value =
                    |(i, z): (usize, f64)| sd * z + if i >= at { 0.03_f64.ln_1p() } else { 0.0 };
                let values: Vec<f64> = noise.into_iter().enumerate().map(value).collect();
                let found = changes(&values, &vec![0.0; values.len()]);
                found.len() == 1 && found[0].places[0] <= at && at <= found[0].places[1]
            };
            (0..200).filter(is_found).count()
        });
        println!("{found:?} of 200");
        assert!(found[0] >= 198 && found[1] >= 190, "{found:?}");
    }
}
