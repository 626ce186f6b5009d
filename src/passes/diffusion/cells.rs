//! The cells between which light diffuses: those of the density grid, or merged ones.

use super::push::{FluxPush, SystemPush};
use crate::gpu::Buffer;
use crate::layout::diffusion::{DiffusionParams, levels};
use crate::layout::frame::GridRecord;

/// Cells, their medium and their light.
pub(super) struct Cells<'a> {
    pub grid: GridRecord,
    /// Extinction by cell.
    pub density: &'a Buffer,
    /// By cell Q0 and q, then φ and F.
    pub field: &'a Buffer,
    /// The medium, with the densest of these cells.
    pub of: DiffusionParams,
}

impl Cells<'_> {
    /// Returns their number.
    pub fn n_total(&self) -> u32 {
        self.grid.n_cells.iter().product()
    }

    /// Returns the push constants of the equations, with the light of so many lights.
    pub fn system_push(&self, n_lights: u32) -> SystemPush {
        SystemPush {
            grid: self.grid,
            absorbed: self.of.absorbed,
            inverse_chord: self.of.inverse_chord,
            kept: self.of.kept,
            n_lights,
            n_all: levels(&self.grid).1,
            densest: self.of.densest,
        }
    }

    /// Returns the push constants of φ and F.
    pub fn flux_push(&self) -> FluxPush {
        FluxPush {
            grid: self.grid,
            kept: self.of.kept,
            inverse_chord: self.of.inverse_chord,
            even: self.of.even,
            densest: self.of.densest,
            forward: self.of.forward,
            g: self.of.scattered_g,
        }
    }
}
