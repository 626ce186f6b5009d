//! place: computes where the particles are in this frame.
//!
//! In: particles relative to their groups, group of each, the groups' offsets, gust modes. Out:
//! position relative to the lighting origin, and σ. Law: the place is s × position, plus the
//! group's offset, plus the sum of a sin(k·x + phase) over the gust's waves; σ is scaled by s.
//! Source: passes.md "place", model.md §12, §13. Error: an ulp of the sums and of the scaled
//! position; of each wave, |a| times 3.5 ulp of the sine and the argument's rounding.

use crate::error::Result;
use crate::gpu::{Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    /// Push constants of `place.comp`.
    pub struct Push {
        /// Number of particles.
        n_particles: u32,
    }
}

bindings! {
    /// The buffers of the pass.
    pub struct PlaceBuffers {
        /// `ParticleRecord` by particle.
        particles,
        /// `u32` group by particle.
        i_group,
        /// `GroupRecord` by group.
        groups,
        /// `ModeRecord`: the gusts of all clouds.
        modes,
        /// Output, `PlacedRecord` by particle.
        placed,
    }
}

/// The pipeline of the pass.
pub struct Place {
    kernel: Kernel,
}

impl Place {
    /// Creates the pipeline.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Place> {
        Ok(Place { kernel: Kernel::new(device, compiler, "place", Push::FIELDS)? })
    }

    /// Writes the place of every particle.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &PlaceBuffers<'_>,
        n_particles: u32,
    ) -> Result<()> {
        rec.dispatch(&self.kernel, &buffers.by_binding(), &Push { n_particles }, n_particles)
    }
}
