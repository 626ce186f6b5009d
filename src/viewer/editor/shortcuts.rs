//! Keyboard shortcuts of the editor, with their commands and descriptions.

use std::fmt;

use super::action::{Action, DragAction, Edit, MirrorPlane, MirrorResult, Select, Setting};
use super::axis::Axis;
use super::grid_snap::GridSnap;
use super::settings::DisplayMode;
use super::state::Editor;

/// A key of the keyboard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Key {
    /// The character that the key types; letters in lower case.
    Char(char),
    /// Delete.
    Delete,
    /// Backspace.
    Backspace,
    /// Escape.
    Escape,
    /// Tab.
    Tab,
}

/// A key with its modifiers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Chord {
    /// The key.
    pub key: Key,
    /// Ctrl, or Command on a Mac.
    pub ctrl: bool,
    /// Shift.
    pub shift: bool,
    /// Alt.
    pub alt: bool,
}

/// A command of the editor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Command {
    New,
    Open,
    Save,
    SaveAs,
    Quit,
    Undo,
    Redo,
    Add,
    Duplicate,
    /// Delete.
    Delete,
    SelectAll,
    /// Cancels a drag, or clears the selection.
    Cancel,
    NextBox,
    PreviousBox,
    /// Moves the camera so that the selection fills the picture.
    Frame,
    /// Begins a drag without a button; the next press ends it.
    Move,
    Scale,
    /// Restricts a drag to an axis; without a drag, sets the axis of mirroring.
    Axis(Axis),
    Mirror,
    MirrorCopy,
    MirrorMiddle,
    ToggleSnap,
    Display(DisplayMode),
    Help,
}

/// A chord with its command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shortcut {
    pub chord: Chord,
    pub command: Command,
    #[cfg_attr(not(feature = "window"), allow(dead_code, reason = "only panels list the keys"))]
    pub description: &'static str,
}

const fn shortcut(key: Key, command: Command, description: &'static str) -> Shortcut {
    Shortcut { chord: Chord { key, ctrl: false, shift: false, alt: false }, command, description }
}

const fn ctrl(key: char, command: Command, description: &'static str) -> Shortcut {
    let chord = Chord { key: Key::Char(key), ctrl: true, shift: false, alt: false };
    Shortcut { chord, command, description }
}

const fn with_shift(shortcut: Shortcut) -> Shortcut {
    Shortcut { chord: Chord { shift: true, ..shortcut.chord }, ..shortcut }
}

const fn with_alt(shortcut: Shortcut) -> Shortcut {
    Shortcut { chord: Chord { alt: true, ..shortcut.chord }, ..shortcut }
}

/// Every shortcut, in the order of the list of keys. Panels show the first chord of a command.
pub const SHORTCUTS: [Shortcut; 30] = [
    ctrl('n', Command::New, "new cloud"),
    ctrl('o', Command::Open, "open a box file"),
    ctrl('s', Command::Save, "save"),
    with_shift(ctrl('s', Command::SaveAs, "save under another name")),
    ctrl('q', Command::Quit, "quit"),
    ctrl('z', Command::Undo, "undo"),
    with_shift(ctrl('z', Command::Redo, "redo")),
    ctrl('y', Command::Redo, "redo"),
    shortcut(Key::Char('a'), Command::Add, "add a box"),
    ctrl('d', Command::Duplicate, "duplicate the selection"),
    shortcut(Key::Delete, Command::Delete, "delete the selection"),
    shortcut(Key::Backspace, Command::Delete, "delete the selection"),
    ctrl('a', Command::SelectAll, "select all boxes"),
    shortcut(Key::Escape, Command::Cancel, "cancel the drag, or select nothing"),
    shortcut(Key::Tab, Command::NextBox, "select the next box"),
    with_shift(shortcut(Key::Tab, Command::PreviousBox, "select the box before")),
    shortcut(Key::Char('f'), Command::Frame, "look at the selection, or at everything"),
    shortcut(Key::Char('g'), Command::Move, "move the selection"),
    shortcut(Key::Char('s'), Command::Scale, "scale the selection"),
    shortcut(Key::Char('x'), Command::Axis(Axis::X), "along x only; the axis to mirror by"),
    shortcut(Key::Char('y'), Command::Axis(Axis::Y), "along y only; the axis to mirror by"),
    shortcut(Key::Char('z'), Command::Axis(Axis::Z), "along z only; the axis to mirror by"),
    shortcut(Key::Char('m'), Command::Mirror, "mirror the selection across 0"),
    with_shift(shortcut(
        Key::Char('m'),
        Command::MirrorCopy,
        "mirror a copy of the selection across 0",
    )),
    with_alt(shortcut(
        Key::Char('m'),
        Command::MirrorMiddle,
        "mirror the selection across its middle",
    )),
    with_shift(shortcut(Key::Char('s'), Command::ToggleSnap, "snap to the grid, or do not")),
    shortcut(Key::Char('1'), Command::Display(DisplayMode::Boxes), "show the boxes"),
    shortcut(Key::Char('2'), Command::Display(DisplayMode::Cloud), "show the cloud"),
    shortcut(Key::Char('3'), Command::Display(DisplayMode::Both), "show both"),
    shortcut(Key::Char('?'), Command::Help, "list the keys"),
];

