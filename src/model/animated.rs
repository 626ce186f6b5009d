//! Particles that somebody else moves: those of a weather file, between its steps (docs/model.md
//! §15 "Time").

use std::fmt::Debug;
use std::sync::Arc;

use glam::DVec3;

use super::cloud::Particle;
use crate::error::Result;

/// Who moves them.
pub trait Animation: Debug + Send + Sync {
    /// All particles at `time_s`, relative to the cloud's position: always as many, and within the
    /// bounds that [`AnimatedParticles`] says.
    ///
    /// # Errors
    /// What cannot be read.
    fn at(&self, time_s: f64) -> Result<Arc<Vec<Particle>>>;
}

/// A cloud's particles, and what bounds them at all times.
#[derive(Debug, Clone)]
pub struct AnimatedParticles {
    pub animation: Arc<dyn Animation>,
    pub n_particles: u32,
    /// Of the positions.
    pub low: DVec3,
    pub high: DVec3,
    /// Along x and z; and along y.
    pub sigma_max: f64,
    pub sigma_y_max: f64,
    /// Means, at the first moment.
    pub sigma_mean: f64,
    pub aspect_mean: f64,
    /// At the first moment: no bounds.
    pub kappa_max: f64,
    pub mass_max: f64,
}

impl PartialEq for AnimatedParticles {
    fn eq(&self, other: &AnimatedParticles) -> bool {
        Arc::ptr_eq(&self.animation, &other.animation) && self.n_particles == other.n_particles
    }
}
