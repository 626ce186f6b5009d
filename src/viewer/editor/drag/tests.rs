//! Drags by rays along −z, so that the pointer's place is that in the scene.

use glam::DVec3;

use super::super::action::{Action, DragAction, Edit, Select, Setting};
use super::super::fixtures::{after, editor, selected};
use super::super::handles::Side;
use super::super::state::Editor;
use super::*;
use crate::model::boxes::CloudBox;

fn ray(x: f64, y: f64) -> Ray {
    Ray { origin: DVec3::new(x, y, 10.0), direction: -DVec3::Z }
}

fn begin(handle: Handle, x: f64, y: f64) -> Action {
    Action::Drag(DragAction::Begin { handle, ray: ray(x, y), forward: -DVec3::Z })
}

fn to(x: f64, y: f64) -> Action {
    held(x, y, DragModifiers::default())
}

fn held(x: f64, y: f64, modifiers: DragModifiers) -> Action {
    Action::Drag(DragAction::To { ray: ray(x, y), modifiers })
}

const END: Action = Action::Drag(DragAction::End);
const CANCEL: Action = Action::Drag(DragAction::Cancel);
const SNAP: GridSnap = GridSnap { is_on: true, step: 0.5 };
const HIGH_X: Handle = Handle::ScaleFace(Axis::X, Side::High);

fn snapping(editor: &Editor) -> Editor {
    after(editor, &[Action::Set(Setting::Snap(SNAP))])
}

fn x_of(editor: &Editor) -> Vec<f64> {
    editor.boxes().iter().map(|b| b.center.x).collect()
}

#[test]
fn a_drag_of_many_moves_is_one_step() {
    let start = selected(&editor(3), &[0, 1]);
    let mut actions = vec![begin(Handle::MoveAxis(Axis::X), 0.3, 0.2)];
    actions.extend((1..200).map(|i| to(0.3 + 0.01 * f64::from(i), 5.0)));
    actions.extend([to(1.3, 0.0), END]);
    let e = after(&start, &actions);
    assert_eq!(
        (x_of(&e), e.history().n_undo(), e.history().undo_label()),
        (vec![1.0, 5.0, 8.0], 1, Some("move"))
    );
    // The path leaves no trace.
    assert!(after(&e, &[Action::Undo]).document().is_same(start.document()));
    assert!(e.boxes().iter().all(|b| b.center.y == 0.0));
}

#[test]
fn a_cancelled_drag_and_one_that_returns_are_no_step() {
    let start = after(&selected(&editor(3), &[1]), &[Action::Edit(Edit::Count(3)), Action::Undo]);
    for ways in [vec![to(2.0, 1.0), CANCEL], vec![to(2.0, 1.0), to(0.0, 0.0), END], vec![END]] {
        let e = after(&start, &[vec![begin(Handle::MoveView, 0.0, 0.0)], ways].concat());
        assert!(e.document().is_same(start.document()) && e.dragged_handle().is_none());
        assert_eq!((e.history().n_undo(), e.history().n_redo()), (0, 1));
    }
}

#[test]
fn a_drag_snaps_the_active_box_to_the_grid() {
    let mut boxes = editor(2).boxes().to_vec();
    boxes[0].center = DVec3::new(0.25, 0.1, -0.600_002);
    let start = snapping(&selected(&Editor::new(boxes), &[0, 1]));
    // The active box moves from (4, 0) by (0.6, 0.9) to (4.5, 1). The other keeps its relative
    // place, and z stays.
    let e = after(&start, &[begin(Handle::MoveView, 1.0, 1.0), to(1.6, 1.9), END]);
    assert_eq!(e.boxes()[1].center, DVec3::new(4.5, 1.0, 0.0));
    assert_eq!(e.boxes()[0].center, DVec3::new(0.75, 1.1, -0.600_002));
    // A held key inverts the setting.
    let free = DragModifiers { snap: true, anchor: false };
    let e = after(&start, &[begin(Handle::MoveView, 1.0, 1.0), held(1.25, 1.0, free), END]);
    assert_eq!(e.boxes()[1].center, DVec3::new(4.25, 0.0, 0.0));
}

#[test]
fn a_drag_can_be_restricted_to_an_axis() {
    let constrain = |axis| Action::Drag(DragAction::Constrain(axis));
    let grabbed =
        after(&selected(&editor(1), &[0]), &[begin(Handle::MoveView, 0.0, 0.0), to(2.0, 3.0)]);
    assert_eq!(grabbed.boxes()[0].center, DVec3::new(2.0, 3.0, 0.0));
    let along = after(&grabbed, &[constrain(Axis::Y)]);
    assert_eq!(
        (along.boxes()[0].center, along.dragged_handle()),
        (DVec3::Y * 3.0, Some(Handle::MoveAxis(Axis::Y)))
    );
    let other = after(&along, &[constrain(Axis::X)]);
    assert_eq!(other.boxes()[0].center, DVec3::X * 2.0);
    let free = after(&other, &[constrain(Axis::X)]);
    assert_eq!(free.boxes()[0].center, DVec3::new(2.0, 3.0, 0.0));
    // The rays are parallel to z, so the box stays.
    let along_z = after(&free, &[constrain(Axis::Z), to(5.0, 5.0)]);
    assert_eq!(along_z.boxes()[0].center, DVec3::new(2.0, 3.0, 0.0));
}

