//! The game step: computes the camera, the clouds and, with `simulate = "cpu"`, every particle at a
//! frame's time.

use std::sync::Arc;
use std::time::Instant;

use glam::{DVec3, Vec3};
use tracing::info_span;

use super::clock::ms;
use super::features::{denser_at_most, has_impostors, has_live, is_glossy, tau_bound};
use super::live::{disc_records, live_particles};
use super::media::{self, KeptMedium};
use super::packet::Packet;
use super::tensor_shape::{Shape, basis_of, is_edited, kind_of};
use super::visibility::drawn_groups;
use crate::error::Result;
use crate::layout::facet::{KeyBits, NO_LOBE, RegionBoundsRecord, RegionRecord, lobe_width};
use crate::layout::frame::{CameraRecord, GridRecord, LightRecord};
use crate::layout::particle::{GroupRecord, ModeRecord, ParticleRecord, PlacedRecord};
use crate::layout::sky::SkyRecord;
use crate::model::basis::{Basis, N_NODES};
use crate::model::camera::Pose;
use crate::model::cloud::{Group, SQRT_TAU, aspects_of, mass, max_blob_mass};
use crate::model::frame_state::FrameState;
use crate::model::grid::DEPOSIT_CUT_SIGMA;
use crate::model::gust::Mode;
use crate::model::gust_lanes::{LANES, Lanes, Waves};
use crate::model::lod::widened;
use crate::model::material::{Brdf, Material};
use crate::model::overlap::slice_length;
use crate::model::scene::Scene;
use crate::passes::blobs::Extent;

/// The game side of a scene, which makes the packet of any frame.
pub struct Game {
    scene: Arc<Scene>,
    groups: Vec<Group>,
    /// Waves of each cloud's gusts.
    modes: Vec<Vec<Mode>>,
    /// Index of each cloud's first wave.
    i_modes: Vec<u32>,
    basis: Option<Basis>,
    /// The table of lobes, if no lobe is edited.
    table: Arc<Vec<f32>>,
    /// The shape of the tensors, if materials are edited.
    shape: Option<Shape>,
    /// Every particle relative to its group, if the game thread moves them.
    rest: Option<Vec<ParticleRecord>>,
    /// Groups that cannot be in the picture are left out.
    culls: bool,
    /// The pose that replaces the scene's camera.
    viewpoint: Option<Viewpoint>,
    mean_medium: KeptMedium,
}

/// A function that returns the camera's pose. It is called at every step, on the game thread; the
/// field of view and the near plane are the scene's.
pub type Viewpoint = Box<dyn Fn() -> Pose + Send>;

impl Game {
    /// Creates the game side of `scene`. `rest` has all particles in order if the game thread is to
    /// move them (`simulate = "cpu"`).
    pub fn new(scene: Arc<Scene>, rest: Option<Vec<ParticleRecord>>) -> Game {
        let groups = scene.groups();
        let modes: Vec<Vec<Mode>> = scene.clouds.iter().map(|c| c.gust.modes(c.seed)).collect();
        let count =
            |n: &mut u32, waves: &Vec<Mode>| Some(std::mem::replace(n, *n + waves.len() as u32));
        let i_modes = modes.iter().scan(0, count).collect();
        let basis = basis_of(&scene);
        let table = Arc::new(table(&scene, basis.as_ref(), scene.time.start_s));
        let n_bases = basis.as_ref().map_or(1, Basis::n_bases);
        let shape = is_edited(&scene).then(|| Shape::new(&scene, n_bases));
        Game {
            scene,
            groups,
            modes,
            i_modes,
            basis,
            table,
            shape,
            rest,
            culls: true,
            viewpoint: None,
            mean_medium: KeptMedium::default(),
        }
    }

    /// Sets whether groups that cannot be in the picture are left out, which is the default.
    pub fn with_culling(self, culls: bool) -> Game {
        Game { culls, ..self }
    }

    /// Sets whether the next steps leave out groups that cannot be in the picture.
    pub fn set_culling(&mut self, culls: bool) {
        self.culls = culls;
    }

    /// Replaces the scene's camera by `viewpoint`.
    pub fn with_viewpoint(self, viewpoint: Viewpoint) -> Game {
        Game { viewpoint: Some(viewpoint), ..self }
    }

