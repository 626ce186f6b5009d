//! The buffers that passes share.

use super::features::{
    colored_runs, has_bounces, has_diffusion, has_haze, has_relief, has_sea, has_second,
    has_slopes, is_grouped, is_lit, is_medium,
};
use super::packet::Packet;
use super::staging::StagedBuffer;
use crate::error::Result;
use crate::gpu::{Buffer, Recorder, buffers};
use crate::layout::cull::KeptRecord;
use crate::layout::diffusion::N_PATCHES;
use crate::layout::facet::{FacetRecord, LitRecord, RegionRecord, SlopeRecord};
use crate::layout::frame::LightRecord;
use crate::layout::harmonics::n_texels;
use crate::layout::medium::MediumRecord;
use crate::layout::particle::{
    BoxRecord, DrawnRecord, GroupRecord, ModeRecord, ParticleRecord, PlacedRecord, Shapes,
    TexturedRecord,
};
use crate::layout::relief::ReliefNodeRecord;
use crate::layout::sky::SkyRecord;
use crate::model::basis::N_NODES;
use crate::model::cloud::{Cloud, CloudSource};
use crate::model::grid::{self, DEPOSIT_CUT_SIGMA, MAX_CELLS};
use crate::model::material::Material;
use crate::model::relief;
use crate::model::scene::Scene;
use crate::passes::blobs::BlobBuffers;
use crate::passes::diffusion::Room;
use crate::passes::grid::Room as GridRoom;
use crate::passes::harmonics::Colored;
use crate::passes::texture::POOL_TEXELS;

buffers! {
    /// The buffers that passes share, with records of [`crate::layout`].
    pub(super) struct SceneBuffers(scene: &Scene) {
        /// Boxes by group.
        boxes: Buffer => BoxRecord, n_groups(scene), "generate.boxes";
        /// Group by particle.
        i_group: Buffer => u32, scene.n_particles(), "generate.i_group";
        /// Particles relative to their groups.
        particles: Buffer => ParticleRecord, scene.n_particles(), "generate.particles",
            TexelStores;
        /// Attempts by particle, and whether it was folded back.
        status: Buffer => u32, scene.n_particles(), "generate.status";
        groups: StagedBuffer => GroupRecord, n_groups(scene), "place.groups";
        /// Gusts of all clouds.
        modes: StagedBuffer => ModeRecord, n_modes(scene), "place.modes";
        placed: Buffer => PlacedRecord, scene.n_particles(), "place.placed", TexelStores;
        /// Extinction by cell.
        density: Buffer => f32, n_cells(scene), "grid.density", Floats;
        facets: Buffer => FacetRecord, scene.n_facets(), "facets.facets";
        /// Region by facet of a surface.
        i_region: Buffer => u32, scene.n_surface_facets(), "facets.i_region";
        /// Facet by particle, where facets stand for several.
        i_facet: Buffer => u32, n_if(is_grouped(scene), scene.n_particles()), "facets.i_facet";
        /// Points of all terrains, relative to their origins.
        ground: Buffer => FacetRecord, n_ground_facets(scene), "terrain.ground";
        /// Boxes over the cells of all terrains.
        relief: Buffer => ReliefNodeRecord, n_if(has_relief(scene), n_relief_nodes(scene)),
            "relief.nodes";
        /// 1 where ground hides a light, by point of the ground and light.
        hidden: Buffer => u32,
            n_if(has_relief(scene), n_ground_facets(scene) * scene.lights.len() as u64),
            "relief.hidden";
        lights: StagedBuffer => LightRecord, scene.lights.len() as u64, "transmit.lights";
        /// By facet and light.
        transmittance: Buffer => f32, n_pairs(scene), "transmit.transmittance";
        /// Transmittance of the clouds alone, for the second reflection.
        through: Buffer => f32, n_if(has_second(scene), n_pairs(scene)), "transmit.through";
        /// Medium of each cloud, in modes that have one.
        media: StagedBuffer => MediumRecord,
            n_if(is_medium(scene), scene.clouds.len() as u64), "scatter.media";
        /// Fluence and flux of diffuse light by cell, and fluence of suns and lamps.
        field: Buffer => [[f32; 4]; 4], n_if(has_diffusion(scene), n_cells(scene)),
            "diffusion.field", Texels;
        /// The same by patch of the grid's box, for surfaces and ground.
        patches: Buffer => [[f32; 4]; 4],
            n_if(has_diffusion(scene) && scene.has_solids(), u64::from(N_PATCHES)),
            "diffusion.patches", Texels;
        /// Radiance that cells scatter toward the eye, and extinction, with bounces.
        seen: Buffer => [f32; 4], n_if(has_bounces(scene), n_cells(scene)), "scatter.seen", Texels;
        regions: StagedBuffer => RegionRecord, scene.n_regions() as u64, "first.regions", Texels;
        /// Lobes by material, then the vectors of the basis, N_NODES numbers each.
        table: StagedBuffer => f32, n_table_rows(scene) * N_NODES as u64, "first.table", Floats;
        lit: Buffer => LitRecord, scene.n_facets(), "first.lit";
        /// The sky as the eye sees it.
        sky: StagedBuffer => SkyRecord, n_if(scene.sky.is_some(), 1), "haze.sky";
        /// Mean square of the slopes of each region's sea.
        seas: Buffer => f32, n_if(has_sea(scene), scene.n_solids() as u64), "haze.seas";
        /// Light of facets behind the air.
        hazed: Buffer => LitRecord, n_if(has_haze(scene), scene.n_facets()), "haze.lit";
        hazed_slopes: Buffer => SlopeRecord,
            n_if(has_haze(scene) && has_slopes(scene), scene.n_facets()), "haze.slopes";
        /// Change of the light inside of blobs, by facet.
        slopes: Buffer => SlopeRecord, n_if(has_slopes(scene), scene.n_facets()),
            "scatter.slopes";
        /// Number of kept particles.
        kept: Buffer => KeptRecord, 1, "cull.kept";
        /// The drawn part of each group.
        drawn: StagedBuffer => DrawnRecord, n_groups(scene), "sort.drawn";
        /// Sort key and particle.
        entries: Buffer => [u32; 2], scene.n_particles(), "sort.entries";
        /// Texture by group.
        textured: Buffer => TexturedRecord, n_if(scene.is_textured(), n_groups(scene)),
            "texture.groups";
        /// Coefficients of harmonics of the particles that have some.
        harmonics: Buffer => [f32; 4], n_harmonic_texels(scene), "harmonics.coefficients",
            TexelStores;
        /// Texels of the pool of textures.
        pool: Buffer => [u32; 4], n_if(scene.is_textured(), POOL_TEXELS.into()),
            "texture.pool", Texels;
    }
}

