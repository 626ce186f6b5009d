//! The amounts of a frame that its floors follow from.

use glam::DVec3;

use super::layers::{Rays, layers};
use super::marches::march_samples;
use crate::error::Result;
use crate::frame::features::{
    colored_runs, gathers_from_tree, has_bounces, has_diffusion, has_glossy, has_impostors,
    has_live, has_second, is_lit, is_medium, region_sizes, target_format,
};
use crate::frame::packet::Packet;
use crate::frame::renderer::Renderer;
use crate::frame::tensor_shape::{Shape, basis_of, is_edited};
use crate::frame::tensors::bright_lights;
use crate::gpu::Device;
use crate::layout::facet::{FacetRecord, RegionRecord};
use crate::layout::particle::GroupRecord;
use crate::model::cloud::{CloudSource, Group};
use crate::model::grid::DEPOSIT_CUT_SIGMA;
use crate::model::harmonics::n_rest;
use crate::model::scene::{Scene, Simulate};
use crate::passes::blobs::Extent;
use crate::passes::texture::POOL_TEXELS;

/// Amounts of a frame, as real numbers: sums of them are beyond 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Amounts {
    /// Particles.
    pub particles: f64,
    /// Particles that are generated from boxes.
    pub box_particles: f64,
    /// Particles that are recomputed in every frame.
    pub live_particles: f64,
    /// Whether the game thread moves the particles.
    pub is_moved_by_host: bool,
    /// Waves of gusts, over all particles.
    pub waves: f64,
    /// Cells of the density grid.
    pub cells: f64,
    /// Cells that blobs reach, over all particles: at least this many.
    pub deposits: f64,
    /// Facets.
    pub facets: f64,
    /// Facets of clouds.
    pub cloud_facets: f64,
    /// Particles that facets are made from.
    pub lit_particles: f64,
    /// Whether a facet stands for several particles.
    pub is_grouped: bool,
    /// Lights.
    pub lights: f64,
    /// Samples of the density on all paths to lights, counted in the frame.
    pub march_samples: f64,
    /// Whether light is reflected twice.
    pub has_second: bool,
    /// Whether clouds are a medium.
    pub is_medium: bool,
    /// Cycles of the diffusion solver; 0 without.
    pub cycles: f64,
    /// Particles whose colours change with the direction of view.
    pub colored_particles: f64,
    /// Harmonics of all of them, the mean included.
    pub harmonics: f64,
    /// Visits of cells by ways along which bounces gather.
    pub gathered: f64,
    /// Whether some material has a lobe.
    pub is_glossy: bool,
    /// Pairs of receiver and source that are looked at: at least this many.
    pub pairs: f64,
    /// Numbers of the light tensors, if they are kept.
    pub tensor_numbers: Option<f64>,
    /// Particles drawn, as many as `draw.count` asks for.
    pub drawn: f64,
    /// Particles that are left after culling.
    pub kept: f64,
    /// Whether the device culls.
    pub culls: bool,
    /// Bytes of a sort key.
    pub key_bytes: f64,
    /// Texels of the pool of textures.
    pub texels: f64,
    /// Pixels of the film.
    pub film_pixels: f64,
    /// Bytes of a pixel.
    pub pixel_bytes: f64,
    /// Whether blobs are blended over a picture of solids.
    pub has_solids: bool,
    /// The picture that blobs are drawn into; `None` where an impostor layer may replace them.
    pub blobs: Option<Blobs>,
}

/// The picture that blobs are drawn into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blobs {
    /// Its pixels.
    pub pixels: f64,
    /// Layers that its pixels are made of, over all pixels: blobs that have not ended, near to far,
    /// until nothing behind them shows. A mean over some rays of the frame, times the pixels; 0
    /// where thresholds or other numbers of blobs leave some of them out. Blobs in and behind the
    /// bounds of a solid do not count.
    pub layers: f64,
}

