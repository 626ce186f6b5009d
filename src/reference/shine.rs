//! The radiance of a layer of a picture, with a bound on what a device's may differ.

use glam::DVec3;

/// The radiance of a layer, and by how much a device's may differ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shine {
    /// Radiance.
    pub radiance: DVec3,
    /// Bound of the difference.
    pub off: DVec3,
}

impl From<DVec3> for Shine {
    fn from(radiance: DVec3) -> Shine {
        Shine { radiance, off: DVec3::ZERO }
    }
}
