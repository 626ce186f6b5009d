//! A scene: everything that a run is made of, checked and complete, with defaults filled in and
//! references resolved.

use std::borrow::Cow;

use glam::{DVec2, DVec3};

use super::air::Air;
use super::camera::Camera;
use super::cell_aspect::cell_aspect;
use super::cloud::{Cloud, CloudSource, Group, Shapes, runs};
use super::cover::Sea;
pub use super::draw::{Chunks, Cull, Draw, DrawPath, Impostors, MAX_CHUNKS};
use super::film::Film;
use super::grid::GridSpec;
use super::group::mean_aspect_of;
use super::light::Light;
pub use super::lighting::{
    DiffusionSettings, FacetCount, Gather, LightBudget, Lighting, LightingMode, MAX_BOUNCE_CELLS,
    MAX_BOUNCE_ORDER, MAX_BOUNCES, MAX_CYCLES, MAX_OCTAVES, MAX_PAIR_LEVELS, Octaves, Pairs, RUNGS,
    Rung,
};
use super::material::Material;
use super::named::named;
pub use super::overlap::Overlap;
use super::resolution::LowResLayout;
use super::sky::{Sky, SkyView};
use super::surface::Surface;
use super::terrain::Terrain;

/// Least and greatest coordinates of a box, world units.
pub type Bounds = (DVec3, DVec3);

fn union(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

/// A scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Title.
    pub title: String,
    /// Picture size, format and display settings.
    pub film: Film,
    /// Camera.
    pub camera: Camera,
    /// Times of the frames.
    pub time: Time,
    /// Lighting settings.
    pub lighting: Lighting,
    /// Drawing settings.
    pub draw: Draw,
    /// Threads of a run.
    pub threads: Threads,
    /// Lights.
    pub lights: Vec<Light>,
    /// Materials, which surfaces, ground and clouds index.
    pub materials: Vec<Material>,
    /// Rectangles.
    pub surfaces: Vec<Surface>,
    /// Ground.
    pub terrains: Vec<Terrain>,
    /// Clouds.
    pub clouds: Vec<Cloud>,
    /// Air that clouds condense in.
    pub air: Air,
    /// Clear sky, in place of the film's background.
    pub sky: Option<Sky>,
}

/// Times of the frames: frame n is at start_s + n·step_s on every machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Time {
    /// Time of frame 0.
    pub start_s: f64,
    /// Time from a frame to the next.
    pub step_s: f64,
    /// Number of frames.
    pub n_frames: u32,
}

impl Time {
    /// Returns the time of a frame.
    pub fn at(&self, i_frame: u32) -> f64 {
        self.start_s + f64::from(i_frame) * self.step_s
    }

    /// Returns the last frame at or before `time_s`, and the first frame for earlier times.
    pub fn frame_at(&self, time_s: f64) -> u32 {
        // The cast to an integer saturates. If time stands still every frame has the same time.
        if self.step_s > 0.0 { ((time_s - self.start_s) / self.step_s) as u32 } else { 0 }
    }
}

named! {
    /// Threading of a run.
    pub enum Threading {
        /// Game and render steps alternate on one thread.
        Serial = "serial",
        /// The game thread works ahead of the render thread.
        Parallel = "parallel",
    }
}

named! {
    /// Processor that moves the particles.
    pub enum Simulate {
        /// The GPU; the game thread moves only their groups.
        Gpu = "gpu",
        /// The game thread, which uploads all positions.
        Cpu = "cpu",
    }
}

/// Threads of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Threads {
    /// Threading.
    pub mode: Threading,
    /// Processor that moves the particles.
    pub simulate: Simulate,
}

