//! The deposit of the blobs' mass in the density grid, model.md §8 and passes.md "grid". It is
//! conservative, and separable where blobs are upright. Wide blobs are deposited on wide cells,
//! which are spread to the finest ones. Many blobs of some cells are deposited narrower than they
//! are, and blurred.
//!
//! Densities are extinction per unit length. Cell (x, y, z) is at index x + n_x (y + n_y z).

use glam::{DVec3, UVec3};

use super::Blob;
use crate::model::grid::{GridSpec, NARROW_UPDATES, given_by_coarser};

mod narrow;
mod shares;
#[cfg(test)]
mod tests;
mod turned;

pub use narrow::{blurred, deposit_narrow, is_narrowed};
pub use shares::axis_weights;
pub(super) use shares::normal_share;
use shares::reached;

/// Returns the blobs that have extinction.
pub(super) fn dense(blobs: &[Blob]) -> impl Iterator<Item = &Blob> {
    blobs.iter().filter(|b| b.sigma > 0.0 && b.kappa > 0.0)
}

/// Returns the density of every cell. A blob outside the grid, or with σ = 0 or κ = 0, deposits
/// nothing.
pub fn deposit(spec: &GridSpec, blobs: &[Blob]) -> Vec<f64> {
    let has_narrow = has_narrow(spec, blobs);
    let (narrowed, others): (Vec<Blob>, Vec<Blob>) =
        dense(blobs).partition(|blob| has_narrow && is_narrowed(spec, blob));
    let mut cells = deposit_by_levels(spec, &others, spec.n_levels(blobs.len() as u64));
    if !narrowed.is_empty() {
        let own = deposit_narrow(spec, &narrowed);
        cells.iter_mut().zip(own).for_each(|(cell, own)| *cell += own);
    }
    cells
}

/// Returns whether some blobs are deposited narrower than they are.
fn has_narrow(spec: &GridSpec, blobs: &[Blob]) -> bool {
    let are_upright = blobs.iter().all(|blob| blob.shape.is_upright());
    let aspects = blobs.iter().fold([f64::INFINITY, 0.0_f64], |[least, greatest], blob| {
        [least.min(blob.shape.aspect), greatest.max(blob.shape.aspect)]
    });
    spec.has_narrow(blobs.len() as u64, are_upright.then_some(aspects))
}

/// Returns the density with wide blobs on wide cells of so many levels, which are spread to the
/// finest ones.
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

/// Returns the level, of `n_levels`, that a blob is deposited on. Spreading adds variance along all
/// axes, so that the level follows from the blob's least variance in any direction.
pub fn level_of(spec: &GridSpec, blob: &Blob, n_levels: u32) -> u32 {
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
    let has_narrow = has_narrow(spec, blobs);
    let of_blob = |blob: &Blob| {
        if has_narrow && is_narrowed(spec, blob) {
            return NARROW_UPDATES;
        }
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
