//! `nimbus view` under a virtual display: it opens, draws, hears keys and mouse, is resized, and
//! closes; and says what is missing where it cannot.

#![cfg(feature = "window")]

#[path = "harness/display.rs"]
mod display;
#[path = "harness/program.rs"]
mod program;

use std::process::{Child, Command};
use std::time::{Duration, Instant};

use display::Display;
use program::nimbus;
use serde_json::Value;

/// `nimbus view` of a small scene on `display`, in `dir`.
fn view(display: &Display, dir: &std::path::Path, more: &[&str]) -> Child {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml");
    let args = [
        &[
            "view",
            scene,
            "--size",
            "200x150",
            "--validation",
            "--json",
            "--present",
            "immediate",
            "--no-panels",
        ],
        more,
    ]
    .concat();
    let mut command: Command = nimbus(&args);
    command.current_dir(dir).env("DISPLAY", display.name()).spawn().expect("the program runs")
}

/// What it printed and what it said once it has ended, within a minute.
fn ended(mut child: Child) -> (String, String) {
    let begin = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        assert!(begin.elapsed() < Duration::from_secs(60), "the window does not close");
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().expect("its output");
    let [printed, said] =
        [output.stdout, output.stderr].map(|b| String::from_utf8_lossy(&b).into_owned());
    assert!(output.status.success(), "{said}");
    (printed, said)
}

fn loops(printed: &str) -> Vec<(String, u64)> {
    let found: Value = serde_json::from_str(printed).expect("JSON");
    let of = |row: &Value| {
        (row["loop"].as_str().expect("a name").to_owned(), row["n"].as_u64().expect("a number"))
    };
    found["loops"].as_array().expect("loops").iter().map(of).collect()
}

#[test]
fn a_window_shows_as_many_frames_as_asked_for() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let (found, said) = ended(view(&display, dir.path(), &["--frames", "120"]));
    // The ten after a beginning are not counted.
    assert_eq!(loops(&found), [("parallel".to_owned(), 110)], "{said}");
    assert!(said.contains("keys:") && said.contains("close the window"), "{said}");
    let (found, said) = ended(view(&display, dir.path(), &["--frames", "30", "--no-skip", "-q"]));
    assert_eq!((loops(&found), said.as_str()), (vec![("parallel".to_owned(), 20)], ""));
}

#[test]
fn keys_and_mouse_and_sizes_are_heard() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let child = view(&display, dir.path(), &[]);
    let window = display.window_of(child.id());
    display.focus(&window);
    // Paused at the first frame; what is kept is what `render` draws.
    for key in ["space", "Home", "F12"] {
        display.key(key);
    }
    let kept = dir.path().join("view-1.png");
    wait_for("a kept picture", || kept.is_file());
    let drawn = dir.path().join("drawn.png");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml");
    let rendered =
        nimbus(&["render", scene, "--size", "200x150", "-q", "-o", &drawn.to_string_lossy()])
            .output();
    assert!(rendered.expect("rendered").status.success());
    assert!(
        std::fs::read(&kept).expect("kept") == std::fs::read(&drawn).expect("drawn"),
        "the same bytes"
    );
    // Every knob, on and on; the mouse turns and goes around; sizes change under way.
    for key in ["t", "l", "p", "r", "k", "b", "g", "o", "v", "c", "t", "i"] {
        display.key(key);
    }
    display.drag(&window, 1, [100, 75], [140, 60]);
    display.drag(&window, 3, [100, 75], [60, 90]);
    for size in [[320, 200], [64, 48], [33, 77], [500, 400], [200, 150]] {
        display.resize(&window, size);
        std::thread::sleep(Duration::from_millis(120));
    }
    display.key("F12");
    let moved = dir.path().join("view-2.png");
    wait_for("another", || moved.is_file());
    display.key("Escape");
    let (printed, said) = ended(child);
    for words in [
        "threads.mode = \"serial\"",
        "draw.path = \"sprites\"",
        "skipping is off",
        "kept view-1.png",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    // The command that draws what was seen does.
    let line = printed.lines().find(|line| line.starts_with("nimbus render ")).expect("a command");
    assert!(line.contains("--no-skip") && line.contains("--set 'draw.path=\"sprites\"'"), "{line}");
    assert!(
        std::fs::read(&moved).expect("kept") != std::fs::read(&drawn).expect("drawn"),
        "the eye has moved"
    );
}

