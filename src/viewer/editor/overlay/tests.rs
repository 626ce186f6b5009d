use super::super::action::{Action, DragAction, Setting};
use super::super::axis::Axis;
use super::super::fixtures::{after, editor, selected, unit_box};
use super::super::handles::Handle;
use super::boxes::{EDGE, MAX_DRAWN, ORANGE, RED, TRANSLUCENT};
use super::canvas::MARGIN_POINTS;
use super::*;
use crate::model::boxes::CloudBox;
use crate::model::camera::Pose;
use glam::DVec3;

fn view(position: DVec3, target: DVec3) -> Viewport {
    let forward = (target - position).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let pose = Pose { position, right, up: right.cross(forward), forward };
    Viewport { pose, fov_y_rad: 0.8, size_px: DVec2::new(800.0, 600.0), px_per_point: 1.0 }
}

fn front() -> Viewport {
    view(DVec3::new(5.0, 4.0, 12.0), DVec3::ZERO)
}

fn shown(editor: &Editor, mode: DisplayMode) -> Editor {
    after(editor, &[Action::Set(Setting::Display(mode))])
}

/// Returns fill, outline and middle of every box's faces, in order.
fn faces_of(shapes: &[Shape]) -> Vec<(Color, Stroke, DVec2)> {
    let of = |shape: &Shape| match shape {
        Shape::Polygon { corners, fill, outline: Some(stroke) } if !is_of_handle(*fill) => {
            Some((*fill, *stroke, corners.iter().sum::<DVec2>() / corners.len() as f64))
        }
        _ => None,
    };
    shapes.iter().filter_map(of).collect()
}

fn is_of_handle(fill: Color) -> bool {
    gizmo::AXES.contains(&fill) || [gizmo::HIGHLIGHT, gizmo::CENTER].contains(&fill)
}

fn is_red(fill: &Color) -> bool {
    u32::from(fill[0]) > 2 * u32::from(fill[1].max(fill[2]))
}

fn lines_of(shapes: &[Shape], color: Color) -> usize {
    shapes
        .iter()
        .filter(|s| matches!(s, Shape::Line { stroke, .. } if stroke.color == color))
        .count()
}

#[test]
fn three_faces_of_a_box_show_and_the_one_toward_the_light_is_brightest() {
    let faces = faces_of(&overlay_shapes(&editor(1), &front(), PointerFeedback::default()));
    assert_eq!(faces.len(), 3);
    let view = front();
    let brightness = |place: DVec3| {
        let pixel = view.project(place).unwrap();
        let nearest = faces
            .iter()
            .min_by(|a, b| a.2.distance(pixel).total_cmp(&b.2.distance(pixel)))
            .unwrap();
        nearest.0[..3].iter().map(|c| u32::from(*c)).sum::<u32>()
    };
    let [right, top, front] = [DVec3::X, DVec3::Y, DVec3::Z].map(|n| brightness(0.5 * n));
    assert!(top > front && front > right, "{top} {front} {right}");
    assert!(faces.iter().all(|(fill, ..)| fill[3] == 255 && fill[2] >= fill[0]));
}

#[test]
fn the_active_box_is_red_and_other_selected_boxes_have_an_orange_outline() {
    let editor = selected(&editor(3), &[0, 1]);
    let faces = faces_of(&overlay_shapes(
        &editor,
        &view(DVec3::new(4.0, 6.0, 16.0), DVec3::X * 4.0),
        PointerFeedback::default(),
    ));
    let n_red = faces.iter().filter(|(fill, ..)| is_red(fill)).count();
    let n_orange =
        faces.iter().filter(|(fill, stroke, _)| stroke.color == ORANGE && !is_red(fill)).count();
    // The box in the middle of the view shows two faces.
    assert_eq!((n_red, n_orange), (2, 3));
}

