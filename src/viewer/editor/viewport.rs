//! Between the scene and the window's pixels: the pointer's ray, a place's pixel, what lies under a
//! point or within a rectangle, and where to stand to see something whole.

use glam::{DVec2, DVec3};

use super::ray::Ray;
use crate::model::boxes::CloudBox;
use crate::model::camera::Pose;

/// A camera and the part of a window that it fills. Pixels are counted from the upper left corner
/// and are real numbers: the centre of the first one is (0.5, 0.5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewport {
    pub pose: Pose,
    pub fov_y_rad: f64,
    pub size_px: DVec2,
    /// Pixels in a logical point, as the display is set: sizes of what is drawn for the hand are
    /// given in points.
    pub px_per_point: f64,
}

/// A box under the pointer, and how far off it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    pub i_box: usize,
    pub distance: f64,
}

impl Viewport {
    /// Slopes, right and up over forward, of what is seen in a pixel.
    fn slopes(&self, pixel: DVec2) -> DVec2 {
        let tangent = (0.5 * self.fov_y_rad).tan();
        let of_height = 2.0 * tangent / self.size_px.y;
        DVec2::new(pixel.x - 0.5 * self.size_px.x, 0.5 * self.size_px.y - pixel.y) * of_height
    }

    pub fn ray(&self, pixel: DVec2) -> Ray {
        let (slopes, pose) = (self.slopes(pixel), &self.pose);
        let direction = pose.forward + slopes.x * pose.right + slopes.y * pose.up;
        Ray { origin: pose.position, direction: direction.normalize() }
    }

    /// Right, up and forward of the eye.
    pub(super) fn seen(&self, place: DVec3) -> DVec3 {
        let v = place - self.pose.position;
        DVec3::new(v.dot(self.pose.right), v.dot(self.pose.up), v.dot(self.pose.forward))
    }

    /// Where a place is seen; none of what lies behind the eye.
    pub fn project(&self, place: DVec3) -> Option<DVec2> {
        self.pixel(self.seen(place))
    }

    /// Of (right, up, forward).
    pub(super) fn pixel(&self, seen: DVec3) -> Option<DVec2> {
        if seen.z.is_nan() || seen.z <= 0.0 {
            return None;
        }
        let per_slope = 0.5 * self.size_px.y / (0.5 * self.fov_y_rad).tan();
        let pixel = 0.5 * self.size_px + DVec2::new(seen.x, -seen.y) * (per_slope / seen.z);
        pixel.is_finite().then_some(pixel)
    }

    /// What is seen between two pixels lies where all of these · (right, up, forward) are ≥ 0: a
    /// pyramid without end from the eye.
    pub(super) fn sides(&self, corner: DVec2, opposite: DVec2) -> [DVec3; 5] {
        let (a, b) = (self.slopes(corner), self.slopes(opposite));
        let (low, high) = (a.min(b), a.max(b));
        [
            DVec3::new(1.0, 0.0, -low.x),
            DVec3::new(-1.0, 0.0, high.x),
            DVec3::new(0.0, 1.0, -low.y),
            DVec3::new(0.0, -1.0, high.y),
            DVec3::Z,
        ]
    }

    /// Scene units that a logical point spans at the depth of `place`.
    pub fn units_per_point(&self, place: DVec3) -> f64 {
        2.0 * (0.5 * self.fov_y_rad).tan() * self.seen(place).z / self.size_px.y * self.px_per_point
    }
}

/// All boxes that a ray meets, nearest first: a click takes the first, a further click at the same
/// place may take the next.
pub fn pick_all(boxes: &[CloudBox], ray: &Ray) -> Vec<Hit> {
    let hits = boxes.iter().enumerate();
    let mut hits: Vec<Hit> =
        hits.filter_map(|(i_box, b)| Some(Hit { i_box, distance: ray.hit(b)? })).collect();
    hits.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    hits
}

/// The nearest box that a ray meets.
pub fn pick(boxes: &[CloudBox], ray: &Ray) -> Option<Hit> {
    pick_all(boxes, ray).first().copied()
}

/// Every box of which a part is seen in the rectangle between two pixels, hidden or not.
pub fn pick_rectangle(
    boxes: &[CloudBox],
    view: &Viewport,
    corner: DVec2,
    opposite: DVec2,
) -> Vec<usize> {
    let sides = view.sides(corner, opposite);
    // From a place within both one can go on within the pyramid until the box ends, at a face:
    // faces are all to be asked.
    let is_seen = |b: &CloudBox| {
        let corners = corners(b).map(|corner| view.seen(corner));
        FACES.iter().any(|face| {
            let polygon = face.iter().map(|i| corners[*i]).collect();
            !sides.iter().fold(polygon, |polygon, side| clipped(polygon, *side)).is_empty()
        })
    };
    boxes.iter().enumerate().filter(|(_, b)| is_seen(b)).map(|(i, _)| i).collect()
}

/// Bit k of a corner's number: the high side along axis k.
pub fn corners(b: &CloudBox) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let side = |bit: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
        b.center + DVec3::new(side(0), side(1), side(2)) * b.extent
    })
}

/// Pairs of corners.
pub const EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];

/// Corners around each face: those of the low and the high side along x, y and z.
pub(super) const FACES: [[usize; 4]; 6] =
    [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];

/// What of a convex polygon lies where `side` · v ≥ 0 (Sutherland–Hodgman).
pub(super) fn clipped(polygon: Vec<DVec3>, side: DVec3) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, b) in polygon.iter().enumerate() {
        let a = polygon[(i + polygon.len() - 1) % polygon.len()];
        let (at_a, at_b) = (side.dot(a), side.dot(*b));
        if (at_a < 0.0 && at_b > 0.0) || (at_a > 0.0 && at_b < 0.0) {
            kept.push(a + (at_a / (at_a - at_b)) * (*b - a));
        }
        if at_b >= 0.0 {
            kept.push(*b);
        }
    }
    kept
}

/// Least and greatest coordinates of boxes; none of none.
pub fn bounds<'a>(boxes: impl IntoIterator<Item = &'a CloudBox>) -> Option<(DVec3, DVec3)> {
    let each = boxes.into_iter().map(|b| (b.center - 0.5 * b.extent, b.center + 0.5 * b.extent));
    each.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Where the eye has to be, looking along `forward`, to see all between `low` and `high`; the
/// middle of that is what it looks at then.
pub fn framing(
    low: DVec3,
    high: DVec3,
    forward: DVec3,
    fov_y_rad: f64,
    aspect: f64,
) -> (DVec3, DVec3) {
    let middle = 0.5 * (low + high);
    let half_fov = (0.5 * fov_y_rad).min(((0.5 * fov_y_rad).tan() * aspect).atan());
    // The ball around the box; what has no size is looked at from 1 unit.
    let radius = 0.5 * (high - low).length();
    let distance = if radius > 0.0 { radius / half_fov.sin() } else { 1.0 };
    (middle - distance * forward, middle)
}

#[cfg(test)]
mod tests;
