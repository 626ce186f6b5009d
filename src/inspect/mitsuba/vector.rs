//! Vectors in the scene file.

use glam::DVec3;

/// Returns the coordinates as Mitsuba reads them.
pub(super) fn list(v: DVec3) -> String {
    format!("{}, {}, {}", v.x, v.y, v.z)
}
