//! Bounds of what turned ellipsoids deposit, slab by slab, row by row and cell by cell. Lengths are
//! in σ, as in the shader.

use glam::DMat3;

use nimbus::model::grid::{DEPOSIT_CUT_SIGMA, GridSpec};
use nimbus::reference::Blob;
use nimbus::reference::deposit::axis_weights;
use nimbus::reference::rounding::{DIVISION_ERROR, U_F32};

use super::{PHI_3, ROUNDINGS, SHARE, erf_error};
use crate::shells::AXIS_ERROR;

const U: f64 = U_F32;

/// A value and its error.
#[derive(Clone, Copy)]
struct Off {
    value: f64,
    error: f64,
}

impl Off {
    fn times(self, by: Off) -> Off {
        let error = self.error * by.value.abs() + self.value.abs() * by.error;
        Off {
            value: self.value * by.value,
            error: error + self.error * by.error + U * (self.value * by.value).abs(),
        }
    }

    fn plus(self, by: Off) -> Off {
        let value = self.value + by.value;
        Off { value, error: self.error + by.error + U * value.abs() }
    }

    fn over(self, by: Off) -> Off {
        let value = self.value / by.value;
        let least = by.value.abs() - by.error;
        assert!(least > 0.0, "the divisor may be 0");
        Off {
            value,
            error: (self.error + value.abs() * by.error) / least + DIVISION_ERROR * U * value.abs(),
        }
    }

    fn root(self) -> Off {
        let value = self.value.sqrt();
        Off { value, error: self.error / value + 4.0 * U * value }
    }
}

/// A share of a Gaussian between two faces, and the mean and variance of the part.
struct Part {
    i: usize,
    share: Off,
    mean: Off,
    variance: Off,
}

/// Returns the parts of an axis that the shader may deposit in.
fn parts(at: Off, variance: Off, edge: f64, n: usize) -> Vec<Part> {
    let sigma = variance.root();
    let (first, weights) = axis_weights(at.value, sigma.value, 0.0, edge, n);
    if weights.is_empty() {
        return vec![];
    }
    let wide = sigma.error / sigma.value;
    let face = |i: usize| (edge * i as f64 - at.value) / sigma.value;
    // The edge in σ has three roundings, and the product, the difference and the quotient theirs.
    let off = |i: usize| {
        let place = edge * i as f64;
        (at.error + U * (4.0 * place + (place - at.value).abs())) / sigma.value
            + (wide + DIVISION_ERROR * U) * face(i).abs()
    };
    let range = (at.error + 6.0 * U * (at.value.abs() + DEPOSIT_CUT_SIGMA * sigma.value))
        / sigma.value
        + DEPOSIT_CUT_SIGMA * wide;
    let cut = |v: f64| v.clamp(-DEPOSIT_CUT_SIGMA, DEPOSIT_CUT_SIGMA);
    // A face beyond the cut counts as at the cut, whatever its error.
    let off_cut = |i: usize| if face(i).abs() - off(i) > DEPOSIT_CUT_SIGMA { 0.0 } else { off(i) };
    let part = |i: usize| {
        let (a, b) = (face(i), face(i + 1));
        let (ea, eb) = (off(i), off(i + 1));
        let value = i.checked_sub(first).and_then(|k| weights.get(k)).copied().unwrap_or(0.0);
        let error = SHARE * (erf_error(a, ea) + erf_error(b, eb)) + 3.0 * U * value + PHI_3 * range;
        let width = (cut(b) - cut(a)).powi(2) / 12.0;
        // Neither changes by more than half of what a face does, times σ.
        let mean = 0.5 * (cut(a) + cut(b)) / (1.0 + width);
        let of_faces = off_cut(i) + off_cut(i + 1);
        let mean = Off { value: mean, error: of_faces + 8.0 * U * mean.abs() };
        let within = width / (1.0 + width);
        let within = Off { value: within, error: of_faces + 8.0 * U * within };
        Part {
            i,
            share: Off { value, error },
            mean: mean.times(sigma),
            variance: within.times(variance),
        }
    };
    (first.saturating_sub(1)..=(first + weights.len()).min(n - 1)).map(part).collect()
}

/// Returns over how many cells a σ extends, squared, along each axis, and the axes by that.
fn order_of(covariance: &DMat3, edges: [f64; 3]) -> ([f64; 3], [usize; 3]) {
    let cells = [0, 1, 2].map(|i| covariance.col(i)[i] / (edges[i] * edges[i]));
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| cells[j].total_cmp(&cells[i]));
    (cells, order)
}

fn is_apart(cells: &[f64; 3], [a, b, c]: [usize; 3]) -> bool {
    let is_tie = |i: usize, j: usize| (cells[i] / cells[j] - 1.0).abs() < 1e-2;
    !is_tie(a, b) && !is_tie(b, c)
}

