//! Particles of a weather file at any time, interpolated between steps that are near enough
//! (model.md §15 "Time").

use std::f64::consts::SQRT_2;
use std::fmt;
use std::sync::Arc;

use glam::DVec3;

use super::blobs::{Settings, life_s, particle, winds_of};
use super::spans::{MOST_TOGETHER, Spans};
use super::wrf::{Step, WeatherFile};
use crate::error::Result;
use crate::model::animated::{AnimatedParticles, Animation};
use crate::model::cloud::{MIN_ASPECT, Particle, Shape, mass};
use crate::model::weather::particles::{Layout, SPREAD, WeatherBlob};
use crate::model::weather::places::GREATEST_WIDTH;
use crate::model::weather::steps::between;

/// Factor by which heights of steps that were not read may exceed those of the steps that were.
const MORE_HEIGHT: f64 = 1.05;

/// A weather file as the source of a cloud's particles.
pub struct Steps {
    spans: Spans,
    settings: Settings,
    times_s: Vec<f64>,
    bounds: Bounds,
}

impl fmt::Debug for Steps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Steps").field("settings", &self.settings).finish_non_exhaustive()
    }
}

/// Returns the particles of `file`, which is at step `settings.i_step` at time 0, and their bounds.
///
/// # Errors
/// When a step cannot be read.
pub fn moving(file: WeatherFile, settings: Settings, seed: u32) -> Result<AnimatedParticles> {
    moving_by(file, settings, seed, MOST_TOGETHER)
}

fn moving_by(
    file: WeatherFile,
    settings: Settings,
    seed: u32,
    most_together: usize,
) -> Result<AnimatedParticles> {
    let times_s = file.times_s.clone().unwrap_or_else(|| vec![0.0]);
    let is_small = file.n_steps <= most_together;
    let wanted: Vec<usize> = if is_small {
        (0..file.n_steps).collect()
    } else {
        vec![settings.i_step, file.n_steps - 1]
    };
    let read: Vec<Step> = wanted.iter().map(|i| file.step(*i)).collect::<Result<_>>()?;
    let all: Vec<&[f64]> = read.iter().map(|s| s.extinction.as_slice()).collect();
    let layout =
        is_small.then(|| Layout::new(&read[0].grid, &all, settings.n_particles as usize, seed));
    let bounds = Bounds::of(&read, settings.exaggeration);
    let life_s = life_s(&read, &winds_of(&file, &settings, &wanted)?);
    let slots = (settings.n_particles as usize, seed, (settings.detail, life_s));
    let spans = Spans::new(file, times_s.clone(), slots, layout, settings.speed < 0.0);
    let steps = Steps { spans, settings, times_s, bounds };
    let first = steps.at(0.0)?;
    // Clouds may come later: the densest blobs of all steps that were read count.
    let time_of = |i: &usize| (steps.times_s[*i] - steps.times_s[settings.i_step]) / settings.speed;
    let others = wanted.iter().filter(|i| **i != settings.i_step && settings.speed != 0.0);
    let others: Vec<_> = others.map(|i| steps.at(time_of(i))).collect::<Result<_>>()?;
    let mean = |of: &dyn Fn(&Particle) -> f64| {
        first.iter().map(of).sum::<f64>() / first.len().max(1) as f64
    };
    let greatest = |of: &dyn Fn(&Particle) -> f64| {
        let all = std::iter::once(&first).chain(&others);
        all.flat_map(|moment| moment.iter()).map(of).fold(0.0, f64::max)
    };
    Ok(AnimatedParticles {
        n_particles: settings.n_particles,
        low: bounds.low,
        high: bounds.high,
        sigma_max: bounds.sigma,
        sigma_y_max: bounds.sigma_y,
        sigma_mean: mean(&|p| p.sigma),
        aspect_mean: mean(&|p| p.shape.aspect),
        kappa_max: greatest(&|p| p.kappa),
        mass_max: greatest(&|p| mass(p.kappa, p.sigma) * p.shape.aspect),
        animation: Arc::new(steps),
    })
}

/// Bounds of all particles at all times.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
    sigma: f64,
    sigma_y: f64,
}

