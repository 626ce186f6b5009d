//! Number fields of the active box. An entered number replaces that of all selected boxes.

use std::collections::HashMap;

use egui::{Grid, Id, Key, TextEdit, Ui};

use crate::viewer::editor::document::density;
use crate::viewer::editor::{Axis, EditorController, Field, Input};

/// Texts of the fields that are being edited.
#[derive(Debug, Default)]
pub struct FieldTexts {
    texts: HashMap<Field, String>,
    /// The first field is to receive the focus.
    pub wants_focus: bool,
}

impl FieldTexts {
    /// Takes the entered texts as inputs.
    pub fn take(&mut self) -> Vec<Input> {
        let texts = self.texts.drain().filter(|(_, text)| !text.trim().is_empty());
        texts.map(|(field, text)| Input::Typed { field, text }).collect()
    }
}

/// Adds the fields.
pub fn show(
    ui: &mut Ui,
    controller: &EditorController,
    texts: &mut FieldTexts,
    inputs: &mut Vec<Input>,
) {
    let editor = controller.editor();
    let (n_selected, active) = (editor.selection().boxes().len(), editor.active_box());
    match active {
        Some((i, _)) if n_selected > 1 => {
            ui.label(format!("box {i} (of {n_selected} that change with it)"))
        }
        Some((i, _)) => ui.label(format!("box {i} (Enter: type)")),
        None => ui.weak("no box is selected"),
    };
    let active = active.map(|(_, b)| b);
    Grid::new("fields").num_columns(2).spacing([8.0, 2.0]).show(ui, |ui| {
        let mut row = |name: &str, field: Field, value: Option<f64>, hint: &str| {
            ui.label(name).on_hover_text(hint);
            edit(ui, texts, field, value, inputs);
            ui.end_row();
        };
        const LENGTH: &str = "in scene units, or 1.5 m, 150 cm, 2 km";
        let n = active.map(|b| f64::from(b.n_particles));
        row("particles", Field::Count, n, "a whole number");
        let hint = "particles in a cubic unit; 12 /m³, 0.5 /km³";
        row("density", Field::Density, active.and_then(density), hint);
        for axis in Axis::ALL {
            let value = active.map(|b| b.extent[axis.index()]);
            row(&format!("extent {}", axis.name()), Field::Extent(axis), value, LENGTH);
        }
        for axis in Axis::ALL {
            let value = active.map(|b| b.center[axis.index()]);
            row(&format!("centre {}", axis.name()), Field::Center(axis), value, LENGTH);
        }
        row("radius", Field::Radius, active.map(|b| b.radius_max), LENGTH);
        let hint = "of the cloud's particles; not saved in the file";
        row("seed", Field::Seed, Some(f64::from(editor.document().seed)), hint);
        let hint = "of the grid that drags snap to";
        row("grid step", Field::SnapStep, Some(editor.settings().snap.step), hint);
    });
}

/// Adds one field. It is disabled without a value.
fn edit(
    ui: &mut Ui,
    texts: &mut FieldTexts,
    field: Field,
    value: Option<f64>,
    inputs: &mut Vec<Input>,
) {
    let is_enabled = value.is_some();
    let value = value.map_or(String::new(), |v| format!("{v}"));
    // A focused field is empty and shows its value as a hint, so that typed text replaces it.
    let mut text = texts.texts.get(&field).cloned().unwrap_or_else(|| value.clone());
    let edit =
        TextEdit::singleline(&mut text).id(Id::new(field)).desired_width(110.0).hint_text(value);
    let response = ui.add_enabled(is_enabled, edit);
    if texts.wants_focus && is_enabled {
        texts.wants_focus = false;
        response.request_focus();
    }
    if response.gained_focus() {
        texts.texts.insert(field, String::new());
    } else if response.changed() {
        texts.texts.insert(field, text);
    }
    if response.lost_focus() {
        let is_cancelled = ui.input(|input| input.key_pressed(Key::Escape));
        let typed = texts.texts.remove(&field);
        let typed = typed.filter(|text| !text.trim().is_empty() && !is_cancelled);
        inputs.extend(typed.map(|text| Input::Typed { field, text }));
    }
}
