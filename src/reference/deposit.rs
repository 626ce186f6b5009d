//! The deposit of the blobs' mass in the density grid, model.md §8 and passes.md "grid". It is
//! conservative, and separable where blobs are upright. Wide blobs are deposited on wide cells,
//! which are spread to the finest ones.
//!
//! Densities are extinction per unit length. Cell (x, y, z) is at index x + n_x (y + n_y z).

use std::f64::consts::FRAC_1_SQRT_2;
use std::ops::RangeInclusive;

use glam::{DVec3, UVec3};
use libm::{erf, erfc};

use super::Blob;
use crate::model::grid::{DEPOSIT_CUT_SIGMA, GridSpec, given_by_coarser};

mod turned;

/// Returns the blobs that have extinction.
pub(super) fn dense(blobs: &[Blob]) -> impl Iterator<Item = &Blob> {
    blobs.iter().filter(|b| b.sigma > 0.0 && b.kappa > 0.0)
}

/// Returns the density of every cell. A blob outside the grid, or with σ = 0 or κ = 0, deposits
/// nothing.
pub fn deposit(spec: &GridSpec, blobs: &[Blob]) -> Vec<f64> {
    deposit_by_levels(spec, blobs, spec.n_levels(blobs.len() as u64))
}

/// Returns the same with wide blobs on wide cells of so many levels, which are spread to the finest
/// ones.
///
/// Error: mass is kept. A blob's density differs by at most 9e-3 of its peak from that on the
/// finest cells. Deposit and spread are even and keep the variance, so the difference begins with
/// the fourth cumulant. A cell of edge h has −h⁴/120. The binomial shares of all levels have
/// −5h⁴/120. Over σ⁴, an eighth of −h⁴/20 is the share by which the peak changes, on each axis:
/// 3.7e-3 together, as σ is 1.5h or more. Where the blob is cut at 3σ, a hundredth of the peak ends
/// at once. Half of that ends within a wide cell, 5.6e-3, and the other axes change 2.5e-3.
pub fn deposit_by_levels(spec: &GridSpec, blobs: &[Blob], n_levels: u32) -> Vec<f64> {
    let mut of_level = vec![Vec::new(); n_levels as usize];
    for blob in dense(blobs) {
        of_level[level_of(spec, blob, n_levels) as usize].push(*blob);
    }
    let n_used = of_level.iter().rposition(|blobs| !blobs.is_empty()).map_or(1, |last| last + 1);
    let mut coarser: Option<Vec<f64>> = None;
    for (level, blobs) in (0..n_used as u32).zip(&of_level).rev() {
        let mut cells = deposit_on(spec, level, blobs);
        if let Some(coarser) = &coarser {
            spread(&spec.level(level), coarser, &mut cells);
        }
        coarser = Some(cells);
    }
    coarser.unwrap_or_default()
}

/// Returns what blobs deposit in the cells of a level, as density.
pub fn deposit_on(spec: &GridSpec, level: u32, blobs: &[Blob]) -> Vec<f64> {
    let of_level = spec.level(level);
    let n = of_level.n_cells.as_usizevec3();
    let mut cells = vec![0.0; n.x * n.y * n.z];
    let (edges, volume) = (of_level.edges(), of_level.cell_volume());
    for blob in dense(blobs) {
        let density = blob.mass() / volume;
        if !blob.shape.is_upright() {
            turned::each_share(spec, blob, level, |cell, share| cells[cell] += density * share);
            continue;
        }
        let sigma = spec.deposited(blob.extents(), level);
        let axis = |i: usize| axis_weights(blob.position[i], sigma[i], spec.low[i], edges[i], n[i]);
        let ((x0, wx), (y0, wy), (z0, wz)) = (axis(0), axis(1), axis(2));
        for (z, wz) in (z0..).zip(&wz) {
            for (y, wy) in (y0..).zip(&wy) {
                let row = n.x * (y + n.y * z);
                for (x, wx) in (x0..).zip(&wx) {
                    cells[row + x] += density * wx * wy * wz;
                }
            }
        }
    }
    cells
}

