//! Properties of a scene that decide which passes, pipelines and buffers it needs. They are
//! constant over a run.

use crate::gpu::TargetFormat;
use crate::model::cloud::{Cloud, CloudSource, Group, SQRT_TAU};
use crate::model::disc::Disc;
use crate::model::film::FilmFormat;
use crate::model::light::Light;
use crate::model::lod::RUN;
use crate::model::relief;
use crate::model::resolution::Resolution;
use crate::model::scene::{
    Cull, DrawPath, Gather, Impostors, LightingMode, Overlap, Scene, Simulate,
};
use crate::passes::blobs::BlobVariant;
use crate::passes::blobs::THIN;
use crate::passes::harmonics::Colored;

/// Properties of a scene in which no knob is "auto".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SceneFeatures {
    /// Some particles come from boxes.
    pub has_boxes: bool,
    /// Some particles are recomputed in every frame.
    pub has_live: bool,
    /// Number of particles.
    pub n_particles: u32,
    /// Number of facets.
    pub n_facets: u32,
    /// `lighting.mode` is not "none".
    pub is_lit: bool,
    /// `lighting.mode` is "two-reflection".
    pub has_second: bool,
    /// Clouds are a medium.
    pub is_medium: bool,
    /// `lighting.mode` is "diffusion".
    pub has_diffusion: bool,
    /// Facets stand for several particles.
    pub is_grouped: bool,
    /// Some cloud has a texture.
    pub is_textured: bool,
    /// Blobs stand for others.
    pub has_lod: bool,
    /// Some colours change with the direction of view.
    pub has_harmonics: bool,
    /// Air lies before the facets.
    pub has_haze: bool,
    /// Number of surfaces.
    pub n_surfaces: u32,
    /// Number of terrains.
    pub n_terrains: u32,
    /// Ground may hide lights from its own points.
    pub has_relief: bool,
    /// Some light is at a point, not a sun or a sky.
    pub has_lamps: bool,
    /// Some region has a specular lobe or a phase function, so that its radiance depends on the
    /// eye.
    pub is_glossy: bool,
    /// Whether light tensors are kept.
    pub tensors: Tensors,
    /// Distant blobs may be shown from a picture of them.
    pub has_impostors: bool,
    /// Particles that show in no pixel are left out.
    pub culls: bool,
    /// The pass that draws blobs.
    pub path: DrawPath,
    /// Blobs are composed by slices.
    pub is_sliced: bool,
    /// Blobs are drawn into a smaller picture.
    pub is_low_res: bool,
}

/// Whether a scene keeps the tensors that let `contract` alone follow the edit of a material.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tensors {
    /// The tensors are kept.
    Kept,
    /// No material is edited.
    Needless,
    /// T2 does not fit the device.
    TooLarge {
        /// Bytes of T2.
        bytes: u64,
        /// Bytes that the device has for it.
        most: u64,
    },
}

impl SceneFeatures {
    /// Returns the properties of `scene`, in which no knob is "auto".
    pub fn new(scene: &Scene, tensors: Tensors) -> SceneFeatures {
        let is_box = |c: &Cloud| matches!(c.source, CloudSource::Boxes { .. });
        SceneFeatures {
            has_boxes: scene.clouds.iter().any(is_box),
            has_live: has_live(scene),
            n_particles: scene.n_particles() as u32,
            n_facets: scene.n_facets() as u32,
            is_lit: is_lit(scene),
            has_second: has_second(scene),
            is_medium: is_medium(scene),
            has_diffusion: has_diffusion(scene),
            is_grouped: is_grouped(scene),
            is_textured: scene.is_textured(),
            has_lod: has_lod(scene),
            has_harmonics: !colored_runs(scene).is_empty(),
            has_haze: has_haze(scene),
            n_surfaces: scene.surfaces.len() as u32,
            n_terrains: scene.terrains.len() as u32,
            has_relief: has_relief(scene),
            has_lamps: scene.lights.iter().any(Light::is_lamp),
            is_glossy: has_glossy(scene) || is_medium(scene),
            tensors,
            has_impostors: has_impostors(scene),
            culls: culls(scene),
            path: scene.draw.path,
            is_sliced: scene.draw.overlap == Overlap::Slices,
            is_low_res: scene.draw.resolution != Resolution::Full,
        }
    }
}

