//! Handles of the active box, the axes, and the ground grid.

use glam::{DVec2, DVec3};

use super::canvas::{Canvas, Color, OUTLINE, Shape, with_alpha};
use crate::viewer::editor::axis::Axis;
use crate::viewer::editor::handles::{Handle, PlacedHandle, place_handles};
use crate::viewer::editor::state::Editor;

/// Colours of the x, y and z axis.
pub const AXES: [Color; 3] = [[226, 70, 70, 255], [110, 190, 70, 255], [80, 130, 240, 255]];
/// Colour of the handle that is dragged or hovered.
pub const HIGHLIGHT: Color = [255, 226, 90, 255];
/// Colour of the centre's handle and of labels.
pub const CENTER: Color = [245, 245, 245, 255];
/// Colour of the ground grid, translucent so that boxes and axes stand out.
const GRID: Color = [128, 136, 150, 70];

/// Half the side of a handle's square, points: its corners are within the pointer's reach.
const SQUARE_POINTS: f64 = 4.5;
/// Length of an arrow's head, points: about a fifth of the arrow.
const HEAD_POINTS: f64 = 12.0;
/// Lines of the grid on each side of the middle: the grid ends at the next larger power of ten.
const N_LINES: i32 = 10;

/// Adds the handles and the label of the active box, and the line of a restricted drag.
pub fn draw_handles(editor: &Editor, canvas: &mut Canvas<'_>, hovered: Option<Handle>) {
    let Some((i, b)) = editor.active_box() else { return };
    let view = canvas.view;
    let dragged = editor.dragged_handle();
    if let Some(axis) = dragged.and_then(Handle::axis) {
        let reach = view.pose.position.distance(b.center) * 10.0 * axis.unit();
        let stroke = canvas.stroke(with_alpha(AXES[axis.index()], 160), 1.0);
        canvas.draw_line(b.center - reach, b.center + reach, stroke);
    }
    let highlighted = dragged.or(hovered);
    let mut handles = place_handles(b, view);
    // The highlighted handle is drawn over the others.
    handles.sort_by_key(|p| Some(p.handle) == highlighted);
    handles.iter().for_each(|p| draw_handle(p, canvas, Some(p.handle) == highlighted));
    let top = b.center + 0.5 * b.extent;
    if let Some([at, _]) = canvas.line(top, top) {
        let text = format!("box {i}: {}", b.n_particles);
        let at = at + DVec2::new(6.0, -8.0) * view.px_per_point;
        canvas.shapes.push(Shape::Label { at, text, color: CENTER });
    }
}

fn draw_handle(p: &PlacedHandle, canvas: &mut Canvas<'_>, is_highlighted: bool) {
    let point = canvas.view.px_per_point;
    let color = match p.handle.axis() {
        _ if is_highlighted => HIGHLIGHT,
        Some(axis) => AXES[axis.index()],
        None => CENTER,
    };
    let Some([from, to]) = canvas.line(p.from, p.to) else { return };
    let Handle::MoveAxis(axis) = p.handle else {
        let corner = |(x, y)| from + SQUARE_POINTS * point * DVec2::new(x, y);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner).to_vec();
        let outline = Some(canvas.stroke(OUTLINE, 1.0));
        canvas.shapes.push(Shape::Polygon { corners, fill: color, outline });
        return;
    };
    let stroke = canvas.stroke(color, if is_highlighted { 3.5 } else { 2.5 });
    let along = (to - from).normalize_or(DVec2::X);
    let head = HEAD_POINTS * point;
    let (base, aside) = (to - head * along, 0.4 * head * along.perp());
    let corners = vec![base + aside, to, base - aside];
    let at = to + (6.0 * point) * along;
    canvas.shapes.extend([
        Shape::Line { from, to, stroke },
        Shape::Polygon { corners, fill: color, outline: None },
        Shape::Label { at, text: axis.name().to_owned(), color },
    ]);
}

/// Returns the distance of grid lines: the largest power of ten that is at most a quarter of the
/// camera's distance from the origin.
fn grid_step(canvas: &Canvas<'_>) -> Option<f64> {
    let distance = canvas.view.pose.position.length();
    let step = 10f64.powf((distance / 4.0).log10().floor());
    (step.is_finite() && step > 0.0).then_some(step)
}

/// Adds a grid in the plane y = 0, without the lines of the axes.
pub fn draw_ground(canvas: &mut Canvas<'_>) {
    let Some(step) = grid_step(canvas) else { return };
    let reach = f64::from(N_LINES) * step;
    let stroke = canvas.stroke(GRID, 1.0);
    for k in (-N_LINES..=N_LINES).filter(|k| *k != 0) {
        let at = f64::from(k) * step;
        canvas.draw_line(DVec3::new(at, 0.0, -reach), DVec3::new(at, 0.0, reach), stroke);
        canvas.draw_line(DVec3::new(-reach, 0.0, at), DVec3::new(reach, 0.0, at), stroke);
    }
}

/// Adds the axes through the origin.
pub fn draw_axes(canvas: &mut Canvas<'_>) {
    let Some(step) = grid_step(canvas) else { return };
    for axis in Axis::ALL {
        // The y axis is short, because it would stand in front of everything.
        let n_steps = if axis == Axis::Y { 1.0 } else { f64::from(N_LINES) };
        let reach = n_steps * step * axis.unit();
        let stroke = canvas.stroke(with_alpha(AXES[axis.index()], 150), 1.0);
        canvas.draw_line(-reach, reach, stroke);
    }
}
