use super::style::ms;
use super::*;
use crate::io::scene_file;
use crate::viewer::scene_window::knobs::Knob;
use egui::{Context, Event, PointerButton, Pos2, RawInput, Rect, vec2};
use std::path::Path;
use std::sync::Arc;

fn state() -> ViewState {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
    ViewState::new(Arc::new(scene_file::load(&path, &[], None).unwrap().scene), true).unwrap()
}

/// Runs the panels with `events`. Returns the clicked commands, and every drawn text with its
/// place.
fn run(
    context: &Context,
    events: Vec<Event>,
    status: &ViewStatus,
) -> (Vec<Command>, Vec<(String, Pos2)>) {
    let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, vec2(800.0, 1400.0)));
    let input = RawInput { screen_rect, events, ..RawInput::default() };
    let (state, mut commands) = (state(), vec![]);
    let mut output = context.run_ui(input, |ui| commands = show(ui, &state, status).0);
    output.textures_delta.clear();
    let text = |shape: &egui::epaint::ClippedShape| match &shape.shape {
        egui::Shape::Text(t) => {
            Some((t.galley.text().to_owned(), t.visual_bounding_rect().center()))
        }
        _ => None,
    };
    (commands, output.shapes.iter().filter_map(text).collect())
}

fn click(at: Pos2) -> Vec<Vec<Event>> {
    let button = |pressed| Event::PointerButton {
        pos: at,
        button: PointerButton::Primary,
        pressed,
        modifiers: Default::default(),
    };
    vec![vec![Event::PointerMoved(at)], vec![button(true)], vec![button(false)]]
}

/// A knob's button shows its value.
#[test]
fn a_click_invokes_the_command_of_the_key() {
    let context = Context::default();
    let status = ViewStatus::default();
    // Headers open with an animation that takes some frames.
    let mut texts = vec![];
    for _ in 0..20 {
        texts = run(&context, vec![], &status).1;
    }
    let (_, at) = texts
        .iter()
        .find(|(text, _)| text == "two-reflection")
        .unwrap_or_else(|| panic!("{texts:?}"));
    let mut commands = vec![];
    for events in click(*at) {
        commands.extend(run(&context, events, &status).0);
    }
    assert_eq!(commands, [Command::Advance(Knob::Lighting)]);
    assert!(texts.iter().any(|(text, _)| text == "threads.mode"));
    assert!(texts.iter().any(|(text, _)| text == "no frame yet"));
}

#[test]
fn times_have_three_digits() {
    assert_eq!([ms(0.123), ms(12.34), ms(1234.5)], ["0.12", "12.3", "1234"]);
}
