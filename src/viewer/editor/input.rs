//! Input of the editor's window.

use glam::DVec2;

use super::action::DragModifiers;
use super::axis::Axis;
use super::selection::SelectionMode;
use super::session::SessionEvent;
use super::shortcuts::{Chord, Command};

/// An input event. Pixels are counted as in [`super::Viewport`].
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// The pointer has moved.
    PointerMoved {
        /// Place in the picture.
        pixel: DVec2,
        /// Keys that are held.
        keys: ModifierKeys,
    },
    /// The pointer has left the window. A drag stays in progress.
    PointerLeft,
    /// A press or release of a mouse button. Releases count wherever the pointer is.
    Button {
        /// The button.
        button: Button,
        /// Whether it was pressed.
        is_down: bool,
        /// Keys that are held.
        keys: ModifierKeys,
    },
    /// Notches of the wheel, away from the user.
    Wheel(f64),
    /// A key was pressed.
    Chord(Chord),
    /// A button of a panel was clicked.
    Command(Command),
    /// The picture has another size.
    Resized {
        /// Width and height in pixels.
        size_px: DVec2,
        /// Pixels per logical point.
        px_per_point: f64,
    },
    /// The window has lost the keyboard.
    FocusLost,
    /// Text that was entered into a field of a panel.
    Typed {
        /// The field.
        field: Field,
        /// The entered text.
        text: String,
    },
    /// A click in a panel, or the answer to a request.
    Event(SessionEvent),
}

/// A button of the mouse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Button {
    /// Selects and drags.
    Left,
    /// Moves the camera.
    Middle,
    /// Moves the camera.
    Right,
}

/// Modifier keys that are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ModifierKeys {
    /// Ctrl, or Command on a Mac.
    pub ctrl: bool,
    /// Shift.
    pub shift: bool,
}

impl ModifierKeys {
    /// Returns the effect of a click or rectangle on the selection.
    pub fn selection_mode(self) -> SelectionMode {
        match (self.ctrl, self.shift) {
            (false, false) => SelectionMode::Replace,
            (false, true) => SelectionMode::Add,
            (true, false) => SelectionMode::Toggle,
            (true, true) => SelectionMode::Remove,
        }
    }

    /// Returns the settings that the keys invert during a drag.
    pub fn drag_modifiers(self) -> DragModifiers {
        DragModifiers { snap: self.ctrl, anchor: self.shift }
    }
}

/// A number in a panel. A number of a box is that of all selected boxes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Field {
    /// The number of particles.
    Count,
    /// Particles per volume.
    Density,
    /// The extent along an axis.
    Extent(Axis),
    /// A coordinate of the centre.
    Center(Axis),
    /// The largest radius of the particles.
    Radius,
    /// The cloud's seed.
    Seed,
    /// The step of the grid.
    SnapStep,
}

/// Uses of the mouse, for the list of keys.
#[cfg(feature = "window")]
pub const MOUSE_HELP: [(&str, &str); 8] = [
    ("Left", "select a box; again at the same place: the box behind it"),
    ("Shift+Left", "add to the selection"),
    ("Ctrl+Left", "add to or remove from the selection"),
    ("Left on a handle", "move or scale; hold Ctrl for the grid, Shift for the other anchor"),
    ("Left beside boxes", "select with a rectangle"),
    ("Middle, Right", "orbit; right cancels a drag that a key began"),
    ("Shift+Middle", "pan"),
    ("Wheel", "approach or recede"),
];
