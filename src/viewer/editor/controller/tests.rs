//! A hand at 800 × 600 pixels, 10 units before two boxes: by pixels alone.

use super::super::samples::{editor, unit_box};
use super::super::state::View;
use super::*;
use crate::model::boxes::CloudBox;
use std::path::Path;

const NONE: Held = Held { ctrl: false, shift: false };
const SHIFT: Held = Held { shift: true, ..NONE };
const CTRL: Held = Held { ctrl: true, ..NONE };

fn screen() -> Screen {
    Screen { size_px: DVec2::new(800.0, 600.0), px_per_point: 1.0, fov_y_rad: 1.0 }
}

fn desk_of(boxes: Vec<CloudBox>) -> Desk {
    let position = DVec3::new(2.0, 0.0, 10.0);
    let pose = Pose { position, right: DVec3::X, up: DVec3::Y, forward: -DVec3::Z };
    let target = DVec3::new(2.0, 0.0, 0.0);
    Desk::new(
        Session::opened(Path::new("b.dat"), boxes),
        (&pose, DVec3::Y, target),
        screen(),
        250.0,
    )
}

/// Unit boxes at x = 0 and 4.
fn desk() -> Desk {
    desk_of(editor(2).boxes().to_vec())
}

/// A hand at a desk, which keeps what is asked of the window.
struct Hand(Desk, Vec<Request>);

impl Hand {
    fn does(&mut self, input: Input) -> Touched {
        let Turn { desk, touched, requests } = self.0.after(&input);
        assert_eq!(touched, Touched::between(self.0.editor().document(), desk.editor().document()));
        self.0 = desk;
        self.1.extend(requests);
        touched
    }

    fn moves(&mut self, pixel: DVec2, held: Held) -> Touched {
        self.does(Input::PointerMoved { pixel, held })
    }

    fn presses(&mut self, which: Button, held: Held) {
        self.does(Input::Button { which, is_down: true, held });
    }

    fn releases(&mut self, which: Button) {
        self.does(Input::Button { which, is_down: false, held: NONE });
    }

    fn clicks(&mut self, pixel: DVec2, held: Held) {
        self.moves(pixel, held);
        self.presses(Button::Left, held);
        self.releases(Button::Left);
    }

    fn drags(&mut self, from: DVec2, to: DVec2, held: Held) {
        self.moves(from, held);
        self.presses(Button::Left, held);
        self.moves(from + 0.4 * (to - from), held);
        self.moves(to, held);
        self.releases(Button::Left);
    }

    fn key(&mut self, key: char) {
        self.does(chord(Key::Char(key), false));
    }

    fn with_ctrl(&mut self, key: char) {
        self.does(chord(Key::Char(key), true));
    }

