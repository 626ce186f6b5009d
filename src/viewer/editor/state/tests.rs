//! History, selection and settings.

use glam::DVec3;

use super::super::axis::Axis;
use super::super::fixtures::{after, edited, editor, selected, unit_box};
use super::super::grid_snap::GridSnap;
use super::super::selection::SelectionMode;
use super::super::settings::{DisplayMode, ScalingAnchor};
use super::*;
use crate::io::box_file;

#[test]
fn undo_and_redo_restore_boxes_and_selection() {
    let start = selected(&editor(3), &[1]);
    let duplicated = edited(&start, Edit::Duplicate);
    let moved = edited(&duplicated, Edit::MoveBy(DVec3::Y));
    assert_eq!(moved.history().undo_label(), Some("move"));
    let undone = after(&moved, &[Action::Undo, Action::Undo]);
    assert!(undone.document().is_same(start.document()));
    assert_eq!(
        (undone.selection(), undone.history().redo_label()),
        (start.selection(), Some("duplicate"))
    );
    let redone = after(&undone, &[Action::Redo, Action::Redo]);
    assert!(redone.document().is_same(moved.document()) && redone.selection() == moved.selection());
    // At the end of the history nothing changes.
    assert!(after(&redone, &[Action::Redo]).document().is_same(moved.document()));
    assert!(after(&undone, &[Action::Undo]).document().is_same(start.document()));
}

#[test]
fn a_new_step_drops_undone_steps_and_an_edit_without_effect_does_not() {
    let e = edited(&selected(&editor(2), &[0]), Edit::Count(5));
    let undone = after(&e, &[Action::Undo]);
    let nothing = edited(&undone, Edit::Count(10));
    assert_eq!((nothing.history().n_undo(), nothing.history().n_redo()), (0, 1));
    let selection = after(
        &undone,
        &[Action::Select(Select::All), Action::Set(Setting::Display(DisplayMode::Both))],
    );
    assert_eq!((selection.history().n_undo(), selection.history().n_redo()), (0, 1));
    let other = edited(&undone, Edit::Count(6));
    assert_eq!((other.history().n_undo(), other.history().n_redo()), (1, 0));
}

#[test]
fn settings_are_not_undone() {
    let snap = GridSnap { is_on: true, step: 0.25 };
    let e = after(
        &edited(&selected(&editor(1), &[0]), Edit::Count(5)),
        &[
            Action::Set(Setting::Display(DisplayMode::Cloud)),
            Action::Set(Setting::Snap(snap)),
            Action::Set(Setting::Axis(Axis::Z)),
            Action::Undo,
        ],
    );
    let expected = Settings {
        display: DisplayMode::Cloud,
        snap,
        axis: Axis::Z,
        anchor: ScalingAnchor::Center,
    };
    assert_eq!((e.settings(), e.boxes()[0].n_particles), (&expected, 10));
}

#[test]
fn selections_end_with_the_active_box() {
    let select =
        |boxes: &[usize], mode| Action::Select(Select::Boxes { boxes: boxes.to_vec(), mode });
    let e = after(
        &editor(4),
        &[select(&[2], SelectionMode::Replace), select(&[0], SelectionMode::Toggle)],
    );
    assert_eq!(e.active_box().map(|(i, _)| i), Some(0));
    let e = after(&e, &[Action::Select(Select::All)]);
    assert_eq!(e.selection().boxes(), [1, 2, 3, 0]);
    let e = after(&e, &[Action::Select(Select::Next)]);
    assert_eq!(e.selection().boxes(), [1]);
    let e = after(&e, &[Action::Select(Select::Previous), Action::Select(Select::Previous)]);
    assert_eq!(e.selection().boxes(), [3]);
    assert_eq!(after(&e, &[Action::Select(Select::None)]).active_box(), None);
    assert_eq!(after(&editor(0), &[Action::Select(Select::Next)]).active_box(), None);
}

#[test]
fn the_seed_is_a_step() {
    let seeded = edited(&editor(3), Edit::Seed(9));
    assert_eq!((seeded.document().seed, seeded.history().n_undo()), (9, 1));
    assert_eq!(after(&seeded, &[Action::Undo]).document().seed, 1);
}

#[test]
fn a_new_box_copies_the_active_one_and_snaps_to_the_grid() {
    let place = DVec3::new(0.12, 0.0, 1.3);
    assert_eq!(editor(0).new_box(place, 10.0), CloudBox { center: place, ..NEW_BOX });
    let e = after(
        &selected(&editor(3), &[2]),
        &[Action::Set(Setting::Snap(GridSnap { is_on: true, step: 0.5 }))],
    );
    let center = DVec3::new(0.0, 0.0, 1.5);
    assert_eq!(e.new_box(place, 10.0), CloudBox { n_particles: 12, center, ..unit_box() });
    // The active box would fill this view, or be too small to be seen in it.
    for (view_height, edge) in [(0.5, 0.05), (2e4, 2e3)] {
        let new = e.new_box(place, view_height);
        assert_eq!((new.extent, new.n_particles), (DVec3::splat(edge), NEW_BOX.n_particles));
    }
}

#[test]
fn a_new_box_fits_every_view() {
    for power in -50..50 {
        for share in [1.0, 1.3, 2.2, 3.1, 4.4, 7.0, 9.9] {
            let view_height = share * 10f64.powi(power).clamp(1e-5, 1e14);
            let place = view_height * DVec3::new(1.0 / 3.0, -2.0 / 7.0, 0.1);
            let new = editor(0).new_box(place, view_height);
            let in_view = new.extent.x / view_height;
            assert!((0.06..0.16).contains(&in_view), "{new:?} in {view_height}");
            assert!(new.extent == DVec3::splat(new.extent.x) && box_file::wrong(&new).is_none());
            assert!((new.center - place).abs().max_element() < 0.02 * new.extent.x);
            // Coordinates have few digits.
            let digits = format!("{:e}", new.center.x.abs());
            assert!(digits.len() <= 9, "{digits} in {view_height}");
        }
    }
    for view_height in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(editor(0).new_box(DVec3::ZERO, view_height).extent, DVec3::ONE);
    }
}

#[test]
fn bounds_are_those_of_the_selection_or_of_all_boxes() {
    let e = editor(3);
    let half = DVec3::splat(0.5);
    assert_eq!(e.bounds(), Some((-half, DVec3::X * 8.0 + half)));
    assert_eq!(selected(&e, &[1]).bounds(), Some((DVec3::X * 4.0 - half, DVec3::X * 4.0 + half)));
    assert_eq!(editor(0).bounds(), None);
}
