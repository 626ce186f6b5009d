//! Commands of the scene window, and the keys that invoke them.

use glam::DVec3;

use super::knobs::Knob;
use super::playback::Seek;
use crate::io::image::ImageKind;
use crate::viewer::shortcut::Shortcut;

/// How the picture of A is compared with that of B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Comparison {
    /// A fills this part of the width from the left, B the rest.
    Split(f64),
    /// The absolute difference times this gain.
    Difference(f64),
    /// B alone.
    OnlyB,
}

impl Comparison {
    /// Two halves.
    pub const HALVES: Comparison = Comparison::Split(0.5);
    /// The difference with a gain that shows a tenth of white as nearly white.
    pub const DIFFERENCE: Comparison = Comparison::Difference(8.0);
}

/// A command of the user.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Sets a knob to its next value.
    Advance(Knob),
    /// Turns skipping of unneeded passes on or off.
    ToggleSkipping,
    /// Selects the next present mode of the window.
    NextPresentMode,
    /// Changes the playback position.
    Seek(Seek),
    /// Multiplies the flying speed by 2 to this power.
    Speed(f64),
    /// Saves the picture.
    Capture(ImageKind),
    /// Shows or hides the panels.
    TogglePanels,
    /// Counts non-finite and clipped values of the next frame.
    Count,
    /// Keeps the present settings as B, or drops B.
    ToggleB,
    /// Selects the next comparison of A with B.
    NextComparison,
    /// Compares A with B in this way.
    Compare(Comparison),
    /// Turns the error measurement on or off.
    ToggleError,
    /// Writes a scene file that draws this view.
    SaveScene,
    /// Copies and prints the command that draws this view.
    PrintCommandLine,
    /// Shows or hides the list of keys.
    Help,
    /// Closes the window.
    Quit,
}

/// Every key of the window except the flying keys.
pub const SHORTCUTS: [Shortcut<Command>; 28] = [
    Shortcut::new(
        "t",
        Command::Advance(Knob::Threading),
        "run game and render step in sequence (serial) or side by side (parallel)",
    ),
    Shortcut::new(
        "c",
        Command::Advance(Knob::Simulate),
        "move particles on the device or the game thread",
    ),
    Shortcut::new(
        "l",
        Command::Advance(Knob::Lighting),
        "lighting: none, first or two reflections",
    ),
    Shortcut::new("b", Command::Advance(Knob::Bases), "number of basis vectors"),
    Shortcut::new(
        "g",
        Command::Advance(Knob::Gather),
        "gather the second reflection by pairs or clusters",
    ),
    Shortcut::new("o", Command::Advance(Knob::Theta), "opening angle of the clusters"),
    Shortcut::new(
        "p",
        Command::Advance(Knob::Path),
        "draw particles by compute tiles or by sprites",
    ),
    Shortcut::new("r", Command::Advance(Knob::Resolution), "resolution of the particles' picture"),
    Shortcut::new(
        "k",
        Command::ToggleSkipping,
        "skip passes that a frame does not need, or run all",
    ),
    Shortcut::new("v", Command::NextPresentMode, "present mode: fifo, mailbox or immediate"),
    Shortcut::new("space", Command::Seek(Seek::TogglePause), "play or pause"),
    Shortcut::new(".", Command::Seek(Seek::By(1)), "next frame"),
    Shortcut::new(",", Command::Seek(Seek::By(-1)), "previous frame"),
    Shortcut::new("home", Command::Seek(Seek::To(0)), "first frame"),
    Shortcut::new("+", Command::Speed(1.0), "fly twice as fast"),
    Shortcut::new("-", Command::Speed(-1.0), "fly half as fast"),
    Shortcut::new("f12", Command::Capture(ImageKind::Png), "save the picture as PNG"),
    Shortcut::new("f11", Command::Capture(ImageKind::Exr), "save the picture as EXR"),
    Shortcut::new("h", Command::TogglePanels, "show or hide the panels"),
    Shortcut::new("n", Command::Count, "count values of a frame that are not finite, or clipped"),
    Shortcut::new(
        "m",
        Command::ToggleB,
        "keep the present settings as B, to compare later ones (A) with them, or drop B",
    ),
    Shortcut::new("x", Command::NextComparison, "show A and B split, their difference, or B alone"),
    Shortcut::new(
        "j",
        Command::ToggleError,
        "measure the error against the f64 reference, while the scene is paused",
    ),
    Shortcut::new("f10", Command::SaveScene, "save the view as a scene file"),
    Shortcut::new(
        "i",
        Command::PrintCommandLine,
        "copy the command that draws this view, and print it on the terminal",
    ),
    Shortcut::new("?", Command::Help, "show or hide this list"),
    Shortcut::new("f1", Command::Help, "show or hide this list, as ?"),
    Shortcut::new("escape", Command::Quit, "close this list, or the window"),
];

/// Keys that move the camera while they are held: direction as (right, up, forward).
pub(super) const FLYING_KEYS: [(&str, DVec3); 6] = [
    ("w", DVec3::Z),
    ("s", DVec3::NEG_Z),
    ("d", DVec3::X),
    ("a", DVec3::NEG_X),
    ("e", DVec3::Y),
    ("q", DVec3::NEG_Y),
];

/// Uses of the mouse, and the keys that fly, for the list of keys.
#[cfg(feature = "window")]
const MOVES: [(&str, &str); 6] = [
    ("w a s d", "fly forward, left, back, right"),
    ("e q", "fly up, down"),
    ("left button", "drag: turn the camera"),
    ("right button", "drag: orbit the target"),
    ("wheel", "approach the target, or recede"),
    ("+ -", "fly twice or half as fast"),
];

/// The line that the window begins with.
#[cfg(feature = "window")]
pub const HINT: &str = "w a s d: fly    drag: turn    h: panels    ?: all keys    escape: close";

/// Returns every key and use of the mouse, in groups.
#[cfg(feature = "window")]
pub fn key_groups() -> Vec<(&'static str, Vec<(&'static str, &'static str)>)> {
    let of = |group: fn(Command) -> bool| {
        let shortcuts = SHORTCUTS.iter().filter(move |s| group(s.command));
        shortcuts.map(|s| (s.key, s.description)).collect::<Vec<_>>()
    };
    use Command::{
        Advance, Capture, Compare, Count, Help, NextComparison, NextPresentMode, PrintCommandLine,
        Quit, SaveScene, Seek, ToggleB, ToggleError, TogglePanels, ToggleSkipping,
    };
    vec![
        ("Move", MOVES.to_vec()),
        ("Window", of(|c| matches!(c, Help | TogglePanels | Quit))),
        ("Play", of(|c| matches!(c, Seek(_)))),
        ("Save", of(|c| matches!(c, Capture(_) | SaveScene | PrintCommandLine))),
        (
            "Compare and measure",
            of(|c| matches!(c, ToggleB | NextComparison | Compare(_) | ToggleError | Count)),
        ),
        ("Settings", of(|c| matches!(c, Advance(_) | ToggleSkipping | NextPresentMode))),
    ]
}
