//! The buffers that the passes hand to each other, and what they are filled with once.

use crate::error::Result;
use crate::gpu::{Buffer, Commands, Device, MemoryUsage, RecordCount, Recorder};
use crate::layout::cull::KeptRecord;
use crate::layout::facet::{FacetRecord, LitRecord, RegionRecord};
use crate::layout::frame::LightRecord;
use crate::layout::particle::TexturedRecord;
use crate::layout::particle::{
    BoxRecord, DrawnRecord, GroupRecord, ModeRecord, ParticleRecord, PlacedRecord,
};
use crate::model::basis::N_NODES;
use crate::model::cloud::{CloudSource, Group};
use crate::model::scene::{LightingMode, Scene};
use crate::passes::texture::POOL_TEXELS;

use super::culling::culls;
use super::feed::Feed;
use super::grouping::is_grouped;
use super::limits::n_cells_max;
use super::packet::Packet;

/// Named by content; record types as in [`crate::layout`].
pub struct Buffers {
    pub boxes: Buffer,
    /// u32 by particle.
    pub i_group: Buffer,
    pub particles: Buffer,
    /// u32 by particle: attempts, and whether it was folded.
    pub status: Buffer,
    pub groups: Feed,
    /// What of each group is drawn.
    pub drawn: Feed,
    pub modes: Feed,
    /// Fed where the game thread places the particles, else written by `place`.
    pub placed: Placed,
    pub density: Buffer,
    pub facets: Buffer,
    pub regions: Feed,
    pub lights: Feed,
    pub transmittance: Buffer,
    /// Its mean over each facet; empty where nothing asks for it.
    pub through: Buffer,
    pub lit: Buffer,
    /// Region of each facet of a surface.
    pub i_region: Buffer,
    /// The ground's facets, relative to their origins.
    pub ground: Buffer,
    /// Lobes by material, then the basis' vectors, N_NODES numbers each.
    pub table: Feed,
    /// Facet of each particle, where facets stand for several.
    pub i_facet: Buffer,
    /// [key, particle].
    pub entries: Buffer,
    /// How many of them there are (KeptRecord), where the device counts them.
    pub kept: Option<Buffer>,
    /// What each group is textured with, and the pool of textures; empty where nothing is.
    pub textured: Buffer,
    pub pool: Buffer,
}

/// Every particle's place.
pub enum Placed {
    ByHost(Box<Feed>),
    ByDevice(Buffer),
}

impl Placed {
    pub fn buffer(&self) -> &Buffer {
        match self {
            Placed::ByHost(feed) => &feed.buffer,
            Placed::ByDevice(buffer) => buffer,
        }
    }
}

impl Buffers {
    /// Writes what every frame brings along, into staging buffers of `slot`.
    pub fn write(&mut self, slot: usize, packet: &Packet) -> Result<()> {
        self.groups.write(slot, &packet.groups)?;
        self.drawn.write(slot, &packet.drawn)?;
        self.modes.write(slot, &packet.modes)?;
        self.table.write(slot, &packet.table)?;
        self.regions.write(slot, &packet.regions)?;
        self.lights.write(slot, &packet.lights)?;
        match (&mut self.placed, &packet.placed) {
            (Placed::ByHost(feed), Some(placed)) => feed.write(slot, placed),
            _ => Ok(()),
        }
    }

    /// Copies it to where shaders read it; the particles' places are `place`'s.
    pub fn record_feeds(&self, rec: &mut Recorder<'_>, slot: usize) {
        for feed in
            [&self.groups, &self.drawn, &self.modes, &self.table, &self.regions, &self.lights]
        {
            feed.record(rec, slot);
        }
    }

    /// What sprites are drawn from, as the pass asks for it.
    pub fn of_sprites(&self) -> [&Buffer; 9] {
        self.of_sprites_from(&self.entries)
    }

