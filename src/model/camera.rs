//! The camera: fixed, or on a Catmull–Rom path. Rays go through the pixels' centres, row 0 is the
//! top, and the frustum is OpenGL's perspective.

use glam::DVec3;

/// A perspective camera on a path.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Keys of the path in rising time; a fixed camera has one.
    pub keys: Vec<CameraKey>,
    /// Direction that is up in the picture.
    pub up: DVec3,
    /// Vertical field of view.
    pub fov_y_rad: f64,
    /// Least view depth of the centre of a drawn particle.
    pub near: f64,
}

/// A key of the camera's path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraKey {
    /// Time of the key.
    pub time_s: f64,
    /// Position of the eye, scene units.
    pub position: DVec3,
    /// Point that the camera looks at, scene units.
    pub target: DVec3,
}

/// Camera at one time: an orthonormal frame with right × up = −forward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position of the eye, scene units.
    pub position: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
    /// Unit vector of the view direction.
    pub forward: DVec3,
}

impl Camera {
    /// Returns the pose at `time_s`. Before the first and after the last key the camera stands
    /// still. `None` if the camera has no direction: position equals target, the view runs along
    /// `up`, or a number is not finite.
    pub fn pose(&self, time_s: f64) -> Option<Pose> {
        let (position, target) = self.interpolate(time_s);
        let forward = (target - position).try_normalize()?;
        // Below this sine the frame would consist of rounding errors alone.
        const LEAST_SINE: f64 = 1e-9;
        let right = forward.cross(self.up.try_normalize()?);
        if right.length() < LEAST_SINE {
            return None;
        }
        let right = right.normalize();
        Some(Pose { position, right, up: right.cross(forward), forward })
    }

    fn interpolate(&self, time_s: f64) -> (DVec3, DVec3) {
        let keys = &self.keys;
        let last = keys.len() - 1;
        let i = keys.partition_point(|k| k.time_s <= time_s);
        if i == 0 || i > last {
            let key = keys[if i == 0 { 0 } else { last }];
            return (key.position, key.target);
        }
        let (k1, k2) = (keys[i - 1], keys[i]);
        let k0 = if i >= 2 { keys[i - 2] } else { k1 };
        let k3 = if i < last { keys[i + 1] } else { k2 };
        let u = (time_s - k1.time_s) / (k2.time_s - k1.time_s);
        let at = |p: fn(&CameraKey) -> DVec3| catmull_rom([p(&k0), p(&k1), p(&k2), p(&k3)], u);
        (at(|k| k.position), at(|k| k.target))
    }
}

/// Returns the cubic through p₁ (u = 0) and p₂ (u = 1) with tangents (p₂ − p₀)/2 and (p₃ − p₁)/2.
fn catmull_rom(p: [DVec3; 4], u: f64) -> DVec3 {
    let a = 2.0 * p[1];
    let b = p[2] - p[0];
    let c = 2.0 * p[0] - 5.0 * p[1] + 4.0 * p[2] - p[3];
    let d = -p[0] + 3.0 * p[1] - 3.0 * p[2] + p[3];
    0.5 * (a + u * (b + u * (c + u * d)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(keys: Vec<CameraKey>) -> Camera {
        Camera { keys, up: DVec3::Y, fov_y_rad: 0.8, near: 0.01 }
    }

    fn key(time_s: f64, x: f64) -> CameraKey {
        CameraKey { time_s, position: DVec3::new(x, 0.0, 10.0), target: DVec3::new(x, 0.0, 0.0) }
    }

    #[test]
    fn a_fixed_camera_has_an_orthonormal_frame() {
        let pose = camera(vec![key(0.0, 0.0)]).pose(5.0).unwrap();
        assert_eq!((pose.right, pose.up, pose.forward), (DVec3::X, DVec3::Y, -DVec3::Z));
    }

    #[test]
    fn a_path_passes_its_keys_and_runs_straight_between_even_ones() {
        let camera = camera((0..5).map(|i| key(f64::from(i), 2.0 * f64::from(i))).collect());
        for (t, x) in [(0.0, 0.0), (1.0, 2.0), (2.5, 5.0), (4.0, 8.0), (9.0, 8.0), (-1.0, 0.0)] {
            assert!((camera.pose(t).unwrap().position.x - x).abs() < 1e-12, "{t}");
        }
    }

    #[test]
    fn a_view_along_up_is_no_pose() {
        let mut c = camera(vec![key(0.0, 0.0)]);
        c.up = DVec3::Z;
        assert_eq!(c.pose(0.0), None);
        c.keys[0].position.x = f64::NAN;
        assert_eq!(c.pose(0.0), None);
    }
}
