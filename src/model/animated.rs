//! Particles whose places are given by a file over time, such as those of a weather model between
//! its steps (model.md §15 "Time").

use std::fmt::Debug;
use std::sync::Arc;

use glam::DVec3;

use super::particle::Particle;
use crate::error::Result;

/// A source of particles over time.
pub trait Animation: Debug + Send + Sync {
    /// Returns all particles at `time_s`, relative to the cloud's position. Their number is
    /// constant, and they stay within the bounds that [`AnimatedParticles`] states.
    ///
    /// # Errors
    /// The file of that time cannot be read.
    fn at(&self, time_s: f64) -> Result<Arc<Vec<Particle>>>;
}

/// A cloud's animated particles, with bounds that hold at all times.
#[derive(Debug, Clone)]
pub struct AnimatedParticles {
    /// Where the particles come from.
    pub animation: Arc<dyn Animation>,
    /// Number of particles.
    pub n_particles: u32,
    /// Lowest coordinates of all positions.
    pub low: DVec3,
    /// Highest coordinates of all positions.
    pub high: DVec3,
    /// Greatest σ along x and z.
    pub sigma_max: f64,
    /// Greatest σ along y.
    pub sigma_y_max: f64,
    /// Mean σ along x and z at the first moment.
    pub sigma_mean: f64,
    /// Mean of σ along y over σ along x and z at the first moment.
    pub aspect_mean: f64,
    /// Greatest peak extinction at the first moment. It may be exceeded later.
    pub kappa_max: f64,
    /// Greatest mass of a blob at the first moment. It may be exceeded later.
    pub mass_max: f64,
}

impl PartialEq for AnimatedParticles {
    fn eq(&self, other: &AnimatedParticles) -> bool {
        Arc::ptr_eq(&self.animation, &other.animation) && self.n_particles == other.n_particles
    }
}
