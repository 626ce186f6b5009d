//! What a painter of two dimensions draws over the cloud, back to front: boxes as P, Figs. 3 and 5
//! have them, the active one red; the handles of that one; a ground grid, and the axes. All is cut
//! off at the picture's edge before it is projected, so that what lies behind the eye, or around
//! it, never shows on the wrong side.

mod gizmo;

use glam::{DVec2, DVec3};

use super::handles::Handle;
use super::state::{Editor, View};
use super::viewport::{EDGES, FACES, Viewport, clipped, corners};
use super::{Axis, handles::placed};
use crate::model::boxes::CloudBox;

/// sRGB and alpha, not premultiplied.
pub type Color = [u8; 4];

/// Pixels, as [`Viewport`] counts them. What the scene has goes no farther than [`MARGIN_POINTS`]
/// beyond the picture.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Convex, of three corners at least.
    Polygon {
        corners: Vec<DVec2>,
        fill: Color,
        /// Around it.
        stroke: Option<Stroke>,
    },
    Line {
        from: DVec2,
        to: DVec2,
        stroke: Stroke,
    },
    /// Its left end, halfway up.
    Label {
        at: DVec2,
        text: String,
        color: Color,
    },
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    pub color: Color,
    pub width_px: f64,
}

/// What the pointer is about.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pointing {
    /// What a press would take hold of.
    pub hovered: Option<Handle>,
    /// Corners of the rectangle that selects.
    pub rectangle: Option<[DVec2; 2]>,
}

/// Strokes along the picture's edge lie outside of it.
pub const MARGIN_POINTS: f64 = 8.0;
/// The nearest boxes that are drawn, at most, and as many of the others that are selected: a
/// painter's milliseconds.
pub const MOST_DRAWN: usize = 4096;

const GREY: Color = [150, 164, 188, 255];
const RED: Color = [214, 52, 44, 255];
const ORANGE: Color = [255, 150, 30, 255];
const OUTLINE: Color = [40, 46, 58, 255];
const EDGE: Color = [196, 206, 222, 200];
const RECTANGLE: Color = [120, 170, 255, 255];
/// Of the active box's faces where the cloud is to shine through.
const TRANSLUCENT: u8 = 64;

/// The editor as its `settings().view` says, back to front.
pub fn sketch(editor: &Editor, view: &Viewport, pointing: Pointing) -> Vec<Shape> {
    let canvas = Canvas::new(view);
    let mut shapes = vec![];
    match editor.settings().view {
        View::Boxes => {
            gizmo::ground(&canvas, &mut shapes);
            gizmo::axes(&canvas, &mut shapes);
            faces(editor, &canvas, &mut shapes);
        }
        View::Both => {
            gizmo::axes(&canvas, &mut shapes);
            edges(editor, &canvas, &mut shapes);
        }
        View::Cloud => {}
    }
    gizmo::handles(editor, &canvas, pointing.hovered, &mut shapes);
    if let Some([a, b]) = pointing.rectangle {
        let corners = vec![a, DVec2::new(b.x, a.y), b, DVec2::new(a.x, b.y)];
        let stroke = Some(canvas.stroke(RECTANGLE, 1.0));
        shapes.push(Shape::Polygon { corners, fill: with_alpha(RECTANGLE, 40), stroke });
    }
    shapes
}

/// The picture, and what of the scene is in it.
struct Canvas<'a> {
    view: &'a Viewport,
    sides: [DVec3; 5],
}

impl Canvas<'_> {
    fn new(view: &Viewport) -> Canvas<'_> {
        let margin = DVec2::splat(MARGIN_POINTS * view.px_per_point);
        Canvas { view, sides: view.sides(-margin, view.size_px + margin) }
    }

    fn stroke(&self, color: Color, points: f64) -> Stroke {
        Stroke { color, width_px: points * self.view.px_per_point }
    }

    /// What is in the picture of a convex polygon; none where that is less than a triangle.
    fn polygon(&self, places: &[DVec3]) -> Option<Vec<DVec2>> {
        let seen = places.iter().map(|place| self.view.seen(*place)).collect();
        let kept = self.sides.iter().fold(seen, |polygon, side| clipped(polygon, *side));
        let pixels: Option<Vec<DVec2>> =
            kept.into_iter().map(|seen| self.view.pixel(seen)).collect();
        pixels.filter(|pixels| pixels.len() > 2)
    }

    /// And of a line.
    fn line(&self, from: DVec3, to: DVec3) -> Option<[DVec2; 2]> {
        let (mut a, mut b) = (self.view.seen(from), self.view.seen(to));
        for side in self.sides {
            let (at_a, at_b) = (side.dot(a), side.dot(b));
            match (at_a >= 0.0, at_b >= 0.0) {
                (true, true) => {}
                (false, false) => return None,
                (true, false) => b = a + (at_a / (at_a - at_b)) * (b - a),
                (false, true) => a += (at_a / (at_a - at_b)) * (b - a),
            }
        }
        Some([self.view.pixel(a)?, self.view.pixel(b)?])
    }

    fn draw_line(&self, from: DVec3, to: DVec3, stroke: Stroke, shapes: &mut Vec<Shape>) {
        if let Some([from, to]) = self.line(from, to) {
            shapes.push(Shape::Line { from, to, stroke });
        }
    }

    /// Whether the ball around a box may be in the picture.
    fn may_show(&self, b: &CloudBox) -> bool {
        let (center, radius) = (self.view.seen(b.center), 0.5 * b.extent.length());
        self.sides.iter().all(|side| side.dot(center) >= -radius * side.length())
    }

    /// A face's colour: light comes from above on the left, from behind the eye.
    fn shaded(&self, color: Color, normal: DVec3) -> Color {
        let pose = &self.view.pose;
        let toward_light = (-0.5 * pose.right + 0.8 * pose.up - 0.45 * pose.forward).normalize();
        // Never so dark that an edge is lost in it.
        let share = 0.4 + 0.6 * (0.5 + 0.5 * normal.dot(toward_light));
        let [r, g, b, a] = color;
        let shade = |c: u8| (f64::from(c) * share).round() as u8;
        [shade(r), shade(g), shade(b), a]
    }
}