#[test]
fn nearer_faces_are_drawn_later() {
    let at = |z: f64| CloudBox { center: DVec3::Z * z, ..unit_box() };
    let editor = Editor::new([3.0, -5.0, 0.0].map(at).to_vec());
    let faces = faces_of(&overlay_shapes(
        &editor,
        &view(DVec3::new(0.2, 0.1, 20.0), DVec3::ZERO),
        PointerFeedback::default(),
    ));
    // The front faces, in drawing order, grow with their nearness.
    let shapes = overlay_shapes(
        &editor,
        &view(DVec3::new(0.0, 0.0, 20.0), DVec3::ZERO),
        PointerFeedback::default(),
    );
    let widths: Vec<f64> = shapes
        .iter()
        .filter_map(|shape| match shape {
            Shape::Polygon { corners, .. } => {
                let xs = || corners.iter().map(|c| c.x);
                Some(xs().fold(f64::MIN, f64::max) - xs().fold(f64::MAX, f64::min))
            }
            _ => None,
        })
        .collect();
    assert!(widths.len() == 3 && widths.is_sorted() && faces.len() >= 3, "{widths:?}");
}

#[test]
fn each_display_mode_has_its_own_shapes() {
    let editor = selected(&editor(2), &[1]);
    let shapes = |mode| overlay_shapes(&shown(&editor, mode), &front(), PointerFeedback::default());
    let handles_alone = shapes(DisplayMode::Cloud);
    let n_handles = editor.handles(&front()).len();
    // A square or a line each, a head and a letter for each arrow, and the box's label.
    assert_eq!(handles_alone.len(), n_handles + 2 * 3 + 1);
    assert!(
        overlay_shapes(
            &shown(&super::super::fixtures::editor(2), DisplayMode::Cloud),
            &front(),
            PointerFeedback::default()
        )
        .is_empty()
    );
    let both = shapes(DisplayMode::Both);
    assert_eq!((lines_of(&both, EDGE), lines_of(&both, RED)), (12, 12));
    let glass =
        both.iter().filter(|s| matches!(s, Shape::Polygon { fill, .. } if fill[3] == TRANSLUCENT));
    assert!(glass.count() >= 2);
    let boxes = shapes(DisplayMode::Boxes);
    assert!(boxes.ends_with(&handles_alone) && both.ends_with(&handles_alone));
    assert_eq!((lines_of(&boxes, EDGE), lines_of(&boxes, RED)), (0, 0));
}

#[test]
fn handles_are_drawn_where_they_are_picked_and_are_highlighted() {
    let editor = selected(&editor(1), &[0]);
    let view = front();
    let moves_x = Handle::MoveAxis(Axis::X);
    let x = editor.handles(&view).into_iter().find(|p| p.handle == moves_x).unwrap();
    let ends = [view.project(x.from).unwrap(), view.project(x.to).unwrap()];
    let color = |shapes: &[Shape]| {
        let of = |shape: &Shape| match shape {
            Shape::Line { from, to, stroke }
                if from.distance(ends[0]) + to.distance(ends[1]) < 1e-9 =>
            {
                Some(stroke.color)
            }
            _ => None,
        };
        shapes.iter().find_map(of).unwrap()
    };
    assert_eq!(color(&overlay_shapes(&editor, &view, PointerFeedback::default())), gizmo::AXES[0]);
    let hovered = PointerFeedback { hovered: Some(moves_x), ..PointerFeedback::default() };
    assert_eq!(color(&overlay_shapes(&editor, &view, hovered)), gizmo::HIGHLIGHT);
    // The dragged handle is highlighted, whatever is under the pointer.
    let (ray, forward) = (view.ray(ends[0]), view.pose.forward);
    let held = after(&editor, &[Action::Drag(DragAction::Begin { handle: moves_x, ray, forward })]);
    let other = PointerFeedback { hovered: Some(Handle::MoveView), ..PointerFeedback::default() };
    assert_eq!(color(&overlay_shapes(&held, &view, other)), gizmo::HIGHLIGHT);
    let rectangle = PointerFeedback {
        rectangle: Some([DVec2::ZERO, DVec2::ONE]),
        ..PointerFeedback::default()
    };
    assert_eq!(
        overlay_shapes(&editor, &view, rectangle).len(),
        overlay_shapes(&editor, &view, PointerFeedback::default()).len() + 1
    );
}

