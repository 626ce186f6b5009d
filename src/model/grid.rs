//! The density grid of model.md §8: cells over everything that attenuates light, positions relative
//! to the lighting origin. Cells are cubes where blobs are balls, and as flat as they are on the
//! mean elsewhere (docs/model.md §14).

use glam::{DVec3, UVec3};

/// Blobs are deposited within this many σ of their centre along each axis, and what lies outside is
/// given to the rest so that mass is kept: 1 − erf(3/√2) = 0.27 % an axis moves by at most 3σ.
pub const DEPOSIT_CUT_SIGMA: f64 = 3.0;

/// Cells of margin around the bounds, so that trilinear sampling at the bounds never leaves the
/// grid.
pub const MARGIN_CELLS: u32 = 2;

/// Greatest number of cells along an axis, the deposit kernel's shared memory: 3 axes of this many
/// weights are 6 KiB of the 16 KiB every Vulkan device has.
pub const MAX_CELLS: u32 = 512;

/// Most steps of one march toward a light. A scene whose step is finer than its grid's diagonal in
/// this many is refused, so that no march is ever cut short.
pub const MAX_MARCH_STEPS: u32 = 4096;

/// The finest march step, in cells, of a grid of `n` cells a side.
pub fn min_step(n: u32) -> f64 {
    3f64.sqrt() * f64::from(n) / f64::from(MAX_MARCH_STEPS)
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridSpec {
    pub n_cells: UVec3,
    /// Edge of the cells along x and z.
    pub cell: f64,
    /// Their edge along y over that; 1: cubes.
    pub aspect: f64,
    /// Low corner of cell (0, 0, 0).
    pub low: DVec3,
}

impl GridSpec {
    /// The grid of cubes whose longest axis has `n` cells, margin included, and covers
    /// `low`..`high`.
    pub fn fit(low: DVec3, high: DVec3, n: u32) -> GridSpec {
        GridSpec::fit_cells(low, high, n, 1.0)
    }

    /// The same of cells `aspect` times as high as wide: no axis has more than `n` cells.
    pub fn fit_cells(low: DVec3, high: DVec3, n: u32, aspect: f64) -> GridSpec {
        // Bounds without extent still need a cell: 1 unit, since there is no other length to take.
        let shape = DVec3::new(1.0, aspect, 1.0);
        let extent = (high - low).max(DVec3::ZERO) / shape;
        let longest = extent.max_element();
        let longest = if longest > 0.0 { longest } else { 1.0 };
        let inner = n.clamp(2 * MARGIN_CELLS + 1, MAX_CELLS) - 2 * MARGIN_CELLS;
        let cell = longest / f64::from(inner);
        let cells = (extent / cell - 1e-9).ceil().as_uvec3().clamp(UVec3::ONE, UVec3::splat(inner));
        let n_cells = cells + UVec3::splat(2 * MARGIN_CELLS);
        let low = 0.5 * (low + high) - 0.5 * cell * shape * n_cells.as_dvec3();
        GridSpec { n_cells, cell, aspect, low }
    }

    pub fn n_total(&self) -> u64 {
        u64::from(self.n_cells.x) * u64::from(self.n_cells.y) * u64::from(self.n_cells.z)
    }

    pub fn high(&self) -> DVec3 {
        self.low + self.edges() * self.n_cells.as_dvec3()
    }

    /// Edges of a cell.
    pub fn edges(&self) -> DVec3 {
        self.cell * DVec3::new(1.0, self.aspect, 1.0)
    }

    pub fn cell_volume(&self) -> f64 {
        self.cell.powi(3) * self.aspect
    }

    /// Cells' widths that a unit along `d` passes: 1/cell where cells are cubes and `d` is a unit
    /// vector.
    pub fn cells_along(&self, d: DVec3) -> f64 {
        (d / self.edges()).length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_covers_its_bounds_with_the_margin() {
        let (low, high) = (DVec3::new(-3.0, 0.0, 1.0), DVec3::new(5.0, 2.0, 1.5));
        let grid = GridSpec::fit(low, high, 64);
        assert_eq!(grid.n_cells, UVec3::new(64, 19, 8));
        let margin = f64::from(MARGIN_CELLS) * grid.cell - 1e-9;
        assert!(
            (low - grid.low).min_element() >= margin
                && (grid.high() - high).min_element() >= margin
        );
    }

    #[test]
    fn bounds_without_extent_still_have_cells() {
        let grid = GridSpec::fit(DVec3::ONE, DVec3::ONE, 16);
        assert!(grid.cell > 0.0 && grid.n_total() > 0 && grid.low.is_finite());
    }
}
