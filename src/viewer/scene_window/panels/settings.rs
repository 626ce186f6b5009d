//! Sections with controls: knobs, playback, comparison, plan and counters.

use std::mem::discriminant;

use egui::{Button, Color32, Grid, RichText, Slider, Ui};

use super::style::{DIM, GAME, ms};
use crate::frame::plan::Pass;
use crate::viewer::colors::ERROR;
use crate::viewer::scene_window::commands::{Command, Comparison, SHORTCUTS};
use crate::viewer::scene_window::knobs::Knob;
use crate::viewer::scene_window::playback::Seek;
use crate::viewer::scene_window::status::{ErrorStatus, ViewStatus};
use crate::viewer::scene_window::view_state::ViewState;
use crate::viewer::shortcut::Shortcut;

/// Adds a button for each knob. A click sets the knob to its next value, as its key does.
pub fn knobs(ui: &mut Ui, state: &ViewState, status: &ViewStatus, commands: &mut Vec<Command>) {
    Grid::new("knobs").num_columns(2).spacing([8.0, 2.0]).show(ui, |ui| {
        let mut row = |name: &str, value: &str, command: Command| {
            ui.label(name);
            let mut button = ui.add(Button::new(RichText::new(value).monospace()).small());
            if let Some(text) = Shortcut::tooltip(&SHORTCUTS, command) {
                button = button.on_hover_text(text);
            }
            if button.clicked() {
                commands.push(command);
            }
            ui.end_row();
        };
        for knob in Knob::ALL {
            row(knob.key(), knob.value(&state.scene).trim_matches('"'), Command::Advance(knob));
        }
        row("skip", if state.skips { "on" } else { "off" }, Command::ToggleSkipping);
        let mode = status.present_mode.map_or("", |mode| mode.name());
        row("present", mode, Command::NextPresentMode);
    });
}

/// Adds the playback buttons and the frame slider.
pub fn playback(ui: &mut Ui, state: &ViewState, status: &ViewStatus, commands: &mut Vec<Command>) {
    let playback = state.playback;
    ui.horizontal(|ui| {
        for (text, seek) in [
            ("⏮", Seek::To(0)),
            ("◀", Seek::By(-1)),
            (if playback.is_paused() { "▶" } else { "⏸" }, Seek::TogglePause),
            ("▶|", Seek::By(1)),
        ] {
            if ui.button(text).clicked() {
                commands.push(Command::Seek(seek));
            }
        }
    });
    let (mut i_frame, i_last) = (playback.i_frame(), playback.n_frames() - 1);
    widen_slider(ui);
    if ui.add_enabled(i_last > 0, Slider::new(&mut i_frame, 0..=i_last)).changed() {
        commands.push(Command::Seek(Seek::To(i_frame)));
    }
    if let Some(frame) = status.timeline.newest() {
        let (time_s, n_shown, n) = (frame.time_s, frame.n_shown(), state.scene.n_particles());
        ui.label(format!("{time_s:.3} s, {n_shown} of {n} particles drawn"));
    }
    ui.label(RichText::new(&status.device_name).color(DIM).small());
}

/// Width of a slider's number, points: five digits and their margins.
const SLIDER_NUMBER: f32 = 60.0;
/// Smallest width of a slider that can still be dragged, points.
const LEAST_SLIDER: f32 = 40.0;

/// Widens sliders to the panel, and leaves space for their numbers.
fn widen_slider(ui: &mut Ui) {
    ui.spacing_mut().slider_width = (ui.available_width() - SLIDER_NUMBER).max(LEAST_SLIDER);
}

/// Adds the passes of the last frame, with the reason why each ran or was skipped.
pub fn plan(ui: &mut Ui, status: &ViewStatus) {
    let Some(frame) = status.timeline.newest() else {
        ui.weak("no frame yet");
        return;
    };
    for pass in Pass::ALL {
        let decision = frame.plan.decision(pass);
        ui.horizontal_wrapped(|ui| {
            let (mark, color) = if decision.run { ("●", GAME) } else { ("○", DIM) };
            ui.label(RichText::new(mark).color(color));
            ui.label(pass.name());
            ui.label(RichText::new(decision.reason.to_string()).color(DIM).small());
        });
    }
}

