//! Statistics and graph of the frame times.

use egui::{Align2, Color32, FontId, Grid, Sense, Stroke, Ui, pos2, vec2};

use super::style::{DIM, PASSES, ms};
use crate::measure::stats::Summary;
use crate::viewer::scene_window::timeline::{CAPACITY, Timeline, recording_ms};

/// Height of the graph, points: peaks stand out, and the settings stay in sight below it.
const HEIGHT: f32 = 70.0;
/// Width from which on the table has all columns, points: just below the panels' usual width less
/// margins.
const WIDE: f32 = 250.0;

/// Adds the graph and a table of percentiles.
pub fn show(ui: &mut Ui, timeline: &Timeline) {
    let Some(frame) = timeline.summary(|f| f.frame_ms) else {
        ui.weak("no frame yet");
        return;
    };
    graph(ui, timeline, &frame);
    let [interval, to_screen] = timeline.shown_summaries();
    let rows = [
        ("frame", Some(frame)),
        ("game step", timeline.summary(|f| f.game_ms)),
        ("recording", timeline.summary(recording_ms)),
        ("waiting", timeline.summary(|f| f.wait_ms)),
        ("latency", timeline.summary(|f| f.latency_ms)),
        ("to screen", to_screen),
        ("on screen", interval),
    ];
    let is_wide = ui.available_width() >= WIDE;
    // A narrow table leaves out one percentile.
    let all = |values: [(&'static str, f64); 4]| {
        values.into_iter().filter(move |(name, _)| is_wide || *name != "p95")
    };
    let values =
        |s: &Summary| all([("p50", s.p50), ("p95", s.p95), ("p99", s.p99), ("max", s.max)]);
    Grid::new("times").num_columns(5).spacing([8.0, 1.0]).show(ui, |ui| {
        ui.weak("ms");
        values(&frame).for_each(|(name, _)| drop(ui.weak(name)));
        ui.end_row();
        for (name, summary) in rows {
            let Some(summary) = summary else { continue };
            ui.label(name);
            values(&summary).for_each(|(_, value)| drop(ui.monospace(ms(value))));
            ui.end_row();
        }
    });
}

/// Draws the frame times from 0 to just above their maximum, with lines at median and p99.
fn graph(ui: &mut Ui, timeline: &Timeline, frame_ms: &Summary) {
    let (area, _) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
    // A clip rectangle of its own would be another draw, and a software device pays for each.
    let painter = ui.painter();
    painter.rect_filled(area, 2.0, Color32::from_gray(12));
    let top = 1.05 * frame_ms.max.max(1e-3);
    let y = |value: f64| area.bottom() - (value / top) as f32 * area.height();
    for value in [frame_ms.p50, frame_ms.p99] {
        painter.hline(area.x_range(), y(value), Stroke::new(1.0, DIM.gamma_multiply(0.4)));
    }
    let step = area.width() / (CAPACITY - 1) as f32;
    let newest_first = timeline.frames().rev().enumerate();
    let points = newest_first.map(|(i, f)| pos2(area.right() - i as f32 * step, y(f.frame_ms)));
    painter.line(points.collect(), Stroke::new(1.0, PASSES[0]));
    let (corner, font) = (area.left_top() + vec2(3.0, 1.0), FontId::proportional(10.0));
    painter.text(corner, Align2::LEFT_TOP, format!("{} ms", ms(top)), font, DIM);
}