    /// Replaces the scene by one that differs in its `draw` alone.
    pub(super) fn with_scene(self, scene: Arc<Scene>) -> Game {
        Game { scene, ..self }
    }

    /// Replaces the scene and its particles; culling and viewpoint stay.
    pub(super) fn replay(&mut self, scene: Arc<Scene>, rest: Option<Vec<ParticleRecord>>) {
        let (culls, viewpoint) = (self.culls, self.viewpoint.take());
        *self = Game { culls, viewpoint, ..Game::new(scene, rest) };
    }

    /// Returns frame `i_frame`, which depends on its number alone: frames can be made in any order.
    ///
    /// # Errors
    /// Fails if the scene has no state at that time or a file of moving particles cannot be read.
    pub fn step(&mut self, i_frame: u32) -> Result<Packet> {
        self.step_at(i_frame, self.scene.time.at(i_frame))
    }

    /// Returns a frame at any time.
    ///
    /// # Errors
    /// Fails as [`Game::step`] does.
    pub fn step_at(&mut self, i_frame: u32, time_s: f64) -> Result<Packet> {
        let begin = Instant::now();
        let _zone = info_span!("game step").entered();
        let mut setting =
            info_span!("setting").in_scope(|| FrameState::at(&self.scene, &self.groups, time_s))?;
        if let Some(viewpoint) = &self.viewpoint {
            setting.pose = viewpoint();
        }
        let origins: Vec<DVec3> =
            self.scene.clouds.iter().map(|c| c.origin_at(time_s) - setting.light_origin).collect();
        let grown = self.scene.grown(&self.groups, time_s);
        // Impostor layers include every particle, so that they stay valid when the camera turns.
        let culls = self.culls && !has_impostors(&self.scene);
        let (drawn, n_drawn) = info_span!("visibility")
            .in_scope(|| drawn_groups(&self.scene, &grown, &setting, culls));
        let live = self.live(time_s)?;
        let placed = live.as_ref().or(self.rest.as_ref()).map(|rest| {
            info_span!("place particles").in_scope(|| self.place(rest, &grown, &origins, time_s))
        });
        // The device does not move particles that the host has placed.
        let (modes, discs) = match placed {
            Some(_) => (vec![], vec![]),
            None => (
                self.modes.iter().flatten().map(|m| ModeRecord::new(m, time_s)).collect(),
                disc_records(&self.scene, &self.groups, time_s),
            ),
        };
        let heaviest = self.heaviest(&grown, live.as_ref());
        let extents = self.extents(&grown, &origins, live.as_deref());
        let filled = || grown.iter().filter(|g| g.n_particles > 0);
        let sigma_max = filled().map(Group::sigma_widest).fold(0.0, f64::max);
        let across_max = filled().map(|g| g.sigma_max).fold(0.0, f64::max);
        let Scene { camera, film, .. } = &*self.scene;
        let camera = CameraRecord::new(camera, &setting.pose, film, setting.light_origin);
        let sky = self.scene.sky_view(setting.pose.position, time_s);
        Ok(Packet {
            i_frame,
            time_s,
            begin,
            camera,
            sky: sky.map(|view| SkyRecord::new(&view, camera)),
            groups: info_span!("groups")
                .in_scope(|| grown.iter().map(|g| self.group(g, origins[g.i_cloud])).collect()),
            drawn,
            n_drawn,
            modes,
            discs,
            live,
            placed,
            table: self.table_at(time_s),
            coefficients: self.coefficients(time_s),
            bounds: self.bounds(&setting),
            regions: self.regions(time_s, setting.light_origin),
            media: media::records(&self.scene, time_s),
            diffusion: self.mean_medium.params(&self.scene, &self.groups, time_s, &setting.grid),
            lights: self
                .scene
                .lights
                .iter()
                .map(|l| LightRecord::new(l, setting.light_origin))
                .collect(),
            grid: GridRecord::from(&setting.grid),
            heaviest,
            sigma_max,
            n_levels: setting.grid.n_used_levels(self.scene.n_particles(), sigma_max),
            n_blurs: setting.grid.n_blurs(self.scene.n_particles(), across_max, aspects_of(&grown)),
            radius: setting.radius,
            sort_bits: self.sort_bits(&grown, setting.radius),
            slice: slice_length(self.scene.draw.slice, &grown, setting.radius),
            extents,
            game_ms: ms(begin, Instant::now()),
        })
    }

