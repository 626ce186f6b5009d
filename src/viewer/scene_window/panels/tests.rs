use super::style::ms;
use super::*;
use crate::frame::Counts;
use crate::io::scene_file;
use crate::viewer::error_probe::ProbeStatus;
use crate::viewer::layout::has_room_for_panels;
use crate::viewer::scene_window::knobs::Knob;
use crate::viewer::scene_window::playback::Seek;
use crate::viewer::scene_window::status::ErrorStatus;
use crate::viewer::scene_window::timeline::{CAPACITY, tests::times};
use crate::viewer::scene_window::view_state::Variant;
use crate::viewer::widget_check::{
    FakeWindow, Text, assert_whole_lines, click, find, is_visible, windows,
};
use egui::pos2;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

fn state() -> ViewState {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
    let scene = Arc::new(scene_file::load(&path, &[], None).unwrap().scene);
    let mut state = ViewState::new(scene, true).unwrap();
    state.has_panels = true;
    state
}

/// A state with all that makes lines long.
fn full_state() -> ViewState {
    let mut state = state();
    state.variant = Some(Variant { scene: state.scene.clone(), skips: true });
    for knob in Knob::ALL {
        knob.advance(Arc::make_mut(&mut state.scene)).unwrap();
    }
    state.act(Command::Seek(Seek::TogglePause));
    state.measures_error = true;
    state
}

