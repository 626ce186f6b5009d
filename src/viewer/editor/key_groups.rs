//! The list of keys, in groups.

use super::input::MOUSE_HELP;
use super::shortcuts::{Command, Command as C, SHORTCUTS};

/// Returns every key and use of the mouse, in groups.
pub fn key_groups() -> Vec<(&'static str, Vec<(&'static str, &'static str)>)> {
    let of = |group: fn(Command) -> bool| {
        let shortcuts = SHORTCUTS.iter().filter(move |s| group(s.command));
        shortcuts.map(|s| (s.key, s.description)).collect::<Vec<_>>()
    };
    let is_of_files = |c: Command| matches!(c, C::New | C::Open | C::Save | C::SaveAs | C::Quit);
    let is_of_selection =
        |c: Command| matches!(c, C::SelectAll | C::Cancel | C::NextBox | C::PreviousBox);
    let is_of_view = |c: Command| matches!(c, C::Frame | C::Display(_) | C::TogglePanels | C::Help);
    let boxes = of(|c| {
        let adds = matches!(c, C::Add | C::Duplicate | C::Delete | C::Undo | C::Redo);
        let changes = matches!(c, C::Move | C::Scale | C::Axis(_) | C::ToggleSnap);
        adds || changes || matches!(c, C::Mirror | C::MirrorCopy | C::MirrorMiddle)
    });
    vec![
        ("View", of(is_of_view)),
        ("Boxes", [boxes, vec![("Enter", "enter the active box's numbers")]].concat()),
        ("Selection", of(is_of_selection)),
        ("Mouse", MOUSE_HELP.to_vec()),
        ("File", of(is_of_files)),
    ]
}