    /// Returns every particle relative to its group, if the game thread recomputes particles.
    fn live(&self, time_s: f64) -> Result<Option<Vec<ParticleRecord>>> {
        let Some(rest) = self.rest.as_ref().filter(|_| has_live(&self.scene)) else {
            return Ok(None);
        };
        info_span!("live")
            .in_scope(|| live_particles(&self.scene, &self.groups, rest, time_s))
            .map(Some)
    }

    /// Returns a bound of every blob's mass; moving particles are looked at one by one.
    fn heaviest(&self, groups: &[Group], live: Option<&Vec<ParticleRecord>>) -> f64 {
        let mass_of =
            |p: &ParticleRecord| mass(f64::from(p.kappa), f64::from(p.sigma)) * p.shape().volume();
        let moved = live
            .filter(|_| self.scene.is_animated())
            .map_or(0.0, |all| all.iter().map(mass_of).fold(0.0, f64::max));
        let scale = groups.iter().map(|g| g.scale.powi(3)).fold(1.0, f64::max);
        max_blob_mass(groups).max(scale * moved)
    }

    /// Returns the bits of a sort key.
    fn sort_bits(&self, groups: &[Group], radius: f64) -> u32 {
        let sigmas = groups
            .iter()
            .filter(|g| g.n_particles > 0)
            .map(|g| g.sigma_mean * g.aspects[0].min(1.0));
        self.scene.draw.sort_bits.of(radius, sigmas.fold(f64::INFINITY, f64::min))
    }

    /// Returns the extents of the groups; moving particles are looked at one by one.
    fn extents(
        &self,
        groups: &[Group],
        origins: &[DVec3],
        live: Option<&[ParticleRecord]>,
    ) -> Vec<Extent> {
        let tau_of = |p: &ParticleRecord| f64::from(p.kappa * p.sigma) * p.shape().widest();
        let moved = live
            .filter(|_| self.scene.is_animated())
            .map(|all| SQRT_TAU * all.iter().map(tau_of).fold(0.0, f64::max));
        // Records are from before their groups grew.
        let tau_of_group = |g: &Group| match moved {
            Some(tau) => tau * g.scale * denser_at_most(&self.scene, g),
            None => tau_bound(&self.scene, g),
        };
        let of = |g: &Group| Extent {
            center: origins[g.i_cloud] + g.center,
            half: g.half_extent + DVec3::splat(g.gust_reach),
            sigma_max: widened(g.sigma_widest(), self.scene.draw.lod),
            sigma_mean: g.sigma_mean * g.aspects[0].min(1.0),
            reach: self.scene.draw.edge().reach(tau_of_group(g)),
            n_particles: g.n_particles,
        };
        groups.iter().filter(|g| g.n_particles > 0).map(of).collect()
    }

    /// Returns the bounds of each region's Morton cells.
    fn bounds(&self, setting: &FrameState) -> Vec<RegionBoundsRecord> {
        let bits = KeyBits::of(self.scene.n_regions() as u32);
        let of = |b| RegionBoundsRecord::new(b, setting.light_origin, bits);
        self.scene
            .region_bounds(&self.groups, setting.time_s, DEPOSIT_CUT_SIGMA)
            .into_iter()
            .map(of)
            .collect()
    }

    /// Returns surfaces, terrains and clouds with their materials.
    fn regions(&self, time_s: f64, light_origin: DVec3) -> Vec<RegionRecord> {
        let scene = &self.scene;
        let mut i_facet = 0;
        let i_lobe = |i: usize| match is_glossy(scene, i) {
            true => scene.region_i_material(i) as u32,
            false => NO_LOBE,
        };
        let of = |i: usize| {
            let material = scene.region_material(i);
            let brdf = material.at(time_s);
            let mut record = match scene.surfaces.get(i) {
                Some(surface) => {
                    RegionRecord::surface(surface, light_origin, &brdf, i_lobe(i), i_facet)
                }
                None => match scene.terrains.get(i - scene.surfaces.len()) {
                    Some(terrain) => {
                        RegionRecord::terrain(terrain, light_origin, &brdf, i_lobe(i), i_facet)
                    }
                    None => {
                        let n_facets =
                            scene.n_cloud_facets(&scene.clouds[i - scene.n_solids()]) as u32;
                        RegionRecord::cloud(&brdf, i_lobe(i), i_facet, n_facets)
                    }
                },
            };
            i_facet += record.n_facets;
            record.kind = kind_of(scene, i);
            let [widest, narrowest] = material.exponents().map(lobe_width);
            (record.lobe_width, record.lobe_width_most) = (narrowest, widest);
            if let Some(block) = self.shape.as_ref().map(|s| s.blocks[i]) {
                (record.i_column, record.i_row) = (block.i_column, block.i_row);
            }
            record
        };
        (0..scene.n_regions()).map(of).collect()
    }

