//! A scene: everything a run is made of, checked and complete (defaults filled in, references resolved).

use glam::DVec3;

use super::camera::Camera;
use super::cloud::{Cloud, Group};
use super::film::Film;
use super::light::Light;
use super::material::Material;

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
    pub clouds: Vec<Cloud>,
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
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LightingMode {
    /// Particle colours as given.
    None,
    /// The first reflection, C (15).
    First,
}

impl LightingMode {
    pub const NAMES: [(&'static str, LightingMode); 2] = [("none", LightingMode::None), ("first", LightingMode::First)];
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
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Draw {
    /// Sprites end at this many σ.
    pub cutoff: f64,
    /// Bits of the sort key: 16 or 32.
    pub sort_bits: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Threading {
    Serial,
    Parallel,
}

impl Threading {
    pub const NAMES: [(&'static str, Threading); 2] =
        [("serial", Threading::Serial), ("parallel", Threading::Parallel)];
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Simulate {
    /// The GPU moves the particles; the game thread only their groups.
    Gpu,
    /// The game thread moves every particle and hands all positions over.
    Cpu,
}

impl Simulate {
    pub const NAMES: [(&'static str, Simulate); 2] = [("gpu", Simulate::Gpu), ("cpu", Simulate::Cpu)];
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Threads {
    pub mode: Threading,
    pub simulate: Simulate,
}

impl Scene {
    /// Particles of all clouds.
    pub fn n_particles(&self) -> u64 {
        self.clouds.iter().map(Cloud::n_particles).sum()
    }

    /// Groups of all clouds in order; the particles are numbered through. Counts must fit u32, which the
    /// limits of every device see to.
    pub fn groups(&self) -> Vec<Group> {
        let mut groups: Vec<Group> = Vec::new();
        let mut i_first = 0u32;
        for (i_cloud, cloud) in self.clouds.iter().enumerate() {
            groups.extend(cloud.groups(i_cloud, i_first));
            i_first = groups.last().map_or(i_first, |g| g.i_first + g.n_particles);
        }
        groups
    }

    /// Bounds (low, high) of everything at `time_s`, blobs included out to `n_sigma` σ; `None` without particles.
    pub fn bounds(&self, groups: &[Group], time_s: f64, n_sigma: f64) -> Option<(DVec3, DVec3)> {
        let reach: Vec<f64> = self.clouds.iter().map(|c| c.gust.reach()).collect();
        let boxes = groups.iter().filter(|g| g.n_particles > 0).map(|g| {
            let center = self.clouds[g.i_cloud].origin_at(time_s) + g.center;
            let reach = g.half_extent + DVec3::splat(n_sigma * g.sigma_max + reach[g.i_cloud]);
            (center - reach, center + reach)
        });
        boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }
}
