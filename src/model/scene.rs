//! A scene: everything a run is made of, checked and complete (defaults filled in, references
//! resolved).

use std::borrow::Cow;

use glam::{DVec2, DVec3};

use super::air::Air;
use super::basis::Sampling;
use super::camera::Camera;
use super::cloud::{Cloud, CloudSource, Group, MIN_ASPECT, runs};
use super::count::Count;
use super::cutoff::Cutoff;
use super::film::Film;
use super::grid::GridSpec;
use super::light::Light;
use super::material::Material;
use super::resolution::{LowResLayout, Resolution};
use super::sort_bits::SortBits;
use super::sums::Sums;
use super::surface::Surface;
use super::terrain::Terrain;

#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    pub title: String,
    pub film: Film,
    pub camera: Camera,
    pub time: Time,
    pub lighting: Lighting,
    pub draw: Draw,
    pub threads: Threads,
    pub lights: Vec<Light>,
    pub materials: Vec<Material>,
    pub surfaces: Vec<Surface>,
    /// The ground.
    pub terrains: Vec<Terrain>,
    pub clouds: Vec<Cloud>,
    pub air: Air,
}

/// Fixed steps: frame n is at start_s + n·step_s on every machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Time {
    pub start_s: f64,
    pub step_s: f64,
    pub n_frames: u32,
}

impl Time {
    pub fn at(&self, i_frame: u32) -> f64 {
        self.start_s + f64::from(i_frame) * self.step_s
    }

