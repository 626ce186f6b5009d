//! Edits compared with numbers worked by hand.

use glam::DVec3;

use super::super::action::{Action, Edit, MirrorPlane, MirrorResult, Select, Setting};
use super::super::axis::Axis;
use super::super::document;
use super::super::fixtures::{after, edited, editor, selected, unit_box};
use super::super::grid_snap::GridSnap;
use super::super::selection::SelectionMode;
use super::super::settings::ScalingAnchor;
use super::super::snapshot::Snapshot;
use super::super::state::Editor;
use super::scale;
use crate::model::boxes::CloudBox;

fn refused(editor: &Editor, edit: Edit) -> String {
    editor.after(&Action::Edit(edit)).map(|_| ()).unwrap_err()
}

fn set(editor: &Editor, setting: Setting) -> Editor {
    after(editor, &[Action::Set(setting)])
}

#[test]
fn an_edit_changes_every_selected_box_and_no_other() {
    let e = selected(&editor(4), &[3, 1]);
    let e = edited(&e, Edit::Count(77));
    let e = edited(&e, Edit::Radius(1.25));
    let e = edited(&e, Edit::Center(Axis::Z, -0.600002));
    let e = edited(&e, Edit::Extent(Axis::Y, 1.07048));
    let was = editor(4);
    for i in [1, 3] {
        let b = e.boxes()[i];
        assert_eq!(
            (b.n_particles, b.radius_max, b.center.z, b.extent.y),
            (77, 1.25, -0.600002, 1.07048)
        );
        assert_eq!((b.center.x, b.extent.x), (was.boxes()[i].center.x, 1.0));
    }
    assert_eq!((e.boxes()[0], e.boxes()[2]), (was.boxes()[0], was.boxes()[2]));
    assert_eq!(e.history().n_undo(), 4);
}

#[test]
fn an_extent_grows_about_the_centre_or_from_the_low_face() {
    let e = selected(&editor(2), &[1]);
    let symmetric = edited(&e, Edit::Extent(Axis::X, 3.0)).boxes()[1];
    assert_eq!((symmetric.extent.x, symmetric.center.x), (3.0, 4.0));
    let e = set(&e, Setting::Anchor(ScalingAnchor::OppositeFace));
    let from_face = edited(&e, Edit::Extent(Axis::X, 3.0)).boxes()[1];
    // The low face stays at 3.5.
    assert_eq!((from_face.extent.x, from_face.center.x), (3.0, 5.0));
}

#[test]
fn a_density_sets_the_count() {
    let e = edited(&selected(&editor(1), &[0]), Edit::Extent(Axis::X, 7.39642));
    let e = edited(&e, Edit::Extent(Axis::Y, 1.07048));
    let e = edited(&e, Edit::Density(25.0));
    // 25 · 7.39642 · 1.07048 = 197.94.
    assert_eq!(e.boxes()[0].n_particles, 198);
    assert!((document::density(&e.boxes()[0]).unwrap() - 198.0 / 7.917_719_681_6).abs() < 1e-9);
    assert_eq!(
        refused(&e, Edit::Density(1e300)),
        "box 0: density times volume: expected 0 to 4294967295, found ".to_owned()
            + &format!("{}", (1e300 * document::volume(&e.boxes()[0])).round())
    );
    for wrong in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(
            refused(&e, Edit::Density(wrong))
                .starts_with("box 0: density times volume: expected 0 to")
        );
    }
    let flat = edited(&e, Edit::Extent(Axis::Z, 0.0));
    assert_eq!(
        refused(&flat, Edit::Density(1.0)),
        "box 0 has no volume, so that no density gives it particles"
    );
}

#[test]
fn copies_are_appended_and_selected_in_the_order_of_their_originals() {
    let e = edited(&selected(&editor(4), &[2, 0]), Edit::Duplicate);
    assert_eq!(e.boxes()[4..], [e.boxes()[0], e.boxes()[2]]);
    assert_eq!(e.selection().boxes(), [5, 4]);
    let e = edited(&e, Edit::Delete);
    assert!(e.document().is_same(editor(4).document()) && e.selection().is_empty());
    // The remaining boxes keep their order.
    let e = edited(&selected(&e, &[2, 0]), Edit::Delete);
    assert_eq!(e.boxes(), [editor(4).boxes()[1], editor(4).boxes()[3]]);
    assert_eq!(edited(&e, Edit::Delete).history().n_undo(), e.history().n_undo());
}

