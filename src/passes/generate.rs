//! generate: generates the particles of boxes by bounded rejection sampling.
//!
//! In: boxes (one a group), group of each particle. Out: particles relative to their box's center,
//! and for each the number of attempts and whether it was folded back. Law: P (1)–(11) with Philox
//! counters. Source: P §Shape modeling, model.md §1. Error: reference/generate.rs
//! derives the bound on position and radius; a decision nearer to a face than that bound may differ
//! from f64.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    /// Push constants of `generate.comp`.
    pub struct Push {
        /// First particle.
        i_first: u32,
        /// Number of particles.
        n_particles: u32,
        /// Attempts after which a particle is folded back.
        max_attempts: u32,
    }
}

/// The bit of a particle's status that says that it was folded back; the other bits count attempts.
pub const FOLDED: u32 = 1 << 31;

/// Particles that an invocation generates; the shader's PER_INVOCATION.
///
/// An invocation that accepts early goes on with its next particle. More particles therefore mean
/// less waiting for rejections of its neighbors: at 27 % accepted, 8 lanes wait 43 % of the time
/// with 8 particles each, and 30 % with 16. Too many particles leave a wide GPU idle.
const PARTICLES_PER_INVOCATION: u32 = 16;

/// The shader stores a particle's attempts in 7 bits.
const MAX_ATTEMPTS: u32 = 127;

/// The pipeline of the pass.
pub struct Generate {
    kernel: Kernel,
}

impl Generate {
    /// Creates the pipeline.
    ///
    /// # Errors
    /// Fails if the shader does not compile or the pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Generate> {
        Ok(Generate { kernel: Kernel::new(device, compiler, "generate", Push::FIELDS)? })
    }

    /// Generates `n_particles` from `i_first` on and leaves all others unchanged.
    ///
    /// `boxes`: `BoxRecord` by group; `i_group`: `u32` by particle, ascending, so that the
    /// particles of a group are contiguous; `particles`: `ParticleRecord`; `status`: `u32` by
    /// particle.
    ///
    /// # Errors
    /// Fails if `max_attempts` is greater than 127.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [boxes, i_group, particles, status]: [&Buffer; 4],
        [i_first, n_particles]: [u32; 2],
        max_attempts: u32,
    ) -> Result<()> {
        if max_attempts > MAX_ATTEMPTS {
            return Err(Error::limit(format!(
                "generate: {max_attempts} attempts a particle, at most {MAX_ATTEMPTS}"
            )));
        }
        let push = Push { i_first, n_particles, max_attempts };
        let n_invocations = n_particles.div_ceil(PARTICLES_PER_INVOCATION);
        let n_groups = n_invocations.div_ceil(self.kernel.local_size_x());
        rec.dispatch_groups(&self.kernel, &[boxes, i_group, particles, status], &push, n_groups)
    }
}
