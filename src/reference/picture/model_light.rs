//! Light by the model itself, at any point and without what nimbus makes it cheap by: transmittance
//! in closed form, normals from the blobs' own density, a facet a particle, areas integrated, the
//! BRDF itself, and as many reflections as asked for.

use std::ops::{Add, Mul};

use glam::DVec3;

use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::scene::{LightingMode, Scene};
use crate::model::surface::Surface;
use crate::reference::area::adaptive::Accuracy;
use crate::reference::area::paths::PathSampling;
use crate::reference::area::{AreaScene, DiscFacet, Receiver};
use crate::reference::facets::{self, Facet};
use crate::reference::picture::stages::{FrameReference, ground};
use crate::reference::place;

/// What a scene's light meets at one time, relative to the lighting origin.
pub struct Met {
    pub surfaces: Vec<Surface>,
    brdfs: Vec<Brdf>,
    lights: Vec<Light>,
    /// The ground's, then the particles'.
    discs: Vec<DiscFacet>,
    n_ground: usize,
    eye: DVec3,
}

/// A radiance toward the eye, and what it may be off in its greatest channel: an estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lit {
    pub radiance: DVec3,
    pub doubt: Doubt,
}

/// What a value may be off, by where that comes from: estimates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Doubt {
    /// Of integrals. It is there however often they are done.
    pub quadrature: f64,
    /// One standard error of random paths. It falls where several samples are averaged.
    pub chance: f64,
}

impl Doubt {
    pub fn sum(self) -> f64 {
        self.quadrature + self.chance
    }

    /// Root mean square of each.
    pub fn mean(all: impl Iterator<Item = Doubt> + Clone) -> Doubt {
        Doubt {
            quadrature: root_mean_square(all.clone().map(|doubt| doubt.quadrature)),
            chance: root_mean_square(all.map(|doubt| doubt.chance)),
        }
    }
}

impl Add for Doubt {
    type Output = Doubt;

    fn add(self, other: Doubt) -> Doubt {
        Doubt { quadrature: self.quadrature + other.quadrature, chance: self.chance + other.chance }
    }
}

impl Mul<f64> for Doubt {
    type Output = Doubt;

    fn mul(self, share: f64) -> Doubt {
        Doubt { quadrature: share * self.quadrature, chance: share * self.chance }
    }
}

/// 0 of nothing.
pub(crate) fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0u64, 0.0), |(n, sum), v| (n + 1, sum + v * v));
    if n == 0 { 0.0 } else { (sum / n as f64).sqrt() }
}

/// How exactly the second reflection is integrated: of a light that is a tenth of all a tenth of a
/// thousandth is left, far below what pictures are off by.
const SECOND_ACCURACY: f64 = 1e-3;
/// Random paths of a receiver, for what comes after the second reflection: so many at once,
const N_PATHS: u32 = 128;
/// as often as should make their standard error this share of what the first two reflections bring,
const PATHS_ACCURACY: f64 = 2e-3;
/// within these bounds.
const LEAST_BATCHES: u32 = 2;
const N_BATCHES: u32 = 16;

impl Met {
    /// Of `scene`, whose particles are where `truth` has them.
    pub fn of(scene: &Scene, truth: &FrameReference) -> Met {
        let (origin, time_s) = (truth.setting.light_origin, truth.setting.time_s);
        let regions = place::regions(&truth.groups);
        let centers = place::cloud_centers(&scene.clouds, time_s, origin);
        let scales = place::sigma_means(&truth.groups, &scene.clouds, time_s);
        let facets = facets::closed(&truth.blobs, &scales, &regions, &centers);
        let n_surfaces = scene.surfaces.len();
        let kd = |region: u32| scene.region_material(region as usize).at(time_s).kd;
        let ground = ground(scene, origin);
        let of_particles =
            facets.into_iter().map(|f| Facet { region: f.region + scene.n_solids() as u32, ..f });
        let n_ground = ground.len();
        let colors = std::iter::repeat_n(DVec3::ONE, n_ground).chain(truth.colors.iter().copied());
        let disc = |(f, color): (Facet, DVec3)| DiscFacet {
            position: f.position,
            normal: f.normal,
            area: f.area,
            kd: kd(f.region) * color,
        };
        Met {
            surfaces: scene
                .surfaces
                .iter()
                .map(|s| Surface { center: s.center - origin, ..*s })
                .collect(),
            brdfs: (0..n_surfaces).map(|i| scene.region_material(i).at(time_s)).collect(),
            lights: scene.lights.iter().map(|l| l.relative_to(origin)).collect(),
            discs: ground.into_iter().chain(of_particles).zip(colors).map(disc).collect(),
            n_ground,
            eye: truth.setting.pose.position - origin,
        }
    }

