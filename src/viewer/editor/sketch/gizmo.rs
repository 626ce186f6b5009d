//! Handles, axes and the ground grid.

use glam::{DVec2, DVec3};

use super::{Canvas, Color, Shape, placed, with_alpha};
use crate::viewer::editor::handles::{Handle, Placed};
use crate::viewer::editor::{Axis, Editor};

/// Of x, y and z.
pub const AXES: [Color; 3] = [[226, 70, 70, 255], [110, 190, 70, 255], [80, 130, 240, 255]];
/// What the hand holds or would take hold of.
pub const LIT: Color = [255, 226, 90, 255];
const CENTER: Color = [245, 245, 245, 255];
const GRID: Color = [128, 136, 150, 70];

/// Half the side of a handle's square, and of an arrow's head; logical points.
const SQUARE_POINTS: f64 = 4.5;
const HEAD_POINTS: f64 = 12.0;
/// Lines of the grid on each side of the middle.
const N_LINES: i32 = 10;

/// Whether a fill is one of theirs.
#[cfg(test)]
pub fn is_of_handle(fill: Color) -> bool {
    AXES.contains(&fill) || [LIT, CENTER].contains(&fill)
}

/// Those of the active box; along a constraint, the line that it goes by.
pub fn handles(
    editor: &Editor,
    canvas: &Canvas<'_>,
    hovered: Option<Handle>,
    shapes: &mut Vec<Shape>,
) {
    let Some((i, b)) = editor.active_box() else { return };
    let dragged = editor.dragged_handle();
    if let Some(axis) = dragged.and_then(Handle::axis) {
        let reach = canvas.view.pose.position.distance(b.center) * 10.0 * axis.unit();
        let stroke = canvas.stroke(with_alpha(AXES[axis.index()], 160), 1.0);
        canvas.draw_line(b.center - reach, b.center + reach, stroke, shapes);
    }
    let lit = dragged.or(hovered);
    let mut all = placed(b, canvas.view);
    // What is lit lies over the others.
    all.sort_by_key(|p| Some(p.handle) == lit);
    for p in &all {
        handle(p, canvas, Some(p.handle) == lit, shapes);
    }
    let top = b.center + 0.5 * b.extent;
    if let Some([at, _]) = canvas.line(top, top) {
        let text = format!("box {i}: {}", b.n_particles);
        let at = at + DVec2::new(6.0, -8.0) * canvas.view.px_per_point;
        shapes.push(Shape::Label { at, text, color: CENTER });
    }
}

fn handle(p: &Placed, canvas: &Canvas<'_>, is_lit: bool, shapes: &mut Vec<Shape>) {
    let view = canvas.view;
    let color =
        if is_lit { LIT } else { p.handle.axis().map_or(CENTER, |axis| AXES[axis.index()]) };
    let Some([from, to]) = canvas.line(p.from, p.to) else { return };
    let Handle::MoveAxis(axis) = p.handle else {
        let half = SQUARE_POINTS * view.px_per_point;
        let corner = |x: f64, y: f64| from + half * DVec2::new(x, y);
        let corners =
            vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        shapes.push(Shape::Polygon {
            corners,
            fill: color,
            stroke: Some(canvas.stroke(super::OUTLINE, 1.0)),
        });
        return;
    };
    shapes.push(Shape::Line {
        from,
        to,
        stroke: canvas.stroke(color, if is_lit { 3.5 } else { 2.5 }),
    });
    let along = (to - from).normalize_or(DVec2::X);
    let head = HEAD_POINTS * view.px_per_point;
    let (base, aside) = (to - head * along, 0.4 * head * along.perp());
    let corners = vec![base + aside, to, base - aside];
    shapes.push(Shape::Polygon { corners, fill: color, stroke: None });
    let at = to + (6.0 * view.px_per_point) * along;
    shapes.push(Shape::Label { at, text: ["x", "y", "z"][axis.index()].to_owned(), color });
}

/// How far apart the grid's lines are: a power of ten that suits the way from the eye to the
/// scene's origin.
fn step(canvas: &Canvas<'_>) -> Option<f64> {
    let far = canvas.view.pose.position.length();
    let step = 10f64.powf((far / 4.0).log10().floor());
    (step.is_finite() && step > 0.0).then_some(step)
}

/// Lines of the plane y = 0.
pub fn ground(canvas: &Canvas<'_>, shapes: &mut Vec<Shape>) {
    let Some(step) = step(canvas) else { return };
    let reach = f64::from(N_LINES) * step;
    let stroke = canvas.stroke(GRID, 1.0);
    // The axes' own lines are theirs.
    for k in (-N_LINES..=N_LINES).filter(|k| *k != 0) {
        let at = f64::from(k) * step;
        canvas.draw_line(DVec3::new(at, 0.0, -reach), DVec3::new(at, 0.0, reach), stroke, shapes);
        canvas.draw_line(DVec3::new(-reach, 0.0, at), DVec3::new(reach, 0.0, at), stroke, shapes);
    }
}

/// A cross through the origin.
pub fn axes(canvas: &Canvas<'_>, shapes: &mut Vec<Shape>) {
    let Some(step) = step(canvas) else { return };
    for axis in Axis::ALL {
        // Of y less: it stands before everything.
        let lines = if axis == Axis::Y { 1.0 } else { f64::from(N_LINES) };
        let reach = lines * step * axis.unit();
        canvas.draw_line(
            -reach,
            reach,
            canvas.stroke(with_alpha(AXES[axis.index()], 150), 1.0),
            shapes,
        );
    }
}
