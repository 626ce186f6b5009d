//! `nimbus edit` on a virtual display, by keys and mouse: P's boxes from an empty file, undo, the
//! question about unsaved changes, and the picture.

#![cfg(feature = "window")]

use std::path::Path;
use std::process::{Child, Command};

use crate::display::{Display, wait_for};
use crate::program::nimbus;
use glam::DVec2;
use nimbus::io::box_file;
use nimbus::viewer::edit_window::picture_size;
use nimbus::viewer::editor::{Document, EditedScene, Viewport};

/// A running `nimbus edit`.
struct Window<'a> {
    display: &'a Display,
    id: String,
    child: Child,
}

impl<'a> Window<'a> {
    /// Opens `file` in a window of 900 × 640 pixels, and waits until it answers keys. The user's
    /// configuration is in `dir`.
    fn open(display: &'a Display, dir: &Path, file: &Path) -> Window<'a> {
        let mut command: Command =
            nimbus(&["edit", &file.to_string_lossy(), "--size", "900x640", "--validation"]);
        command.current_dir(dir).envs(display.variables()).env("XDG_CONFIG_HOME", dir);
        let child = command.spawn().expect("the program runs");
        let id = display.window_of(child.id());
        let window = Window { display, id, child };
        window.wait_for_title(|title| title.contains("| nimbus"));
        if box_file::read(&dir.join(file)).is_err() {
            // A change makes the title begin with a star.
            window.press_until("a", || window.is_dirty());
            window.press_until("ctrl+z", || !window.is_dirty());
        } else {
            // Selecting leaves no trace in the history, which the buttons show.
            window.press_until("Tab", || window.has_red_box());
            window.press_until("Escape", || !window.has_red_box());
        }
        window
    }

    /// Presses a key again and again until `condition` holds: a window may miss the first ones.
    fn press_until(&self, key: &str, condition: impl Fn() -> bool) {
        wait_for("answer to a key", || {
            self.key(key);
            condition()
        });
    }

    /// Returns whether the active box, which is red, is in the picture.
    fn has_red_box(&self) -> bool {
        n_red(&self.display.pixels(&self.id).2) > 500
    }

    fn key(&self, name: &str) {
        self.display.key(name);
    }

    /// Types numbers into the active box's fields, from the first on. An empty text leaves a field
    /// as it is.
    fn types(&self, fields: &[&str]) {
        self.key("Return");
        for text in fields {
            if !text.is_empty() {
                self.display.types(text);
            }
            self.key("Tab");
        }
        self.key("Escape");
    }

    fn title(&self) -> String {
        self.display.title(&self.id)
    }

    fn is_dirty(&self) -> bool {
        self.title().starts_with('*')
    }

    fn wait_for_title(&self, condition: impl Fn(&str) -> bool) {
        wait_for("title", || condition(&self.title()));
    }

    fn wait_for_dirty(&self, is_dirty: bool) {
        wait_for("title", || self.is_dirty() == is_dirty);
    }

    fn save(&self) {
        self.key("ctrl+s");
        self.wait_for_dirty(false);
    }

    /// Waits for the program's end. Returns its stderr.
    fn end(mut self) -> String {
        wait_for("end", || self.child.try_wait().expect("a child").is_some());
        let output = self.child.wait_with_output().expect("its output");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{text}");
        text
    }
}

fn n_red(rgb: &[u8]) -> usize {
    rgb.chunks_exact(3).filter(|p| p[0] > 120 && p[1] < 90 && p[2] < 90).count()
}

/// The first lines of P, Table 2, as printed.
const PRINTED: [[&str; 8]; 3] = [
    ["200", "7.39642", "1.07048", "2.89284", "-3.4", "-3.3", "-0.600002", "2.1"],
    ["10", "1.12383", "0.893671", "0.750589", "2.8", "-3.1", "-0.4", "2.2"],
    ["5", "1.29472", "0.981624", "1", "1.1", "-3.2", "0", "2"],
];

#[test]
fn boxes_are_made_by_keys_and_numbers_from_an_empty_file() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("new.dat");
    let window = Window::open(&display, dir.path(), &path);
    for [n, ex, ey, ez, x, y, z, radius] in PRINTED {
        window.key("a");
        // The density follows from the count.
        window.types(&[n, "", ex, ey, ez, x, y, z, radius]);
    }
    window.wait_for_dirty(true);
    window.save();
    let whole = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cubes-554.dat");
    let expected = &box_file::read(&whole).expect("Table 2")[..3];
    assert_eq!(box_file::read(&path).expect("what was saved"), expected);
    // With a deletion unsaved, quitting asks first. The question is cancelled.
    window.key("Delete");
    window.wait_for_dirty(true);
    window.key("ctrl+q");
    window.key("Escape");
    window.key("ctrl+z");
    window.wait_for_dirty(false);
    window.key("ctrl+q");
    assert_eq!(window.end(), "");
    assert_eq!(box_file::read(&path).expect("what was saved"), expected);
}

