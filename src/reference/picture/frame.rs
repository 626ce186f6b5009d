//! Every stage of one frame in f64, from the scene alone.

use glam::DVec3;

use super::local_scene::LocalScene;
use super::medium_light::{BlobLight, CloudCells, MediumLight};
use crate::error::Result;
use crate::model::cloud::{Cloud, CloudSource, Group};
use crate::model::cover::Sea;
use crate::model::frame_state::FrameState;
use crate::model::light::Light;
use crate::model::medium::{MeanMedium, Medium, ScatterLaw};
use crate::model::parallel::parallel_map;
use crate::model::scene::{LightingMode, Scene};
use crate::model::shade::FacetSlope;
use crate::model::sky::SkyView;
use crate::reference::area::adaptive::Estimate;
use crate::reference::facets::{Facet, FacetPlace, FacetSources};
use crate::reference::generate::Generated;
use crate::reference::occlude::Rectangle;
use crate::reference::transmit::{self, Obstacles};
use crate::reference::{self, Blob};

/// Returns the second reflection of a facet.
pub type SecondOf<'a> = dyn Fn(usize) -> Estimate + Sync + 'a;

/// The second reflection where there is none.
fn nothing(_: usize) -> Estimate {
    Estimate::default()
}

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
    /// Colour of every facet: 1 for surfaces.
    pub facet_colors: Vec<DVec3>,
    /// I_d of every facet; of a medium the fluence of suns and lamps, W m⁻².
    pub irradiance: Vec<DVec3>,
    /// L1 of every facet toward the eye, and what a medium scatters, W m⁻² sr⁻¹.
    pub radiance: Vec<DVec3>,
    /// Change of `radiance` at every facet; empty unless light changes inside of blobs.
    pub slopes: Vec<FacetSlope>,
    /// Light of the cells toward the eye; `None` without bounces.
    pub cells: Option<CloudCells>,
    /// I_i of every facet; empty unless the lighting mode is "two-reflection".
    pub indirect: Vec<DVec3>,
    /// L2 of every facet toward the eye; empty unless the lighting mode is "two-reflection".
    pub second: Vec<DVec3>,
    /// The sky whose air lies before the facets; `None` without.
    pub sky: Option<SkyView>,
    /// Share of the sun that arrives at each facet of a sea, with the sea; `None` of others. Empty
    /// without a sea.
    pub seas: Vec<Option<(Sea, f64)>>,
    /// Estimated error of `second`, greatest channel.
    pub second_error: Vec<f64>,
    /// Greatest of three channels of Σ A |L1 − L1'| / Σ A L1 over facets of ground and clouds, L1
    /// in closed form and L1' through the density grid; 0 unless the mode is "two-reflection".
    pub grid_error: f64,
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
        let scene = &*scene.lit();
        let mut frame = FrameReference::unlit(scene, time_s)?;
        if scene.lighting.mode == LightingMode::None {
            return Ok(frame);
        }
        let has_second = scene.lighting.mode == LightingMode::TwoReflection;
        let found = frame.light(scene, |frame, second| {
            let n = if has_second { frame.facets.len() } else { 0 };
            parallel_map(n, |i| {
                let found = second(i);
                on_facet(n);
                found
            })
        });
        frame.indirect = found.iter().map(|e| e.irradiance).collect();
        frame.second = found.iter().map(|e| e.radiance).collect();
        frame.second_error = found.iter().map(|e| e.error).collect();
        Ok(frame)
    }

    /// Computes all stages but the second reflection, and calls `take` with them and with the
    /// second reflection of any facet, which is 0 unless the lighting mode is "two-reflection".
    ///
    /// # Errors
    /// As for [`FrameReference::new`].
    pub fn with_second<T>(
        scene: &Scene,
        time_s: f64,
        take: impl FnOnce(&FrameReference, &SecondOf<'_>) -> T,
    ) -> Result<T> {
        let scene = &*scene.lit();
        let mut frame = FrameReference::unlit(scene, time_s)?;
        Ok(match scene.lighting.mode {
            LightingMode::TwoReflection => frame.light(scene, take),
            LightingMode::None => take(&frame, &nothing),
            _ => frame.light(scene, |frame, _| take(frame, &nothing)),
        })
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
            sky: scene.sky_view(state.pose.position, time_s).filter(|_| scene.has_haze()),
            seas: vec![],
            colors: colors(scene, &blobs, state.pose.position - state.light_origin),
            state,
            groups,
            blobs,
            facets: vec![],
            facet_colors: vec![],
            irradiance: vec![],
            radiance: vec![],
            slopes: vec![],
            cells: None,
            indirect: vec![],
            second: vec![],
            second_error: vec![],
            grid_error: 0.0,
        })
    }

    /// Lights ground and clouds through the density grid, then the surfaces by their areas. Calls
    /// `take` with the frame and the second reflection of any facet.
    fn light<T>(
        &mut self,
        scene: &Scene,
        take: impl FnOnce(&FrameReference, &SecondOf<'_>) -> T,
    ) -> T {
        let (grid, origin) = (self.state.grid, self.state.light_origin);
        let local = LocalScene::new(scene, origin, self.state.time_s);
        let cells = reference::deposit::deposit(&grid, &self.blobs);
        (self.facets, self.facet_colors) = self.cloud_facets(scene, &cells);
        self.facet_colors.splice(0..0, local.ground_colors.iter().copied());
        self.facets.splice(0..0, local.ground.iter().copied());
        let rectangles: Vec<Rectangle> =
            scene.surfaces.iter().map(|s| Rectangle::new(s, origin)).collect();
        let obstacles = Obstacles {
            spec: &grid,
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
        let diffuse = (scene.lighting.mode == LightingMode::Diffusion).then(|| {
            let mean = MeanMedium::new(scene, &self.groups, self.state.time_s);
            let eye = self.state.pose.position - origin;
            MediumLight::new(scene, &mean, &obstacles, &local, eye)
        });
        // Diffuse light has the sky, and what is scattered on the way from suns and lamps.
        let (direct, lights) = match &diffuse {
            Some(light) => {
                let lights = local.lights.iter().filter(|light| !light.is_sky()).copied();
                (Obstacles { forward: light.forward, ..obstacles }, lights.collect())
            }
            None => (obstacles, local.lights.clone()),
        };
        let mut transmittance = direct.transmittance(&receivers, &lights);
        local.hide_by_ground(&mut transmittance, &lights);
        self.seas = seas(scene, &lights, &transmittance);
        self.irradiance =
            reference::first::irradiance(&positions, &normals, &transmittance, &lights);
        let more = diffuse.as_ref().map_or(&[][..], |light| &light.on_solids);
        let (on_surfaces, on_ground) = more.split_at(more.len().saturating_sub(local.ground.len()));
        for (e, more) in self.irradiance.iter_mut().zip(on_ground) {
            *e += *more;
        }
        self.radiance =
            reference::first::radiance(&self.irradiance, &regions, &local.kd(), &self.facet_colors);
        if scene.lighting.mode.is_medium() {
            self.scatter(scene, &obstacles, &local.lights, diffuse.as_ref());
        }
        self.light_surfaces(scene, &local, (&lights, direct.forward), on_surfaces, take)
    }

    /// Replaces the light of the clouds' facets by what they scatter as a medium.
    fn scatter(
        &mut self,
        scene: &Scene,
        obstacles: &Obstacles<'_>,
        lights: &[Light],
        diffuse: Option<&MediumLight>,
    ) {
        let forward = scene.lighting.forward;
        let medium =
            |c: &Cloud| Medium::new(&scene.materials[c.i_material], self.state.time_s, forward);
        let media: Vec<Medium> = scene.clouds.iter().map(medium).collect();
        let eye = self.state.pose.position - self.state.light_origin;
        let n_solids = scene.n_solids();
        let found = parallel_map(self.facets.len(), |i| {
            let facet = &self.facets[i];
            let i_cloud = (facet.region as usize).checked_sub(n_solids)?;
            let law = ScatterLaw::new(&scene.lighting, &media[i_cloud], self.facet_colors[i]);
            let receiver = transmit::Receiver { position: facet.position, i_region: facet.region };
            let taus = obstacles.depths(&[receiver], lights);
            Some(BlobLight::new(&law, facet, eye, (&taus, lights), diffuse))
        });
        for (i, light) in found.iter().enumerate() {
            if let Some(light) = light {
                (self.irradiance[i], self.radiance[i]) = (light.fluence, light.radiance);
            }
        }
        if let Some(cells) = diffuse.and_then(|light| light.seen.clone()) {
            let mean = |light: &Option<BlobLight>| light.as_ref().map_or(0.0, |l| l.mean);
            self.cells = Some(CloudCells { cells, means: found.iter().map(mean).collect() });
        }
        if scene.lighting.has_slopes() {
            let slope = |(facet, light): (&Facet, &Option<BlobLight>)| FacetSlope {
                relative: light.as_ref().map_or(DVec3::ZERO, |l| l.slope),
                position: facet.position,
            };
            self.slopes = self.facets.iter().zip(&found).map(slope).collect();
        }
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
            place: match scene.lighting.mode.is_medium() {
                true => FacetPlace::Center,
                false => FacetPlace::Shell,
            },
        };
        take(&sources, &reference::place::cloud_centers(&scene.clouds, time_s, light_origin))
    }
}

