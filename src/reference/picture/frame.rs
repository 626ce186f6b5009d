//! Every stage of one frame in f64, from the scene alone.

use glam::DVec3;

use super::local_scene::LocalScene;
use crate::error::Result;
use crate::model::cloud::{Cloud, CloudSource, Group};
use crate::model::frame_state::FrameState;
use crate::model::grid::DEPOSIT_CUT_SIGMA;
use crate::model::scene::{LightingMode, Scene};
use crate::model::surface::Surface;
use crate::reference::area::adaptive::Accuracy;
use crate::reference::area::{AreaScene, DiscFacet, Receiver};
use crate::reference::facets::{Facet, FacetSources};
use crate::reference::generate::Generated;
use crate::reference::occlude::Rectangle;
use crate::reference::parallel::parallel_map;
use crate::reference::transmit::{self, Obstacles};
use crate::reference::{self, Blob};

/// All stages of one frame up to the light on its facets. Positions are relative to the lighting
/// origin; facets are ordered surfaces, ground, clouds.
#[derive(Clone)]
pub struct FrameReference {
    /// Camera, lighting origin and density grid.
    pub state: FrameState,
    /// Groups of all clouds at time 0.
    pub groups: Vec<Group>,
    /// Colour of every particle, linear RGB.
    pub colors: Vec<DVec3>,
    /// Placed particles.
    pub blobs: Vec<Blob>,
    /// Facets; empty if the lighting mode is "none".
    pub facets: Vec<Facet>,
    /// Colour of every facet: 1 for surfaces and ground.
    pub facet_colors: Vec<DVec3>,
    /// I_d of every facet, W m⁻².
    pub irradiance: Vec<DVec3>,
    /// L1 of every facet toward the eye, W m⁻² sr⁻¹.
    pub radiance: Vec<DVec3>,
    /// I_i of every facet; empty unless the lighting mode is "two-reflection".
    pub indirect: Vec<DVec3>,
    /// L2 of every facet toward the eye; empty unless the lighting mode is "two-reflection".
    pub second: Vec<DVec3>,
    /// Estimated error of `second`, greatest channel.
    pub second_error: Vec<f64>,
}

impl FrameReference {
    /// Computes all stages of `scene` at `time_s`.
    ///
    /// # Errors
    /// The camera has no direction at that time, or an animation cannot be read.
    pub fn new(scene: &Scene, time_s: f64) -> Result<FrameReference> {
        FrameReference::with_progress(scene, time_s, &|_| ())
    }

    /// Computes all stages and calls `on_facet` with the number of receiving facets each time the
    /// second reflection of one more is done.
    ///
    /// # Errors
    /// As for [`FrameReference::new`].
    pub fn with_progress(
        scene: &Scene,
        time_s: f64,
        on_facet: &(dyn Fn(usize) + Sync),
    ) -> Result<FrameReference> {
        let mut frame = FrameReference::unlit(scene, time_s)?;
        if scene.lighting.mode != LightingMode::None {
            frame.light(scene, on_facet);
        }
        Ok(frame)
    }

    /// Computes the stages up to the placed particles, without light.
    ///
    /// # Errors
    /// As for [`FrameReference::new`].
    pub fn unlit(scene: &Scene, time_s: f64) -> Result<FrameReference> {
        let groups = scene.groups();
        let state = FrameState::at(scene, &groups, time_s)?;
        for cloud in &scene.clouds {
            if let CloudSource::Animated(m) = &cloud.source {
                m.animation.at(time_s)?;
            }
        }
        let alive = |c| reference::live::cloud(c, time_s);
        let generated: Vec<Generated> = scene.clouds.iter().flat_map(alive).collect();
        let offsets = reference::place::offsets(&groups, &scene.clouds, time_s, state.light_origin);
        let generated = reference::place::grown(&generated, &groups, &scene.clouds, time_s);
        let positions: Vec<DVec3> = generated.iter().map(|g| g.position).collect();
        let mut placed = reference::place::place(&positions, &groups, &offsets);
        reference::place::add_gusts(&mut placed, &positions, &groups, &scene.clouds, time_s);
        let blobs = reference::place::blobs(&generated, &placed);
        Ok(FrameReference {
            state,
            groups,
            colors: colors(scene),
            blobs,
            facets: vec![],
            facet_colors: vec![],
            irradiance: vec![],
            radiance: vec![],
            indirect: vec![],
            second: vec![],
            second_error: vec![],
        })
    }

