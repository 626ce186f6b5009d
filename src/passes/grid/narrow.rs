//! Blobs that are deposited narrower than they are, and blurred (passes.md "grid").

use crate::error::Result;
use crate::gpu::{Buffer, BufferSpec, Compiler, Device, Kernel, Recorder, buffers};
use crate::layout::frame::{FIRST_BLUR, GridRecord, LAST_BLUR};
use crate::layout::record;

record! {
    /// Push constants of `grid_narrow.comp`.
    pub struct NarrowPush {
        /// The density grid.
        grid: GridRecord,
        /// Number of particles.
        n_particles: u32,
        /// Quanta of a unit of mass.
        quanta_per_mass: f32,
        /// Greatest number of blurs.
        n_blurs: u32,
    }
}

record! {
    /// Push constants of `grid_blur.comp`.
    pub struct BlurPush {
        /// Cells of the grid along each axis.
        n_cells: [u32; 3],
        /// The axis of the blur: 0, 1, 2.
        axis: u32,
        /// First cell of the sums.
        i_first: u32,
        /// 1: the sums count.
        has_sums: u32,
        /// 1: the density counts.
        has_density: u32,
        /// 1: the result is added to what is there.
        adds: u32,
        /// Extinction per length of a quantum.
        density_per_quantum: f32,
    }
}

/// Numbers of blurs that have sums of their own.
const N_SUMS: u64 = (LAST_BLUR - FIRST_BLUR + 1) as u64;

buffers! {
    /// Scratch for a number of cells.
    struct Scratch(n_cells: u64) {
        /// Fixed-point sums by number of blurs and cell.
        sums: Buffer => [u32; 2], N_SUMS * n_cells, "grid.narrow_sums";
        /// Density after a blur, by cell.
        blurred: Buffer => f32, n_cells, "grid.blurred";
        /// The same after the next blur.
        other: Buffer => f32, n_cells, "grid.blurred_other";
    }
}

/// Returns the sizes of the scratch buffers for `n_cells` cells.
pub(super) fn specs(n_cells: u64) -> Vec<BufferSpec> {
    Scratch::specs(n_cells)
}

/// The pipelines and scratch buffers.
pub(super) struct Narrow {
    deposit: Kernel,
    blur: Kernel,
    scratch: Scratch,
}

impl Narrow {
    pub fn new(device: &Device, compiler: &Compiler, n_cells: u64) -> Result<Narrow> {
        Ok(Narrow {
            deposit: Kernel::new(device, compiler, "grid.narrow", NarrowPush::FIELDS)?,
            blur: Kernel::new(device, compiler, "grid.blur", BlurPush::FIELDS)?,
            scratch: Scratch::new(device, n_cells)?,
        })
    }

    /// Reallocates the scratch buffers for `n_cells` cells.
    pub fn set_capacity(&mut self, device: &Device, n_cells: u64) -> Result<()> {
        self.scratch = Scratch::new(device, n_cells)?;
        Ok(())
    }

    /// Adds the blobs to the density of the finest grid, by at most `push.n_blurs` blurs.
    /// `density_per_quantum`: extinction per length of a quantum.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [placed, particles, density]: [&Buffer; 3],
        density_per_quantum: f32,
        push: &NarrowPush,
    ) -> Result<()> {
        let sides = push.grid.n_cells;
        let n_cells: u32 = sides.iter().product();
        let Scratch { sums, blurred, other } = &self.scratch;
        rec.fill(sums, 0);
        rec.dispatch(&self.deposit, &[placed, particles, sums], push, push.n_particles)?;
        let (mut from, mut to) = (blurred, other);
        for step in (1..=push.n_blurs).rev() {
            for axis in 0..3 {
                let own = step.checked_sub(FIRST_BLUR).filter(|_| axis == 0);
                let is_last = step == 1 && axis == 2;
                let push = BlurPush {
                    n_cells: sides,
                    axis,
                    i_first: own.unwrap_or(0) * n_cells,
                    has_sums: own.is_some().into(),
                    has_density: (step < push.n_blurs || axis > 0).into(),
                    adds: is_last.into(),
                    density_per_quantum,
                };
                let target = if is_last { density } else { to };
                rec.dispatch(&self.blur, &[sums, from, target], &push, n_cells)?;
                (from, to) = (to, from);
            }
        }
        Ok(())
    }
}
