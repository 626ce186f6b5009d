//! Gaussian blobs of extinction, model.md §1, §14.

use glam::DVec3;

use super::shape::Shape;

/// σ of a Gaussian blob over its radius: σ = R/3 (model.md §1).
pub const SIGMA_PER_RADIUS: f64 = 1.0 / 3.0;

/// √(2π): the optical depth through a blob's centre is √(2π) κ σ.
pub const SQRT_TAU: f64 = 2.506_628_274_631_000_5;

/// A Gaussian blob of extinction, relative to its cloud's position.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Particle {
    /// Centre, scene units.
    pub position: DVec3,
    /// σ along the first axis of its shape, scene units: of an upright one that along x and z.
    pub sigma: f64,
    /// Its shape (model.md §14).
    pub shape: Shape,
    /// κ: peak extinction per unit length.
    pub kappa: f64,
    /// Linear RGB: radiance if the lighting mode is "none", otherwise a factor on the material's
    /// K_d.
    pub color: DVec3,
}

/// Returns the integral of a ball's extinction, κ (2π)^{3/2} σ³. That of an ellipsoid is larger by
/// its shape's volume.
pub fn mass(kappa: f64, sigma: f64) -> f64 {
    kappa * (SQRT_TAU * sigma).powi(3)
}
