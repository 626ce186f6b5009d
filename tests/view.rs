//! `nimbus view` on a virtual display: frames, keys, mouse, sizes, panels, files that change, and
//! the message where there is no display.

#![cfg(feature = "window")]

#[path = "harness/display.rs"]
mod display;
#[path = "harness/program.rs"]
mod program;

use std::path::{Path, PathBuf};
use std::process::Child;

use display::{Display, wait_for};
use program::nimbus;
use serde_json::Value;

const HELLO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml");

/// Colour behind the panels.
const BACKGROUND: [u8; 3] = [24, 26, 30];

/// Frames after a change of settings until one is timed: the ten of the warm-up, and one more.
const N_UNTIL_TIMED: usize = 11;
/// Greatest share of the window that panels cover: a third, and the rest of whole points.
const MOST_COVERED: f64 = 0.34;
/// Limit of the RMSE by the sprites' cut at 3 sigma. `compare` finds 7e-5 of it in these pictures;
/// wrong light gives far more.
const CUT_ERROR: f64 = 0.02;
/// Least pixels of a box with one line of text. The scene has no pixel of the box's colour.
const ALARM_PIXELS: usize = 500;

/// A running `nimbus view` whose stderr goes to a file.
struct View<'a> {
    display: &'a Display,
    dir: &'a Path,
    child: Child,
    stderr: PathBuf,
}

impl<'a> View<'a> {
    fn start(display: &'a Display, dir: &'a Path, args: &[&str]) -> View<'a> {
        let stderr = dir.join("stderr.txt");
        let options = ["--validation", "--json", "--present", "immediate"];
        let mut command = nimbus(&[&["view"], args, &options].concat());
        command
            .current_dir(dir)
            .envs(display.variables())
            .env("NIMBUS_CACHE_DIR", dir.join("cache"))
            .stderr(std::fs::File::create(&stderr).expect("a file"));
        let child = command.spawn().expect("the program runs");
        View { display, dir, child, stderr }
    }

    /// Waits until the window answers keys. Returns the window.
    fn window(&self) -> String {
        let window = self.display.window_of(self.child.id());
        let n_answers = || self.text().matches("flying speed: ").count();
        let before = n_answers();
        wait_for("answer to a key", || {
            self.display.key("minus");
            n_answers() > before
        });
        window
    }

    fn keys(&self, names: &[&str]) {
        names.iter().for_each(|name| self.display.key(name));
    }

    /// Returns the program's stderr so far.
    fn text(&self) -> String {
        std::fs::read_to_string(&self.stderr).unwrap_or_default()
    }

    fn wait_for_text(&self, text: &str) {
        wait_for(text, || self.text().contains(text));
    }

    /// Waits until at least `n` more frames have been drawn: each count is of another frame.
    fn wait_for_frames(&self, n: usize) {
        let n_counts = || self.text().matches("not finite").count();
        for _ in 0..n {
            let before = n_counts();
            self.display.key("n");
            wait_for("count", || n_counts() > before);
        }
    }

    /// Presses a key that saves a file, and waits for the file. Returns its path.
    fn save(&self, key: &str, name: &str) -> PathBuf {
        let path = self.dir.join(name);
        self.display.key(key);
        // The name is claimed by an empty file.
        wait_for(name, || path.metadata().is_ok_and(|about| about.len() > 0));
        path
    }

    /// Returns the number of pixels of the window with the colour behind the panels.
    fn n_behind_panels(&self, window: &str) -> usize {
        let (.., rgb) = self.display.pixels(window);
        rgb.chunks_exact(3).filter(|p| **p == BACKGROUND).count()
    }

    /// Waits for the program's end. Returns stdout and stderr.
    fn end(mut self) -> (String, String) {
        wait_for("end", || self.child.try_wait().expect("a child").is_some());
        let output = self.child.wait_with_output().expect("its output");
        let text = std::fs::read_to_string(&self.stderr).unwrap_or_default();
        assert!(output.status.success(), "{text}");
        (String::from_utf8_lossy(&output.stdout).into_owned(), text)
    }
}

