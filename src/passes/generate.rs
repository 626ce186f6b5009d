//! generate: particles of boxes by bounded rejection.
//!
//! In: boxes (one a group), group of each particle. Out: particles relative to their box's centre, and for each the
//! attempts made and whether it was folded back. Law: P (1)–(11) with Philox counters. Source: P §Shape modeling,
//! docs/model.md §1. Error: reference/generate.rs derives the bound on position and radius; decisions nearer to a face
//! than that bound may differ from f64's.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::record;

record! {
    pub struct Push { n_particles: u32, max_attempts: u32 }
}

/// Set in a particle's status where it was folded back; the other bits count attempts.
pub const FOLDED: u32 = 1 << 31;

/// Particles an invocation makes one after the other. An invocation that accepts early goes on with its next particle,
/// so the more it has the less it waits for its neighbours' rejections; too many leave a wide GPU idle.
const PARTICLES_PER_INVOCATION: u32 = 8;

pub struct Generate {
    kernel: Kernel,
}

impl Generate {
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Generate> {
        Ok(Generate { kernel: Kernel::new(device, compiler, "generate", Push::FIELDS, &[])? })
    }

    /// `boxes`: BoxRecord by group; `i_group`: u32 by particle; `particles`: ParticleRecord; `status`: u32.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [boxes, i_group, particles, status]: [&Buffer; 4],
        n_particles: u32,
        max_attempts: u32,
    ) -> Result<()> {
        let push = Push { n_particles, max_attempts };
        let n_invocations = n_particles.div_ceil(PARTICLES_PER_INVOCATION);
        rec.dispatch(&self.kernel, &[boxes, i_group, particles, status], &push, n_invocations)
    }
}
