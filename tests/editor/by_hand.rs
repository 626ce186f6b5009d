//! P, Table 2, made by input alone: pixels, keys, and numbers as printed, from an empty window to a
//! saved file.

use std::path::Path;

use glam::{DVec2, DVec3};
use nimbus::io::box_file;
use nimbus::model::boxes::CloudBox;
use nimbus::model::camera::Pose;
use nimbus::viewer::editor::{
    Axis, Button, Chord, EditorController, Field, Handle, Input, Key, ModifierKeys, PictureArea,
    Request, Session, SessionEvent, perform,
};
use nimbus::viewer::fly_camera::FlyCamera;

const NONE: ModifierKeys = ModifierKeys { ctrl: false, shift: false };
const CTRL: ModifierKeys = ModifierKeys { ctrl: true, ..NONE };

/// A window that carries out every request at once. A dialog returns `path`.
struct Window<'a> {
    controller: EditorController,
    path: &'a Path,
    has_quit: bool,
}

impl Window<'_> {
    fn takes(&mut self, input: Input) {
        let request = self.controller.handle(&input);
        let message = self.controller.message();
        assert_eq!(message.filter(|text| !text.starts_with("saved")), None, "{input:?}");
        let event = match request {
            None => return,
            Some(Request::ChooseToSave) => SessionEvent::ChosenToSave(Some(self.path.to_owned())),
            Some(Request::Quit) => {
                self.has_quit = true;
                return;
            }
            Some(request) => perform(&request).unwrap_or_else(|| panic!("{request:?}")),
        };
        self.takes(Input::Event(event));
    }

    fn key(&mut self, key: char, ctrl: bool) {
        self.takes(Input::Chord(Chord { key: Key::Char(key), ctrl, shift: false, alt: false }));
    }

    fn moves(&mut self, pixel: DVec2, keys: ModifierKeys) {
        self.takes(Input::PointerMoved { pixel, keys });
    }

    fn types(&mut self, field: Field, text: &str) {
        self.takes(Input::Typed { field, text: text.to_owned() });
    }

    fn active(&self) -> CloudBox {
        *self.controller.editor().active_box().unwrap().1
    }

    /// Drags the arrow along an axis until the box's coordinate is about `to`. Ctrl snaps to the
    /// grid of tenths.
    fn pulls(&mut self, axis: Axis, to: f64) {
        let (view, b) = (self.controller.viewport(), self.active());
        let handles = self.controller.editor().handles(&view);
        let arrow = handles.iter().find(|p| p.handle == Handle::MoveAxis(axis)).unwrap();
        let middle = 0.5 * (arrow.from + arrow.to);
        let pixel = |place: DVec3| view.project(place).unwrap().round();
        let (from, to) =
            (pixel(middle), pixel(middle + (to - b.center[axis.index()]) * axis.unit()));
        self.moves(from, NONE);
        assert_eq!(self.controller.feedback().hovered, Some(Handle::MoveAxis(axis)));
        self.takes(Input::Button { button: Button::Left, is_down: true, keys: NONE });
        for share in [0.2, 1.3, 1.0] {
            self.moves((from + share * (to - from)).round(), CTRL);
        }
        self.takes(Input::Button { button: Button::Left, is_down: false, keys: CTRL });
    }

    /// Makes the box of one printed line of the table.
    fn makes(&mut self, fields: &[&str]) {
        self.moves(DVec2::new(430.0, 320.0), NONE);
        self.key('a', false);
        let v = |i: usize| fields[i].parse::<f64>().unwrap();
        self.pulls(Axis::X, v(4).abs());
        self.pulls(Axis::Y, v(5));
        if v(4) < 0.0 {
            // PlacedHandle right of the middle.
            self.key('x', false);
            self.key('m', false);
        }
        for axis in Axis::ALL {
            let k = axis.index();
            self.types(Field::Extent(axis), fields[1 + k]);
            if self.active().center[k] != v(4 + k) {
                self.types(Field::Center(axis), fields[4 + k]);
            }
        }
        self.types(Field::Count, fields[0]);
        self.types(Field::Radius, fields[7]);
    }
}

#[test]
fn boxes_of_the_papers_table_are_made_by_pixels_keys_and_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made.dat");
    let position = DVec3::new(0.0, 0.0, 18.0);
    let pose = Pose { position, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z };
    let fov_y_rad = 45f64.to_radians();
    let area = PictureArea { size_px: DVec2::new(800.0, 600.0), px_per_point: 1.0, fov_y_rad };
    let camera = FlyCamera::new(&pose, DVec3::Y, DVec3::ZERO);
    let controller = EditorController::new(Session::default(), camera, area, 250.0);
    let mut window = Window { controller, path: &path, has_quit: false };

    let table = Path::new("scenes/cubes-554.dat");
    let text = std::fs::read_to_string(table).unwrap();
    const N_LINES: usize = 6;
    for line in text.lines().skip(2).take(N_LINES) {
        window.makes(&line.split(',').map(str::trim).collect::<Vec<_>>());
    }
    window.key('s', true);
    assert_eq!(window.controller.message(), Some(format!("saved {}", path.display()).as_str()));
    let expected = box_file::read(table).unwrap()[..N_LINES].to_vec();
    assert_eq!(box_file::read(&path).unwrap(), expected);
    assert!(!window.controller.session().is_dirty());

    // Every step is undone and redone.
    let steps = window.controller.editor().history().n_undo();
    window.key('z', true);
    assert!(
        window.controller.session().is_dirty()
            && window.controller.editor().history().n_undo() == steps - 1
    );
    for _ in 1..steps {
        window.key('z', true);
    }
    assert!(window.controller.editor().boxes().is_empty());
    for _ in 0..steps {
        window.key('y', true);
    }
    assert!(!window.controller.session().is_dirty());
    window.key('q', true);
    assert!(window.has_quit);
}
