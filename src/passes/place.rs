//! place: where the particles are this frame.
//!
//! In: particles relative to their groups, group of each, groups' offsets. Out: position relative to the lighting
//! origin, and σ. Law: placed = position + offset. Source: docs/model.md §11. Error: half an ulp of the sum.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::record;

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

    /// `particles`: ParticleRecord; `i_group`: u32; `groups`: GroupRecord; `placed`: PlacedRecord.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        [particles, i_group, groups, placed]: [&Buffer; 4],
        n_particles: u32,
    ) -> Result<()> {
        rec.dispatch(&self.kernel, &[particles, i_group, groups, placed], &Push { n_particles }, n_particles)
    }
}
