//! A weather file's particles at any time: from step to step by straight lines where steps are near enough (docs/model.md §15 "Time").

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;

use super::scene_weather::{WeatherKeys, particle};
use super::weather::wrf::{Step, WeatherFile};
use crate::error::Result;
use crate::model::cloud::{LEAST_ASPECT, Particle, mass};
use crate::model::moving::{Mover, Moving};
use crate::model::weather::interval::{Interval, Moment};
use crate::model::weather::particles::Layout;
use crate::model::weather::steps::{Between, LONGEST_INTERPOLATED_S, between};

/// Files of so few steps are read whole, and one layout stands for all of them: nobody jumps from one interval to the next.
const MOST_TOGETHER: usize = 8;
/// Intervals that are kept: the one at hand, and the one before or after.
const MOST_KEPT: usize = 2;
/// How much farther than those that were looked at heights of other steps may reach.
const MORE_HEIGHT: f64 = 1.05;

/// By first and second step.
type Kept = ((usize, usize), Arc<Interval>);

pub struct Steps {
    file: WeatherFile,
    keys: WeatherKeys,
    seed: u32,
    times_s: Vec<f64>,
    /// Of all steps; None of a file of more than a few.
    layout: Option<Layout>,
    bounds: Bounds,
    kept: Mutex<Vec<Kept>>,
}

impl fmt::Debug for Steps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Steps").field("keys", &self.keys).field("seed", &self.seed).finish()
    }
}

/// The particles of `file` from step `keys.i_step` at time 0 on, and their bounds.
pub fn moving(file: WeatherFile, keys: WeatherKeys, seed: u32) -> Result<Moving> {
    moving_by(file, keys, seed, MOST_TOGETHER)
}

fn moving_by(file: WeatherFile, keys: WeatherKeys, seed: u32, most_together: usize) -> Result<Moving> {
    let times_s = file.times_s.clone().unwrap_or_else(|| vec![0.0]);
    let is_small = file.n_steps <= most_together;
    let wanted = if is_small { (0..file.n_steps).collect() } else { vec![keys.i_step, file.n_steps - 1] };
    let read: Vec<Step> = wanted.iter().map(|i| file.step(*i)).collect::<Result<_>>()?;
    let all: Vec<&[f64]> = read.iter().map(|s| s.extinction.as_slice()).collect();
    let layout = is_small.then(|| Layout::new(&read[0].grid, &all, keys.n_particles as usize, seed));
    let (bounds, kept) = (Bounds::of(&read, keys.exaggeration), Mutex::new(vec![]));
    let steps = Steps { file, keys, seed, times_s, layout, bounds, kept };
    let first = steps.at(0.0)?;
    let mean = |of: &dyn Fn(&Particle) -> f64| first.iter().map(of).sum::<f64>() / first.len().max(1) as f64;
    let greatest = |of: &dyn Fn(&Particle) -> f64| first.iter().map(of).fold(0.0, f64::max);
    Ok(Moving {
        n_particles: keys.n_particles,
        low: bounds.low,
        high: bounds.high,
        sigma_max: bounds.sigma,
        sigma_y_max: bounds.sigma_y,
        sigma_mean: mean(&|p| p.sigma),
        aspect_mean: mean(&|p| p.aspect),
        kappa_max: greatest(&|p| p.kappa),
        mass_max: greatest(&|p| mass(p.kappa, p.sigma) * p.aspect),
        mover: Arc::new(steps),
    })
}

/// What all particles keep to at all times.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
    sigma: f64,
    sigma_y: f64,
}

impl Bounds {
    /// Of what was looked at, and some more height for what was not; heights `stretch` times as great.
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
        // A blob is no wider than what is spread evenly over its cell: 1/sqrt 12 of it.
        let even = |size: f64| size / 12f64.sqrt();
        Bounds {
            low: shape * (low - more),
            high: shape * (high + more),
            sigma: even(widest),
            sigma_y: even(MORE_HEIGHT * stretch * thickest),
        }
    }
}

