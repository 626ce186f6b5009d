//! The active box's numbers: what is typed takes the place of what is there, and holds for all
//! selected boxes.

use std::collections::HashMap;

use egui::{Grid, Id, Key, TextEdit, Ui};

use crate::viewer::editor::Axis;
use crate::viewer::editor::desk::{Desk, Field, Input};
use crate::viewer::editor::document::density;

/// What stands in fields that somebody types into.
#[derive(Debug, Default)]
pub struct Typing {
    texts: HashMap<Field, String>,
    /// The first field is to have the keys.
    pub wants_focus: bool,
}

impl Typing {
    /// What stands in the fields, as if each was left.
    pub fn take(&mut self) -> Vec<Input> {
        let texts = self.texts.drain().filter(|(_, text)| !text.trim().is_empty());
        texts.map(|(field, text)| Input::Typed { field, text }).collect()
    }
}

pub fn show(ui: &mut Ui, desk: &Desk, typing: &mut Typing, inputs: &mut Vec<Input>) {
    let editor = desk.editor();
    let active = editor.active_box().map(|(_, b)| b);
    let number = |v: f64| format!("{v}");
    let of_axis = |of: fn(&crate::model::boxes::CloudBox) -> glam::DVec3, axis: Axis| {
        active.map(|b| number(of(b)[axis.index()]))
    };
    let extent = |axis| (Field::Extent(axis), of_axis(|b| b.extent, axis));
    let center = |axis| (Field::Center(axis), of_axis(|b| b.center, axis));
    let rows = [
        ("particles", (Field::Count, active.map(|b| b.n_particles.to_string())), "a whole number"),
        (
            "density",
            (Field::Density, active.and_then(density).map(number)),
            "particles in a cubic unit; 12 /m³, 0.5 /km³",
        ),
        ("extent x", extent(Axis::X), LENGTH),
        ("extent y", extent(Axis::Y), LENGTH),
        ("extent z", extent(Axis::Z), LENGTH),
        ("centre x", center(Axis::X), LENGTH),
        ("centre y", center(Axis::Y), LENGTH),
        ("centre z", center(Axis::Z), LENGTH),
        ("radius", (Field::Radius, active.map(|b| number(b.radius_max))), LENGTH),
        (
            "seed",
            (Field::Seed, Some(editor.document().seed.to_string())),
            "of the cloud's particles; no part of the file",
        ),
        (
            "grid step",
            (Field::SnapStep, Some(number(editor.settings().snap.step))),
            "of the grid that drags snap to",
        ),
    ];
    let n_selected = editor.selection().boxes().len();
    match editor.active_box() {
        Some((i, _)) if n_selected > 1 => {
            ui.label(format!("box {i} (of {n_selected} that change with it)"))
        }
        Some((i, _)) => ui.label(format!("box {i} (Enter: type)")),
        None => ui.weak("no box is selected"),
    };
    Grid::new("fields").num_columns(2).spacing([8.0, 2.0]).show(ui, |ui| {
        for (name, (field, now), hint) in rows {
            ui.label(name).on_hover_text(hint);
            one(ui, typing, (field, now), inputs);
            ui.end_row();
        }
    });
}

const LENGTH: &str = "in scene units, or 1.5 m, 150 cm, 2 km";

fn one(
    ui: &mut Ui,
    typing: &mut Typing,
    (field, now): (Field, Option<String>),
    inputs: &mut Vec<Input>,
) {
    let is_there = now.is_some();
    let now = now.unwrap_or_default();
    // A field that was taken is empty, and what it was stands behind: what is typed is all there
    // is.
    let mut text = typing.texts.get(&field).cloned().unwrap_or_else(|| now.clone());
    let edit =
        TextEdit::singleline(&mut text).id(Id::new(field)).desired_width(110.0).hint_text(now);
    let response = ui.add_enabled(is_there, edit);
    if typing.wants_focus && is_there {
        typing.wants_focus = false;
        response.request_focus();
    }
    if response.gained_focus() {
        typing.texts.insert(field, String::new());
    } else if response.changed() {
        typing.texts.insert(field, text);
    }
    if response.lost_focus() {
        let is_left = ui.input(|input| input.key_pressed(Key::Escape));
        let typed = typing.texts.remove(&field).filter(|text| !text.trim().is_empty() && !is_left);
        inputs.extend(typed.map(|text| Input::Typed { field, text }));
    }
}