fn loops(stdout: &str) -> Vec<(String, u64)> {
    let found: Value = serde_json::from_str(stdout).expect("JSON");
    let of = |row: &Value| {
        (row["loop"].as_str().expect("a name").to_owned(), row["n"].as_u64().expect("a number"))
    };
    found["loops"].as_array().expect("loops").iter().map(of).collect()
}

/// Renders a scene without a window. Returns the PNG's bytes.
fn rendered(dir: &Path, scene: &str, args: &[&str]) -> Vec<u8> {
    let path = dir.join("rendered.png");
    let output = path.to_string_lossy();
    let args = [&["render", scene, "-q", "-o", &output], args].concat();
    assert!(nimbus(&args).output().expect("rendered").status.success());
    std::fs::read(path).expect("a picture")
}

#[test]
fn a_window_shows_as_many_frames_as_asked_for() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let args = [HELLO, "--size", "200x150", "--no-panels"];
    let view = View::start(&display, dir.path(), &[&args[..], &["--frames", "120"]].concat());
    let (found, text) = view.end();
    // Ten frames of warm-up are not counted.
    assert_eq!(loops(&found), [("parallel".to_owned(), 110)], "{text}");
    // The keys are listed in the window.
    assert!(!text.contains("close the window") && !text.contains("keys"), "{text}");
    let more = ["--frames", "30", "--no-skip", "-q"];
    let (found, text) = View::start(&display, dir.path(), &[&args[..], &more].concat()).end();
    assert_eq!((loops(&found), text.as_str()), (vec![("parallel".to_owned(), 20)], ""));
}

#[test]
fn the_window_follows_keys_mouse_and_size() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let view = View::start(&display, dir.path(), &[HELLO, "--size", "200x150", "--no-panels"]);
    let window = view.window();
    // Paused at the first frame, the window shows what `render` draws.
    view.keys(&["space", "Home"]);
    let first = std::fs::read(view.save("F12", "captures/hello-view-1.png")).expect("a picture");
    assert!(first == rendered(dir.path(), HELLO, &["--size", "200x150"]), "the same bytes");
    view.keys(&["t", "l", "p", "r", "k", "b", "g", "o", "v", "c", "t", "i"]);
    display.drag(&window, 1, [100, 75], [140, 60]);
    display.drag(&window, 3, [100, 75], [60, 90]);
    let mut n = 1;
    let mut moved = vec![];
    for [width, height] in [[320, 200], [64, 48], [33, 77], [500, 400], [200, 150]] {
        display.resize(&window, [width, height]);
        wait_for("picture of the new size", || {
            n += 1;
            let path = view.save("F12", &format!("captures/hello-view-{n}.png"));
            moved = std::fs::read(&path).expect("a picture");
            image::image_dimensions(&path).expect("a PNG") == (width, height)
        });
    }
    display.key("Escape");
    let (stdout, text) = view.end();
    let path = dir.path().canonicalize().expect("a folder").join("captures/hello-view-1.png");
    let saved = format!("saved {}", path.display());
    for words in ["threads.mode = \"serial\"", "draw.path = \"sprites\"", "skipping is off", &saved]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
    let line = stdout.lines().find(|line| line.starts_with("nimbus render ")).expect("a command");
    assert!(line.contains("--no-skip") && line.contains("--set 'draw.path=\"sprites\"'"), "{line}");
    assert!(moved != first, "the mouse has moved the camera");
}

