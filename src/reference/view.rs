//! The view of a reference picture: camera, size and the limits beyond which blobs are not drawn
//! (model.md §9).

use glam::{DVec2, DVec3};

use super::Blob;
use crate::model::camera::Pose;
use crate::model::edge::Edge;

/// A view: camera, picture size and cuts. `pose.position` is the eye relative to O.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pose of the camera.
    pub pose: Pose,
    /// Vertical field of view.
    pub fov_y_rad: f64,
    /// Least view depth of a drawn particle's centre.
    pub near: f64,
    /// Where sprites end.
    pub edge: Edge,
    /// Width in pixels of σ below which blobs are left out; 0 leaves out none.
    pub smallest: f64,
    /// Thickness of a slice; 0 where blobs are composed one after the other.
    pub slice: f64,
    /// Slices among which a blob is dealt, where there are any.
    pub n_parts: u32,
    /// Offset of the rays from the pixels' centres, to the right and down, pixels within ±½.
    pub shift: DVec2,
}

#[cfg(test)]
impl View {
    /// Eye at the origin, looking along −z, one pixel.
    pub(super) const ONE_PIXEL: View = View {
        width: 1,
        height: 1,
        pose: Pose { position: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z },
        fov_y_rad: 1.0,
        near: 0.5,
        edge: Edge::at(3.0),
        smallest: 0.0,
        slice: 0.0,
        n_parts: 4,
        shift: DVec2::ZERO,
    };
}

impl View {
    pub(super) fn half_slopes(&self) -> (f64, f64) {
        let tan = (0.5 * self.fov_y_rad).tan();
        (tan * f64::from(self.width) / f64::from(self.height), tan)
    }

    /// Returns by how much a blob's σ exceeds the smallest drawn width, `c` its offset from the
    /// eye; if negative the blob is not drawn (passes.md "cull"). The second value bounds a
    /// device's error, with `depth` as in [`super::composite::Rounding`].
    pub fn above_smallest(&self, blob: &Blob, c: DVec3, depth: f64) -> (f64, f64) {
        let width = self.smallest * self.pixel();
        (blob.widest() - width * c.dot(self.pose.forward), width * depth * c.length())
    }

    /// Returns the ray through the pixel in column `i` and row `j`, at its centre plus `shift`. Its
    /// view depth is 1.
    pub fn ray(&self, i: u32, j: u32) -> DVec3 {
        let (slope_x, slope_y) = self.half_slopes();
        let x = 2.0 * (f64::from(i) + 0.5 + self.shift.x) / f64::from(self.width) - 1.0;
        let y = 1.0 - 2.0 * (f64::from(j) + 0.5 + self.shift.y) / f64::from(self.height);
        self.pose.forward + x * slope_x * self.pose.right + y * slope_y * self.pose.up
    }

    /// Returns the slopes of the direction `offset`.
    pub fn slopes_of(&self, offset: DVec3) -> DVec2 {
        DVec2::new(offset.dot(self.pose.right), offset.dot(self.pose.up))
            / offset.dot(self.pose.forward)
    }

    /// Returns the difference of slopes between neighbouring pixels.
    pub fn pixel(&self) -> f64 {
        2.0 * self.half_slopes().1 / f64::from(self.height)
    }

    /// Returns the columns and rows (first, end) outside which no ray meets `blob` out to `reach`
    /// σ, `c` its offset from the eye. The range may be too large, never too small.
    pub fn rectangle(&self, blob: &Blob, c: DVec3, reach: f64) -> [(u32, u32); 2] {
        let (slope_x, slope_y) = self.half_slopes();
        let [x, y] = [self.pose.right, self.pose.up]
            .map(|side| blob.slopes(c, [side, self.pose.forward], reach));
        let pixels = |(low, high): (f64, f64), slope: f64, n: u32| {
            let at = |s: f64| 0.5 * (s / slope + 1.0) * f64::from(n);
            // One pixel to either side covers the rounding of the tangents and a shift of up to
            // half a pixel. `as` saturates, and `min` keeps it inside.
            let from = ((at(low) - 1.0).floor() as u32).min(n);
            (from, ((at(high) + 1.0).ceil() as u32).clamp(from, n))
        };
        // Rows count downward.
        [pixels(x, slope_x, self.width), pixels((-y.1, -y.0), slope_y, self.height)]
    }
}
