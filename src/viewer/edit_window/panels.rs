//! The editor's panels: numbers, the list of boxes, questions and keys; and the sketch of the boxes
//! behind them. What is clicked or typed becomes the desk's inputs.

use egui::{
    Align2, Color32, FontId, Frame, Margin, Panel, Pos2, Rect, RichText, ScrollArea, Stroke, Ui,
    pos2,
};
use glam::DVec2;

pub use super::dialogs::Choosing;
pub use super::fields::Typing;
use super::{dialogs, fields};
use crate::viewer::editor::acceptance::{Counted, mean_rate};
use crate::viewer::editor::desk::{Desk, Input};
use crate::viewer::editor::selection::How;
use crate::viewer::editor::session::Event;
use crate::viewer::editor::shortcuts::{Command, SHORTCUTS};
use crate::viewer::editor::sketch::{Color, Shape, sketch};
use crate::viewer::editor::state::{Scaling, View};
use crate::viewer::editor::{Action, Axis, Select, Setting};

/// Points.
const WIDTH: f32 = 230.0;
/// And of the line below.
const STATUS: f32 = 30.0;
const BACKGROUND: Color32 = Color32::from_rgb(24, 26, 30);
const WRONG: Color32 = Color32::from_rgb(240, 110, 100);
/// Of the list of boxes.
const LIST: f32 = 130.0;

/// What panels leave of a window of `size` pixels to the picture, at its upper left corner; a pixel
/// at least.
pub fn picture_of([width, height]: [u32; 2], px_per_point: f64) -> [u32; 2] {
    let less = |n: u32, points: f32| {
        n.saturating_sub((f64::from(points) * px_per_point).round() as u32).max(1)
    };
    [less(width, WIDTH), less(height, STATUS)]
}

/// What panels show.
pub struct Shown<'a> {
    pub desk: &'a Desk,
    /// Of each box; fewer where the device has not made them yet.
    pub counted: &'a [Counted],
    pub recent: &'a [std::path::PathBuf],
    /// Why the picture is not what is edited.
    pub wrong: Option<&'a str>,
}

/// The sketch and all panels, and what is to be done.
pub fn show(
    ui: &mut Ui,
    shown: &Shown<'_>,
    typing: &mut Typing,
    choosing: &mut Option<Choosing>,
) -> Vec<Input> {
    let mut inputs = vec![];
    draw(ui, shown.desk);
    let frame = Frame::new().fill(BACKGROUND).inner_margin(Margin::same(6));
    Panel::bottom("status")
        .resizable(false)
        .exact_size(STATUS)
        .frame(frame)
        .show(ui, |ui| status(ui, shown));
    Panel::right("numbers").resizable(false).exact_size(WIDTH).frame(frame).show(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            file(ui, shown, &mut inputs);
            ui.separator();
            fields::show(ui, shown.desk, typing, &mut inputs);
            ui.separator();
            buttons(ui, shown, &mut inputs);
            ui.separator();
            list(ui, shown, &mut inputs);
        });
    });
    dialogs::show(ui, shown, choosing, &mut inputs);
    inputs
}

/// What the keys of a command would do.
fn press(command: Command) -> Option<Input> {
    SHORTCUTS.iter().find(|s| s.command == command).map(|s| Input::Chord(s.chord))
}

/// A button that does what a key does, and says which.
fn button(ui: &mut Ui, text: &str, command: Command, is_enabled: bool, inputs: &mut Vec<Input>) {
    let shortcut = SHORTCUTS.iter().find(|s| s.command == command);
    let mut response = ui.add_enabled(is_enabled, egui::Button::new(text).small());
    if let Some(s) = shortcut {
        response = response.on_hover_text(format!("{} ({})", s.description, s.chord));
    }
    if response.clicked() {
        inputs.extend(press(command));
    }
}

fn file(ui: &mut Ui, shown: &Shown<'_>, inputs: &mut Vec<Input>) {
    let session = shown.desk.session();
    let name = session.path().map_or("(no file)".to_owned(), |path| path.display().to_string());
    let mark = if session.is_dirty() { " *" } else { "" };
    ui.label(RichText::new(format!("{name}{mark}")).strong());
    ui.horizontal_wrapped(|ui| {
        for (text, command) in [
            ("New", Command::New),
            ("Open", Command::Open),
            ("Save", Command::Save),
            ("Save as", Command::SaveAs),
        ] {
            button(ui, text, command, true, inputs);
        }
        button(ui, "?", Command::Help, true, inputs);
    });
}

