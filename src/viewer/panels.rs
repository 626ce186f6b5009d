//! What panels show beside the picture, and what is clicked in them: commands, the same that keys
//! mean.

mod lanes;
mod settings;
mod times;

use egui::{
    Align2, CollapsingHeader, Color32, FontId, Frame, Margin, Panel, RichText, ScrollArea, Ui,
};

use super::seen::Seen;
use super::wanted::{Command, Wanted};
use crate::gpu::Backdrop;

/// Points.
const WIDTH: f32 = 270.0;
/// At most so much of the window's width.
const SHARE: f32 = 0.45;

const BACKGROUND: Color32 = Color32::from_rgb(24, 26, 30);
const DIM: Color32 = Color32::from_gray(140);
const GAME: Color32 = Color32::from_rgb(95, 170, 110);
const RECORD: Color32 = Color32::from_rgb(215, 160, 70);
const WAIT: Color32 = Color32::from_rgb(80, 85, 95);
const WRONG: Color32 = Color32::from_rgb(150, 40, 40);

/// Colours of the device's passes, in turn.
const PASSES: [Color32; 8] = [
    Color32::from_rgb(90, 140, 220),
    Color32::from_rgb(170, 120, 210),
    Color32::from_rgb(80, 185, 190),
    Color32::from_rgb(220, 110, 120),
    Color32::from_rgb(150, 180, 80),
    Color32::from_rgb(200, 140, 180),
    Color32::from_rgb(120, 120, 230),
    Color32::from_rgb(210, 190, 90),
];

/// All panels, what was clicked in them, and what lies behind them.
pub fn show(ui: &mut Ui, wanted: &Wanted, seen: &Seen) -> (Vec<Command>, Backdrop) {
    let mut commands = vec![];
    let width = WIDTH.min(SHARE * ui.max_rect().width());
    let frame = Frame::new().inner_margin(Margin::same(6));
    let panel = Panel::right("panels")
        .resizable(false)
        .show_separator_line(false)
        .exact_size(width)
        .frame(frame);
    let shown = panel.show(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            section(ui, "Frame times", true, |ui| times::show(ui, &seen.timeline));
            section(ui, "Who did what when", true, |ui| lanes::show(ui, &seen.timeline));
            section(ui, "Passes", true, |ui| lanes::bars(ui, &seen.timeline));
            section(ui, "Settings", true, |ui| settings::knobs(ui, wanted, seen, &mut commands));
            section(ui, "Frame", true, |ui| settings::playback(ui, wanted, seen, &mut commands));
            section(ui, "A and B", false, |ui| settings::compare(ui, wanted, seen, &mut commands));
            section(ui, "Plan", false, |ui| settings::plan(ui, seen));
            section(ui, "Counters", false, |ui| settings::counters(ui, seen, &mut commands));
        });
    });
    (commands, Backdrop { room: shown.response.rect, color: BACKGROUND })
}

fn section(ui: &mut Ui, title: &str, is_open: bool, add: impl FnOnce(&mut Ui)) {
    CollapsingHeader::new(RichText::new(title).strong())
        .default_open(is_open)
        .show_unindented(ui, add);
}

/// Something that went wrong, over the picture that is still the last good one.
pub fn alarm(ui: &Ui, text: &str) {
    let painter = ui.painter();
    let room = ui.max_rect().shrink(8.0);
    let galley = painter.layout(
        text.to_owned(),
        FontId::monospace(12.0),
        Color32::WHITE,
        room.width() - 16.0,
    );
    let box_ =
        Align2::LEFT_BOTTOM.anchor_size(room.left_bottom(), galley.size() + egui::vec2(16.0, 12.0));
    painter.rect_filled(box_, 4.0, WRONG);
    painter.galley(box_.min + egui::vec2(8.0, 6.0), galley, Color32::WHITE);
}

/// "12.3", with as many digits as a time is worth reading with.
fn ms(value: f64) -> String {
    match value {
        v if v >= 100.0 => format!("{v:.0}"),
        v if v >= 10.0 => format!("{v:.1}"),
        v => format!("{v:.2}"),
    }
}

#[cfg(test)]
mod tests;
