//! Two-dimensional shapes, clipped to the picture before they are projected.
//!
//! Clipping in view space keeps parts behind the camera from appearing mirrored.

use glam::{DVec2, DVec3};

use crate::viewer::editor::viewport::{Viewport, clipped};

/// sRGB with alpha, not premultiplied.
pub type Color = [u8; 4];

/// A shape in pixels, as [`Viewport`] counts them. Parts of the scene end at most
/// [`MARGIN_POINTS`] beyond the picture.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A convex polygon of at least three corners.
    Polygon {
        corners: Vec<DVec2>,
        fill: Color,
        outline: Option<Stroke>,
    },
    Line {
        from: DVec2,
        to: DVec2,
        stroke: Stroke,
    },
    /// Text with its left end, at half its height, at `at`.
    Label {
        at: DVec2,
        text: String,
        color: Color,
    },
}

/// Colour and width of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Colour of the line.
    pub color: Color,
    /// Width in pixels.
    pub width_px: f64,
}

/// Margin beyond the picture, so that outlines along its edge are not visible, points.
pub const MARGIN_POINTS: f64 = 8.0;

/// Outline of faces and handles.
pub const OUTLINE: Color = [40, 46, 58, 255];

/// Returns a colour with another alpha.
pub fn with_alpha([r, g, b, _]: Color, alpha: u8) -> Color {
    [r, g, b, alpha]
}

/// Shapes of one picture, back to front.
pub struct Canvas<'a> {
    /// The camera and the picture area.
    pub view: &'a Viewport,
    /// The shapes so far, back to front.
    pub shapes: Vec<Shape>,
    /// Planes of the pyramid in view.
    sides: [DVec3; 5],
}

impl Canvas<'_> {
    /// Creates a canvas without shapes.
    pub fn new(view: &Viewport) -> Canvas<'_> {
        let margin = DVec2::splat(MARGIN_POINTS * view.px_per_point);
        let sides = view.sides(-margin, view.size_px + margin);
        Canvas { view, shapes: vec![], sides }
    }

    /// Returns a stroke with a width in points.
    pub fn stroke(&self, color: Color, points: f64) -> Stroke {
        Stroke { color, width_px: points * self.view.px_per_point }
    }

    /// Returns the visible part of a convex polygon; `None` where it is less than a triangle.
    pub fn polygon(&self, places: &[DVec3]) -> Option<Vec<DVec2>> {
        let in_view = places.iter().map(|place| self.view.in_view_space(*place)).collect();
        let kept = self.sides.iter().fold(in_view, |polygon, side| clipped(polygon, *side));
        let pixels: Option<Vec<DVec2>> =
            kept.into_iter().map(|v| self.view.project_view(v)).collect();
        pixels.filter(|pixels| pixels.len() > 2)
    }

    /// Returns the visible part of a line.
    pub fn line(&self, from: DVec3, to: DVec3) -> Option<[DVec2; 2]> {
        let (mut a, mut b) = (self.view.in_view_space(from), self.view.in_view_space(to));
        for side in self.sides {
            let (at_a, at_b) = (side.dot(a), side.dot(b));
            match (at_a >= 0.0, at_b >= 0.0) {
                (true, true) => {}
                (false, false) => return None,
                (true, false) => b = a + (at_a / (at_a - at_b)) * (b - a),
                (false, true) => a += (at_a / (at_a - at_b)) * (b - a),
            }
        }
        Some([self.view.project_view(a)?, self.view.project_view(b)?])
    }

    /// Adds the visible part of a line.
    pub fn draw_line(&mut self, from: DVec3, to: DVec3, stroke: Stroke) {
        if let Some([from, to]) = self.line(from, to) {
            self.shapes.push(Shape::Line { from, to, stroke });
        }
    }

    /// Returns whether a sphere may be visible.
    pub fn may_show(&self, center: DVec3, radius: f64) -> bool {
        let center = self.view.in_view_space(center);
        self.sides.iter().all(|side| side.dot(center) >= -radius * side.length())
    }
}