/// Types a number, and drags the active box, which is the file's first. Undoes both.
fn drags_and_undoes(window: &Window<'_>, path: &Path) {
    let edited = EditedScene::default_scene().expect("the editor's scene");
    let document = Document::new(box_file::read(path).expect("boxes"));
    let scene = edited.scene(&document);
    let [width, height] = picture_size([900, 640], 1.0, true).map(f64::from);
    let view = Viewport {
        pose: scene.camera.pose(0.0).expect("a pose"),
        fov_y_rad: scene.camera.fov_y_rad,
        size_px: DVec2::new(width, height),
        px_per_point: 1.0,
    };
    let at = |i: usize| {
        view.project(document.boxes[i].center).expect("in sight").to_array().map(|v| v as u32)
    };
    // Text typed before a click belongs to the box that was active before.
    window.key("Return");
    window.display.types("33");
    window.display.drag(&window.id, 1, at(16), at(16));
    window.wait_for_dirty(true);
    window.save();
    let counts: Vec<u32> =
        box_file::read(path).expect("boxes").iter().map(|b| b.n_particles).collect();
    let expected =
        document.boxes.iter().enumerate().map(|(i, b)| if i == 0 { 33 } else { b.n_particles });
    assert_eq!(counts, expected.collect::<Vec<u32>>());
    window.key("ctrl+z");
    window.wait_for_dirty(true);
    window.save();
    window.display.drag(&window.id, 1, at(0), at(0));
    let [x, y] = at(0);
    window.display.drag(&window.id, 1, [x, y], [x + 60, y - 50]);
    window.wait_for_dirty(true);
    window.key("ctrl+z");
    window.wait_for_dirty(false);
}

#[test]
fn an_undone_drag_leaves_the_saved_cloud_as_it_was() {
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
    drags_and_undoes(&window, &path);
    assert!(draw("after.png") == before, "the same bytes");
    // A moved box draws another picture, so the comparison can fail.
    window.types(&["", "", "", "", "", "1"]);
    window.wait_for_dirty(true);
    window.save();
    assert!(draw("moved.png") != before);
    window.key("ctrl+q");
    assert_eq!(window.end(), "");
}

/// Returns the greatest difference between the means of blocks of 16 × 16 pixels, in any channel;
/// white is 1.
fn difference(a: &[u8], b: &[u8], width: u32) -> f64 {
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
/// Largest difference of equal pictures. A driver may place an edge half a pixel elsewhere, which
/// is 1/32 of a block, and three edges meet in a box's corner. A missing face fills whole blocks.
const MAX_DIFFERENCE: f64 = 3.0 / 32.0;

#[test]
fn the_window_looks_as_in_the_documentation() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = dir.path().join("cubes-554.dat");
    std::fs::copy(root.join("scenes/cubes-554.dat"), &path).expect("a copy");
    let window = Window::open(&display, Path::new(dir.path()), Path::new("cubes-554.dat"));
    window.key("Tab");
    for (key, name) in [("1", "edit-boxes.png"), ("3", "edit-both.png")] {
        window.key(key);
        let kept = root.join("docs/pictures").join(name);
        let mut last = (0, 0, vec![]);
        if std::env::var_os("NIMBUS_KEEP").is_some() {
            std::thread::sleep(std::time::Duration::from_secs(3));
            let (width, height, rgb) = window.display.pixels(&window.id);
            image::save_buffer(&kept, &rgb, width, height, image::ColorType::Rgb8).expect("kept");
        }
        let expected = image::open(&kept).expect("the documented picture").to_rgb8();
        wait_for(name, || {
            last = window.display.pixels(&window.id);
            (last.0, last.1) == expected.dimensions()
                && difference(&last.2, expected.as_raw(), last.0) < MAX_DIFFERENCE
        });
        // The active box is red.
        assert!(n_red(&last.2) > 500);
    }
    // A box less is seen.
    let kept = image::open(root.join("docs/pictures/edit-both.png"))
        .expect("the picture that is kept")
        .to_rgb8();
    window.key("Delete");
    wait_for("picture without the box", || {
        difference(&window.display.pixels(&window.id).2, kept.as_raw(), kept.width())
            > 2.0 * MAX_DIFFERENCE
    });
    window.key("ctrl+z");
    window.wait_for_dirty(false);
    window.key("ctrl+q");
    assert_eq!(window.end(), "");
}

#[test]
fn unsaved_changes_survive_a_lost_display() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("cloud.dat");
    let mut window = Window::open(&display, dir.path(), &path);
    window.key("a");
    window.wait_for_dirty(true);
    display.end();
    wait_for("end", || window.child.try_wait().expect("a child").is_some());
    let output = window.child.wait_with_output().expect("its output");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{text}");
    let kept = path.with_extension("unsaved-1.dat");
    assert!(
        text.contains(&format!("unsaved changes were written to {}", kept.display())),
        "{text}"
    );
    assert_eq!(box_file::read(&kept).expect("the changes").len(), 1);
    assert!(!path.exists());
}

#[test]
fn a_saved_file_that_was_not_edited_keeps_its_bytes() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("cloud.dat");
    let written = "12\n\n2\n4, 1.0, 2.50, 3, 0.30000000000000004, 6.12438e-007, 0, 2\n\
        8,1,1,1,  0,0,-5,2\n";
    std::fs::write(&path, written).expect("a file");
    let window = Window::open(&display, dir.path(), &path);
    window.key("Tab");
    // Fields that are visited, and left as they are.
    window.types(&["", "", "", "", "", "", "", "", ""]);
    window.key("Tab");
    window.types(&["9"]);
    window.wait_for_dirty(true);
    window.save();
    let text = std::fs::read_to_string(&path).expect("text");
    let line = written.lines().nth(3).expect("the first box");
    assert_eq!(text, format!("13\n2\n{line}\n9, 1, 1, 1, 0, 0, -5, 2\n"));
    // Without panels the picture's background reaches the window's last corner.
    window.key("h");
    let has_sky = || {
        let (width, height, rgb) = display.pixels(&window.id);
        let at = 3 * ((height - 4) * width + width - 4) as usize;
        let [red, _, blue] = [rgb[at], rgb[at + 1], rgb[at + 2]];
        blue > 100 && blue > red
    };
    wait_for("a picture of the whole window", has_sky);
    window.key("h");
    wait_for("panels", || !has_sky());
    window.key("ctrl+q");
    assert_eq!(window.end(), "");
}
