//! Input by pixels and keys, in a picture of 800 × 600 pixels, 10 units in front of two boxes.

use super::super::axis::Axis;
use super::super::fixtures::{editor, unit_box};
use super::super::input::{Button, ModifierKeys};
use super::super::settings::DisplayMode;
use super::*;
use crate::model::boxes::CloudBox;
use crate::model::camera::Pose;
use glam::DVec3;
use std::path::Path;

const NONE: ModifierKeys = ModifierKeys { ctrl: false, shift: false };
const SHIFT: ModifierKeys = ModifierKeys { shift: true, ..NONE };
const CTRL: ModifierKeys = ModifierKeys { ctrl: true, ..NONE };

fn area() -> PictureArea {
    PictureArea { size_px: DVec2::new(800.0, 600.0), px_per_point: 1.0, fov_y_rad: 1.0 }
}

fn controller_of(boxes: Vec<CloudBox>) -> EditorController {
    let position = DVec3::new(2.0, 0.0, 10.0);
    let pose = Pose { position, right: DVec3::X, up: DVec3::Y, forward: -DVec3::Z };
    let target = DVec3::new(2.0, 0.0, 0.0);
    let session = Session::from_file(Path::new("b.dat"), boxes);
    EditorController::new(session, FlyCamera::new(&pose, DVec3::Y, target), area(), 250.0)
}

/// Unit boxes at x = 0 and 4.
fn controller() -> EditorController {
    controller_of(editor(2).boxes().to_vec())
}

/// A controller with the requests that it has made.
struct User(EditorController, Vec<Request>);

impl User {
    /// Returns the boxes that were regenerated.
    fn does(&mut self, input: Input) -> Vec<usize> {
        let before = self.0.editor().shared_document();
        self.1.extend(self.0.handle(&input));
        self.0.editor().document().regenerated_since(&before)
    }

    fn moves(&mut self, pixel: DVec2, keys: ModifierKeys) -> Vec<usize> {
        self.does(Input::PointerMoved { pixel, keys })
    }

    fn presses(&mut self, button: Button, keys: ModifierKeys) {
        self.does(Input::Button { button, is_down: true, keys });
    }

    fn releases(&mut self, button: Button) {
        self.does(Input::Button { button, is_down: false, keys: NONE });
    }

    fn clicks(&mut self, pixel: DVec2, keys: ModifierKeys) {
        self.moves(pixel, keys);
        self.presses(Button::Left, keys);
        self.releases(Button::Left);
    }

    fn drags(&mut self, from: DVec2, to: DVec2, keys: ModifierKeys) {
        self.moves(from, keys);
        self.presses(Button::Left, keys);
        self.moves(from + 0.4 * (to - from), keys);
        self.moves(to, keys);
        self.releases(Button::Left);
    }

    fn key(&mut self, key: char) {
        self.does(chord(Key::Char(key), false));
    }

    fn with_ctrl(&mut self, key: char) {
        self.does(chord(Key::Char(key), true));
    }

    fn types(&mut self, field: Field, text: &str) {
        self.does(Input::Typed { field, text: text.to_owned() });
    }

    fn at(&self, place: DVec3) -> DVec2 {
        self.0.viewport().project(place).unwrap()
    }

    fn selected(&self) -> &[usize] {
        self.0.editor().selection().boxes()
    }

    fn boxes(&self) -> &[CloudBox] {
        self.0.editor().boxes()
    }

    /// Returns the middle of the arrow along an axis.
    fn arrow(&self, axis: Axis) -> DVec2 {
        let (view, handles) = (self.0.viewport(), self.0.editor().handles(&self.0.viewport()));
        let placed = handles.iter().find(|p| p.handle == Handle::MoveAxis(axis)).unwrap();
        0.5 * (view.project(placed.from).unwrap() + view.project(placed.to).unwrap())
    }
}

fn chord(key: Key, ctrl: bool) -> Input {
    Input::Chord(Chord { key, ctrl, shift: false, alt: false })
}

fn user() -> User {
    User(controller(), vec![])
}

#[test]
fn clicks_select_by_the_held_keys() {
    let mut user = user();
    let [first, second] = [0.4, 4.4].map(|x| user.at(DVec3::new(x, 0.4, 0.5)));
    user.clicks(first, NONE);
    assert_eq!(user.selected(), [0]);
    user.clicks(second, SHIFT);
    assert_eq!(user.selected(), [0, 1]);
    user.clicks(first, CTRL);
    assert_eq!(user.selected(), [1]);
    user.clicks(DVec2::new(400.0, 20.0), NONE);
    assert!(user.selected().is_empty() && user.0.feedback().rectangle.is_none());
    assert_eq!(user.0.editor().history().n_undo(), 0);
}

