//! A camera that flies with keys and mouse, and orbits a target.

use glam::{DQuat, DVec3};

use crate::model::camera::Pose;
use crate::model::scene::Scene;

/// A camera with the distance to its target and a flying speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlyCamera {
    position: DVec3,
    /// Unit vector.
    forward: DVec3,
    /// Unit vector, never parallel to `forward`.
    up: DVec3,
    /// Distance to the target that the camera orbits.
    distance: f64,
    /// Scene units a second.
    speed: f64,
}

/// A change of the camera. Angles are in radians, times in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// Flies along (right, up, forward), each component from −1 to 1.
    Fly {
        /// Direction by the camera's axes; its length is the share of the speed.
        along: DVec3,
        /// Duration.
        seconds: f64,
    },
    /// Turns the camera in place.
    Look {
        /// Angle to the right.
        right: f64,
        /// Angle upward.
        upward: f64,
    },
    /// Moves the camera around its target, to the right and upward.
    Orbit {
        /// Angle to the right.
        right: f64,
        /// Angle upward.
        upward: f64,
    },
    /// Moves toward the target by notches of the wheel; negative: away.
    Approach {
        /// Notches.
        notches: f64,
    },
    /// Multiplies the speed by 2 to this power.
    Speed {
        /// The power.
        doublings: f64,
    },
}

/// Smallest angle between the view direction and `up` or its opposite, rad. At 0 the right axis is
/// undefined.
const MIN_ANGLE_FROM_UP: f64 = 0.01;
/// Part of the distance to the target that one notch covers: about seven notches halve it.
const NOTCH: f64 = 0.1;
/// Time to fly the distance to the target at the initial speed, s: slow enough to steer, and the
/// user need not wait long to arrive.
const CROSSING_S: f64 = 4.0;
/// Bounds of distance, scene units, and speed, scene units a second: within f32 and the largest
/// coordinate of a scene.
const LIMITS: (f64, f64) = (1e-6, 1e14);
/// Largest coordinate of the camera, scene units: the limit of scene files.
const MAX_COORDINATE: f64 = 1e15;

impl FlyCamera {
    /// Creates a camera at `pose` that orbits `target`.
    pub fn new(pose: &Pose, up: DVec3, target: DVec3) -> FlyCamera {
        let distance = (target - pose.position).length().clamp(LIMITS.0, LIMITS.1);
        let up = up.normalize_or(DVec3::Y);
        FlyCamera {
            position: pose.position,
            forward: pose.forward,
            up,
            distance,
            speed: distance / CROSSING_S,
        }
    }

    /// Starts at the first key of a scene's camera; `None` where it has no direction there. The
    /// camera's coordinates are relative to `origin`.
    pub fn of_scene(scene: &Scene, origin: DVec3) -> Option<FlyCamera> {
        let camera = &scene.camera;
        let pose = camera.pose(scene.time.start_s)?;
        let local = Pose { position: pose.position - origin, ..pose };
        Some(FlyCamera::new(&local, camera.up, camera.keys.first()?.target - origin))
    }

    /// Returns the camera at another position, which orbits `target`. It has the same direction,
    /// and the speed of a new camera.
    pub fn placed(&self, position: DVec3, target: DVec3) -> FlyCamera {
        FlyCamera::new(&Pose { position, ..self.pose() }, self.up, target)
    }

    /// Returns the camera's position.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Returns the point that the camera orbits.
    pub fn target(&self) -> DVec3 {
        self.position + self.distance * self.forward
    }

    /// Returns the speed, scene units a second.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Returns position and axes.
    pub fn pose(&self) -> Pose {
        let right = self.forward.cross(self.up).normalize();
        Pose {
            position: self.position,
            right,
            up: right.cross(self.forward),
            forward: self.forward,
        }
    }

    /// Returns the camera after `motion`. A motion whose result is not finite, or too far away,
    /// changes nothing.
    pub fn after(self, motion: Motion) -> FlyCamera {
        let next = match motion {
            Motion::Fly { along, seconds } => {
                let Pose { right, up, forward, .. } = self.pose();
                let step =
                    self.speed * seconds * (along.x * right + along.y * up + along.z * forward);
                FlyCamera { position: self.position + step, ..self }
            }
            Motion::Look { right, upward } => {
                FlyCamera { forward: self.turned(right, upward), ..self }
            }
            Motion::Orbit { right, upward } => {
                // Moving right around the target turns the camera left.
                let forward = self.turned(-right, -upward);
                FlyCamera { position: self.target() - self.distance * forward, forward, ..self }
            }
            Motion::Approach { notches } => {
                let distance =
                    (self.distance * (1.0 - NOTCH).powf(notches)).clamp(LIMITS.0, LIMITS.1);
                FlyCamera { position: self.target() - distance * self.forward, distance, ..self }
            }
            Motion::Speed { doublings } => FlyCamera {
                speed: (self.speed * doublings.exp2()).clamp(LIMITS.0, LIMITS.1),
                ..self
            },
        };
        let is_valid = next.position.abs().max_element() <= MAX_COORDINATE
            && next.forward.is_finite()
            && next.speed.is_finite();
        if is_valid { next } else { self }
    }

