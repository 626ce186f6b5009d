//! The photometric unit of skies.

use std::f64::consts::PI;

use glam::DVec3;

/// Illuminance of one unit of irradiance, lx: a white surface in 100 klx, full sunlight, has the
/// radiance 1.
pub const UNIT_LX: f64 = 1e5 / PI;
/// The same in watts of which one is 683 lm.
pub const UNIT_W: f64 = UNIT_LX / 683.0;

/// Returns the luminance of linear sRGB, by BT.709.
pub fn luminance(rgb: DVec3) -> f64 {
    rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}
