//! Host and device on one time line, and the median time of each pass.

use std::time::Instant;

use egui::{Align2, Color32, FontId, Rect, Sense, Ui, pos2, vec2};

use super::style::{DIM, GAME, PASSES, RECORD, WAIT, ms};
use crate::frame::{FrameTimes, Marks};
use crate::viewer::scene_window::timeline::{
    PassTime, Span, Timeline, device_spans, ms_after, recording_ms,
};

/// Number of frames on the time line: enough to show how they overlap, few enough that passes have
/// a visible width.
const N_FRAMES: usize = 4;
/// Height of a lane, points: room for its name, which is 10 points high.
const LANE: f32 = 14.0;
/// Height of a pass's bar, points: room for its text, which is 11 points high.
const BAR: f32 = 13.0;
/// Width of the lanes' names, points: the longest has six letters.
const NAMES: f32 = 46.0;

/// Adds the last frames as three lanes: game step, recording, and the device's passes.
pub fn show(ui: &mut Ui, timeline: &Timeline) {
    let frames: Vec<_> = timeline.frames().rev().take(N_FRAMES).collect();
    let (Some(newest), Some(oldest)) = (frames.first(), frames.last()) else {
        ui.weak("no frame yet");
        return;
    };
    let (area, _) = ui.allocate_exact_size(vec2(ui.available_width(), 3.0 * LANE), Sense::hover());
    // A clip rectangle of its own would be another draw, and a software device pays for each.
    let painter = ui.painter();
    let zero = oldest.marks.game[0];
    let at = |t: Instant| ms_after(zero, t);
    let points_per_ms = f64::from(area.width() - NAMES) / at(newest.marks.end).max(1e-3);
    let x = |ms: f64| area.left() + NAMES + (ms * points_per_ms) as f32;
    let bar = |lane: usize, [from, to]: Span, color: Color32| {
        let y = area.top() + lane as f32 * LANE;
        let right = x(to).max(x(from) + 0.5);
        let rect = Rect::from_min_max(pos2(x(from), y + 1.0), pos2(right, y + LANE - 1.0));
        painter.rect_filled(rect, 0.0, color);
    };
    for (lane, name) in ["game", "record", "device"].into_iter().enumerate() {
        let at = pos2(area.left(), area.top() + (lane as f32 + 0.5) * LANE);
        painter.text(at, Align2::LEFT_CENTER, name, FontId::proportional(10.0), DIM);
    }
    let passes = timeline.passes();
    for frame in &frames {
        let Marks { game, record, end } = frame.marks;
        bar(0, game.map(at), GAME);
        bar(1, record.map(at), RECORD);
        bar(2, [record[1], end].map(at), WAIT);
        for (name, span) in device_spans(frame, zero) {
            bar(2, span, pass_color(&passes, name));
        }
    }
}

/// Adds a bar for each host step and each pass, as long as its median time.
pub fn show_passes(ui: &mut Ui, timeline: &Timeline) {
    let passes = timeline.passes();
    let host = |name, color, value: fn(&FrameTimes) -> f64| {
        let p50_ms = timeline.summary(value)?.p50;
        Some((PassTime { name, p50_ms, share: 1.0 }, color))
    };
    let mut rows: Vec<(PassTime, Color32)> =
        [host("game step", GAME, |f| f.game_ms), host("recording", RECORD, recording_ms)]
            .into_iter()
            .flatten()
            .collect();
    rows.extend(passes.iter().map(|p| (*p, pass_color(&passes, p.name))));
    let longest = rows.iter().map(|(p, _)| p.p50_ms).fold(1e-3, f64::max);
    for (PassTime { name, p50_ms, share }, color) in rows {
        let size = vec2(ui.available_width(), BAR);
        let (area, response) = ui.allocate_exact_size(size, Sense::hover());
        let painter = ui.painter();
        let length = (p50_ms / longest) as f32 * area.width();
        let bar = Rect::from_min_size(area.min, vec2(length, BAR - 1.0));
        painter.rect_filled(bar, 0.0, color.gamma_multiply(0.6));
        let text = |at, align, text: String| {
            painter.text(at, align, text, FontId::proportional(11.0), Color32::WHITE);
        };
        let inset = vec2(3.0, 0.0);
        text(area.left_center() + inset, Align2::LEFT_CENTER, name.to_owned());
        text(area.right_center() - inset, Align2::RIGHT_CENTER, format!("{} ms", ms(p50_ms)));
        response.on_hover_text(format!("in {:.0} % of the last frames", 100.0 * share));
    }
    if passes.is_empty() && timeline.frames().len() > 0 {
        ui.weak("no pass ran, or passes are not timed");
    }
}

fn pass_color(passes: &[PassTime], name: &str) -> Color32 {
    PASSES[passes.iter().position(|p| p.name == name).unwrap_or(0) % PASSES.len()]
}