    /// Lights ground and clouds through the density grid, then the surfaces by their areas.
    fn light(&mut self, scene: &Scene, on_facet: &(dyn Fn(usize) + Sync)) {
        let (grid, origin) = (&self.state.grid, self.state.light_origin);
        let local = LocalScene::new(scene, origin, self.state.time_s);
        let cells = reference::grid::deposit(grid, &self.blobs);
        (self.facets, self.facet_colors) = self.cloud_facets(scene, &cells);
        self.facet_colors.splice(0..0, std::iter::repeat_n(DVec3::ONE, local.ground.len()));
        self.facets.splice(0..0, local.ground.iter().copied());
        let rectangles: Vec<Rectangle> =
            scene.surfaces.iter().map(|s| Rectangle::new(s, origin)).collect();
        let obstacles = Obstacles {
            spec: grid,
            cells: &cells,
            rectangles: &rectangles,
            step: scene.lighting.step,
            forward: scene.lighting.forward,
        };
        let positions: Vec<DVec3> = self.facets.iter().map(|f| f.position).collect();
        let normals: Vec<DVec3> = self.facets.iter().map(|f| f.normal).collect();
        let regions: Vec<u32> = self.facets.iter().map(|f| f.region).collect();
        let receivers: Vec<transmit::Receiver> = self
            .facets
            .iter()
            .map(|f| transmit::Receiver { position: f.position, i_region: f.region })
            .collect();
        let transmittance = obstacles.transmittance(&receivers, &local.lights);
        self.irradiance =
            reference::first::irradiance(&positions, &normals, &transmittance, &local.lights);
        self.radiance =
            reference::first::radiance(&self.irradiance, &regions, &local.kd(), &self.facet_colors);
        self.light_surfaces(scene, &local, on_facet);
    }

    /// Facets of the clouds and their colours, from the density grid.
    fn cloud_facets(&self, scene: &Scene, cells: &[f64]) -> (Vec<Facet>, Vec<DVec3>) {
        let (mut facets, colors): (Vec<Facet>, Vec<DVec3>) =
            self.with_sources(scene, |sources, centers| {
                let grid = &self.state.grid;
                if !scene.groups_facets() {
                    let facets = reference::facets::facets(grid, cells, sources, centers);
                    return (facets, self.colors.clone());
                }
                let (order, runs) = (self.morton_order(scene, sources.regions), scene.facet_runs());
                reference::facet_runs::grouped(grid, cells, sources, centers, &order, &runs)
                    .into_iter()
                    .unzip()
            });
        facets.iter_mut().for_each(|f| f.region += scene.n_solids() as u32);
        (facets, colors)
    }

