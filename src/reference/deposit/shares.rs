//! Shares of a Gaussian's mass in the cells along one axis, model.md §8.

use std::f64::consts::FRAC_1_SQRT_2;
use std::ops::RangeInclusive;

use libm::{erf, erfc};

use crate::model::grid::DEPOSIT_CUT_SIGMA;

/// Returns the first to last cell of one axis within the cut; `None` if there is none.
pub(super) fn reached(
    p: f64,
    sigma: f64,
    low: f64,
    cell: f64,
    n: usize,
) -> Option<RangeInclusive<usize>> {
    let reach = DEPOSIT_CUT_SIGMA * sigma;
    let first = ((p - reach - low) / cell).floor().max(0.0);
    let last = ((p + reach - low) / cell).floor().min(n as f64 - 1.0);
    (p.is_finite() && first <= last).then_some(first as usize..=last as usize)
}

/// erf(3/√2): the share of a Gaussian within the cut, which normalises the weights.
pub(super) const WITHIN_CUT: f64 = 0.997_300_203_936_739_8;

/// Returns the first cell and the weights of one axis: each cell's share of the Gaussian cut at ±3σ
/// and normalised. They sum to 1, less the part outside the grid, and change continuously with `p`.
/// Empty if no cell lies within the cut, or `p` is NaN.
pub fn axis_weights(p: f64, sigma: f64, low: f64, cell: f64, n: usize) -> (usize, Vec<f64>) {
    let Some(cells) = reached(p, sigma, low, cell, n) else { return (0, Vec::new()) };
    let edge = |i: usize| (low + cell * i as f64 - p) / sigma;
    let cut = |v: f64| v.clamp(-DEPOSIT_CUT_SIGMA, DEPOSIT_CUT_SIGMA);
    let weight = |i: usize| normal_share(cut(edge(i)), cut(edge(i + 1))) / WITHIN_CUT;
    (*cells.start(), cells.map(weight).collect())
}

/// Returns the share of the unit normal distribution in [a, b]: ½[erf(b/√2) − erf(a/√2)], by erfc
/// in the tails.
pub(in crate::reference) fn normal_share(a: f64, b: f64) -> f64 {
    let (s, t) = (a * FRAC_1_SQRT_2, b * FRAC_1_SQRT_2);
    let twice = if a > 0.0 {
        erfc(s) - erfc(t)
    } else if b < 0.0 {
        erfc(-t) - erfc(-s)
    } else {
        erf(t) - erf(s)
    };
    0.5 * twice
}
