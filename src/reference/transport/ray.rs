//! Rays.

use glam::DVec3;

/// A ray from a point along a unit vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it begins.
    pub origin: DVec3,
    /// Unit vector along it.
    pub direction: DVec3,
}

impl Ray {
    /// Returns the point at that distance.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + distance * self.direction
    }
}

/// Returns a unit vector at an angle of that cosine to the unit vector `axis`, turned about it by
/// `turn` of a full turn.
pub(super) fn around(axis: DVec3, cosine: f64, turn: f64) -> DVec3 {
    let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
    let (a, b) = axis.any_orthonormal_pair();
    let (s, c) = (std::f64::consts::TAU * turn).sin_cos();
    (cosine * axis + sine * (c * a + s * b)).normalize()
}
