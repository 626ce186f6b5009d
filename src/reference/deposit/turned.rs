//! Shares of an ellipsoid whose axes are turned in the cells of a grid, model.md §14: slab by slab
//! along one axis, rows along the next, and cells.
//!
//! Each is a share of a normal distribution: of all mass along the first axis, of a slab along the
//! second, and of a row along the third. So the shares sum to 1 but for what lies outside of the
//! grid. Within a slab or a row, the mass counts as a normal distribution of the mean and variance
//! of [`Part`].

use glam::DMat3;

use super::axis_weights;
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

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3, UVec3};

    use super::*;
    use crate::model::cloud::Shape;
    use crate::reference::deposit::deposit_on;

    fn spec(n: u32, cell: f64) -> GridSpec {
        let low = DVec3::splat(-0.5 * cell * f64::from(n));
        GridSpec { aspect: 1.0, n_cells: UVec3::splat(n), cell, low }
    }

    fn blob(scales: DVec3, turned: DQuat) -> Blob {
        let (sigma, shape) = Shape::of(scales, turned);
        Blob { position: DVec3::new(0.13, -0.21, 0.07), sigma, shape, kappa: 0.8 }
    }

    fn turns() -> [DQuat; 4] {
        [
            DQuat::from_axis_angle(DVec3::Z, 0.4),
            DQuat::from_axis_angle(DVec3::new(0.6, 0.8, 0.0), 1.1),
            DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 2.3),
            DQuat::from_axis_angle(DVec3::X, std::f64::consts::FRAC_PI_4),
        ]
    }

    /// Mass, mean and covariance of the cells.
    fn moments(spec: &GridSpec, cells: &[f64]) -> (f64, DVec3, DMat3) {
        let (mut mass, mut mean, mut square) = (0.0, DVec3::ZERO, DMat3::ZERO);
        for (c, v) in cells.iter().enumerate() {
            let x = spec.center(c);
            mass += v;
            mean += *v * x;
            square += *v * DMat3::from_cols(x * x.x, x * x.y, x * x.z);
        }
        let mean = mean / mass;
        let of_mean = DMat3::from_cols(mean * mean.x, mean * mean.y, mean * mean.z);
        (mass * spec.cell_volume(), mean, square * (1.0 / mass) - of_mean)
    }

    #[test]
    fn mass_place_and_spread_are_kept() {
        for turned in turns() {
            for (scales, cell) in [
                (DVec3::new(0.6, 0.2, 0.4), 0.1),
                (DVec3::new(0.9, 0.05, 0.5), 0.15),
                (DVec3::new(0.05, 0.9, 0.05), 0.2),
                (DVec3::new(0.03, 0.02, 0.01), 0.4),
            ] {
                let (spec, blob) = (spec(61, cell), blob(scales, turned));
                let (mass, mean, found) = moments(&spec, &deposit_on(&spec, 0, &[blob]));
                assert!((mass / blob.mass() - 1.0).abs() < 1e-12, "{mass}");
                // Cutting at 3 sigma takes 2.7 % of a variance, each time it is cut.
                let expected = blob.sigma * blob.sigma * blob.shape.covariance();
                let wide = blob.sigma + cell;
                assert!((mean - blob.position).length() < 0.5 * cell.min(wide), "{mean}");
                // A cell's own spread is a twelfth of its edge's square, or what the place in a
                // single cell makes.
                let rest = found - expected;
                let most = 0.06 * blob.sigma * blob.sigma + 0.3 * cell * cell;
                let greatest =
                    rest.to_cols_array().into_iter().fold(0.0, |m: f64, v| m.max(v.abs()));
                assert!(greatest < most, "{turned} {scales} {found} {expected}");
            }
        }
    }

    #[test]
    fn cells_have_the_means_of_the_density() {
        // Means over 6^3 points of a cell.
        let density = |blob: &Blob, x: DVec3| {
            let r = blob.white_matrix() * (x - blob.position);
            blob.kappa * (-0.5 * r.length_squared()).exp()
        };
        let spec = spec(40, 0.1);
        for turned in turns() {
            for scales in [DVec3::new(0.5, 0.25, 0.35), DVec3::new(0.5, 0.08, 0.3)] {
                let blob = blob(scales, turned);
                let cells = deposit_on(&spec, 0, &[blob]);
                let mut off: f64 = 0.0;
                for (c, found) in cells.iter().enumerate() {
                    let mut mean = 0.0;
                    for k in 0..216 {
                        let at = DVec3::new((k % 6) as f64, (k / 6 % 6) as f64, (k / 36) as f64);
                        let at = (at + 0.5) / 6.0 - 0.5;
                        mean += density(&blob, spec.center(c) + spec.cell * at) / 216.0;
                    }
                    off = off.max((found - mean).abs());
                }
                // Where a blob is cut at 3 sigma, a hundredth of the peak ends at once.
                assert!(off < 0.011 * blob.kappa, "{scales} {turned}: {}", off / blob.kappa);
            }
        }
    }

    #[test]
    fn along_the_axes_it_is_the_separable_deposit() {
        let quarter = DQuat::from_axis_angle(DVec3::Z, std::f64::consts::FRAC_PI_2);
        // Flat along y, turned to be flat along x; and the same by its own axes.
        let spec = spec(40, 0.1);
        let turned = blob(DVec3::new(0.3, 0.1, 0.3), quarter);
        assert!(!turned.shape.is_upright());
        let cells = deposit_on(&spec, 0, &[turned]);
        for (c, found) in cells.iter().enumerate() {
            let at = spec.center(c);
            let weight = |axis: usize, sigma: f64| {
                let (first, weights) =
                    axis_weights(turned.position[axis], sigma, spec.low[axis], 0.1, 40);
                let i = ((at[axis] - spec.low[axis]) / 0.1) as usize;
                i.checked_sub(first).and_then(|k| weights.get(k)).copied().unwrap_or(0.0)
            };
            let share = weight(0, 0.1) * weight(1, 0.3) * weight(2, 0.3);
            let expected = turned.mass() / spec.cell_volume() * share;
            assert!((found - expected).abs() < 2e-5 * turned.kappa, "{at} {found} {expected}");
        }
    }

    #[test]
    fn wider_cells_keep_the_spread() {
        let spec = spec(64, 0.1);
        let blob = blob(DVec3::new(0.9, 0.5, 0.7), turns()[2]);
        let mut cells = deposit_on(&spec, 0, &[]);
        super::super::spread(&spec, &deposit_on(&spec, 1, &[blob]), &mut cells);
        let fine = deposit_on(&spec, 0, &[blob]);
        let off = cells.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 0.02 * blob.kappa && off > 1e-5, "{}", off / blob.kappa);
    }
}
