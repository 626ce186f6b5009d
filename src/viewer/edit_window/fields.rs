//! Number fields of the active box. An entered number replaces that of all selected boxes.

use std::collections::HashMap;

use egui::text::{CCursor, CCursorRange};
use egui::text_edit::TextEditState;
use egui::{Grid, Id, Key, TextEdit, Ui};

use crate::model::boxes::CloudBox;
use crate::viewer::digits::{format_significant, format_to_resolution};
use crate::viewer::editor::document::density;
use crate::viewer::editor::{Axis, EditorController, Field, Input};

/// Texts of the fields that are being edited.
#[derive(Debug, Default)]
pub struct FieldTexts {
    texts: HashMap<Field, FieldText>,
    /// The first field is to receive the focus.
    pub wants_focus: bool,
    /// The field whose whole text is selected until the button of the mouse is released.
    selected: Option<Field>,
}

/// Text of a field that is being edited.
#[derive(Debug)]
struct FieldText {
    /// The whole value, before any edit.
    before: String,
    now: String,
}

impl FieldText {
    /// Returns the text where it was edited.
    fn typed(self) -> Option<String> {
        (self.now != self.before && !self.now.trim().is_empty()).then_some(self.now)
    }
}

impl FieldTexts {
    /// Takes the entered texts as inputs.
    pub fn take(&mut self) -> Vec<Input> {
        let typed = |(field, text): (Field, FieldText)| Some((field, text.typed()?));
        let texts = self.texts.drain().filter_map(typed);
        texts.map(|(field, text)| Input::Typed { field, text }).collect()
    }
}

/// Number of digits of the box's largest length or coordinate: the device computes in f32, which
/// keeps at least six.
const LENGTH_DIGITS: i32 = 6;
/// Number of digits of a density. It follows from the other numbers, so fewer digits suffice.
const DENSITY_DIGITS: i32 = 4;
/// Width of the fields' names, points: the longest has nine letters.
const NAMES: f32 = 66.0;
/// Width of a field, points: the panel keeps room for names and margins.
const FIELD: f32 = 130.0;

/// A number as a field shows it.
struct FieldValue {
    /// Every digit, for an edit.
    whole: String,
    /// The digits that matter.
    rounded: String,
}

impl FieldValue {
    fn exact(v: f64) -> FieldValue {
        FieldValue { whole: format!("{v}"), rounded: format!("{v}") }
    }

    fn with_digits(v: f64, n: i32) -> FieldValue {
        FieldValue { rounded: format_significant(v, n), ..FieldValue::exact(v) }
    }
}

/// Returns the smallest length that the fields of a box show: the sixth digit of its largest
/// number, but at most the step of the grid.
fn resolution(b: &CloudBox, step: f64) -> f64 {
    let largest = b.center.abs().max(b.extent).max_element().max(b.radius_max);
    let digits = if largest > 0.0 { largest.log10().floor() } else { 0.0 };
    10f64.powf(digits - f64::from(LENGTH_DIGITS - 1)).min(step)
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
    let step = editor.settings().snap.step;
    let length = |of: fn(&CloudBox, Axis) -> f64, axis: Axis| {
        let b = active?;
        let v = of(b, axis);
        Some(FieldValue {
            rounded: format_to_resolution(v, resolution(b, step)),
            ..FieldValue::exact(v)
        })
    };
    Grid::new("fields").num_columns(2).min_col_width(NAMES).spacing([8.0, 2.0]).show(ui, |ui| {
        let mut row = |name: &str, field: Field, value: Option<FieldValue>, hint: &str| {
            ui.label(name).on_hover_text(hint);
            edit(ui, texts, field, value, inputs);
            ui.end_row();
        };
        const LENGTH: &str = "in scene units, or 1.5 m, 150 cm, 2 km";
        let n = active.map(|b| FieldValue::exact(b.n_particles.into()));
        row("particles", Field::Count, n, "a whole number");
        let hint = "particles in a cubic unit; 12 /m³, 0.5 /km³";
        let density = active.and_then(density).map(|v| FieldValue::with_digits(v, DENSITY_DIGITS));
        row("density", Field::Density, density, hint);
        for axis in Axis::ALL {
            let value = length(|b, axis| b.extent[axis.index()], axis);
            row(&format!("extent {}", axis.name()), Field::Extent(axis), value, LENGTH);
        }
        for axis in Axis::ALL {
            let value = length(|b, axis| b.center[axis.index()], axis);
            row(&format!("centre {}", axis.name()), Field::Center(axis), value, LENGTH);
        }
        row("radius", Field::Radius, length(|b, _| b.radius_max, Axis::X), LENGTH);
        let hint = "of the cloud's particles; not saved in the file";
        row("seed", Field::Seed, Some(FieldValue::exact(editor.document().seed.into())), hint);
        let hint = "of the grid that drags snap to";
        row("grid step", Field::SnapStep, Some(FieldValue::with_digits(step, LENGTH_DIGITS)), hint);
    });
}

/// Adds one field. It is disabled without a value.
///
/// A field shows the digits that matter. While it has the focus it shows every digit, selected, so
/// that typed text replaces them.
fn edit(
    ui: &mut Ui,
    texts: &mut FieldTexts,
    field: Field,
    value: Option<FieldValue>,
    inputs: &mut Vec<Input>,
) {
    let is_enabled = value.is_some();
    let value = value.unwrap_or(FieldValue { whole: String::new(), rounded: String::new() });
    let text = texts.texts.get(&field).map(|text| text.now.clone());
    let mut text = text.unwrap_or(value.rounded);
    let id = Id::new(field);
    let width = FIELD.min(ui.available_width());
    let edit = TextEdit::singleline(&mut text).id(id).desired_width(width);
    let response = ui.add_enabled(is_enabled, edit);
    if texts.wants_focus && is_enabled {
        texts.wants_focus = false;
        response.request_focus();
    }
    if response.gained_focus() {
        let (before, now) = (value.whole.clone(), value.whole);
        texts.texts.insert(field, FieldText { before, now });
        texts.selected = Some(field);
    } else if response.changed()
        && let Some(typed) = texts.texts.get_mut(&field)
    {
        typed.now = text;
    }
    if texts.selected == Some(field) {
        select_all(ui, id);
        if !ui.input(|input| input.pointer.any_down()) {
            texts.selected = None;
        }
    }
    if response.lost_focus() {
        let is_cancelled = ui.input(|input| input.key_pressed(Key::Escape));
        let typed = texts.texts.remove(&field).and_then(FieldText::typed);
        let typed = typed.filter(|_| !is_cancelled);
        inputs.extend(typed.map(|text| Input::Typed { field, text }));
    }
}

/// Selects the whole text of a field.
fn select_all(ui: &Ui, id: Id) {
    let mut state = TextEditState::load(ui.ctx(), id).unwrap_or_default();
    // The field limits the range to its text.
    let whole = CCursorRange::two(CCursor::new(0), CCursor::new(usize::MAX));
    state.cursor.set_char_range(Some(whole));
    state.store(ui.ctx(), id);
}