impl Bounds {
    /// Returns the bounds of some steps, with a margin of height for the others. Heights are
    /// multiplied by `stretch`.
    fn of(steps: &[Step], stretch: f64) -> Bounds {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut widest, mut thickest) = (0f64, 0f64);
        for grid in steps.iter().map(|s| &s.grid) {
            let (ground, n_columns) = (&grid.ground, grid.shape().n_columns());
            for i in 0..grid.shape().n_cells() {
                let k = i % n_columns;
                let (x, z) = (ground.east_m[k], ground.south_m[k]);
                let half = 0.5 * DVec3::new(ground.dx_m[k], 0.0, ground.dy_m[k]);
                low = low.min(DVec3::new(x, grid.bottom_m(i), z) - half);
                high = high.max(DVec3::new(x, grid.top_m(i), z) + half);
                widest = widest.max(2.0 * half.max_element());
                thickest = thickest.max(grid.thickness_m(i));
            }
        }
        let more = DVec3::Y * (MORE_HEIGHT - 1.0) * (high.y - low.y);
        let shape = DVec3::new(1.0, stretch, 1.0);
        // A blob is no higher than a uniform density over its cell, whose σ is 1/√12 of the size,
        // and no wider than a single one among equal cells, or the wider one of two.
        let even = |size: f64| size / 12f64.sqrt();
        Bounds {
            low: shape * (low - more),
            high: shape * (high + more),
            sigma: SPREAD * (GREATEST_WIDTH / SQRT_2).max(1.0) * widest,
            sigma_y: even(MORE_HEIGHT * stretch * thickest),
        }
    }
}

impl Animation for Steps {
    fn at(&self, time_s: f64) -> Result<Arc<Vec<Particle>>> {
        let file_s = self.times_s.get(self.settings.i_step).copied().unwrap_or(0.0)
            + self.settings.speed * time_s;
        let (i, weight) = between(&self.times_s, file_s).unwrap_or((0, 0.0));
        // A span holds its first step; before the first step of the file that step stands still.
        let is_before = file_s < self.times_s.first().copied().unwrap_or(file_s);
        let ends = if is_before { (i, i) } else { self.spans.ends_from(i) };
        let span = self.spans.get(ends)?;
        let Settings { n_particles, exaggeration, speed, .. } = self.settings;
        let blobs = span.blobs(n_particles as usize, weight, speed * time_s);
        let of = |blob: &Option<WeatherBlob>| match blob {
            Some(blob) => self.kept_to(particle(blob, exaggeration)),
            None => self.nothing(),
        };
        Ok(Arc::new(blobs.iter().map(of).collect()))
    }
}

impl Steps {
    /// Clamps a particle to the bounds and keeps its mass.
    fn kept_to(&self, p: Particle) -> Particle {
        let sigma = p.sigma.min(self.bounds.sigma);
        let aspect = p.shape.aspect.min(self.bounds.sigma_y / sigma).max(MIN_ASPECT);
        let thinner = mass(p.kappa, p.sigma) * p.shape.aspect / (mass(1.0, sigma) * aspect);
        Particle {
            position: p.position.clamp(self.bounds.low, self.bounds.high),
            sigma,
            shape: Shape::upright(aspect),
            kappa: thinner,
            ..p
        }
    }

