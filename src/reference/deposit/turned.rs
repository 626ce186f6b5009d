//! Shares of an ellipsoid whose axes are turned in the cells of a grid, model.md §14: slab by slab
//! along one axis, rows along the next, and cells.
//!
//! Each is a share of a normal distribution: of all mass along the first axis, of a slab along the
//! second, and of a row along the third. So the shares sum to 1 but for what lies outside of the
//! grid. Within a slab or a row, the mass counts as a normal distribution of the mean and variance
//! of [`Part`].

use glam::DMat3;

use super::shares::axis_weights;
use crate::model::grid::{DEPOSIT_CUT_SIGMA, GridSpec};
use crate::reference::Blob;

/// A part of a unit normal distribution, as another one.
struct Part {
    mean: f64,
    variance: f64,
}

impl Part {
    /// Returns what stands for the part from `a` to `b`: the product of the distribution with one
    /// of the mean and the variance of the interval.
    fn between(a: f64, b: f64) -> Part {
        let cut = |v: f64| v.clamp(-DEPOSIT_CUT_SIGMA, DEPOSIT_CUT_SIGMA);
        let (a, b) = (cut(a), cut(b));
        let width = (b - a) * (b - a) / 12.0;
        let mean = 0.5 * (a + b) / (1.0 + width);
        Part { mean, variance: width / (1.0 + width) }
    }
}

/// Returns the axes, those first along which the blob extends over the most cells. Of equal ones
/// the first comes first.
fn order(covariance: &DMat3, edges: [f64; 3]) -> [usize; 3] {
    let cells = [0, 1, 2].map(|i| covariance.col(i)[i] / (edges[i] * edges[i]));
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| cells[j].total_cmp(&cells[i]));
    order
}

/// Gives every cell of a level that the blob reaches, and its share of the blob's mass.
pub fn each_share(spec: &GridSpec, blob: &Blob, level: u32, mut give: impl FnMut(usize, f64)) {
    let of_level = spec.level(level);
    let edges = of_level.edges().to_array();
    let n = of_level.n_cells.as_usizevec3().to_array();
    let mut covariance = blob.sigma * blob.sigma * blob.shape.covariance();
    if level > 0 {
        covariance -= DMat3::from_diagonal(spec.spread_variance(level));
    }
    let [a, b, c] = order(&covariance, edges);
    let precise = covariance.inverse();
    let of = |i: usize, j: usize| covariance.col(j)[i];
    let given = |i: usize, j: usize| precise.col(j)[i];
    // b = by_a a + ..., and c = of_a a + of_b b + ..., about the centre; the rest of each is
    // independent of what comes before.
    let by_a = of(a, b) / of(a, a);
    let rest_b = of(b, b) - by_a * of(a, b);
    let (of_a, of_b) = (-given(c, a) / given(c, c), -given(c, b) / given(c, c));
    let rest_c = given(c, c).recip();
    let axis = |i: usize, mean: f64, variance: f64| {
        let (at, sigma) = (blob.position[i] + mean, variance.sqrt());
        let (first, weights) = axis_weights(at, sigma, spec.low[i], edges[i], n[i]);
        weights.into_iter().enumerate().map(move |(k, weight)| {
            let edge = |k: usize| (spec.low[i] + edges[i] * k as f64 - at) / sigma;
            let part = Part::between(edge(first + k), edge(first + k + 1));
            (first + k, weight, sigma * part.mean, variance * part.variance)
        })
    };
    let stride = [1, n[0], n[0] * n[1]];
    for (i, in_slab, mean_a, within_a) in axis(a, 0.0, of(a, a)) {
        let variance_b = rest_b + by_a * by_a * within_a;
        // How far a lies off the slab's mean where b lies off the row's.
        let back = by_a * within_a / variance_b;
        let slope = of_a * back + of_b;
        let left = rest_c + of_a * of_a * (within_a - back * back * variance_b);
        for (j, in_row, mean_b, within_b) in axis(b, by_a * mean_a, variance_b) {
            let mean_c = (of_a + of_b * by_a) * mean_a + slope * mean_b;
            let row = i * stride[a] + j * stride[b];
            for (k, share, ..) in axis(c, mean_c, left + slope * slope * within_b) {
                give(row + k * stride[c], in_slab * in_row * share);
            }
        }
    }
}
