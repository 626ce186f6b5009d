//! The light of clouds that are a medium, and what it adds on surfaces and ground.

use glam::DVec3;

use super::local_scene::LocalScene;
use crate::model::medium::MeanMedium;
use crate::model::scene::Scene;
use crate::reference::diffusion::{BoxLight, DiffuseLight, DiffusionMedium, FaceLight};
use crate::reference::first;
use crate::reference::parallel::parallel_map;
use crate::reference::scatter::BARRED;
use crate::reference::transmit::{Obstacles, Receiver};

/// Diffuse light of a frame.
pub(super) struct MediumLight {
    /// That of the cells.
    pub cells: DiffuseLight,
    /// Irradiance of the facets of surfaces and then of ground, by the sky and the clouds.
    pub on_solids: Vec<DVec3>,
    /// 1 − s: share of τ that suns and lamps pass on their way to surfaces and ground.
    pub forward: f64,
}

impl MediumLight {
    /// Computes that of a medium in the cells of `obstacles`.
    pub fn new(
        scene: &Scene,
        mean: &MeanMedium,
        obstacles: &Obstacles<'_>,
        local: &LocalScene,
    ) -> MediumLight {
        let (grid, lights) = (obstacles.spec, &local.lights);
        let medium = DiffusionMedium::new(*mean, grid);
        let facets = local.solid_facets();
        let receivers: Vec<Receiver> =
            facets.iter().map(|f| Receiver { position: f.position, i_region: f.region }).collect();
        let (positions, normals): (Vec<DVec3>, Vec<DVec3>) =
            facets.iter().map(|f| (f.position, f.normal)).unzip();
        let passed = obstacles.transmittance(&receivers, lights);
        let arriving = first::irradiance(&positions, &normals, &passed, lights);
        let kd = local.kd();
        let radiosity: Vec<DVec3> =
            facets.iter().zip(&arriving).map(|(f, e)| kd[f.region as usize] * *e).collect();
        let lift = scene.longest_facet_edge();
        let of_solids =
            (!facets.is_empty()).then(|| FaceLight::new(grid, &facets, &radiosity, lights, lift));
        let n_cycles = scene.lighting.diffusion.cycles;
        let cells = DiffuseLight::new(&medium, obstacles, lights, of_solids.as_ref(), n_cycles);
        let depths = obstacles.depths(&receivers, lights);
        let of_box = BoxLight::new(grid, &cells);
        let on_solids = parallel_map(facets.len(), |j| {
            let is_open = |l: usize| depths[j * lights.len() + l] < BARRED;
            of_box.irradiance((facets[j].position, facets[j].normal), lights, is_open)
        });
        let forward = (mean.albedo * mean.straight).element_sum() / 3.0;
        MediumLight { cells, on_solids, forward }
    }
}