impl Amounts {
    /// Returns the amounts of the last frame that `renderer` drew of `scene`; `None` before its
    /// first frame.
    ///
    /// # Errors
    /// Fails if a frame is in flight or the device is lost.
    pub fn measured(
        renderer: &mut Renderer,
        device: &Device,
        scene: &Scene,
    ) -> Result<Option<Amounts>> {
        renderer.check_idle()?;
        let Some(packet) = renderer.last.clone() else { return Ok(None) };
        let mut of = Amounts::known(scene, &packet);
        if let Some(n) = renderer.n_kept_last()? {
            (of.culls, of.kept) = (true, f64::from(n));
        }
        let mut facets = Vec::new();
        if of.facets > 0.0 {
            facets = renderer.facets(device)?.0;
            let transmittance = renderer.transmittance(device)?;
            of.march_samples = march_samples(scene, &packet, &facets, &transmittance);
        }
        if !has_impostors(scene) {
            let (camera, size) = renderer.blob_camera(&packet);
            let pixels = f64::from(size[0]) * f64::from(size[1]);
            let mut per_pixel = 0.0;
            if scene.draw.count.is_none() && of.particles > 0.0 {
                let (placed, particles) = (renderer.placed(device)?, renderer.particles(device)?);
                let bounds = (scene.draw.edge(), renderer.saturated());
                let rays = Rays::new(&camera, size, placed.len());
                let solids = solids(scene, &packet, &facets);
                per_pixel = layers(&rays, &camera, &placed, &particles, &solids, bounds);
            }
            of.blobs = Some(Blobs { pixels, layers: pixels * per_pixel });
        }
        Ok(Some(of))
    }

    /// Returns the amounts that need no measurement: counts of the scene and of `packet`.
    pub fn known(scene: &Scene, packet: &Packet) -> Amounts {
        let count = |n: u64| n as f64;
        let lit = is_lit(scene);
        let n_of = |is: &dyn Fn(&CloudSource) -> bool| -> f64 {
            let clouds = scene.clouds.iter().filter(|c| is(&c.source));
            clouds.map(|c| count(c.n_particles())).sum()
        };
        let particles = count(scene.n_particles());
        let film_pixels = f64::from(scene.film.width) * f64::from(scene.film.height);
        let facets = if lit { count(scene.n_facets()) } else { 0.0 };
        let cloud_facets = if lit { facets - count(scene.n_solid_facets()) } else { 0.0 };
        let is_moved_by_host = scene.threads.simulate == Simulate::Cpu;
        let [x, y, z] = packet.grid.n_cells.map(f64::from);
        // Light tensors gather every pair; a tree looks at one cluster at least.
        let is_tree = gathers_from_tree(scene) && !is_edited(scene);
        Amounts {
            particles,
            box_particles: n_of(&|source| matches!(source, CloudSource::Boxes { .. })),
            live_particles: match has_live(scene) {
                true => n_of(&|s| matches!(s, CloudSource::Disc(_) | CloudSource::Animated(_))),
                false => 0.0,
            },
            is_moved_by_host,
            waves: if is_moved_by_host { 0.0 } else { waves(scene, packet) },
            colored_particles: colored_runs(scene).iter().map(|r| f64::from(r.n_particles)).sum(),
            harmonics: colored_runs(scene)
                .iter()
                .map(|r| f64::from(r.n_particles) * f64::from(1 + n_rest(r.degree)))
                .sum(),
            cells: if lit { x * y * z } else { 0.0 },
            deposits: if lit { deposits(scene, packet) } else { 0.0 },
            facets,
            cloud_facets,
            lit_particles: if lit { particles } else { 0.0 },
            is_grouped: lit && scene.groups_facets(),
            lights: scene.lights.len() as f64,
            march_samples: 0.0,
            has_second: has_second(scene),
            is_medium: is_medium(scene),
            cycles: match has_diffusion(scene) {
                true => f64::from(scene.lighting.diffusion.cycles),
                false => 0.0,
            },
            gathered: if lit { gathered(scene, [x, y, z]) } else { 0.0 },
            is_glossy: has_glossy(scene),
            pairs: if is_tree { facets } else { facets * (cloud_facets - 1.0).max(0.0) },
            tensor_numbers: is_edited(scene).then(|| tensor_numbers(scene, packet)),
            drawn: f64::from(packet.n_drawn),
            kept: f64::from(packet.n_drawn),
            culls: false,
            key_bytes: f64::from(packet.sort_bits) / 8.0,
            texels: if scene.is_textured() { f64::from(POOL_TEXELS) } else { 0.0 },
            film_pixels,
            pixel_bytes: target_format(scene.film.format).bytes_per_pixel() as f64,
            has_solids: scene.has_solids(),
            blobs: None,
        }
    }
}

