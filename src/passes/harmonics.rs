//! harmonics: colours of particles that change with the direction of view.
//!
//! In: places, coefficients of real spherical harmonics by particle, the eye. Out: the particles'
//! colours. Law: the mean colour and the sum of c Y over degree 1 to 3, at least 0. Source:
//! model.md §14, Kerbl et al. 2023. Error: `reference::harmonics::rounding`.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::harmonics;
use crate::layout::record;

record! {
    /// Push constants of `harmonics.comp`.
    pub struct Push {
        /// The eye relative to the lighting origin.
        eye: [f32; 3],
        /// Greatest degree: 1 to 3.
        degree: u32,
        /// The first particle.
        i_first: u32,
        /// Number of particles.
        n_particles: u32,
        /// Texel of the first particle's coefficients.
        i_texel: u32,
        /// Texels of a particle's coefficients.
        n_texels: u32,
    }
}

/// A run of particles that have coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Colored {
    /// The first particle.
    pub i_first: u32,
    /// Number of particles.
    pub n_particles: u32,
    /// Greatest degree: 1 to 3.
    pub degree: u32,
}

/// The pipeline of the pass.
pub struct Harmonics {
    kernel: Kernel,
}

impl Harmonics {
    /// Creates the pipeline.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Harmonics> {
        Ok(Harmonics { kernel: Kernel::new(device, compiler, "harmonics", Push::FIELDS)? })
    }

    /// Writes the colours of all `runs` toward `eye`, which is relative to the lighting origin.
    ///
    /// `placed`: `PlacedRecord` by particle; `coefficients`: texels of [`harmonics`] of the runs,
    /// one after the other; `particles`: `ParticleRecord`, whose colours are replaced.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [placed, coefficients, particles]: [&Buffer; 3],
        eye: [f32; 3],
        runs: &[Colored],
    ) -> Result<()> {
        let mut i_texel = 0;
        for &Colored { i_first, n_particles, degree } in runs {
            let n_texels = harmonics::n_texels(degree);
            let push = Push { eye, degree, i_first, n_particles, i_texel, n_texels };
            let all = [placed, coefficients, particles];
            rec.dispatch(&self.kernel, &all, &push, n_particles)?;
            i_texel += n_particles * n_texels;
        }
        Ok(())
    }
}
