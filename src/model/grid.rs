//! The density grid of model.md §8: cells over everything that attenuates light, relative to the
//! lighting origin. Cells are cubes for round blobs, otherwise as flat as the mean blob
//! (model.md §14).

use glam::{DVec3, UVec3};

/// Half width of a deposited blob along each axis, σ. Mass outside, 1 − erf(3/√2) = 0.27 % an axis,
/// is spread over the rest, so that mass is kept.
pub const DEPOSIT_CUT_SIGMA: f64 = 3.0;

/// Margin around the bounds, cells: trilinear sampling at the bounds never leaves the grid.
pub const MARGIN_CELLS: u32 = 2;

/// Greatest number of cells along an axis. It bounds the deposit kernel's shared memory: 3 axes of
/// this many weights are 6 KiB of the 16 KiB that every Vulkan device has.
pub const MAX_CELLS: u32 = 512;

/// Greatest number of steps of a march toward a light. A scene whose step is finer than its grid's
/// diagonal over this number is refused, so that no march is cut short.
pub const MAX_MARCH_STEPS: u32 = 4096;

/// Returns the finest march step, in cells, of a grid of `n` cells a side.
pub fn min_step(n: u32) -> f64 {
    3f64.sqrt() * f64::from(n) / f64::from(MAX_MARCH_STEPS)
}

/// Place and size of a density grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridSpec {
    /// Number of cells along each axis.
    pub n_cells: UVec3,
    /// Edge of the cells along x and z.
    pub cell: f64,
    /// Edge along y over the edge along x and z; 1 for cubes.
    pub aspect: f64,
    /// Low corner of cell (0, 0, 0).
    pub low: DVec3,
}

impl GridSpec {
    /// Returns the grid that covers `low`..`high`. Its cells are `aspect` times as high as wide,
    /// and its longest axis has `n` of them, margin included. The numbers along the others are even
    /// or odd as `n` is.
    pub fn fit(low: DVec3, high: DVec3, n: u32, aspect: f64) -> GridSpec {
        // Bounds without extent still need a cell; there is no other length to take than 1 unit.
        let shape = DVec3::new(1.0, aspect, 1.0);
        let extent = (high - low).max(DVec3::ZERO) / shape;
        let longest = extent.max_element();
        let longest = if longest > 0.0 { longest } else { 1.0 };
        let inner = n.clamp(2 * MARGIN_CELLS + 1, MAX_CELLS) - 2 * MARGIN_CELLS;
        let cell = longest / f64::from(inner);
        // Layers come and go in pairs, one at each end, so that the others stay where they are
        // while the bounds move.
        let odd = inner % 2;
        let pairs = (0.5 * (extent / cell - f64::from(odd)) - 1e-9).ceil().max(DVec3::ZERO);
        let cells = 2 * pairs.as_uvec3() + UVec3::splat(odd);
        let cells = cells.clamp(UVec3::splat(2 - odd), UVec3::splat(inner));
        let n_cells = cells + UVec3::splat(2 * MARGIN_CELLS);
        let low = 0.5 * (low + high) - 0.5 * cell * shape * n_cells.as_dvec3();
        GridSpec { n_cells, cell, aspect, low }
    }

    /// Returns the grid of cells that are `edge` times as wide. The outermost ones may reach beyond
    /// the box.
    pub fn merged(&self, edge: u32) -> GridSpec {
        let before = self.n_cells.map(|n| cells_before(n, edge));
        let n_cells = (self.n_cells + before).map(|n| n.div_ceil(edge));
        let low = self.low - self.edges() * before.as_dvec3();
        GridSpec { n_cells, cell: self.cell * f64::from(edge), low, ..*self }
    }

    /// Returns the number of cells.
    pub fn n_total(&self) -> u64 {
        u64::from(self.n_cells.x) * u64::from(self.n_cells.y) * u64::from(self.n_cells.z)
    }

    /// Returns the high corner of the last cell.
    pub fn high(&self) -> DVec3 {
        self.low + self.edges() * self.n_cells.as_dvec3()
    }

    /// Returns the edges of a cell along x, y and z.
    pub fn edges(&self) -> DVec3 {
        self.cell * DVec3::new(1.0, self.aspect, 1.0)
    }

    /// Returns the volume of a cell.
    pub fn cell_volume(&self) -> f64 {
        self.cell.powi(3) * self.aspect
    }

    /// Returns the centre of cell `c`.
    pub fn center(&self, c: usize) -> DVec3 {
        let n = self.n_cells.as_usizevec3();
        let at = DVec3::new((c % n.x) as f64, (c / n.x % n.y) as f64, (c / (n.x * n.y)) as f64);
        self.low + self.edges() * (at + 0.5)
    }