    /// Returns `forward` turned about `up` and about the right axis. It stays
    /// [`MIN_ANGLE_FROM_UP`] away from straight up and down.
    fn turned(&self, right: f64, upward: f64) -> DVec3 {
        if !(right.is_finite() && upward.is_finite()) {
            return self.forward;
        }
        let level = DQuat::from_axis_angle(self.up, -right) * self.forward;
        let angle = level.angle_between(self.up);
        let upward = upward
            .clamp(angle - std::f64::consts::PI + MIN_ANGLE_FROM_UP, angle - MIN_ANGLE_FROM_UP);
        let axis = level.cross(self.up).normalize();
        (DQuat::from_axis_angle(axis, upward) * level).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// At (0, 0, 8), looking at the origin.
    fn camera() -> FlyCamera {
        let position = DVec3::new(0.0, 0.0, 8.0);
        let pose = Pose { position, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z };
        FlyCamera::new(&pose, DVec3::Y, DVec3::ZERO)
    }

    fn is(a: DVec3, b: [f64; 3]) -> bool {
        (a - DVec3::from(b)).length() < 1e-12
    }

    #[test]
    fn fly_moves_along_the_camera_axes() {
        let f = camera();
        assert_eq!(
            (f.pose().right, f.pose().up, f.target(), f.speed()),
            (DVec3::X, DVec3::Y, DVec3::ZERO, 2.0)
        );
        let ahead = f.after(Motion::Fly { along: DVec3::Z, seconds: 0.5 });
        assert!(is(ahead.position(), [0.0, 0.0, 7.0]) && is(ahead.target(), [0.0, 0.0, -1.0]));
        let aside = f
            .after(Motion::Speed { doublings: 1.0 })
            .after(Motion::Fly { along: DVec3::X, seconds: 1.0 });
        assert!(is(aside.position(), [4.0, 0.0, 8.0]));
    }

    #[test]
    fn look_turns_the_camera_and_orbit_moves_it() {
        let right = camera().after(Motion::Look { right: FRAC_PI_2, upward: 0.0 });
        assert!(is(right.pose().forward, [1.0, 0.0, 0.0]) && is(right.position(), [0.0, 0.0, 8.0]));
        let round = camera().after(Motion::Orbit { right: FRAC_PI_2, upward: 0.0 });
        assert!(is(round.position(), [8.0, 0.0, 0.0]) && is(round.target(), [0.0; 3]), "{round:?}");
        let above = camera().after(Motion::Orbit { right: 0.0, upward: 0.5 });
        assert!(above.position().y > 3.0 && (above.position().length() - 8.0).abs() < 1e-12);
        // A full circle.
        let mut f = camera();
        for _ in 0..8 {
            f = f.after(Motion::Orbit { right: 0.25 * std::f64::consts::PI, upward: 0.0 });
        }
        assert!(is(f.position(), [0.0, 0.0, 8.0]));
    }

    #[test]
    fn the_camera_stays_upright_and_within_bounds() {
        for upward in [9.0, -9.0] {
            for motion in
                [Motion::Look { right: 0.3, upward }, Motion::Orbit { right: 0.3, upward }]
            {
                let f = camera().after(motion).after(motion);
                let pose = f.pose();
                assert!(pose.right.is_finite() && pose.up.y > 0.0, "{pose:?}");
                assert!((pose.forward.y.abs() - MIN_ANGLE_FROM_UP.cos()).abs() < 1e-9);
            }
        }
        let f = camera();
        for motion in [
            Motion::Fly { along: DVec3::NAN, seconds: 1.0 },
            Motion::Fly { along: DVec3::Z, seconds: 1e300 },
            Motion::Look { right: f64::NAN, upward: 0.0 },
        ] {
            assert_eq!(f.after(motion), f, "{motion:?}");
        }
        let near = (0..2000).fold(f, |f, _| f.after(Motion::Approach { notches: 1.0 }));
        assert!(near.position().length() < 1e-5 && near.pose().right.is_finite());
        assert!(is(f.after(Motion::Approach { notches: 1.0 }).position(), [0.0, 0.0, 7.2]));
    }
}