/// Returns every particle's own colour, linear RGB: toward `eye` where it changes with the
/// direction of view and no light decides what it shows.
fn colors(scene: &Scene, blobs: &[Blob], eye: DVec3) -> Vec<DVec3> {
    let is_lit = scene.lighting.mode != LightingMode::None;
    let mut all = Vec::with_capacity(blobs.len());
    for cloud in &scene.clouds {
        let first = all.len();
        match &cloud.source {
            CloudSource::Particles(list) => match list.harmonics().filter(|_| !is_lit) {
                Some(of) => {
                    all.extend(blobs[first..].iter().zip(&of.by_particle).map(|(b, of)| {
                        reference::harmonics::color(of, (b.position - eye).normalize_or_zero())
                    }))
                }
                None => all.extend(list.iter().map(|p| p.color)),
            },
            _ => all.resize(first + cloud.n_particles() as usize, DVec3::ONE),
        }
    }
    all
}

/// Returns the sea of every facet of surfaces and ground, and what arrives of the sun. `passed`
/// [point][light]: of the ground's points first.
fn seas(scene: &Scene, lights: &[Light], passed: &[f64]) -> Vec<Option<(Sea, f64)>> {
    let i_sun = lights.iter().position(Light::is_sun);
    let Some(i_sun) = i_sun.filter(|_| scene.has_sea()) else {
        return vec![];
    };
    let of_ground = scene
        .terrains
        .iter()
        .zip(scene.seas())
        .flat_map(|(t, sea)| std::iter::repeat_n(sea, t.n_facets() as usize))
        .enumerate()
        .map(|(i, sea)| sea.map(|sea| (sea, passed[i * lights.len() + i_sun])));
    std::iter::repeat_n(None, scene.n_surface_facets() as usize).chain(of_ground).collect()
}
