use super::super::action::{Action, DragAction, Setting};
use super::super::samples::{after, editor, selected, unit_box};
use super::*;
use crate::model::camera::Pose;

fn view(position: DVec3, target: DVec3) -> Viewport {
    let forward = (target - position).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let pose = Pose { position, right, up: right.cross(forward), forward };
    Viewport { pose, fov_y_rad: 0.8, size_px: DVec2::new(800.0, 600.0), px_per_point: 1.0 }
}

fn front() -> Viewport {
    view(DVec3::new(5.0, 4.0, 12.0), DVec3::ZERO)
}

fn shown(editor: &Editor, view: View) -> Editor {
    after(editor, &[Action::Set(Setting::View(view))])
}

/// Fill, stroke and middle of every box's opaque faces, in order.
fn faces_of(shapes: &[Shape]) -> Vec<(Color, Stroke, DVec2)> {
    let of = |shape: &Shape| match shape {
        Shape::Polygon { corners, fill, stroke: Some(stroke) } if !gizmo::is_of_handle(*fill) => {
            Some((*fill, *stroke, corners.iter().sum::<DVec2>() / corners.len() as f64))
        }
        _ => None,
    };
    shapes.iter().filter_map(of).collect()
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
fn three_faces_of_a_box_are_seen_and_the_one_to_the_light_is_brightest() {
    let faces = faces_of(&sketch(&editor(1), &front(), Pointing::default()));
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
fn the_active_box_is_red_and_what_else_is_selected_has_an_orange_rim() {
    let editor = selected(&editor(3), &[0, 1]);
    let faces = faces_of(&sketch(
        &editor,
        &view(DVec3::new(4.0, 6.0, 16.0), DVec3::X * 4.0),
        Pointing::default(),
    ));
    let n_red = faces.iter().filter(|(fill, ..)| is_red(fill)).count();
    let n_orange =
        faces.iter().filter(|(fill, stroke, _)| stroke.color == ORANGE && !is_red(fill)).count();
    // Seen from straight before it the box in the middle shows two faces.
    assert_eq!((n_red, n_orange), (2, 3));
}

#[test]
fn what_is_nearer_is_drawn_later() {
    let at = |z: f64| CloudBox { center: DVec3::Z * z, ..unit_box() };
    let editor = Editor::new([3.0, -5.0, 0.0].map(at).to_vec());
    let faces = faces_of(&sketch(
        &editor,
        &view(DVec3::new(0.2, 0.1, 20.0), DVec3::ZERO),
        Pointing::default(),
    ));
    // Fronts of the three, which differ in size: by their widths on the picture, as they are drawn.
    let shapes =
        sketch(&editor, &view(DVec3::new(0.0, 0.0, 20.0), DVec3::ZERO), Pointing::default());
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
fn each_view_shows_its_own() {
    let editor = selected(&editor(2), &[1]);
    let shapes = |view| sketch(&shown(&editor, view), &front(), Pointing::default());
    let handles_alone = shapes(View::Cloud);
    let n_handles = editor.handles(&front()).len();
    // A square or a line, a head and a letter each, and what the box is called.
    assert_eq!(handles_alone.len(), n_handles + 2 * 3 + 1);
    assert!(
        sketch(
            &shown(&super::super::samples::editor(2), View::Cloud),
            &front(),
            Pointing::default()
        )
        .is_empty()
    );
    let both = shapes(View::Both);
    assert_eq!((lines_of(&both, EDGE), lines_of(&both, RED)), (12, 12));
    let glass =
        both.iter().filter(|s| matches!(s, Shape::Polygon { fill, .. } if fill[3] == TRANSLUCENT));
    assert!(glass.count() >= 2);
    let boxes = shapes(View::Boxes);
    assert!(boxes.ends_with(&handles_alone) && both.ends_with(&handles_alone));
    assert_eq!((lines_of(&boxes, EDGE), lines_of(&boxes, RED)), (0, 0));
}

#[test]
fn handles_lie_where_they_are_found_and_light_up() {
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
    assert_eq!(color(&sketch(&editor, &view, Pointing::default())), gizmo::AXES[0]);
    let hovered = Pointing { hovered: Some(moves_x), ..Pointing::default() };
    assert_eq!(color(&sketch(&editor, &view, hovered)), gizmo::LIT);
    // What is held is lit whatever lies under the pointer.
    let (ray, forward) = (view.ray(ends[0]), view.pose.forward);
    let held = after(&editor, &[Action::Drag(DragAction::Begin { handle: moves_x, ray, forward })]);
    let other = Pointing { hovered: Some(Handle::MoveView), ..Pointing::default() };
    assert_eq!(color(&sketch(&held, &view, other)), gizmo::LIT);
    let rectangle = Pointing { rectangle: Some([DVec2::ZERO, DVec2::ONE]), ..Pointing::default() };
    assert_eq!(
        sketch(&editor, &view, rectangle).len(),
        sketch(&editor, &view, Pointing::default()).len() + 1
    );
}

/// From among, within and behind boxes of every size nothing is drawn beyond the margin, and every
/// polygon is convex and turns one way.
#[test]
fn nothing_flips_wherever_the_eye_is() {
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
        for what in [View::Boxes, View::Both] {
            let shapes = sketch(&shown(&editor, what), &view, Pointing::default());
            n_shapes += shapes.len();
            shapes.iter().for_each(|shape| check(shape, &view, i));
        }
    }
    assert!(n_shapes > 10_000, "{n_shapes}");
}

fn check(shape: &Shape, view: &Viewport, i: usize) {
    // Heads and letters of arrows lie beside their ends.
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
            // Rounding of pixels of some thousand, squared.
            let (least, most) =
                (0..n).map(turns).fold((0.0f64, 0.0f64), |(l, m), t| (l.min(t), m.max(t)));
            assert!(least > -1e-6 || most < 1e-6, "{i}: {least} {most} {shape:?}");
        }
        Shape::Line { from, to, .. } => assert!(within(from) && within(to), "{i}: {shape:?}"),
        Shape::Label { at, .. } => assert!(within(at), "{i}: {shape:?}"),
    }
}

