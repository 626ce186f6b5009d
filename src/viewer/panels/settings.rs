//! What is set, which frame is shown, what the plan says, and what is odd about it.

use egui::{Button, Color32, Grid, RichText, Slider, Ui};

use super::{DIM, GAME, WRONG};
use crate::frame::plan::Pass;
use crate::viewer::knobs::Knob;
use crate::viewer::playback::Action;
use crate::viewer::seen::{Judged, Seen};
use crate::viewer::wanted::{Beside, Command, SHORTCUTS, Wanted};

/// A button a knob: a click turns it to its next value, as its key does.
pub fn knobs(ui: &mut Ui, wanted: &Wanted, seen: &Seen, commands: &mut Vec<Command>) {
    Grid::new("knobs").num_columns(2).spacing([8.0, 2.0]).show(ui, |ui| {
        let mut row = |ui: &mut Ui, name: &str, value: &str, command: Command| {
            ui.label(name);
            let hover = SHORTCUTS.iter().find(|(_, c, _)| *c == command);
            let button = ui.add(Button::new(RichText::new(value).monospace()).small());
            let button = match hover {
                Some((key, _, what)) => button.on_hover_text(format!("{what} ({key})")),
                None => button,
            };
            if button.clicked() {
                commands.push(command);
            }
            ui.end_row();
        };
        for knob in Knob::ALL {
            row(ui, knob.key(), knob.value(&wanted.scene).trim_matches('"'), Command::Turn(knob));
        }
        row(ui, "skip", if wanted.skip { "on" } else { "off" }, Command::Skip);
        row(ui, "present", seen.present.map_or("", |mode| mode.name()), Command::PresentMode);
    });
}

/// Play, pause, step, seek.
pub fn playback(ui: &mut Ui, wanted: &Wanted, seen: &Seen, commands: &mut Vec<Command>) {
    let playback = wanted.playback;
    ui.horizontal(|ui| {
        let buttons = [
            ("⏮", Action::Seek(0)),
            ("◀", Action::Step(-1)),
            (if playback.is_paused() { "▶" } else { "⏸" }, Action::Toggle),
            ("▶|", Action::Step(1)),
        ];
        for (text, action) in buttons {
            if ui.button(text).clicked() {
                commands.push(Command::Play(action));
            }
        }
    });
    let mut i_frame = playback.i_frame();
    ui.spacing_mut().slider_width = (ui.available_width() - 60.0).max(40.0);
    let last = playback.n_frames().saturating_sub(1);
    if ui.add_enabled(last > 0, Slider::new(&mut i_frame, 0..=last)).changed() {
        commands.push(Command::Play(Action::Seek(i_frame)));
    }
    if let Some(last) = &seen.last {
        ui.label(format!(
            "{:.3} s, {} of {} particles drawn",
            last.time_s, last.n_shown, last.n_particles
        ));
    }
    ui.label(RichText::new(&seen.device).color(DIM).small());
}

/// Which passes the last frame ran, and why not the others.
pub fn plan(ui: &mut Ui, seen: &Seen) {
    let Some(last) = &seen.last else {
        ui.weak("no frame yet");
        return;
    };
    for pass in Pass::ALL {
        let decision = last.plan.decision(pass);
        ui.horizontal_wrapped(|ui| {
            let (mark, color) = if decision.run { ("●", GAME) } else { ("○", DIM) };
            ui.label(RichText::new(mark).color(color));
            ui.label(pass.name());
            ui.label(RichText::new(decision.reason.to_string()).color(DIM).small());
        });
    }
}

