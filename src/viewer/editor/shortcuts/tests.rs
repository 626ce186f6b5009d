//! Chords are unique, and every command has its action.

use std::collections::HashSet;

use super::super::fixtures::{after, editor, selected};
use super::*;
use crate::viewer::editor::handles::Handle;
use crate::viewer::editor::ray::Ray;
use glam::DVec3;

fn typed(key: char) -> Chord {
    Chord { key: Key::Char(key), ctrl: false, shift: false, alt: false }
}

/// Returns the chord with this name.
fn chord(name: &str) -> Chord {
    let (modifiers, key) = name.rsplit_once('+').unwrap_or(("", name));
    let named = [Key::Delete, Key::Backspace, Key::Escape, Key::Tab];
    let named = named.into_iter().find(|named| format!("{named:?}") == key);
    let typed = key.to_lowercase().chars().next().map(Key::Char);
    let [ctrl, shift, alt] = ["Ctrl", "Shift", "Alt"].map(|held| modifiers.contains(held));
    Chord { key: named.or(typed).unwrap(), ctrl, shift, alt }
}

#[test]
fn every_chord_has_one_command() {
    let mut seen = HashSet::new();
    for shortcut in SHORTCUTS {
        assert!(seen.insert(shortcut.key), "{} twice", shortcut.key);
        assert_eq!(command(chord(shortcut.key)), Some(shortcut.command), "{}", shortcut.key);
        assert!(!shortcut.description.is_empty());
    }
}

#[test]
#[cfg(feature = "window")]
fn every_chord_is_in_one_group_of_the_list() {
    let groups = crate::viewer::editor::key_groups();
    let listed: Vec<&str> = groups.iter().flat_map(|(_, keys)| keys.iter().map(|k| k.0)).collect();
    for shortcut in SHORTCUTS {
        assert_eq!(listed.iter().filter(|k| **k == shortcut.key).count(), 1, "{}", shortcut.key);
    }
}

#[test]
fn common_chords_have_their_usual_commands() {
    for (name, expected) in [
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
        ("1", Command::Display(DisplayMode::Boxes)),
        ("2", Command::Display(DisplayMode::Cloud)),
        ("3", Command::Display(DisplayMode::Both)),
        ("Tab", Command::NextBox),
        ("?", Command::Help),
    ] {
        assert_eq!(command(chord(name)), Some(expected), "{name}");
    }
}

#[test]
fn capitals_and_shifted_signs_are_recognized() {
    assert_eq!(command(Chord { shift: true, ..typed('?') }), Some(Command::Help));
    assert_eq!(command(Chord { ctrl: true, shift: true, ..typed('Z') }), Some(Command::Redo));
    assert_eq!(command(typed('G')), Some(Command::Move));
    assert_eq!(command(Chord { alt: true, ..typed('g') }), None);
    assert_eq!(command(typed('§')), None);
}

#[test]
fn commands_become_actions() {
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
    assert!(done(Command::ToggleSnap).settings().snap.is_on);
    assert_eq!(done(Command::Display(DisplayMode::Cloud)).settings().display, DisplayMode::Cloud);
    assert_eq!(Command::Open.action(&e), None);
}

#[test]
fn during_a_drag_axis_keys_and_escape_act_on_the_drag() {
    let ray = Ray { origin: DVec3::Z * 5.0, direction: -DVec3::Z };
    let begin = DragAction::Begin { handle: Handle::MoveView, ray, forward: -DVec3::Z };
    let e = after(&selected(&editor(1), &[0]), &[Action::Drag(begin)]);
    assert_eq!(
        Command::Axis(Axis::X).action(&e),
        Some(Action::Drag(DragAction::Constrain(Axis::X)))
    );
    assert_eq!(Command::Cancel.action(&e), Some(Action::Drag(DragAction::Cancel)));
}