#[test]
fn faces_scale_about_the_centre_or_from_the_other_face() {
    let start = selected(&editor(2), &[1, 0]);
    // The face of box 0 at 0.5 is dragged outward by 0.25.
    let e = after(&start, &[begin(HIGH_X, 0.5, 0.0), to(0.75, 0.0), END]);
    assert_eq!(e.boxes()[0].extent, DVec3::new(1.5, 1.0, 1.0));
    assert_eq!((x_of(&e), e.boxes()[1].extent.x), (vec![0.0, 4.0], 1.5));
    let opposite = DragModifiers { snap: false, anchor: true };
    let e = after(&start, &[begin(HIGH_X, 0.5, 0.0), held(0.75, 0.0, opposite), END]);
    assert_eq!((e.boxes()[0].extent.x, x_of(&e)), (1.25, vec![0.125, 4.125]));
    let low = Handle::ScaleFace(Axis::X, Side::Low);
    let e = after(&start, &[begin(low, -0.5, 0.0), held(-1.5, 0.0, opposite), END]);
    assert_eq!((e.boxes()[0].extent.x, x_of(&e)), (2.0, vec![-0.5, 3.5]));
}

#[test]
fn a_face_stops_at_the_opposite_one_or_one_grid_step_before() {
    let start = selected(&editor(1), &[0]);
    let e = after(&start, &[begin(HIGH_X, 0.5, 0.0), to(-9.0, 0.0), END]);
    assert_eq!((e.boxes()[0].extent.x, e.boxes()[0].center.x), (0.0, 0.0));
    let e = after(&snapping(&start), &[begin(HIGH_X, 0.5, 0.0), to(-9.0, 0.0), END]);
    assert_eq!((e.boxes()[0].extent.x, e.history().undo_label()), (0.5, Some("scale")));
    let opposite = DragModifiers { snap: false, anchor: true };
    let e = after(&snapping(&start), &[begin(HIGH_X, 0.5, 0.0), held(1.3, 0.0, opposite), END]);
    // 1.8 snaps to 2, and the low face stays at −0.5.
    assert_eq!((e.boxes()[0].extent.x, e.boxes()[0].center.x), (2.0, 0.5));
}

#[test]
fn a_selection_scales_by_the_distance_from_its_middle() {
    let start = selected(&editor(3), &[0, 1]);
    // The bounds are −0.5 to 4.5, so the middle is 2.
    let e = after(&start, &[begin(Handle::ScaleAll, 3.0, 0.0), to(2.0, 1.5), END]);
    assert_eq!((x_of(&e), e.boxes()[1].extent), (vec![-1.0, 5.0, 8.0], DVec3::splat(1.5)));
    let one_axis = [
        begin(Handle::ScaleAll, 3.0, 0.0),
        Action::Drag(DragAction::Constrain(Axis::X)),
        to(4.04, 0.0),
        END,
    ];
    let e = after(&snapping(&start), &one_axis);
    // The factor 2.04 snaps to tenths.
    assert_eq!((x_of(&e), e.boxes()[1].extent), (vec![-2.0, 6.0, 8.0], DVec3::new(2.0, 1.0, 1.0)));
    // A start in the middle has no distance to compare with.
    let e = after(&start, &[begin(Handle::ScaleAll, 2.0, 0.0), to(9.0, 0.0), END]);
    assert_eq!(e.history().n_undo(), 0);
}

#[test]
fn a_drag_refuses_other_actions_and_moves_after_it_do_nothing() {
    let grabbed =
        after(&selected(&editor(2), &[0]), &[begin(Handle::MoveView, 0.0, 0.0), to(1.0, 0.0)]);
    for action in [
        Action::Undo,
        Action::Edit(Edit::Delete),
        Action::Select(Select::All),
        begin(HIGH_X, 0.0, 0.0),
    ] {
        assert!(grabbed.after(&action).is_err(), "{action:?}");
    }
    let cancelled = after(&grabbed, &[CANCEL, to(7.0, 7.0), END]);
    assert!(cancelled.document().is_same(editor(2).document()));
    let nothing = editor(2).after(&begin(HIGH_X, 0.0, 0.0)).map(|_| ());
    assert_eq!(nothing, Err("nothing is selected".to_owned()));
}

#[test]
fn a_drag_beyond_the_limits_keeps_its_last_place() {
    let far = CloudBox { center: DVec3::X * 9e14, ..editor(1).boxes()[0] };
    let e = after(
        &selected(&Editor::new(vec![far]), &[0]),
        &[begin(Handle::MoveAxis(Axis::X), 9e14, 0.0), to(9.5e14, 0.0)],
    );
    let refusal = e.after(&to(2e15, 0.0)).map(|_| ()).unwrap_err();
    assert_eq!(refusal, "box 0: x: expected a number from -1e15 to 1e15, found 2e15");
    let e = after(&e, &[END]);
    assert_eq!((e.boxes()[0].center.x, e.history().n_undo()), (9.5e14, 1));
}
