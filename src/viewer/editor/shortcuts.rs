//! Keyboard shortcuts of the editor, with their commands and descriptions.

use std::fmt;

use super::action::{Action, DragAction, Edit, MirrorPlane, MirrorResult, Select, Setting};
use super::axis::Axis;
use super::grid_snap::GridSnap;
use super::settings::DisplayMode;
use super::state::Editor;
use crate::viewer::shortcut::Shortcut;

/// A key of the keyboard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Key {
    /// The character that the key types.
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
    /// Begins a new cloud.
    New,
    /// Opens a box file.
    Open,
    /// Saves to the file.
    Save,
    /// Saves under another name.
    SaveAs,
    /// Closes the window.
    Quit,
    /// Takes the last step back.
    Undo,
    /// Repeats the step that was taken back last.
    Redo,
    /// Adds a box.
    Add,
    /// Duplicates the selection.
    Duplicate,
    /// Deletes the selection.
    Delete,
    /// Selects all boxes.
    SelectAll,
    /// Cancels a drag, or clears the selection.
    Cancel,
    /// Selects the next box.
    NextBox,
    /// Selects the box before.
    PreviousBox,
    /// Moves the camera so that the selection fills the picture.
    Frame,
    /// Begins to move without a button; the next press ends the drag.
    Move,
    /// Begins to scale without a button.
    Scale,
    /// Restricts a drag to an axis; without a drag, sets the axis of mirroring.
    Axis(Axis),
    /// Mirrors the selection across 0.
    Mirror,
    /// Mirrors a copy of the selection across 0.
    MirrorCopy,
    /// Mirrors the selection across its middle.
    MirrorMiddle,
    /// Switches snapping to the grid on or off.
    ToggleSnap,
    /// Sets what is drawn.
    Display(DisplayMode),
    /// Shows or hides the panels.
    TogglePanels,
    /// Lists the keys.
    Help,
}

/// Every shortcut, in the order of the list of keys. Panels show the first chord of a command.
pub const SHORTCUTS: [Shortcut<Command>; 31] = [
    Shortcut::new("Ctrl+N", Command::New, "new cloud"),
    Shortcut::new("Ctrl+O", Command::Open, "open a box file"),
    Shortcut::new("Ctrl+S", Command::Save, "save"),
    Shortcut::new("Ctrl+Shift+S", Command::SaveAs, "save under another name"),
    Shortcut::new("Ctrl+Q", Command::Quit, "quit"),
    Shortcut::new("Ctrl+Z", Command::Undo, "undo"),
    Shortcut::new("Ctrl+Shift+Z", Command::Redo, "redo"),
    Shortcut::new("Ctrl+Y", Command::Redo, "redo"),
    Shortcut::new("A", Command::Add, "add a box where the view looks"),
    Shortcut::new("Ctrl+D", Command::Duplicate, "duplicate the selection"),
    Shortcut::new("Delete", Command::Delete, "delete the selection"),
    Shortcut::new("Backspace", Command::Delete, "delete the selection"),
    Shortcut::new("Ctrl+A", Command::SelectAll, "select all boxes"),
    Shortcut::new("Escape", Command::Cancel, "cancel the drag, or select nothing"),
    Shortcut::new("Tab", Command::NextBox, "select the next box"),
    Shortcut::new("Shift+Tab", Command::PreviousBox, "select the box before"),
    Shortcut::new("F", Command::Frame, "look at the selection, or at everything"),
    Shortcut::new("G", Command::Move, "move the selection"),
    Shortcut::new("S", Command::Scale, "scale the selection"),
    Shortcut::new("X", Command::Axis(Axis::X), "along x only; the axis to mirror by"),
    Shortcut::new("Y", Command::Axis(Axis::Y), "along y only; the axis to mirror by"),
    Shortcut::new("Z", Command::Axis(Axis::Z), "along z only; the axis to mirror by"),
    Shortcut::new("M", Command::Mirror, "mirror the selection across 0"),
    Shortcut::new("Shift+M", Command::MirrorCopy, "mirror a copy of the selection across 0"),
    Shortcut::new("Alt+M", Command::MirrorMiddle, "mirror the selection across its middle"),
    Shortcut::new("Shift+S", Command::ToggleSnap, "snap to the grid, or do not"),
    Shortcut::new("1", Command::Display(DisplayMode::Boxes), "show the boxes"),
    Shortcut::new("2", Command::Display(DisplayMode::Cloud), "show the cloud"),
    Shortcut::new("3", Command::Display(DisplayMode::Both), "show both"),
    Shortcut::new("H", Command::TogglePanels, "show or hide the panels"),
    Shortcut::new("?", Command::Help, "show or hide this list"),
];

/// Returns the command of a chord.
pub fn command(chord: Chord) -> Option<Command> {
    // "?" needs shift only on some keyboards.
    let is_sign = matches!(chord.key, Key::Char(c) if !c.is_alphabetic());
    let chord = Chord { shift: chord.shift && !is_sign, ..chord };
    Shortcut::command_of(&SHORTCUTS, &chord.to_string())
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
            | Command::TogglePanels
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
