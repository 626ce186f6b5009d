//! grid: deposits the blobs' extinction on a grid of cells.
//!
//! In: placed particles and their extinction. Out: density (extinction per length), cell (x, y, z)
//! at x + n_x (y + n_y z). Law: mass-conserving separable deposit. Source:
//! model.md §8, passes.md. Error: at most 2.5e-6 of a weight, of which 3e-7 are from the
//! formula of erf and the rest from rounding (1e-6 measured); and half a quantum of the fixed-point
//! sum a deposit.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder, buffers};
use crate::layout::frame::GridRecord;
use crate::layout::record;

record! {
    /// Push constants of `grid_deposit.comp`.
    pub struct DepositPush {
        /// The density grid.
        grid: GridRecord,
        /// Number of particles.
        n_particles: u32,
        /// Quanta of a unit of mass.
        quanta_per_mass: f32,
    }
}

record! {
    /// Push constants of `grid_resolve.comp`.
    pub struct ResolvePush {
        /// Number of cells.
        n_cells: u32,
        /// Extinction per length of a quantum.
        density_per_quantum: f32,
    }
}

/// Quanta of the heaviest particle's mass: 2³¹ in one cell fits a 32-bit word with room for
/// rounding up, and 2³³ such particles fit the 64-bit sum.
const QUANTA_OF_HEAVIEST: f64 = 2_147_483_648.0;

buffers! {
    /// Scratch of the pass for a number of cells.
    pub struct Scratch(n_cells: u64) {
        /// Fixed-point sums by cell.
        sums: Buffer => [u32; 2], n_cells, "grid.sums";
    }
}

/// The pipelines and scratch buffers of the pass.
pub struct Grid {
    deposit: Kernel,
    resolve: Kernel,
    scratch: Scratch,
    capacity: u64,
}

impl Grid {
    /// Creates the pipelines, and scratch buffers for `n_cells` cells.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the device cannot hold the buffers.
    pub fn new(device: &Device, compiler: &Compiler, n_cells: u64) -> Result<Grid> {
        // A workgroup of one subgroup does not wait at its barriers, and a blob's few cells fill
        // it.
        let width = [("WORKGROUP", device.limits().subgroup_size.clamp(8, 64))];
        let fields = DepositPush::FIELDS;
        Ok(Grid {
            deposit: Kernel::with_macros(device, compiler, "grid.deposit", fields, &[], &width)?,
            resolve: Kernel::new(device, compiler, "grid.resolve", ResolvePush::FIELDS)?,
            scratch: Scratch::new(device, n_cells)?,
            capacity: n_cells,
        })
    }

    /// Returns the number of cells that the scratch buffers hold.
    pub fn capacity(&self) -> u64 {
        self.capacity
    }

    /// Reallocates the scratch buffers for `n_cells` cells.
    ///
    /// # Errors
    /// Fails if the device cannot hold them.
    pub fn set_capacity(&mut self, device: &Device, n_cells: u64) -> Result<()> {
        self.scratch = Scratch::new(device, n_cells)?;
        self.capacity = n_cells;
        Ok(())
    }

    /// Writes the density of every cell of `grid`.
    ///
    /// `placed`: `PlacedRecord`; `particles`: `ParticleRecord`; `density`: `f32` by cell.
    /// `heaviest` is at least the greatest mass κ (2π)^{3/2} σ³ of a particle.
    ///
    /// # Errors
    /// Fails if the grid has more cells than the scratch buffers.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [placed, particles, density]: [&Buffer; 3],
        grid: &GridRecord,
        n_particles: u32,
        heaviest: f64,
    ) -> Result<()> {
        let n_wanted = grid.n_cells.iter().map(|n| u64::from(*n)).product::<u64>();
        if n_wanted > self.capacity {
            return Err(Error::limit(format!(
                "a density grid of {n_wanted} cells, where there is room for {}",
                self.capacity
            )));
        }
        let sums = &self.scratch.sums;
        rec.fill(sums, 0);
        let quanta_per_mass = if heaviest > 0.0 { QUANTA_OF_HEAVIEST / heaviest } else { 0.0 };
        let push =
            DepositPush { grid: *grid, n_particles, quanta_per_mass: quanta_per_mass as f32 };
        rec.dispatch_groups(&self.deposit, &[placed, particles, sums], &push, n_particles)?;
        let n_cells = grid.n_cells.iter().product();
        let volume = f64::from(grid.cell).powi(3) * f64::from(grid.aspect);
        let density_per_quantum = (heaviest / QUANTA_OF_HEAVIEST / volume) as f32;
        let push = ResolvePush { n_cells, density_per_quantum };
        rec.dispatch(&self.resolve, &[sums, density], &push, n_cells)
    }
}
