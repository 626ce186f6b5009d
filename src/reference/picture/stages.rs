//! A frame's f64 reference, stage by stage, from the scene alone.

use glam::DVec3;

use crate::error::Result;
use crate::model::cloud::{CloudSource, Group};
use crate::model::frame_state::FrameState;
use crate::model::grid::DEPOSIT_CUT_SIGMA;
use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::scene::{LightingMode, Scene};
use crate::model::surface::Surface;
use crate::reference::area::adaptive::Accuracy;
use crate::reference::area::mean::each;
use crate::reference::area::{AreaScene, DiscFacet, Receiver};
use crate::reference::facets::{Facet, FacetSources};
use crate::reference::generate::Generated;
use crate::reference::occlude::Rectangle;
use crate::reference::transmit::{self, Obstacles};
use crate::reference::{self, Blob};

/// All stages of one frame up to the light on the facets. Positions relative to the lighting
/// origin.
#[derive(Clone)]
pub struct FrameReference {
    pub setting: FrameState,
    pub groups: Vec<Group>,
    pub generated: Vec<Generated>,
    pub colors: Vec<DVec3>,
    pub blobs: Vec<Blob>,
    /// Empty where lighting.mode is "none".
    pub facets: Vec<Facet>,
    pub facet_colors: Vec<DVec3>,
    /// I_d, and L1 toward the eye.
    pub irradiance: Vec<DVec3>,
    pub radiance: Vec<DVec3>,
    /// I_i, and L2 toward the eye; empty but for lighting.mode "two-reflection".
    pub indirect: Vec<DVec3>,
    pub second: Vec<DVec3>,
    /// What L2 may be off, greatest channel: an estimate.
    pub second_error: Vec<f64>,
}

impl FrameReference {
    pub fn of(scene: &Scene, time_s: f64) -> Result<FrameReference> {
        FrameReference::of_with_listener(scene, time_s, &|_| ())
    }

    /// `on_facet` hears how many facets receive a second reflection each time that one of them has;
    /// it may take long.
    pub fn of_with_listener(
        scene: &Scene,
        time_s: f64,
        on_facet: &(dyn Fn(usize) + Sync),
    ) -> Result<FrameReference> {
        let mut truth = FrameReference::unlit(scene, time_s)?;
        if scene.lighting.mode != LightingMode::None {
            truth.light(scene, on_facet);
        }
        Ok(truth)
    }

