//! The interface of a participating medium.

use glam::DVec3;

use super::ray::Ray;
use super::stream::Stream;
use crate::model::phase::Phase;

/// The scattering at a collision.
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
    /// The scattering there.
    pub scatterer: Scatterer,
}

/// A medium that light flies through.
pub trait Medium: Sync {
    /// Returns the optical depth along `ray` up to the distance `end`, which may be infinite.
    fn depth(&self, ray: &Ray, end: f64) -> f64;

    /// Samples a free flight: the collision where the optical depth reaches an exponential number
    /// of mean 1. `None` if it lies beyond `end`.
    fn collide(&self, ray: &Ray, end: f64, stream: &mut Stream) -> Option<Collision>;
}
