//! The editor's panels: file, numbers, buttons, list of boxes, status line, and messages.

use egui::{Align, Button, Frame, Id, Layout, Margin, Panel, Rect, RichText, ScrollArea};
use egui::{TextStyle, Ui, vec2};

use super::dialogs::{self, FileDialog};
use super::fields::{self, FieldTexts};
use super::panel_state::PanelState;
use super::shapes;
use crate::viewer::colors;
use crate::viewer::editor::{
    Action, Axis, Command, DisplayMode, Input, SHORTCUTS, ScalingAnchor, Select, SelectionMode,
    SessionEvent, Setting, mean_rate,
};
use crate::viewer::layout::panel_width;
use crate::viewer::overlay_text::{MESSAGE_ROWS, banner, rows_of_third, shrink_text};
use crate::viewer::shortcut::Shortcut;

/// Width of the panel, points: the fields with their names, the margins, and some space.
const WIDTH: f32 = 230.0;
/// Largest part of the window's width that the panel covers. With the status line it is a third of
/// a window of 640 × 480.
const MAX_SHARE: f64 = 0.3;
/// Height of the status line, points: one line of text and its margins.
const STATUS: f32 = 24.0;
/// Part of the panel's height that a long list of boxes has at least: five boxes in a window of 640
/// points.
const LIST_SHARE: f32 = 0.17;
/// Least height of a long list of boxes, points: two boxes and a half, which show that it scrolls.
const LEAST_LIST: f32 = 60.0;
/// Distance of buttons from each other, points: less than egui's, so that more fit a row.
const BUTTON_GAP: f32 = 5.0;
/// The line over an empty picture.
const FIRST_STEPS: &str = "A: add a box where the view looks    ?: all keys";

/// Returns the size of the picture that the panels leave in a window of `size` pixels, at least one
/// pixel. The picture is at the upper left corner.
pub fn picture_size(size: [u32; 2], px_per_point: f64, has_panels: bool) -> [u32; 2] {
    let width = width_of(f64::from(size[0]) / px_per_point);
    let panels = if has_panels { [width, STATUS] } else { [0.0; 2] };
    let less = |k: usize| {
        let px = (f64::from(panels[k]) * px_per_point).round() as u32;
        size[k].saturating_sub(px).max(1)
    };
    [less(0), less(1)]
}

/// Returns the width of the panel in a window of this width; points.
fn width_of(window_points: f64) -> f32 {
    panel_width(window_points, WIDTH.into(), MAX_SHARE) as f32
}

/// Adds the overlay and all panels. Returns the inputs that follow from clicks and typed text.
pub fn show(
    ui: &mut Ui,
    state: &PanelState<'_>,
    texts: &mut FieldTexts,
    dialog: &mut Option<FileDialog>,
) -> Vec<Input> {
    let mut inputs = vec![];
    shapes::draw(ui, state.controller);
    if state.has_panels {
        sides(ui, state, texts, &mut inputs);
    }
    let mut free = ui.available_rect_before_wrap();
    if let Some(failure) = state.failure {
        free = banner(ui, free, failure, colors::ERROR, rows_of_third(free));
    }
    if let Some(message) = state.controller.message() {
        free = banner(ui, free, message, colors::MESSAGE, MESSAGE_ROWS);
    }
    if state.controller.editor().boxes().is_empty() && !state.controller.shows_help() {
        banner(ui, free, FIRST_STEPS, colors::MESSAGE, MESSAGE_ROWS);
    }
    dialogs::show(ui, state, dialog, &mut inputs);
    inputs
}

/// Adds the status line and the panel.
fn sides(ui: &mut Ui, state: &PanelState<'_>, texts: &mut FieldTexts, inputs: &mut Vec<Input>) {
    let width = width_of(ui.max_rect().width().into());
    let frame = Frame::new().fill(colors::PANEL).inner_margin(Margin::symmetric(6, 2));
    let status_line = Panel::bottom("status").resizable(false).exact_size(STATUS).frame(frame);
    status_line.show(ui, |ui| status(ui, state));
    let frame = Frame::new().fill(colors::PANEL).inner_margin(Margin::same(6));
    let numbers = Panel::right("numbers").resizable(false).exact_size(width).frame(frame);
    numbers.show(ui, |ui| {
        shrink_text(ui, width / WIDTH);
        // The list has a part of the panel, however many numbers and buttons are above it.
        let n = state.controller.editor().boxes().len();
        let rows = n as f32 * (row_height(ui) + ui.spacing().item_spacing.y);
        let of_list = (LIST_SHARE * ui.available_height()).max(LEAST_LIST).min(rows);
        let controls = ScrollArea::vertical().id_salt("controls").auto_shrink([false, true]);
        controls.max_height((ui.available_height() - of_list).max(0.0)).show(ui, |ui| {
            ui.spacing_mut().item_spacing.x = BUTTON_GAP;
            file(ui, state, inputs);
            ui.separator();
            fields::show(ui, state.controller, texts, inputs);
            ui.separator();
            buttons(ui, state, inputs);
        });
        ui.separator();
        list(ui, state, inputs);
    });
}

/// Adds a button for a command. Its tooltip names the shortcut.
fn button(ui: &mut Ui, text: &str, command: Command, is_enabled: bool, inputs: &mut Vec<Input>) {
    let mut response = ui.add_enabled(is_enabled, egui::Button::new(text).small());
    if let Some(text) = Shortcut::tooltip(&SHORTCUTS, command) {
        response = response.on_hover_text(text);
    }
    if response.clicked() {
        inputs.push(Input::Command(command));
    }
}