/// Returns boxes around surfaces and terrains, relative to the lighting origin. Terrain that has no
/// facets, without light, may be anywhere.
fn solids(scene: &Scene, packet: &Packet, facets: &[FacetRecord]) -> Vec<[DVec3; 2]> {
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let anywhere = [DVec3::NEG_INFINITY, DVec3::INFINITY];
    let around = |points: &mut dyn Iterator<Item = DVec3>| {
        let first = points.next().map(|p| [p, p])?;
        Some(points.fold(first, |[low, high], p| [low.min(p), high.max(p)]))
    };
    let of = |(i, region): (usize, &RegionRecord)| {
        let [center, u, v] = [region.center, region.u, region.v].map(vector);
        if i < scene.surfaces.len() {
            let half = u.abs() + v.abs();
            return [center - half, center + half];
        }
        let first = region.i_first_facet as usize;
        let own = facets.get(first..first + region.n_facets as usize).unwrap_or(&[]);
        around(&mut own.iter().map(|f| vector(f.position))).unwrap_or(anywhere)
    };
    packet.regions.iter().take(scene.n_solids()).enumerate().map(of).collect()
}

/// Returns the waves of all particles' gusts.
fn waves(scene: &Scene, packet: &Packet) -> f64 {
    let groups = scene.groups();
    let of = |(group, record): (&Group, &GroupRecord)| {
        f64::from(group.n_particles) * f64::from(record.n_modes)
    };
    groups.iter().zip(&packet.groups).map(of).sum()
}

/// Least σ of what is deposited on wider cells, in these: √(1.5² − ½).
const LEAST_SIGMA: f64 = 1.322;

/// Returns the least number of cells that blobs reach. A blob of σ reaches over 6σ along each axis,
/// which is at least 6σ/h cells of edge h, and one. The product is convex in σ, so that the blobs
/// of a group reach at least as many as if all had their mean σ. A blob on wider cells has at least
/// [`LEAST_SIGMA`] of them a σ. Any blob has fewer of cells of which the widest blob has so many.
/// Where some are deposited narrower than they are, each counts as one cell: those shares of a blob
/// that round to nothing are left out.
fn deposits(scene: &Scene, packet: &Packet) -> f64 {
    let widest = packet.extents.iter().map(|e| e.sigma_max).fold(0.0, f64::max);
    let least = if packet.n_levels > 1 { widest / LEAST_SIGMA } else { 0.0 };
    let cell = f64::from(packet.grid.cell);
    let reached =
        |sigma: f64, edge: f64| (2.0 * DEPOSIT_CUT_SIGMA * sigma / edge.max(least)).max(1.0);
    let groups = scene.groups();
    let of = |((group, record), extent): ((&Group, &GroupRecord), &Extent)| {
        // The mean σ of turned ellipsoids is that of their longest axes. All count as balls of the
        // shortest.
        let least = if group.turned_max > 0.0 { group.aspects[0].min(1.0) } else { 1.0 };
        let across = reached(least * f64::from(record.sigma_mean), cell);
        let along = reached(least * extent.sigma_mean, cell * f64::from(packet.grid.aspect));
        let cells = if packet.n_blurs > 0 { 1.0 } else { across * across * along };
        f64::from(group.n_particles) * cells
    };
    groups.iter().zip(&packet.groups).zip(&packet.extents).map(of).sum()
}

/// Returns the numbers of T1 and T2 that are summed: by light with energy, each row of a region
/// with the columns of the regions whose light can reach it.
fn tensor_numbers(scene: &Scene, packet: &Packet) -> f64 {
    let shape = Shape::new(scene, basis_of(scene).map_or(1, |basis| basis.n_bases()));
    let spans = shape.spans(scene);
    let of_region = |(i, n_facets): (usize, u32)| {
        let rows = f64::from(n_facets) * f64::from(1 + shape.blocks[i].n_vectors);
        let [first, n] = spans[i].map(|n| n as usize);
        let columns: u32 = spans[first..first + n].iter().map(|[_, n]| n).sum();
        rows * f64::from(1 + columns)
    };
    let of_light: f64 = region_sizes(scene).into_iter().enumerate().map(of_region).sum();
    of_light * bright_lights(&packet.lights).count() as f64
}

/// Returns the visits of cells by bounces, at least. Of each cell 24 ways lead to the box. In the
/// mean they pass more than half of the cells along its shortest axis.
fn gathered(scene: &Scene, [x, y, z]: [f64; 3]) -> f64 {
    if !has_bounces(scene) {
        return 0.0;
    }
    let of = scene.lighting.diffusion;
    let (bounces, edge) = (f64::from(of.bounces), f64::from(of.bounce_cells));
    let [x, y, z] = [x, y, z].map(|n| (n / edge).ceil());
    24.0 * bounces * x * y * z * x.min(y).min(z) / 2.0
}