#[test]
fn a_second_click_selects_the_box_behind_also_on_a_handle() {
    let behind = |z: f64| CloudBox { center: DVec3::new(2.0, 0.0, z), ..unit_box() };
    let mut user = User(controller_of(vec![behind(-4.0), behind(0.0), behind(-2.0)]), vec![]);
    let middle = DVec2::new(400.0, 300.0);
    for expected in [1, 2, 0, 1] {
        user.clicks(middle, NONE);
        assert_eq!(user.selected(), [expected]);
        user.moves(middle + DVec2::X, NONE);
        // The box's centre is a handle, and a click does not move it.
        assert_eq!(user.0.feedback().hovered, Some(Handle::MoveView));
    }
    assert_eq!((user.0.editor().history().n_undo(), user.0.session().is_dirty()), (0, false));
}

#[test]
fn a_rectangle_selects_and_escape_drops_it() {
    let mut user = user();
    let (a, b) = (DVec2::new(5.0, 100.0), DVec2::new(795.0, 500.0));
    user.moves(a, NONE);
    user.presses(Button::Left, NONE);
    user.moves(b, NONE);
    assert_eq!((user.0.feedback().rectangle, user.selected()), (Some([a, b]), [].as_slice()));
    user.does(chord(Key::Escape, false));
    assert_eq!(user.0.feedback().rectangle, None);
    user.releases(Button::Left);
    assert!(user.selected().is_empty());
    user.drags(a, b, NONE);
    assert_eq!(user.selected(), [0, 1]);
    // Ctrl deselects the box in the left half.
    user.drags(a, DVec2::new(400.0, 500.0), CTRL);
    assert_eq!(user.selected(), [1]);
    user.drags(a, DVec2::new(20.0, 120.0), NONE);
    assert!(user.selected().is_empty());
}

#[test]
fn a_drag_is_one_step_that_undo_takes_back() {
    let mut user = user();
    let before = user.0.editor().shared_document();
    let face = user.at(DVec3::new(0.4, 0.4, 0.5));
    user.clicks(face, NONE);
    let from = user.arrow(Axis::X);
    // Pixels per unit at the box's depth.
    let px_per_unit = 300.0 / (0.5f64.tan() * 10.0);
    user.moves(from, NONE);
    assert_eq!(user.0.feedback().hovered, Some(Handle::MoveAxis(Axis::X)));
    user.presses(Button::Left, NONE);
    // Two pixels are not a drag.
    user.moves(from + 2.0 * DVec2::Y, NONE);
    assert!(user.0.editor().document().is_same(&before));
    // A move keeps the particles.
    assert!(user.moves(from + px_per_unit * DVec2::X, NONE).is_empty());
    user.moves(from + 1.5 * px_per_unit * DVec2::X, NONE);
    user.releases(Button::Left);
    assert!(
        (user.boxes()[0].center - DVec3::X * 1.5).length() < 1e-12,
        "{}",
        user.boxes()[0].center
    );
    assert_eq!(user.0.editor().history().n_undo(), 1);
    user.with_ctrl('z');
    assert!(user.0.editor().document().is_same(&before));
    user.with_ctrl('y');
    assert!((user.boxes()[0].center.x - 1.5).abs() < 1e-12);
    // Ctrl snaps to the grid.
    user.with_ctrl('z');
    user.drags(from, from + 1.53 * px_per_unit * DVec2::X, CTRL);
    assert_eq!(user.boxes()[0].center, DVec3::X * 1.5);
}

#[test]
fn escape_cancels_a_drag_and_losing_the_focus_ends_it() {
    let mut user = user();
    let face = user.at(DVec3::new(0.4, 0.4, 0.5));
    user.clicks(face, NONE);
    let from = user.arrow(Axis::Y);
    let drag = |user: &mut User| {
        user.moves(from, NONE);
        user.presses(Button::Left, NONE);
        user.moves(from - 70.0 * DVec2::Y, NONE);
        assert!(user.boxes()[0].center.y > 1.0);
    };
    drag(&mut user);
    // The camera does not move during a drag.
    let pose = user.0.viewport().pose;
    user.does(Input::Wheel(3.0));
    user.key('f');
    assert_eq!(user.0.viewport().pose, pose);
    user.does(chord(Key::Escape, false));
    assert_eq!(user.boxes()[0].center, DVec3::ZERO);
    user.moves(from - 90.0 * DVec2::Y, NONE);
    user.releases(Button::Left);
    assert_eq!((user.boxes()[0].center, user.selected()), (DVec3::ZERO, [0].as_slice()));
    assert_eq!(user.0.editor().history().n_undo(), 0);
    drag(&mut user);
    user.does(Input::FocusLost);
    assert_eq!((user.0.editor().history().n_undo(), user.0.editor().dragged_handle()), (1, None));
    let center = user.boxes()[0].center;
    user.moves(from, NONE);
    assert_eq!(user.boxes()[0].center, center);
}

