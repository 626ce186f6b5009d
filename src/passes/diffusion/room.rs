//! Room for what diffuses light.

use crate::layout::diffusion::{LEVELS_ROOM, N_PATCHES};

/// Harmonics of the second order.
pub const N_SECOND: u64 = 5;

/// Room for the grids of the solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Room {
    /// Cells of all levels.
    pub n_cells: u64,
    /// Sets of equations: 1 where channels share them, else 3.
    pub n_sets: u32,
    /// The fluence of suns and lamps is wanted in every cell.
    pub has_slopes: bool,
    /// Facets of surfaces and ground.
    pub n_solid_facets: u64,
    /// Edge of the cells that bounces lead between, in cells; 0 without bounces.
    pub bounce_cells: u32,
    /// Bounces have the second order of the phase function.
    pub has_second: bool,
}

impl Room {
    /// Returns the room for a grid of at most `n_cells`.
    pub fn new(
        n_cells: u64,
        n_sets: u32,
        (has_slopes, bounce_cells, has_second): (bool, u32, bool),
        n_solid_facets: u64,
    ) -> Room {
        let n_cells = LEVELS_ROOM * n_cells;
        Room { n_cells, n_sets, has_slopes, n_solid_facets, bounce_cells, has_second }
    }

    /// Returns the most cells of the density grid.
    pub(super) fn n_grid_cells(&self) -> u64 {
        self.n_cells / LEVELS_ROOM
    }

    /// Returns the most cells that bounces lead between. A grid has three cells or more along each
    /// axis, of which merging leaves at most two thirds.
    pub(super) fn n_bounce_cells(&self) -> u64 {
        if self.bounce_cells > 1 { self.n_grid_cells() * 8 / 27 } else { self.n_grid_cells() }
    }

    /// Returns how many numbers the cells that bounces lead between have of the second order.
    pub(super) fn n_of_second(&self) -> u64 {
        if self.has_second { self.n_bounce_cells() * N_SECOND } else { 0 }
    }

    /// Returns the number of patches through which light passes to and from surfaces and ground.
    pub fn n_patches(&self) -> u64 {
        if self.n_solid_facets > 0 { u64::from(N_PATCHES) } else { 0 }
    }
}
