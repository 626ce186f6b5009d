//! Shapes that are drawn over the cloud, back to front: boxes, handles, axes, grid and selection
//! rectangle.

mod boxes;
mod canvas;
mod gizmo;

use glam::DVec2;

use super::controller::PointerFeedback;
use super::settings::DisplayMode;
use super::state::Editor;
use super::viewport::Viewport;
use canvas::{Canvas, with_alpha};
pub use canvas::{Color, Shape, Stroke};

/// Colour of the selection rectangle; its fill is translucent.
const RECTANGLE: Color = [120, 170, 255, 255];

/// Returns the shapes of the editor's state.
pub fn overlay_shapes(editor: &Editor, view: &Viewport, feedback: PointerFeedback) -> Vec<Shape> {
    let mut canvas = Canvas::new(view);
    match editor.settings().display {
        DisplayMode::Boxes => {
            gizmo::draw_ground(&mut canvas);
            gizmo::draw_axes(&mut canvas);
            boxes::draw_solid(editor, &mut canvas);
        }
        DisplayMode::Both => {
            gizmo::draw_axes(&mut canvas);
            boxes::draw_edges(editor, &mut canvas);
        }
        DisplayMode::Cloud => {}
    }
    gizmo::draw_handles(editor, &mut canvas, feedback.hovered);
    if let Some([a, b]) = feedback.rectangle {
        let corners = vec![a, DVec2::new(b.x, a.y), b, DVec2::new(a.x, b.y)];
        let outline = Some(canvas.stroke(RECTANGLE, 1.0));
        let fill = with_alpha(RECTANGLE, 40);
        canvas.shapes.push(Shape::Polygon { corners, fill, outline });
    }
    canvas.shapes
}

#[cfg(test)]
mod tests;