/// Returns the level, of `n_levels`, that a blob is deposited on. What spreading adds to its
/// variance must be less than it has in any direction.
fn level_of(spec: &GridSpec, blob: &Blob, n_levels: u32) -> u32 {
    let sigma =
        if blob.shape.is_upright() { blob.extents() } else { DVec3::splat(blob.narrowest()) };
    spec.level_of(sigma, n_levels)
}

/// Adds to the cells of a level what the cells of the next, `coarser`, give them.
pub fn spread(level: &GridSpec, coarser: &[f64], cells: &mut [f64]) {
    let (n, n_coarse) = (level.n_cells, level.level(1).n_cells);
    for (i, cell) in (0..).zip(cells) {
        let at = UVec3::new(i % n.x, i / n.x % n.y, i / (n.x * n.y));
        let weights = [0, 1, 2].map(|axis| given_by_coarser(at[axis], n[axis]));
        for k in 0..27 {
            let of = [k % 3, k / 3 % 3, k / 9];
            let weight: f64 = (0..3).map(|axis| weights[axis][of[axis]]).product();
            if weight > 0.0 {
                let [x, y, z] = [0, 1, 2].map(|axis| at[axis] / 2 + of[axis] as u32 - 1);
                let c = x + n_coarse.x * (y + n_coarse.y * z);
                *cell += weight * coarser[c as usize];
            }
        }
    }
}

/// Returns the number of cell updates of [`deposit`], over all blobs.
pub fn n_deposited(spec: &GridSpec, blobs: &[Blob]) -> f64 {
    let n_levels = spec.n_levels(blobs.len() as u64);
    let of_blob = |blob: &Blob| {
        let level = level_of(spec, blob, n_levels);
        if !blob.shape.is_upright() {
            let mut n = 0.0;
            turned::each_share(spec, blob, level, |_, _| n += 1.0);
            return n;
        }
        let (sigma, of_level) = (spec.deposited(blob.extents(), level), spec.level(level));
        let (n, edges) = (of_level.n_cells.as_usizevec3(), of_level.edges());
        let axis = |i: usize| {
            reached(blob.position[i], sigma[i], spec.low[i], edges[i], n[i])
                .map_or(0, |r| r.count())
        };
        axis(0) as f64 * axis(1) as f64 * axis(2) as f64
    };
    dense(blobs).map(of_blob).sum()
}

/// Returns the first to last cell of one axis within the cut; `None` if there is none.
fn reached(p: f64, sigma: f64, low: f64, cell: f64, n: usize) -> Option<RangeInclusive<usize>> {
    let reach = DEPOSIT_CUT_SIGMA * sigma;
    let first = ((p - reach - low) / cell).floor().max(0.0);
    let last = ((p + reach - low) / cell).floor().min(n as f64 - 1.0);
    (p.is_finite() && first <= last).then_some(first as usize..=last as usize)
}

