//! What the keys do: one table, which a window looks keys up in and lists where it is asked what
//! they do.

use std::fmt;

use super::Axis;
use super::action::{Action, DragAction, Edit, Select, Setting};
use super::mirror::{Outcome, Plane};
use super::snap::Snap;
use super::state::{Editor, View};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Key {
    /// What the key writes, a letter as a small one.
    Char(char),
    Delete,
    Backspace,
    Escape,
    Tab,
}

/// A key, and those that are held with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Chord {
    pub key: Key,
    /// Command on a Mac.
    pub ctrl: bool,
    pub shift: bool,
    pub alt: bool,
}

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
    Delete,
    SelectAll,
    /// A drag, or else what is selected.
    Cancel,
    NextBox,
    PreviousBox,
    /// The camera goes where the selection fills the picture.
    Frame,
    /// A drag begins without a button: the next press ends it.
    Move,
    Scale,
    /// What a drag goes along; without one, what mirroring goes by.
    Axis(Axis),
    Mirror,
    MirrorCopy,
    MirrorMiddle,
    ToggleSnap,
    View(View),
    Help,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shortcut {
    pub chord: Chord,
    pub command: Command,
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

/// In the order of a list for reading; of two chords for one command the first is the one to show
/// beside it.
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
    shortcut(Key::Char('1'), Command::View(View::Boxes), "show the boxes"),
    shortcut(Key::Char('2'), Command::View(View::Cloud), "show the cloud"),
    shortcut(Key::Char('3'), Command::View(View::Both), "show both"),
    shortcut(Key::Char('?'), Command::Help, "list the keys"),
];

/// What a chord means.
pub fn command(chord: Chord) -> Option<Command> {
    let chord = chord.normal();
    SHORTCUTS.iter().find(|shortcut| shortcut.chord == chord).map(|shortcut| shortcut.command)
}

impl Chord {
    /// Letters small, and shift only where it does not decide what is written: "?" takes one on
    /// some keyboards.
    fn normal(self) -> Chord {
        match self.key {
            Key::Char(c) if c.is_alphabetic() => {
                let small = c.to_lowercase().next().unwrap_or(c);
                Chord { key: Key::Char(small), ..self }
            }
            Key::Char(_) => Chord { shift: false, ..self },
            _ => self,
        }
    }
}

impl Command {
    /// What it does to the editor; none of those that take a file, a camera or a pointer, which are
    /// for the window and the session.
    pub fn action(self, editor: &Editor) -> Option<Action> {
        let is_dragging = editor.dragged_handle().is_some();
        let settings = editor.settings();
        let mirror =
            |plane, outcome| Action::Edit(Edit::Mirror { axis: settings.axis, plane, outcome });
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
            Command::Mirror => mirror(Plane::Zero, Outcome::Move),
            Command::MirrorCopy => mirror(Plane::Zero, Outcome::Copy),
            Command::MirrorMiddle => mirror(Plane::Middle, Outcome::Move),
            Command::ToggleSnap => {
                Action::Set(Setting::Snap(Snap { on: !settings.snap.on, ..settings.snap }))
            }
            Command::View(view) => Action::Set(Setting::View(view)),
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
            Key::Delete => f.write_str("Delete"),
            Key::Backspace => f.write_str("Backspace"),
            Key::Escape => f.write_str("Escape"),
            Key::Tab => f.write_str("Tab"),
        }
    }
}

#[cfg(test)]
mod tests;
