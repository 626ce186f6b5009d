//! Panels beside the picture: times, settings, playback, comparison, plan and counters.
//!
//! A click returns the command that a key would invoke.

mod lanes;
mod settings;
mod style;
mod times;

use egui::{Align2, CollapsingHeader, Color32, FontId, Frame, Margin, Panel, RichText, ScrollArea};
use egui::{Ui, vec2};

use super::commands::Command;
use super::status::ViewStatus;
use super::view_state::ViewState;
use crate::gpu::Backdrop;

/// Width of the panels, points.
const WIDTH: f32 = 270.0;
/// Largest part of the window that the panels cover.
const MAX_SHARE: f32 = 0.45;

/// Adds all panels. Returns the clicked commands, and the backdrop behind the panels.
pub fn show(ui: &mut Ui, state: &ViewState, status: &ViewStatus) -> (Vec<Command>, Backdrop) {
    let mut commands = vec![];
    let width = WIDTH.min(MAX_SHARE * ui.max_rect().width());
    let panel = Panel::right("panels")
        .resizable(false)
        .show_separator_line(false)
        .exact_size(width)
        .frame(Frame::new().inner_margin(Margin::same(6)));
    let shown = panel.show(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let commands = &mut commands;
            section(ui, "Frame times", true, |ui| times::show(ui, &status.timeline));
            section(ui, "Timeline", true, |ui| lanes::show(ui, &status.timeline));
            section(ui, "Passes", true, |ui| lanes::show_passes(ui, &status.timeline));
            section(ui, "Settings", true, |ui| settings::knobs(ui, state, status, commands));
            section(ui, "Frame", true, |ui| settings::playback(ui, state, status, commands));
            section(ui, "A and B", false, |ui| settings::compare(ui, state, status, commands));
            section(ui, "Plan", false, |ui| settings::plan(ui, status));
            section(ui, "Counters", false, |ui| settings::counters(ui, status, commands));
        });
    });
    (commands, Backdrop { room: shown.response.rect, color: style::BACKGROUND })
}

fn section(ui: &mut Ui, title: &str, is_open: bool, add: impl FnOnce(&mut Ui)) {
    let header = CollapsingHeader::new(RichText::new(title).strong());
    header.default_open(is_open).show_unindented(ui, add);
}

/// Draws an error message over the picture, which still shows the last good state.
pub fn alarm(ui: &Ui, text: &str) {
    let painter = ui.painter();
    let area = ui.max_rect().shrink(8.0);
    let (font, color) = (FontId::monospace(12.0), Color32::WHITE);
    let galley = painter.layout(text.to_owned(), font, color, area.width() - 16.0);
    let size = galley.size() + vec2(16.0, 12.0);
    let frame = Align2::LEFT_BOTTOM.anchor_size(area.left_bottom(), size);
    painter.rect_filled(frame, 4.0, style::ERROR);
    painter.galley(frame.min + vec2(8.0, 6.0), galley, color);
}

#[cfg(test)]
mod tests;
