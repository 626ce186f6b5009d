//! What the hand takes hold of at the active box: an arrow along each axis to move, a handle on
//! each face to scale, and the centre to move in the view's plane.

use glam::{DVec2, DVec3};

use super::Axis;
use super::viewport::Viewport;
use crate::model::boxes::CloudBox;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    Low,
    High,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Handle {
    MoveAxis(Axis),
    /// In the plane through the centre that the camera looks at.
    MoveView,
    ScaleFace(Axis, Side),
    /// All selected boxes and the distances between them, about their middle: by the pointer's
    /// distance from it.
    ScaleAll,
    /// The same along one axis.
    ScaleAxis(Axis),
}

/// Where a handle lies in the scene: on a line, whose ends are the same where it is a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    pub handle: Handle,
    pub from: DVec3,
    pub to: DVec3,
}

/// From a face to its arrow, so that the face's own handle lies free; logical points, as are the
/// next two.
pub const GAP_POINTS: f64 = 16.0;
pub const ARROW_POINTS: f64 = 64.0;
/// A handle is under the pointer at most so far from it: what a hand hits well.
pub const REACH_POINTS: f64 = 8.0;
/// Handles of an axis that is seen nearly from its end are not shown: below this sine (6°) the
/// pointer's place along the axis is magnified more than tenfold.
const LEAST_SINE: f64 = 0.1;

impl Side {
    pub const BOTH: [Side; 2] = [Side::Low, Side::High];

    pub fn sign(self) -> f64 {
        match self {
            Side::Low => -1.0,
            Side::High => 1.0,
        }
    }
}

impl Handle {
    /// As in "Undo …".
    pub fn label(self) -> &'static str {
        match self {
            Handle::MoveAxis(_) | Handle::MoveView => "move",
            Handle::ScaleFace(..) | Handle::ScaleAll | Handle::ScaleAxis(_) => "scale",
        }
    }

    pub fn axis(self) -> Option<Axis> {
        match self {
            Handle::MoveAxis(axis) | Handle::ScaleFace(axis, _) | Handle::ScaleAxis(axis) => {
                Some(axis)
            }
            Handle::MoveView | Handle::ScaleAll => None,
        }
    }
}

/// The handles of a box as they are to be drawn, all at the same size on the screen wherever the
/// box is.
pub fn placed(b: &CloudBox, view: &Viewport) -> Vec<Placed> {
    let mut placed = vec![Placed { handle: Handle::MoveView, from: b.center, to: b.center }];
    let sight = (b.center - view.pose.position).normalize_or(view.pose.forward);
    for axis in Axis::ALL {
        let unit = axis.unit();
        if unit.cross(sight).length() < LEAST_SINE {
            continue;
        }
        let half = 0.5 * b.extent[axis.index()];
        for side in Side::BOTH {
            let face = b.center + side.sign() * half * unit;
            placed.push(Placed { handle: Handle::ScaleFace(axis, side), from: face, to: face });
        }
        let face = b.center + half * unit;
        let point = view.units_per_point(face);
        let (from, to) =
            (face + GAP_POINTS * point * unit, face + (GAP_POINTS + ARROW_POINTS) * point * unit);
        placed.push(Placed { handle: Handle::MoveAxis(axis), from, to });
    }
    // What is not before the eye cannot be taken hold of.
    placed.retain(|p| view.project(p.from).is_some() && view.project(p.to).is_some());
    placed
}

/// The handle nearest to a pixel, if one is within [`REACH_POINTS`].
pub fn pick(placed: &[Placed], view: &Viewport, pixel: DVec2) -> Option<Handle> {
    let distance =
        |p: &Placed| Some(from_segment(pixel, view.project(p.from)?, view.project(p.to)?));
    let reached = placed.iter().filter_map(|p| Some((p.handle, distance(p)?)));
    let nearest = reached.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (nearest.1 <= REACH_POINTS * view.px_per_point).then_some(nearest.0)
}

fn from_segment(point: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let length_squared = along.length_squared();
    let t = if length_squared > 0.0 {
        ((point - a).dot(along) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    point.distance(a + t * along)
}

#[cfg(test)]
mod tests {
    use super::super::samples::unit_box;
    use super::*;
    use crate::model::camera::Pose;

    fn view(position: DVec3) -> Viewport {
        let forward = (-position).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let pose = Pose { position, right, up: right.cross(forward), forward };
        Viewport { pose, fov_y_rad: 0.8, size_px: DVec2::new(800.0, 600.0), px_per_point: 1.0 }
    }

    #[test]
    fn ten_handles_and_each_is_found_under_its_own_pixel() {
        let (view, b) = (view(DVec3::new(3.0, 2.0, 4.0)), unit_box());
        let placed = placed(&b, &view);
        assert_eq!(placed.len(), 1 + 6 + 3);
        for p in &placed {
            let (a, b) = (view.project(p.from).unwrap(), view.project(p.to).unwrap());
            assert_eq!(pick(&placed, &view, 0.5 * (a + b)), Some(p.handle));
        }
        assert_eq!(pick(&placed, &view, DVec2::new(5.0, 5.0)), None);
    }

    #[test]
    fn reach_and_arrows_are_as_long_as_said_and_grow_with_the_displays_points() {
        for px_per_point in [1.0, 2.0] {
            let view = Viewport { px_per_point, ..view(DVec3::new(0.0, 0.0, 9.0)) };
            let placed = placed(&unit_box(), &view);
            let arrow = placed.iter().find(|p| p.handle == Handle::MoveAxis(Axis::X)).unwrap();
            let (from, to) = (view.project(arrow.from).unwrap(), view.project(arrow.to).unwrap());
            assert!((from.distance(to) - ARROW_POINTS * px_per_point).abs() < 1e-9);
            let beside = |points: f64| 0.5 * (from + to) + DVec2::Y * points * px_per_point;
            assert_eq!(pick(&placed, &view, beside(7.9)), Some(Handle::MoveAxis(Axis::X)));
            assert_eq!(pick(&placed, &view, beside(8.1)), None);
            // Seen from its end, z has no handles.
            assert!(placed.iter().all(|p| p.handle.axis() != Some(Axis::Z)));
            assert_eq!(placed.len(), 1 + 4 + 2);
        }
    }

    #[test]
    fn what_lies_behind_has_no_handles() {
        let mut view = view(DVec3::new(3.0, 2.0, 4.0));
        view.pose.forward = -view.pose.forward;
        assert_eq!(placed(&unit_box(), &view), []);
    }
}