/// The camera is between, inside and behind boxes of every size.
#[test]
fn shapes_stay_within_the_margin_and_polygons_are_convex() {
    let mut state = 1u64;
    let mut uniform = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut n_shapes = 0;
    for i in 0..200 {
        let mut place = |size: f64| size * (DVec3::new(uniform(), uniform(), uniform()) - 0.5);
        let boxes = (0..12)
            .map(|_| CloudBox { center: place(6.0), extent: place(12.0).abs(), ..unit_box() })
            .collect();
        let view = view(place(6.0), place(3.0));
        let editor = selected(&Editor::new(boxes), &[0, 5]);
        for what in [DisplayMode::Boxes, DisplayMode::Both] {
            let shapes = overlay_shapes(&shown(&editor, what), &view, PointerFeedback::default());
            n_shapes += shapes.len();
            shapes.iter().for_each(|shape| check(shape, &view, i));
        }
    }
    assert!(n_shapes > 10_000, "{n_shapes}");
}

fn check(shape: &Shape, view: &Viewport, i: usize) {
    // Heads and letters of arrows extend beyond their ends.
    let most = MARGIN_POINTS + 20.0;
    let within =
        |p: &DVec2| p.cmpge(DVec2::splat(-most)).all() && p.cmple(view.size_px + most).all();
    match shape {
        Shape::Polygon { corners, .. } => {
            assert!(corners.len() > 2 && corners.iter().all(within), "{i}: {shape:?}");
            let n = corners.len();
            let turns = |k: usize| {
                let [a, b, c] = [corners[k], corners[(k + 1) % n], corners[(k + 2) % n]];
                (b - a).perp_dot(c - b)
            };
            // Rounding of products of pixel coordinates up to some thousand.
            let (least, most) =
                (0..n).map(turns).fold((0.0f64, 0.0f64), |(l, m), t| (l.min(t), m.max(t)));
            assert!(least > -1e-6 || most < 1e-6, "{i}: {least} {most} {shape:?}");
        }
        Shape::Line { from, to, .. } => assert!(within(from) && within(to), "{i}: {shape:?}"),
        Shape::Label { at, .. } => assert!(within(at), "{i}: {shape:?}"),
    }
}

#[test]
fn a_box_around_the_camera_shows_only_edges() {
    let around = CloudBox { extent: DVec3::new(8.0, 8.0, 40.0), ..unit_box() };
    let shapes = overlay_shapes(
        &Editor::new(vec![around, unit_box()]),
        &view(DVec3::Z * 5.0, DVec3::ZERO),
        PointerFeedback::default(),
    );
    assert_eq!(faces_of(&shapes).len(), 1);
    assert!(lines_of(&shapes, EDGE) >= 4);
}

#[test]
fn of_too_many_boxes_the_nearest_and_the_active_one_are_drawn() {
    let at = |i: u32| CloudBox {
        center: DVec3::new(f64::from(i % 100) - 50.0, 0.0, -f64::from(i / 100)),
        ..unit_box()
    };
    let boxes: Vec<CloudBox> = (0..20_000).map(at).collect();
    let far = boxes.len() - 50;
    let editor = selected(&Editor::new(boxes), &[far]);
    let shapes = overlay_shapes(
        &editor,
        &view(DVec3::new(0.0, 60.0, 100.0), DVec3::new(0.0, 0.0, -100.0)),
        PointerFeedback::default(),
    );
    let faces = faces_of(&shapes);
    assert!(faces.len() > MAX_DRAWN && faces.len() < 4 * MAX_DRAWN, "{}", faces.len());
    assert!(faces.iter().any(|(fill, ..)| is_red(fill)));
    // Boxes behind the camera are not drawn.
    let away = overlay_shapes(
        &editor,
        &view(DVec3::new(0.0, 0.0, 100.0), DVec3::new(0.0, 0.0, 200.0)),
        PointerFeedback::default(),
    );
    assert!(faces_of(&away).is_empty());
}
