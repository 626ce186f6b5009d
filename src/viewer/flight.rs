//! Where somebody looks from: flying with keys and mouse, and turning about what is looked at.

use glam::{DQuat, DVec3};

use crate::model::camera::Pose;

/// A place, a direction, and what a step is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flight {
    position: DVec3,
    /// Unit.
    forward: DVec3,
    /// Unit: never along `forward`.
    up: DVec3,
    /// From the position to what is turned about.
    distance: f64,
    /// Scene units in a second.
    speed: f64,
}

/// What hands do; angles in radians, times in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// Along (right, up, forward), each −1 to 1, for so long.
    Fly { along: DVec3, seconds: f64 },
    /// The eye turns: to the right and upward.
    Look { right: f64, upward: f64 },
    /// Around what is looked at: the eye goes to the right and upward.
    Orbit { right: f64, upward: f64 },
    /// Nearer to it by so many notches; negative: away.
    Approach { notches: f64 },
    /// Times so many doublings.
    Speed { doublings: f64 },
}

/// The eye keeps so far from straight up and down, rad.
const FROM_UP: f64 = 0.01;
/// A notch goes this share of the way.
const NOTCH: f64 = 0.1;
/// Across what is looked at in as many seconds.
const CROSSING_S: f64 = 4.0;
/// Distances and speeds are no less and no greater: what f32 and the scene's greatest coordinate
/// allow.
const LIMITS: (f64, f64) = (1e-6, 1e14);
/// Coordinates are no greater.
const FARTHEST: f64 = 1e15;

impl Flight {
    /// From where a camera is: `target` is what is turned about.
    pub fn new(pose: &Pose, up: DVec3, target: DVec3) -> Flight {
        let distance = (target - pose.position).length().clamp(LIMITS.0, LIMITS.1);
        let up = up.normalize_or(DVec3::Y);
        Flight {
            position: pose.position,
            forward: pose.forward,
            up,
            distance,
            speed: distance / CROSSING_S,
        }
    }

    pub fn position(&self) -> DVec3 {
        self.position
    }

    pub fn target(&self) -> DVec3 {
        self.position + self.distance * self.forward
    }

    pub fn speed(&self) -> f64 {
        self.speed
    }

    pub fn pose(&self) -> Pose {
        let right = self.forward.cross(self.up).normalize();
        Pose {
            position: self.position,
            right,
            up: right.cross(self.forward),
            forward: self.forward,
        }
    }

    /// After `motion`; what is no number changes nothing.
    pub fn after(self, motion: Motion) -> Flight {
        let next = match motion {
            Motion::Fly { along, seconds } => {
                let Pose { right, up, forward, .. } = self.pose();
                let step =
                    self.speed * seconds * (along.x * right + along.y * up + along.z * forward);
                Flight { position: self.position + step, ..self }
            }
            Motion::Look { right, upward } => {
                Flight { forward: self.turned(right, upward), ..self }
            }
            Motion::Orbit { right, upward } => {
                // The eye goes to the right where it turns to the left.
                let forward = self.turned(-right, -upward);
                Flight { position: self.target() - self.distance * forward, forward, ..self }
            }
            Motion::Approach { notches } => {
                let distance =
                    (self.distance * (1.0 - NOTCH).powf(notches)).clamp(LIMITS.0, LIMITS.1);
                Flight { position: self.target() - distance * self.forward, distance, ..self }
            }
            Motion::Speed { doublings } => {
                Flight { speed: (self.speed * doublings.exp2()).clamp(LIMITS.0, LIMITS.1), ..self }
            }
        };
        let is_sound = next.position.abs().max_element() <= FARTHEST
            && next.forward.is_finite()
            && next.speed.is_finite();
        if is_sound { next } else { self }
    }

    /// `forward` turned about `up` and about what is to the right, no nearer to `up` than
    /// [`FROM_UP`].
    fn turned(&self, right: f64, upward: f64) -> DVec3 {
        if !(right.is_finite() && upward.is_finite()) {
            return self.forward;
        }
        let level = DQuat::from_axis_angle(self.up, -right) * self.forward;
        let angle = level.angle_between(self.up);
        let upward = upward.clamp(angle - std::f64::consts::PI + FROM_UP, angle - FROM_UP);
        let axis = level.cross(self.up).normalize();
        (DQuat::from_axis_angle(axis, upward) * level).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// At (0, 0, 8), looking at the origin.
    fn flight() -> Flight {
        let position = DVec3::new(0.0, 0.0, 8.0);
        let pose = Pose { position, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z };
        Flight::new(&pose, DVec3::Y, DVec3::ZERO)
    }

    fn is(a: DVec3, b: [f64; 3]) -> bool {
        (a - DVec3::from(b)).length() < 1e-12
    }

    #[test]
    fn flying_goes_along_the_view() {
        let f = flight();
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
    fn looking_turns_the_eye_and_orbiting_moves_it() {
        let right = flight().after(Motion::Look { right: FRAC_PI_2, upward: 0.0 });
        assert!(is(right.pose().forward, [1.0, 0.0, 0.0]) && is(right.position(), [0.0, 0.0, 8.0]));
        let round = flight().after(Motion::Orbit { right: FRAC_PI_2, upward: 0.0 });
        assert!(is(round.position(), [8.0, 0.0, 0.0]) && is(round.target(), [0.0; 3]), "{round:?}");
        let above = flight().after(Motion::Orbit { right: 0.0, upward: 0.5 });
        assert!(above.position().y > 3.0 && (above.position().length() - 8.0).abs() < 1e-12);
        // All the way around.
        let mut f = flight();
        for _ in 0..8 {
            f = f.after(Motion::Orbit { right: 0.25 * std::f64::consts::PI, upward: 0.0 });
        }
        assert!(is(f.position(), [0.0, 0.0, 8.0]));
    }

    #[test]
    fn nobody_stands_on_his_head_and_nobody_gets_lost() {
        for upward in [9.0, -9.0] {
            for motion in
                [Motion::Look { right: 0.3, upward }, Motion::Orbit { right: 0.3, upward }]
            {
                let f = flight().after(motion).after(motion);
                let pose = f.pose();
                assert!(pose.right.is_finite() && pose.up.y > 0.0, "{pose:?}");
                assert!((pose.forward.y.abs() - FROM_UP.cos()).abs() < 1e-9);
            }
        }
        let f = flight();
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
