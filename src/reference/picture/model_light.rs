//! Light by the model itself at any point, without the approximations that make it cheap.
//!
//! Transmittance has its closed form, normals come from the blobs' own density, every particle has
//! a facet, areas are integrated, and the BRDF is used itself. Any number of reflections counts.

use glam::DVec3;

use super::error_estimate::ErrorEstimate;
use super::frame::FrameReference;
use super::local_scene::LocalScene;
use crate::model::scene::Scene;
use crate::reference::area::adaptive::Accuracy;
use crate::reference::area::paths::PathSampling;
use crate::reference::area::{AreaScene, DiscFacet, Receiver};
use crate::reference::facets::{self, Facet};

/// Everything that a scene's light meets at one time, relative to the lighting origin.
pub(super) struct ModelScene {
    /// Surfaces, lights and materials.
    pub local: LocalScene,
    /// Facets of the ground, then of the particles.
    pub discs: Vec<DiscFacet>,
    eye: DVec3,
}

/// Radiance toward the eye, W m⁻² sr⁻¹, with its error estimate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct RadianceEstimate {
    /// Radiance.
    pub radiance: DVec3,
    /// Error estimate.
    pub error: ErrorEstimate,
}

/// Relative accuracy of the second reflection: where that is a tenth of all light, 10⁻⁴ of it is
/// left, far below the pictures' errors.
const SECOND_ACCURACY: f64 = 1e-3;
/// Random paths of a receiver in one batch, for the reflections after the second.
const N_PATHS: u32 = 128;
/// Standard error that the number of batches aims at, as a share of the first two reflections.
const PATHS_ACCURACY: f64 = 2e-3;
/// Least and greatest number of batches.
const N_BATCHES: (u32, u32) = (2, 16);

impl ModelScene {
    /// Collects surfaces, ground and one facet for every particle of `frame`.
    pub fn new(scene: &Scene, frame: &FrameReference) -> ModelScene {
        let origin = frame.state.light_origin;
        let local = LocalScene::new(scene, origin, frame.state.time_s);
        let n_solids = scene.n_solids() as u32;
        let of_particles = frame.with_sources(scene, facets::from_density).into_iter();
        let of_particles = of_particles
            .zip(&frame.colors)
            .map(|(f, color)| local.disc(&Facet { region: f.region + n_solids, ..f }, *color));
        let of_ground = local.ground.iter().zip(&local.ground_colors);
        let of_ground = of_ground.map(|(f, color)| local.disc(f, *color));
        let discs = of_ground.chain(of_particles).collect();
        ModelScene { discs, eye: frame.state.pose.position - origin, local }
    }
}

/// The light of a scene toward the eye.
pub(super) struct ModelLight<'a> {
    /// Surfaces and facets, lit.
    pub area_scene: AreaScene<'a>,
    eye: DVec3,
    n_reflections: u32,
}

impl<'a> ModelLight<'a> {
    /// Prepares the light of `frame` with that number of reflections.
    pub fn new(
        scene: &Scene,
        model: &'a ModelScene,
        frame: &'a FrameReference,
        n_reflections: u32,
    ) -> ModelLight<'a> {
        let area_scene = AreaScene::new(
            &model.local.surfaces,
            model.local.surface_brdfs(),
            &model.local.lights,
            &frame.blobs,
            scene.lighting.forward,
            &model.discs,
        )
        .behind_ground(model.local.relief.as_ref(), model.local.ground.len());
        ModelLight { area_scene, eye: model.eye, n_reflections }
    }

    /// Returns whether random paths contribute, so that samples differ.
    pub fn is_random(&self) -> bool {
        self.n_reflections >= 3
    }

    /// Returns the radiance of a point toward the eye. `number`, of the point and of the sample,
    /// selects the random paths.
    pub fn toward_eye(&self, at: &Receiver, number: [u32; 2]) -> RadianceEstimate {
        let toward = (self.eye - at.position).normalize_or(at.normal);
        let radiance = self.area_scene.first(at, toward);
        let mut lit = RadianceEstimate { radiance, ..RadianceEstimate::default() };
        if self.n_reflections >= 2 {
            let second = self.area_scene.second(at, toward, &Accuracy::relative(SECOND_ACCURACY));
            lit.radiance += second.radiance;
            lit.error.quadrature += second.error;
        }
        if self.is_random() {
            let (radiance, error) =
                self.further(at, toward, number, PATHS_ACCURACY * lit.radiance.abs().max_element());
            lit.radiance += radiance;
            lit.error.chance += error;
        }
        lit
    }

    /// Returns the light after the second reflection by random paths, to about `accuracy`, and its
    /// standard error. The first batch only decides how many batches follow: stopping where the
    /// running error happens to look small would bias the estimate.
    fn further(
        &self,
        at: &Receiver,
        toward: DVec3,
        [i, i_sample]: [u32; 2],
        accuracy: f64,
    ) -> (DVec3, f64) {
        let k = self.n_reflections as usize;
        let batch = |i_batch: u32| {
            let seed = i.wrapping_mul(N_BATCHES.1 + 1).wrapping_add(i_batch);
            let sampling = PathSampling { n_paths: N_PATHS, seed, i_sample };
            let all = self.area_scene.reflections(at, toward, k, sampling);
            let radiance = all[2..k].iter().map(|r| r.radiance).sum::<DVec3>();
            // The reflections share their paths, so their errors may add up.
            (radiance, all[2..k].iter().map(|r| r.error.max_element()).sum::<f64>())
        };
        let (_, pilot) = batch(0);
        let n = if pilot > 0.0 && accuracy > 0.0 {
            let (least, most) = (f64::from(N_BATCHES.0), f64::from(N_BATCHES.1));
            (pilot / accuracy).powi(2).ceil().clamp(least, most) as u32
        } else {
            // The pilot met no light, or the same light everywhere.
            N_BATCHES.1
        };
        let (sum, squares) =
            (1..=n).map(batch).fold((DVec3::ZERO, 0.0), |(sum, squares), found| {
                (sum + found.0, squares + found.1 * found.1)
            });
        (sum / f64::from(n), squares.sqrt() / f64::from(n))
    }
}