/// Returns the command of a chord.
pub fn command(chord: Chord) -> Option<Command> {
    let chord = chord.normal();
    SHORTCUTS.iter().find(|shortcut| shortcut.chord == chord).map(|shortcut| shortcut.command)
}

impl Chord {
    /// Returns the chord with a lower-case letter. A sign loses its shift, because "?" needs shift
    /// only on some keyboards.
    fn normal(self) -> Chord {
        match self.key {
            Key::Char(c) if c.is_alphabetic() => {
                Chord { key: Key::Char(c.to_lowercase().next().unwrap_or(c)), ..self }
            }
            Key::Char(_) => Chord { shift: false, ..self },
            _ => self,
        }
    }
}

impl Command {
    /// Returns the command's action on the editor's state; `None` for a command that needs a file,
    /// a camera or the pointer.
    pub fn action(self, editor: &Editor) -> Option<Action> {
        let is_dragging = editor.dragged_handle().is_some();
        let settings = editor.settings();
        let mirror =
            |plane, result| Action::Edit(Edit::Mirror { axis: settings.axis, plane, result });
        Some(match self {
            Command::Undo => Action::Undo,
            Command::Redo => Action::Redo,
            Command::Duplicate => Action::Edit(Edit::Duplicate),
            Command::Delete => Action::Edit(Edit::Delete),
            Command::SelectAll => Action::Select(Select::All),
            Command::Cancel if is_dragging => Action::Drag(DragAction::Cancel),
            Command::Cancel => Action::Select(Select::None),
            Command::NextBox => Action::Select(Select::Next),
            Command::PreviousBox => Action::Select(Select::Previous),
            Command::Axis(axis) if is_dragging => Action::Drag(DragAction::Constrain(axis)),
            Command::Axis(axis) => Action::Set(Setting::Axis(axis)),
            Command::Mirror => mirror(MirrorPlane::Zero, MirrorResult::Move),
            Command::MirrorCopy => mirror(MirrorPlane::Zero, MirrorResult::Copy),
            Command::MirrorMiddle => mirror(MirrorPlane::Middle, MirrorResult::Move),
            Command::ToggleSnap => {
                let snap = settings.snap;
                Action::Set(Setting::Snap(GridSnap { is_on: !snap.is_on, ..snap }))
            }
            Command::Display(display) => Action::Set(Setting::Display(display)),
            Command::New
            | Command::Open
            | Command::Save
            | Command::SaveAs
            | Command::Quit
            | Command::Add
            | Command::Frame
            | Command::Move
            | Command::Scale
            | Command::Help => return None,
        })
    }
}

impl fmt::Display for Chord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (is_held, name) in [(self.ctrl, "Ctrl+"), (self.alt, "Alt+"), (self.shift, "Shift+")] {
            if is_held {
                f.write_str(name)?;
            }
        }
        match self.key {
            Key::Char(c) => write!(f, "{}", c.to_uppercase()),
            key => write!(f, "{key:?}"),
        }
    }
}

#[cfg(test)]
mod tests;
