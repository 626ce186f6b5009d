//! Handles of the active box: an arrow along each axis to move the box, a square on each face to
//! scale it, and its centre to move it in the view plane.

use glam::{DVec2, DVec3};

use super::axis::Axis;
use super::viewport::Viewport;
use crate::model::boxes::CloudBox;

/// A side of a box along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    /// The side of the smaller coordinate.
    Low,
    /// The side of the larger coordinate.
    High,
}

/// A handle that a drag takes hold of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Handle {
    /// Moves along an axis.
    MoveAxis(Axis),
    /// Moves in the plane through the centre that faces the camera.
    MoveView,
    /// Moves one face.
    ScaleFace(Axis, Side),
    /// Scales all selected boxes, and their distances, by the pointer's distance from their middle.
    ScaleAll,
    /// Scales in the same way along one axis.
    ScaleAxis(Axis),
}

/// A handle in the scene: a line, or a point where both ends are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedHandle {
    /// The handle.
    pub handle: Handle,
    /// Begin of the line.
    pub from: DVec3,
    /// End of the line.
    pub to: DVec3,
}

/// Distance from a face to its arrow, which leaves space for the face's handle, points.
pub const GAP_POINTS: f64 = 16.0;
/// Length of an arrow, points: eight times the pointer's reach, so that it is easy to grab.
pub const ARROW_POINTS: f64 = 64.0;
/// Largest distance of the pointer from a handle that it picks, points: half of [`GAP_POINTS`], so
/// that the reaches of a face's handle and of its arrow do not overlap.
pub const REACH_POINTS: f64 = 8.0;
/// Sine of the angle (6°) between view and axis below which the axis has no handles: the pointer's
/// place would be magnified more than tenfold along it.
const MIN_SINE: f64 = 0.1;

impl Side {
    /// Both sides.
    pub const BOTH: [Side; 2] = [Side::Low, Side::High];

    /// Returns −1 or 1.
    pub fn sign(self) -> f64 {
        match self {
            Side::Low => -1.0,
            Side::High => 1.0,
        }
    }
}

impl Handle {
    /// Returns the name of the step, as in "Undo …".
    pub fn label(self) -> &'static str {
        match self {
            Handle::MoveAxis(_) | Handle::MoveView => "move",
            Handle::ScaleFace(..) | Handle::ScaleAll | Handle::ScaleAxis(_) => "scale",
        }
    }

    /// Returns the axis that the handle is bound to.
    pub fn axis(self) -> Option<Axis> {
        match self {
            Handle::MoveAxis(axis) | Handle::ScaleFace(axis, _) | Handle::ScaleAxis(axis) => {
                Some(axis)
            }
            Handle::MoveView | Handle::ScaleAll => None,
        }
    }
}

/// Returns the handles of a box. Their size on the screen does not depend on the box's distance.
pub fn place_handles(b: &CloudBox, view: &Viewport) -> Vec<PlacedHandle> {
    let mut placed = vec![PlacedHandle { handle: Handle::MoveView, from: b.center, to: b.center }];
    let sight = (b.center - view.pose.position).normalize_or(view.pose.forward);
    for axis in Axis::ALL {
        let unit = axis.unit();
        if unit.cross(sight).length() < MIN_SINE {
            continue;
        }
        let half = 0.5 * b.extent[axis.index()];
        for side in Side::BOTH {
            let face = b.center + side.sign() * half * unit;
            placed.push(PlacedHandle {
                handle: Handle::ScaleFace(axis, side),
                from: face,
                to: face,
            });
        }
        let face = b.center + half * unit;
        let point = view.units_per_point(face);
        let (from, to) =
            (face + GAP_POINTS * point * unit, face + (GAP_POINTS + ARROW_POINTS) * point * unit);
        placed.push(PlacedHandle { handle: Handle::MoveAxis(axis), from, to });
    }
    // Handles behind the camera cannot be picked.
    placed.retain(|p| view.project(p.from).is_some() && view.project(p.to).is_some());
    placed
}

/// Returns the handle nearest to a pixel within [`REACH_POINTS`].
pub fn pick_handle(placed: &[PlacedHandle], view: &Viewport, pixel: DVec2) -> Option<Handle> {
    let distance = |p: &PlacedHandle| {
        Some(distance_to_segment(pixel, view.project(p.from)?, view.project(p.to)?))
    };
    let reached = placed.iter().filter_map(|p| Some((p.handle, distance(p)?)));
    let nearest = reached.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (nearest.1 <= REACH_POINTS * view.px_per_point).then_some(nearest.0)
}

fn distance_to_segment(point: DVec2, a: DVec2, b: DVec2) -> f64 {
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
    use super::super::fixtures::unit_box;
    use super::*;
    use crate::model::camera::Pose;

    fn view(position: DVec3) -> Viewport {
        let forward = (-position).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let pose = Pose { position, right, up: right.cross(forward), forward };
        Viewport { pose, fov_y_rad: 0.8, size_px: DVec2::new(800.0, 600.0), px_per_point: 1.0 }
    }

    #[test]
    fn each_of_the_ten_handles_is_picked_at_its_own_pixel() {
        let (view, b) = (view(DVec3::new(3.0, 2.0, 4.0)), unit_box());
        let placed = place_handles(&b, &view);
        assert_eq!(placed.len(), 1 + 6 + 3);
        for p in &placed {
            let (a, b) = (view.project(p.from).unwrap(), view.project(p.to).unwrap());
            assert_eq!(pick_handle(&placed, &view, 0.5 * (a + b)), Some(p.handle));
        }
        assert_eq!(pick_handle(&placed, &view, DVec2::new(5.0, 5.0)), None);
    }

    #[test]
    fn reach_and_arrows_scale_with_the_displays_points() {
        for px_per_point in [1.0, 2.0] {
            let view = Viewport { px_per_point, ..view(DVec3::new(0.0, 0.0, 9.0)) };
            let placed = place_handles(&unit_box(), &view);
            let arrow = placed.iter().find(|p| p.handle == Handle::MoveAxis(Axis::X)).unwrap();
            let (from, to) = (view.project(arrow.from).unwrap(), view.project(arrow.to).unwrap());
            assert!((from.distance(to) - ARROW_POINTS * px_per_point).abs() < 1e-9);
            let beside = |points: f64| 0.5 * (from + to) + DVec2::Y * points * px_per_point;
            assert_eq!(pick_handle(&placed, &view, beside(7.9)), Some(Handle::MoveAxis(Axis::X)));
            assert_eq!(pick_handle(&placed, &view, beside(8.1)), None);
            // The view is along z, which has no handles then.
            assert!(placed.iter().all(|p| p.handle.axis() != Some(Axis::Z)));
            assert_eq!(placed.len(), 1 + 4 + 2);
        }
    }

    #[test]
    fn a_box_behind_the_camera_has_no_handles() {
        let mut view = view(DVec3::new(3.0, 2.0, 4.0));
        view.pose.forward = -view.pose.forward;
        assert_eq!(place_handles(&unit_box(), &view), []);
    }
}
