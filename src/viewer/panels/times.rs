//! The frame-time graph, and what the times come to.

use egui::{Grid, Sense, Stroke, Ui, pos2, vec2};

use super::{DIM, PASSES, ms};
use crate::measure::stats::Summary;
use crate::viewer::timeline::{KEPT, Timeline};

/// Points.
const HEIGHT: f32 = 70.0;

pub fn show(ui: &mut Ui, timeline: &Timeline) {
    let Some(frame) = timeline.summary(|f| f.frame_ms) else {
        ui.weak("no frame yet");
        return;
    };
    graph(ui, timeline, &frame);
    let rows: [(&str, Option<Summary>); 5] = [
        ("frame", Some(frame)),
        ("game step", timeline.summary(|f| f.game_ms)),
        ("recording", timeline.summary(|f| f.record_ms + f.submit_ms)),
        ("waiting", timeline.summary(|f| f.wait_ms)),
        ("latency", timeline.summary(|f| f.latency_ms)),
    ];
    Grid::new("times").num_columns(5).spacing([8.0, 1.0]).show(ui, |ui| {
        for head in ["ms", "p50", "p95", "p99", "max"] {
            ui.weak(head);
        }
        ui.end_row();
        for (name, summary) in rows.into_iter().filter_map(|(name, s)| Some((name, s?))) {
            ui.label(name);
            for value in [summary.p50, summary.p95, summary.p99, summary.max] {
                ui.monospace(ms(value));
            }
            ui.end_row();
        }
    });
}

/// From 0 to a little more than the greatest; lines where the median and the 99th percentile are.
fn graph(ui: &mut Ui, timeline: &Timeline, of_frames: &Summary) {
    let (room, _) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
    // Without a clip of its own: each one is a draw, and draws are what a software device pays for.
    let painter = ui.painter();
    painter.rect_filled(room, 2.0, egui::Color32::from_gray(12));
    let top = 1.05 * of_frames.max.max(1e-3);
    let y = |value: f64| room.bottom() - (value / top) as f32 * room.height();
    let x = |i: usize| {
        room.right() - (timeline.frames().len() - 1 - i) as f32 * room.width() / (KEPT - 1) as f32
    };
    for value in [of_frames.p50, of_frames.p99] {
        painter.hline(room.x_range(), y(value), Stroke::new(1.0, DIM.gamma_multiply(0.4)));
    }
    let points = timeline.frames().enumerate().map(|(i, f)| pos2(x(i), y(f.frame_ms))).collect();
    painter.line(points, Stroke::new(1.0, PASSES[0]));
    let font = egui::FontId::proportional(10.0);
    painter.text(
        room.left_top() + vec2(3.0, 1.0),
        egui::Align2::LEFT_TOP,
        format!("{} ms", ms(top)),
        font,
        DIM,
    );
}
