//! A list of particles, with bounds and means over all of them.

use std::ops::Deref;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::harmonics::Harmonics;
use super::parallel::parallel_map;
use super::particle::{Particle, mass};

/// Particles of a list. Copies share them.
#[derive(Debug, Clone, Default)]
pub struct ParticleList(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    particles: Vec<Particle>,
    harmonics: Option<Harmonics>,
    /// Of millions of particles it takes longer than a frame, so that it is made once.
    summary: OnceLock<Summary>,
}

/// Bounds and means over all particles of a list. Without particles, sizes are 0 and aspects 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Least coordinates of the centres.
    pub low: DVec3,
    /// Greatest coordinates of the centres.
    pub high: DVec3,
    /// Mean of the centres.
    pub center: DVec3,
    /// Greatest σ along x and z.
    pub sigma_max: f64,
    /// Greatest σ along y.
    pub sigma_y_max: f64,
    /// Mean σ along x and z.
    pub sigma_mean: f64,
    /// The same, weighted by σ².
    pub sigma_by_area: f64,
    /// Least, mean and greatest aspect: σ along y over σ along x and z. Of turned ellipsoids, the
    /// least counts as that of the shortest axis over σ.
    pub aspects: [f64; 3],
    /// Greatest σ in any direction of the ellipsoids that are not upright; 0 without any.
    pub turned_max: f64,
    /// Greatest κ.
    pub kappa_max: f64,
    /// Greatest integral of extinction of a particle.
    pub mass_max: f64,
    /// The last particle that has it.
    pub i_heaviest: usize,
    /// Whether every particle's colour is a grey.
    pub is_grey: bool,
}

/// Particles whose sums one thread takes. The parts are the same whatever the number of threads,
/// and so are the rounded sums.
const PART: usize = 1 << 16;

/// Bounds and sums over a run of particles of a list.
#[derive(Debug, Clone, Copy)]
struct Sums {
    low: DVec3,
    high: DVec3,
    position: DVec3,
    sigma_max: f64,
    sigma_y_max: f64,
    /// Sums of σ, σ² and σ³.
    sigma_powers: DVec3,
    /// Least aspect, sum, and greatest.
    aspects: [f64; 3],
    turned_max: f64,
    kappa_max: f64,
    /// The greatest mass, and the last particle that has it.
    heaviest: (f64, usize),
    is_grey: bool,
}

impl Sums {
    const NONE: Sums = Sums {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
        position: DVec3::ZERO,
        sigma_max: 0.0,
        sigma_y_max: 0.0,
        sigma_powers: DVec3::ZERO,
        aspects: [f64::INFINITY, 0.0, 0.0],
        turned_max: 0.0,
        kappa_max: 0.0,
        heaviest: (0.0, 0),
        is_grey: true,
    };

    /// Returns those of particle `i` alone.
    fn of(p: &Particle, i: usize) -> Sums {
        let extents = p.shape.extents();
        let aspect = p.shape.aspect_upright_of(extents);
        let (least, turned) = match p.shape.is_upright() {
            true => (aspect, 0.0),
            false => (p.shape.narrowest(), p.sigma * p.shape.widest()),
        };
        Sums {
            low: p.position,
            high: p.position,
            position: p.position,
            sigma_max: p.sigma * extents.x.max(extents.z),
            sigma_y_max: p.sigma * extents.y,
            sigma_powers: DVec3::new(p.sigma, p.sigma.powi(2), p.sigma.powi(3)),
            aspects: [least, aspect, aspect],
            turned_max: turned,
            kappa_max: p.kappa,
            heaviest: (mass(p.kappa, p.sigma) * p.shape.volume(), i),
            is_grey: p.color.x == p.color.y && p.color.y == p.color.z,
        }
    }

    /// Adds those of particles that follow.
    fn and(self, next: Sums) -> Sums {
        let [least, sum, greatest] = self.aspects;
        let [next_least, next_sum, next_greatest] = next.aspects;
        Sums {
            low: self.low.min(next.low),
            high: self.high.max(next.high),
            position: self.position + next.position,
            sigma_max: self.sigma_max.max(next.sigma_max),
            sigma_y_max: self.sigma_y_max.max(next.sigma_y_max),
            sigma_powers: self.sigma_powers + next.sigma_powers,
            aspects: [least.min(next_least), sum + next_sum, greatest.max(next_greatest)],
            turned_max: self.turned_max.max(next.turned_max),
            kappa_max: self.kappa_max.max(next.kappa_max),
            heaviest: if next.heaviest.0 >= self.heaviest.0 {
                next.heaviest
            } else {
                self.heaviest
            },
            is_grey: self.is_grey && next.is_grey,
        }
    }
}