impl Mover for Steps {
    fn at(&self, time_s: f64) -> Result<Arc<Vec<Particle>>> {
        let file_s = self.times_s.get(self.keys.i_step).copied().unwrap_or(0.0) + self.keys.speed * time_s;
        let at = between(&self.times_s, file_s).unwrap_or(Between { i: 0, j: 0, weight: 0.0 });
        // An interval's first moment has the interval's layout, too.
        let follows = at.i + 1 < self.times_s.len()
            && self.times_s[at.i + 1] - self.times_s[at.i] <= LONGEST_INTERPOLATED_S
            && file_s >= self.times_s[at.i];
        let interval = self.of_steps(at.i, if follows { at.i + 1 } else { at.i })?;
        let of = |i: usize| match i < interval.len() {
            true => self.kept_to(particle(&interval.blob(i, at.weight), self.keys.exaggeration)),
            false => self.nothing(),
        };
        Ok(Arc::new((0..self.keys.n_particles as usize).map(of).collect()))
    }
}

impl Steps {
    fn of_steps(&self, i: usize, j: usize) -> Result<Arc<Interval>> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = kept.iter().find(|(of, _)| *of == (i, j)) {
            return Ok(found.clone());
        }
        let read = Arc::new(self.read(i, j)?);
        kept.truncate(MOST_KEPT - 1);
        kept.insert(0, ((i, j), read.clone()));
        Ok(read)
    }

    fn read(&self, i: usize, j: usize) -> Result<Interval> {
        let first = self.file.step(i)?;
        let second = if i == j { None } else { Some(self.file.step(j)?) };
        let (a, b) = (moment(&first), second.as_ref().map(moment));
        let n = self.keys.n_particles as usize;
        Ok(match (&self.layout, b) {
            (Some(layout), b) => Interval::laid_out(layout, a, b),
            (None, Some(b)) => Interval::between(a, b, n, self.seed),
            (None, None) => Interval::alone(a, n, self.seed),
        })
    }

    /// Within the bounds that the scene was told, with its mass.
    fn kept_to(&self, p: Particle) -> Particle {
        let sigma = p.sigma.min(self.bounds.sigma);
        let aspect = p.aspect.min(self.bounds.sigma_y / sigma).max(LEAST_ASPECT);
        let thinner = mass(p.kappa, p.sigma) * p.aspect / (mass(1.0, sigma) * aspect);
        Particle { position: p.position.clamp(self.bounds.low, self.bounds.high), sigma, aspect, kappa: thinner, ..p }
    }

    /// In place of a particle that a layout does not need.
    fn nothing(&self) -> Particle {
        Particle {
            position: 0.5 * (self.bounds.low + self.bounds.high),
            sigma: self.bounds.sigma,
            aspect: 1.0,
            kappa: 0.0,
            color: DVec3::ONE,
        }
    }
}

fn moment(step: &Step) -> Moment<'_> {
    Moment { grid: &step.grid, extinction: &step.extinction }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::io::weather::wrf;

    #[test]
    fn a_file_of_many_steps_is_laid_out_interval_by_interval() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/weather/supercell.nc");
        let keys = WeatherKeys { i_step: 0, n_particles: 2000, exaggeration: 2.0, speed: 60.0 };
        let of = |most_together| moving_by(wrf::open(&path).unwrap(), keys, 3, most_together).unwrap();
        let (many, few) = (of(0), of(MOST_TOGETHER));
        let mass_of = |all: &[Particle]| all.iter().map(|p| mass(p.kappa, p.sigma) * p.aspect).sum::<f64>();
        // Steps of 120 s: at 0, 2 and 4 s.
        for t in [-1.0, 0.0, 0.7, 2.0, 3.1, 4.0, 9.0] {
            let (a, b) = (many.mover.at(t).unwrap(), few.mover.at(t).unwrap());
            assert_eq!((a.len(), b.len()), (2000, 2000));
            assert!((mass_of(&a) / mass_of(&b) - 1.0).abs() < 1e-9, "{t}");
            let within = |p: &Particle| p.position.cmpge(many.low).all() && p.position.cmple(many.high).all();
            assert!(
                a.iter().all(|p| within(p)
                    && p.sigma <= many.sigma_max
                    && p.sigma * p.aspect <= many.sigma_y_max * 1.000001)
            );
        }
        // Within an interval particles stay who they are; from one to the next they may not.
        let [a, b, c] = [0.0, 1.9, 2.0].map(|t| many.mover.at(t).unwrap());
        let apart = |a: &[Particle], b: &[Particle]| {
            a.iter().zip(b).map(|(p, q)| p.position.distance(q.position)).fold(0.0, f64::max)
        };
        assert!(apart(&a, &b) < 200.0 && apart(&b, &c) > 1000.0, "{} {}", apart(&a, &b), apart(&b, &c));
    }
}
