//! A scene's solids and lights at one time, relative to the lighting origin.

use glam::DVec3;

use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::parallel::parallel_map;
use crate::model::relief::may_hide;
use crate::model::scene::Scene;
use crate::model::surface::Surface;
use crate::model::terrain::Terrain;
use crate::reference::area::DiscFacet;
use crate::reference::facets::Facet;
use crate::reference::relief::Ground;
use crate::reference::terrain;

/// Surfaces, ground, lights and materials at one time; positions relative to the lighting origin.
#[derive(Debug, Clone)]
pub(super) struct LocalScene {
    /// Place of the lighting origin in the scene.
    pub origin: DVec3,
    /// Surfaces.
    pub surfaces: Vec<Surface>,
    /// Lights.
    pub lights: Vec<Light>,
    /// Material of every region: surfaces, ground, clouds.
    brdfs: Vec<Brdf>,
    /// Number of surfaces and of grounds together.
    n_solids: usize,
    /// Facets of the ground, one a point.
    pub ground: Vec<Facet>,
    /// Factor on K_d of these facets.
    pub ground_colors: Vec<DVec3>,
    /// Ground that hides lights from its own points; `None` where it hides none.
    pub relief: Option<Ground>,
}

impl LocalScene {
    /// Collects the solids and lights of `scene` relative to `origin`.
    pub fn new(scene: &Scene, origin: DVec3, time_s: f64) -> LocalScene {
        let terrains = scene.terrains.iter().zip(scene.surfaces.len() as u32..);
        let brdf = |i: usize| scene.region_material(i).at(time_s);
        LocalScene {
            origin,
            surfaces: surfaces(scene, origin),
            lights: scene.lights.iter().map(|l| l.relative_to(origin)).collect(),
            brdfs: (0..scene.n_regions()).map(brdf).collect(),
            n_solids: scene.n_solids(),
            ground: terrains.flat_map(|(t, region)| terrain::facets(t, origin, region)).collect(),
            ground_colors: scene.terrains.iter().flat_map(colors).collect(),
            relief: may_hide(&scene.terrains, &scene.lights)
                .then(|| Ground::new(&scene.terrains, origin)),
        }
    }

    /// Takes away the lights that ground hides from its own points: `passed` [point][light] is what
    /// else lets through.
    pub fn hide_by_ground(&self, passed: &mut [f64], lights: &[Light]) {
        let Some(relief) = self.relief.as_ref().filter(|_| !lights.is_empty()) else { return };
        let hidden = parallel_map(self.ground.len(), |i| {
            let p = self.ground[i].position;
            lights.iter().map(|light| relief.hides(p, light, 0.0)).collect::<Vec<_>>()
        });
        for (passed, is_hidden) in passed.iter_mut().zip(hidden.concat()) {
            *passed = if is_hidden { 0.0 } else { *passed };
        }
    }

    /// Materials of the surfaces.
    pub fn surface_brdfs(&self) -> &[Brdf] {
        &self.brdfs[..self.surfaces.len()]
    }

    /// Materials of surfaces and ground.
    pub fn solid_brdfs(&self) -> &[Brdf] {
        &self.brdfs[..self.n_solids]
    }

    /// Facets of the surfaces.
    pub fn surface_facets(&self) -> impl Iterator<Item = Facet> + '_ {
        self.surfaces.iter().zip(0u32..).flat_map(|(s, i)| surface_facets(s, i))
    }

    /// Facets of the surfaces, and then of the ground.
    pub fn solid_facets(&self) -> Vec<Facet> {
        self.surface_facets().chain(self.ground.iter().copied()).collect()
    }

    /// Factor on K_d of the facets of the surfaces, and then of the ground.
    pub fn solid_colors(&self) -> Vec<DVec3> {
        let n = self.surfaces.iter().map(Surface::n_facets).sum::<u64>() as usize;
        std::iter::repeat_n(DVec3::ONE, n).chain(self.ground_colors.iter().copied()).collect()
    }

    /// K_d of every region.
    pub fn kd(&self) -> Vec<DVec3> {
        self.brdfs.iter().map(|brdf| brdf.kd).collect()
    }

    /// Returns `facet` of a particle or of the ground as the area reference takes it.
    pub fn disc(&self, facet: &Facet, color: DVec3) -> DiscFacet {
        DiscFacet {
            position: facet.position,
            normal: facet.normal,
            area: facet.area,
            kd: self.brdfs[facet.region as usize].kd * color,
        }
    }
}

fn colors(terrain: &Terrain) -> Vec<DVec3> {
    (0..terrain.points.len()).map(|i| terrain.color(i)).collect()
}

/// Returns the scene's surfaces relative to `origin`.
pub(super) fn surfaces(scene: &Scene, origin: DVec3) -> Vec<Surface> {
    scene.surfaces.iter().map(|s| Surface { center: s.center - origin, ..*s }).collect()
}

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
        sigma: 0.0,
        conditioning: 1.0,
    })
}
