//! The editor's panels: file, numbers, buttons, list of boxes, and status line.

use egui::{Color32, Frame, Margin, Panel, RichText, ScrollArea, TextStyle, Ui};

use super::dialogs::{self, FileDialog};
use super::fields::{self, FieldTexts};
use super::panel_state::PanelState;
use super::shapes;
use crate::viewer::editor::{
    Action, Axis, Command, DisplayMode, Input, SHORTCUTS, ScalingAnchor, Select, SelectionMode,
    SessionEvent, Setting, mean_rate,
};
use crate::viewer::shortcut::Shortcut;

/// Width of the panel, points.
const WIDTH: f32 = 230.0;
/// Height of the status line, points.
const STATUS: f32 = 30.0;
/// Height of the list of boxes, points.
const LIST: f32 = 130.0;
const BACKGROUND: Color32 = Color32::from_rgb(24, 26, 30);
const ERROR: Color32 = Color32::from_rgb(240, 110, 100);

/// Returns the size of the picture that the panels leave in a window of `size` pixels, at least one
/// pixel. The picture is at the upper left corner.
pub fn picture_size([width, height]: [u32; 2], px_per_point: f64) -> [u32; 2] {
    let less = |n: u32, points: f32| {
        n.saturating_sub((f64::from(points) * px_per_point).round() as u32).max(1)
    };
    [less(width, WIDTH), less(height, STATUS)]
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
    let frame = Frame::new().fill(BACKGROUND).inner_margin(Margin::same(6));
    let status_line = Panel::bottom("status").resizable(false).exact_size(STATUS).frame(frame);
    status_line.show(ui, |ui| status(ui, state));
    let numbers = Panel::right("numbers").resizable(false).exact_size(WIDTH).frame(frame);
    numbers.show(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            file(ui, state, &mut inputs);
            ui.separator();
            fields::show(ui, state.controller, texts, &mut inputs);
            ui.separator();
            buttons(ui, state, &mut inputs);
            ui.separator();
            list(ui, state, &mut inputs);
        });
    });
    dialogs::show(ui, state, dialog, &mut inputs);
    inputs
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
    ui.horizontal(|ui| {
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
    ui.horizontal(|ui| {
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

fn list(ui: &mut Ui, state: &PanelState<'_>, inputs: &mut Vec<Input>) {
    let editor = state.controller.editor();
    let (height, n) = (ui.text_style_height(&TextStyle::Body), editor.boxes().len());
    let area = ScrollArea::vertical().id_salt("boxes").max_height(LIST).auto_shrink([false, true]);
    area.show_rows(ui, height, n, |ui, rows| {
        for i in rows {
            let rate = state.acceptances.get(i).and_then(|b| b.acceptance.rate());
            let rate = rate.map_or(String::new(), |r| format!(", {:.0} % accepted", 100.0 * r));
            let text = format!("{i}: {} particles{rate}", editor.boxes()[i].n_particles);
            if ui.selectable_label(editor.selection().contains(i), text).clicked() {
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
    ui.horizontal(|ui| {
        let mut text =
            format!("{} boxes, {} particles", document.boxes.len(), document.n_particles());
        if let Some(rate) = mean_rate(state.acceptances) {
            text += &format!(", {:.1} % of attempts accepted", 100.0 * rate);
        }
        ui.label(text);
        if let Some(failure) = state.failure {
            ui.label(RichText::new(failure).color(ERROR));
        } else if let Some(message) = state.controller.message() {
            ui.label(RichText::new(message).strong());
        }
    });
}
