//! Rays from the camera through the pointer, and their intersections; f64, scene units.

use glam::DVec3;

use crate::model::boxes::CloudBox;

/// A half line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// First point.
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
}

/// Smallest squared sine of the angle between a ray and an axis. At 0.01 rad an error of the
/// pointer is magnified about 100 times along the axis.
const MIN_SINE_SQUARED: f64 = 1e-4;
/// Smallest sine of the angle between a ray and a plane. At 0.01 rad an error of the pointer is
/// magnified about 100 times along the plane.
const MIN_SINE: f64 = 1e-2;

impl Ray {
    /// Returns the point at distance `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }

    /// Returns the distance to the box's surface, faces included.
    ///
    /// From outside the ray hits where it enters. From inside it hits where it leaves, so that a
    /// box around the camera does not hide the boxes in it.
    ///
    /// *Source*: slab method.
    pub fn hit(&self, b: &CloudBox) -> Option<f64> {
        let (origin, half) = ((self.origin - b.center).to_array(), (0.5 * b.extent).to_array());
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for (k, d) in self.direction.to_array().into_iter().enumerate() {
            // Parallel to the slab: on a face the quotient would be 0/0.
            if d == 0.0 {
                if origin[k].abs() > half[k] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((-half[k] - origin[k]) / d, (half[k] - origin[k]) / d);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        // Comparisons with NaN are false.
        let is_hit = enter <= leave && leave >= 0.0 && leave.is_finite();
        is_hit.then_some(if enter > 0.0 { enter } else { leave })
    }

    /// Returns s, where `point` + s `axis` is the point of the line nearest to the ray. `axis` is a
    /// unit vector.
    ///
    /// `None` where ray and line are nearly parallel, or the nearest point is behind the camera.
    pub fn nearest_on_axis(&self, point: DVec3, axis: DVec3) -> Option<f64> {
        let to_point = point - self.origin;
        let cosine = axis.dot(self.direction);
        // |a × d|² is accurate where 1 − cos² cancels.
        let sine_squared = axis.cross(self.direction).length_squared();
        if sine_squared.is_nan() || sine_squared < MIN_SINE_SQUARED {
            return None;
        }
        let (along_ray, along_axis) = (to_point.dot(self.direction), to_point.dot(axis));
        let s = (cosine * along_ray - along_axis) / sine_squared;
        let t = (along_ray - cosine * along_axis) / sine_squared;
        (t > 0.0 && s.is_finite()).then_some(s)
    }

    /// Returns the intersection with the plane through `point`; `None` where the ray is nearly
    /// parallel to the plane or points away from it.
    pub fn on_plane(&self, point: DVec3, normal: DVec3) -> Option<DVec3> {
        let sine = normal.dot(self.direction);
        if sine.is_nan() || sine.abs() < MIN_SINE * normal.length() {
            return None;
        }
        let t = normal.dot(point - self.origin) / sine;
        (t > 0.0 && t.is_finite()).then(|| self.at(t))
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::unit_box;
    use super::*;

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray {
            origin: DVec3::from_array(origin),
            direction: DVec3::from_array(direction).normalize(),
        }
    }

    #[test]
    fn boxes_are_hit_from_outside_inside_and_along_faces() {
        let b = CloudBox { extent: DVec3::new(2.0, 4.0, 6.0), center: DVec3::X, ..unit_box() };
        for (origin, direction, expected) in [
            ([-5.0, 0.0, 0.0], [1.0, 0.0, 0.0], Some(5.0)),
            ([-5.0, 0.0, 0.0], [-1.0, 0.0, 0.0], None),
            // From inside.
            ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], Some(2.0)),
            ([1.0, 1.0, 0.0], [0.0, 0.0, -1.0], Some(3.0)),
            // Along a face, and just beside it.
            ([1.0, 2.0, -9.0], [0.0, 0.0, 1.0], Some(6.0)),
            ([1.0, 2.0 + 1e-12, -9.0], [0.0, 0.0, 1.0], None),
            // A 3-4-5 triangle: the edge at x = 0, z = −3.
            ([-3.0, 0.0, -7.0], [3.0, 0.0, 4.0], Some(5.0)),
            ([-3.0, 0.0, -7.001], [3.0, 0.0, 4.0], Some(5.0)),
            ([-3.0, 0.0, -7.0], [-3.0, 0.0, 4.0], None),
            ([f64::NAN, 0.0, 0.0], [1.0, 0.0, 0.0], None),
        ] {
            let found = ray(origin, direction).hit(&b);
            let is_near = match (found, expected) {
                (Some(a), Some(b)) => f64::abs(a - b) < 2e-3,
                (a, b) => a == b,
            };
            assert!(is_near, "{origin:?} {direction:?}: {found:?}");
        }
        let flat = CloudBox { extent: DVec3::new(2.0, 0.0, 2.0), ..b };
        assert_eq!(ray([1.0, 5.0, 0.5], [0.0, -1.0, 0.0]).hit(&flat), Some(5.0));
        assert_eq!(ray([1.0, 5.0, 1.5], [0.0, -1.0, 0.0]).hit(&flat), None);
    }

    #[test]
    fn the_nearest_point_of_an_axis_agrees_with_a_scan() {
        let (point, axis) = (DVec3::new(1.0, 2.0, 3.0), DVec3::Y);
        let r = ray([4.0, -1.0, 9.0], [-0.4, 0.3, -0.8]);
        let s = r.nearest_on_axis(point, axis).unwrap();
        let distance = |s: f64| (point + s * axis - r.origin).cross(r.direction).length();
        let least =
            (-4000..4000).map(|i| distance(f64::from(i) * 1e-3)).fold(f64::INFINITY, f64::min);
        // The scan comes within half a step h of the minimum, where a distance d grows by h²/2d.
        assert!(distance(s) < least + 1e-12 && least - distance(s) < 1e-6, "{s}");
    }

    #[test]
    fn parallel_lines_and_points_behind_the_camera_have_no_result() {
        let r = ray([0.0, 0.0, 5.0], [0.0, 1e-3, -1.0]);
        assert_eq!(r.nearest_on_axis(DVec3::ZERO, DVec3::Z), None);
        assert!(
            ray([0.0, 1.0, 5.0], [0.0, -0.1, -1.0])
                .nearest_on_axis(DVec3::ZERO, DVec3::Z)
                .is_some()
        );
        assert_eq!(
            ray([0.0, 0.0, 5.0], [0.0, 0.0, 1.0]).nearest_on_axis(DVec3::ZERO, DVec3::X),
            None
        );
        assert_eq!(r.nearest_on_axis(DVec3::NAN, DVec3::X), None);
        assert_eq!(
            ray([1.0, 1.0, 5.0], [0.0, 0.0, -1.0]).on_plane(DVec3::ZERO, DVec3::Z),
            Some(DVec3::new(1.0, 1.0, 0.0))
        );
        assert_eq!(ray([1.0, 1.0, 5.0], [0.0, 0.0, 1.0]).on_plane(DVec3::ZERO, DVec3::Z), None);
        assert_eq!(ray([1.0, 1.0, 5.0], [1.0, 0.0, -1e-3]).on_plane(DVec3::ZERO, DVec3::Z), None);
    }
}
