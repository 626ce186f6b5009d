//! A list of particles, with bounds and means over all of them.

use std::ops::Deref;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::particle::{Particle, mass};

/// Particles of a list. Copies share them.
#[derive(Debug, Clone, Default)]
pub struct ParticleList(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    particles: Vec<Particle>,
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

impl Summary {
    fn of(list: &[Particle]) -> Summary {
        let all = DVec3::splat(f64::INFINITY);
        let (mut low, mut high, mut center) = (all, -all, DVec3::ZERO);
        let (mut sigma_max, mut sigma_y_max, mut sums) = (0.0_f64, 0.0_f64, [0.0; 3]);
        let (mut least, mut aspects, mut greatest) = (f64::INFINITY, 0.0, 0.0_f64);
        let (mut kappa_max, mut mass_max, mut i_heaviest) = (0.0_f64, 0.0_f64, 0);
        let (mut is_grey, mut turned_max) = (true, 0.0_f64);
        for (i, p) in list.iter().enumerate() {
            (low, high, center) = (low.min(p.position), high.max(p.position), center + p.position);
            let extents = p.shape.extents();
            sigma_max = sigma_max.max(p.sigma * extents.x.max(extents.z));
            sigma_y_max = sigma_y_max.max(p.sigma * extents.y);
            (1..).zip(&mut sums).for_each(|(power, sum)| *sum += p.sigma.powi(power));
            let aspect = p.shape.aspect_upright();
            let own = if p.shape.is_upright() { aspect } else { p.shape.narrowest() };
            (least, greatest) = (least.min(own), greatest.max(aspect));
            aspects += aspect;
            if !p.shape.is_upright() {
                turned_max = turned_max.max(p.sigma * p.shape.widest());
            }
            kappa_max = kappa_max.max(p.kappa);
            let mass = mass(p.kappa, p.sigma) * p.shape.volume();
            if mass >= mass_max {
                (mass_max, i_heaviest) = (mass, i);
            }
            is_grey &= p.color.x == p.color.y && p.color.y == p.color.z;
        }
        let n = list.len() as f64;
        let is_empty = list.is_empty();
        let [one, two, three] = sums;
        let or_zero = |v: DVec3| if is_empty { DVec3::ZERO } else { v };
        Summary {
            low: or_zero(low),
            high: or_zero(high),
            center: or_zero(center / n),
            sigma_max,
            sigma_y_max,
            sigma_mean: one / n.max(1.0),
            sigma_by_area: if two > 0.0 { three / two } else { 0.0 },
            // If all aspects are equal, so is their mean, whatever their sum rounds to.
            aspects: match is_empty {
                true => [1.0; 3],
                false => [least, (aspects / n).clamp(least, greatest), greatest],
            },
            kappa_max,
            mass_max,
            i_heaviest,
            is_grey,
            turned_max,
        }
    }
}

impl ParticleList {
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
        ParticleList(Arc::new(Shared { particles, summary: OnceLock::new() }))
    }
}

impl FromIterator<Particle> for ParticleList {
    fn from_iter<I: IntoIterator<Item = Particle>>(particles: I) -> ParticleList {
        Vec::from_iter(particles).into()
    }
}

impl PartialEq for ParticleList {
    fn eq(&self, other: &ParticleList) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.0.particles == other.0.particles
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