    fn escape(&mut self) {
        self.does(chord(Key::Escape, false));
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

    /// Halfway along the arrow of an axis.
    fn arrow(&self, axis: Axis) -> DVec2 {
        let (view, handles) = (self.0.viewport(), self.0.editor().handles(&self.0.viewport()));
        let placed = handles.iter().find(|p| p.handle == Handle::MoveAxis(axis)).unwrap();
        0.5 * (view.project(placed.from).unwrap() + view.project(placed.to).unwrap())
    }
}

fn chord(key: Key, ctrl: bool) -> Input {
    Input::Chord(Chord { key, ctrl, shift: false, alt: false })
}

fn hand() -> Hand {
    Hand(desk(), vec![])
}

#[test]
fn clicks_select_and_keys_that_are_held_say_how() {
    let mut hand = hand();
    let [first, second] = [0.4, 4.4].map(|x| hand.at(DVec3::new(x, 0.4, 0.5)));
    hand.clicks(first, NONE);
    assert_eq!(hand.selected(), [0]);
    hand.clicks(second, SHIFT);
    assert_eq!(hand.selected(), [0, 1]);
    hand.clicks(first, CTRL);
    assert_eq!(hand.selected(), [1]);
    hand.clicks(DVec2::new(400.0, 20.0), NONE);
    assert!(hand.selected().is_empty() && hand.0.rectangle().is_none());
    assert_eq!(hand.0.editor().history().n_undo(), 0);
}

#[test]
fn a_further_click_takes_what_lies_behind_even_where_a_handle_is() {
    let behind = |z: f64| CloudBox { center: DVec3::new(2.0, 0.0, z), ..unit_box() };
    let mut hand = Hand(desk_of(vec![behind(-4.0), behind(0.0), behind(-2.0)]), vec![]);
    let middle = DVec2::new(400.0, 300.0);
    for expected in [1, 2, 0, 1] {
        hand.clicks(middle, NONE);
        assert_eq!(hand.selected(), [expected]);
        hand.moves(middle + DVec2::X, NONE);
        // The box's centre is a handle, and a click moves nothing.
        assert_eq!(hand.0.hovered(), Some(Handle::MoveView));
    }
    assert_eq!((hand.0.editor().history().n_undo(), hand.0.session().is_dirty()), (0, false));
}

#[test]
fn a_rectangle_selects_and_escape_drops_it() {
    let mut hand = hand();
    let (a, b) = (DVec2::new(5.0, 100.0), DVec2::new(795.0, 500.0));
    hand.moves(a, NONE);
    hand.presses(Button::Left, NONE);
    hand.moves(b, NONE);
    assert_eq!((hand.0.rectangle(), hand.selected()), (Some([a, b]), [].as_slice()));
    hand.escape();
    assert_eq!(hand.0.rectangle(), None);
    hand.releases(Button::Left);
    assert!(hand.selected().is_empty());
    hand.drags(a, b, NONE);
    assert_eq!(hand.selected(), [0, 1]);
    // Of the left half, no longer.
    hand.drags(a, DVec2::new(400.0, 500.0), CTRL);
    assert_eq!(hand.selected(), [1]);
    hand.drags(a, DVec2::new(20.0, 120.0), NONE);
    assert!(hand.selected().is_empty());
}

#[test]
fn a_drag_is_one_step_that_undo_takes_back() {
    let mut hand = hand();
    let before = hand.0.editor().shared_document();
    let face = hand.at(DVec3::new(0.4, 0.4, 0.5));
    hand.clicks(face, NONE);
    let from = hand.arrow(Axis::X);
    // At the box's depth 10 units are as far as the picture's height says.
    let px_per_unit = 300.0 / (0.5f64.tan() * 10.0);
    hand.moves(from, NONE);
    assert_eq!(hand.0.hovered(), Some(Handle::MoveAxis(Axis::X)));
    hand.presses(Button::Left, NONE);
    // A trembling hand.
    assert!(hand.moves(from + 2.0 * DVec2::Y, NONE).is_nothing());
    let touched = hand.moves(from + px_per_unit * DVec2::X, NONE);
    assert_eq!((touched.moved, touched.generate), (vec![0], vec![]));
    hand.moves(from + 1.5 * px_per_unit * DVec2::X, NONE);
    hand.releases(Button::Left);
    assert!(
        (hand.boxes()[0].center - DVec3::X * 1.5).length() < 1e-12,
        "{}",
        hand.boxes()[0].center
    );
    assert_eq!(hand.0.editor().history().n_undo(), 1);
    hand.with_ctrl('z');
    assert!(hand.0.editor().document().is_same(&before));
    hand.with_ctrl('y');
    assert!((hand.boxes()[0].center.x - 1.5).abs() < 1e-12);
    // With Ctrl held to the grid.
    hand.with_ctrl('z');
    hand.drags(from, from + 1.53 * px_per_unit * DVec2::X, CTRL);
    assert_eq!(hand.boxes()[0].center, DVec3::X * 1.5);
}

#[test]
fn escape_cancels_a_drag_and_losing_the_focus_ends_it() {
    let mut hand = hand();
    let face = hand.at(DVec3::new(0.4, 0.4, 0.5));
    hand.clicks(face, NONE);
    let from = hand.arrow(Axis::Y);
    let drag = |hand: &mut Hand| {
        hand.moves(from, NONE);
        hand.presses(Button::Left, NONE);
        hand.moves(from - 70.0 * DVec2::Y, NONE);
        assert!(hand.boxes()[0].center.y > 1.0);
    };
    drag(&mut hand);
    // The eye stands still meanwhile.
    let pose = hand.0.viewport().pose;
    hand.does(Input::Wheel(3.0));
    hand.key('f');
    assert_eq!(hand.0.viewport().pose, pose);
    hand.escape();
    assert_eq!(hand.boxes()[0].center, DVec3::ZERO);
    hand.moves(from - 90.0 * DVec2::Y, NONE);
    hand.releases(Button::Left);
    assert_eq!((hand.boxes()[0].center, hand.selected()), (DVec3::ZERO, [0].as_slice()));
    assert_eq!(hand.0.editor().history().n_undo(), 0);
    drag(&mut hand);
    hand.does(Input::FocusLost);
    assert_eq!((hand.0.editor().history().n_undo(), hand.0.editor().dragged_handle()), (1, None));
    let center = hand.boxes()[0].center;
    hand.moves(from, NONE);
    assert_eq!(hand.boxes()[0].center, center);
}

#[test]
fn keys_begin_drags_that_a_press_ends() {
    let mut hand = hand();
    hand.key('g');
    assert_eq!(hand.0.said(), Some("nothing is selected"));
    hand.with_ctrl('a');
    assert_eq!((hand.selected(), hand.0.said()), ([0, 1].as_slice(), None));
    assert_eq!(hand.0.pointing(), Pointing::default());
    let middle = DVec2::new(400.0, 300.0);
    hand.moves(middle, NONE);
    hand.key('g');
    hand.key('y');
    hand.moves(middle + DVec2::new(60.0, -80.0), NONE);
    let y = hand.boxes()[1].center.y;
    assert!(y > 1.0 && hand.boxes()[1].center == DVec3::new(4.0, y, 0.0));
    hand.presses(Button::Left, NONE);
    hand.releases(Button::Left);
    hand.moves(middle, NONE);
    assert_eq!((hand.boxes()[1].center.y, hand.0.editor().history().n_undo()), (y, 1));
    assert_eq!(hand.selected(), [0, 1]);
    // Twice as far from the middle is twice as large; the right button takes it back.
    let center = hand.at(DVec3::new(2.0, y, 0.0));
    hand.moves(center + 50.0 * DVec2::X, NONE);
    hand.key('s');
    hand.moves(center + 100.0 * DVec2::X, NONE);
    assert!((hand.boxes()[1].extent - 2.0).abs().max_element() < 1e-9);
    hand.presses(Button::Right, NONE);
    hand.moves(center, NONE);
    hand.releases(Button::Right);
    assert_eq!((hand.boxes()[1].extent, hand.0.editor().history().n_undo()), (DVec3::ONE, 1));
}

#[test]
fn other_buttons_and_the_wheel_move_the_camera_and_nothing_else() {
    let mut hand = hand();
    let before = hand.0.editor().shared_document();
    let orbits = |hand: &mut Hand, which, held, by: DVec2| {
        hand.moves(DVec2::new(300.0, 300.0), held);
        hand.presses(which, held);
        hand.moves(DVec2::new(300.0, 300.0) + by, held);
        hand.releases(which);
        hand.moves(DVec2::new(10.0, 10.0), held);
        hand.0.viewport().pose
    };
    let pose = hand.0.viewport().pose;
    // Half the picture's width is a quarter around.
    let turned = orbits(&mut hand, Button::Right, NONE, DVec2::X * 400.0);
    assert!((turned.position - DVec3::new(-8.0, 0.0, 0.0)).length() < 1e-9, "{}", turned.position);
    orbits(&mut hand, Button::Middle, NONE, DVec2::X * -400.0);
    assert!((hand.0.viewport().pose.position - pose.position).length() < 1e-9);
    // What is turned about goes with the pointer.
    let target = DVec3::new(2.0, 0.0, 0.0);
    orbits(&mut hand, Button::Middle, SHIFT, DVec2::new(30.0, 40.0));
    assert!((hand.at(target) - DVec2::new(430.0, 340.0)).length() < 1e-9, "{}", hand.at(target));
    let far = hand.0.flight().position().z;
    hand.does(Input::Wheel(2.0));
    assert!((hand.0.flight().position().z - 0.81 * far).abs() < 1e-9);
    assert!(hand.selected().is_empty() && hand.0.editor().document().is_same(&before));
}

#[test]
fn a_box_comes_under_the_pointer_and_f_looks_at_it() {
    let mut hand = Hand(desk_of(vec![]), vec![]);
    hand.key('f');
    assert_eq!(hand.0.said(), Some("there is no box to look at"));
    hand.moves(DVec2::new(500.0, 200.0), NONE);
    hand.key('a');
    assert_eq!(hand.selected(), [0]);
    let center = hand.boxes()[0].center;
    assert!((hand.at(center) - DVec2::new(500.0, 200.0)).length() < 1e-9 && center.z.abs() < 1e-12);
    hand.key('f');
    assert!((hand.0.flight().target() - center).length() < 1e-9);
    hand.does(Input::PointerLeft);
    hand.key('a');
    assert!((hand.boxes()[1].center - hand.0.flight().target()).length() < 1e-12);
}

#[test]
fn what_is_typed_is_taken_with_its_unit_or_refused_with_its_reason() {
    let mut hand = hand();
    hand.types(Field::Radius, "2");
    assert_eq!(hand.0.said(), Some("nothing is selected"));
    hand.with_ctrl('a');
    hand.types(Field::Radius, "1.5");
    hand.types(Field::Extent(Axis::Z), "500 m");
    hand.types(Field::Count, "12");
    hand.types(Field::Seed, "77");
    hand.types(Field::SnapStep, "0.25");
    let expected = CloudBox {
        n_particles: 12,
        extent: DVec3::new(1.0, 1.0, 2.0),
        radius_max: 1.5,
        ..hand.boxes()[0]
    };
    assert_eq!((hand.boxes()[0], hand.0.editor().document().seed), (expected, 77));
    assert_eq!((hand.0.said(), hand.0.editor().settings().snap.step), (None, 0.25));
    hand.types(Field::Center(Axis::X), "1 furlong");
    assert!(hand.0.said().unwrap().contains("furlong"));
    assert_eq!(hand.boxes()[0], expected);
    // A panel's button.
    hand.does(Input::Event(Event::Act(Action::Undo)));
    assert_eq!((hand.0.said(), hand.0.editor().document().seed), (None, 1));
}

#[test]
fn nothing_is_lost_unasked_and_nothing_else_is_answered_meanwhile() {
    let mut hand = hand();
    hand.with_ctrl('a');
    hand.types(Field::Radius, "1");
    hand.with_ctrl('q');
    assert_eq!(std::mem::take(&mut hand.1), [Request::Ask(Wish::Quit)]);
    hand.key('a');
    hand.clicks(DVec2::new(400.0, 20.0), NONE);
    hand.types(Field::Radius, "3");
    hand.does(Input::Wheel(1.0));
    assert_eq!(
        (hand.boxes().len(), hand.selected().len(), hand.boxes()[0].radius_max),
        (2, 2, 1.0)
    );
    assert_eq!(hand.0.flight().position(), desk().flight().position());
    hand.escape();
    assert_eq!(hand.0.session().asked(), None);
    assert_eq!((hand.selected().len(), hand.1.len()), (2, 0));
    hand.with_ctrl('q');
    hand.does(Input::Event(Event::Answer(Answer::Discard)));
    assert_eq!(hand.1, [Request::Ask(Wish::Quit), Request::Quit]);
}

#[test]
fn a_file_that_is_opened_is_looked_at_and_one_that_fails_is_told_of() {
    let mut hand = Hand(desk_of(vec![]), vec![]);
    let far = CloudBox { center: DVec3::X * 100.0, ..unit_box() };
    hand.with_ctrl('o');
    assert_eq!(hand.1, [Request::ChooseToOpen]);
    hand.does(Input::Event(Event::Opened { path: "c.dat".into(), boxes: vec![far] }));
    assert_eq!(hand.0.flight().target(), far.center);
    let error = crate::error::Error::usage("no such file");
    hand.does(Input::Event(Event::Failed(error.clone())));
    assert_eq!(hand.0.said(), Some(error.to_string().as_str()));
    // A drag that a file ends is no longer in the hand.
    hand.with_ctrl('a');
    hand.key('g');
    hand.does(Input::Event(Event::Save));
    assert_eq!((hand.0.editor().dragged_handle(), hand.0.hold), (None, Hold::Nothing));
}

#[test]
fn settings_help_and_the_window_change_no_box() {
    let mut hand = hand();
    hand.key('?');
    assert!(hand.0.shows_help());
    hand.with_ctrl('a');
    hand.escape();
    assert_eq!((hand.0.shows_help(), hand.selected().len()), (false, 2));
    hand.key('3');
    assert_eq!(hand.0.editor().settings().view, View::Both);
    hand.does(Input::Resized { size_px: DVec2::new(400.0, 200.0), px_per_point: 2.0 });
    assert_eq!(
        (hand.0.viewport().size_px, hand.0.viewport().px_per_point),
        (DVec2::new(400.0, 200.0), 2.0)
    );
    hand.does(Input::Resized { size_px: DVec2::ZERO, px_per_point: 2.0 });
    assert_eq!(hand.0.viewport().size_px, DVec2::new(400.0, 200.0));
    hand.moves(DVec2::NAN, NONE);
    assert_eq!(hand.0.hovered(), None);
    assert!(!hand.0.session().is_dirty());
}
