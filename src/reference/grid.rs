//! The density grid, model.md §8 and passes.md "sample": cells sampled trilinearly, and the closed
//! form of the optical depth that the grid approximates.
//!
//! Densities are extinction per unit length. Cell (x, y, z) is at index x + n_x (y + n_y z).

use glam::DVec3;

use super::Blob;
use super::deposit::{dense, normal_share};
use crate::model::grid::GridSpec;

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
    use glam::UVec3;
    use libm::erf;

    use crate::model::cloud::{SQRT_TAU, Shape};
    use crate::reference::deposit::{deposit, deposit_on};
    use crate::reference::{facets, transmit};

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
        let b = Blob {
            shape: Shape::BALL,
            position: DVec3::new(1.0, 2.0, 3.0),
            sigma: 0.5,
            kappa: 1.2,
        };
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
            let blob = Blob { shape: Shape::BALL, position: DVec3::ZERO, sigma, kappa };
            // On the finest cells: wider ones have an error of their own (deposit.rs).
            let cells = deposit_on(&spec, 0, &[blob]);
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
        let cells = deposit(
            &spec,
            &[Blob { shape: Shape::BALL, position: DVec3::ZERO, sigma: 1.0, kappa: 1.0 }],
        );
        let density = cells.iter().sum::<f64>() * spec.cell.powi(3);
        assert!((density / SQRT_TAU.powi(3) - 1.0).abs() < 1e-12);
        assert_eq!(sample(&spec, &cells, DVec3::splat(9.0)), 0.0);
        // Along the grid's diagonal density falls from the centre, so that no facet turns inward.
        let q = facets::gradient(|x| sample(&spec, &cells, x), DVec3::ONE, 0.5, &Shape::BALL).0;
        assert!(q.x < 0.0 && (q.x - q.y).abs() < 1e-12);
    }
}