/// What is no finite number, cut off or folded, in the frame that was counted.
pub fn counters(ui: &mut Ui, seen: &Seen, commands: &mut Vec<Command>) {
    if ui.button("count").on_hover_text("reads the next frame back and counts (n)").clicked() {
        commands.push(Command::Count);
    }
    let Some((i_frame, c)) = &seen.counts else {
        ui.weak("not counted yet");
        return;
    };
    let rows = [
        ("not finite, of the picture", c.not_finite, Some(c.values)),
        ("at the format's end", c.saturated, Some(c.values)),
        ("particles folded back", c.folded, Some(c.particles)),
        ("facets not finite", c.facets_not_finite, Some(c.facets)),
        ("facets below 0", c.facets_negative, Some(c.facets)),
        ("pairs unresolved", c.pairs_unresolved, None),
        ("sources lost", c.sources_lost, None),
    ];
    ui.label(format!("frame {i_frame}"));
    Grid::new("counts").num_columns(2).spacing([8.0, 1.0]).show(ui, |ui| {
        for (name, n, of) in rows {
            ui.label(name);
            let bad = name.contains("finite") && n > 0;
            let of = of.map_or(String::new(), |of: u64| format!(" of {of}"));
            let text = RichText::new(format!("{n}{of}")).monospace();
            ui.label(if bad { text.color(Color32::WHITE).background_color(WRONG) } else { text });
            ui.end_row();
        }
    });
}

/// A and B, and how far they are from the truth.
pub fn compare(ui: &mut Ui, wanted: &Wanted, seen: &Seen, commands: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        let held = wanted.other.is_some();
        if ui
            .selectable_label(held, "B")
            .on_hover_text("keeps what is set as B, or forgets it (m)")
            .clicked()
        {
            commands.push(Command::Hold);
        }
        let ways = [
            ("split", Beside::Split(0.5)),
            ("difference", Beside::Difference(8.0)),
            ("B alone", Beside::Other),
        ];
        for (text, way) in ways {
            let is_now = std::mem::discriminant(&way) == std::mem::discriminant(&wanted.beside);
            if ui.add_enabled_ui(held, |ui| ui.selectable_label(is_now, text)).inner.clicked() {
                commands.push(Command::Beside(way));
            }
        }
    });
    if wanted.other.is_some() {
        ui.spacing_mut().slider_width = (ui.available_width() - 60.0).max(40.0);
        match wanted.beside {
            Beside::Split(mut share) => {
                if ui.add(Slider::new(&mut share, 0.0..=1.0).fixed_decimals(2)).changed() {
                    commands.push(Command::Beside(Beside::Split(share)));
                }
            }
            Beside::Difference(mut gain) => {
                if ui.add(Slider::new(&mut gain, 1.0..=1000.0).logarithmic(true)).changed() {
                    commands.push(Command::Beside(Beside::Difference(gain)));
                }
            }
            Beside::Other => {}
        }
        for knob in Knob::ALL {
            let other =
                wanted.other.as_ref().map(|other| knob.value(&other.scene)).unwrap_or_default();
            let here = knob.value(&wanted.scene);
            if here != other {
                ui.label(format!("{}: A {here}, B {other}", knob.key()));
            }
        }
        if let Some(ms) = seen.other_ms {
            ui.label(format!("B's frame: {} ms; A's frame times have it in them", super::ms(ms)));
        }
    }
    let mut judges = wanted.judges;
    let hover = "RMSE and greatest difference from the f64 reference, while the eye and the frame \
        stand still (j)";
    if ui.checkbox(&mut judges, "error against the reference").on_hover_text(hover).clicked() {
        commands.push(Command::Judge);
    }
    if let Some(judged) = &seen.judged {
        errors(ui, wanted, judged);
    }
}

fn errors(ui: &mut Ui, wanted: &Wanted, judged: &Judged) {
    let standing = &judged.standing;
    if let Some(known) = &standing.known {
        for (name, error) in ["A", "B"].into_iter().zip(&judged.errors) {
            if let Some(e) = error {
                ui.monospace(format!("{name}: RMSE {:.2e}, greatest {:.2e}", e.rmse.value, e.max));
            }
        }
        let cached = if known.from_cache { ", kept from before" } else { "" };
        let text =
            format!("at {} pixels, against {}{cached}", known.pixels.at.len(), known.view.against);
        ui.label(RichText::new(text).color(DIM).small());
    } else if !wanted.playback.is_paused() {
        ui.weak("pause (space) to measure");
    } else if let Some(why) = &standing.failed {
        ui.label(RichText::new(why).color(Color32::WHITE).background_color(WRONG));
    }
    if let Some(p) = &standing.progress {
        ui.weak(format!("{} of {} done, for {} pixels", p.n_done, p.n, p.n_pixels));
    }
}
