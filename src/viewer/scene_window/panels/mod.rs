//! Panels beside the picture: times, settings, playback, comparison, plan and counters.
//!
//! A click returns the command that a key would invoke.

mod lanes;
mod settings;
mod style;
mod times;

use egui::{CollapsingHeader, Frame, Margin, Panel, RichText, ScrollArea, Ui};

use super::commands::{Command, HINT, key_groups};
use super::status::ViewStatus;
use super::view_state::ViewState;
use crate::gpu::Backdrop;
use crate::viewer::colors;
use crate::viewer::layout::panel_width;
use crate::viewer::overlay_text::{self, MESSAGE_ROWS, banner, rows_of_third, shrink_text};

/// Width of the panels, points: the table of frame times has all its columns.
const WIDTH: f32 = 270.0;
/// Largest part of the window that the panels cover: most of the window belongs to the picture.
const MAX_SHARE: f64 = 1.0 / 3.0;
/// Height of the window from which on the sections of passes begin open, too, points: below it they
/// would push the settings out of sight.
const TALL: f32 = 700.0;

/// Adds all that is shown over the picture. Returns the clicked commands, and the backdrop behind
/// the panels where they are shown.
pub fn show_all(
    ui: &mut Ui,
    state: &ViewState,
    status: &ViewStatus,
    messages: &[String],
) -> (Vec<Command>, Option<Backdrop>) {
    let (mut commands, mut backdrop) = (vec![], None);
    if state.has_panels {
        let (clicked, behind) = show(ui, state, status);
        (commands, backdrop) = (clicked, Some(behind));
    }
    let picture = ui.available_rect_before_wrap();
    let mut free = picture;
    if let Some(text) = status.alarm() {
        free = banner(ui, free, &text, colors::ERROR, rows_of_third(picture));
    }
    if state.shows_hint && !state.shows_help {
        free = banner(ui, free, HINT, colors::MESSAGE, MESSAGE_ROWS);
    }
    for text in messages.iter().rev() {
        free = banner(ui, free, text, colors::MESSAGE, MESSAGE_ROWS);
    }
    if state.shows_help && overlay_text::keys(ui, picture, &key_groups()) {
        commands.push(Command::Help);
    }
    (commands, backdrop)
}

/// Adds all panels. Returns the clicked commands, and the backdrop behind the panels.
fn show(ui: &mut Ui, state: &ViewState, status: &ViewStatus) -> (Vec<Command>, Backdrop) {
    let mut commands = vec![];
    let window = ui.max_rect();
    let width = panel_width(window.width().into(), WIDTH.into(), MAX_SHARE) as f32;
    let is_tall = window.height() >= TALL;
    let panel = Panel::right("panels")
        .resizable(false)
        .show_separator_line(false)
        .exact_size(width)
        .frame(Frame::new().inner_margin(Margin::same(6)));
    let shown = panel.show(ui, |ui| {
        shrink_text(ui, width / WIDTH);
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let commands = &mut commands;
            section(ui, "Frame times", true, |ui| times::show(ui, &status.timeline));
            section(ui, "Settings", true, |ui| settings::knobs(ui, state, status, commands));
            section(ui, "Frame", true, |ui| settings::playback(ui, state, status, commands));
            section(ui, "A and B", false, |ui| settings::compare(ui, state, status, commands));
            section(ui, "Timeline", is_tall, |ui| lanes::show(ui, &status.timeline));
            section(ui, "Passes", is_tall, |ui| lanes::show_passes(ui, &status.timeline));
            section(ui, "Plan", false, |ui| settings::plan(ui, status));
            section(ui, "Counters", false, |ui| settings::counters(ui, status, commands));
            ui.label(RichText::new("h hides the panels, ? lists the keys").color(style::DIM));
        });
    });
    (commands, Backdrop { room: shown.response.rect, color: colors::PANEL })
}

fn section(ui: &mut Ui, title: &str, is_open: bool, add: impl FnOnce(&mut Ui)) {
    let header = CollapsingHeader::new(RichText::new(title).strong());
    header.default_open(is_open).show_unindented(ui, add);
}

#[cfg(test)]
mod tests;