fn file(ui: &mut Ui, state: &PanelState<'_>, inputs: &mut Vec<Input>) {
    let session = state.controller.session();
    let name = session.path().map_or("(no file)".to_owned(), |path| path.display().to_string());
    let mark = if session.is_dirty() { " *" } else { "" };
    ui.label(RichText::new(format!("{name}{mark}")).strong());
    ui.horizontal_wrapped(|ui| {
        for (text, command) in [
            ("New", Command::New),
            ("Open", Command::Open),
            ("Save", Command::Save),
            ("Save as", Command::SaveAs),
            ("?", Command::Help),
        ] {
            button(ui, text, command, true, inputs);
        }
    });
}

fn buttons(ui: &mut Ui, state: &PanelState<'_>, inputs: &mut Vec<Input>) {
    let editor = state.controller.editor();
    let (settings, history) = (editor.settings(), editor.history());
    let has_selection = !editor.selection().is_empty();
    ui.horizontal_wrapped(|ui| {
        for (text, command, is_enabled) in [
            ("Add", Command::Add, true),
            ("Duplicate", Command::Duplicate, has_selection),
            ("Delete", Command::Delete, has_selection),
            ("Mirror", Command::Mirror, has_selection),
            ("Mirror a copy", Command::MirrorCopy, has_selection),
            ("Frame", Command::Frame, true),
        ] {
            button(ui, text, command, is_enabled, inputs);
        }
    });
    ui.horizontal_wrapped(|ui| {
        for (verb, label, command) in [
            ("Undo", history.undo_label(), Command::Undo),
            ("Redo", history.redo_label(), Command::Redo),
        ] {
            let text = label.map_or(verb.to_owned(), |label| format!("{verb} {label}"));
            button(ui, &text, command, label.is_some(), inputs);
        }
    });
    ui.horizontal_wrapped(|ui| {
        use DisplayMode::{Both, Boxes, Cloud};
        for (text, display) in [("Boxes", Boxes), ("Cloud", Cloud), ("Both", Both)] {
            if ui.selectable_label(settings.display == display, text).clicked() {
                inputs.push(Input::Command(Command::Display(display)));
            }
        }
        if ui.checkbox(&mut settings.snap.is_on.clone(), "Snap").clicked() {
            inputs.push(Input::Command(Command::ToggleSnap));
        }
    });
    ui.horizontal_wrapped(|ui| {
        let mut is_centred = settings.anchor == ScalingAnchor::Center;
        let hover = "scaling keeps the centre in place, else the opposite face (Shift inverts)";
        if ui.checkbox(&mut is_centred, "Symmetric").on_hover_text(hover).clicked() {
            let action = Action::Set(Setting::Anchor(settings.anchor.toggled()));
            inputs.push(Input::Event(SessionEvent::Act(action)));
        }
        ui.label("mirror by");
        for axis in Axis::ALL {
            if ui.selectable_label(settings.axis == axis, axis.name()).clicked() {
                inputs.push(Input::Command(Command::Axis(axis)));
            }
        }
    });
}

/// Returns the height of a line of the list, points.
fn row_height(ui: &Ui) -> f32 {
    let text = ui.text_style_height(&TextStyle::Button);
    ui.spacing().interact_size.y.max(text + 2.0 * ui.spacing().button_padding.y)
}

/// Adds the list of boxes, which fills the rest of the panel and scrolls to a new active box.
fn list(ui: &mut Ui, state: &PanelState<'_>, inputs: &mut Vec<Input>) {
    let editor = state.controller.editor();
    let n = editor.boxes().len();
    let height = row_height(ui);
    let active = editor.active_box().map(|(i, _)| i);
    let id = Id::new("listed active box");
    let was_active = ui.data(|data| data.get_temp::<Option<usize>>(id)).flatten();
    ui.data_mut(|data| data.insert_temp(id, active));
    let area = ScrollArea::vertical().id_salt("boxes").auto_shrink(false);
    area.show_rows(ui, height, n, |ui, rows| {
        if let Some(i) = active.filter(|_| active != was_active) {
            let step = height + ui.spacing().item_spacing.y;
            let top = ui.max_rect().top() + (i as f32 - rows.start as f32) * step;
            let row = Rect::from_x_y_ranges(ui.max_rect().x_range(), top..=top + height);
            ui.scroll_to_rect(row, None);
        }
        for i in rows {
            let rate = state.acceptances.get(i).and_then(|b| b.acceptance.rate());
            let rate = rate.map_or(String::new(), |r| format!(", {:.0} % accepted", 100.0 * r));
            let text = format!("{i}: {} particles{rate}", editor.boxes()[i].n_particles);
            let is_selected = editor.selection().contains(i);
            let row = Button::selectable(is_selected, text).min_size(vec2(0.0, height)).truncate();
            if ui.add(row).clicked() {
                let keys = ui.input(|input| input.modifiers);
                let mode = match (keys.command, keys.shift) {
                    (true, _) => SelectionMode::Toggle,
                    (_, true) => SelectionMode::Add,
                    _ => SelectionMode::Replace,
                };
                let action = Action::Select(Select::Boxes { boxes: vec![i], mode });
                inputs.push(Input::Event(SessionEvent::Act(action)));
            }
        }
    });
}

fn status(ui: &mut Ui, state: &PanelState<'_>) {
    let document = state.controller.editor().document();
    let mut text = format!("{} boxes, {} particles", document.boxes.len(), document.n_particles());
    if let Some(rate) = mean_rate(state.acceptances) {
        text += &format!(", {:.1} % of attempts accepted", 100.0 * rate);
    }
    ui.horizontal_centered(|ui| {
        ui.label(text);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.weak("?: all keys    H: hide panels");
        });
    });
}

#[cfg(test)]
mod tests;
