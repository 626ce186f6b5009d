//! The blobs' extinction and albedo on a grid, as Mitsuba reads it.

use glam::DVec3;

use crate::error::{Error, Result};
use crate::model::parallel::parallel_map;
use crate::reference::Blob;
use crate::reference::picture::TransportParts;

/// Optical depth of any line that a blob keeps beyond the grid's cells.
const OMITTED: f64 = 1e-5;
/// Cells along σ, where no step is given, of all blobs but the narrowest ones.
const CELLS_A_SIGMA: f64 = 4.0;
/// Share of all mass that narrower blobs have.
const NARROWER: f64 = 0.01;
/// Most cells of a grid: 256 MiB of extinction, and four times that while it is made.
const MOST_CELLS: f64 = (64u64 << 20) as f64;
/// Most cells where no step is given.
const USUAL_CELLS: f64 = (16u64 << 20) as f64;
/// A grid of numbers over a box.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Low and high corner.
    pub bounds: [DVec3; 2],
    /// Cells along x, y and z.
    pub n: [u32; 3],
    /// Numbers of a cell.
    pub n_channels: u32,
    /// The numbers at the cells' centres, x first.
    pub values: Vec<f32>,
}

/// Returns the number of σ out to which a blob is on the grid.
pub(super) fn reach(blob: &Blob) -> f64 {
    let cut = (blob.deepest() / OMITTED).ln();
    if cut > 0.0 && blob.sigma > 0.0 { (2.0 * cut).sqrt() } else { 0.0 }
}

/// Returns low and high corner of blobs.
fn bounds(blobs: &[Blob], shown: &[usize]) -> [DVec3; 2] {
    let of = |&i: &usize| {
        let extent = reach(&blobs[i]) * blobs[i].extents();
        [blobs[i].position - extent, blobs[i].position + extent]
    };
    let all = shown.iter().map(of).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    all.unwrap_or_default()
}

/// Returns a step that all blobs but the narrowest have four of along σ, or a wider one that makes
/// a usual number of cells.
pub(super) fn usual_step(blobs: &[Blob], shown: &[usize]) -> f64 {
    let mut by_width = shown.to_vec();
    by_width.sort_by(|&a, &b| blobs[a].narrowest().total_cmp(&blobs[b].narrowest()));
    let all: f64 = shown.iter().map(|&i| blobs[i].mass()).sum();
    let mut left = NARROWER * all;
    let is_wide = |&&i: &&usize| {
        left -= blobs[i].mass();
        left < 0.0
    };
    let narrow = by_width.iter().find(is_wide).map_or(1.0, |&i| blobs[i].narrowest());
    let [low, high] = bounds(blobs, shown);
    let volume: f64 = (high - low).to_array().iter().product();
    (narrow / CELLS_A_SIGMA).max((volume / USUAL_CELLS).cbrt())
}

/// Returns the extinction and the mean albedo of the cells. A blob has its whole mass on the grid.
pub(super) fn extinction(
    parts: &TransportParts,
    shown: &[usize],
    step: f64,
) -> Result<(Grid, Option<Grid>)> {
    let [low, high] = bounds(&parts.blobs, shown);
    let cells = ((high - low) / step).ceil().max(DVec3::splat(2.0));
    let n_cells = cells.x * cells.y * cells.z;
    if n_cells.is_nan() || n_cells > MOST_CELLS {
        let fits = step * (n_cells / MOST_CELLS).cbrt();
        return Err(Error::usage(format!(
            "a grid of {:.0} x {:.0} x {:.0} cells of {step} is too large; expected --step \
             {fits:.4} or more",
            cells.x, cells.y, cells.z
        )));
    }
    let n = cells.to_array().map(|n| n as u32);
    let layers = parallel_map(n[2] as usize, |k| layer(parts, shown, (low, step), n, k as u32));
    let bounds = [low, low + step * cells];
    let cells = || layers.iter().flatten();
    let values = cells().map(|v| v[3]).collect();
    // Cells without a blob have any albedo.
    let share = |c: f32, of: f32| if of > 0.0 { c / of } else { 1.0 };
    let of_albedo = cells().flat_map(|v| [0, 1, 2].map(|k| share(v[k], v[3]))).collect();
    Ok((
        Grid { bounds, n, n_channels: 1, values },
        Some(Grid { bounds, n, n_channels: 3, values: of_albedo }),
    ))
}

/// Returns albedo times extinction, and extinction, of the cells of layer `k` along z.
fn layer(
    parts: &TransportParts,
    shown: &[usize],
    (low, step): (DVec3, f64),
    n: [u32; 3],
    k: u32,
) -> Vec<[f32; 4]> {
    let mut cells = vec![[0f64; 4]; (n[0] * n[1]) as usize];
    let center = |k: u32| step * (f64::from(k) + 0.5);
    for &i in shown {
        let blob = &parts.blobs[i];
        let albedo = parts.scatterers[parts.i_scatterer[i] as usize].albedo;
        let extents = blob.extents();
        let (extent, at) = (reach(blob) * extents, blob.position - low);
        let range = |axis: usize| {
            let first = ((at[axis] - extent[axis]) / step).floor().max(0.0) as u32;
            let end = ((at[axis] + extent[axis]) / step).ceil();
            first..(end.max(0.0) as u32).min(n[axis])
        };
        if !range(2).contains(&k) {
            continue;
        }
        // Shares of the mass along an axis. Of a blob that is narrow against the cells, the samples
        // would not add up to its mass.
        let shares = |axis: usize| -> Vec<f64> {
            let sigma = extents[axis];
            let value = |k: u32| (-0.5 * ((center(k) - at[axis]) / sigma).powi(2)).exp();
            let sum: f64 = range(axis).map(value).sum();
            let nearest = ((at[axis] / step) as u32).min(n[axis] - 1);
            let share = |k: u32| match sum > 1e-3 {
                true => value(k) / sum,
                false => f64::from(u8::from(k == nearest)),
            };
            range(axis).map(share).collect()
        };
        let [of_x, of_y, of_z] = [0, 1, 2].map(shares);
        let of_layer = blob.mass() / step.powi(3) * of_z[(k - range(2).start) as usize];
        for (y, j) in of_y.iter().zip(range(1)) {
            let of_row = of_layer * y;
            for (x, i) in of_x.iter().zip(range(0)) {
                let density = of_row * x;
                let cell = &mut cells[(j * n[0] + i) as usize];
                for (c, a) in cell.iter_mut().zip([albedo.x, albedo.y, albedo.z, 1.0]) {
                    *c += a * density;
                }
            }
        }
    }
    cells.into_iter().map(|cell| cell.map(|v| v as f32)).collect()
}

impl Grid {
    /// Returns the grid as a file of Mitsuba (version 3, f32).
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = b"VOL\x03".to_vec();
        let words = [1, self.n[0], self.n[1], self.n[2], self.n_channels];
        bytes.extend(words.iter().flat_map(|w| w.to_le_bytes()));
        let corners = self.bounds.iter().flat_map(|v| v.to_array());
        bytes.extend(corners.flat_map(|v| (v as f32).to_le_bytes()));
        bytes.extend(self.values.iter().flat_map(|v| v.to_le_bytes()));
        bytes
    }
}
