//! What a medium tells a path.

use glam::DVec3;

use super::ray::Ray;
use super::stream::Stream;
use crate::model::phase::Phase;

/// What scatters light at a collision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatterer {
    /// Albedo ϖ of single scattering, linear RGB.
    pub albedo: DVec3,
    /// Phase function.
    pub phase: Phase,
}

/// Where a flight ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collision {
    /// Distance along the ray.
    pub distance: f64,
    /// What is met.
    pub scatterer: Scatterer,
}

/// A medium that light flies through.
pub trait Medium: Sync {
    /// Returns the optical depth along `ray` up to the distance `end`, which may be infinite.
    fn depth(&self, ray: &Ray, end: f64) -> f64;

    /// Draws a free flight: the distance at which the optical depth reaches an exponential number
    /// of mean 1, and what is met there. `None` if that is beyond `end`.
    fn collide(&self, ray: &Ray, end: f64, stream: &mut Stream) -> Option<Collision>;
}