/// Returns whether rounding leaves no doubt about the order of the axes.
pub fn is_decided(spec: &GridSpec, blob: &Blob, level: u32) -> bool {
    let edges = (spec.level(level).edges() / blob.sigma).to_array();
    let mut covariance = blob.shape.covariance();
    if level > 0 {
        let spread = spec.spread_variance(level) / (blob.sigma * blob.sigma);
        covariance -= DMat3::from_diagonal(spread);
    }
    let (cells, order) = order_of(&covariance, edges);
    blob.sigma == 0.0 || blob.shape.is_upright() || is_apart(&cells, order)
}

/// Adds the bounds of the density that a blob has in the cells of a level.
pub fn add_bounds(spec: &GridSpec, blob: &Blob, level: u32, quantum: f64, bounds: &mut [f64]) {
    let of_level = spec.level(level);
    let edges = (of_level.edges() / blob.sigma).to_array();
    let n = of_level.n_cells.as_usizevec3().to_array();
    let at = (blob.position - spec.low) / blob.sigma;
    let place = (blob.position.abs() + spec.low.abs()) / blob.sigma;
    let lengths = blob.shape.lengths();
    let squares = lengths * lengths;
    let mut covariance = blob.shape.covariance();
    // Two axes and the square's roundings, and the sums'.
    let of_axes = 2.0 * AXIS_ERROR + 8.0 * U;
    let mut off = of_axes * squares.element_sum();
    let mut product = Off { value: squares.y * squares.z, error: 3.0 * U * squares.y * squares.z };
    if level > 0 {
        let spread = spec.spread_variance(level) / (blob.sigma * blob.sigma);
        covariance -= DMat3::from_diagonal(spread);
        off += 8.0 * U * spread.element_sum();
    }
    let inverted = covariance.inverse();
    let trace = |m: &DMat3| m.col(0).x + m.col(1).y + m.col(2).z;
    let mut off_inverted = of_axes * squares.recip().element_sum();
    if level > 0 {
        // |(C + δ)⁻¹ − C⁻¹| ≤ |C⁻¹|² |δ|, and the inverse is made of cofactors.
        let greatest = trace(&inverted);
        off_inverted = greatest * greatest * (off + 20.0 * U * trace(&covariance));
        product = Off { value: covariance.determinant(), error: 0.0 };
        product.error = product.value * greatest * (off + 20.0 * U * trace(&covariance));
    }
    let (cells, [a, b, c]) = order_of(&covariance, edges);
    assert!(is_apart(&cells, [a, b, c]), "two axes extend over as many cells");
    let of = |i: usize, j: usize| Off { value: covariance.col(j)[i], error: off };
    let given = |i: usize, j: usize| Off { value: inverted.col(j)[i], error: off_inverted };
    let minus = |v: Off| Off { value: -v.value, ..v };
    let by_a = of(a, b).over(of(a, a));
    let rest_b = given(c, c).times(product).over(of(a, a));
    let (of_a, of_b) = (minus(given(c, a)).over(given(c, c)), minus(given(c, b)).over(given(c, c)));
    let rest_c = Off { value: 1.0, error: 0.0 }.over(given(c, c));
    let at = |i: usize| Off { value: at[i], error: 4.0 * U * place[i] };
    let density = blob.mass() / of_level.cell_volume();
    let stride = [1, n[0], n[0] * n[1]];
    for slab in parts(at(a), of(a, a), edges[a], n[a]) {
        let variance_b = rest_b.plus(by_a.times(by_a).times(slab.variance));
        let lag = by_a.times(slab.variance).over(variance_b);
        let slope = of_a.times(lag).plus(of_b);
        let left =
            rest_c.plus(of_a.times(of_a).times(slab.variance).times(rest_b.over(variance_b)));
        for row in parts(at(b).plus(by_a.times(slab.mean)), variance_b, edges[b], n[b]) {
            let mean = of_a.plus(of_b.times(by_a)).times(slab.mean).plus(slope.times(row.mean));
            let variance = left.plus(slope.times(slope).times(row.variance));
            for cell in parts(at(c).plus(mean), variance, edges[c], n[c]) {
                let all = [slab.share, row.share, cell.share];
                let exact: f64 = all.iter().map(|s| s.value).product();
                let most: f64 = all.iter().map(|s| s.value + s.error).product();
                let i = slab.i * stride[a] + row.i * stride[b] + cell.i * stride[c];
                let rounded = if most > 0.0 { 0.5 * quantum } else { 0.0 };
                bounds[i] += density * (most * (1.0 + (ROUNDINGS + 4.0) * U) - exact) + rounded;
            }
        }
    }
}