    /// The same with other entries.
    pub fn of_sprites_from<'a>(&'a self, entries: &'a Buffer) -> [&'a Buffer; 9] {
        let (placed, drawn) = (self.placed.buffer(), &self.drawn.buffer);
        let Buffers { particles, lit, i_facet, i_group, textured, pool, .. } = self;
        [entries, placed, particles, lit, i_facet, i_group, drawn, textured, pool]
    }

    /// How many entries are drawn, of `n_drawn` at most.
    pub fn amount(&self, n_drawn: u32) -> RecordCount<'_> {
        self.kept.as_ref().map_or(RecordCount::Known(n_drawn), RecordCount::Indirect)
    }

    pub fn new(
        device: &Device,
        scene: &Scene,
        groups: &[Group],
        host_places: bool,
    ) -> Result<Buffers> {
        let n = scene.n_particles();
        let n_facets = scene.n_facets();
        let n_groups = groups.len() as u64;
        let n_modes = scene.clouds.iter().map(|c| c.gust.modes(c.seed).len() as u64).sum();
        let n_lights = scene.lights.len() as u64;
        let n_ground = scene.n_solid_facets() - scene.n_surface_facets();
        let (n_textured, n_texels) =
            if scene.is_textured() { (n_groups, POOL_TEXELS) } else { (0, 0) };
        let n_named = if is_grouped(scene) { n } else { 0 };
        let n_through = if has_second(scene) { n_facets * n_lights } else { 0 };
        // No more vectors than were asked for.
        let n_table_rows = scene.materials.len() as u64 + u64::from(scene.lighting.bases) - 1;
        let placed = match host_places {
            true => Placed::ByHost(Box::new(Feed::new::<PlacedRecord>(device, "place.placed", n)?)),
            false => Placed::ByDevice(Buffer::new::<PlacedRecord>(
                device,
                "place.placed",
                n,
                MemoryUsage::Device,
            )?),
        };
        Ok(Buffers {
            boxes: Buffer::new::<BoxRecord>(
                device,
                "generate.boxes",
                n_groups,
                MemoryUsage::Device,
            )?,
            i_group: Buffer::new::<u32>(device, "generate.i_group", n, MemoryUsage::Device)?,
            particles: Buffer::new::<ParticleRecord>(
                device,
                "generate.particles",
                n,
                MemoryUsage::Device,
            )?,
            status: Buffer::new::<u32>(device, "generate.status", n, MemoryUsage::Device)?,
            groups: Feed::new::<GroupRecord>(device, "place.groups", n_groups)?,
            drawn: Feed::new::<DrawnRecord>(device, "sort.drawn", n_groups)?,
            modes: Feed::new::<ModeRecord>(device, "place.modes", n_modes)?,
            placed,
            density: Buffer::new::<f32>(
                device,
                "grid.density",
                n_cells_max(scene),
                MemoryUsage::Device,
            )?,
            facets: Buffer::new::<FacetRecord>(
                device,
                "facets.facets",
                n_facets,
                MemoryUsage::Device,
            )?,
            regions: Feed::new::<RegionRecord>(device, "first.regions", scene.n_regions() as u64)?,
            lights: Feed::new::<LightRecord>(device, "transmit.lights", n_lights)?,
            transmittance: Buffer::new::<f32>(
                device,
                "transmit.transmittance",
                n_facets * n_lights,
                MemoryUsage::Device,
            )?,
            i_region: Buffer::new::<u32>(
                device,
                "facets.i_region",
                scene.n_surface_facets(),
                MemoryUsage::Device,
            )?,
            ground: Buffer::new::<FacetRecord>(
                device,
                "terrain.ground",
                n_ground,
                MemoryUsage::Device,
            )?,
            table: Feed::new::<f32>(device, "first.table", n_table_rows * N_NODES as u64)?,
            through: Buffer::new::<f32>(
                device,
                "transmit.through",
                n_through,
                MemoryUsage::Device,
            )?,
            lit: Buffer::new::<LitRecord>(device, "first.lit", n_facets, MemoryUsage::Device)?,
            kept: kept(device, scene)?,
            i_facet: Buffer::new::<u32>(device, "facets.i_facet", n_named, MemoryUsage::Device)?,
            entries: Buffer::new::<[u32; 2]>(device, "sort.entries", n, MemoryUsage::Device)?,
            textured: Buffer::new::<TexturedRecord>(
                device,
                "texture.groups",
                n_textured,
                MemoryUsage::Device,
            )?,
            pool: Buffer::new::<[u32; 4]>(
                device,
                "texture.pool",
                u64::from(n_texels),
                MemoryUsage::Device,
            )?,
        })
    }

    /// Fills what never changes: the boxes, each particle's group, the particles of lists.
    pub fn fill(
        &self,
        device: &Device,
        commands: &mut Commands,
        scene: &Scene,
        groups: &[Group],
    ) -> Result<()> {
        let i_group: Vec<u32> = groups
            .iter()
            .zip(0u32..)
            .flat_map(|(g, i)| std::iter::repeat_n(i, g.n_particles as usize))
            .collect();
        let surfaces = scene.surfaces.iter().zip(0u32..);
        let i_region: Vec<u32> =
            surfaces.flat_map(|(s, i)| std::iter::repeat_n(i, s.n_facets() as usize)).collect();
        upload(device, commands, &i_region, &self.i_region)?;
        upload(device, commands, &ground_records(scene), &self.ground)?;
        upload(device, commands, &box_records(scene, groups), &self.boxes)?;
        upload(device, commands, &i_group, &self.i_group)?;
        if scene.is_textured() {
            upload(device, commands, &textured_records(scene, groups), &self.textured)?;
        }
        commands.run(|rec| {
            rec.fill(&self.status, 0);
            // What no pass of this scene writes is zero: L2 where there is a first reflection
            // alone.
            rec.fill(&self.lit, 0);
            Ok(())
        })?;
        if scene.lighting.mode == LightingMode::None {
            upload(device, commands, &unlit(scene), &self.lit)?;
        }
        upload(device, commands, &given_particles(scene, groups), &self.particles)
    }
}

