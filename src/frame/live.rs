//! Particles that are recomputed in every frame: those of discs by the pass `live` or the game
//! thread, and those that another program moves by the game thread.

use super::features::{discs, has_live, has_live_on_host};
use super::packet::Packet;
use super::staging::{StagedBuffer, Staging, UploadBuffers};
use crate::error::{Error, Result};
use crate::gpu::{BufferSpec, Compiler, Device, buffers};
use crate::layout::disc::DiscRecord;
use crate::layout::particle::{ParticleRecord, PlacedRecord};
use crate::model::cloud::{CloudSource, Group};
use crate::model::scene::{Scene, Simulate};
use crate::passes::live::Live;

/// Returns a record for each disc at `time_s`.
pub(super) fn disc_records(scene: &Scene, groups: &[Group], time_s: f64) -> Vec<DiscRecord> {
    let of = |(i, cloud, disc): (usize, &crate::model::cloud::Cloud, &crate::model::disc::Disc)| {
        let group = groups.iter().find(|g| g.i_cloud == i)?;
        Some(DiscRecord::new(disc, group, cloud.seed, cloud.wind, disc.cycle_at(time_s)))
    };
    discs(scene).filter_map(of).collect()
}

/// Returns all particles relative to their groups at `time_s`: those of discs are computed, moving
/// ones are read, and the others are copied from `rest`.
///
/// # Errors
/// Fails if a file of moving particles cannot be read.
pub(super) fn live_particles(
    scene: &Scene,
    groups: &[Group],
    rest: &[ParticleRecord],
    time_s: f64,
) -> Result<Vec<ParticleRecord>> {
    let mut live = rest.to_vec();
    for group in groups {
        let first = group.i_first as usize;
        let records = &mut live[first..first + group.n_particles as usize];
        let cloud = &scene.clouds[group.i_cloud];
        match &cloud.source {
            CloudSource::Animated(m) => {
                let particles = m.animation.at(time_s)?;
                for (record, p) in records.iter_mut().zip(particles.iter()) {
                    *record = ParticleRecord::new(p, group);
                }
            }
            CloudSource::Disc(disc) => {
                let turn = disc.cycle_at(time_s);
                for (slot, record) in (0..).zip(records) {
                    let particle = disc.particle(cloud.seed, cloud.wind, slot, turn);
                    *record = ParticleRecord::new(&particle, group);
                }
            }
            CloudSource::Boxes { .. } | CloudSource::Particles(_) => {}
        }
    }
    Ok(live)
}

buffers! {
    /// The discs of a scene whose particles the device computes.
    pub(super) struct DiscBuffers(scene: &Scene) {
        discs: StagedBuffer => DiscRecord, discs(scene).count() as u64, "live.discs";
    }
}

buffers! {
    /// Staging buffers of particles that the game thread recomputes.
    pub(super) struct LiveUploads(scene: &Scene) {
        particles: UploadBuffers => ParticleRecord, scene.n_particles(), "live.upload",
            TexelStores;
    }
}

buffers! {
    /// Staging buffers of places that the game thread computes.
    pub(super) struct PlacedUploads(scene: &Scene) {
        placed: Staging => PlacedRecord, scene.n_particles(), "place.placed";
    }
}

/// The source of recomputed particles.
pub(super) enum LiveParticles {
    /// The pass `live`, with the number of particles of each disc.
    Device { live: Live, buffers: Box<DiscBuffers>, counts: Vec<u32> },
    /// The game thread.
    Host(Box<LiveUploads>),
}

impl LiveParticles {
    /// Creates the source; `None` if no particles are recomputed.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
    ) -> Result<Option<LiveParticles>> {
        Ok(match has_live(scene) {
            false => None,
            true if has_live_on_host(scene) => {
                Some(LiveParticles::Host(Box::new(LiveUploads::new(device, scene)?)))
            }
            true => Some(LiveParticles::Device {
                live: Live::new(device, compiler)?,
                buffers: Box::new(DiscBuffers::new(device, scene)?),
                counts: discs(scene).map(|(_, _, disc)| disc.n_particles).collect(),
            }),
        })
    }

    /// Writes the data of `packet` into the staging buffers of `slot`.
    pub fn write(&mut self, slot: usize, packet: &Packet) -> Result<()> {
        match (self, &packet.live) {
            (LiveParticles::Device { buffers, .. }, _) => buffers.discs.write(slot, &packet.discs),
            (LiveParticles::Host(uploads), Some(live)) => uploads.particles.0[slot].write(live),
            (LiveParticles::Host(_), None) => Err(unmoved("particles")),
        }
    }
}

/// Returns the fault of a packet without what the game thread moves. The device would draw what
/// its memory had before.
pub(super) fn unmoved(what: &str) -> Error {
    Error::Fault { what: format!("a packet without {what}, which the game thread moves") }
}

/// Lists the sizes of the buffers of particles that move.
pub(super) fn specs(scene: &Scene) -> Vec<BufferSpec> {
    let live = match has_live_on_host(scene) {
        true => LiveUploads::specs(scene),
        false => DiscBuffers::specs(scene),
    };
    let placed = match scene.threads.simulate {
        Simulate::Cpu => PlacedUploads::specs(scene),
        Simulate::Gpu => vec![],
    };
    [live, placed].concat()
}