#[test]
fn a_key_begins_a_drag_that_a_press_ends() {
    let mut user = user();
    user.key('g');
    assert_eq!(user.0.message(), Some("nothing is selected"));
    user.with_ctrl('a');
    assert_eq!((user.selected(), user.0.message()), ([0, 1].as_slice(), None));
    assert_eq!(user.0.feedback(), PointerFeedback::default());
    let middle = DVec2::new(400.0, 300.0);
    user.moves(middle, NONE);
    user.key('g');
    user.key('y');
    user.moves(middle + DVec2::new(60.0, -80.0), NONE);
    let y = user.boxes()[1].center.y;
    assert!(y > 1.0 && user.boxes()[1].center == DVec3::new(4.0, y, 0.0));
    user.presses(Button::Left, NONE);
    user.releases(Button::Left);
    user.moves(middle, NONE);
    assert_eq!((user.boxes()[1].center.y, user.0.editor().history().n_undo()), (y, 1));
    assert_eq!(user.selected(), [0, 1]);
    // Twice the distance from the middle doubles the size; the right button cancels.
    let center = user.at(DVec3::new(2.0, y, 0.0));
    user.moves(center + 50.0 * DVec2::X, NONE);
    user.key('s');
    user.moves(center + 100.0 * DVec2::X, NONE);
    assert!((user.boxes()[1].extent - 2.0).abs().max_element() < 1e-9);
    user.presses(Button::Right, NONE);
    user.moves(center, NONE);
    user.releases(Button::Right);
    assert_eq!((user.boxes()[1].extent, user.0.editor().history().n_undo()), (DVec3::ONE, 1));
}

#[test]
fn other_buttons_and_the_wheel_move_only_the_camera() {
    let mut user = user();
    let before = user.0.editor().shared_document();
    let orbits = |user: &mut User, button, keys, by: DVec2| {
        user.moves(DVec2::new(300.0, 300.0), keys);
        user.presses(button, keys);
        user.moves(DVec2::new(300.0, 300.0) + by, keys);
        user.releases(button);
        user.moves(DVec2::new(10.0, 10.0), keys);
        user.0.viewport().pose
    };
    let pose = user.0.viewport().pose;
    // Half the picture's width is a quarter turn.
    let turned = orbits(&mut user, Button::Right, NONE, DVec2::X * 400.0);
    assert!((turned.position - DVec3::new(-8.0, 0.0, 0.0)).length() < 1e-9, "{}", turned.position);
    orbits(&mut user, Button::Middle, NONE, DVec2::X * -400.0);
    assert!((user.0.viewport().pose.position - pose.position).length() < 1e-9);
    // The target follows the pointer.
    let target = DVec3::new(2.0, 0.0, 0.0);
    orbits(&mut user, Button::Middle, SHIFT, DVec2::new(30.0, 40.0));
    assert!((user.at(target) - DVec2::new(430.0, 340.0)).length() < 1e-9, "{}", user.at(target));
    let far = user.0.camera().position().z;
    user.does(Input::Wheel(2.0));
    assert!((user.0.camera().position().z - 0.81 * far).abs() < 1e-9);
    assert!(user.selected().is_empty() && user.0.editor().document().is_same(&before));
}

#[test]
fn a_new_box_appears_where_the_view_looks_and_f_frames_it() {
    let mut user = User(controller_of(vec![]), vec![]);
    user.key('f');
    assert_eq!(user.0.message(), Some("there is no box to look at"));
    // The pointer has no part in it.
    user.moves(DVec2::new(500.0, 200.0), NONE);
    let target = user.0.camera().target();
    user.key('a');
    assert_eq!(user.selected(), [0]);
    let first = user.boxes()[0];
    assert!((first.center - target).length() < 0.01 * first.extent.x);
    user.key('f');
    // The next box lies on the first one, which is in the way.
    user.does(Input::PointerLeft);
    user.key('a');
    let (eye, forward) = (user.0.camera().position(), user.0.camera().pose().forward);
    let to_first = (first.center - eye).dot(forward);
    let to_second = (user.boxes()[1].center - eye).dot(forward);
    let radius = 0.5 * first.extent.length();
    assert!(to_second < to_first && to_second > to_first - 1.01 * radius);
}

