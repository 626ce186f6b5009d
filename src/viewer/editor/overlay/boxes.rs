//! Boxes as solids or as edges (P, Figs. 3 and 5); the active box is red.

use glam::{DVec2, DVec3};

use super::canvas::{Canvas, Color, OUTLINE, Shape, Stroke, with_alpha};
use crate::model::boxes::CloudBox;
use crate::viewer::editor::axis::Axis;
use crate::viewer::editor::state::Editor;
use crate::viewer::editor::viewport::{FACES, corners};

/// Largest number of the nearest boxes that are drawn, and of further selected boxes. It bounds an
/// update of the overlay to some milliseconds.
pub const MAX_DRAWN: usize = 4096;

/// Colour of the faces of boxes that are not active.
const GREY: Color = [150, 164, 188, 255];
/// Colour of the active box.
pub const RED: Color = [214, 52, 44, 255];
/// Outline of selected boxes.
pub const ORANGE: Color = [255, 150, 30, 255];
/// Colour of the edges of unselected boxes without faces. It is translucent over the cloud.
pub const EDGE: Color = [196, 206, 222, 200];
/// Alpha of the active box's faces over the cloud: a quarter, so that the cloud shows through.
pub const TRANSLUCENT: u8 = 64;

/// Returns the boxes to draw, and for every box whether it is selected.
fn visible_boxes(editor: &Editor, canvas: &Canvas<'_>) -> (Vec<usize>, Vec<bool>) {
    let boxes = editor.boxes();
    let mask = editor.selection().mask(boxes.len());
    let may_show = |i: &usize| canvas.may_show(boxes[*i].center, 0.5 * boxes[*i].extent.length());
    let mut visible: Vec<usize> = (0..boxes.len()).filter(may_show).collect();
    if visible.len() > MAX_DRAWN {
        let distance = |i: &usize| boxes[*i].center.distance_squared(canvas.view.pose.position);
        visible.select_nth_unstable_by(MAX_DRAWN, |a, b| distance(a).total_cmp(&distance(b)));
        let mut selected = visible.split_off(MAX_DRAWN);
        selected.retain(|i| mask[*i]);
        selected.sort_by_key(|i| Some(*i) != editor.selection().active());
        selected.truncate(MAX_DRAWN);
        visible.extend(selected);
    }
    (visible, mask)
}

/// Adds the opaque faces that look at the camera, the farthest middle first.
///
/// For boxes of very different sizes this is not always the order in which they hide each other,
/// and intersecting boxes have none. Both show when the camera turns.
pub fn draw_solid(editor: &Editor, canvas: &mut Canvas<'_>) {
    let (visible, mask) = visible_boxes(editor, canvas);
    let active = editor.selection().active();
    let mut faces: Vec<(f64, Shape)> = Vec::with_capacity(3 * visible.len());
    for i in visible {
        let b = &editor.boxes()[i];
        let (color, outline) = match mask[i] {
            true if active == Some(i) => (RED, canvas.stroke(OUTLINE, 1.5)),
            true => (GREY, canvas.stroke(ORANGE, 2.0)),
            false => (GREY, canvas.stroke(OUTLINE, 1.0)),
        };
        if contains_camera(b, canvas) {
            draw_box_edges(
                b,
                canvas,
                Stroke { color: if mask[i] { color } else { EDGE }, ..outline },
            );
            continue;
        }
        faces.extend(front_faces(b, canvas).into_iter().map(|face| {
            let fill = shaded(canvas, color, face.normal);
            let distance = face.middle.distance_squared(canvas.view.pose.position);
            (distance, Shape::Polygon { corners: face.corners, fill, outline: Some(outline) })
        }));
    }
    faces.sort_by(|a, b| b.0.total_cmp(&a.0));
    canvas.shapes.extend(faces.into_iter().map(|(_, shape)| shape));
}

/// Adds edges, between which the cloud shows, and the active box's faces as red glass.
pub fn draw_edges(editor: &Editor, canvas: &mut Canvas<'_>) {
    let (visible, mask) = visible_boxes(editor, canvas);
    let active = editor.selection().active();
    // Selected boxes are drawn over the others, and the active box over all.
    for (is_selected, color, points) in [(false, EDGE, 1.0), (true, ORANGE, 1.5)] {
        let stroke = canvas.stroke(color, points);
        for i in visible.iter().filter(|i| mask[**i] == is_selected && active != Some(**i)) {
            draw_box_edges(&editor.boxes()[*i], canvas, stroke);
        }
    }
    let Some((_, b)) = editor.active_box() else { return };
    if !contains_camera(b, canvas) {
        for face in front_faces(b, canvas) {
            let fill = with_alpha(shaded(canvas, RED, face.normal), TRANSLUCENT);
            canvas.shapes.push(Shape::Polygon { corners: face.corners, fill, outline: None });
        }
    }
    draw_box_edges(b, canvas, canvas.stroke(RED, 2.0));
}

fn draw_box_edges(b: &CloudBox, canvas: &mut Canvas<'_>, stroke: Stroke) {
    let corners = corners(b);
    // An edge joins two corners whose indices differ in one bit.
    for (i, bit) in (0..8).flat_map(|i| [1, 2, 4].map(|bit| (i, bit))) {
        if i & bit == 0 {
            canvas.draw_line(corners[i], corners[i | bit], stroke);
        }
    }
}

fn contains_camera(b: &CloudBox, canvas: &Canvas<'_>) -> bool {
    (canvas.view.pose.position - b.center).abs().cmple(0.5 * b.extent).all()
}

/// A face, with the pixels of its visible part.
struct Face {
    middle: DVec3,
    normal: DVec3,
    corners: Vec<DVec2>,
}

/// Returns the visible faces that look at the camera.
fn front_faces(b: &CloudBox, canvas: &Canvas<'_>) -> Vec<Face> {
    let corners = corners(b);
    let of = |(i, face): (usize, &[usize; 4])| {
        let normal = if i % 2 == 0 { -1.0 } else { 1.0 } * Axis::ALL[i / 2].unit();
        let middle = b.center + 0.5 * b.extent * normal;
        if normal.dot(canvas.view.pose.position - middle) <= 0.0 {
            return None;
        }
        Some(Face { middle, normal, corners: canvas.polygon(&face.map(|i| corners[i]))? })
    };
    FACES.iter().enumerate().filter_map(of).collect()
}

/// Returns a face's colour under a light above, to the left, and behind the camera.
fn shaded(canvas: &Canvas<'_>, [r, g, b, a]: Color, normal: DVec3) -> Color {
    let pose = &canvas.view.pose;
    let toward_light = (-0.5 * pose.right + 0.8 * pose.up - 0.45 * pose.forward).normalize();
    // The darkest face is still lighter than an outline.
    let share = 0.4 + 0.6 * (0.5 + 0.5 * normal.dot(toward_light));
    let [r, g, b] = [r, g, b].map(|c| (f64::from(c) * share).round() as u8);
    [r, g, b, a]
}