    /// Calls `take` with what facets are made from and the place that each cloud's facets face away
    /// from.
    pub(super) fn with_sources<T>(
        &self,
        scene: &Scene,
        take: impl FnOnce(&FacetSources<'_>, &[DVec3]) -> T,
    ) -> T {
        let FrameState { time_s, light_origin, .. } = self.state;
        let sources = FacetSources {
            blobs: &self.blobs,
            sigma_means: &reference::place::sigma_means(&self.groups, &scene.clouds, time_s),
            regions: &reference::place::regions(&self.groups),
            colors: &self.colors,
        };
        take(&sources, &reference::place::cloud_centers(&scene.clouds, time_s, light_origin))
    }

    /// Puts the surfaces' facets before all others, lit by the area reference, and adds the second
    /// reflection to all.
    fn light_surfaces(
        &mut self,
        scene: &Scene,
        local: &LocalScene,
        on_facet: &(dyn Fn(usize) + Sync),
    ) {
        let discs: Vec<DiscFacet> =
            self.facets.iter().zip(&self.facet_colors).map(|(f, c)| local.disc(f, *c)).collect();
        let area_scene = AreaScene::new(
            &local.surfaces,
            local.surface_brdfs(),
            &local.lights,
            &self.blobs,
            scene.lighting.forward,
            &discs,
        );
        let flat: Vec<Facet> =
            local.surfaces.iter().zip(0u32..).flat_map(|(s, i)| surface_facets(s, i)).collect();
        let eye = self.state.pose.position - self.state.light_origin;
        let on_surfaces = flat.iter().map(|f| area_scene.on_surface(f.region as usize, f.position));
        let receivers: Vec<(Receiver, DVec3)> = on_surfaces
            .chain((0..discs.len()).map(|i| area_scene.on_disc(i)))
            .map(|r| (r, (eye - r.position).normalize_or(r.normal)))
            .collect();
        let of_surfaces = &receivers[..flat.len()];
        let first = of_surfaces.iter().map(|(r, toward)| area_scene.first(r, *toward));
        self.radiance.splice(0..0, first);
        self.irradiance.splice(0..0, of_surfaces.iter().map(|(r, _)| area_scene.irradiance(r)));
        self.facet_colors.splice(0..0, std::iter::repeat_n(DVec3::ONE, flat.len()));
        self.facets.splice(0..0, flat);
        if scene.lighting.mode == LightingMode::TwoReflection {
            let accuracy = Accuracy::relative(SECOND_ACCURACY);
            let found = parallel_map(receivers.len(), |i| {
                let second = area_scene.second(&receivers[i].0, receivers[i].1, &accuracy);
                on_facet(receivers.len());
                second
            });
            self.indirect = found.iter().map(|e| e.irradiance).collect();
            self.second = found.iter().map(|e| e.radiance).collect();
            self.second_error = found.iter().map(|e| e.error).collect();
        }
    }

    /// Returns L1 + L2 of facet `i` toward the eye.
    pub fn facet_radiance(&self, i: usize) -> DVec3 {
        self.radiance[i] + self.second.get(i).copied().unwrap_or(DVec3::ZERO)
    }

    /// Returns the radiance that every particle is drawn with: that of its facet, or its own
    /// colour if nothing is lit.
    pub fn particle_radiance(&self, scene: &Scene) -> Vec<DVec3> {
        if self.facets.is_empty() {
            return self.colors.clone();
        }
        let n_before = scene.n_solid_facets() as usize;
        if !scene.groups_facets() {
            return (0..self.blobs.len()).map(|i| self.facet_radiance(n_before + i)).collect();
        }
        let order = self.morton_order(scene, &reference::place::regions(&self.groups));
        let mut found = vec![DVec3::ZERO; self.blobs.len()];
        for (k, (first, end)) in scene.facet_runs().into_iter().enumerate() {
            for place in first..end {
                found[order[place as usize] as usize] = self.facet_radiance(n_before + k);
            }
        }
        found
    }

    /// Particles in Morton order, cloud by cloud.
    fn morton_order(&self, scene: &Scene, i_cloud: &[u32]) -> Vec<u32> {
        let (n_solids, origin) = (scene.n_solids() as u32, self.state.light_origin);
        let bounds = scene.region_bounds(&self.groups, self.state.time_s, DEPOSIT_CUT_SIGMA);
        let bounds: Vec<_> =
            bounds.into_iter().map(|(low, high)| (low - origin, high - origin)).collect();
        let positions: Vec<DVec3> = self.blobs.iter().map(|b| b.position).collect();
        let regions: Vec<u32> = i_cloud.iter().map(|i| n_solids + i).collect();
        reference::morton::order(&positions, &regions, &bounds)
    }
}

/// Relative accuracy of the second reflection: a hundredth of the 1 % that devices are held to.
const SECOND_ACCURACY: f64 = 1e-4;

/// Facets of a surface whose region is `region`.
fn surface_facets(surface: &Surface, region: u32) -> impl Iterator<Item = Facet> + '_ {
    let n = surface.subdivide[0] * surface.subdivide[1];
    let area = surface.area() / f64::from(n);
    let normal = surface.normal();
    (0..n).map(move |i| Facet {
        position: surface.facet_center(i),
        normal,
        area,
        region,
        conditioning: 1.0,
    })
}

/// Returns every particle's own colour, linear RGB.
pub fn colors(scene: &Scene) -> Vec<DVec3> {
    let of_cloud = |cloud: &Cloud| match &cloud.source {
        CloudSource::Particles(list) => list.iter().map(|p| p.color).collect(),
        _ => vec![DVec3::ONE; cloud.n_particles() as usize],
    };
    scene.clouds.iter().flat_map(of_cloud).collect()
}
