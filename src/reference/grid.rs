//! The density grid, model.md §8 and passes.md "grid", "sample": blobs' mass deposited
//! conservatively into cells and sampled trilinearly, and the closed form of the optical depth that
//! the grid approximates.
//!
//! Densities are extinction per unit length. Cell (x, y, z) is at index x + n_x (y + n_y z).

use std::f64::consts::FRAC_1_SQRT_2;
use std::ops::RangeInclusive;

use glam::DVec3;
use libm::{erf, erfc};

use super::Blob;
use crate::model::grid::{DEPOSIT_CUT_SIGMA, GridSpec};

/// Returns the blobs that have extinction.
fn dense(blobs: &[Blob]) -> impl Iterator<Item = &Blob> {
    blobs.iter().filter(|b| b.sigma > 0.0 && b.kappa > 0.0)
}

/// Returns the density of every cell. A blob outside the grid, or with σ = 0 or κ = 0, deposits
/// nothing.
pub fn deposit(spec: &GridSpec, blobs: &[Blob]) -> Vec<f64> {
    let n = spec.n_cells.as_usizevec3();
    let mut cells = vec![0.0; n.x * n.y * n.z];
    let (edges, volume) = (spec.edges(), spec.cell_volume());
    for blob in dense(blobs) {
        let sigma = blob.sigma * blob.axes();
        let axis = |i: usize| axis_weights(blob.position[i], sigma[i], spec.low[i], edges[i], n[i]);
        let ((x0, wx), (y0, wy), (z0, wz)) = (axis(0), axis(1), axis(2));
        let density = blob.mass() / volume;
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

/// Returns the number of cell updates of [`deposit`], over all blobs.
pub fn n_deposited(spec: &GridSpec, blobs: &[Blob]) -> f64 {
    let n = spec.n_cells.as_usizevec3();
    let of_blob = |blob: &Blob| {
        let (sigma, edges) = (blob.sigma * blob.axes(), spec.edges());
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
fn normal_share(a: f64, b: f64) -> f64 {
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

/// Returns the density at `p`: trilinear between cell centres, 0 outside the hull of the outermost
/// ones.
pub fn sample(spec: &GridSpec, cells: &[f64], p: DVec3) -> f64 {
    let n = spec.n_cells.as_usizevec3();
    let at = (p - spec.low) / spec.edges() - DVec3::splat(0.5);
    let greatest = spec.n_cells.as_dvec3() - DVec3::ONE;
    if !(at.cmpge(DVec3::ZERO).all() && at.cmple(greatest).all()) {
        return 0.0;
    }
    let base = at.floor();
    let f = at - base;
    let i0 = base.as_usizevec3();
    // On the last centre the upper neighbour has weight 0 and need not exist.
    let i1 = (i0 + 1).min(n - 1);
    let cell = |x: usize, y: usize, z: usize| cells[x + n.x * (y + n.y * z)];
    let lerp = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
    let along_x = |y: usize, z: usize| lerp(cell(i0.x, y, z), cell(i1.x, y, z), f.x);
    let along_y = |z: usize| lerp(along_x(i0.y, z), along_x(i1.y, z), f.y);
    lerp(along_y(i0.z), along_y(i1.z), f.z)
}

/// Returns ρ = Σ κ e^{−|x − p|²/2σ²} in closed form.
pub fn density(blobs: &[Blob], x: DVec3) -> f64 {
    let of_blob = |blob: &Blob| {
        let r2 = blob.whiten(x - blob.position).length_squared() / (blob.sigma * blob.sigma);
        if r2 > UNSEEN { 0.0 } else { blob.kappa * (-0.5 * r2).exp() }
    };
    dense(blobs).map(of_blob).sum()
}

/// (Distance/σ)² beyond which a blob is skipped: e^{−50} of its peak, which even summed over 10⁶
/// blobs is below the rounding of 2⁻⁵³.
const UNSEEN: f64 = 100.0;

/// Returns the optical depth through all blobs along p + s d, s in [0, `length`], d unit; `length`
/// may be infinite.
///
/// Closed form (model.md §8): κσ√(π/2) e^{−b²/2σ²} [erf((length − s₀)/√2σ) + erf(s₀/√2σ)], s₀ the
/// foot of the centre on the line and b its distance.
pub fn optical_depth_exact(blobs: &[Blob], p: DVec3, d: DVec3, length: f64) -> f64 {
    let of_blob = |blob: &Blob| {
        let c = blob.position - p;
        let line = blob.along(c, d);
        if line.off * line.off > UNSEEN {
            return 0.0;
        }
        let white = blob.whiten(d);
        // Foot of the centre, and σ, along the line.
        let (foot, sigma) =
            (blob.whiten(c).dot(white) / white.length_squared(), blob.sigma / white.length());
        line.tau() * normal_share(-foot / sigma, (length - foot) / sigma)
    };
    dense(blobs).map(of_blob).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::cloud::SQRT_TAU;
    use crate::reference::{facets, transmit};
    use glam::UVec3;

    fn spec(n: u32, cell: f64, low: f64) -> GridSpec {
        GridSpec { aspect: 1.0, n_cells: UVec3::splat(n), cell, low: DVec3::splat(low) }
    }

    fn blob(x: f64, sigma: f64, kappa: f64) -> Blob {
        Blob { aspect: 1.0, position: DVec3::new(x, 0.3, -0.2), sigma, kappa }
    }

    #[test]
    fn cells_that_blobs_meet_by_hand() {
        let spec = spec(20, 0.5, -5.0);
        let at = |x: f64, sigma: f64, kappa: f64| Blob {
            aspect: 1.0,
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
        assert_eq!(n_deposited(&spec, &[Blob { aspect: 2.0, ..blobs[0] }]), 7.0 * 13.0 * 7.0);
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

    #[test]
    fn a_small_blob_lies_in_its_cell_or_is_halved_by_a_face() {
        // m = κ(√(2π)σ)³, by hand for κ = 2, σ = 0.1: 2·0.0157496… in one cell of volume 8.
        let one = Blob { aspect: 1.0, position: DVec3::splat(1.0), sigma: 0.1, kappa: 2.0 };
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

    #[test]
    fn samples_are_trilinear_and_end_at_the_last_centre() {
        let spec = GridSpec {
            aspect: 1.0,
            n_cells: UVec3::new(2, 3, 1),
            cell: 2.0,
            low: DVec3::new(-1.0, 0.0, 0.0),
        };
        // Cell values x + 10 y at centres x = 0, 2; y = 1, 3, 5; z = 1.
        let cells = [0.0, 1.0, 10.0, 11.0, 20.0, 21.0];
        let at = |x, y, z| sample(&spec, &cells, DVec3::new(x, y, z));
        assert_eq!((at(0.0, 1.0, 1.0), at(2.0, 5.0, 1.0), at(0.5, 3.5, 1.0)), (0.0, 21.0, 12.75));
        assert_eq!(
            (at(2.1, 3.0, 1.0), at(1.0, 0.9, 1.0), at(1.0, 3.0, 1.1), at(f64::NAN, 3.0, 1.0)),
            (0.0, 0.0, 0.0, 0.0)
        );
    }

    #[test]
    fn optical_depth_through_blobs() {
        let b = Blob { aspect: 1.0, position: DVec3::new(1.0, 2.0, 3.0), sigma: 0.5, kappa: 1.2 };
        let through = SQRT_TAU * 1.2 * 0.5;
        let tau = |p: DVec3, d, length| optical_depth_exact(&[b], p, d, length);
        // Relative errors of erf and exp: a few 1e-16.
        let same = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-13, "{a} {b}");
        same(tau(b.position - 40.0 * DVec3::X, DVec3::X, f64::INFINITY), through);
        same(tau(b.position, DVec3::Y, f64::INFINITY), 0.5 * through);
        // Offset by 2σ: e^{−2}; a segment of ±σ: erf(1/√2) = 0.682689492137086.
        same(
            tau(b.position + DVec3::new(-40.0, 1.0, 0.0), DVec3::X, 80.0),
            through * (-2f64).exp(),
        );
        same(tau(b.position - 0.5 * DVec3::Z, DVec3::Z, 1.0), through * 0.682_689_492_137_086);
        let none = Blob { sigma: 0.0, ..b };
        same(optical_depth_exact(&[b, none, b], b.position, DVec3::Y, f64::INFINITY), through);
    }

    #[test]
    fn the_grid_converges_to_the_closed_form_at_second_order() {
        let (sigma, kappa) = (1.0, 0.8);
        let error = |cells_per_sigma: u32| {
            let cell = sigma / f64::from(cells_per_sigma);
            // The blob sits on the centre of the middle cell, at every resolution.
            let n = 2 * 4 * cells_per_sigma + 1;
            let spec = GridSpec {
                aspect: 1.0,
                n_cells: UVec3::splat(n),
                cell,
                low: DVec3::splat(-0.5 * cell * f64::from(n)),
            };
            let blob = Blob { aspect: 1.0, position: DVec3::ZERO, sigma, kappa };
            let cells = deposit(&spec, &[blob]);
            let start = DVec3::X * spec.low.x;
            let tau = transmit::optical_depth(&spec, &cells, start, DVec3::X, f64::INFINITY, 0.5);
            // The mass that the cut moves is not an error of h: model.md's 0.54 %, on the two axes
            // across the line.
            let kept = erf(3.0 / 2f64.sqrt());
            // The whole line is meant: the part that its own axis cuts off is within the grid, too.
            let exact =
                optical_depth_exact(&[blob], 10.0 * start, DVec3::X, f64::INFINITY) / (kept * kept);
            tau / exact - 1.0
        };
        let errors = [2, 4, 8, 16].map(error);
        println!("relative errors of τ at h = σ/2, /4, /8, /16: {errors:?}");
        // A cell's mean of exp(−y²/2σ²) about its maximum is 1 − h²/24σ², on two axes: −h²/12σ²,
        // next term (h/σ)⁴/500.
        assert!((errors[3] * 12.0 * 256.0 + 1.0).abs() < 0.01);
        for pair in errors.windows(2) {
            assert!((pair[0] / pair[1] - 4.0).abs() < 0.1);
        }
    }

    #[test]
    fn far_from_the_grid_there_is_no_density() {
        let spec = GridSpec::fit(DVec3::splat(-3.0), DVec3::splat(3.0), 32, 1.0);
        let cells =
            deposit(&spec, &[Blob { aspect: 1.0, position: DVec3::ZERO, sigma: 1.0, kappa: 1.0 }]);
        let density = cells.iter().sum::<f64>() * spec.cell.powi(3);
        assert!((density / SQRT_TAU.powi(3) - 1.0).abs() < 1e-12);
        assert_eq!(sample(&spec, &cells, DVec3::splat(9.0)), 0.0);
        // Along the grid's diagonal density falls from the centre, so that no facet turns inward.
        let q = facets::gradient(|x| sample(&spec, &cells, x), DVec3::ONE, 0.5, 1.0).0;
        assert!(q.x < 0.0 && (q.x - q.y).abs() < 1e-12);
    }
}