    fn table_at(&self, time_s: f64) -> Arc<Vec<f32>> {
        let edited = self.scene.materials.iter().any(|m| m.is_edited() && m.is_glossy());
        match &self.basis {
            Some(basis) if edited => Arc::new(table(&self.scene, Some(basis), time_s)),
            _ => self.table.clone(),
        }
    }

    /// Returns C of every column of the tensors.
    fn coefficients(&self, time_s: f64) -> Vec<[f32; 4]> {
        let (Some(shape), scene) = (&self.shape, &self.scene) else { return vec![] };
        let brdfs: Vec<Brdf> =
            (0..scene.n_regions()).map(|i| scene.region_material(i).at(time_s)).collect();
        let of = |ns: f64| self.basis.as_ref().map_or(vec![], |b| b.coefficients(ns));
        // Several regions may share a material.
        let of_materials: Vec<Vec<f64>> = scene
            .materials
            .iter()
            .map(|m| if m.is_glossy() { of(m.at(time_s).ns) } else { vec![] })
            .collect();
        shape.coefficients(&brdfs, |i| of_materials[scene.region_i_material(i)].clone())
    }

    fn group(&self, group: &Group, origin: DVec3) -> GroupRecord {
        let i_region = (self.scene.n_solids() + group.i_cloud) as u32;
        let modes = (self.i_modes[group.i_cloud], self.modes[group.i_cloud].len() as u32);
        GroupRecord::new(group, i_region, origin, modes)
    }

    /// Returns every particle's place, computed in f64 and rounded once.
    fn place(
        &self,
        rest: &[ParticleRecord],
        groups: &[Group],
        origins: &[DVec3],
        time_s: f64,
    ) -> Vec<PlacedRecord> {
        let waves: Vec<Waves> = self.modes.iter().map(|modes| Waves::at(modes, time_s)).collect();
        let mut placed = Vec::with_capacity(rest.len());
        for group in groups {
            let offset = origins[group.i_cloud] + group.center;
            let first = group.i_first as usize;
            for some in rest[first..first + group.n_particles as usize].chunks(LANES) {
                place_lanes(some, group, offset, &waves[group.i_cloud], &mut placed);
            }
        }
        placed
    }
}

/// Places at most [`LANES`] particles of one group.
fn place_lanes(
    some: &[ParticleRecord],
    group: &Group,
    offset: DVec3,
    waves: &Waves,
    placed: &mut Vec<PlacedRecord>,
) {
    let rest: [DVec3; LANES] = std::array::from_fn(|l| {
        some.get(l).map_or(DVec3::ZERO, |p| group.scale * Vec3::from(p.position).as_dvec3())
    });
    let along =
        |axis: usize| -> Lanes { std::array::from_fn(|l| rest[l][axis] + group.center[axis]) };
    let [x, y, z] = waves.displace(&[along(0), along(1), along(2)]);
    placed.extend(some.iter().enumerate().map(|(l, p)| {
        let moved = rest[l] + offset + DVec3::new(x[l], y[l], z[l]);
        let sigma = (group.scale * f64::from(p.sigma)) as f32;
        PlacedRecord { position: moved.as_vec3().to_array(), sigma }
    }));
}

/// Returns a row a material, its lobe in the basis or zeros, then a row a vector of the basis.
fn table(scene: &Scene, basis: Option<&Basis>, time_s: f64) -> Vec<f32> {
    let Some(basis) = basis else { return vec![] };
    let lobe =
        |m: &Material| if m.is_glossy() { basis.lobe(m.at(time_s).ns) } else { vec![0.0; N_NODES] };
    let rows = scene.materials.iter().map(lobe).chain(basis.vectors().iter().cloned());
    rows.flatten().map(|v| v as f32).collect()
}
