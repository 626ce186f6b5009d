//! Frustum test of groups of particles (passes.md "visibility"). It errs towards
//! visible.

use glam::{DVec2, DVec3};

use super::camera::{Camera, Pose};
use super::film::Film;

/// Enlargement of sprites' quads over the sprites (GROWTH in sprites.vert). Nothing is drawn
/// beyond.
const GROWTH: f64 = 1e-4;
/// Relative error in f32 of a length on its way from placed particle to pixel: some twenty
/// roundings of 2⁻²⁴, times a safety factor of twelve.
const ROUNDING: f64 = 1.0 / 65536.0;

/// View frustum of a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frustum {
    forward: DVec3,
    near: f64,
    /// Linear functions of an offset from the eye that are all positive within the frustum, and all
    /// negative in its mirror image behind the eye.
    inward: [DVec3; 5],
}

impl Frustum {
    /// Returns the frustum of a camera. `widening` are factors on the view's width and height.
    pub fn of(camera: &Camera, pose: &Pose, film: &Film, widening: DVec2) -> Frustum {
        let tan_y = (0.5 * camera.fov_y_rad).tan();
        let tan =
            widening * DVec2::new(tan_y * f64::from(film.width) / f64::from(film.height), tan_y);
        let (f, right, up) = (pose.forward, pose.right, pose.up);
        let inward = [f, tan.x * f - right, tan.x * f + right, tan.y * f - up, tan.y * f + up];
        Frustum { forward: f, near: camera.near, inward }
    }

    /// Returns whether sprites of at most `radius`, with centres within `center` ± `half` from the
    /// eye, may draw a pixel. `lengths` is the sum of the magnitudes of the coordinates that f32
    /// stores.
    pub fn may_show(&self, center: DVec3, half: DVec3, radius: f64, lengths: f64) -> bool {
        let slack = ROUNDING * (lengths + center.abs().element_sum() + half.element_sum());
        let across = |n: DVec3| n.abs().dot(half);
        if self.forward.dot(center) + across(self.forward) < self.near - slack {
            return false;
        }
        // A sprite is bounded by its distance from a pixel's line, which continues behind the eye.
        let reach = radius * (1.0 + GROWTH) + slack;
        let range = |n: &DVec3| [n.dot(center), across(*n) + n.length() * reach];
        let before = self.inward.iter().map(range).any(|[middle, reach]| middle + reach < 0.0);
        let behind = self.inward.iter().map(range).any(|[middle, reach]| middle - reach > 0.0);
        !(before && behind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::camera::CameraKey;
    use crate::model::film::{FilmFormat, ToneMap};

    /// Looks from the origin along −z, 90° high and 106° wide: half a width is 4/3 of the depth.
    fn frustum() -> Frustum {
        let key = CameraKey { time_s: 0.0, position: DVec3::ZERO, target: DVec3::NEG_Z };
        let camera = Camera {
            keys: vec![key],
            up: DVec3::Y,
            fov_y_rad: std::f64::consts::FRAC_PI_2,
            near: 0.5,
        };
        let (format, tone_map) = (FilmFormat::Rgba16f, ToneMap::Clip);
        let film = Film {
            width: 400,
            height: 300,
            format,
            background: DVec3::ZERO,
            exposure: 1.0,
            tone_map,
        };
        Frustum::of(&camera, &camera.pose(0.0).unwrap(), &film, DVec2::ONE)
    }

    #[test]
    fn groups_beside_the_frustum_or_before_the_near_plane_are_left_out() {
        let shows = |x: f64, y: f64, z: f64| {
            frustum().may_show(DVec3::new(x, y, -z), DVec3::splat(0.5), 0.25, 0.0)
        };
        assert!(shows(0.0, 0.0, 10.0) && shows(13.0, 0.0, 10.0) && shows(0.0, -10.0, 10.0));
        // For a box at depths 9.5 to 10.5 the right side's plane is 4/3 · 10.5 = 14 off; x − 0.5 −
        // 0.25 · 5/3 > 14.
        assert!(shows(14.9, 0.0, 10.0) && !shows(14.95, 0.0, 10.0) && !shows(-14.95, 0.0, 10.0));
        // 10.5 + 0.5 + 0.25 √2.
        assert!(shows(0.0, 11.3, 10.0) && !shows(0.0, 11.4, 10.0) && !shows(0.0, -11.4, 10.0));
        // The last centres are at the depth of the near plane.
        assert!(shows(0.0, 0.0, 0.001) && !shows(0.0, 0.0, -0.001) && !shows(0.0, 0.0, -30.0));
    }

    #[test]
    fn sprites_around_the_eye_are_kept() {
        let shows = |x: f64, z: f64, radius: f64| {
            frustum().may_show(DVec3::new(x, 0.0, -z), DVec3::ZERO, radius, 0.0)
        };
        // Around the eye; and beside it, so large that lines continue behind the eye to meet it.
        assert!(shows(3.0, 1.0, 4.0) && shows(30.0, 1.0, 29.0));
        // Beside the eye, with a short reach.
        assert!(!shows(30.0, 1.0, 2.0) && !shows(-30.0, 1.0, 2.0));
        let nothing = DVec3::NAN;
        assert!(frustum().may_show(nothing, nothing, 1.0, 0.0));
    }
}
