//! What puts the particles into Morton order, where facets stand for runs of them.

use super::buffers::{Buffers, upload};
use super::feed::Feed;
use super::packet::Packet;
use crate::error::Result;
use crate::gpu::{Buffer, Commands, Compiler, Device, MemoryUsage, Recorder};
use crate::layout::facet::{RegionBoundsRecord, RunRecord};
use crate::model::scene::{LightingMode, Scene};
use crate::passes::facets::Facets;
use crate::passes::morton::Morton;
use crate::passes::sort::Sort;

/// Bits of a Morton key.
const KEY_BITS: u32 = 32;

pub struct Grouping {
    morton: Morton,
    sort: Sort,
    /// [key, particle].
    entries: Buffer,
    /// Particle of each place.
    order: Buffer,
    /// Places of each of the clouds' facets.
    runs: Buffer,
    bounds: Feed,
    n_particles: u32,
    n_solid_facets: u32,
    n_runs: u32,
    n_regions: u32,
}

/// Whether a frame needs it.
pub fn is_grouped(scene: &Scene) -> bool {
    scene.lighting.mode != LightingMode::None && scene.groups_facets()
}

impl Grouping {
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        commands: &mut Commands,
        scene: &Scene,
    ) -> Result<Grouping> {
        let (n, n_regions) = (scene.n_particles(), scene.n_regions());
        let record = |(first, end): (u64, u64)| RunRecord {
            i_first: first as u32,
            n_particles: (end - first) as u32,
        };
        let runs: Vec<RunRecord> = scene.facet_runs().into_iter().map(record).collect();
        let grouping = Grouping {
            morton: Morton::new(device, compiler)?,
            sort: Sort::new(device, compiler, n as u32)?,
            entries: Buffer::new::<[u32; 2]>(device, "morton.entries", n, MemoryUsage::Device)?,
            order: Buffer::new::<u32>(device, "morton.order", n, MemoryUsage::Device)?,
            runs: Buffer::new::<RunRecord>(
                device,
                "facets.runs",
                runs.len() as u64,
                MemoryUsage::Device,
            )?,
            bounds: Feed::new::<RegionBoundsRecord>(device, "morton.bounds", n_regions as u64)?,
            n_particles: n as u32,
            n_solid_facets: scene.n_solid_facets() as u32,
            n_runs: runs.len() as u32,
            n_regions: n_regions as u32,
        };
        upload(device, commands, &runs, &grouping.runs)?;
        Ok(grouping)
    }

    pub fn write(&mut self, slot: usize, packet: &Packet) -> Result<()> {
        self.bounds.write(slot, &packet.bounds)
    }

    /// Copies what was written to where shaders read it.
    pub fn record_feeds(&self, rec: &mut Recorder<'_>, slot: usize) {
        self.bounds.record(rec, slot);
    }

    pub fn record_order(&self, rec: &mut Recorder<'_>, b: &Buffers) -> Result<()> {
        let buffers =
            [b.placed.buffer(), &b.i_group, &b.groups.buffer, &self.bounds.buffer, &self.entries];
        self.morton.record_particles(rec, buffers, self.n_particles, self.n_regions)?;
        self.sort.record(rec, &self.entries, self.n_particles, KEY_BITS)?;
        self.morton.record_order(rec, [&self.entries, &self.order], self.n_particles)
    }

    pub fn record_facets(
        &self,
        rec: &mut Recorder<'_>,
        facets: &Facets,
        b: &Buffers,
        packet: &Packet,
    ) -> Result<()> {
        let [placed, particles, i_group, groups] =
            [b.placed.buffer(), &b.particles, &b.i_group, &b.groups.buffer];
        let buffers = [
            placed,
            particles,
            i_group,
            groups,
            &b.density,
            &self.order,
            &self.runs,
            &b.facets,
            &b.i_facet,
        ];
        facets.record_groups(rec, buffers, &packet.grid, self.n_runs, self.n_solid_facets)
    }
}
