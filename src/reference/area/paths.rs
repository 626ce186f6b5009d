//! Any number of reflections by random paths, with standard errors. For the second reflection it is
//! an estimate that shares no quadrature with `AreaScene::second`.
//!
//! Each path starts at the receiver, continues as its BRDF reflects or to one of the discs, and
//! collects L1 at every vertex. V is tested point by point.

use glam::DVec3;

use super::scene::{AreaScene, Receiver};
use super::visibility::met;
use crate::model::parallel::parallel_map;
use crate::model::philox::{philox4x32_10, uniform};
use crate::reference::brdf::{density, direction, reflectance};
use crate::reference::occlude::{Rectangle, Source};

/// Second word of the Philox key: paths share no random numbers with particles.
const KEY: u32 = 0x7061_7468;
/// Number of paths of a job. Jobs run in parallel.
const PATHS_A_JOB: u32 = 1024;

/// Radiance of one number of reflections toward the eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflected {
    /// Mean radiance, W m⁻² sr⁻¹.
    pub radiance: DVec3,
    /// One standard error of the mean, every channel; 0 for the first reflection, which is not
    /// sampled. It comes from the same paths, so it is too small if few of them met the light, and
    /// 0 if none did. Where it is below a tenth of the radiance, which takes a hundred paths that
    /// meet the light, errors are normally distributed with it (`tests/area.rs`).
    pub error: DVec3,
}

/// Number and random numbers of the paths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathSampling {
    /// Number of paths.
    pub n_paths: u32,
    /// Seed.
    pub seed: u32,
    /// Number of the sample; samples share no random numbers.
    pub i_sample: u32,
}

/// Sums of one job: of every reflection beyond the first, and last of all of them together.
type Sums = Vec<(DVec3, DVec3)>;

impl AreaScene<'_> {
    /// Returns the radiance toward the unit vector `toward` after exactly 1, 2, … `k` reflections,
    /// and last of all together.
    pub fn reflections(
        &self,
        at: &Receiver,
        toward: DVec3,
        k: usize,
        sampling: PathSampling,
    ) -> Vec<Reflected> {
        let first = Reflected { radiance: self.first(at, toward), error: DVec3::ZERO };
        let n_more = k.saturating_sub(1);
        let n_jobs = sampling.n_paths.div_ceil(PATHS_A_JOB);
        let job = |i: usize| {
            let i = i as u32;
            let paths = i * PATHS_A_JOB..sampling.n_paths.min((i + 1) * PATHS_A_JOB);
            let mut sums = vec![(DVec3::ZERO, DVec3::ZERO); n_more + 1];
            for i_path in paths {
                let mut all = DVec3::ZERO;
                let found = self.path(at, toward, n_more, (sampling, i_path));
                for (sum, l) in sums.iter_mut().zip(found) {
                    *sum = (sum.0 + l, sum.1 + l * l);
                    all += l;
                }
                sums[n_more] = (sums[n_more].0 + all, sums[n_more].1 + all * all);
            }
            sums
        };
        let sums = parallel_map(n_jobs as usize, job).into_iter().reduce(add).unwrap_or_default();
        let n = f64::from(sampling.n_paths);
        let of = |(sum, squares): (DVec3, DVec3)| {
            let radiance = sum / n;
            let variance =
                (squares / n - radiance * radiance).max(DVec3::ZERO) / (n - 1.0).max(1.0);
            Reflected { radiance, error: variance.powf(0.5) }
        };
        let mut all: Vec<Reflected> =
            std::iter::once(first).chain(sums.into_iter().map(of)).collect();
        // The last sum is that of all reflections beyond the first; without paths there is none.
        all.resize(k.max(1) + 1, Reflected { radiance: DVec3::ZERO, error: DVec3::ZERO });
        all[k.max(1)].radiance += first.radiance;
        all
    }

    /// Returns the light that one path collects at its vertices: the second reflection, the third,
    /// …
    fn path(
        &self,
        at: &Receiver,
        toward: DVec3,
        n_more: usize,
        (sampling, i_path): (PathSampling, u32),
    ) -> Vec<DVec3> {
        let (mut at, mut toward, mut weight) = (*at, toward, DVec3::ONE);
        let mut found = vec![DVec3::ZERO; n_more];
        for (i, l) in found.iter_mut().enumerate() {
            let draw = |turn: u32| {
                philox4x32_10([sampling.seed, KEY], [i_path, i as u32, turn, sampling.i_sample])
                    .map(uniform)
            };
            let Some((next, direction, w)) = self.step(&at, toward, draw(0), draw(1)) else {
                break;
            };
            weight *= w;
            *l = weight * self.first(&next, -direction);
            (at, toward) = (next, -direction);
        }
        found
    }

    /// Returns the next vertex, the direction to it, and f cos θ V over the probability.
    fn step(
        &self,
        at: &Receiver,
        toward: DVec3,
        u: [f64; 4],
        more: [f64; 4],
    ) -> Option<(Receiver, DVec3, DVec3)> {
        let to_discs = match (self.discs.is_empty(), self.rectangles.is_empty()) {
            (true, _) => 0.0,
            (false, true) => 1.0,
            (false, false) => 0.5,
        };
        if more[0] < to_discs {
            return self.step_to_disc(at, toward, more[1], to_discs);
        }
        let direction = direction(&at.brdf, at.normal, toward, u);
        let cosine = at.normal.dot(direction);
        if cosine <= 0.0 {
            return None;
        }
        let (i, t) = nearest(&self.rectangles, at.position, direction)?;
        if self.rectangles[i].normal.dot(direction) >= 0.0 {
            return None;
        }
        let position = at.position + t * direction;
        let v = self.transmittance(at.position, Source::At(position)) / (1.0 - to_discs);
        let density = density(&at.brdf, at.normal, toward, direction);
        let w = reflectance(&at.brdf, at.normal, direction, toward) * (v * cosine / density);
        Some((self.on_surface(i, position), direction, w))
    }

    /// Returns the next vertex on one of the discs. Discs are drawn by the light each would send if
    /// all had one radiance and nothing lay between. Discs were chosen with probability `chosen`.
    fn step_to_disc(
        &self,
        at: &Receiver,
        toward: DVec3,
        u: f64,
        chosen: f64,
    ) -> Option<(Receiver, DVec3, DVec3)> {
        let pairs: Vec<f64> = (0..self.discs.len())
            .map(|i| if at.i_disc == Some(i) { 0.0 } else { self.disc_form_factor(i, at) })
            .collect();
        let sum: f64 = pairs.iter().sum();
        let mut left = u * sum;
        let drawn = pairs.iter().position(|pair| {
            left -= pair;
            left < 0.0
        });
        // No disc counts before the last, or rounding led past it.
        let i = drawn.or_else(|| pairs.iter().rposition(|pair| *pair > 0.0))?;
        let (e, direction) = self.disc_light(i, at, DVec3::splat(sum / (pairs[i] * chosen)));
        let w = e * reflectance(&at.brdf, at.normal, direction, toward);
        (w != DVec3::ZERO).then(|| (self.on_disc(i), direction, w))
    }
}

fn add(a: Sums, b: Sums) -> Sums {
    a.into_iter().zip(b).map(|((s, q), (t, r))| (s + t, q + r)).collect()
}

fn nearest(rectangles: &[Rectangle], p: DVec3, direction: DVec3) -> Option<(usize, f64)> {
    let hit = |(i, r): (usize, &Rectangle)| met(r, p, Source::Toward(direction)).map(|t| (i, t));
    rectangles.iter().enumerate().filter_map(hit).min_by(|a, b| a.1.total_cmp(&b.1))
}
