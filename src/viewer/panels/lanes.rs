//! Host and device side by side: the last frames on a line of time, and each pass's median.

use egui::{Align2, Color32, FontId, Rect, Sense, Ui, pos2, vec2};

use super::{DIM, GAME, PASSES, RECORD, WAIT, ms};
use crate::viewer::timeline::{Span, Timeline};

/// So many of the last frames are drawn.
const N_FRAMES: usize = 4;
/// Points.
const LANE: f32 = 14.0;
const BAR: f32 = 13.0;

/// Game step, recording and the device's passes of the last frames.
pub fn show(ui: &mut Ui, timeline: &Timeline) {
    let frames: Vec<_> = timeline.frames().rev().take(N_FRAMES).collect();
    let (Some(newest), Some(oldest)) = (frames.first(), frames.last()) else {
        ui.weak("no frame yet");
        return;
    };
    let (room, _) = ui.allocate_exact_size(vec2(ui.available_width(), 3.0 * LANE), Sense::hover());
    // Without a clip of its own: each one is a draw, and draws are what a software device pays for.
    let painter = ui.painter();
    let (begin, end) = (oldest.game[0], newest.end.max(oldest.game[0] + 1e-3));
    let names = 46.0;
    let x = |t: f64| {
        room.left() + names + ((t - begin) / (end - begin)) as f32 * (room.width() - names)
    };
    let stretch = |lane: usize, [from, to]: Span, color: Color32| {
        let y = room.top() + lane as f32 * LANE;
        let right = x(to).max(x(from) + 0.5);
        painter.rect_filled(
            Rect::from_min_max(pos2(x(from), y + 1.0), pos2(right, y + LANE - 1.0)),
            0.0,
            color,
        );
    };
    for (lane, name) in ["game", "record", "device"].into_iter().enumerate() {
        let at = pos2(room.left(), room.top() + (lane as f32 + 0.5) * LANE);
        painter.text(at, Align2::LEFT_CENTER, name, FontId::proportional(10.0), DIM);
    }
    let names = timeline.passes();
    for frame in &frames {
        stretch(0, frame.game, GAME);
        stretch(1, frame.record, RECORD);
        stretch(2, [frame.record[1], frame.end], WAIT);
        for (name, span) in &frame.passes {
            stretch(2, *span, color_of(&names, name));
        }
    }
}

/// A bar a pass, as long as its median; with host times above them.
pub fn bars(ui: &mut Ui, timeline: &Timeline) {
    let passes = timeline.passes();
    let of_host = |name, color, of: fn(&crate::viewer::timeline::Frame) -> f64| {
        timeline.summary(of).map(|s| (name, s.p50, 1.0, color))
    };
    let host = [
        of_host("game step", GAME, |f| f.game_ms),
        of_host("recording", RECORD, |f| f.record_ms + f.submit_ms),
    ];
    let device =
        passes.iter().map(|(name, ms, share)| (*name, *ms, *share, color_of(&passes, name)));
    let rows: Vec<_> = host.into_iter().flatten().chain(device).collect();
    let longest = rows.iter().map(|row| row.1).fold(1e-3, f64::max);
    for (name, p50, share, color) in rows {
        let (room, response) =
            ui.allocate_exact_size(vec2(ui.available_width(), BAR), Sense::hover());
        // Without a clip of its own: each one is a draw, and draws are what a software device pays
        // for.
        let painter = ui.painter();
        let length = (p50 / longest) as f32 * room.width();
        painter.rect_filled(
            Rect::from_min_size(room.min, vec2(length, BAR - 1.0)),
            0.0,
            color.gamma_multiply(0.6),
        );
        let font = FontId::proportional(11.0);
        painter.text(
            room.left_center() + vec2(3.0, 0.0),
            Align2::LEFT_CENTER,
            name,
            font.clone(),
            Color32::WHITE,
        );
        let text = format!("{} ms", ms(p50));
        painter.text(
            room.right_center() - vec2(3.0, 0.0),
            Align2::RIGHT_CENTER,
            text,
            font,
            Color32::WHITE,
        );
        response.on_hover_text(format!("in {:.0} % of the last frames", 100.0 * share));
    }
    if passes.is_empty() && timeline.frames().len() > 0 {
        ui.weak("no pass ran, or the device has no timestamps");
    }
}

fn color_of(passes: &[(&'static str, f64, f64)], name: &str) -> Color32 {
    PASSES[passes.iter().position(|p| p.0 == name).unwrap_or(0) % PASSES.len()]
}
