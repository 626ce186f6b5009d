//! `nimbus edit` under a virtual display: P's boxes by real keys and mouse, saved as they were
//! typed and drawn by `render` as before; undo, the question about what would be lost, and the
//! picture that a person sees.

#![cfg(feature = "window")]

#[path = "harness/display.rs"]
mod display;
#[path = "harness/program.rs"]
mod program;

use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use display::Display;
use glam::DVec2;
use nimbus::io::box_file;
use nimbus::viewer::edit_panels::picture_of;
use nimbus::viewer::editor::Document;
use nimbus::viewer::editor::scenery::Scenery;
use nimbus::viewer::editor::viewport::Viewport;
use program::nimbus;

struct Window<'a> {
    display: &'a Display,
    id: String,
    child: Child,
}

impl<'a> Window<'a> {
    /// `nimbus edit FILE`, 900 by 640 pixels, with what is kept of a user in `dir`.
    fn open(display: &'a Display, dir: &Path, file: &Path) -> Window<'a> {
        let mut command: Command =
            nimbus(&["edit", &file.to_string_lossy(), "--size", "900x640", "--validation"]);
        command.current_dir(dir).env("DISPLAY", display.name()).env("XDG_CONFIG_HOME", dir);
        let child = command.spawn().expect("the program runs");
        let id = display.window_of(child.id());
        display.focus(&id);
        let window = Window { display, id, child };
        window.wait_for_title(|title| title.contains("| nimbus"));
        window
    }

    fn key(&self, name: &str) {
        self.display.key(name);
    }

    /// Numbers into the active box's fields, from the first on; nothing where a field stays as it
    /// is.
    fn types(&self, fields: &[&str]) {
        self.key("Return");
        std::thread::sleep(Duration::from_millis(300));
        for text in fields {
            if !text.is_empty() {
                self.display.types(text);
            }
            self.key("Tab");
            std::thread::sleep(Duration::from_millis(60));
        }
        self.key("Escape");
        std::thread::sleep(Duration::from_millis(150));
    }

    fn wait_for_title(&self, is_it: impl Fn(&str) -> bool) {
        wait_for("a title", || is_it(&self.display.title(&self.id)));
    }

    /// What it said once it has ended well.
    fn ended(mut self) -> String {
        wait_for("an end", || self.child.try_wait().expect("a child").is_some());
        let output = self.child.wait_with_output().expect("its output");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        said
    }
}

fn wait_for(what: &str, mut is_there: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !is_there() {
        assert!(begin.elapsed() < Duration::from_secs(60), "no {what}");
        std::thread::sleep(Duration::from_millis(30));
    }
}

/// P, Table 2, its first lines as printed.
const PRINTED: [[&str; 8]; 3] = [
    ["200", "7.39642", "1.07048", "2.89284", "-3.4", "-3.3", "-0.600002", "2.1"],
    ["10", "1.12383", "0.893671", "0.750589", "2.8", "-3.1", "-0.4", "2.2"],
    ["5", "1.29472", "0.981624", "1", "1.1", "-3.2", "0", "2"],
];

#[test]
fn boxes_are_made_by_hand_from_an_empty_file() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("new.dat");
    let window = Window::open(&display, dir.path(), &path);
    for [n, ex, ey, ez, x, y, z, radius] in PRINTED {
        window.key("a");
        std::thread::sleep(Duration::from_millis(150));
        // The density follows from the count.
        window.types(&[n, "", ex, ey, ez, x, y, z, radius]);
    }
    window.wait_for_title(|title| title.starts_with('*'));
    window.key("ctrl+s");
    wait_for("a saved file", || path.is_file());
    window.wait_for_title(|title| !title.starts_with('*'));
    let whole = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cubes-554.dat");
    let expected = &box_file::read(&whole).expect("Table 2")[..3];
    assert_eq!(box_file::read(&path).expect("what was saved"), expected);
    // A deletion is something to lose: whoever closes is asked, and may take it back.
    window.key("Delete");
    window.wait_for_title(|title| title.starts_with('*'));
    window.key("ctrl+q");
    std::thread::sleep(Duration::from_millis(500));
    window.key("Escape");
    std::thread::sleep(Duration::from_millis(300));
    window.key("ctrl+z");
    window.wait_for_title(|title| !title.starts_with('*'));
    window.key("ctrl+q");
    assert_eq!(window.ended(), "");
    assert_eq!(box_file::read(&path).expect("what was saved"), expected);
}

/// Pulls the active box, the file's first, by its middle, and takes that back.
fn drags_and_undoes(window: &Window<'_>, path: &Path) {
    let scenery = Scenery::plain().expect("the editor's scene");
    let document = Document::new(box_file::read(path).expect("boxes"));
    let scene = scenery.scene(&document);
    let [width, height] = picture_of([900, 640], 1.0).map(f64::from);
    let view = Viewport {
        pose: scene.camera.pose(0.0).expect("a pose"),
        fov_y_rad: scene.camera.fov_y_rad,
        size_px: DVec2::new(width, height),
        px_per_point: 1.0,
    };
    let at = |i: usize| {
        view.project(document.boxes[i].center).expect("in sight").to_array().map(|v| v as u32)
    };
    // What was typed before a click is for the box that was active then.
    window.key("Return");
    std::thread::sleep(Duration::from_millis(300));
    window.display.types("33");
    window.display.drag(&window.id, 1, at(16), at(16));
    window.wait_for_title(|title| title.starts_with('*'));
    window.key("ctrl+s");
    window.wait_for_title(|title| !title.starts_with('*'));
    let counts: Vec<u32> =
        box_file::read(path).expect("boxes").iter().map(|b| b.n_particles).collect();
    let expected =
        document.boxes.iter().enumerate().map(|(i, b)| if i == 0 { 33 } else { b.n_particles });
    assert_eq!(counts, expected.collect::<Vec<u32>>());
    window.key("ctrl+z");
    window.wait_for_title(|title| title.starts_with('*'));
    window.key("ctrl+s");
    window.wait_for_title(|title| !title.starts_with('*'));
    window.display.drag(&window.id, 1, at(0), at(0));
    let [x, y] = at(0);
    window.display.drag(&window.id, 1, [x, y], [x + 60, y - 50]);
    window.wait_for_title(|title| title.starts_with('*'));
    window.key("ctrl+z");
    window.wait_for_title(|title| !title.starts_with('*'));
}

