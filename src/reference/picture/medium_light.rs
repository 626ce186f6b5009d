//! The light of clouds that are a medium, and what it adds on surfaces and ground.

use glam::DVec3;

use super::local_scene::LocalScene;
use crate::model::light::{Light, UP};
use crate::model::medium::{MeanMedium, ScatterLaw};
use crate::model::parallel::parallel_map;
use crate::model::scene::{DiffusionSettings, Scene};
use crate::reference::diffusion::{BoxLight, DiffuseLight, DiffusionMedium, FaceLight, SeenCells};
use crate::reference::facets::Facet;
use crate::reference::scatter::{self, BARRED};
use crate::reference::transmit::{Obstacles, Receiver};

/// Diffuse light of a frame.
pub(super) struct MediumLight {
    /// That of the cells.
    pub cells: DiffuseLight,
    /// Light that the cells scatter toward the eye, with bounces.
    pub seen: Option<SeenCells>,
    /// ϖ(1 − f) of the mean medium.
    pub scattered: DVec3,
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
        eye: DVec3,
    ) -> MediumLight {
        let (grid, lights) = (obstacles.spec, &local.lights);
        let medium = DiffusionMedium::new(*mean, grid);
        let facets = local.solid_facets();
        let receivers: Vec<Receiver> =
            facets.iter().map(|f| Receiver { position: f.position, i_region: f.region }).collect();
        let mut passed = obstacles.transmittance(&receivers, lights);
        let n_before = facets.len() - local.ground.len();
        local.hide_by_ground(&mut passed[n_before * lights.len()..], lights);
        let arriving = facets.iter().enumerate().map(|(j, f)| {
            let of = lights.iter().zip(&passed[j * lights.len()..]);
            let at = |(light, v): (&Light, &f64)| {
                light.irradiance(f.normal, &light.arrival(f.position), *v)
            };
            of.map(at).sum::<DVec3>()
        });
        let kd = local.kd();
        let radiosity = facets.iter().zip(arriving).map(|(f, e)| kd[f.region as usize] * e);
        let radiosity: Vec<DVec3> =
            radiosity.zip(local.solid_colors()).map(|(sent, color)| sent * color).collect();
        let lift = scene.longest_facet_edge();
        let of_solids =
            (!facets.is_empty()).then(|| FaceLight::new(grid, &facets, &radiosity, lights, lift));
        let DiffusionSettings { cycles, bounces, bounce_cells, .. } = scene.lighting.diffusion;
        let of_solids = of_solids.as_ref();
        let n = (cycles, bounces, bounce_cells);
        let (cells, seen) =
            DiffuseLight::with_bounces(&medium, obstacles, lights, of_solids, n, eye);
        let depths = obstacles.depths(&receivers, lights);
        let of_box = BoxLight::new(grid, &cells);
        let on_solids = parallel_map(facets.len(), |j| {
            let is_open = |l: usize| depths[j * lights.len() + l] < BARRED;
            of_box.irradiance((facets[j].position, facets[j].normal), lights, is_open)
        });
        let forward = (mean.albedo * mean.straight).element_sum() / 3.0;
        let scattered = mean.albedo * (1.0 - mean.straight);
        MediumLight { cells, seen, scattered, on_solids, forward }
    }
}

/// Light of cells that slices of clouds have where they are.
#[derive(Debug, Clone)]
pub struct CloudCells {
    /// Radiance toward the eye by cell.
    pub cells: SeenCells,
    /// By facet, the mean over the channels of what the cells show of it; 0 on surfaces and ground.
    pub means: Vec<f64>,
}

/// Light that a blob scatters toward the eye.
pub(super) struct BlobLight {
    /// Fluence of suns and lamps.
    pub fluence: DVec3,
    pub radiance: DVec3,
    /// Its relative change per length.
    pub slope: DVec3,
    /// Mean over the channels of what the cells show; 0 without bounces.
    pub mean: f64,
}

impl BlobLight {
    /// Returns that of `facet`, to which lights have the depths `taus`.
    pub fn new(
        law: &ScatterLaw,
        facet: &Facet,
        eye: DVec3,
        (taus, lights): (&[f64], &[Light]),
        diffuse: Option<&MediumLight>,
    ) -> BlobLight {
        let p = facet.position;
        let outgoing = (eye - p).normalize_or(UP);
        let fluence = scatter::fluence(law, p, taus, lights);
        if let Some((light, seen)) = diffuse.and_then(|light| Some((light, light.seen.as_ref()?))) {
            let blob = seen.of_blob(p, facet.sigma, outgoing);
            // Where the mean medium scatters nothing, cells show nothing.
            let all = light.scattered.max(DVec3::splat(f64::MIN_POSITIVE));
            let share = law.albedo * law.depth / all;
            let mean = blob.radiance.element_sum() / 3.0;
            return BlobLight {
                fluence,
                radiance: share * blob.radiance,
                slope: blob.across,
                mean,
            };
        }
        let once = scatter::radiance(law, p, eye, taus, lights, diffuse.is_none());
        let cells = diffuse.map(|light| &light.cells);
        let more = cells.map(|light| light.scattered(law, p, outgoing)).unwrap_or_default();
        let slope = cells.map(|light| light.slope(law, p, outgoing, once)).unwrap_or_default();
        BlobLight { fluence, radiance: once + more, slope, mean: 0.0 }
    }
}
