//! Documents and states for tests.

use glam::DVec3;

use super::action::{Action, Edit, Select};
use super::document::Document;
use super::selection::SelectionMode;
use super::state::Editor;
use crate::model::boxes::CloudBox;

pub fn unit_box() -> CloudBox {
    CloudBox { n_particles: 10, extent: DVec3::ONE, center: DVec3::ZERO, radius_max: 2.0 }
}

/// Returns boxes of 10, 11, 12 … particles at x = 0, 4, 8 …
pub fn document(n: u32) -> Document {
    let of = |i: u32| CloudBox {
        n_particles: 10 + i,
        center: DVec3::X * 4.0 * f64::from(i),
        ..unit_box()
    };
    Document::new((0..n).map(of).collect())
}

pub fn editor(n: u32) -> Editor {
    Editor::new(document(n).boxes)
}

/// Returns the state after actions, none of which may be refused.
pub fn after(editor: &Editor, actions: &[Action]) -> Editor {
    actions.iter().fold(editor.clone(), |editor, action| match editor.after(action) {
        Ok(next) => next,
        Err(refusal) => panic!("{action:?}: {refusal}"),
    })
}

pub fn edited(editor: &Editor, edit: Edit) -> Editor {
    after(editor, &[Action::Edit(edit)])
}

pub fn selected(editor: &Editor, boxes: &[usize]) -> Editor {
    after(
        editor,
        &[Action::Select(Select::Boxes { boxes: boxes.to_vec(), mode: SelectionMode::Replace })],
    )
}
