//! The density grid, model.md §8 and §11 "grid", "sample": blobs' mass deposited conservatively into cubic
//! cells, sampled trilinearly; and the closed form of the optical depth that the grid approximates.
//! Densities are extinction per unit length; cell (x, y, z) is at index x + n_x (y + n_y z).

use std::f64::consts::FRAC_1_SQRT_2;

use glam::DVec3;
use libm::{erf, erfc};

use super::Blob;
use crate::model::cloud::SQRT_TAU;
use crate::model::grid::{DEPOSIT_CUT_SIGMA, GridSpec};

/// m = ∫ρ dV = κ (2π)^{3/2} σ³ of one blob.
pub fn mass(blob: &Blob) -> f64 {
    blob.kappa * (SQRT_TAU * blob.sigma).powi(3)
}

/// Density of every cell. A blob none of whose cells exist, or with σ = 0 or κ = 0, deposits nothing.
pub fn deposit(spec: &GridSpec, blobs: &[Blob]) -> Vec<f64> {
    let n = spec.n_cells.as_usizevec3();
    let mut cells = vec![0.0; n.x * n.y * n.z];
    let volume = spec.cell.powi(3);
    for blob in blobs.iter().filter(|b| b.sigma > 0.0 && b.kappa > 0.0) {
        let axis = |i: usize| axis_weights(blob.position[i], blob.sigma, spec.low[i], spec.cell, n[i]);
        let ((x0, wx), (y0, wy), (z0, wz)) = (axis(0), axis(1), axis(2));
        let density = mass(blob) / volume;
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

/// First cell and weights of one axis: the blob's share of every whole cell that meets [p − 3σ, p + 3σ] and
/// exists, normalised to sum 1. Empty where there is no such cell.
pub fn axis_weights(p: f64, sigma: f64, low: f64, cell: f64, n: usize) -> (usize, Vec<f64>) {
    let reach = DEPOSIT_CUT_SIGMA * sigma;
    let first = ((p - reach - low) / cell).floor().max(0.0);
    let last = ((p + reach - low) / cell).floor().min(n as f64 - 1.0);
    // Also where p is NaN.
    if !(first <= last) {
        return (0, Vec::new());
    }
    let (first, last) = (first as usize, last as usize);
    let edge = |i: usize| (low + cell * i as f64 - p) / sigma;
    let mut weights: Vec<f64> = (first..=last).map(|i| normal_share(edge(i), edge(i + 1))).collect();
    let sum: f64 = weights.iter().sum();
    for w in &mut weights {
        *w /= sum;
    }
    (first, weights)
}

/// Share of the unit normal distribution in [a, b]: ½[erf(b/√2) − erf(a/√2)], in its tails through erfc.
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

/// Density at `p`: trilinear between cell centres, 0 outside the hull of the outermost ones.
pub fn sample(spec: &GridSpec, cells: &[f64], p: DVec3) -> f64 {
    let n = spec.n_cells.as_usizevec3();
    let at = (p - spec.low) / spec.cell - DVec3::splat(0.5);
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

/// Optical depth through all blobs along p + s d, s in [0, `length`], d unit; `length` may be infinite. Closed
/// form (model.md §8): κσ√(π/2) e^{−b²/2σ²} [erf((length − s₀)/√2σ) + erf(s₀/√2σ)], s₀ the foot of the centre
/// on the line and b its distance.
pub fn optical_depth_exact(blobs: &[Blob], p: DVec3, d: DVec3, length: f64) -> f64 {
    let of_blob = |blob: &Blob| {
        let c = blob.position - p;
        let s0 = c.dot(d);
        let b2 = c.cross(d).length_squared() / (blob.sigma * blob.sigma);
        let share = normal_share(-s0 / blob.sigma, (length - s0) / blob.sigma);
        SQRT_TAU * blob.kappa * blob.sigma * (-0.5 * b2).exp() * share
    };
    blobs.iter().filter(|b| b.sigma > 0.0 && b.kappa > 0.0).map(of_blob).sum()
}
