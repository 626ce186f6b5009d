//! grid: the blobs' extinction on cells, cubes where blobs are balls.
//!
//! In: placed particles, their κ. Out: density (extinction per unit length), cell (x, y, z) at x +
//! n_x (y + n_y z). Law: mass-conserving separable deposit. Source: docs/model.md §8, §11. Error: a
//! weight's 2.5e-6 (erf's formula 3e-7, the rest its rounding) at the most, some 1e-6 measured, and
//! half a quantum of the fixed-point sum a deposit.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Compiler, Device, Kernel, MemoryUsage, Recorder};
use crate::layout::frame::GridRecord;
use crate::layout::record;

record! {
    pub struct DepositPush { grid: GridRecord, n_particles: u32, quanta_per_mass: f32 }
}

record! {
    pub struct ResolvePush { n_cells: u32, density_per_quantum: f32 }
}

/// Quanta of the heaviest particle's mass: 2³¹ in one cell fits a 32-bit word with room for
/// rounding up, and 2³³ such particles fit the 64-bit sum.
const QUANTA_OF_HEAVIEST: f64 = 2_147_483_648.0;

pub struct Grid {
    deposit: Kernel,
    resolve: Kernel,
    sums: Buffer,
    /// Cells that there is room for.
    room: u64,
}

impl Grid {
    /// Room for `n_cells` cells.
    pub fn new(device: &Device, compiler: &Compiler, n_cells: u64) -> Result<Grid> {
        // A workgroup of one subgroup needs no waiting at its barriers, and a blob's few cells fill
        // it.
        let width = device.limits().subgroup_size.clamp(8, 64);
        Ok(Grid {
            deposit: Kernel::with_macros(
                device,
                compiler,
                "grid.deposit",
                DepositPush::FIELDS,
                &[],
                &[("WORKGROUP", width)],
            )?,
            resolve: Kernel::new(device, compiler, "grid.resolve", ResolvePush::FIELDS, &[])?,
            sums: Buffer::new::<[u32; 2]>(device, "grid.sums", n_cells, MemoryUsage::Device)?,
            room: n_cells,
        })
    }

    /// Cells that there is room for.
    pub fn room(&self) -> u64 {
        self.room
    }

    /// Room for `n_cells` cells.
    pub fn make_room(&mut self, device: &Device, n_cells: u64) -> Result<()> {
        self.sums = Buffer::new::<[u32; 2]>(device, "grid.sums", n_cells, MemoryUsage::Device)?;
        self.room = n_cells;
        Ok(())
    }

    /// `placed`: PlacedRecord; `particles`: ParticleRecord; `density`: f32 by cell. `heaviest` is
    /// at least the greatest mass κ (2π)^{3/2} σ³ of any particle.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [placed, particles, density]: [&Buffer; 3],
        grid: &GridRecord,
        n_particles: u32,
        heaviest: f64,
    ) -> Result<()> {
        let n_wanted = grid.n_cells.iter().map(|n| u64::from(*n)).product::<u64>();
        if n_wanted > self.room {
            return Err(Error::limit(format!(
                "a density grid of {n_wanted} cells, where there is room for {}",
                self.room
            )));
        }
        rec.fill(&self.sums, 0);
        let quanta_per_mass = if heaviest > 0.0 { QUANTA_OF_HEAVIEST / heaviest } else { 0.0 };
        let push =
            DepositPush { grid: *grid, n_particles, quanta_per_mass: quanta_per_mass as f32 };
        rec.dispatch_groups(&self.deposit, &[placed, particles, &self.sums], &push, n_particles)?;
        let n_cells = grid.n_cells.iter().product();
        let volume = f64::from(grid.cell).powi(3) * f64::from(grid.aspect);
        let density_per_quantum = (heaviest / QUANTA_OF_HEAVIEST / volume) as f32;
        rec.dispatch(
            &self.resolve,
            &[&self.sums, density],
            &ResolvePush { n_cells, density_per_quantum },
            n_cells,
        )
    }
}