/// Numbers of boxes to draw, and which are selected.
fn drawn(editor: &Editor, canvas: &Canvas<'_>) -> (Vec<usize>, Vec<bool>) {
    let boxes = editor.boxes();
    let mask = editor.selection().mask(boxes.len());
    let mut drawn: Vec<usize> = (0..boxes.len()).filter(|i| canvas.may_show(&boxes[*i])).collect();
    if drawn.len() > MOST_DRAWN {
        let eye = canvas.view.pose.position;
        let distance = |i: &usize| boxes[*i].center.distance_squared(eye);
        drawn.select_nth_unstable_by(MOST_DRAWN, |a, b| distance(a).total_cmp(&distance(b)));
        // The active one first of those.
        let mut others: Vec<usize> =
            drawn.split_off(MOST_DRAWN).into_iter().filter(|i| mask[*i]).collect();
        others.sort_by_key(|i| Some(*i) != editor.selection().active());
        others.truncate(MOST_DRAWN);
        drawn.extend(others);
    }
    (drawn, mask)
}

/// Opaque faces that look at the eye, the farthest first by their middles' distance. Of boxes of
/// very different sizes that is not always the order in which they hide each other, and boxes that
/// pass through each other have none: both are seen to be so as soon as the camera turns.
fn faces(editor: &Editor, canvas: &Canvas<'_>, shapes: &mut Vec<Shape>) {
    let (drawn, mask) = drawn(editor, canvas);
    let active = editor.selection().active();
    let mut faces: Vec<(f64, Shape)> = Vec::with_capacity(3 * drawn.len());
    for i in drawn {
        let b = &editor.boxes()[i];
        let (color, outline) = match mask[i] {
            true if active == Some(i) => (RED, canvas.stroke(OUTLINE, 1.5)),
            true => (GREY, canvas.stroke(ORANGE, 2.0)),
            false => (GREY, canvas.stroke(OUTLINE, 1.0)),
        };
        if surrounds_eye(b, canvas) {
            draw_edges(
                b,
                canvas,
                Stroke { color: if mask[i] { color } else { EDGE }, ..outline },
                shapes,
            );
            continue;
        }
        faces.extend(facing(b, canvas).map(|(middle, normal, corners)| {
            let fill = canvas.shaded(color, normal);
            (
                middle.distance_squared(canvas.view.pose.position),
                Shape::Polygon { corners, fill, stroke: Some(outline) },
            )
        }));
    }
    faces.sort_by(|a, b| b.0.total_cmp(&a.0));
    shapes.extend(faces.into_iter().map(|(_, shape)| shape));
}

/// Edges alone, through which the cloud shows, and the active box's faces like red glass.
fn edges(editor: &Editor, canvas: &Canvas<'_>, shapes: &mut Vec<Shape>) {
    let (drawn, mask) = drawn(editor, canvas);
    let active = editor.selection().active();
    // What is selected lies over what is not, the active box over all.
    for i in drawn.iter().copied().filter(|i| !mask[*i]) {
        draw_edges(&editor.boxes()[i], canvas, canvas.stroke(EDGE, 1.0), shapes);
    }
    for i in drawn.iter().copied().filter(|i| mask[*i] && active != Some(*i)) {
        draw_edges(&editor.boxes()[i], canvas, canvas.stroke(ORANGE, 1.5), shapes);
    }
    let Some((_, b)) = editor.active_box() else { return };
    if !surrounds_eye(b, canvas) {
        shapes.extend(facing(b, canvas).map(|(_, normal, corners)| {
            let fill = with_alpha(canvas.shaded(RED, normal), TRANSLUCENT);
            Shape::Polygon { corners, fill, stroke: None }
        }));
    }
    draw_edges(b, canvas, canvas.stroke(RED, 2.0), shapes);
}

fn draw_edges(b: &CloudBox, canvas: &Canvas<'_>, stroke: Stroke, shapes: &mut Vec<Shape>) {
    let corners = corners(b);
    for [i, k] in EDGES {
        canvas.draw_line(corners[i], corners[k], stroke, shapes);
    }
}

fn surrounds_eye(b: &CloudBox, canvas: &Canvas<'_>) -> bool {
    (canvas.view.pose.position - b.center).abs().cmple(0.5 * b.extent).all()
}

/// Middle, normal and pixels of the faces that look at the eye.
fn facing<'a>(
    b: &'a CloudBox,
    canvas: &'a Canvas<'_>,
) -> impl Iterator<Item = (DVec3, DVec3, Vec<DVec2>)> + 'a {
    let corners = corners(b);
    FACES.iter().enumerate().filter_map(move |(i, face)| {
        let normal = if i % 2 == 0 { -1.0 } else { 1.0 } * Axis::ALL[i / 2].unit();
        let middle = b.center + 0.5 * b.extent * normal;
        if normal.dot(canvas.view.pose.position - middle) <= 0.0 {
            return None;
        }
        Some((middle, normal, canvas.polygon(&face.map(|i| corners[i]))?))
    })
}

fn with_alpha([r, g, b, _]: Color, alpha: u8) -> Color {
    [r, g, b, alpha]
}

#[cfg(test)]
mod tests;