impl SceneBuffers {
    /// Writes the data of `packet` into the staging buffers of `slot`.
    pub fn write(&mut self, slot: usize, packet: &Packet) -> Result<()> {
        self.groups.write(slot, &packet.groups)?;
        self.drawn.write(slot, &packet.drawn)?;
        self.modes.write(slot, &packet.modes)?;
        self.table.write(slot, &packet.table)?;
        self.regions.write(slot, &packet.regions)?;
        self.media.write(slot, &packet.media)?;
        if let Some(sky) = packet.sky {
            self.sky.write(slot, &[sky])?;
        }
        self.lights.write(slot, &packet.lights)
    }

    /// Copies the staged data to where shaders read it.
    pub fn record_copies(&self, rec: &mut Recorder<'_>, slot: usize) {
        let SceneBuffers { groups, drawn, modes, table, media, regions, lights, sky, .. } = self;
        for staged in [groups, drawn, modes, table, media, regions, lights, sky] {
            staged.record_copy(rec, slot);
        }
    }

    /// Returns the light of facets that is drawn, and its changes inside of blobs: behind the air
    /// where a scene has some.
    pub fn shown_light(&self, has_haze: bool) -> [&Buffer; 2] {
        match has_haze {
            true => [&self.hazed, &self.hazed_slopes],
            false => [&self.lit, &self.slopes],
        }
    }

    /// Returns the buffers that blobs are drawn from.
    pub fn of_blobs(&self, has_haze: bool) -> BlobBuffers<'_> {
        let [lit, slopes] = self.shown_light(has_haze);
        let SceneBuffers { entries, placed, particles, i_facet, i_group, drawn, .. } = self;
        let SceneBuffers { textured, pool, seen, .. } = self;
        BlobBuffers {
            entries,
            placed,
            particles,
            lit,
            i_facet,
            i_group,
            drawn,
            textured,
            pool,
            slopes,
            seen,
        }
    }
}