    /// Returns 1 over the mean chord 4V/A of the box.
    pub fn inverse_chord(&self) -> f64 {
        0.5 * (self.high() - self.low).recip().element_sum()
    }

    /// Returns how many cell widths a step of `d` passes: |d|/cell where cells are cubes.
    pub fn cells_along(&self, d: DVec3) -> f64 {
        (d / self.edges()).length()
    }
}

/// Returns how many cells the first merged one reaches beyond the box, of `n` along an axis that
/// are merged by `edge`. A merged cell begins in the middle of the box, so that it stays when
/// layers of cells come and go at both ends.
pub fn cells_before(n: u32, edge: u32) -> u32 {
    (edge - n / 2 % edge) % edge
}

/// Number of patches along each edge of the box's faces, through which light passes between the
/// cells and surfaces or ground.
pub const PATCHES: u32 = 8;

/// Number of cells at which a grid is coarse enough to be solved by sweeps alone.
pub const COARSEST_CELLS: u32 = 64;

/// Returns the next coarser grid of `n` cells with the given edges, and the axes along which pairs
/// of its cells are merged: those along which cells are short. `None` for the coarsest.
pub fn coarser(n: UVec3, edges: DVec3) -> Option<(UVec3, [bool; 3])> {
    if n.element_product() <= COARSEST_CELLS {
        return None;
    }
    let long = |axis: usize| n[axis] > 1;
    let least = (0..3).filter(|a| long(*a)).map(|a| edges[a]).fold(f64::INFINITY, f64::min);
    let halved = [0, 1, 2].map(|axis| long(axis) && edges[axis] < 1.5 * least);
    let of = |axis: usize| if halved[axis] { n[axis].div_ceil(2) } else { n[axis] };
    Some((UVec3::new(of(0), of(1), of(2)), halved))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_cells_are_merged_across_first() {
        let n = UVec3::new(16, 9, 16);
        let (halved, axes) = coarser(n, DVec3::new(1.0, 0.2, 1.0)).expect("more than 64 cells");
        assert_eq!((halved, axes), (UVec3::new(16, 5, 16), [false, true, false]));
        let (next, axes) = coarser(halved, DVec3::new(1.0, 0.8, 1.0)).expect("more than 64");
        assert_eq!((next, axes), (UVec3::new(8, 3, 8), [true; 3]));
        // Along an axis of one cell nothing is merged, however short the cell is.
        let (next, _) = coarser(UVec3::new(65, 1, 1), DVec3::new(1.0, 0.1, 0.1)).expect("65");
        assert_eq!(next, UVec3::new(33, 1, 1));
        assert_eq!(coarser(UVec3::new(4, 4, 4), DVec3::ONE), None);
    }

    #[test]
    fn the_mean_chord_of_a_cube_is_two_thirds_of_its_edge() {
        let cube = GridSpec { n_cells: UVec3::splat(3), cell: 2.0, aspect: 1.0, low: DVec3::ZERO };
        assert!((cube.inverse_chord() - 0.25).abs() < 1e-15);
        assert_eq!(cube.center(1 + 3 * (2 + 3)), DVec3::new(3.0, 5.0, 3.0));
    }

    #[test]
    fn the_grid_covers_its_bounds_with_the_margin() {
        let (low, high) = (DVec3::new(-3.0, 0.0, 1.0), DVec3::new(5.0, 2.0, 1.5));
        let grid = GridSpec::fit(low, high, 64, 1.0);
        assert_eq!(grid.n_cells, UVec3::new(64, 20, 8));
        let margin = f64::from(MARGIN_CELLS) * grid.cell - 1e-9;
        assert!(
            (low - grid.low).min_element() >= margin
                && (grid.high() - high).min_element() >= margin
        );
    }

    #[test]
    fn cells_stay_where_they_are_when_others_come() {
        for n in [24, 25] {
            let fit = |y: f64| GridSpec::fit(DVec3::new(-3.0, -y, 0.0), DVec3::splat(5.0), n, 1.0);
            let mut before = fit(0.0);
            for i in 1..100 {
                let now = fit(0.03 * f64::from(i));
                let moved = (now.low - before.low) / now.cell;
                // The bounds' middle moves by half of what they grow; with them the grid.
                let with_bounds = -0.015 / now.cell;
                let layers = (now.n_cells.y - before.n_cells.y) / 2;
                assert_eq!(now.n_cells.y, before.n_cells.y + 2 * layers);
                assert!((moved.y - with_bounds + f64::from(layers)).abs() < 1e-9, "{moved}");
                before = now;
            }
        }
    }

    #[test]
    fn bounds_without_extent_still_have_cells() {
        let grid = GridSpec::fit(DVec3::ONE, DVec3::ONE, 16, 1.0);
        assert!(grid.cell > 0.0 && grid.n_total() > 0 && grid.low.is_finite());
    }
}
