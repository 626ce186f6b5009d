//! live: computes the particles of discs at a frame's time.
//!
//! In: a disc's parameters and the time. Out: its particles relative to their group's center, with
//! σ and κ at their age. Law: model.md §2, in closed form of (seed, slot, time).
//! Source: C §2.3. Error: tests/passes/live.rs derives the bound on position, σ and κ from the
//! rounding of each operation; generations and births are integers, equal to those in f64.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    /// Push constants of `live.comp`.
    pub struct Push {
        /// The disc.
        i_disc: u32,
        /// Number of particles.
        n_particles: u32,
    }
}

/// The pipeline of the pass.
pub struct Live {
    kernel: Kernel,
}

impl Live {
    /// Creates the pipeline.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Live> {
        Ok(Live { kernel: Kernel::new(device, compiler, "live", Push::FIELDS)? })
    }

    /// Writes the `n_particles` particles of disc `i_disc`.
    ///
    /// `discs`: `DiscRecord`, which says where a disc's particles lie; `particles`:
    /// `ParticleRecord`.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [discs, particles]: [&Buffer; 2],
        i_disc: u32,
        n_particles: u32,
    ) -> Result<()> {
        rec.dispatch(&self.kernel, &[discs, particles], &Push { i_disc, n_particles }, n_particles)
    }
}
