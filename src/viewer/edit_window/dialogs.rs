//! What stands in the middle of the window: the question about unsaved changes, a file to choose,
//! the keys.

use std::path::PathBuf;

use egui::{Grid, Id, Key, Modal, RichText, TextEdit, Ui, Window};

use super::panels::Shown;
use crate::viewer::editor::desk::{Input, MOUSE};
use crate::viewer::editor::session::{Answer, Event, Wish};
use crate::viewer::editor::shortcuts::SHORTCUTS;

/// A file that is being chosen: its path so far.
#[derive(Debug, Clone)]
pub struct Choosing {
    pub text: String,
    pub saves: bool,
    /// The field has the keys already.
    has_focus: bool,
}

impl Choosing {
    /// From among all files, or to save under; beginning with a path.
    pub fn new(saves: bool, path: Option<&std::path::Path>) -> Choosing {
        let text = path.map_or(String::new(), |path| path.display().to_string());
        Choosing { text, saves, has_focus: false }
    }
}

pub fn show(
    ui: &mut Ui,
    shown: &Shown<'_>,
    choosing: &mut Option<Choosing>,
    inputs: &mut Vec<Input>,
) {
    if let Some(wish) = shown.desk.session().asked() {
        question(ui, wish, inputs);
    } else if let Some(mut now) = choosing.take() {
        match choose(ui, &mut now, shown.recent) {
            None => *choosing = Some(now),
            Some(path) => inputs.push(Input::Event(match now.saves {
                true => Event::ChosenToSave(path),
                false => Event::ChosenToOpen(path),
            })),
        }
    } else if shown.desk.shows_help() {
        help(ui);
    }
}

fn question(ui: &Ui, wish: &Wish, inputs: &mut Vec<Input>) {
    let before = match wish {
        Wish::New => "a new cloud",
        Wish::Open(_) => "opening another",
        Wish::Quit => "closing",
    };
    Modal::new(Id::new("question")).show(ui.ctx(), |ui| {
        ui.label(format!("Save changes before {before}?"));
        ui.horizontal(|ui| {
            for (text, answer) in
                [("Save", Answer::Save), ("Discard", Answer::Discard), ("Cancel", Answer::Cancel)]
            {
                if ui.button(text).clicked() {
                    inputs.push(Input::Event(Event::Answer(answer)));
                }
            }
        });
    });
}

/// What was chosen, or that nothing is to be; none while nobody has decided.
fn choose(ui: &Ui, now: &mut Choosing, recent: &[PathBuf]) -> Option<Option<PathBuf>> {
    let mut chosen = None;
    Modal::new(Id::new("file")).show(ui.ctx(), |ui| {
        ui.set_width(360.0);
        ui.label(if now.saves { "Save as" } else { "Open" });
        let response = ui.add(
            TextEdit::singleline(&mut now.text).hint_text("path").desired_width(f32::INFINITY),
        );
        if !std::mem::replace(&mut now.has_focus, true) {
            response.request_focus();
        }
        let (enter, escape) =
            ui.input(|input| (input.key_pressed(Key::Enter), input.key_pressed(Key::Escape)));
        let path = |text: &str| Some(Some(PathBuf::from(text.trim())));
        if !now.saves {
            for place in recent.iter().filter_map(|p| p.to_str()) {
                if ui.link(place).clicked() {
                    chosen = path(place);
                }
            }
        }
        ui.horizontal(|ui| {
            let is_given = !now.text.trim().is_empty();
            if ui.add_enabled(is_given, egui::Button::new("OK")).clicked() || enter && is_given {
                chosen = path(&now.text);
            }
            if ui.button("Cancel").clicked() || escape {
                chosen = Some(None);
            }
        });
    });
    chosen
}

fn help(ui: &Ui) {
    Window::new("Keys").collapsible(false).show(ui.ctx(), |ui| {
        Grid::new("keys").num_columns(2).spacing([12.0, 1.0]).show(ui, |ui| {
            let keys = SHORTCUTS.iter().map(|s| (s.chord.to_string(), s.description));
            let mouse = MOUSE.iter().map(|(what, does)| ((*what).to_owned(), *does));
            for (key, does) in
                keys.chain([("Enter".to_owned(), "type the active box's numbers")]).chain(mouse)
            {
                ui.label(RichText::new(key).monospace());
                ui.label(does);
                ui.end_row();
            }
        });
    });
}