/// Adds the counts of non-finite, clipped and folded values.
pub fn counters(ui: &mut Ui, status: &ViewStatus, commands: &mut Vec<Command>) {
    if ui.button("count").on_hover_text("reads the next frame back and counts (n)").clicked() {
        commands.push(Command::Count);
    }
    let Some((i_frame, c)) = &status.counts else {
        ui.weak("not counted yet");
        return;
    };
    ui.label(format!("frame {i_frame}"));
    for (name, n, of, is_fault) in [
        ("picture values not finite", c.not_finite, Some(c.values), true),
        ("picture values clipped", c.saturated, Some(c.values), false),
        ("particles folded back", c.folded, Some(c.particles), false),
        ("facets not finite", c.facets_not_finite, Some(c.facets), true),
        ("facets below 0", c.facets_negative, Some(c.facets), false),
        ("pairs unresolved", c.pairs_unresolved, None, false),
        ("sources lost", c.sources_lost, None, false),
    ] {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing = [8.0, 0.0].into();
            ui.label(name);
            let of = of.map_or(String::new(), |of| format!(" of {of}"));
            let text = RichText::new(format!("{n}{of}")).monospace();
            ui.label(if is_fault && n > 0 { highlighted(text) } else { text });
        });
    }
}

fn highlighted(text: RichText) -> RichText {
    text.color(Color32::WHITE).background_color(ERROR)
}

/// Tooltip of the button that keeps or drops B.
const KEEP_B: &str =
    "keeps the present settings as B, to compare later ones (A) with them, or drops B (m)";

/// Adds the comparison of A with B, and the error of both.
pub fn compare(ui: &mut Ui, state: &ViewState, status: &ViewStatus, commands: &mut Vec<Command>) {
    let has_b = state.variant.is_some();
    ui.horizontal_wrapped(|ui| {
        let label = ui.selectable_label(has_b, "B");
        if label.on_hover_text(KEEP_B).clicked() {
            commands.push(Command::ToggleB);
        }
        for (text, comparison) in [
            ("split", Comparison::HALVES),
            ("difference", Comparison::DIFFERENCE),
            ("B alone", Comparison::OnlyB),
        ] {
            let is_selected = discriminant(&comparison) == discriminant(&state.comparison);
            let label = ui.add_enabled_ui(has_b, |ui| ui.selectable_label(is_selected, text));
            if label.inner.clicked() {
                commands.push(Command::Compare(comparison));
            }
        }
    });
    if let Some(variant) = &state.variant {
        widen_slider(ui);
        match state.comparison {
            Comparison::Split(mut share) => {
                if ui.add(Slider::new(&mut share, 0.0..=1.0).fixed_decimals(2)).changed() {
                    commands.push(Command::Compare(Comparison::Split(share)));
                }
            }
            Comparison::Difference(mut gain) => {
                if ui.add(Slider::new(&mut gain, 1.0..=1000.0).logarithmic(true)).changed() {
                    commands.push(Command::Compare(Comparison::Difference(gain)));
                }
            }
            Comparison::OnlyB => {}
        }
        for knob in Knob::ALL {
            let (a, b) = (knob.value(&state.scene), knob.value(&variant.scene));
            if a != b {
                ui.label(format!("{}: A {a}, B {b}", knob.key()));
            }
        }
        if let Some(b_ms) = status.variant_ms {
            ui.label(format!("frame of B: {} ms (included in the frame times)", ms(b_ms)));
        }
    }
    let mut measures = state.measures_error;
    let hover = "RMSE and greatest difference from the f64 reference, while camera and frame \
        stand still (j)";
    let checkbox = ui.checkbox(&mut measures, "error against the reference");
    if checkbox.on_hover_text(hover).clicked() {
        commands.push(Command::ToggleError);
    }
    if let Some(error) = &status.error {
        errors(ui, state, error);
    }
}

fn errors(ui: &mut Ui, state: &ViewState, error: &ErrorStatus) {
    let probe = &error.probe;
    if let Some(reference) = &probe.reference {
        for (name, error) in [("A", &error.a), ("B", &error.b)] {
            if let Some(e) = error {
                ui.monospace(format!("{name}: RMSE {:.2e}, greatest {:.2e}", e.rmse.value, e.max));
            }
        }
        let cached = if reference.from_cache { ", from the cache" } else { "" };
        let (n, kind) = (reference.pixels.at.len(), reference.request.kind);
        let text = RichText::new(format!("at {n} pixels, against {kind}{cached}"));
        ui.label(text.color(DIM).small());
    } else if !state.playback.is_paused() {
        ui.weak("press space to pause; then it is measured");
    } else if let Some(why) = &probe.failure {
        ui.label(highlighted(RichText::new(why)));
    }
    if let Some(p) = &probe.progress {
        ui.weak(format!("{} of {} done, for {} pixels", p.n_done, p.n, p.n_pixels));
    }
}
