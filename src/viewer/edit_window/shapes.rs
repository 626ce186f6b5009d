//! Draws the editor's overlay with egui.

use egui::{Align2, Color32, FontId, Pos2, Rect, Stroke, Ui, pos2, vec2};
use glam::DVec2;

use crate::viewer::editor::{self, Color, EditorController, Shape, overlay_shapes};

/// Draws boxes, handles and selection rectangle over the picture.
pub fn draw(ui: &Ui, controller: &EditorController) {
    let view = controller.viewport();
    let points = |px: f64| (px / view.px_per_point) as f32;
    let point = |p: DVec2| -> Pos2 { pos2(points(p.x), points(p.y)) };
    let color = |[r, g, b, a]: Color| Color32::from_rgba_unmultiplied(r, g, b, a);
    let stroke = |s: editor::Stroke| Stroke::new(points(s.width_px), color(s.color));
    let size = vec2(points(view.size_px.x), points(view.size_px.y));
    let painter = ui.painter_at(Rect::from_min_size(Pos2::ZERO, size));
    for shape in overlay_shapes(controller.editor(), &view, controller.feedback()) {
        match shape {
            Shape::Polygon { corners, fill, outline } => {
                let corners = corners.into_iter().map(point).collect();
                let outline = outline.map_or(Stroke::NONE, stroke);
                painter.add(egui::Shape::convex_polygon(corners, color(fill), outline));
            }
            Shape::Line { from, to, stroke: s } => {
                painter.line_segment([point(from), point(to)], stroke(s));
            }
            Shape::Label { at, text, color: c } => {
                let font = FontId::proportional(12.0);
                painter.text(point(at), Align2::LEFT_CENTER, text, font, color(c));
            }
        }
    }
}
