//! Lights: C's I(x, y, z, θ, φ, λ) as a direction and an irradiance, and the sky beside it (model.md §7, §8).

use glam::DVec3;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Light {
    /// Parallel light: `direction` of travel (unit), irradiance on a plane across it.
    Directional { direction: DVec3, irradiance: DVec3 },
    /// Irradiance E (½ + ½ n·up) e^{−(1−g)τ toward up} + E·constant.
    Sky { irradiance: DVec3, constant: f64 },
}

/// The sky's up, whatever the camera's.
pub const UP: DVec3 = DVec3::Y;

impl Light {
    /// Unit vector toward the light; for the sky, up.
    pub fn toward(&self) -> DVec3 {
        match self {
            Light::Directional { direction, .. } => -*direction,
            Light::Sky { .. } => UP,
        }
    }

    /// Share of the light's irradiance that a facet of normal `n` receives where the transmittance toward it
    /// is `transmittance`.
    pub fn factor(&self, n: DVec3, transmittance: f64) -> f64 {
        match self {
            Light::Directional { direction, .. } => transmittance * n.dot(-*direction).max(0.0),
            Light::Sky { constant, .. } => transmittance * (0.5 + 0.5 * n.dot(UP)) + constant,
        }
    }

    pub fn irradiance(&self) -> DVec3 {
        match self {
            Light::Directional { irradiance, .. } | Light::Sky { irradiance, .. } => *irradiance,
        }
    }
}
