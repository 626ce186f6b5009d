//! Confidence intervals of medians from many short blocks, which need no model of the noise.
//!
//! Frames of one block share their noise: neighbours are correlated, and a block can be slow as a
//! whole. Blocks of different rounds are nearly independent. Therefore the block is the unit whose
//! spread is measured:
//!
//! - m is the median of all values. Block k has the share p_k of values below m (half of those
//!   equal to it). A block with p_k = ½ has the median m itself.
//! - The mean p̄ of all blocks is ½ by the choice of m. Its variance follows from the spread of the
//!   p_k, and its interval is ½ ± t √var.
//! - The quantiles of all values at both ends of that interval are the interval of the median
//!   (Woodruff 1952; Francisco and Fuller 1991). No density is estimated.
//!
//! A scene changes from frame to frame, so that blocks of different frames differ without noise.
//! Only blocks of one *stratum* are compared, those that begin with the same frame. A stratum of a
//! single block joins its neighbour (collapsed strata, Wolter 2007), which can only widen the
//! interval. With g blocks in a stratum and weights w_k, the shares of all values,
//!
//! var = Σ_strata g/(g − 1) Σ_k (w_k (p_k − ½) − mean of the stratum)², with Σ (g − 1) degrees of
//! freedom for Student's t.
//!
//! For a ratio of medians the change of ln m is linear in the p_k: block k moves it by
//! w_k (½ − p_k) d ln Q/dp, where Q is the quantile. Its variance comes from the same strata. If
//! two loops ran in the same rounds, the variance is that of the differences round by round, so
//! that what slows both down cancels.

use super::bootstrap::Interval;
use super::stats::percentile_of_sorted;
use super::student::student_95;

/// Blocks that a list needs for an interval.
pub const N_BLOCKS_NEEDED: usize = 8;
/// Degrees of freedom that an interval over blocks needs. With fewer, Student's t is above 3, and
/// no interval gets narrow.
const DEGREES_NEEDED: f64 = 4.0;
/// Starts of a program that a list needs for an interval. With two, Student's t is 12.7.
pub const N_STARTS_NEEDED: usize = 3;
/// The part of the quantile's range, each side of ½, over which its slope is measured, is the
/// standard error, but at least and at most these: a few values have no slope, and the tails of
/// late frames have another one.
const SLOPE_SPAN: [f64; 2] = [0.05, 0.2];

/// Values that were taken one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Number of the start of the program.
    pub start: u32,
    /// Blocks with the same number measure the same thing.
    pub stratum: u32,
    /// The values.
    pub values: Vec<f64>,
}

/// The median of all values of a list of blocks, and how far it may be off.
#[derive(Debug, Clone)]
pub struct BlockedMedian {
    sorted: Vec<f64>,
    /// Stratum of each block that has values, and w_k (½ − p_k).
    pulls: Vec<(u32, f64)>,
    /// Groups of blocks that are compared, by their places in `pulls`.
    groups: Vec<Vec<usize>>,
    spread: Spread,
}

/// A variance and the degrees of freedom that it is known with.
#[derive(Debug, Clone, Copy)]
struct Spread {
    variance: f64,
    degrees: f64,
}

impl BlockedMedian {
    /// Returns the median of the finite values of all blocks, which are in the order in which they
    /// ran. Blocks of several starts of a program count as one block a start. None for too few
    /// blocks or starts.
    pub fn new(blocks: &[Block]) -> Option<BlockedMedian> {
        if !has_starts(blocks) {
            return BlockedMedian::of(blocks, N_BLOCKS_NEEDED, DEGREES_NEEDED);
        }
        let starts: Vec<Block> = blocks
            .chunk_by(|a, b| a.start == b.start)
            .map(|of_start| Block {
                start: of_start[0].start,
                stratum: 0,
                values: of_start.iter().flat_map(|block| &block.values).copied().collect(),
            })
            .collect();
        BlockedMedian::of(&starts, N_STARTS_NEEDED, N_STARTS_NEEDED as f64 - 1.0)
    }

    fn of(blocks: &[Block], n_needed: usize, degrees_needed: f64) -> Option<BlockedMedian> {
        let finite = |block: &Block| -> Vec<f64> {
            block.values.iter().copied().filter(|v| v.is_finite()).collect()
        };
        let blocks: Vec<(u32, Vec<f64>)> = blocks
            .iter()
            .map(|block| (block.stratum, finite(block)))
            .filter(|(_, values)| !values.is_empty())
            .collect();
        if blocks.len() < n_needed {
            return None;
        }
        let mut sorted: Vec<f64> = blocks.iter().flat_map(|(_, v)| v).copied().collect();
        sorted.sort_by(f64::total_cmp);
        let median = percentile_of_sorted(&sorted, 0.5);
        let n = sorted.len() as f64;
        // w_k (½ − p_k) = (values above − values below) / 2n.
        let above = |v: &f64| f64::from(i8::from(*v > median) - i8::from(*v < median));
        let pull = |(stratum, values): &(u32, Vec<f64>)| {
            (*stratum, values.iter().map(above).sum::<f64>() / (2.0 * n))
        };
        let pulls: Vec<(u32, f64)> = blocks.iter().map(pull).collect();
        let groups = groups(pulls.iter().map(|(stratum, _)| *stratum));
        let spread = Spread::of(&groups, |k| pulls[k].1);
        (spread.degrees >= degrees_needed).then_some(BlockedMedian {
            sorted,
            pulls,
            groups,
            spread,
        })
    }