/// erf(3/√2): the share of a Gaussian within the cut, which normalises the weights.
const WITHIN_CUT: f64 = 0.997_300_203_936_739_8;

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
pub(super) fn normal_share(a: f64, b: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::cloud::{SQRT_TAU, Shape};
    use crate::model::grid::MAX_LEVELS;
    use glam::DVec3;

    fn spec(n: u32, cell: f64, low: f64) -> GridSpec {
        GridSpec { aspect: 1.0, n_cells: UVec3::splat(n), cell, low: DVec3::splat(low) }
    }

    fn blob(x: f64, sigma: f64, kappa: f64) -> Blob {
        Blob { shape: Shape::BALL, position: DVec3::new(x, 0.3, -0.2), sigma, kappa }
    }

    #[test]
    fn cells_that_blobs_meet_by_hand() {
        let spec = spec(20, 0.5, -5.0);
        let at = |x: f64, sigma: f64, kappa: f64| Blob {
            shape: Shape::BALL,
            position: DVec3::splat(x),
            sigma,
            kappa,
        };
        // ±1.5 about 0.1: cells 7 to 13 along each axis. About the corner at 5: 17 to 19. Beyond
        // it: none.
        let blobs =
            [at(0.1, 0.5, 1.0), at(5.0, 0.5, 1.0), at(7.0, 0.5, 1.0), at(f64::NAN, 0.5, 1.0)];
        let counts = blobs.map(|blob| n_deposited(&spec, &[blob]));
        assert_eq!(counts, [343.0, 27.0, 0.0, 0.0]);
        assert_eq!(n_deposited(&spec, &blobs), 370.0);
        // Blobs without mass update no cell.
        assert_eq!(n_deposited(&spec, &[at(0.1, 0.0, 1.0), at(0.1, 0.5, 0.0)]), 0.0);
        // Twice as high, twice as many along y: ±3 is 4 to 16.
        assert_eq!(
            n_deposited(&spec, &[Blob { shape: Shape::upright(2.0), ..blobs[0] }]),
            7.0 * 13.0 * 7.0
        );
        let met = deposit(&spec, &blobs[..1]).iter().filter(|density| **density > 0.0).count();
        assert_eq!(met, 343);
    }

    #[test]
    fn deposit_keeps_mass_and_superposes() {
        let spec = spec(20, 0.5, -5.0);
        // Small, large, cut by the grid's border, without size, without extinction, outside, NaN.
        let blobs = [
            blob(0.1, 0.02, 3.0),
            blob(-1.0, 1.3, 0.7),
            blob(4.9, 0.8, 1.0),
            blob(0.0, 0.0, 9.0),
            blob(0.0, 1.0, 0.0),
            blob(50.0, 1.0, 1.0),
            blob(f64::NAN, 1.0, 1.0),
        ];
        let all = deposit(&spec, &blobs);
        let total = all.iter().sum::<f64>() * spec.cell_volume();
        // The grid keeps the part of the third below x = 5, an eighth of σ beyond its centre: Φ
        // within the cut.
        let inside = 0.5 + 0.5 * erf(0.125 * FRAC_1_SQRT_2) / erf(3.0 * FRAC_1_SQRT_2);
        let expected = blobs[0].mass() + blobs[1].mass() + inside * blobs[2].mass();
        // 8000 cells, each a few roundings of 1e-16 of its own value.
        assert!((total / expected - 1.0).abs() < 1e-12);
        let first = deposit(&spec, &blobs[..1]);
        let second = deposit(&spec, &blobs[1..]);
        // The same terms in another order.
        assert!(
            all.iter()
                .zip(first.iter().zip(&second))
                .all(|(c, (a, b))| (c - (a + b)).abs() <= 1e-15 * c)
        );
    }

    /// Bound of what wide cells change, over a blob's peak.
    const LEVEL_ERROR: f64 = 9e-3;

    #[test]
    fn wide_cells_keep_mass_and_differ_by_their_bound() {
        // From three to twelve cells a σ, at any place, in grids of even and odd size.
        let mut greatest = 0.0_f64;
        for i in 0..40 {
            let (a, b) = (f64::from(i) * 0.618_034 % 1.0, f64::from(i) * 0.754_877_7 % 1.0);
            let sigma = 3.0 * 4f64.powf(a);
            let n = (7.0 * sigma).ceil() as u32 + i % 3;
            let spec = spec(n, 1.0, 0.0);
            let position = 0.5 * f64::from(n) + DVec3::new(a - 0.5, b - 0.5, 0.5 - a) * 0.8 * sigma;
            let blob = Blob { shape: Shape::BALL, position, sigma, kappa: 0.7 };
            let wide = deposit_by_levels(&spec, &[blob], MAX_LEVELS);
            let exact = deposit_by_levels(&spec, &[blob], 1);
            let mass = |cells: &[f64]| cells.iter().sum::<f64>();
            assert!((mass(&wide) / mass(&exact) - 1.0).abs() < 1e-12);
            let off = wide.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            greatest = greatest.max(off / blob.kappa);
        }
        println!("greatest difference over the blob's peak: {greatest:.2e}");
        assert!(greatest < LEVEL_ERROR);
        assert!(greatest > 0.5 * LEVEL_ERROR, "the bound says nothing: {greatest}");
    }

    #[test]
    fn wide_cells_at_the_border_keep_mass() {
        // The grids of scenes reach two cells beyond 3σ.
        for n in [29, 30, 31, 101] {
            let sigma = (f64::from(n) - 4.0) / 6.0;
            let position = DVec3::splat(0.5 * f64::from(n));
            let blob = Blob { shape: Shape::BALL, position, sigma, kappa: 0.7 };
            let spec = spec(n, 1.0, 0.0);
            assert!(spec.level_of(DVec3::splat(sigma), MAX_LEVELS) >= 1);
            let mass: f64 = deposit_by_levels(&spec, &[blob], MAX_LEVELS).iter().sum();
            assert!((mass / blob.mass() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_small_blob_lies_in_its_cell_or_is_halved_by_a_face() {
        // m = κ(√(2π)σ)³, by hand for κ = 2, σ = 0.1: 2·0.0157496… in one cell of volume 8.
        let one = Blob { shape: Shape::BALL, position: DVec3::splat(1.0), sigma: 0.1, kappa: 2.0 };
        let cells = deposit(&spec(3, 2.0, -2.0), &[one]);
        assert!((cells[13] * 8.0 - 2.0 * 0.015_749_609_945_722_4).abs() < 1e-13);
        assert_eq!(cells.iter().filter(|&&c| c > 0.0).count(), 1);
        let (first, weights) = axis_weights(2.0, 0.1, 0.0, 1.0, 4);
        // The constant's and the quotient's rounding.
        assert!(
            first == 1 && weights.len() == 2 && weights.iter().all(|w| (w - 0.5).abs() < 1e-15)
        );
    }

    #[test]
    fn weights_are_shares_of_the_normal_distribution() {
        // Cells of one σ about p: the published shares 34.134 %, 13.591 %, 2.140 % over their sum
        // 99.730 %.
        let (first, w) = axis_weights(5.0 + 1e-9, 1.0 - 1e-9, 0.0, 1.0, 10);
        assert_eq!((first, w.len()), (2, 6));
        for (w, share) in w.iter().zip([
            0.021_400_2,
            0.135_905_1,
            0.341_344_7,
            0.341_344_7,
            0.135_905_1,
            0.021_400_2,
        ]) {
            // The shares are given to 1e-7, the cells moved by 1e-9.
            assert!((w - share / 0.997_300_2).abs() < 2e-7);
        }
        // In the far tail the share keeps its relative accuracy: Q(8) − Q(9) = 6.2209605743e-16 −
        // 1.1286e-19.
        assert!((normal_share(8.0, 9.0) / 6.219_831_7e-16 - 1.0).abs() < 1e-6);
        assert_eq!(normal_share(8.0, 9.0), normal_share(-9.0, -8.0));
    }

    #[test]
    fn weights_sum_to_one_and_change_continuously() {
        assert!((WITHIN_CUT - erf(3.0 * FRAC_1_SQRT_2)).abs() < 1e-15);
        // Steps of 1e-4 through a whole cell: a weight's slope is at most twice the density's
        // maximum over σ.
        let all = |k: i32| {
            let (first, weights) = axis_weights(9.5 + 1e-4 * f64::from(k), 0.9, 0.0, 1.0, 20);
            let mut cells = vec![0.0; 20];
            cells[first..first + weights.len()].copy_from_slice(&weights);
            cells
        };
        for k in 0..10_000 {
            let (here, next) = (all(k), all(k + 1));
            assert!((here.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            assert!(
                here.iter().zip(&next).all(|(a, b)| (a - b).abs() <= 2.0 * 1e-4 / (0.9 * SQRT_TAU))
            );
        }
    }
}
