use super::*;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::model::boxes::CloudBox;
use crate::model::camera::Pose;
use crate::viewer::editor::{
    Chord, EditorController, Field, Key, PictureArea, Session, key_groups,
};
use crate::viewer::fly_camera::FlyCamera;
use crate::viewer::layout::has_room_for_panels;
use crate::viewer::widget_check::{
    FakeWindow, Text, assert_whole_lines, click, find, is_visible, wheel, windows,
};
use egui::{Event, Pos2, pos2};
use glam::{DVec2, DVec3};

/// Number of boxes of the long list.
const N: usize = 500;

fn controller(n: usize) -> EditorController {
    let position = DVec3::new(0.0, 0.0, 18.0);
    let pose = Pose { position, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z };
    let boxes = (0..n).map(|i| CloudBox {
        n_particles: 1_000_000,
        extent: DVec3::new(0.1 + 0.2, 1.0 / 3.0, 7.39642),
        center: DVec3::new(-0.600002, i as f64, 1e-7 / 3.0),
        radius_max: 2.0,
    });
    let path = Path::new("/home/somebody/clouds/of-a-long-name-without-any-blank/cloud.dat");
    let session = Session::from_file(path, boxes.collect());
    let size_px = DVec2::new(800.0, 600.0);
    let area = PictureArea { size_px, px_per_point: 1.0, fov_y_rad: 0.8 };
    let camera = FlyCamera::new(&pose, DVec3::Y, DVec3::ZERO);
    EditorController::new(session, camera, area, 250.0)
}

fn key(controller: &mut EditorController, key: Key) {
    controller.handle(&Input::Chord(Chord { key, ctrl: false, shift: false, alt: false }));
}

/// A window with the panels in it.
struct Panels {
    window: FakeWindow,
    controller: EditorController,
    texts: FieldTexts,
    dialog: Option<FileDialog>,
    recent: Vec<PathBuf>,
    inputs: Vec<Input>,
}

impl Panels {
    fn open(size: [u32; 2], scale: f64, n: usize) -> Panels {
        Panels {
            window: FakeWindow::new(size, scale),
            controller: controller(n),
            texts: FieldTexts::default(),
            dialog: None,
            recent: vec![],
            inputs: vec![],
        }
    }

    fn pass(&mut self, events: Vec<Event>) -> Vec<Text> {
        let Panels { window, controller, texts, dialog, recent, inputs } = self;
        let failure = None;
        let acceptances = &[];
        let state = PanelState { controller, acceptances, recent, has_panels: true, failure };
        let drawn = window.run(events, |ui| inputs.extend(show(ui, &state, texts, dialog)));
        for input in std::mem::take(inputs) {
            self.controller.handle(&input);
        }
        drawn
    }

    fn settle(&mut self) -> Vec<Text> {
        (0..8).for_each(|_| drop(self.pass(vec![])));
        self.pass(vec![])
    }

    fn scroll(&mut self, at: Pos2, points: f32) -> Vec<Text> {
        wheel(at, points).into_iter().for_each(|events| drop(self.pass(events)));
        self.settle()
    }

    fn click(&mut self, at: Pos2) -> Vec<Text> {
        click(at).into_iter().for_each(|events| drop(self.pass(events)));
        self.settle()
    }

    fn types(&mut self, text: &str) -> Vec<Text> {
        self.pass(vec![Event::Text(text.to_owned())]);
        let enter = |pressed| Event::Key {
            key: egui::Key::Enter,
            physical_key: None,
            pressed,
            repeat: false,
            modifiers: Default::default(),
        };
        self.pass(vec![enter(true)]);
        self.pass(vec![enter(false)]);
        self.settle()
    }

    /// Returns the texts that are completely visible at some place of the wheel at `at`.
    fn reached(&mut self, at: Pos2) -> BTreeSet<String> {
        let mut seen = BTreeSet::new();
        let mut texts = self.scroll(at, -1e5);
        for _ in 0..30 {
            let visible = texts.iter().filter(|t| is_visible(t, self.window.rect()));
            seen.extend(visible.map(|t| t.text.clone()));
            texts = self.scroll(at, 50.0);
        }
        seen
    }
}

#[test]
fn the_picture_has_two_thirds_of_the_window_and_no_line_is_cut() {
    for (size, scale) in windows() {
        let what = format!("{size:?} at {scale}");
        let px_per_point = crate::viewer::layout::px_per_point(size, scale);
        assert!(has_room_for_panels(size, scale), "{what}");
        let [width, height] = picture_size(size, px_per_point, true).map(f64::from);
        let share = width * height / (f64::from(size[0]) * f64::from(size[1]));
        assert!(share >= 0.66, "{what}: the picture has {share}");
        assert_eq!(picture_size(size, px_per_point, false), size);
        for n in [0, N] {
            let mut panels = Panels::open(size, scale, n);
            key(&mut panels.controller, Key::Tab);
            panels.controller.handle(&Input::Command(Command::MirrorCopy));
            let texts = panels.settle();
            assert_whole_lines(&texts, panels.window.rect(), &what);
            // The panels are where the picture ends.
            let edge = width / px_per_point;
            let title = texts.iter().find(|t| t.text == "particles").expect(&what);
            assert!(f64::from(title.rect.left()) > edge, "{what}: {title:?}");
        }
    }
    for size in [[0, 0], [1, 1], [100, 3]] {
        assert!(picture_size(size, 1.0, true).into_iter().all(|v| v >= 1));
    }
}