#[test]
fn boxes_move_and_scale_about_their_middle() {
    let e = selected(&editor(3), &[0, 2]);
    let moved = edited(&e, Edit::MoveBy(DVec3::new(0.0, -1.5, 0.0)));
    assert_eq!(moved.boxes().iter().map(|b| b.center.y).collect::<Vec<_>>(), [-1.5, 0.0, -1.5]);
    // The bounds are −0.5 to 8.5 along x.
    let (document, selection) = (e.shared_document(), e.selection().clone());
    let mut scaled = Snapshot { document, selection };
    scale(&mut scaled, DVec3::new(0.5, 1.0, 3.0));
    let scaled = scaled.document;
    assert_eq!(scaled.boxes.iter().map(|b| b.center.x).collect::<Vec<_>>(), [2.0, 4.0, 6.0]);
    assert_eq!(scaled.boxes[2].extent, DVec3::new(0.5, 1.0, 3.0));
    assert_eq!((scaled.boxes[2].n_particles, scaled.boxes[2].radius_max), (12, 2.0));
}

#[test]
fn mirroring_twice_restores_the_boxes() {
    let start = edited(&selected(&editor(3), &[1, 2]), Edit::MoveBy(DVec3::new(0.1, 0.7, 0.0)));
    for axis in Axis::ALL {
        let zero = Edit::Mirror { axis, plane: MirrorPlane::Zero, result: MirrorResult::Move };
        let once = edited(&start, zero.clone());
        assert_eq!(once.boxes()[1].center[axis.index()], -start.boxes()[1].center[axis.index()]);
        assert!(edited(&once, zero).document().is_same(start.document()));
    }
    // The boxes at 4.1 and 8.1 have equal extents, so they change places.
    let middle =
        Edit::Mirror { axis: Axis::X, plane: MirrorPlane::Middle, result: MirrorResult::Move };
    let once = edited(&start, middle.clone());
    let x = |i: usize| once.boxes()[i].center.x;
    // Rounding of sums below 16.
    assert!((x(1) - 8.1).abs() < 1e-14 && (x(2) - 4.1).abs() < 1e-14);
    // One box is its own mirror image, so this is no step.
    let one = selected(&start, &[2]);
    assert_eq!(edited(&one, middle).history().n_undo(), start.history().n_undo());
}

#[test]
fn mirrored_copies_are_appended_unless_they_equal_their_originals() {
    let e = after(&editor(3), &[Action::Select(Select::All)]);
    let e = edited(
        &e,
        Edit::Mirror { axis: Axis::X, plane: MirrorPlane::Zero, result: MirrorResult::Copy },
    );
    assert_eq!(
        e.boxes().iter().map(|b| b.center.x).collect::<Vec<_>>(),
        [0.0, 4.0, 8.0, -4.0, -8.0]
    );
    assert_eq!(e.selection().boxes(), [3, 4]);
    let on_plane = selected(&e, &[0]);
    let copied = edited(
        &on_plane,
        Edit::Mirror { axis: Axis::X, plane: MirrorPlane::Zero, result: MirrorResult::Copy },
    );
    assert_eq!((copied.boxes().len(), copied.history().n_undo()), (5, 1));
}

#[test]
fn values_that_a_box_file_cannot_hold_are_refused_in_one_sentence() {
    let e = selected(&editor(3), &[0, 2]);
    for (edit, message) in [
        (
            Edit::Center(Axis::X, f64::NAN),
            "box 0: x: expected a number from -1e15 to 1e15, found NaN",
        ),
        (
            Edit::MoveBy(DVec3::Y * 1e300),
            "box 0: y: expected a number from -1e15 to 1e15, found 1e300",
        ),
        (Edit::Radius(-2.0), "box 0: radius: expected a number from 0 to 1e15, found -2"),
        (
            Edit::Extent(Axis::Z, 1e-31),
            "box 0: z extent: expected 0 or a number from 1e-30 to 1e15, found 1e-31",
        ),
        (
            Edit::Add(CloudBox { extent: DVec3::splat(f64::INFINITY), ..unit_box() }),
            "box 3: x extent: expected 0 or a number from 1e-30 to 1e15, found inf",
        ),
    ] {
        assert_eq!(refused(&e, edit), message);
    }
    let wrong = Action::Select(Select::Boxes { boxes: vec![1, 3], mode: SelectionMode::Add });
    assert_eq!(
        e.after(&wrong).map(|_| ()),
        Err("box: expected a number below 3, found 3".to_owned())
    );
    assert!(e.after(&Action::Set(Setting::Snap(GridSnap { is_on: true, step: 0.0 }))).is_err());
    // Copies would exceed the largest number of boxes.
    let full =
        after(&Editor::new(vec![unit_box(); document::MAX_BOXES]), &[Action::Select(Select::All)]);
    assert_eq!(refused(&full, Edit::Duplicate), "expected at most 262144 boxes, found 524288");
}
