//! Room for what diffuses light.

use crate::layout::diffusion::{LEVELS_ROOM, N_PATCHES};

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
    /// Order up to which bounces have the phase function.
    pub order: u32,
}

impl Room {
    /// Returns the room for a grid of at most `n_cells`.
    pub fn new(
        n_cells: u64,
        n_sets: u32,
        (has_slopes, bounce_cells, order): (bool, u32, u32),
        n_solid_facets: u64,
    ) -> Room {
        let n_cells = LEVELS_ROOM * n_cells;
        Room { n_cells, n_sets, has_slopes, n_solid_facets, bounce_cells, order }
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

    /// Returns how many numbers a cell has of what suns and lamps make it send out.
    pub(super) fn n_arrived(&self) -> u64 {
        4 + u64::from(self.n_high())
    }

    /// Returns the number of harmonics of the second and the third order that bounces have.
    pub(super) fn n_high(&self) -> u32 {
        match self.order {
            0 | 1 => 0,
            2 => 5,
            _ => 12,
        }
    }

    /// Returns the most cells that have high orders of what bounces bring.
    pub(super) fn n_high_cells(&self) -> u64 {
        if self.n_high() > 0 { self.n_bounce_cells() } else { 0 }
    }

    /// Returns the number of patches through which light passes to and from surfaces and ground.
    pub fn n_patches(&self) -> u64 {
        if self.n_solid_facets > 0 { u64::from(N_PATCHES) } else { 0 }
    }
}