#[test]
fn a_drag_is_undone_and_what_is_saved_is_drawn_as_before() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let path = dir.path().join("cubes-554.dat");
    std::fs::copy(scenes.join("cubes-554.dat"), &path).expect("a copy");
    std::fs::copy(scenes.join("cubes-554.toml"), dir.path().join("scene.toml")).expect("a copy");
    let draw = |name: &str| {
        let to = dir.path().join(name);
        let size = ["--size", "160x120", "-q", "-o"];
        let scene = dir.path().join("scene.toml");
        let [scene, picture] = [&scene, &to].map(|path| path.to_string_lossy().into_owned());
        let args = [&["render", scene.as_str()][..], &size, &[picture.as_str()]].concat();
        assert!(nimbus(&args).output().expect("rendered").status.success());
        std::fs::read(to).expect("a picture")
    };
    let before = draw("before.png");
    let window = Window::open(&display, dir.path(), &path);
    window.key("Tab");
    std::thread::sleep(Duration::from_millis(400));
    drags_and_undoes(&window, &path);
    assert!(draw("after.png") == before, "the same bytes");
    // Another place is another picture: the comparison can fail.
    window.types(&["", "", "", "", "", "1"]);
    window.wait_for_title(|title| title.starts_with('*'));
    window.key("ctrl+s");
    window.wait_for_title(|title| !title.starts_with('*'));
    assert!(draw("moved.png") != before);
    window.key("ctrl+q");
    assert_eq!(window.ended(), "");
}

/// How far two pictures of a width are apart: the greatest difference of the means of their blocks
/// of 16 by 16 pixels, of any channel, white being 1.
fn apart(a: &[u8], b: &[u8], width: u32) -> f64 {
    let width = width as usize;
    let n_columns = width.div_ceil(BLOCK);
    let mut sums = vec![([0.0; 3], 0.0); n_columns * (a.len() / 3 / width).div_ceil(BLOCK)];
    for (i, (p, q)) in a.chunks_exact(3).zip(b.chunks_exact(3)).enumerate() {
        let (sum, n) = &mut sums[i / width / BLOCK * n_columns + i % width / BLOCK];
        (0..3).for_each(|k| sum[k] += (f64::from(p[k]) - f64::from(q[k])) / 255.0);
        *n += 1.0;
    }
    sums.iter().flat_map(|(sum, n)| sum.map(|s| (s / n).abs())).fold(0.0, f64::max)
}

const BLOCK: usize = 16;
/// A driver may place an edge half a pixel elsewhere: 1/32 of a block, by at most white; three
/// edges meet in a box's corner. A face that is missing fills whole blocks.
const ALIKE: f64 = 3.0 / 32.0;

#[test]
fn the_window_looks_as_it_did() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = dir.path().join("cubes-554.dat");
    std::fs::copy(root.join("scenes/cubes-554.dat"), &path).expect("a copy");
    let window = Window::open(&display, Path::new(dir.path()), Path::new("cubes-554.dat"));
    window.key("Tab");
    for (key, name) in [("1", "edit-boxes.png"), ("3", "edit-both.png")] {
        window.key(key);
        let kept = root.join("docs").join(name);
        let mut last = (0, 0, vec![]);
        if std::env::var_os("NIMBUS_KEEP").is_some() {
            std::thread::sleep(Duration::from_secs(3));
            let (width, height, rgb) = window.display.seen(&window.id);
            image::save_buffer(&kept, &rgb, width, height, image::ColorType::Rgb8).expect("kept");
        }
        let expected = image::open(&kept).expect("the picture that is kept").to_rgb8();
        wait_for(name, || {
            last = window.display.seen(&window.id);
            (last.0, last.1) == expected.dimensions()
                && apart(&last.2, expected.as_raw(), last.0) < ALIKE
        });
        // The red box is what Tab took, and is seen.
        let n_red = last.2.chunks_exact(3).filter(|p| p[0] > 120 && p[1] < 90 && p[2] < 90).count();
        assert!(n_red > 500, "{n_red}");
    }
    // A box less is seen.
    let kept = image::open(root.join("docs/pictures/edit-both.png"))
        .expect("the picture that is kept")
        .to_rgb8();
    window.key("Delete");
    wait_for("a box less", || {
        apart(&window.display.seen(&window.id).2, kept.as_raw(), kept.width()) > 2.0 * ALIKE
    });
    window.key("ctrl+z");
    window.wait_for_title(|title| !title.starts_with('*'));
    window.key("ctrl+q");
    assert_eq!(window.ended(), "");
}