impl SceneFeatures {
    /// Returns whether there are surfaces or terrains.
    pub fn has_solids(&self) -> bool {
        self.n_surfaces + self.n_terrains > 0
    }
}

/// Returns whether `lighting.mode` is not "none".
pub fn is_lit(scene: &Scene) -> bool {
    scene.lighting.mode != LightingMode::None
}

/// Returns whether the scene has a second reflection.
pub fn has_second(scene: &Scene) -> bool {
    scene.lighting.mode == LightingMode::TwoReflection
}

/// Returns whether clouds are a medium.
pub fn is_medium(scene: &Scene) -> bool {
    scene.lighting.mode.is_medium()
}

/// Returns whether light diffuses on the density grid.
pub fn has_diffusion(scene: &Scene) -> bool {
    scene.lighting.mode == LightingMode::Diffusion
}

/// Returns whether bounces between cells follow diffusion.
pub fn has_bounces(scene: &Scene) -> bool {
    scene.lighting.has_bounces()
}

/// Returns whether the light changes inside of each blob.
pub fn has_slopes(scene: &Scene) -> bool {
    scene.lighting.has_slopes()
}

/// Returns whether air lies before lit facets.
pub fn has_haze(scene: &Scene) -> bool {
    is_lit(scene) && scene.has_haze()
}

/// Returns whether some lit ground is a sea that mirrors a sky.
pub fn has_sea(scene: &Scene) -> bool {
    is_lit(scene) && scene.has_sea()
}

/// Returns whether ground may hide lights from its own points.
pub fn has_relief(scene: &Scene) -> bool {
    is_lit(scene) && relief::may_hide(&scene.terrains, &scene.lights)
}

/// Returns whether lit facets stand for several particles.
pub fn is_grouped(scene: &Scene) -> bool {
    is_lit(scene) && scene.groups_facets()
}

/// Returns whether blobs stand for others.
pub fn has_lod(scene: &Scene) -> bool {
    scene.draw.lod > 0.0 && scene.n_particles() > 0
}

/// Returns the particles whose colours change with the direction of view: none where light decides
/// what they show.
pub fn colored_runs(scene: &Scene) -> Vec<Colored> {
    if is_lit(scene) {
        return vec![];
    }
    let run = |g: &Group| match &scene.clouds[g.i_cloud].source {
        CloudSource::Particles(list) => list.harmonics().map(|of| Colored {
            i_first: g.i_first,
            n_particles: g.n_particles,
            degree: of.degree,
        }),
        _ => None,
    };
    scene.groups().iter().filter_map(run).collect()
}

/// Returns whether distant blobs may be shown from a picture of them.
pub fn has_impostors(scene: &Scene) -> bool {
    scene.draw.impostors != Impostors::Off
}

/// Returns whether the device leaves out particles that show in no pixel. Impostor layers include
/// every particle, so that they stay valid when the camera turns.
pub fn culls(scene: &Scene) -> bool {
    scene.draw.cull != Cull::Off && !has_impostors(scene) && scene.n_particles() > 0
}

/// Returns the scene's discs in order, with their clouds and the indices of these.
pub fn discs(scene: &Scene) -> impl Iterator<Item = (usize, &Cloud, &Disc)> {
    scene.clouds.iter().enumerate().filter_map(|(i, cloud)| match &cloud.source {
        CloudSource::Disc(disc) => Some((i, cloud, disc)),
        _ => None,
    })
}

/// Returns whether some particles are recomputed in every frame.
pub fn has_live(scene: &Scene) -> bool {
    discs(scene).next().is_some() || scene.is_animated()
}