#[test]
fn typed_numbers_have_units_and_invalid_ones_are_refused_with_a_reason() {
    let mut user = user();
    user.types(Field::Radius, "2");
    assert_eq!(user.0.message(), Some("nothing is selected"));
    user.with_ctrl('a');
    user.types(Field::Radius, "1.5");
    user.types(Field::Extent(Axis::Z), "500 m");
    user.types(Field::Count, "12");
    user.types(Field::Seed, "77");
    user.types(Field::SnapStep, "0.25");
    let expected = CloudBox {
        n_particles: 12,
        extent: DVec3::new(1.0, 1.0, 2.0),
        radius_max: 1.5,
        ..user.boxes()[0]
    };
    assert_eq!((user.boxes()[0], user.0.editor().document().seed), (expected, 77));
    assert_eq!((user.0.message(), user.0.editor().settings().snap.step), (None, 0.25));
    user.types(Field::Center(Axis::X), "1 furlong");
    assert!(user.0.message().unwrap().contains("furlong"));
    assert_eq!(user.boxes()[0], expected);
    // A click in a panel clears the message.
    user.does(Input::Event(SessionEvent::Act(Action::Undo)));
    assert_eq!((user.0.message(), user.0.editor().document().seed), (None, 1));
}

#[test]
fn a_question_blocks_other_input_until_it_is_answered() {
    let mut user = user();
    user.with_ctrl('a');
    user.types(Field::Radius, "1");
    user.with_ctrl('q');
    assert_eq!(std::mem::take(&mut user.1), [Request::Ask(Intent::Quit)]);
    user.key('a');
    user.clicks(DVec2::new(400.0, 20.0), NONE);
    user.types(Field::Radius, "3");
    user.does(Input::Wheel(1.0));
    assert_eq!(
        (user.boxes().len(), user.selected().len(), user.boxes()[0].radius_max),
        (2, 2, 1.0)
    );
    assert_eq!(user.0.camera().position(), controller().camera().position());
    user.does(chord(Key::Escape, false));
    assert_eq!(user.0.session().question(), None);
    assert_eq!((user.selected().len(), user.1.len()), (2, 0));
    user.with_ctrl('q');
    user.does(Input::Event(SessionEvent::Answer(Answer::Discard)));
    assert_eq!(user.1, [Request::Ask(Intent::Quit), Request::Quit]);
}

#[test]
fn an_opened_file_is_framed_and_a_failure_is_reported() {
    let mut user = User(controller_of(vec![]), vec![]);
    let far = CloudBox { center: DVec3::X * 100.0, ..unit_box() };
    user.with_ctrl('o');
    assert_eq!(user.1, [Request::ChooseToOpen]);
    user.does(Input::Event(SessionEvent::Opened { path: "c.dat".into(), boxes: vec![far] }));
    assert_eq!(user.0.camera().target(), far.center);
    let error = crate::error::Error::usage("no such file");
    user.does(Input::Event(SessionEvent::Failed(error.clone())));
    assert_eq!(user.0.message(), Some(error.to_string().as_str()));
    // A save ends the drag.
    user.with_ctrl('a');
    user.key('g');
    user.does(Input::Event(SessionEvent::Save));
    assert_eq!((user.0.editor().dragged_handle(), user.0.pointer.gesture), (None, Gesture::None));
}

#[test]
fn settings_help_and_window_size_change_no_box() {
    let mut user = user();
    user.key('?');
    assert!(user.0.shows_help());
    user.with_ctrl('a');
    user.does(chord(Key::Escape, false));
    assert_eq!((user.0.shows_help(), user.selected().len()), (false, 2));
    user.key('3');
    assert_eq!(user.0.editor().settings().display, DisplayMode::Both);
    let size_px = DVec2::new(400.0, 200.0);
    user.does(Input::Resized { size_px, px_per_point: 2.0 });
    user.does(Input::Resized { size_px: DVec2::ZERO, px_per_point: 2.0 });
    assert_eq!((user.0.viewport().size_px, user.0.viewport().px_per_point), (size_px, 2.0));
    user.moves(DVec2::NAN, NONE);
    assert_eq!(user.0.feedback().hovered, None);
    assert!(!user.0.session().is_dirty());
}