#[test]
fn a_missing_display_is_reported_with_a_command_that_needs_none() {
    let run = |variables: &[(&str, &str)], args: &[&str]| {
        let mut command = nimbus(args);
        command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").env_remove("DISPLAY");
        command.envs(variables.iter().copied());
        let output = command.output().expect("the program runs");
        assert_eq!(output.status.code(), Some(3));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    for args in [["view", HELLO, "-q"], ["edit", "none.dat", "-q"]] {
        for (variables, why) in [
            (&[][..], "there is no display: neither WAYLAND_DISPLAY nor DISPLAY is set"),
            (&[("DISPLAY", ":6543")], "the display :6543 cannot be opened"),
            (
                &[("DISPLAY", ":6543"), ("WAYLAND_DISPLAY", "wayland-6543")],
                "the Wayland display wayland-6543 cannot be opened",
            ),
        ] {
            let text = run(variables, &args);
            assert!(text.contains(why) && text.contains("nimbus render"), "{text}");
        }
    }
}

#[test]
fn panels_compare_count_and_measure() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let view = View::start(&display, dir.path(), &[HELLO, "--size", "640x480"]);
    view.window();
    view.keys(&["space", "n"]);
    view.wait_for_text("0 not finite");
    // B has the present settings, A has no light; both are compared with the reference.
    view.keys(&["m", "l", "j"]);
    view.wait_for_text("A: RMSE");
    view.wait_for_text("B: RMSE");
    // A changed setting is measured again.
    let n_errors = || view.text().lines().filter(|line| line.starts_with("A: RMSE")).count();
    let before = n_errors();
    display.key("p");
    wait_for("another measurement", || n_errors() > before);
    // Every comparison, and frames of A alone with and without panels.
    for key in ["x", "x", "x"] {
        display.key(key);
        view.wait_for_frames(1);
    }
    for key in ["m", "h", "h"] {
        display.key(key);
        view.wait_for_frames(N_UNTIL_TIMED);
    }
    display.key("Escape");
    let (stdout, text) = view.end();
    let found: Value = serde_json::from_str(&stdout).expect("JSON");
    let rows = found["loops"].as_array().expect("loops");
    let has_row = |panels: bool| rows.iter().any(|row| row["panels"] == panels);
    assert!(has_row(true) && has_row(false), "{found}");
    assert!(found["panels"]["p50"].as_f64().is_some_and(|ms| ms > 0.0), "{found}");
    let error = |name: &str| {
        let line = text.lines().rfind(|line| line.starts_with(&format!("{name}: RMSE ")));
        let value = line.expect("an error").split([' ', ',']).nth(2).expect("a number");
        value.parse::<f64>().expect("a number")
    };
    // The reference is that of A's settings. A is off by the sprites' cut-off, which thin sprites
    // of the reference do not have; B has other light.
    assert!(error("A") < CUT_ERROR && error("B") > 10.0 * error("A"), "{text}");
}

#[test]
fn changed_files_are_read_again_and_errors_keep_the_last_picture() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let copy =
        |from: &str, to: &str| std::fs::copy(root.join(from), dir.path().join(to)).expect("a copy");
    copy("scenes/hello.csv", "hello.csv");
    copy("scenes/hello.toml", "scene.toml");
    std::fs::create_dir(dir.path().join("shaders")).expect("a folder");
    let shaders = dir.path().join("shaders");
    for entry in std::fs::read_dir(root.join("shaders")).expect("shaders") {
        let entry = entry.expect("a file");
        if entry.file_type().expect("a type").is_file() {
            std::fs::copy(entry.path(), shaders.join(entry.file_name())).expect("a copy");
        }
    }
    let options = ["--no-panels", "--shaders", "shaders", "--captures", "shots/of today"];
    let args = [&["scene.toml", "--size", "200x150"][..], &options].concat();
    let view = View::start(&display, dir.path(), &args);
    let window = view.window();
    view.keys(&["space", "Home"]);
    let write =
        |name: &str, text: &str| std::fs::write(dir.path().join(name), text).expect("written");
    let scene = std::fs::read_to_string(dir.path().join("scene.toml")).expect("text");
    write("scene.toml", &scene.replace("width = 320", "width = ]"));
    view.wait_for_text("scene.toml:");
    write("scene.toml", &scene.replace("[film]", "[film]\nexposure = 0.5"));
    view.wait_for_text("scene.toml has changed");
    let present = std::fs::read_to_string(shaders.join("present.frag")).expect("text");
    write("shaders/present.frag", "no shader");
    view.wait_for_text("the last good state stays");
    // A red box shows the error until the shader is right again.
    let n_red = || {
        let (.., rgb) = display.pixels(&window);
        rgb.chunks_exact(3).filter(|p| p[0] > 130 && p[1] < 70 && p[2] < 70).count()
    };
    wait_for("alarm", || n_red() > ALARM_PIXELS);
    // Texts that the compiler would not survive.
    std::fs::create_dir(shaders.join("include")).expect("a folder");
    write("shaders/include/walk.glsl", "#include \"walk.glsl\"\n");
    let include = "\n#extension GL_GOOGLE_include_directive : require\n#include \"walk.glsl\"\n";
    let itself = present.replacen('\n', include, 1);
    for (text, message) in [
        (present.replacen('\n', "\n\0", 1), "it holds a zero byte"),
        (present.clone() + &"\n".repeat(100_000), "lines, the limit is"),
        (present.clone() + &"(".repeat(1000), "brackets within each other"),
        (itself, "more than 64 includes"),
    ] {
        write("shaders/present.frag", &text);
        view.wait_for_text(message);
    }
    std::fs::remove_file(shaders.join("include/walk.glsl")).expect("it was there");
    write("shaders/present.frag", &present);
    wait_for("end of the alarm", || n_red() == 0);
    // The saved scene draws the saved picture.
    let picture = view.save("F12", "shots/of today/scene-view-1.png");
    let picture = std::fs::read(picture).expect("a picture");
    let saved = view.save("F10", "shots/of today/scene-view-1.toml");
    display.key("Escape");
    view.end();
    assert!(picture == rendered(dir.path(), &saved.to_string_lossy(), &[]), "the same bytes");
}

