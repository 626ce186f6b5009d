//! generate: particles of boxes by bounded rejection.
//!
//! In: boxes (one a group), group of each particle. Out: particles relative to their box's centre,
//! and for each the attempts made and whether it was folded back. Law: P (1)–(11) with Philox
//! counters. Source: P §Shape modeling, docs/model.md §1. Error: reference/generate.rs derives the
//! bound on position and radius; decisions nearer to a face than that bound may differ from f64's.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    pub struct Push { i_first: u32, n_particles: u32, max_attempts: u32 }
}

/// Set in a particle's status where it was folded back; the other bits count attempts.
pub const FOLDED: u32 = 1 << 31;

/// Particles an invocation makes. An invocation that accepts early goes on with its next particle,
/// so the more it has the less it waits for its neighbours' rejections (at 27 % accepted, 8 lanes
/// wait 43 % for 8 particles each, 30 % for 16); too many leave a wide GPU idle. The shader's
/// PER_INVOCATION, which any other number here would only slow.
const PARTICLES_PER_INVOCATION: u32 = 16;

/// The shader notes a particle's attempts in 7 bits.
const MOST_ATTEMPTS: u32 = 127;

pub struct Generate {
    kernel: Kernel,
}

impl Generate {
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Generate> {
        Ok(Generate { kernel: Kernel::new(device, compiler, "generate", Push::FIELDS, &[])? })
    }

    /// `boxes`: BoxRecord by group; `i_group`: u32 by particle, ascending, each group the run of
    /// particles that its box says; `particles`: ParticleRecord; `status`: u32. `max_attempts` is
    /// at most 127.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 4],
        n_particles: u32,
        max_attempts: u32,
    ) -> Result<()> {
        self.record_run(rec, buffers, [0, n_particles], max_attempts)
    }

    /// Makes `n_particles` from `i_first` on, and leaves all others as they are.
    pub fn record_run(
        &self,
        rec: &mut Recorder<'_>,
        [boxes, i_group, particles, status]: [&Buffer; 4],
        [i_first, n_particles]: [u32; 2],
        max_attempts: u32,
    ) -> Result<()> {
        if max_attempts > MOST_ATTEMPTS {
            return Err(Error::limit(format!(
                "generate: {max_attempts} attempts a particle, at most {MOST_ATTEMPTS}"
            )));
        }
        let push = Push { i_first, n_particles, max_attempts };
        let n_invocations = n_particles.div_ceil(PARTICLES_PER_INVOCATION);
        let n_groups = n_invocations.div_ceil(self.kernel.local_size_x());
        rec.dispatch_groups(&self.kernel, &[boxes, i_group, particles, status], &push, n_groups)
    }
}