fn buttons(ui: &mut Ui, shown: &Shown<'_>, inputs: &mut Vec<Input>) {
    let (editor, history) = (shown.desk.editor(), shown.desk.editor().history());
    let has_selection = !editor.selection().is_empty();
    ui.horizontal_wrapped(|ui| {
        button(ui, "Add", Command::Add, true, inputs);
        button(ui, "Duplicate", Command::Duplicate, has_selection, inputs);
        button(ui, "Delete", Command::Delete, has_selection, inputs);
        button(ui, "Mirror", Command::Mirror, has_selection, inputs);
        button(ui, "Mirror a copy", Command::MirrorCopy, has_selection, inputs);
        button(ui, "Frame", Command::Frame, true, inputs);
    });
    ui.horizontal_wrapped(|ui| {
        let text = |verb: &str, label: Option<&str>| {
            label.map_or(verb.to_owned(), |label| format!("{verb} {label}"))
        };
        button(
            ui,
            &text("Undo", history.undo_label()),
            Command::Undo,
            history.n_undo() > 0,
            inputs,
        );
        button(
            ui,
            &text("Redo", history.redo_label()),
            Command::Redo,
            history.n_redo() > 0,
            inputs,
        );
    });
    ui.horizontal(|ui| {
        let now = editor.settings().view;
        for (text, view) in [("Boxes", View::Boxes), ("Cloud", View::Cloud), ("Both", View::Both)] {
            if ui.selectable_label(now == view, text).clicked() {
                inputs.extend(press(Command::View(view)));
            }
        }
        let mut snaps = editor.settings().snap.on;
        if ui.checkbox(&mut snaps, "Snap").clicked() {
            inputs.extend(press(Command::ToggleSnap));
        }
    });
    ui.horizontal(|ui| {
        let scaling = editor.settings().scaling;
        let mut is_symmetric = scaling == Scaling::Symmetric;
        let hover = "an edge that is scaled keeps its middle, or else its other end (held Shift: \
            the other way)";
        if ui.checkbox(&mut is_symmetric, "Symmetric").on_hover_text(hover).clicked() {
            inputs.push(Input::Event(Event::Act(Action::Set(Setting::Scaling(scaling.other())))));
        }
        ui.label("mirror by");
        for (text, axis) in [("x", Axis::X), ("y", Axis::Y), ("z", Axis::Z)] {
            if ui.selectable_label(editor.settings().axis == axis, text).clicked() {
                inputs.extend(press(Command::Axis(axis)));
            }
        }
    });
}

fn list(ui: &mut Ui, shown: &Shown<'_>, inputs: &mut Vec<Input>) {
    let editor = shown.desk.editor();
    let height = ui.text_style_height(&egui::TextStyle::Body);
    let n = editor.boxes().len();
    ScrollArea::vertical().id_salt("boxes").max_height(LIST).auto_shrink([false, true]).show_rows(
        ui,
        height,
        n,
        |ui, rows| {
            for i in rows {
                let rate = shown.counted.get(i).and_then(Counted::rate);
                let rate =
                    rate.map_or(String::new(), |rate| format!(", {:.0} % accepted", 100.0 * rate));
                let text = format!("{i}: {} particles{rate}", editor.boxes()[i].n_particles);
                if ui.selectable_label(editor.selection().contains(i), text).clicked() {
                    let held = ui.input(|input| input.modifiers);
                    let how = match (held.command, held.shift) {
                        (true, _) => How::Toggle,
                        (_, true) => How::Add,
                        _ => How::Replace,
                    };
                    inputs.push(Input::Event(Event::Act(Action::Select(Select::Boxes {
                        boxes: vec![i],
                        how,
                    }))));
                }
            }
        },
    );
}

fn status(ui: &mut Ui, shown: &Shown<'_>) {
    let document = shown.desk.editor().document();
    ui.horizontal(|ui| {
        let mut text =
            format!("{} boxes, {} particles", document.boxes.len(), document.n_particles());
        if let Some(rate) = mean_rate(shown.counted) {
            text += &format!(", {:.1} % of attempts accepted", 100.0 * rate);
        }
        ui.label(text);
        if let Some(wrong) = shown.wrong {
            ui.label(RichText::new(wrong).color(WRONG));
        } else if let Some(said) = shown.desk.said() {
            ui.label(RichText::new(said).strong());
        }
    });
}

/// The boxes as the editor's view has them.
fn draw(ui: &Ui, desk: &Desk) {
    let view = desk.viewport();
    let size = view.size_px / view.px_per_point;
    let picture = Rect::from_min_size(Pos2::ZERO, egui::vec2(size.x as f32, size.y as f32));
    let painter = ui.painter_at(picture);
    let point = |p: DVec2| -> Pos2 {
        pos2((p.x / view.px_per_point) as f32, (p.y / view.px_per_point) as f32)
    };
    let color = |[r, g, b, a]: Color| Color32::from_rgba_unmultiplied(r, g, b, a);
    let stroke = |s: crate::viewer::editor::sketch::Stroke| {
        Stroke::new((s.width_px / view.px_per_point) as f32, color(s.color))
    };
    for shape in sketch(desk.editor(), &view, desk.pointing()) {
        match shape {
            Shape::Polygon { corners, fill, stroke: around } => {
                let corners = corners.into_iter().map(point).collect();
                let around = around.map_or(Stroke::NONE, stroke);
                painter.add(egui::Shape::convex_polygon(corners, color(fill), around));
            }
            Shape::Line { from, to, stroke: s } => {
                painter.line_segment([point(from), point(to)], stroke(s));
            }
            Shape::Label { at, text, color: c } => {
                painter.text(
                    point(at),
                    Align2::LEFT_CENTER,
                    text,
                    FontId::proportional(12.0),
                    color(c),
                );
            }
        }
    }
}
