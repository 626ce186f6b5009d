//! The mapping between scene and pixels: rays, projection, picking by point or rectangle, and
//! framing.

use glam::{DVec2, DVec3};

use super::ray::Ray;
use crate::model::boxes::CloudBox;
use crate::model::camera::Pose;

/// A camera and the area that its picture fills.
///
/// Pixels are real coordinates from the upper left corner; the centre of the first pixel is
/// (0.5, 0.5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewport {
    /// Position and axes of the camera.
    pub pose: Pose,
    /// Vertical field of view, rad.
    pub fov_y_rad: f64,
    /// Width and height in pixels.
    pub size_px: DVec2,
    /// Pixels per logical point. Sizes of handles are given in points.
    pub px_per_point: f64,
}

impl Viewport {
    /// Returns the slopes of a pixel's ray: right and up over forward.
    fn slopes(&self, pixel: DVec2) -> DVec2 {
        let tangent = (0.5 * self.fov_y_rad).tan();
        let of_height = 2.0 * tangent / self.size_px.y;
        DVec2::new(pixel.x - 0.5 * self.size_px.x, 0.5 * self.size_px.y - pixel.y) * of_height
    }

    /// Returns the ray through a pixel.
    pub fn ray(&self, pixel: DVec2) -> Ray {
        let (slopes, pose) = (self.slopes(pixel), &self.pose);
        let direction = pose.forward + slopes.x * pose.right + slopes.y * pose.up;
        Ray { origin: pose.position, direction: direction.normalize() }
    }

    /// Returns a place in view space: right, up and forward of the camera.
    pub(super) fn in_view_space(&self, place: DVec3) -> DVec3 {
        let v = place - self.pose.position;
        DVec3::new(v.dot(self.pose.right), v.dot(self.pose.up), v.dot(self.pose.forward))
    }

    /// Returns the pixel of a place; `None` behind the camera.
    pub fn project(&self, place: DVec3) -> Option<DVec2> {
        self.project_view(self.in_view_space(place))
    }

    /// Returns the pixel of a place in view space.
    pub(super) fn project_view(&self, place_view: DVec3) -> Option<DVec2> {
        let DVec3 { x, y, z } = place_view;
        if z.is_nan() || z <= 0.0 {
            return None;
        }
        let per_slope = 0.5 * self.size_px.y / (0.5 * self.fov_y_rad).tan();
        let pixel = 0.5 * self.size_px + DVec2::new(x, -y) * (per_slope / z);
        pixel.is_finite().then_some(pixel)
    }

    /// Returns the planes of the infinite pyramid between two pixels. A place in view space is
    /// inside where its product with each plane is ≥ 0.
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

    /// Returns the scene units of one logical point at the depth of `place`.
    pub fn units_per_point(&self, place: DVec3) -> f64 {
        2.0 * (0.5 * self.fov_y_rad).tan() * self.in_view_space(place).z / self.size_px.y
            * self.px_per_point
    }
}

/// Returns the indices of all boxes that a ray hits, nearest first.
pub fn pick_all(boxes: &[CloudBox], ray: &Ray) -> Vec<usize> {
    let hits = boxes.iter().enumerate().filter_map(|(i, b)| Some((i, ray.hit(b)?)));
    let mut hits: Vec<(usize, f64)> = hits.collect();
    hits.sort_by(|a, b| a.1.total_cmp(&b.1));
    hits.into_iter().map(|(i, _)| i).collect()
}

/// Returns every box with a part inside the rectangle between two pixels, whether or not other
/// boxes hide it.
pub fn pick_rectangle(
    boxes: &[CloudBox],
    view: &Viewport,
    corner: DVec2,
    opposite: DVec2,
) -> Vec<usize> {
    let sides = view.sides(corner, opposite);
    // The pyramid is infinite and the box is not, so the pyramid meets a face if it meets the box.
    let is_inside = |b: &CloudBox| {
        let corners = corners(b).map(|corner| view.in_view_space(corner));
        FACES.iter().any(|face| {
            let polygon = face.iter().map(|i| corners[*i]).collect();
            !sides.iter().fold(polygon, |polygon, side| clipped(polygon, *side)).is_empty()
        })
    };
    boxes.iter().enumerate().filter(|(_, b)| is_inside(b)).map(|(i, _)| i).collect()
}

/// Returns the corners of a box. Bit k of a corner's index is its side along axis k.
pub fn corners(b: &CloudBox) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let side = |bit: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
        b.center + DVec3::new(side(0), side(1), side(2)) * b.extent
    })
}

/// Faces as cycles of corners: the low and the high side along x, y and z.
pub(super) const FACES: [[usize; 4]; 6] =
    [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];

/// Returns the part of a convex polygon where `side` · v ≥ 0.
///
/// *Source*: Sutherland–Hodgman.
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

/// Returns the lower and upper bounds of boxes; `None` without boxes.
pub fn bounds<'a>(boxes: impl IntoIterator<Item = &'a CloudBox>) -> Option<(DVec3, DVec3)> {
    let each = boxes.into_iter().map(|b| (b.center - 0.5 * b.extent, b.center + 0.5 * b.extent));
    each.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Returns the camera position from which all between `low` and `high` is in view along `forward`,
/// and the middle, which is the target.
pub fn framing(
    low: DVec3,
    high: DVec3,
    forward: DVec3,
    fov_y_rad: f64,
    aspect: f64,
) -> (DVec3, DVec3) {
    let middle = 0.5 * (low + high);
    let half_fov = (0.5 * fov_y_rad).min(((0.5 * fov_y_rad).tan() * aspect).atan());
    // The bounding sphere decides. A point is viewed from a distance of 1 unit.
    let radius = 0.5 * (high - low).length();
    let distance = if radius > 0.0 { radius / half_fov.sin() } else { 1.0 };
    (middle - distance * forward, middle)
}

#[cfg(test)]
mod tests;