/// Returns whether the game thread recomputes particles in every frame.
pub fn has_live_on_host(scene: &Scene) -> bool {
    scene.threads.simulate == Simulate::Cpu && has_live(scene)
}

/// Returns whether the specular lobe of a region is computed.
pub fn is_glossy(scene: &Scene, i_region: usize) -> bool {
    scene.lighting.bases > 1 && scene.region_material(i_region).is_glossy()
}

/// Returns whether the specular lobe of some region is computed.
pub fn has_glossy(scene: &Scene) -> bool {
    (0..scene.n_regions()).any(|i| is_glossy(scene, i))
}

/// Returns whether the second reflection is gathered from a tree of clusters.
pub fn gathers_from_tree(scene: &Scene) -> bool {
    /// The number of facets from which on the tree is faster (docs/reference/measured.md).
    const MIN_FACETS: u64 = 1024;
    match scene.lighting.gather {
        Gather::Exact => false,
        Gather::Tree => true,
        Gather::Auto => scene.n_facets() >= MIN_FACETS,
    }
}

/// Returns the number of facets of each region.
pub(super) fn region_sizes(scene: &Scene) -> Vec<u32> {
    let of_surfaces = scene.surfaces.iter().map(|s| s.n_facets());
    let of_terrains = scene.terrains.iter().map(|t| t.n_facets());
    let of_clouds = scene.clouds.iter().map(|c| scene.n_cloud_facets(c));
    of_surfaces.chain(of_terrains).chain(of_clouds).map(|n| n as u32).collect()
}

/// Returns the properties of the scene's blobs.
pub(super) fn blob_variant(scene: &Scene) -> BlobVariant {
    let in_cells = scene.has_light_of_cells();
    BlobVariant {
        lit: is_lit(scene),
        grouped: is_grouped(scene),
        weighted: scene.draw.count.is_some(),
        textured: scene.is_textured(),
        threshold: scene.draw.edge().has_threshold(),
        shapes: scene.shapes(),
        thin: is_thin(scene) && !scene.is_textured(),
        shaded: has_slopes(scene) && !in_cells,
        in_cells,
    }
}

/// Returns the film's format as a render target's.
pub fn target_format(format: FilmFormat) -> TargetFormat {
    match format {
        FilmFormat::Rgba8 => TargetFormat::Rgba8,
        FilmFormat::Rgba16f => TargetFormat::Rgba16f,
        FilmFormat::Rgba32f => TargetFormat::Rgba32f,
    }
}

/// Returns the transmittance below which a pixel of `format` hides everything behind it: half a
/// step of the format below 1.
pub fn saturation_bound(format: FilmFormat) -> f64 {
    0.5 * format.unit_roundoff()
}

/// Returns whether the tile shaders for thin blobs draw the scene.
pub(super) fn is_thin(scene: &Scene) -> bool {
    tau_max(scene) <= THIN
}

/// Returns a bound of the optical depth of every blob at any time.
pub(super) fn tau_max(scene: &Scene) -> f64 {
    let of = |g: &Group| tau_bound(scene, &g.grown(scene.clouds[g.i_cloud].growth.to.max(1.0)));
    scene.groups().iter().map(of).fold(0.0, f64::max)
}

/// Returns a bound of the optical depth of every blob of `group`, as it has grown.
pub(super) fn tau_bound(scene: &Scene, group: &Group) -> f64 {
    if scene.is_animated() {
        return f64::INFINITY;
    }
    SQRT_TAU * group.kappa_max * group.sigma_widest() * denser_at_most(scene, group)
}

/// Returns a bound of the factor on the extinction of `group` where few particles stand for all.
pub(super) fn denser_at_most(scene: &Scene, group: &Group) -> f64 {
    let conserves = scene.draw.count.is_some_and(|c| c.conserve);
    let by_count = if conserves { f64::from(group.n_particles) } else { 1.0 };
    // With merged blobs, one stands for a run at most.
    let by_run = (scene.n_particles() as f64).min(f64::from(RUN));
    if has_lod(scene) { by_count * by_run } else { by_count }
}
