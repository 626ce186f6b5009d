//! Tests of the deposit.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::DVec3;
use libm::erf;

use super::shares::WITHIN_CUT;
use super::*;
use crate::model::cloud::{SQRT_TAU, Shape};
use crate::model::grid::MAX_LEVELS;

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
    let blobs = [at(0.1, 0.5, 1.0), at(5.0, 0.5, 1.0), at(7.0, 0.5, 1.0), at(f64::NAN, 0.5, 1.0)];
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

/// Bounds of what blurs change, over a blob's peak, and the σ in cells from which they hold.
const NARROW_ERRORS: [(f64, f64); 3] = [(1.125, 9e-2), (1.5, 2.2e-2), (1.75, 1.2e-2)];

#[test]
fn blurred_blobs_keep_mass_and_differ_by_their_bounds() {
    let mut greatest = [0.0_f64; 3];
    for i in 0..150 {
        let (a, b) = (f64::from(i) * 0.618_034 % 1.0, f64::from(i) * 0.754_877_7 % 1.0);
        let sigma = 1.125 + 1.874 * f64::from(i) / 150.0;
        let spec = spec((6.0 * sigma).ceil() as u32 + 4 + i % 3, 1.0, 0.0);
        let middle = 0.5 * spec.n_cells.x as f64;
        let position = middle + 0.5 * DVec3::new(a - 0.5, b - 0.5, 0.5 - a);
        let blob = Blob { shape: Shape::BALL, position, sigma, kappa: 0.7 };
        assert!(is_narrowed(&spec, &blob));
        let (narrow, exact) =
            (deposit_narrow(&spec, &[blob]), deposit_by_levels(&spec, &[blob], 1));
        let sum = |cells: &[f64]| cells.iter().sum::<f64>();
        assert!((sum(&narrow) / sum(&exact) - 1.0).abs() < 1e-12);
        // Place and variance along x are those of the blob in its cells, but for the mirrored tail:
        // 0.3 % of the mass lies beyond 3σ, where the ends are.
        let along = |f: &dyn Fn(f64) -> f64| {
            let of = |c: usize| f(spec.center(c).x) * narrow[c];
            (0..narrow.len()).map(of).sum::<f64>() / sum(&narrow)
        };
        let mean = along(&|x| x);
        assert!((mean - position.x).abs() < 2e-3, "{mean} {position}");
        let variance = along(&|x| (x - mean).powi(2));
        let expected = sigma * sigma + 1.0 / 12.0;
        assert!((variance / expected - 1.0).abs() < 1e-3, "{variance} {expected}");
        let off = narrow.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let of = NARROW_ERRORS.iter().rposition(|(from, _)| sigma >= *from).unwrap();
        greatest[of] = greatest[of].max(off / blob.kappa);
    }
    println!("greatest differences over the blob's peak: {greatest:?}");
    for (greatest, (_, bound)) in greatest.into_iter().zip(NARROW_ERRORS) {
        assert!(greatest < bound && greatest > 0.5 * bound, "{greatest} {bound}");
    }
}

#[test]
fn a_spline_and_a_blur_by_hand() {
    // In the middle of a cell: 1/8, 3/4, 1/8. On a face: 1/2, 1/2.
    let spec = spec(7, 1.0, 0.0);
    let one = |x: f64| {
        let position = DVec3::new(x, 3.5, 3.5);
        let blob = Blob { shape: Shape::BALL, position, sigma: 2.0, kappa: 1.0 };
        let mut along = [0.0; 7];
        super::narrow::each_share(&spec, &blob, |c, share| along[c % 7] += share);
        along
    };
    assert_eq!(one(3.5), [0.0, 0.0, 0.125, 0.75, 0.125, 0.0, 0.0]);
    assert_eq!(one(3.0), [0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0]);
    let row = |cells: [f64; 4]| blurred(&cells, UVec3::new(4, 1, 1), 0);
    assert_eq!(row([0.0, 96.0, 0.0, 0.0]), [21.0, 54.0, 20.0, 1.0]);
    assert_eq!(row([96.0, 0.0, 0.0, 0.0]), [74.0, 21.0, 1.0, 0.0]);
    // Along y and z the neighbours lie a row and a layer further.
    let mut cells = vec![0.0; 8];
    cells[0] = 96.0;
    assert_eq!(blurred(&cells, UVec3::splat(2), 1)[..4], [74.0, 0.0, 22.0, 0.0]);
    assert_eq!(blurred(&cells, UVec3::splat(2), 2)[4], 22.0);
}