fn full_status() -> ViewStatus {
    let (zero, mut status) = (Instant::now(), ViewStatus::default());
    let passes: Vec<(&'static str, f64, f64)> =
        ["generate", "place", "transmit", "second", "contract", "impostors", "upsample"]
            .into_iter()
            .enumerate()
            .map(|(i, name)| (name, 1e9 * i as f64, 1e9 * (i + 1) as f64))
            .collect();
    for i in 0..CAPACITY as u32 {
        // Frame times of some thousand ms have the most digits.
        status.timeline.push(&times(zero, 3000 + 10 * i, &passes));
    }
    let n = 3840 * 2160 * 4;
    let counts = Counts {
        values: n,
        not_finite: n,
        saturated: n,
        particles: 1 << 30,
        folded: 1 << 30,
        facets: 1 << 30,
        facets_not_finite: 1 << 30,
        facets_negative: 1 << 30,
        pairs_unresolved: u64::from(u32::MAX),
        sources_lost: u64::from(u32::MAX),
    };
    status.counts = Some((123_456, counts));
    status.device_name = "llvmpipe (LLVM 15.0.6, 256 bits), of a maker with a long name".to_owned();
    status.variant_ms = Some(12.345);
    let failure = Some("the folder of references cannot be written: disk full".to_owned());
    let probe = ProbeStatus { failure, ..ProbeStatus::default() };
    status.error = Some(ErrorStatus { probe, ..ErrorStatus::default() });
    status
}

/// Opens every section of a window that is high enough for all of them.
fn open_all(window: &mut FakeWindow, state: &ViewState, status: &ViewStatus) -> Vec<Text> {
    let mut add = |ui: &mut Ui| drop(show_all(ui, state, status, &[]));
    for (title, inside) in
        [("A and B", "split"), ("Timeline", "device"), ("Plan", "○"), ("Counters", "count")]
    {
        let texts = window.settle(&mut add);
        if !texts.iter().any(|t| t.text == inside) {
            let at = find(&texts, title).rect.center();
            click(at).into_iter().for_each(|events| drop(window.run(events, &mut add)));
        }
    }
    window.settle(add)
}

#[test]
fn panels_leave_two_thirds_of_the_picture_and_cut_no_line() {
    let (state, status) = (full_state(), full_status());
    for (size, scale) in windows() {
        assert!(has_room_for_panels(size, scale));
        let what = format!("{size:?} at {scale}");
        let mut window = FakeWindow::new(size, scale);
        let rect = window.rect();
        let mut room = egui::Rect::NOTHING;
        let texts = window.settle(|ui| {
            room = show_all(ui, &state, &status, &[]).1.expect("panels").room;
        });
        assert!(
            room.area() <= 0.334 * rect.area() && rect.expand(1.0).contains_rect(room),
            "{what}: {room:?}"
        );
        assert_whole_lines(&texts, rect, &what);
        // The same width, with all sections open.
        let high = [size[0], size[1].max(size[0] * 8)];
        let mut window = FakeWindow::new(high, scale);
        let texts = open_all(&mut window, &state, &status);
        assert_whole_lines(&texts, window.rect(), &what);
        assert!(texts.len() > 100, "{what}: {texts:?}");
    }
}

#[test]
fn all_panels_are_reached_by_scrolling_in_the_smallest_window() {
    let (state, status) = (full_state(), full_status());
    let mut window = FakeWindow::new([640, 480], 1.0);
    let mut add = |ui: &mut Ui| drop(show_all(ui, &state, &status, &[]));
    let at = pos2(600.0, 240.0);
    // Sections are opened from the last to the first, so that the wheel reaches each title.
    let mut seen: BTreeSet<String> = BTreeSet::new();
    for title in ["Counters", "Plan", "Passes", "Timeline", "A and B"] {
        window.scroll(at, 1e5, &mut add);
        let mut texts = window.settle(&mut add);
        for _ in 0..40 {
            let found = texts.iter().find(|t| t.text == title).cloned();
            if let Some(t) = found.filter(|t| is_visible(t, window.rect())) {
                click(t.rect.center()).into_iter().for_each(|e| drop(window.run(e, &mut add)));
                break;
            }
            texts = window.scroll(at, -100.0, &mut add);
        }
    }
    window.scroll(at, -1e5, &mut add);
    for _ in 0..40 {
        let texts = window.scroll(at, 100.0, &mut add);
        seen.extend(texts.iter().filter(|t| is_visible(t, window.rect())).map(|t| t.text.clone()));
    }
    for text in [
        "lighting.mode",
        "draw.resolution",
        "error against the reference",
        "device",
        "impostors",
        "○",
        "picture values not finite",
        "sources lost",
        "h hides the panels, ? lists the keys",
    ] {
        assert!(seen.contains(text), "{text} is not reached: {seen:?}");
    }
}

/// A knob's button shows its value.
#[test]
fn a_click_invokes_the_command_of_the_key() {
    let (state, status) = (state(), ViewStatus::default());
    let mut window = FakeWindow::new([800, 1400], 1.0);
    let mut commands = vec![];
    let mut add = |ui: &mut Ui| commands.extend(show_all(ui, &state, &status, &[]).0);
    let texts = window.settle(&mut add);
    let at = find(&texts, "two-reflection").rect.center();
    click(at).into_iter().for_each(|events| drop(window.run(events, &mut add)));
    assert_eq!(commands, [Command::Advance(Knob::Lighting)]);
    find(&texts, "threads.mode");
    find(&texts, "no frame yet");
}

#[test]
fn the_list_of_keys_is_inside_every_window_and_scrolls() {
    let status = ViewStatus::default();
    let mut state = state();
    (state.shows_help, state.has_panels) = (true, false);
    let small = [([320, 240], 1.0), ([320, 240], 2.0)];
    for (size, scale) in windows().chain(small) {
        let what = format!("{size:?} at {scale}");
        let mut window = FakeWindow::new(size, scale);
        let mut add = |ui: &mut Ui| drop(show_all(ui, &state, &status, &[]));
        let (rect, mut seen) = (window.rect(), BTreeSet::new());
        let mut texts = window.settle(&mut add);
        for _ in 0..30 {
            assert_whole_lines(&texts, rect, &what);
            let visible = texts.iter().filter(|t| is_visible(t, rect));
            seen.extend(visible.map(|t| t.text.clone()));
            texts = window.scroll(rect.center(), 60.0, &mut add);
        }
        for (title, keys) in key_groups() {
            assert!(seen.contains(title), "{what}: {title}");
            for (key, description) in keys {
                assert!(seen.contains(key) && seen.contains(description), "{what}: {key}");
            }
        }
    }
}

#[test]
fn messages_and_errors_stay_legible_beside_the_panels() {
    let path = format!("saved /home/{}/captures/hello-view-12.png", "long-name/".repeat(14));
    let status = ViewStatus {
        file_error: Some("scene.toml:3:9: expected a number, found `]`".to_owned()),
        render_error: Some("shaders/tiles.comp:1: no such thing\n".repeat(100_000)),
        ..ViewStatus::default()
    };
    for (size, scale) in windows() {
        let what = format!("{size:?} at {scale}");
        let mut state = state();
        state.shows_hint = true;
        let mut window = FakeWindow::new(size, scale);
        let rect = window.rect();
        let mut room = egui::Rect::NOTHING;
        let messages = [path.clone(), "skipping is off".to_owned()];
        let texts = window.settle(|ui| {
            room = show_all(ui, &state, &status, &messages).1.expect("panels").room;
        });
        for text in [path.as_str(), "skipping is off", HINT] {
            let shown = find(&texts, text);
            assert!(!shown.is_cut && is_visible(shown, rect), "{what}: {shown:?}");
            assert!(shown.rect.right() <= room.left() + 1.0, "{what}: {shown:?} {room:?}");
        }
        let alarm = texts.iter().find(|t| t.text.starts_with("scene.toml:3:9")).expect(&what);
        assert!(is_visible(alarm, rect) && alarm.rect.height() < 0.4 * rect.height(), "{what}");
    }
}

#[test]
fn a_window_of_any_size_is_drawn() {
    let (mut state, status) = (full_state(), full_status());
    for shows_help in [false, true] {
        (state.shows_help, state.shows_hint) = (shows_help, true);
        for size in [[1, 1], [16, 4], [4, 300], [300, 4], [64, 48], [199, 99], [16384, 16384]] {
            for scale in [0.5, 1.0, 3.0] {
                let mut window = FakeWindow::new(size, scale);
                window.settle(|ui| {
                    show_all(ui, &state, &status, &["saved a file".to_owned()]);
                });
            }
        }
    }
}

#[test]
fn times_have_three_digits() {
    assert_eq!([ms(0.123), ms(12.34), ms(1234.5)], ["0.12", "12.3", "1234"]);
}
