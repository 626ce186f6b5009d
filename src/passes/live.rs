//! live: the particles of discs at a frame's time.
//!
//! In: a disc's law and the time. Out: its particles relative to their group's centre, with σ and κ
//! as old as they are. Law: docs/model.md §2, in closed form of (seed, slot, time). Source: C §2.3.
//! Error: tests/pass_live.rs derives the bound on position, σ and κ by what each operation rounds;
//! generations and births are integers and the same as in f64.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    pub struct Push { i_disc: u32, n_particles: u32 }
}

pub struct Live {
    kernel: Kernel,
}

impl Live {
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Live> {
        Ok(Live { kernel: Kernel::new(device, compiler, "live", Push::FIELDS, &[])? })
    }

    /// `discs`: DiscRecord; `particles`: ParticleRecord. Disc `i_disc` has `n_particles`, which lie
    /// where its record says.
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
