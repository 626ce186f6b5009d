//! Commands of the scene window, and the keys that invoke them.

use glam::DVec3;

use super::knobs::Knob;
use super::playback::Seek;
use crate::io::image::ImageKind;

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

/// A command of the user.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Sets a knob to its next value.
    Advance(Knob),
    /// Turns skipping of unneeded passes on or off.
    ToggleSkipping,
    /// Selects the next present mode of the window.
    NextPresentMode,
    Seek(Seek),
    /// Multiplies the flying speed by 2 to this power.
    Speed(f64),
    /// Saves the picture.
    Capture(ImageKind),
    TogglePanels,
    /// Counts non-finite and clipped values of the next frame.
    Count,
    /// Keeps the present settings as B, or drops B.
    ToggleB,
    /// Selects the next comparison of A with B.
    NextComparison,
    Compare(Comparison),
    /// Turns the error measurement on or off.
    ToggleError,
    /// Writes a scene file that draws this view.
    SaveScene,
    /// Prints the command that draws this view.
    PrintCommandLine,
    Help,
    Quit,
}

/// A key with its command. Letters and signs are their own names.
pub struct Shortcut {
    pub key: &'static str,
    pub command: Command,
    pub description: &'static str,
}

const fn key(key: &'static str, command: Command, description: &'static str) -> Shortcut {
    Shortcut { key, command, description }
}

/// Every key of the window except the flying keys.
pub const SHORTCUTS: [Shortcut; 27] = [
    key(
        "t",
        Command::Advance(Knob::Threading),
        "run game and render step in sequence (serial) or side by side (parallel)",
    ),
    key("c", Command::Advance(Knob::Simulate), "move particles on the device or the game thread"),
    key("l", Command::Advance(Knob::Lighting), "lighting: none, first or two reflections"),
    key("b", Command::Advance(Knob::Bases), "number of basis vectors"),
    key("g", Command::Advance(Knob::Gather), "gather the second reflection by pairs or clusters"),
    key("o", Command::Advance(Knob::Theta), "opening angle of the clusters"),
    key("p", Command::Advance(Knob::Path), "draw particles by compute tiles or by sprites"),
    key("r", Command::Advance(Knob::Resolution), "resolution of the particles' picture"),
    key("k", Command::ToggleSkipping, "skip passes that a frame does not need, or run all"),
    key("v", Command::NextPresentMode, "present mode: fifo, mailbox or immediate"),
    key("space", Command::Seek(Seek::TogglePause), "play or pause"),
    key(".", Command::Seek(Seek::By(1)), "next frame"),
    key(",", Command::Seek(Seek::By(-1)), "previous frame"),
    key("home", Command::Seek(Seek::To(0)), "first frame"),
    key("+", Command::Speed(1.0), "fly twice as fast"),
    key("-", Command::Speed(-1.0), "fly half as fast"),
    key("f12", Command::Capture(ImageKind::Png), "save the picture as PNG"),
    key("f11", Command::Capture(ImageKind::Exr), "save the picture as EXR"),
    key("h", Command::TogglePanels, "show or hide the panels"),
    key("n", Command::Count, "count non-finite and clipped values of a frame"),
    key("m", Command::ToggleB, "keep the settings as B for a comparison, or drop B"),
    key("x", Command::NextComparison, "show A and B split, their difference, or B alone"),
    key("j", Command::ToggleError, "measure the error against the f64 reference, when paused"),
    key("f10", Command::SaveScene, "save the view as a scene file"),
    key("i", Command::PrintCommandLine, "print and copy the command that draws this view"),
    key("?", Command::Help, "print the keys"),
    key("escape", Command::Quit, "close the window"),
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

/// Returns the list of keys that `?` prints.
pub fn help() -> String {
    let keys: String =
        SHORTCUTS.iter().map(|s| format!("  {:<7} {}\n", s.key, s.description)).collect();
    format!(
        "keys:\n{keys}  w a s d q e  fly\nmouse: the left button turns the camera, the right \
         button orbits the target, the wheel approaches it\n"
    )
}