#[test]
fn keys_are_listed_in_the_window_and_panels_keep_to_a_third_at_every_scale() {
    let display = Display::open();
    for (size, scale) in [([640, 480], "1"), ([640, 480], "2"), ([1280, 960], "2")] {
        let dir = tempfile::tempdir().expect("a folder");
        let [width, height] = size;
        let stderr = dir.path().join("stderr.txt");
        let size = format!("{width}x{height}");
        let mut command = nimbus(&["view", HELLO, "--size", &size, "--present", "immediate"]);
        command.current_dir(dir.path()).envs(display.variables());
        command.env("WINIT_X11_SCALE_FACTOR", scale);
        command.stderr(std::fs::File::create(&stderr).expect("a file"));
        let child = command.spawn().expect("the program runs");
        let view = View { display: &display, dir: dir.path(), child, stderr };
        let window = view.window();
        display.key("space");
        let n_pixels = (width * height) as usize;
        let covered = || view.n_behind_panels(&window);
        // Panels cover nearly a third, of which text and graphs leave at least three eighths.
        wait_for("panels", || covered() > n_pixels / 8);
        assert!(covered() as f64 <= MOST_COVERED * n_pixels as f64, "{size} at {scale}");
        display.key("h");
        // Few pixels of the picture have the colour of the panels by chance.
        wait_for("picture without panels", || covered() < n_pixels / 100);
        // The list of keys covers more than a fifth: the middle, where cloud and sky are bright.
        // Without it, the number differs from that before by the frames' noise alone.
        let grey = || {
            let (.., rgb) = display.pixels(&window);
            let is_dark = |p: &[u8]| p.iter().all(|v| *v < 60);
            rgb.chunks_exact(3).filter(|p| is_dark(p)).count()
        };
        let before = grey();
        display.key("question");
        wait_for("list of keys", || grey() > before + n_pixels / 5);
        display.key("Escape");
        wait_for("picture without the list", || grey() < before + n_pixels / 10);
        display.key("Escape");
        view.end();
    }
}

#[test]
fn the_hint_is_shown_for_a_while() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    // Without room for panels the hint is the only widget.
    let view = View::start(&display, dir.path(), &[HELLO, "--size", "320x240"]);
    let window = display.window_of(view.child.id());
    let n_hint = || {
        let (.., rgb) = display.pixels(&window);
        rgb.chunks_exact(3).filter(|p| **p == [34, 38, 46]).count()
    };
    wait_for("hint", || n_hint() > 500);
    wait_for("picture without the hint", || n_hint() < 50);
    view.window();
    display.key("Escape");
    view.end();
}

#[test]
fn a_lost_display_ends_the_window_with_a_message() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let mut view = View::start(&display, dir.path(), &[HELLO, "--size", "200x150"]);
    view.window();
    display.end();
    wait_for("end", || view.child.try_wait().expect("a child").is_some());
    let status = view.child.wait().expect("a status");
    let text = view.text();
    assert_eq!(status.code(), Some(3), "{text}");
    assert!(text.contains("the connection to the display is lost"), "{text}");
}