    /// Particles where they are, and nothing of light.
    pub fn unlit(scene: &Scene, time_s: f64) -> Result<FrameReference> {
        let groups = scene.groups();
        let setting = FrameState::at(scene, &groups, time_s)?;
        for cloud in &scene.clouds {
            if let CloudSource::Animated(m) = &cloud.source {
                m.mover.at(time_s)?;
            }
        }
        let alive = |c| reference::live::cloud(c, time_s);
        let generated: Vec<Generated> = scene.clouds.iter().flat_map(alive).collect();
        let offsets =
            reference::place::offsets(&groups, &scene.clouds, time_s, setting.light_origin);
        let generated = reference::place::grown(&generated, &groups, &scene.clouds, time_s);
        let positions: Vec<DVec3> = generated.iter().map(|g| g.position).collect();
        let mut placed = reference::place::place(&positions, &groups, &offsets);
        reference::place::add_gusts(&mut placed, &positions, &groups, &scene.clouds, time_s);
        let blobs = reference::place::blobs(&generated, &placed);
        let colors = colors(scene);
        Ok(FrameReference {
            setting,
            groups,
            generated,
            colors,
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

    fn light(&mut self, scene: &Scene, on_facet: &(dyn Fn(usize) + Sync)) {
        let grid = &self.setting.grid;
        let cells = reference::grid::deposit(grid, &self.blobs);
        let centers = reference::place::cloud_centers(
            &scene.clouds,
            self.setting.time_s,
            self.setting.light_origin,
        );
        let regions = reference::place::regions(&self.groups);
        let scales =
            reference::place::sigma_means(&self.groups, &scene.clouds, self.setting.time_s);
        let members = FacetSources {
            blobs: &self.blobs,
            sigma_means: &scales,
            regions: &regions,
            colors: &self.colors,
        };
        (self.facets, self.facet_colors) = if scene.groups_facets() {
            let order = self.order(scene, &regions);
            reference::facets::grouped(
                grid,
                &cells,
                &members,
                &centers,
                &order,
                &scene.facet_runs(),
            )
            .into_iter()
            .unzip()
        } else {
            (
                reference::facets::facets(grid, &cells, &self.blobs, &scales, &regions, &centers),
                self.colors.clone(),
            )
        };
        let lighting = &scene.lighting;
        let lights: Vec<Light> =
            scene.lights.iter().map(|l| l.relative_to(self.setting.light_origin)).collect();
        let rectangles: Vec<Rectangle> =
            scene.surfaces.iter().map(|s| Rectangle::new(s, self.setting.light_origin)).collect();
        let obstacles = Obstacles {
            spec: grid,
            cells: &cells,
            rectangles: &rectangles,
            step: lighting.step,
            forward: lighting.forward,
        };
        // Surfaces are the first regions, then comes the ground.
        for facet in &mut self.facets {
            facet.region += scene.n_solids() as u32;
        }
        let ground = ground(scene, self.setting.light_origin);
        self.facet_colors.splice(0..0, std::iter::repeat_n(DVec3::ONE, ground.len()));
        self.facets.splice(0..0, ground);
        let positions: Vec<DVec3> = self.facets.iter().map(|f| f.position).collect();
        let normals: Vec<DVec3> = self.facets.iter().map(|f| f.normal).collect();
        let receivers: Vec<transmit::Receiver> = self
            .facets
            .iter()
            .map(|f| transmit::Receiver { position: f.position, i_region: f.region })
            .collect();
        let transmittance = obstacles.transmittance(&receivers, &lights);
        self.irradiance =
            reference::first::irradiance(&positions, &normals, &transmittance, &lights);
        let kd: Vec<DVec3> = (0..scene.n_regions())
            .map(|i| scene.region_material(i).at(self.setting.time_s).kd)
            .collect();
        let regions: Vec<u32> = self.facets.iter().map(|f| f.region).collect();
        self.radiance =
            reference::first::radiance(&self.irradiance, &regions, &kd, &self.facet_colors);
        self.light_surfaces(scene, &lights, &kd, on_facet);
    }

    /// Puts the surfaces' facets before the clouds', lit by the area reference, and adds the second
    /// reflection to both.
    fn light_surfaces(
        &mut self,
        scene: &Scene,
        lights: &[Light],
        kd: &[DVec3],
        on_facet: &(dyn Fn(usize) + Sync),
    ) {
        let origin = self.setting.light_origin;
        let at_origin = |s: &Surface| Surface { center: s.center - origin, ..*s };
        let surfaces: Vec<Surface> = scene.surfaces.iter().map(at_origin).collect();
        let brdfs: Vec<Brdf> =
            (0..surfaces.len()).map(|i| scene.region_material(i).at(self.setting.time_s)).collect();
        let disc = |(f, c): (&Facet, &DVec3)| DiscFacet {
            position: f.position,
            normal: f.normal,
            area: f.area,
            kd: kd[f.region as usize] * c,
        };
        let discs: Vec<DiscFacet> = self.facets.iter().zip(&self.facet_colors).map(disc).collect();
        let forward = scene.lighting.forward;
        let scenery = AreaScene::new(&surfaces, &brdfs, lights, &self.blobs, forward, &discs);
        let flat: Vec<Facet> =
            surfaces.iter().zip(0u32..).flat_map(|(s, i)| facets_of(s, i)).collect();
        let eye = self.setting.pose.position - origin;
        let on_surfaces = flat.iter().map(|f| scenery.on_surface(f.region as usize, f.position));
        let receivers: Vec<(Receiver, DVec3)> = on_surfaces
            .chain((0..discs.len()).map(|i| scenery.on_disc(i)))
            .map(|r| (r, (eye - r.position).normalize_or(r.normal)))
            .collect();
        let of_surfaces = &receivers[..flat.len()];
        let first = of_surfaces.iter().map(|(r, toward)| scenery.first(r, *toward));
        self.radiance.splice(0..0, first);
        self.irradiance.splice(0..0, of_surfaces.iter().map(|(r, _)| scenery.irradiance(r)));
        self.facet_colors.splice(0..0, std::iter::repeat_n(DVec3::ONE, flat.len()));
        self.facets.splice(0..0, flat);
        if scene.lighting.mode == LightingMode::TwoReflection {
            let accuracy = Accuracy::relative(SECOND_ACCURACY);
            let found = each(receivers.len(), |i| {
                let second = scenery.second(&receivers[i].0, receivers[i].1, &accuracy);
                on_facet(receivers.len());
                second
            });
            self.indirect = found.iter().map(|e| e.irradiance).collect();
            self.second = found.iter().map(|e| e.radiance).collect();
            self.second_error = found.iter().map(|e| e.error).collect();
        }
    }

    /// L1 + L2 of facet `i` toward the eye.
    pub fn facet_radiance(&self, i: usize) -> DVec3 {
        self.radiance[i] + self.second.get(i).copied().unwrap_or(DVec3::ZERO)
    }

    /// What every particle is drawn with: the radiance of its facet, or its own colour where
    /// nothing is lit.
    pub fn particle_radiance(&self, scene: &Scene) -> Vec<DVec3> {
        if self.facets.is_empty() {
            return self.colors.clone();
        }
        let n_before = scene.n_solid_facets() as usize;
        if !scene.groups_facets() {
            return (0..self.blobs.len()).map(|i| self.facet_radiance(n_before + i)).collect();
        }
        let order = self.order(scene, &reference::place::regions(&self.groups));
        let mut found = vec![DVec3::ZERO; self.blobs.len()];
        for (k, (first, end)) in scene.facet_runs().into_iter().enumerate() {
            for place in first..end {
                found[order[place as usize] as usize] = self.facet_radiance(n_before + k);
            }
        }
        found
    }

    /// The particles in Morton order, cloud by cloud.
    fn order(&self, scene: &Scene, i_cloud: &[u32]) -> Vec<u32> {
        let (n_solids, origin) = (scene.n_solids() as u32, self.setting.light_origin);
        let bounds = scene.region_bounds(&self.groups, self.setting.time_s, DEPOSIT_CUT_SIGMA);
        let bounds: Vec<_> =
            bounds.into_iter().map(|(low, high)| (low - origin, high - origin)).collect();
        let positions: Vec<DVec3> = self.blobs.iter().map(|b| b.position).collect();
        let regions: Vec<u32> = i_cloud.iter().map(|i| n_solids + i).collect();
        reference::morton::order(&positions, &regions, &bounds)
    }
}

/// How exactly the second reflection is integrated: a hundredth of the percent that it is compared
/// to.
const SECOND_ACCURACY: f64 = 1e-4;

/// Facets of a surface, whose region is its number.
fn facets_of(surface: &Surface, region: u32) -> impl Iterator<Item = Facet> + '_ {
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

/// Facets of the scene's ground, relative to `origin`.
pub fn ground(scene: &Scene, origin: DVec3) -> Vec<Facet> {
    let terrains = scene.terrains.iter().zip(scene.surfaces.len() as u32..);
    terrains.flat_map(|(t, region)| reference::terrain::facets(t, origin, region)).collect()
}

/// Every particle's own colour.
pub fn colors(scene: &Scene) -> Vec<DVec3> {
    let of = |cloud: &crate::model::cloud::Cloud| match &cloud.source {
        CloudSource::Boxes { .. } | CloudSource::Disc(_) | CloudSource::Animated(_) => {
            vec![DVec3::ONE; cloud.n_particles() as usize]
        }
        CloudSource::Particles(list) => list.iter().map(|p| p.color).collect(),
    };
    scene.clouds.iter().flat_map(of).collect()
}
