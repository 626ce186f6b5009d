//! place: where the particles are this frame.
//!
//! In: particles relative to their groups, group of each, groups' offsets, gust modes. Out:
//! position relative to the lighting origin, and σ. Law: placed =
//! `s position + offset + Σ a sin(k·x + phase)`, `s σ`. Source: docs/model.md §11 to §13. Error: an ulp of the sums and of s position; of
//! each wave |a| (3.5 ulp of the sine + the argument's rounding).

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::record;

record! {
    pub struct Push { n_particles: u32 }
}

pub struct Place {
    kernel: Kernel,
}

impl Place {
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Place> {
        Ok(Place { kernel: Kernel::new(device, compiler, "place", Push::FIELDS, &[])? })
    }

    /// `particles`: ParticleRecord; `i_group`: u32; `groups`: GroupRecord; `modes`: ModeRecord;
    /// `placed`: PlacedRecord.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [particles, i_group, groups, modes, placed]: [&Buffer; 5],
        n_particles: u32,
    ) -> Result<()> {
        rec.dispatch(
            &self.kernel,
            &[particles, i_group, groups, modes, placed],
            &Push { n_particles },
            n_particles,
        )
    }
}