fn wait_for(what: &str, is_there: impl Fn() -> bool) {
    let begin = Instant::now();
    while !is_there() {
        assert!(begin.elapsed() < Duration::from_secs(60), "no {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn without_a_display_it_says_what_is_missing_and_what_needs_none() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml");
    let run = |display: Option<&str>, args: &[&str]| {
        let mut command = nimbus(args);
        command.env_remove("WAYLAND_DISPLAY").env_remove("DISPLAY");
        if let Some(display) = display {
            command.env("DISPLAY", display);
        }
        let output = command.output().expect("the program runs");
        assert_eq!(output.status.code(), Some(3));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    for args in [["view", scene, "-q"], ["edit", "none.dat", "-q"]] {
        let said = run(None, &args);
        assert!(
            said.contains("there is no display: DISPLAY is not set")
                && said.contains("nimbus render"),
            "{said}"
        );
        let said = run(Some(":6543"), &args);
        assert!(
            said.contains("the display :6543 cannot be opened") && said.contains("nimbus render"),
            "{said}"
        );
    }
}

/// What a child says goes to a file, which is read while it runs.
fn view_telling(
    display: &Display,
    dir: &std::path::Path,
    args: &[&str],
) -> (Child, impl Fn() -> String + use<>) {
    let path = dir.join("said.txt");
    let mut command: Command =
        nimbus(&[&["view"], args, &["--validation", "--json", "--present", "immediate"]].concat());
    command
        .current_dir(dir)
        .env("DISPLAY", display.name())
        .env("NIMBUS_CACHE_DIR", dir.join("cache"));
    command.stderr(std::fs::File::create(&path).expect("a file"));
    let child = command.spawn().expect("the program runs");
    (child, move || std::fs::read_to_string(&path).unwrap_or_default())
}

#[test]
fn panels_compare_count_and_measure() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml");
    let (child, said) = view_telling(&display, dir.path(), &[scene, "--size", "400x300"]);
    let window = display.window_of(child.id());
    display.focus(&window);
    display.key("space");
    display.key("n");
    wait_for("counts", || said().contains("0 not finite"));
    // B is what is set now, A goes without light: how far each is from the truth.
    display.key("m");
    display.key("l");
    display.key("j");
    wait_for("A's error", || said().contains("A: RMSE"));
    wait_for("B's error", || said().contains("B: RMSE"));
    // What is turned is measured anew.
    let n_said = || said().lines().filter(|line| line.starts_with("A: RMSE")).count();
    let before = n_said();
    display.key("p");
    wait_for("another measurement", || n_said() > before);
    for key in ["x", "x", "x", "m", "h", "h"] {
        display.key(key);
        std::thread::sleep(Duration::from_millis(250));
    }
    display.key("Escape");
    let output = child.wait_with_output().expect("its output");
    assert!(output.status.success(), "{}", said());
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let rows = found["loops"].as_array().expect("loops");
    assert!(
        rows.iter().any(|row| row["panels"] == true)
            && rows.iter().any(|row| row["panels"] == false),
        "{found}"
    );
    assert!(found["panels"]["p50"].as_f64().is_some_and(|ms| ms > 0.0), "{found}");
    // The truth is that of what is set, and B has other light.
    let text = said();
    let error = |name: &str| {
        let line = text
            .lines()
            .rfind(|line| line.starts_with(&format!("{name}: RMSE ")))
            .expect("an error");
        line.split([' ', ',']).nth(2).expect("a number").parse::<f64>().expect("a number")
    };
    // A's is what sprites' cut-off leaves out: thin sprites of the reference have none.
    assert!(error("A") < 0.02 && error("B") > 10.0 * error("A"), "{text}");
}

#[test]
fn files_that_change_are_read_again_and_what_is_wrong_leaves_the_picture() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
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
    let (child, said) = view_telling(
        &display,
        dir.path(),
        &["scene.toml", "--size", "200x150", "--no-panels", "--shaders", "shaders"],
    );
    let window = display.window_of(child.id());
    display.focus(&window);
    display.key("space");
    display.key("Home");
    let write =
        |name: &str, text: &str| std::fs::write(dir.path().join(name), text).expect("written");
    let scene = std::fs::read_to_string(dir.path().join("scene.toml")).expect("text");
    write("scene.toml", &scene.replace("width = 320", "width = ]"));
    wait_for("an error", || said().contains("scene.toml:"));
    write("scene.toml", &scene.replace("[film]", "[film]\nexposure = 0.5"));
    wait_for("the scene again", || said().contains("scene.toml has changed"));
    let present = std::fs::read_to_string(shaders.join("present.frag")).expect("text");
    write("shaders/present.frag", "no shader");
    wait_for("a shader's error", || said().contains("back to what was"));
    // It stands over the picture, and goes when all is well again.
    let n_red = || {
        let (.., rgb) = display.seen(&window);
        rgb.chunks_exact(3).filter(|p| p[0] > 130 && p[1] < 70 && p[2] < 70).count()
    };
    wait_for("an alarm", || n_red() > 500);
    write("shaders/present.frag", &present);
    wait_for("no alarm", || n_red() == 0);
    // What is saved as a scene is drawn as what is kept as a picture.
    for (key, name) in [("F12", "view-1.png"), ("F10", "scene-view-1.toml")] {
        display.key(key);
        wait_for(name, || dir.path().join(name).is_file());
    }
    display.key("Escape");
    let output = child.wait_with_output().expect("its output");
    assert!(output.status.success(), "{}", said());
    let drawn = dir.path().join("drawn.png");
    let saved = dir.path().join("scene-view-1.toml");
    let rendered =
        nimbus(&["render", &saved.to_string_lossy(), "-q", "-o", &drawn.to_string_lossy()])
            .output();
    assert!(rendered.expect("rendered").status.success());
    let kept = std::fs::read(dir.path().join("view-1.png")).expect("kept");
    assert!(kept == std::fs::read(&drawn).expect("drawn"), "the same bytes");
}