impl Summary {
    fn of(list: &[Particle]) -> Summary {
        let part = |i: usize| {
            let first = i * PART;
            let part = &list[first..list.len().min(first + PART)];
            (first..).zip(part).fold(Sums::NONE, |sums, (i, p)| sums.and(Sums::of(p, i)))
        };
        let parts = parallel_map(list.len().div_ceil(PART), part);
        let sums = parts.into_iter().fold(Sums::NONE, Sums::and);
        let n = list.len() as f64;
        let is_empty = list.is_empty();
        let [one, two, three] = sums.sigma_powers.to_array();
        let [least, aspects, greatest] = sums.aspects;
        let or_zero = |v: DVec3| if is_empty { DVec3::ZERO } else { v };
        Summary {
            low: or_zero(sums.low),
            high: or_zero(sums.high),
            center: or_zero(sums.position / n),
            sigma_max: sums.sigma_max,
            sigma_y_max: sums.sigma_y_max,
            sigma_mean: one / n.max(1.0),
            sigma_by_area: if two > 0.0 { three / two } else { 0.0 },
            // If all aspects are equal, so is their mean, whatever their sum rounds to.
            aspects: match is_empty {
                true => [1.0; 3],
                false => [least, (aspects / n).clamp(least, greatest), greatest],
            },
            kappa_max: sums.kappa_max,
            mass_max: sums.heaviest.0,
            i_heaviest: sums.heaviest.1,
            is_grey: sums.is_grey,
            turned_max: sums.turned_max,
        }
    }
}

impl ParticleList {
    /// Returns a list whose colours change with the direction of view as `harmonics` says, which
    /// has coefficients for each of the particles.
    pub fn with_harmonics(particles: Vec<Particle>, harmonics: Option<Harmonics>) -> ParticleList {
        ParticleList(Arc::new(Shared { particles, harmonics, summary: OnceLock::new() }))
    }

    /// Returns how the colours change with the direction of view; `None` if they do not.
    pub fn harmonics(&self) -> Option<&Harmonics> {
        self.0.harmonics.as_ref()
    }

    /// Returns bounds and means over all particles.
    pub fn summary(&self) -> &Summary {
        self.0.summary.get_or_init(|| Summary::of(&self.0.particles))
    }
}

impl Deref for ParticleList {
    type Target = [Particle];

    fn deref(&self) -> &[Particle] {
        &self.0.particles
    }
}

impl From<Vec<Particle>> for ParticleList {
    fn from(particles: Vec<Particle>) -> ParticleList {
        ParticleList::with_harmonics(particles, None)
    }
}

impl FromIterator<Particle> for ParticleList {
    fn from_iter<I: IntoIterator<Item = Particle>>(particles: I) -> ParticleList {
        Vec::from_iter(particles).into()
    }
}

impl PartialEq for ParticleList {
    fn eq(&self, other: &ParticleList) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
            || (&self.0.particles, &self.0.harmonics) == (&other.0.particles, &other.0.harmonics)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::shape::Shape;

    fn blob(x: f64, sigma: f64, aspect: f64) -> Particle {
        let position = DVec3::new(x, -x, 1.0);
        Particle {
            position,
            sigma,
            shape: Shape::upright(aspect),
            kappa: 2.0 / sigma,
            color: DVec3::ONE,
        }
    }

    #[test]
    fn a_summary_by_hand() {
        let list = ParticleList::from(vec![blob(1.0, 1.0, 1.0), blob(3.0, 2.0, 0.25)]);
        let of = list.summary();
        assert_eq!((of.low, of.high), (DVec3::new(1.0, -3.0, 1.0), DVec3::new(3.0, -1.0, 1.0)));
        assert_eq!(of.center, DVec3::new(2.0, -2.0, 1.0));
        assert_eq!((of.sigma_max, of.sigma_y_max, of.sigma_mean), (2.0, 1.0, 1.5));
        assert_eq!((of.sigma_by_area, of.aspects), (9.0 / 5.0, [0.25, 0.625, 1.0]));
        // κ σ² σ_y: 2 and 1 · 4 · 0.5, so that the last one counts.
        assert_eq!((of.kappa_max, of.i_heaviest, of.is_grey), (2.0, 1, true));
        assert_eq!(of.mass_max, mass(2.0, 1.0));
        assert!(std::ptr::eq(of, list.clone().summary()), "copies share it");
        let colored = Particle { color: DVec3::X, ..blob(0.0, 1.0, 1.0) };
        assert!(!ParticleList::from(vec![colored]).summary().is_grey);
    }

    /// Three parts: the sums are those of all particles, and the last of equals is the heaviest.
    #[test]
    fn a_summary_of_several_parts() {
        let n = 2 * PART + 3;
        let list: ParticleList = (0..n).map(|i| blob(i as f64, 1.0, 1.0)).collect();
        let of = list.summary();
        let last = (n - 1) as f64;
        assert_eq!((of.low, of.high), (DVec3::new(0.0, -last, 1.0), DVec3::new(last, 0.0, 1.0)));
        assert_eq!(of.center, DVec3::new(0.5 * last, -0.5 * last, 1.0));
        assert_eq!((of.sigma_mean, of.sigma_by_area, of.aspects), (1.0, 1.0, [1.0; 3]));
        assert_eq!((of.i_heaviest, of.is_grey), (n - 1, true));
        let mut particles = list.to_vec();
        particles[PART + 1].kappa = 7.0;
        particles[PART].color = DVec3::X;
        let of = *ParticleList::from(particles).summary();
        assert_eq!((of.i_heaviest, of.kappa_max, of.is_grey), (PART + 1, 7.0, false));
    }

    #[test]
    fn no_particles_have_no_size() {
        let none = ParticleList::default();
        let of = none.summary();
        assert_eq!(
            (of.low, of.center, of.sigma_mean, of.mass_max),
            (DVec3::ZERO, DVec3::ZERO, 0.0, 0.0)
        );
        assert_eq!(of.aspects, [1.0; 3]);
    }
}
