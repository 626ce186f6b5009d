//! The photometric unit of skies.

use std::f64::consts::PI;

use glam::DVec3;

/// Illuminance of one unit of irradiance, lx: a white surface in 100 klx, full sunlight, has the
/// radiance 1.
pub const UNIT_LX: f64 = 1e5 / PI;
/// The same in watts of which one is 683 lm.
pub const UNIT_W: f64 = UNIT_LX / 683.0;

/// Light of the standard illuminant D55, linear sRGB of luminance 1: XYZ is (0.9568, 1, 0.9214).
const D55: DVec3 = DVec3::new(1.104, 0.987, 0.823);

/// Returns light balanced as by film for daylight: D55 is white. Its luminance stays.
pub fn balanced(rgb: DVec3) -> DVec3 {
    rgb / D55
}

/// Returns the luminance of linear sRGB, by BT.709.
pub fn luminance(rgb: DVec3) -> f64 {
    rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn daylight_is_white() {
        assert!((luminance(D55) - 1.0).abs() < 1e-3);
        assert_eq!(balanced(2.0 * D55), DVec3::splat(2.0));
    }
}