impl Scene {
    /// Returns the scene with every "auto" of its drawing replaced by the choice that changes
    /// nothing, and "auto" lighting by the setting nearest to transport.
    pub fn exact(&self) -> Cow<'_, Scene> {
        let lit = self.lit();
        let draw = lit.draw.exact();
        if draw == lit.draw { lit } else { Cow::Owned(Scene { draw, ..lit.into_owned() }) }
    }

    /// Returns the scene with the setting nearest to transport in place of "auto" lighting.
    pub fn lit(&self) -> Cow<'_, Scene> {
        match self.lighting.mode {
            LightingMode::Auto => Cow::Owned(self.on(&RUNGS[RUNGS.len() - 1])),
            _ => Cow::Borrowed(self),
        }
    }

    /// Returns the scene with a rung in place of "auto" lighting.
    pub fn on(&self, rung: &Rung) -> Scene {
        Scene { lighting: self.lighting.on(rung), draw: self.draw_on(rung), ..self.clone() }
    }

    /// Returns the drawing with a rung. Where `draw.overlap` is "auto", tiles are composed as the
    /// rung says.
    fn draw_on(&self, rung: &Rung) -> Draw {
        let is_free = self.draw.overlap == Overlap::Auto && self.draw.path == DrawPath::Tiles;
        match rung.slice {
            _ if !is_free => self.draw,
            Some(slice) => Draw { overlap: Overlap::Slices, slice, ..self.draw },
            None => Draw { overlap: Overlap::Thin, ..self.draw },
        }
    }

    /// Returns a rung's error against transport in this scene's drawing.
    pub fn error_of(&self, rung: &Rung) -> f64 {
        rung.errors[usize::from(self.draw_on(rung).exact().overlap == Overlap::Slices)]
    }

    /// Returns the number of particles of all clouds.
    pub fn n_particles(&self) -> u64 {
        self.clouds.iter().map(Cloud::n_particles).sum()
    }

    /// Returns the groups of all clouds in order, with particles numbered through. Counts must fit
    /// u32; the limits of every device ensure it.
    pub fn groups(&self) -> Vec<Group> {
        let mut groups: Vec<Group> = Vec::new();
        let mut i_first = 0u32;
        for (i_cloud, cloud) in self.clouds.iter().enumerate() {
            groups.extend(cloud.groups(i_cloud, i_first));
            i_first = groups.last().map_or(i_first, |g| g.i_first + g.n_particles);
        }
        groups
    }

    /// Returns the greatest growth of the camera's half widths by a low-resolution picture's
    /// margin.
    pub fn widening(&self) -> DVec2 {
        match self.draw.resolution.divisor() {
            1 => DVec2::ONE,
            n => LowResLayout::of([self.film.width, self.film.height], n).widening(),
        }
    }

    /// Returns whether some cloud's particles are animated.
    pub fn is_animated(&self) -> bool {
        self.clouds.iter().any(|c| matches!(c.source, CloudSource::Animated(_)))
    }

    /// Returns the shapes of the blobs.
    pub fn shapes(&self) -> Shapes {
        let of = |c: &Cloud| match c.source {
            CloudSource::Particles(_) => c.groups(0, 0).iter().map(Group::shapes).max(),
            CloudSource::Animated(_) => Some(Shapes::Upright),
            CloudSource::Boxes { .. } | CloudSource::Disc(_) => None,
        };
        self.clouds.iter().filter_map(of).max().unwrap_or_default()
    }

    /// Returns the density grid over ± `half` about the lighting origin.
    pub fn density_grid(&self, groups: &[Group], half: DVec3) -> GridSpec {
        let Lighting { grid, layers, .. } = self.lighting;
        let aspect = cell_aspect(mean_aspect_of(groups), 2.0 * half, grid, layers);
        GridSpec::fit(-half, half, grid, aspect)
    }

    /// Returns whether slices of clouds have the light of the cells where they are, and not that
    /// of their blobs (model.md §18). Behind air they have that of their blobs.
    pub fn has_light_of_cells(&self) -> bool {
        self.lighting.has_bounces() && self.draw.overlap == Overlap::Slices && !self.has_haze()
    }

    /// Returns whether what the eye sees of facets is more than their light: air lies between, or a
    /// sea mirrors the sky.
    pub fn has_haze(&self) -> bool {
        self.sky.is_some_and(|sky| sky.settings().haze > 0.0) || self.has_sea()
    }

    /// Returns whether some ground is a sea that mirrors a sky.
    pub fn has_sea(&self) -> bool {
        self.sky.is_some() && self.seas().any(|sea| sea.is_some())
    }

    /// Returns the seas of the grounds, `None` of what is none.
    pub fn seas(&self) -> impl Iterator<Item = Option<Sea>> + '_ {
        self.terrains.iter().map(|t| self.materials[t.i_material].cover.sea())
    }

    /// Returns the number of the first light that is a sun.
    pub fn i_sun(&self) -> Option<usize> {
        self.lights.iter().position(Light::is_sun)
    }

    /// Returns the sky as it is seen from `eye`; `None` without.
    pub fn sky_view(&self, eye: DVec3, time_s: f64) -> Option<SkyView> {
        let sky = self.sky.as_ref()?;
        Some(SkyView::new(sky, eye, &self.lights, &self.materials, time_s))
    }

    /// Returns whether some cloud's particles have textures.
    pub fn is_textured(&self) -> bool {
        self.clouds.iter().any(|c| !c.texture.is_none())
    }

    /// Returns `groups` as they have grown at `time_s`.
    pub fn grown(&self, groups: &[Group], time_s: f64) -> Vec<Group> {
        groups.iter().map(|g| g.grown(self.clouds[g.i_cloud].growth.at(time_s))).collect()
    }

    /// Returns the number of facets of the rectangles, which come first.
    pub fn n_surface_facets(&self) -> u64 {
        self.surfaces.iter().map(Surface::n_facets).sum()
    }

    /// Returns the number of facets of rectangles and ground, which come before those of the
    /// clouds.
    pub fn n_solid_facets(&self) -> u64 {
        self.n_surface_facets() + self.terrains.iter().map(Terrain::n_facets).sum::<u64>()
    }

    /// Returns the longest edge of a facet of rectangles and ground as a square; 0 without any.
    pub fn longest_facet_edge(&self) -> f64 {
        let of_surfaces = self.surfaces.iter().map(|s| s.area() / s.n_facets() as f64);
        let of_ground = self.terrains.iter().flat_map(Terrain::facets).map(|f| f.area);
        of_surfaces.chain(of_ground).fold(0.0, f64::max).sqrt()
    }

    /// Returns the number of rectangles and terrains: the regions before the clouds.
    pub fn n_solids(&self) -> usize {
        self.surfaces.len() + self.terrains.len()
    }

    /// Returns whether the scene has surfaces or ground.
    pub fn has_solids(&self) -> bool {
        self.n_solids() > 0
    }

    /// Returns the number of facets of one cloud.
    pub fn n_cloud_facets(&self, cloud: &Cloud) -> u64 {
        self.lighting.facets_per_cloud.of(cloud.n_particles(), self.lighting.mode)
    }

    /// Returns whether some facet stands for several particles.
    pub fn groups_facets(&self) -> bool {
        self.clouds.iter().any(|c| self.n_cloud_facets(c) < c.n_particles())
    }

    /// Returns for each of the clouds' facets the run (first, end) of its particles' places in
    /// Morton order. Places are numbered through over all clouds, as particles are.
    pub fn facet_runs(&self) -> Vec<(u64, u64)> {
        let mut i_first = 0;
        let of_cloud = |c: &Cloud| {
            let n = c.n_particles();
            let first = i_first;
            i_first += n;
            runs(n, self.n_cloud_facets(c)).map(move |(a, b)| (first + a, first + b))
        };
        self.clouds.iter().flat_map(of_cloud).collect()
    }

    /// Returns the number of facets.
    pub fn n_facets(&self) -> u64 {
        self.n_solid_facets() + self.clouds.iter().map(|c| self.n_cloud_facets(c)).sum::<u64>()
    }

    /// Returns the number of regions: facets of one material each, C's R_i, in the order surfaces,
    /// ground, clouds.
    pub fn n_regions(&self) -> usize {
        self.n_solids() + self.clouds.len()
    }

    /// Returns the index of the material of region `i`.
    pub fn region_i_material(&self, i: usize) -> usize {
        let of_surface = self.surfaces.get(i).map(|s| s.i_material);
        let of_terrain = || self.terrains.get(i - self.surfaces.len()).map(|t| t.i_material);
        of_surface
            .or_else(of_terrain)
            .unwrap_or_else(|| self.clouds[i - self.n_solids()].i_material)
    }

    /// Returns the material of region `i`.
    pub fn region_material(&self, i: usize) -> &Material {
        &self.materials[self.region_i_material(i)]
    }

    /// Returns bounds of the clouds as [`Scene::bounds`]; without particles, of
    /// surfaces and ground.
    pub fn lighting_bounds(&self, groups: &[Group], time_s: f64, n_sigma: f64) -> Option<Bounds> {
        self.bounds(groups, time_s, n_sigma).or_else(|| self.solid_bounds().reduce(union))
    }

    fn solid_bounds(&self) -> impl Iterator<Item = Bounds> + '_ {
        self.surfaces.iter().map(Surface::bounds).chain(self.terrains.iter().map(Terrain::bounds))
    }

    /// Returns bounds of every region at `time_s`; `groups` are those of [`Scene::groups`]. A cloud
    /// without particles has its origin as both.
    pub fn region_bounds(&self, mut groups: &[Group], time_s: f64, n_sigma: f64) -> Vec<Bounds> {
        let of_cloud = |cloud: &Cloud| {
            let (own, others) = groups.split_at(cloud.n_groups() as usize);
            groups = others;
            let origin = cloud.origin_at(time_s);
            self.bounds(own, time_s, n_sigma).unwrap_or((origin, origin))
        };
        self.solid_bounds().chain(self.clouds.iter().map(of_cloud)).collect()
    }

    /// Returns bounds of all particles at `time_s`, blobs included out to `n_sigma` σ; `None`
    /// without particles.
    pub fn bounds(&self, groups: &[Group], time_s: f64, n_sigma: f64) -> Option<Bounds> {
        let with_particles = groups.iter().filter(|g| g.n_particles > 0);
        with_particles.map(|g| self.group_bounds(g, time_s, n_sigma)).reduce(union)
    }

    fn group_bounds(&self, group: &Group, time_s: f64, n_sigma: f64) -> Bounds {
        let cloud = &self.clouds[group.i_cloud];
        let group = group.grown(cloud.growth.at(time_s));
        let center = cloud.origin_at(time_s) + group.center;
        let reach =
            group.half_extent + n_sigma * group.sigma_bounds() + DVec3::splat(group.gust_reach);
        (center - reach, center + reach)
    }
}