    /// The last frame at or before `time_s`; the first for all that comes before it.
    pub fn frame_at(&self, time_s: f64) -> u32 {
        // A cast to an integer stops at its ends. Where time stands still every frame is at the
        // same time.
        if self.step_s > 0.0 { ((time_s - self.start_s) / self.step_s) as u32 } else { 0 }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LightingMode {
    /// Particle colours as given.
    None,
    /// The first reflection, C (15).
    First,
    /// The first and the second, C (15) and (16).
    TwoReflection,
}

impl LightingMode {
    pub const NAMES: [(&'static str, LightingMode); 3] = [
        ("none", LightingMode::None),
        ("first", LightingMode::First),
        ("two-reflection", LightingMode::TwoReflection),
    ];
}

/// How the second reflection is gathered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gather {
    /// Exact or tree, whichever is the faster at the scene's number of facets.
    Auto,
    /// Every pair of facets.
    Exact,
    /// Clusters of facets, opened where they are large against their distance.
    Tree,
}

impl Gather {
    pub const NAMES: [(&'static str, Gather); 3] =
        [("auto", Gather::Auto), ("exact", Gather::Exact), ("tree", Gather::Tree)];
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lighting {
    pub mode: LightingMode,
    /// Cells along the density grid's longest axis.
    pub grid: u32,
    /// March step toward a light, in cells.
    pub step: f64,
    /// g: the share of τ that does not count on light's way through a cloud.
    pub forward: f64,
    /// N_b: the diffuse basis and N_b − 1 of lobes (model.md §6).
    pub bases: u32,
    pub sampling: Sampling,
    /// Range of n_s that the basis is made for.
    pub exponents: [f64; 2],
    pub gather: Gather,
    /// Clusters are opened where their radius is more than this share of their distance.
    pub theta: f64,
    /// Facets of a cloud; `None`: one a particle.
    pub facets_per_cloud: Option<u32>,
    pub pairs: Pairs,
    pub sums: Sums,
}

/// An emitter that is quartered this often is 2¹⁶ times smaller.
pub const MAX_PAIR_LEVELS: u32 = 16;

/// How closely a pair of facets is looked at (model.md §7).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pairs {
    /// An emitter is quartered while it is wider than this share of its distance.
    pub size: f64,
    /// How often, at most.
    pub levels: u32,
    /// Most steps of the march through the density grid between two facets.
    pub steps: u32,
}

/// What draws the particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DrawPath {
    /// Quads through the graphics pipeline.
    Sprites,
    /// Tiles of pixels in compute.
    Tiles,
    /// Whichever is faster at the scene's first frame.
    Auto,
}

impl DrawPath {
    pub const NAMES: [(&'static str, DrawPath); 3] =
        [("sprites", DrawPath::Sprites), ("tiles", DrawPath::Tiles), ("auto", DrawPath::Auto)];
}

/// Whether what is far is shown again from a picture of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Impostors {
    Off,
    On,
    /// Whichever is faster over the scene's first frames.
    Auto,
}

impl Impostors {
    pub const NAMES: [(&'static str, Impostors); 3] =
        [("off", Impostors::Off), ("on", Impostors::On), ("auto", Impostors::Auto)];
}

/// Whether particles that show in no pixel are left out before the sort, which changes none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cull {
    Off,
    On,
    /// Whichever is faster at the scene's first frame.
    Auto,
}

impl Cull {
    pub const NAMES: [(&'static str, Cull); 3] =
        [("on", Cull::On), ("off", Cull::Off), ("auto", Cull::Auto)];
}

/// Most chunks that sprites are drawn in.
pub const MAX_CHUNKS: u32 = 256;

/// In what order sprites are drawn, and what becomes of pixels that are full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chunks {
    /// So many, near to far, and after each the pixels that let nothing more through are left out;
    /// 0: far to near, all of it.
    Of(u32),
    /// Whichever is the fastest at the scene's first frame.
    Auto,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Draw {
    pub path: DrawPath,
    pub impostors: Impostors,
    /// Pixels that an impostor may be predicted to be off by.
    pub impostor_error: f64,
    /// Of the picture that they are drawn into.
    pub resolution: Resolution,
    /// What "auto" takes, all together, differs from the picture without by no more than this, root
    /// mean square.
    pub error: f64,
    /// Of path "sprites".
    pub chunks: Chunks,
    /// Sprites end at this many σ.
    pub cutoff: f64,
    /// And where their optical depth falls under this.
    pub threshold: Cutoff,
    pub cull: Cull,
    /// Where particles are left out, also those whose σ is narrower than so many pixels.
    pub smallest: Cutoff,
    pub sort_bits: SortBits,
    /// How many particles are drawn of a cloud; `None`: all.
    pub count: Option<Count>,
    /// Of the pool of textures.
    pub texture_seed: u32,
    /// The clouds made from boxes have so many particles together; 0: as many as their files say.
    pub n_particles: u32,
}

impl Draw {
    /// With what changes nothing in place of every "auto".
    pub fn exact(self) -> Draw {
        let least = |l: Cutoff| Cutoff::At(l.bound());
        Draw {
            path: if self.path == DrawPath::Auto { DrawPath::Sprites } else { self.path },
            chunks: if self.chunks == Chunks::Auto { Chunks::Of(0) } else { self.chunks },
            cull: if self.cull == Cull::Auto { Cull::On } else { self.cull },
            threshold: least(self.threshold),
            smallest: least(self.smallest),
            resolution: if self.resolution == Resolution::Auto {
                Resolution::Full
            } else {
                self.resolution
            },
            impostors: if self.impostors == Impostors::Auto {
                Impostors::Off
            } else {
                self.impostors
            },
            ..self
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Threading {
    Serial,
    Parallel,
}

impl Threading {
    pub const NAMES: [(&'static str, Threading); 2] =
        [("serial", Threading::Serial), ("parallel", Threading::Parallel)];

    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Simulate {
    /// The GPU moves the particles; the game thread only their groups.
    Gpu,
    /// The game thread moves every particle and hands all positions over.
    Cpu,
}

impl Simulate {
    pub const NAMES: [(&'static str, Simulate); 2] =
        [("gpu", Simulate::Gpu), ("cpu", Simulate::Cpu)];
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Threads {
    pub mode: Threading,
    pub simulate: Simulate,
}

impl Scene {
    /// With what changes nothing in place of every "auto" of its drawing.
    pub fn exact(&self) -> Cow<'_, Scene> {
        let draw = self.draw.exact();
        if draw == self.draw {
            Cow::Borrowed(self)
        } else {
            Cow::Owned(Scene { draw, ..self.clone() })
        }
    }

    /// Particles of all clouds.
    pub fn n_particles(&self) -> u64 {
        self.clouds.iter().map(Cloud::n_particles).sum()
    }

    /// Groups of all clouds in order; the particles are numbered through. Counts must fit u32,
    /// which the limits of every device see to.
    pub fn groups(&self) -> Vec<Group> {
        let mut groups: Vec<Group> = Vec::new();
        let mut i_first = 0u32;
        for (i_cloud, cloud) in self.clouds.iter().enumerate() {
            groups.extend(cloud.groups(i_cloud, i_first));
            i_first = groups.last().map_or(i_first, |g| g.i_first + g.n_particles);
        }
        groups
    }

    /// What the half widths of the camera's view grow by, at most, where blobs are drawn into a
    /// smaller picture.
    pub fn widening(&self) -> DVec2 {
        match self.draw.resolution.divisor() {
            1 => DVec2::ONE,
            n => LowResLayout::of([self.film.width, self.film.height], n).widening(),
        }
    }

    /// Whether somebody else moves some particles.
    pub fn is_animated(&self) -> bool {
        self.clouds.iter().any(|c| matches!(c.source, CloudSource::Animated(_)))
    }

    /// Whether some blobs are no balls.
    pub fn has_ellipsoids(&self) -> bool {
        let of = |c: &Cloud| match c.source {
            CloudSource::Particles(_) => c.groups(0, 0).iter().any(Group::has_ellipsoids),
            CloudSource::Animated(_) => true,
            CloudSource::Boxes { .. } | CloudSource::Disc(_) => false,
        };
        self.clouds.iter().any(of)
    }

    /// The density grid over what lies within ± `half` of its middle.
    pub fn density_grid(&self, groups: &[Group], half: DVec3) -> GridSpec {
        GridSpec::fit_cells(-half, half, self.lighting.grid, Scene::cell_aspect(groups, 2.0 * half))
    }

    /// Heights of the density grid's cells over their widths: 1 where all blobs of `groups` are
    /// balls; else as flat as they are on the mean, or as all of the bounds (their extent given)
    /// is, whichever is flatter.
    fn cell_aspect(groups: &[Group], extent: DVec3) -> f64 {
        if !groups.iter().any(Group::has_ellipsoids) {
            return 1.0;
        }
        let n: f64 = groups.iter().map(|g| f64::from(g.n_particles)).sum();
        let mean = groups.iter().map(|g| f64::from(g.n_particles) * g.aspects[1]).sum::<f64>() / n;
        let flat = extent.y / extent.x.max(extent.z);
        if flat > 0.0 { mean.min(flat) } else { mean }.clamp(MIN_ASPECT, 1.0 / MIN_ASPECT)
    }

    /// Whether some cloud's particles have textures.
    pub fn is_textured(&self) -> bool {
        self.clouds.iter().any(|c| !c.texture.is_none())
    }

    /// `groups` as they have grown at `time_s`.
    pub fn grown(&self, groups: &[Group], time_s: f64) -> Vec<Group> {
        groups.iter().map(|g| g.grown(self.clouds[g.i_cloud].growth.at(time_s))).collect()
    }

    /// Facets of the rectangles, which come before all others.
    pub fn n_surface_facets(&self) -> u64 {
        self.surfaces.iter().map(Surface::n_facets).sum()
    }

    /// Facets of rectangles and ground, which come before those of the clouds.
    pub fn n_solid_facets(&self) -> u64 {
        self.n_surface_facets() + self.terrains.iter().map(Terrain::n_facets).sum::<u64>()
    }

    /// Regions that are no clouds and come before them: rectangles, then ground.
    pub fn n_solids(&self) -> usize {
        self.surfaces.len() + self.terrains.len()
    }

    /// Whether anything is there that hides what is behind it.
    pub fn has_solids(&self) -> bool {
        self.n_solids() > 0
    }

    /// Facets of one cloud.
    pub fn n_cloud_facets(&self, cloud: &Cloud) -> u64 {
        let n = cloud.n_particles();
        self.lighting.facets_per_cloud.map_or(n, |most| n.min(u64::from(most.max(1))))
    }

    /// Whether some facet stands for several particles.
    pub fn groups_facets(&self) -> bool {
        self.clouds.iter().any(|c| self.n_cloud_facets(c) < c.n_particles())
    }

    /// Of each of the clouds' facets the run (first, end) of its particles' places in Morton order,
    /// all clouds' places numbered through as their particles are.
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

    pub fn n_facets(&self) -> u64 {
        self.n_solid_facets() + self.clouds.iter().map(|c| self.n_cloud_facets(c)).sum::<u64>()
    }

    /// Facets of one material each, C's R_i: the surfaces, the ground, then the clouds.
    pub fn n_regions(&self) -> usize {
        self.n_solids() + self.clouds.len()
    }

    /// Index of the material of region `i`.
    pub fn region_i_material(&self, i: usize) -> usize {
        let of_surface = self.surfaces.get(i).map(|s| s.i_material);
        let of_terrain = || self.terrains.get(i - self.surfaces.len()).map(|t| t.i_material);
        of_surface
            .or_else(of_terrain)
            .unwrap_or_else(|| self.clouds[i - self.n_solids()].i_material)
    }

    pub fn region_material(&self, i: usize) -> &Material {
        &self.materials[self.region_i_material(i)]
    }

    /// Bounds (low, high) of the clouds, as [`Scene::bounds`] has them; without particles, of
    /// surfaces and ground.
    pub fn lighting_bounds(
        &self,
        groups: &[Group],
        time_s: f64,
        n_sigma: f64,
    ) -> Option<(DVec3, DVec3)> {
        let of_solids = || self.solid_bounds().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        self.bounds(groups, time_s, n_sigma).or_else(of_solids)
    }

    fn solid_bounds(&self) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
        self.surfaces.iter().map(Surface::bounds).chain(self.terrains.iter().map(Terrain::bounds))
    }

    /// Bounds (low, high) of every region at `time_s`: of a surface or ground its own, of a cloud
    /// as [`Scene::bounds`] has them, its origin where it has no particles.
    pub fn region_bounds(
        &self,
        groups: &[Group],
        time_s: f64,
        n_sigma: f64,
    ) -> Vec<(DVec3, DVec3)> {
        let mut of_clouds: Vec<_> =
            self.clouds.iter().map(|c| (c.origin_at(time_s), None)).collect();
        for group in groups.iter().filter(|g| g.n_particles > 0) {
            let (low, high) = self.group_bounds(group, time_s, n_sigma);
            let of_cloud = &mut of_clouds[group.i_cloud].1;
            let (l, h) = of_cloud.unwrap_or((low, high));
            *of_cloud = Some((low.min(l), high.max(h)));
        }
        let of_clouds =
            of_clouds.into_iter().map(|(origin, bounds)| bounds.unwrap_or((origin, origin)));
        self.solid_bounds().chain(of_clouds).collect()
    }

    /// Bounds (low, high) of all particles at `time_s`, blobs included out to `n_sigma` σ; `None`
    /// without particles.
    pub fn bounds(&self, groups: &[Group], time_s: f64, n_sigma: f64) -> Option<(DVec3, DVec3)> {
        let boxes = groups
            .iter()
            .filter(|g| g.n_particles > 0)
            .map(|g| self.group_bounds(g, time_s, n_sigma));
        boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    fn group_bounds(&self, group: &Group, time_s: f64, n_sigma: f64) -> (DVec3, DVec3) {
        let cloud = &self.clouds[group.i_cloud];
        let group = group.grown(cloud.growth.at(time_s));
        let center = cloud.origin_at(time_s) + group.center;
        let reach =
            group.half_extent + n_sigma * group.sigma_bounds() + DVec3::splat(group.gust_reach);
        (center - reach, center + reach)
    }
}
