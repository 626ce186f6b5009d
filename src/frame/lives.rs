//! The particles of discs, new in every frame: by the pass `live`, or by the game thread where it
//! moves the particles; and those that somebody else moves, by the game thread alone.

use super::feed::{Feed, IN_FLIGHT};
use super::packet::Packet;
use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, MemoryUsage, Recorder};
use crate::layout::disc::DiscRecord;
use crate::layout::particle::ParticleRecord;
use crate::model::cloud::{Cloud, CloudSource, Group};
use crate::model::disc::Disc;
use crate::model::scene::{Scene, Simulate};
use crate::passes::live::Live;

/// The scene's discs, in order, with their clouds' numbers.
pub fn discs(scene: &Scene) -> impl Iterator<Item = (usize, &Cloud, &Disc)> {
    scene.clouds.iter().enumerate().filter_map(|(i, cloud)| match &cloud.source {
        CloudSource::Disc(disc) => Some((i, cloud, disc)),
        _ => None,
    })
}

/// Whether some particles are other ones in every frame.
pub fn lives(scene: &Scene) -> bool {
    discs(scene).next().is_some() || scene.is_animated()
}

/// Whether the game thread computes those.
pub fn lives_on_host(scene: &Scene) -> bool {
    scene.threads.simulate == Simulate::Cpu && lives(scene)
}

/// A record a disc, at `time_s`.
pub fn disc_records(scene: &Scene, groups: &[Group], time_s: f64) -> Vec<DiscRecord> {
    let of = |(i, cloud, disc): (usize, &Cloud, &Disc)| {
        let group = groups.iter().find(|g| g.i_cloud == i)?;
        Some(DiscRecord::new(disc, group, cloud.seed, cloud.wind, disc.cycle_at(time_s)))
    };
    discs(scene).filter_map(of).collect()
}

/// All particles relative to their groups at `time_s`: those of discs computed, those that somebody
/// else moves as they then are, the others as they are in `rest`.
pub fn lived(
    scene: &Scene,
    groups: &[Group],
    rest: &[ParticleRecord],
    time_s: f64,
) -> Result<Vec<ParticleRecord>> {
    let mut lived = rest.to_vec();
    for group in groups {
        if let CloudSource::Animated(m) = &scene.clouds[group.i_cloud].source {
            let (particles, first) = (m.animation.at(time_s)?, group.i_first as usize);
            let records = &mut lived[first..first + group.n_particles as usize];
            records
                .iter_mut()
                .zip(particles.iter())
                .for_each(|(record, p)| *record = ParticleRecord::new(p, group));
        }
    }
    for (i, cloud, disc) in discs(scene) {
        let turn = disc.cycle_at(time_s);
        for group in groups.iter().filter(|g| g.i_cloud == i) {
            let first = group.i_first as usize;
            for (slot, record) in (0..).zip(&mut lived[first..first + group.n_particles as usize]) {
                *record =
                    ParticleRecord::new(&disc.particle(cloud.seed, cloud.wind, slot, turn), group);
            }
        }
    }
    Ok(lived)
}

pub(super) enum Lives {
    ByDevice {
        live: Live,
        discs: Box<Feed>,
        /// Particles of each.
        counts: Vec<u32>,
    },
    /// Staging buffers of all particles.
    ByHost(Box<[Buffer; IN_FLIGHT]>),
}

impl Lives {
    /// None where no particles are new in every frame.
    pub fn of_scene(device: &Device, compiler: &Compiler, scene: &Scene) -> Result<Option<Lives>> {
        let counts: Vec<u32> = discs(scene).map(|(_, _, disc)| disc.n_particles).collect();
        if !lives(scene) {
            return Ok(None);
        }
        if lives_on_host(scene) {
            let n = scene.n_particles();
            let staging =
                |name| Buffer::new::<ParticleRecord>(device, name, n, MemoryUsage::Upload);
            return Ok(Some(Lives::ByHost(Box::new([
                staging("live.upload0")?,
                staging("live.upload1")?,
            ]))));
        }
        let discs = Box::new(Feed::new::<DiscRecord>(device, "live.discs", counts.len() as u64)?);
        Ok(Some(Lives::ByDevice { live: Live::new(device, compiler)?, discs, counts }))
    }

    pub fn write(&mut self, slot: usize, packet: &Packet) -> Result<()> {
        match (self, &packet.lived) {
            (Lives::ByDevice { discs, .. }, _) => discs.write(slot, &packet.discs),
            (Lives::ByHost(staging), Some(lived)) => staging[slot].write(lived),
            (Lives::ByHost(_), None) => Ok(()),
        }
    }

    /// Copies what every frame brings along to where shaders read it.
    pub fn record_feeds(&self, rec: &mut Recorder<'_>, slot: usize) {
        if let Lives::ByDevice { discs, .. } = self {
            discs.record(rec, slot);
        }
    }

    pub fn record(&self, rec: &mut Recorder<'_>, slot: usize, particles: &Buffer) -> Result<()> {
        match self {
            Lives::ByDevice { live, discs, counts } => {
                let mut each = (0..).zip(counts).filter(|(_, n)| **n > 0);
                each.try_for_each(|(i, n)| live.record(rec, [&discs.buffer, particles], i, *n))
            }
            Lives::ByHost(staging) => {
                rec.copy(&staging[slot], particles);
                Ok(())
            }
        }
    }
}
