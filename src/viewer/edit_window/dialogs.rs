//! Dialogs in the middle of the window: the question about unsaved changes, the choice of a file,
//! and the list of keys.

use std::path::{Path, PathBuf};

use egui::{Id, Key, Modal, ScrollArea, TextEdit, Ui};

use super::panel_state::PanelState;
use crate::viewer::editor::{Answer, Command, Input, Intent, SessionEvent, key_groups};
use crate::viewer::overlay_text;

/// A dialog for the path of a file.
#[derive(Debug, Clone)]
pub struct FileDialog {
    text: String,
    saves: bool,
    /// The text field has received the focus.
    has_focus: bool,
}

impl FileDialog {
    /// Creates a dialog to save a file, or to open one; `path` is the suggestion.
    pub fn new(saves: bool, path: Option<&Path>) -> FileDialog {
        let text = path.map_or(String::new(), |path| path.display().to_string());
        FileDialog { text, saves, has_focus: false }
    }
}

/// Width of the dialog for a file, points: room for a long path, and less than the smallest window
/// with panels.
const WIDTH: f32 = 420.0;
/// Height of the list of recent files, points: a third of the smallest window with panels. The list
/// scrolls.
const RECENT: f32 = 160.0;

/// Adds the open dialog, if there is one.
pub fn show(
    ui: &Ui,
    state: &PanelState<'_>,
    dialog: &mut Option<FileDialog>,
    inputs: &mut Vec<Input>,
) {
    if let Some(intent) = state.controller.session().question() {
        question(ui, intent, inputs);
    } else if let Some(open) = dialog {
        if let Some(path) = choose(ui, open, state.recent) {
            inputs.push(Input::Event(match open.saves {
                true => SessionEvent::ChosenToSave(path),
                false => SessionEvent::ChosenToOpen(path),
            }));
            *dialog = None;
        }
    } else if state.controller.shows_help() && overlay_text::keys(ui, ui.max_rect(), &key_groups())
    {
        inputs.push(Input::Command(Command::Help));
    }
}

fn question(ui: &Ui, intent: &Intent, inputs: &mut Vec<Input>) {
    let before = match intent {
        Intent::New => "a new cloud",
        Intent::Open(_) => "opening another",
        Intent::Quit => "closing",
    };
    Modal::new(Id::new("question")).show(ui.ctx(), |ui| {
        ui.label(format!("Save changes before {before}?"));
        ui.horizontal(|ui| {
            for (text, answer) in
                [("Save", Answer::Save), ("Discard", Answer::Discard), ("Cancel", Answer::Cancel)]
            {
                if ui.button(text).clicked() {
                    inputs.push(Input::Event(SessionEvent::Answer(answer)));
                }
            }
        });
    });
}

/// Adds the dialog. Returns the chosen path, or `Some(None)` where the user has cancelled.
fn choose(ui: &Ui, dialog: &mut FileDialog, recent: &[PathBuf]) -> Option<Option<PathBuf>> {
    let mut chosen = None;
    Modal::new(Id::new("file")).show(ui.ctx(), |ui| {
        ui.set_width(WIDTH.min(ui.ctx().content_rect().width() - 60.0));
        ui.label(if dialog.saves { "Save as" } else { "Open" });
        let edit = TextEdit::singleline(&mut dialog.text).hint_text("path");
        let response = ui.add(edit.desired_width(f32::INFINITY));
        if !std::mem::replace(&mut dialog.has_focus, true) {
            response.request_focus();
        }
        let is_pressed = |key| ui.input(|input| input.key_pressed(key));
        let (enter, escape) = (is_pressed(Key::Enter), is_pressed(Key::Escape));
        let path = |text: &str| Some(Some(PathBuf::from(text.trim())));
        if !dialog.saves {
            let list = ScrollArea::vertical().id_salt("recent").max_height(RECENT);
            list.show(ui, |ui| {
                for place in recent.iter().filter_map(|p| p.to_str()) {
                    if ui.link(place).clicked() {
                        chosen = path(place);
                    }
                }
            });
        }
        ui.horizontal(|ui| {
            let is_given = !dialog.text.trim().is_empty();
            if ui.add_enabled(is_given, egui::Button::new("OK")).clicked() || enter && is_given {
                chosen = path(&dialog.text);
            }
            if ui.button("Cancel").clicked() || escape {
                chosen = Some(None);
            }
        });
    });
    chosen
}