#[test]
fn every_control_and_the_last_box_are_reached() {
    for (size, scale) in windows() {
        let what = format!("{size:?} at {scale}");
        let mut panels = Panels::open(size, scale, N);
        key(&mut panels.controller, Key::Tab);
        let rect = panels.window.rect();
        let seen = panels.reached(pos2(rect.right() - 20.0, 60.0));
        for text in ["New", "Save as", "particles", "grid step", "Add", "Undo", "Symmetric", "z"] {
            assert!(seen.contains(text), "{what}: {text}: {seen:?}");
        }
        let in_list = pos2(rect.right() - 20.0, rect.bottom() - STATUS - 20.0);
        let texts = panels.scroll(in_list, 1e6);
        let last = find(&texts, &format!("{}: 1000000 particles", N - 1));
        assert!(is_visible(last, rect), "{what}: {last:?}");
        // The first lines were scrolled away, and return.
        assert!(!texts.iter().any(|t| t.text.starts_with("0: ")), "{what}");
        let texts = panels.scroll(in_list, -1e6);
        assert!(is_visible(find(&texts, "0: 1000000 particles"), rect), "{what}");
    }
}

#[test]
fn the_list_scrolls_to_a_box_that_becomes_active() {
    let mut panels = Panels::open([900, 700], 1.0, N);
    panels.settle();
    for i in [0, 1, N - 1, 250, 249] {
        let select = Select::Boxes { boxes: vec![i], mode: SelectionMode::Replace };
        let event = SessionEvent::Act(Action::Select(select));
        panels.controller.handle(&Input::Event(event));
        let texts = (0..3).fold(vec![], |_, _| panels.settle());
        let row = find(&texts, &format!("{i}: 1000000 particles"));
        assert!(is_visible(row, panels.window.rect()), "{row:?}");
    }
}

#[test]
fn fields_show_the_digits_that_matter_and_edit_all_of_them() {
    let mut panels = Panels::open([900, 640], 1.0, 3);
    key(&mut panels.controller, Key::Tab);
    let before = panels.controller.editor().shared_document();
    let texts = panels.settle();
    for text in ["0.3", "0.33333", "7.39642", "-0.6", "3.33e-8", "1000000"] {
        find(&texts, text);
    }
    assert!(!texts.iter().any(|t| t.text.contains("0000000000")), "{texts:?}");
    // A field with the focus has every digit; leaving it changes nothing.
    let at = find(&texts, "0.3").rect.center();
    let texts = panels.click(at);
    find(&texts, "0.30000000000000004");
    let texts = panels.click(find(&texts, "0.33333").rect.center());
    find(&texts, "0.3333333333333333");
    panels.pass(vec![Event::PointerMoved(pos2(10.0, 10.0))]);
    let texts = panels.click(pos2(10.0, 10.0));
    find(&texts, "0.33333");
    assert!(panels.controller.editor().document().is_same(&before));
    // Typed text replaces the selected digits.
    panels.click(at);
    panels.types("0.7");
    let extent = panels.controller.editor().boxes()[0].extent;
    assert_eq!(extent, DVec3::new(0.7, 1.0 / 3.0, 7.39642));
    assert_eq!(panels.controller.message(), None);
}

#[test]
fn dialogs_and_keys_are_inside_the_window_and_scroll() {
    for (size, scale) in windows() {
        let what = format!("{size:?} at {scale}");
        let mut panels = Panels::open(size, scale, 0);
        let rect = panels.window.rect();
        panels.controller.handle(&Input::Command(Command::Help));
        let seen = panels.reached(rect.center());
        for (title, keys) in key_groups() {
            assert!(seen.contains(title), "{what}: {title}");
            for (key, description) in keys {
                assert!(seen.contains(key) && seen.contains(description), "{what}: {key}");
            }
        }
        assert_whole_lines(&panels.settle(), rect, &what);
        panels.controller.handle(&Input::Command(Command::Help));
        panels.recent = (0..40).map(|i| PathBuf::from(format!("/clouds/{i}.dat"))).collect();
        panels.dialog = Some(FileDialog::new(false, None));
        let texts = panels.settle();
        let fourth = find(&texts, "/clouds/4.dat");
        let seen = panels.reached(fourth.rect.center());
        for text in ["Open", "OK", "Cancel", "/clouds/0.dat", "/clouds/39.dat"] {
            assert!(seen.contains(text), "{what}: {text}: {fourth:?} {seen:?}");
        }
        assert_whole_lines(&panels.settle(), rect, &what);
    }
}

#[test]
fn messages_are_whole_and_an_empty_cloud_says_how_to_begin() {
    let mut panels = Panels::open([640, 480], 1.0, 0);
    let texts = panels.settle();
    assert!(is_visible(find(&texts, FIRST_STEPS), panels.window.rect()));
    let text = "1 furlong".to_owned();
    panels.controller.handle(&Input::Command(Command::Add));
    panels.controller.handle(&Input::Typed { field: Field::Center(Axis::X), text });
    let message = panels.controller.message().expect("a reason").to_owned();
    let texts = panels.settle();
    let shown = find(&texts, &message);
    assert!(!shown.is_cut && is_visible(shown, panels.window.rect()), "{shown:?}");
    assert!(!texts.iter().any(|t| t.text == FIRST_STEPS));
}