    /// Those of the ground and of the particles.
    pub fn n_discs(&self) -> usize {
        self.discs.len()
    }

    /// Those of the ground, which come first.
    pub fn n_ground(&self) -> usize {
        self.n_ground
    }
}

/// The light of a scene toward the eye.
pub struct ModelLight<'a> {
    scenery: AreaScene<'a>,
    eye: DVec3,
    n_reflections: u32,
}

impl<'a> ModelLight<'a> {
    /// `n_reflections`, where they are others than those of the scene.
    pub fn new(
        scene: &Scene,
        met: &'a Met,
        truth: &'a FrameReference,
        n_reflections: Option<u32>,
    ) -> ModelLight<'a> {
        let forward = scene.lighting.forward;
        let scenery = AreaScene::new(
            &met.surfaces,
            &met.brdfs,
            &met.lights,
            &truth.blobs,
            forward,
            &met.discs,
        );
        ModelLight {
            scenery,
            eye: met.eye,
            n_reflections: n_reflections.unwrap_or(reflections_of(scene)),
        }
    }

    /// Whether it has random paths in it, and so differs from sample to sample.
    pub fn is_random(&self) -> bool {
        self.n_reflections >= 3
    }

    /// Of disc `i`, in one of several samples.
    pub fn of_disc(&self, i: usize, i_sample: u32) -> Lit {
        self.of(&self.scenery.on_disc(i), [i as u32, i_sample])
    }

    /// At a point of a surface's front; `i` tells its random numbers from others'.
    pub fn of_surface(&self, i_surface: usize, position: DVec3, i: usize, i_sample: u32) -> Lit {
        self.of(&self.scenery.on_surface(i_surface, position), [i as u32, i_sample])
    }

    fn of(&self, at: &Receiver, number: [u32; 2]) -> Lit {
        let toward = (self.eye - at.position).normalize_or(at.normal);
        let mut lit = Lit { radiance: self.scenery.first(at, toward), doubt: Doubt::default() };
        if self.n_reflections >= 2 {
            let second = self.scenery.second(at, toward, &Accuracy::relative(SECOND_ACCURACY));
            lit.radiance += second.radiance;
            lit.doubt.quadrature += second.error;
        }
        if self.is_random() {
            let (radiance, error) =
                self.further(at, toward, number, PATHS_ACCURACY * lit.radiance.abs().max_element());
            lit.radiance += radiance;
            lit.doubt.chance += error;
        }
        lit
    }

    /// What comes after the second reflection, by random paths, to about `accuracy`, and its
    /// standard error. A first batch says how many are needed and counts for nothing else: who
    /// stops where chance has looked best so far is off to that side.
    fn further(
        &self,
        at: &Receiver,
        toward: DVec3,
        [i, i_sample]: [u32; 2],
        accuracy: f64,
    ) -> (DVec3, f64) {
        let k = self.n_reflections as usize;
        let batch = |i_batch: u32| {
            let seed = i.wrapping_mul(N_BATCHES + 1).wrapping_add(i_batch);
            let all = self.scenery.reflections(
                at,
                toward,
                k,
                PathSampling { n_paths: N_PATHS, seed, i_sample },
            );
            let radiance = all[2..k].iter().map(|r| r.radiance).sum::<DVec3>();
            // Of the same paths: errors of one reflection and the next may add up.
            (radiance, all[2..k].iter().map(|r| r.error.max_element()).sum::<f64>())
        };
        let (_, pilot) = batch(0);
        let n = match pilot > 0.0 && accuracy > 0.0 {
            true => (pilot / accuracy)
                .powi(2)
                .ceil()
                .clamp(f64::from(LEAST_BATCHES), f64::from(N_BATCHES)) as u32,
            // It met no light, or the same everywhere.
            false => N_BATCHES,
        };
        let (sum, squares) =
            (1..=n).map(batch).fold((DVec3::ZERO, 0.0), |(sum, squares), found| {
                (sum + found.0, squares + found.1 * found.1)
            });
        (sum / f64::from(n), squares.sqrt() / f64::from(n))
    }
}

/// How many reflections a scene asks for.
pub fn reflections_of(scene: &Scene) -> u32 {
    match scene.lighting.mode {
        LightingMode::None => 0,
        LightingMode::First => 1,
        LightingMode::TwoReflection => 2,
    }
}