/// Where the number of kept particles is; none where all are drawn.
pub(super) fn kept(device: &Device, scene: &Scene) -> Result<Option<Buffer>> {
    culls(scene)
        .then(|| Buffer::new::<KeptRecord>(device, "cull.kept", 1, MemoryUsage::Device))
        .transpose()
}

/// Whether there is a second reflection: it asks for what clouds alone let through.
pub fn has_second(scene: &Scene) -> bool {
    scene.lighting.mode == LightingMode::TwoReflection
}

/// Surfaces and ground that nothing lights show their materials' K_d, as particles show their
/// colours.
fn unlit(scene: &Scene) -> Vec<LitRecord> {
    let of = |(i_material, n_facets): (usize, u64)| {
        let first = scene.materials[i_material].at(scene.time.start_s).kd.as_vec3().to_array();
        std::iter::repeat_n(LitRecord { first, ..LitRecord::default() }, n_facets as usize)
    };
    let surfaces = scene.surfaces.iter().map(|s| (s.i_material, s.n_facets()));
    surfaces
        .chain(scene.terrains.iter().map(|t| (t.i_material, t.n_facets())))
        .flat_map(of)
        .collect()
}

/// The facets of all grounds.
fn ground_records(scene: &Scene) -> Vec<FacetRecord> {
    let grounds = scene.terrains.iter().zip(scene.surfaces.len() as u32..);
    grounds
        .flat_map(|(t, i_region)| t.facets().map(move |f| FacetRecord::terrain(&f, i_region)))
        .collect()
}

/// A record a group, in order.
pub(super) fn box_records(scene: &Scene, groups: &[Group]) -> Vec<BoxRecord> {
    let mut records = Vec::with_capacity(groups.len());
    for cloud in &scene.clouds {
        match &cloud.source {
            CloudSource::Boxes { boxes, law } => {
                for (b, i_box) in boxes.iter().zip(0u32..) {
                    let i_first = groups[records.len()].i_first;
                    records.push(BoxRecord::new(b, law, cloud.seed, i_box, i_first));
                }
            }
            CloudSource::Particles(_) | CloudSource::Disc(_) | CloudSource::Animated(_) => {
                records.push(BoxRecord::given())
            }
        }
    }
    records
}

/// A record a group, in order.
pub(super) fn textured_records(scene: &Scene, groups: &[Group]) -> Vec<TexturedRecord> {
    let of_group = |(g, i_box): (&Group, u32)| {
        let cloud = &scene.clouds[g.i_cloud];
        TexturedRecord::new(&cloud.texture, cloud.seed, i_box, g.i_first)
    };
    groups
        .chunk_by(|a, b| a.i_cloud == b.i_cloud)
        .flat_map(|boxes| boxes.iter().zip(0u32..).map(of_group))
        .collect()
}

/// Every particle that comes from a list at its place; zeros where particles are generated. Empty
/// without lists.
fn given_particles(scene: &Scene, groups: &[Group]) -> Vec<ParticleRecord> {
    let mut records = Vec::new();
    for group in groups {
        if let CloudSource::Particles(list) = &scene.clouds[group.i_cloud].source {
            records.resize(group.i_first as usize, ParticleRecord::default());
            records.extend(list.iter().map(|p| ParticleRecord::new(p, group)));
        }
    }
    records
}

/// Fills a device buffer with `data`.
pub fn upload<T: bytemuck::Pod>(
    device: &Device,
    commands: &mut Commands,
    data: &[T],
    to: &Buffer,
) -> Result<()> {
    if data.is_empty() {
        return Ok(());
    }
    let mut staging =
        Buffer::new::<T>(device, "frame.staging", data.len() as u64, MemoryUsage::Upload)?;
    staging.write(data)?;
    commands.run(|rec| {
        rec.copy(&staging, to);
        Ok(())
    })?;
    Ok(())
}

/// The first `n` records of a device buffer.
pub fn download<T: bytemuck::Pod>(
    device: &Device,
    commands: &mut Commands,
    from: &Buffer,
    n: u32,
) -> Result<Vec<T>> {
    let readback = Buffer::new::<T>(device, "frame.readback", u64::from(n), MemoryUsage::Readback)?;
    commands.run(|rec| {
        rec.copy(from, &readback);
        Ok(())
    })?;
    readback.read(n as usize)
}