    /// Returns a particle without extinction, for a slot that the layout does not use.
    fn nothing(&self) -> Particle {
        Particle {
            position: 0.5 * (self.bounds.low + self.bounds.high),
            sigma: self.bounds.sigma.min(self.bounds.sigma_y),
            shape: Shape::BALL,
            kappa: 0.0,
            color: DVec3::ONE,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::io::weather::wrf;
    use crate::model::weather::detail::{Detail, Wind};

    /// Two layouts that fade into each other have the mass of one layout, stay in the bounds, and
    /// no visible particle jumps.
    #[test]
    fn layouts_of_a_file_of_many_steps_fade_into_each_other() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/weather/supercell.nc");
        let detail = Detail::NONE;
        let settings =
            Settings { i_step: 0, n_particles: 2001, exaggeration: 2.0, speed: 60.0, detail };
        let of = |most_together| {
            moving_by(wrf::open(&path).unwrap(), settings, 3, most_together).unwrap()
        };
        let (many, few) = (of(0), of(MOST_TOGETHER));
        let mass_of = |all: &[Particle]| {
            all.iter().map(|p| mass(p.kappa, p.sigma) * p.shape.aspect).sum::<f64>()
        };
        // Steps of 120 s: at 0, 2 and 4 s.
        for t in [-1.0, 0.0, 0.7, 2.0, 3.1, 4.0, 9.0] {
            let (a, b) = (many.animation.at(t).unwrap(), few.animation.at(t).unwrap());
            assert_eq!((a.len(), b.len()), (2001, 2001));
            // Between steps a cell's mass is not linear in time, and the cells of the two layouts
            // stand for other mass: by 0.0027 as measured, of which the limit is twice.
            let most = if [0.7, 3.1].contains(&t) { 0.0054 } else { 1e-9 };
            let ratio = mass_of(&a) / mass_of(&b);
            assert!((ratio - 1.0).abs() < most, "{t}: {ratio}");
            let within = |p: &Particle| {
                p.position.cmpge(many.low).all() && p.position.cmple(many.high).all()
            };
            assert!(a.iter().all(|p| within(p)
                && p.sigma <= many.sigma_max
                && p.sigma * p.shape.aspect <= many.sigma_y_max * 1.000001));
        }
        // A particle that jumps has no mass at that moment.
        for (t, is_all) in [(0.5, false), (2.0, false), (4.0, true)] {
            let [a, b] = [t - 1e-6, t + 1e-6].map(|t| many.animation.at(t).unwrap());
            let whole = mass_of(&a);
            for (p, q) in a.iter().zip(b.iter()) {
                let of = |p: &Particle| mass(p.kappa, p.sigma) * p.shape.aspect;
                let changed = if p.position.distance(q.position) > 1.0 {
                    of(p).max(of(q))
                } else {
                    (of(p) - of(q)).abs()
                };
                assert!(changed < 1e-4 * whole / 2001.0, "{t}: {p:?} {q:?}");
            }
            // Both halves are visible between steps, one half at a step.
            let n_seen = a.iter().filter(|p| p.kappa > 0.0).count();
            assert!(n_seen > 500, "{t}: {n_seen}");
            assert!(is_all || n_seen > 1000, "{t}: {n_seen}");
        }
        // Particles do not depend on the order in which times are asked for.
        let (c, d) = (of(0), of(0));
        let [late, early] = [3.0, 1.0].map(|t| c.animation.at(t).unwrap());
        assert!(d.animation.at(1.0).unwrap() == early && d.animation.at(3.0).unwrap() == late);
        assert!(many.animation.at(3.0).unwrap() == late);
    }

    /// Detail in the winds of the file goes on without a step, forward and backward, with one
    /// layout and with several. It does not depend on the order in which times are asked for.
    #[test]
    fn winds_carry_detail_in_both_directions() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/weather/supercell.nc");
        let detail = Detail { strength: 1.0, wind: Wind::OfFile, seed: 5 };
        for (i_step, speed) in [(0, 60.0), (2, -60.0)] {
            let settings = Settings { i_step, n_particles: 2001, exaggeration: 2.0, speed, detail };
            for most_together in [0, MOST_TOGETHER] {
                let of =
                    || moving_by(wrf::open(&path).unwrap(), settings, 3, most_together).unwrap();
                let (one, other) = (of(), of());
                let [late, early] = [3.1, 0.9].map(|t| one.animation.at(t).unwrap());
                assert!(other.animation.at(0.9).unwrap() == early);
                assert!(other.animation.at(3.1).unwrap() == late);
                let soon = one.animation.at(0.9 + 1e-4).unwrap();
                let moved = |a: &[Particle], b: &[Particle]| {
                    let seen = a.iter().zip(b).filter(|(p, q)| p.kappa.min(q.kappa) > 0.0);
                    let all: Vec<f64> =
                        seen.map(|(p, q)| p.position.distance(q.position)).collect();
                    all.iter().sum::<f64>() / all.len() as f64
                };
                // 6 ms of the file, and 132 s.
                assert!(moved(&early, &soon) < 2.0, "{speed} {most_together}");
                assert!(moved(&early, &late) > 50.0, "{speed} {most_together}");
            }
        }
    }
}