fn n_if(is_used: bool, n: u64) -> u64 {
    if is_used { n } else { 0 }
}

fn n_groups(scene: &Scene) -> u64 {
    scene.clouds.iter().map(|c| c.n_groups()).sum()
}

fn n_harmonic_texels(scene: &Scene) -> u64 {
    let of_run = |run: &Colored| u64::from(run.n_particles) * u64::from(n_texels(run.degree));
    colored_runs(scene).iter().map(of_run).sum()
}

fn n_modes(scene: &Scene) -> u64 {
    scene.clouds.iter().map(|c| u64::from(c.gust.n_waves)).sum()
}

fn n_ground_facets(scene: &Scene) -> u64 {
    scene.n_solid_facets() - scene.n_surface_facets()
}

fn n_relief_nodes(scene: &Scene) -> u64 {
    scene.terrains.iter().map(relief::n_nodes).sum()
}

fn n_pairs(scene: &Scene) -> u64 {
    scene.n_facets() * scene.lights.len() as u64
}

/// Returns the rows of the table, none if nothing is lit: the basis has at most as many vectors as
/// the scene asks for.
fn n_table_rows(scene: &Scene) -> u64 {
    n_if(is_lit(scene), scene.materials.len() as u64 + u64::from(scene.lighting.bases) - 1)
}

/// Returns the most cells that the density grid has at any time; 0 if nothing is lit.
pub fn n_cells(scene: &Scene) -> u64 {
    if is_lit(scene) { n_cells_max(scene) } else { 0 }
}

/// Returns the room for the deposit of the particles in the density grid.
pub fn grid_room(scene: &Scene) -> GridRoom {
    let (n, side) = (scene.n_particles(), scene.lighting.grid.min(MAX_CELLS));
    // Such blobs are balls in cells at every time.
    let may_be_balls = scene.shapes() < Shapes::Turned && !scene.is_animated();
    GridRoom {
        n_cells: n_cells(scene),
        has_levels: is_lit(scene) && grid::has_levels(n, side),
        has_narrow: is_lit(scene) && may_be_balls && grid::has_narrow(n, side),
    }
}

/// Returns the room that the diffusion of light takes; `None` without.
pub(super) fn diffusion_room(scene: &Scene) -> Option<Room> {
    let grey = |v: glam::DVec3| v.x == v.y && v.y == v.z;
    let is_grey = |m: &Material| {
        grey(m.scattering.albedo.unwrap_or_default()) && m.keys.iter().all(|k| grey(k.brdf.kd))
    };
    let has_colors = |c: &Cloud| match &c.source {
        CloudSource::Particles(list) => !list.summary().is_grey,
        _ => false,
    };
    let plain = |c: &Cloud| is_grey(&scene.materials[c.i_material]) && !has_colors(c);
    let n_sets = if scene.clouds.iter().all(plain) { 1 } else { 3 };
    let n_solid_facets = scene.n_solid_facets();
    let bounce_cells = if has_bounces(scene) { scene.lighting.diffusion.bounce_cells } else { 0 };
    let more = (has_slopes(scene), bounce_cells, scene.lighting.order() > 1);
    has_diffusion(scene).then(|| Room::new(n_cells(scene), n_sets, more, n_solid_facets))
}

/// Returns the most cells of a density grid at any time. Clouds that drift apart or grow change its
/// proportions, so a scene that moves needs room for a cube.
fn n_cells_max(scene: &Scene) -> u64 {
    let side = u64::from(scene.lighting.grid.min(MAX_CELLS));
    let is_still =
        |c: &crate::model::cloud::Cloud| c.drift() == glam::DVec3::ZERO && c.growth.is_none();
    let groups = scene.groups();
    match scene.bounds(&groups, scene.time.start_s, DEPOSIT_CUT_SIGMA) {
        Some((low, high)) if scene.clouds.iter().all(is_still) => {
            scene.density_grid(&groups, 0.5 * (high - low)).n_total()
        }
        _ => side * side * side,
    }
}