#[test]
fn many_blobs_of_some_cells_are_blurred() {
    let spec = spec(20, 1.0, 0.0);
    // Every other one has a σ of one cell, and stays as wide as it is.
    let of = |i: usize| Blob {
        position: DVec3::new(10.0, 9.5, 9.5) + 0.001 * (i % 7) as f64,
        ..blob(0.0, [1.0, 2.0][i % 2], 1.0)
    };
    let blobs: Vec<Blob> = (0..24_000).map(of).collect();
    let narrowed: Vec<Blob> = blobs.iter().skip(1).step_by(2).copied().collect();
    let others: Vec<Blob> = blobs.iter().step_by(2).copied().collect();
    let found = deposit(&spec, &blobs);
    let parts = [deposit_narrow(&spec, &narrowed), deposit_by_levels(&spec, &others, 6)];
    for (c, found) in found.iter().enumerate() {
        assert!((found - parts[0][c] - parts[1][c]).abs() <= 1e-12 * found);
    }
    assert_eq!(n_deposited(&spec, &blobs), 12_000.0 * 54.0 + n_deposited(&spec, &others));
    // One less, and none is blurred.
    let few = deposit_by_levels(&spec, &blobs[..23_999], 6);
    assert_eq!(deposit(&spec, &blobs[..23_999]), few);
    assert!(n_deposited(&spec, &blobs[..23_999]) > 2.0 * n_deposited(&spec, &blobs));
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
    assert!(first == 1 && weights.len() == 2 && weights.iter().all(|w| (w - 0.5).abs() < 1e-15));
}

#[test]
fn weights_are_shares_of_the_normal_distribution() {
    // Cells of one σ about p: the published shares 34.134 %, 13.591 %, 2.140 % over their sum
    // 99.730 %.
    let (first, w) = axis_weights(5.0 + 1e-9, 1.0 - 1e-9, 0.0, 1.0, 10);
    assert_eq!((first, w.len()), (2, 6));
    for (w, share) in
        w.iter().zip([0.021_400_2, 0.135_905_1, 0.341_344_7, 0.341_344_7, 0.135_905_1, 0.021_400_2])
    {
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

/// Ellipsoids whose axes are turned.
mod turned {
    use glam::{DMat3, DQuat, DVec3, UVec3};

    use crate::model::cloud::Shape;
    use crate::model::grid::GridSpec;
    use crate::reference::Blob;
    use crate::reference::deposit::{axis_weights, deposit_on, spread as spread_to};

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
            // The mean is kept where slabs and rows are narrow against the blob. A blob that is
            // narrow against a cell has the place of its cells, up to half of one off on each axis.
            for (scales, cell, most_off) in [
                (DVec3::new(0.6, 0.2, 0.4), 0.1, 1e-3),
                (DVec3::new(0.9, 0.05, 0.5), 0.15, 1e-3),
                (DVec3::new(0.05, 0.9, 0.05), 0.2, 0.5),
                (DVec3::new(0.03, 0.02, 0.01), 0.4, 0.87),
            ] {
                let (spec, blob) = (spec(61, cell), blob(scales, turned));
                let (mass, mean, found) = moments(&spec, &deposit_on(&spec, 0, &[blob]));
                assert!((mass / blob.mass() - 1.0).abs() < 1e-12, "{mass}");
                assert!((mean - blob.position).length() < most_off * cell, "{mean}");
                // A cut at 3σ takes 2.7 % of a variance, and an axis is cut in up to two ways.
                // Cells add at most a quarter of their edge's square: two share a narrow blob.
                let expected = blob.sigma * blob.sigma * blob.shape.covariance();
                let most = 2.0 * 0.027 * blob.sigma * blob.sigma + 0.25 * cell * cell;
                let rest = (found - expected).to_cols_array();
                let greatest = rest.into_iter().fold(0.0, |m: f64, v| m.max(v.abs()));
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
        // Flat along y, and then turned to be flat along x.
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
            // The stored quarter turn is exact but for roundings of f64.
            assert!((found - expected).abs() < 1e-12 * turned.kappa, "{at} {found} {expected}");
        }
    }

    #[test]
    fn wider_cells_keep_the_spread() {
        let spec = spec(64, 0.1);
        let blob = blob(DVec3::new(0.9, 0.5, 0.7), turns()[2]);
        let mut cells = deposit_on(&spec, 0, &[]);
        spread_to(&spec, &deposit_on(&spec, 1, &[blob]), &mut cells);
        let fine = deposit_on(&spec, 0, &[blob]);
        let off = cells.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // The bound of deposit_by_levels.
        assert!(off < 9e-3 * blob.kappa && off > 1e-5, "{}", off / blob.kappa);
    }
}