    /// Returns the median.
    pub fn median(&self) -> f64 {
        percentile_of_sorted(&self.sorted, 0.5)
    }

    /// Returns the 95 % interval of the median, with its half widths in terms of quantiles times
    /// `widening`.
    pub fn interval(&self, widening: f64) -> Interval {
        let half = widening * self.spread.half_width();
        let at = |p: f64| percentile_of_sorted(&self.sorted, p);
        Interval { estimate: self.median(), low: at(0.5 - half), high: at(0.5 + half) }
    }

    /// Returns d ln Q/dp around the median. None unless the quantiles there are above 0.
    fn slope(&self) -> Option<f64> {
        let [least, most] = SLOPE_SPAN;
        let span = self.spread.variance.sqrt().clamp(least, most);
        let [low, high] = [0.5 - span, 0.5 + span].map(|p| percentile_of_sorted(&self.sorted, p));
        (low > 0.0).then(|| (high / low).ln() / (2.0 * span))
    }

    /// Returns the interval of the ratio of the median to that of `base`, which ran at another
    /// time. None unless both medians are above 0.
    pub fn ratio(&self, base: &BlockedMedian, widening: f64) -> Option<Interval> {
        let of = |m: &BlockedMedian| {
            let variance = m.spread.variance * m.slope()?.powi(2);
            Some(Spread { variance, ..m.spread })
        };
        self.ratio_with(base, of(self)?.plus(of(base)?), widening)
    }

    /// Returns the interval of the ratio of the median to that of `base`, whose blocks ran in the
    /// same rounds. Where they did not, the medians are independent.
    pub fn paired_ratio(&self, base: &BlockedMedian, widening: f64) -> Option<Interval> {
        let strata = |m: &BlockedMedian| m.pulls.iter().map(|(s, _)| *s).collect::<Vec<_>>();
        if strata(self) != strata(base) {
            return self.ratio(base, widening);
        }
        let (own, of_base) = (self.slope()?, base.slope()?);
        let moved = |k: usize| own * self.pulls[k].1 - of_base * base.pulls[k].1;
        self.ratio_with(base, Spread::of(&self.groups, moved), widening)
    }

    fn ratio_with(&self, base: &BlockedMedian, of_ln: Spread, widening: f64) -> Option<Interval> {
        let (own, of_base) = (self.median(), base.median());
        let estimate = if of_base > 0.0 { own / of_base } else { f64::NAN };
        let factor = (widening * of_ln.half_width()).exp();
        (estimate > 0.0 && (estimate * factor).is_finite()).then(|| Interval {
            estimate,
            low: estimate / factor,
            high: estimate * factor,
        })
    }
}

impl Spread {
    /// Returns the variance of the sum of all `values`, which are given by their place.
    fn of(groups: &[Vec<usize>], values: impl Fn(usize) -> f64) -> Spread {
        let of_group = |group: &Vec<usize>| {
            let g = group.len() as f64;
            let mean = group.iter().map(|&k| values(k)).sum::<f64>() / g;
            let squares: f64 = group.iter().map(|&k| (values(k) - mean).powi(2)).sum();
            // A group of one has no spread; there is none unless there is a single block.
            if g > 1.0 { squares * g / (g - 1.0) } else { 0.0 }
        };
        let degrees = groups.iter().map(|group| group.len() as f64 - 1.0).sum();
        Spread { variance: groups.iter().map(of_group).sum(), degrees }
    }

    /// Returns the sum of two independent ones, with the degrees of freedom of Welch 1947.
    fn plus(self, other: Spread) -> Spread {
        let variance = self.variance + other.variance;
        let part = |s: Spread| s.variance.powi(2) / s.degrees;
        let parts = part(self) + part(other);
        let most = self.degrees + other.degrees;
        let degrees = if parts > 0.0 { variance.powi(2) / parts } else { most };
        Spread { variance, degrees }
    }

    fn half_width(self) -> f64 {
        student_95(self.degrees) * self.variance.sqrt()
    }
}

/// Returns whether blocks are of several starts of a program.
pub fn has_starts(blocks: &[Block]) -> bool {
    blocks.windows(2).any(|w| w[0].start != w[1].start)
}

/// Returns the blocks that are compared with each other: those of a stratum, and for a single block
/// those of the next stratum, of the one before for the last.
fn groups(strata: impl Iterator<Item = u32>) -> Vec<Vec<usize>> {
    let mut order: Vec<(u32, usize)> = strata.enumerate().map(|(k, s)| (s, k)).collect();
    order.sort_unstable();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut waits: Vec<usize> = Vec::new();
    for of_stratum in order.chunk_by(|a, b| a.0 == b.0) {
        waits.extend(of_stratum.iter().map(|(_, k)| *k));
        if waits.len() > 1 {
            groups.push(std::mem::take(&mut waits));
        }
    }
    match groups.last_mut() {
        Some(last) => last.append(&mut waits),
        None => groups.push(waits),
    }
    groups
}

#[cfg(test)]
mod tests;