#[test]
fn a_box_around_the_eye_shows_its_edges_alone() {
    let around = CloudBox { extent: DVec3::new(8.0, 8.0, 40.0), ..unit_box() };
    let shapes = sketch(
        &Editor::new(vec![around, unit_box()]),
        &view(DVec3::Z * 5.0, DVec3::ZERO),
        Pointing::default(),
    );
    assert_eq!(faces_of(&shapes).len(), 1);
    assert!(lines_of(&shapes, EDGE) >= 4);
}

#[test]
fn of_very_many_boxes_the_nearest_and_the_active_one_are_drawn() {
    let at = |i: u32| CloudBox {
        center: DVec3::new(f64::from(i % 100) - 50.0, 0.0, -f64::from(i / 100)),
        ..unit_box()
    };
    let boxes: Vec<CloudBox> = (0..20_000).map(at).collect();
    let far = boxes.len() - 50;
    let editor = selected(&Editor::new(boxes), &[far]);
    let shapes = sketch(
        &editor,
        &view(DVec3::new(0.0, 60.0, 100.0), DVec3::new(0.0, 0.0, -100.0)),
        Pointing::default(),
    );
    let faces = faces_of(&shapes);
    assert!(faces.len() > MOST_DRAWN && faces.len() < 4 * MOST_DRAWN, "{}", faces.len());
    assert!(faces.iter().any(|(fill, ..)| is_red(fill)));
    // What lies behind costs nothing.
    let away = sketch(
        &editor,
        &view(DVec3::new(0.0, 0.0, 100.0), DVec3::new(0.0, 0.0, 200.0)),
        Pointing::default(),
    );
    assert!(faces_of(&away).is_empty());
}
