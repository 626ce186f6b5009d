//! The table is what is said of it, and every command does what its line says.

use std::collections::HashSet;

use super::super::samples::{after, editor, selected};
use super::*;
use crate::viewer::editor::handles::Handle;
use crate::viewer::editor::ray::Ray;
use glam::DVec3;

fn typed(key: char) -> Chord {
    Chord { key: Key::Char(key), ctrl: false, shift: false, alt: false }
}

#[test]
fn no_two_are_the_same_and_all_can_be_typed() {
    let mut seen = HashSet::new();
    for shortcut in SHORTCUTS {
        assert!(seen.insert(shortcut.chord), "{} twice", shortcut.chord);
        assert_eq!(command(shortcut.chord), Some(shortcut.command), "{}", shortcut.chord);
        assert!(!shortcut.description.is_empty());
    }
}

#[test]
fn todays_habits_are_kept() {
    let named =
        |chord: &str| SHORTCUTS.iter().find(|s| s.chord.to_string() == chord).map(|s| s.command);
    for (chord, command) in [
        ("Ctrl+Z", Command::Undo),
        ("Ctrl+Shift+Z", Command::Redo),
        ("Ctrl+Y", Command::Redo),
        ("Ctrl+D", Command::Duplicate),
        ("Delete", Command::Delete),
        ("Ctrl+A", Command::SelectAll),
        ("Escape", Command::Cancel),
        ("Ctrl+S", Command::Save),
        ("Ctrl+Shift+S", Command::SaveAs),
        ("Ctrl+O", Command::Open),
        ("Ctrl+N", Command::New),
        ("Ctrl+Q", Command::Quit),
        ("F", Command::Frame),
        ("G", Command::Move),
        ("S", Command::Scale),
        ("X", Command::Axis(Axis::X)),
        ("Y", Command::Axis(Axis::Y)),
        ("Z", Command::Axis(Axis::Z)),
        ("M", Command::Mirror),
        ("1", Command::View(View::Boxes)),
        ("2", Command::View(View::Cloud)),
        ("3", Command::View(View::Both)),
        ("Tab", Command::NextBox),
        ("?", Command::Help),
    ] {
        assert_eq!(named(chord), Some(command), "{chord}");
    }
}

#[test]
fn capitals_and_signs_that_take_shift_are_found() {
    assert_eq!(command(Chord { shift: true, ..typed('?') }), Some(Command::Help));
    assert_eq!(command(Chord { ctrl: true, shift: true, ..typed('Z') }), Some(Command::Redo));
    assert_eq!(command(typed('G')), Some(Command::Move));
    assert_eq!(command(Chord { alt: true, ..typed('g') }), None);
    assert_eq!(command(typed('§')), None);
}

#[test]
fn commands_of_the_editor_are_actions_that_it_takes() {
    let e = selected(&editor(3), &[2]);
    let done = |command: Command| after(&e, &[command.action(&e).unwrap()]);
    assert_eq!(done(Command::Duplicate).boxes().len(), 4);
    assert_eq!(done(Command::Delete).boxes().len(), 2);
    assert_eq!(done(Command::SelectAll).selection().boxes().len(), 3);
    assert!(done(Command::Cancel).selection().is_empty());
    assert_eq!(done(Command::Mirror).boxes()[2].center.x, -8.0);
    assert_eq!(done(Command::MirrorCopy).boxes().len(), 4);
    assert_eq!(done(Command::NextBox).selection().active(), Some(0));
    assert_eq!(done(Command::PreviousBox).selection().active(), Some(1));
    assert_eq!(done(Command::Axis(Axis::Y)).settings().axis, Axis::Y);
    assert!(done(Command::ToggleSnap).settings().snap.on);
    assert_eq!(done(Command::View(View::Cloud)).settings().view, View::Cloud);
    assert_eq!(Command::Open.action(&e), None);
}

#[test]
fn while_dragging_axes_and_escape_are_the_drags() {
    let ray = Ray { origin: DVec3::Z * 5.0, direction: -DVec3::Z };
    let begin = DragAction::Begin { handle: Handle::MoveView, ray, forward: -DVec3::Z };
    let e = after(&selected(&editor(1), &[0]), &[Action::Drag(begin)]);
    assert_eq!(
        Command::Axis(Axis::X).action(&e),
        Some(Action::Drag(DragAction::Constrain(Axis::X)))
    );
    assert_eq!(Command::Cancel.action(&e), Some(Action::Drag(DragAction::Cancel)));
}
