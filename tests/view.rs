//! `nimbus view` under a virtual display: it opens, draws, hears keys and mouse, is resized, and closes; and says what is missing
//! where it cannot.

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
    let args =
        [&["view", scene, "--size", "200x150", "--validation", "--json", "--present", "immediate"], more].concat();
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
    let [printed, said] = [output.stdout, output.stderr].map(|b| String::from_utf8_lossy(&b).into_owned());
    assert!(output.status.success(), "{said}");
    (printed, said)
}

fn loops(printed: &str) -> Vec<(String, u64)> {
    let found: Value = serde_json::from_str(printed).expect("JSON");
    let of = |row: &Value| (row["loop"].as_str().expect("a name").to_owned(), row["n"].as_u64().expect("a number"));
    found["loops"].as_array().expect("loops").iter().map(of).collect()
}

#[test]
fn a_window_shows_as_many_frames_as_asked_for() {
    let display = Display::open();
    let dir = tempfile::tempdir().expect("a folder");
    let (found, said) = ended(view(&display, dir.path(), &["--frames", "120"]));
    // Those after a beginning are not counted.
    assert_eq!(loops(&found), [("parallel".to_owned(), 117)], "{said}");
    assert!(said.contains("keys:") && said.contains("close the window"), "{said}");
    let (found, said) = ended(view(&display, dir.path(), &["--frames", "30", "--no-skip", "-q"]));
    assert_eq!((loops(&found), said.as_str()), (vec![("parallel".to_owned(), 27)], ""));
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
    let rendered = nimbus(&["render", scene, "--size", "200x150", "-q", "-o", &drawn.to_string_lossy()]).output();
    assert!(rendered.expect("rendered").status.success());
    assert!(std::fs::read(&kept).expect("kept") == std::fs::read(&drawn).expect("drawn"), "the same bytes");
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
    for words in ["threads.mode = \"serial\"", "draw.path = \"sprites\"", "skipping is off", "kept view-1.png"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    // The command that draws what was seen does.
    let line = printed.lines().find(|line| line.starts_with("nimbus render ")).expect("a command");
    assert!(line.contains("--no-skip") && line.contains("--set 'draw.path=\"sprites\"'"), "{line}");
    assert!(std::fs::read(&moved).expect("kept") != std::fs::read(&drawn).expect("drawn"), "the eye has moved");
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
    let run = |display: Option<&str>| {
        let mut command = nimbus(&["view", scene, "-q"]);
        command.env_remove("WAYLAND_DISPLAY").env_remove("DISPLAY");
        if let Some(display) = display {
            command.env("DISPLAY", display);
        }
        let output = command.output().expect("the program runs");
        assert_eq!(output.status.code(), Some(3));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let said = run(None);
    assert!(said.contains("there is no display: DISPLAY is not set") && said.contains("nimbus render"), "{said}");
    let said = run(Some(":6543"));
    assert!(said.contains("the display :6543 cannot be opened") && said.contains("nimbus render"), "{said}");
}
