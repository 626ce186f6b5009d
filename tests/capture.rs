//! `--capture`: which frame RenderDoc is asked to capture, and what is said where it can't.
//!
//! `fake_renderdoc/renderdoc.c` is a library with RenderDoc's in-application API that logs calls.

#[cfg(feature = "window")]
#[path = "harness/display.rs"]
mod display;
#[path = "harness/program.rs"]
mod program;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use nimbus::frame::{DeviceChoice, GpuContext};
use nimbus::io::scene_file;
use program::{nimbus, path};
use tempfile::TempDir;

const LOG: &str = "NIMBUS_FAKE_RENDERDOC_LOG";
const FAULT: &str = "NIMBUS_FAKE_RENDERDOC_FAULT";
const FILE: &str = "/tmp/fake_frame.rdc";

/// The fake library, compiled, and the place of its log.
struct RenderDoc {
    dir: TempDir,
    library: PathBuf,
}

impl RenderDoc {
    fn new() -> RenderDoc {
        let dir = tempfile::tempdir().expect("a folder");
        let library = dir.path().join("librenderdoc.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fake_renderdoc/renderdoc.c");
        let mut command = Command::new("cc");
        command.args(["-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]);
        // The name by which nimbus looks for it among the loaded libraries.
        command.args(["-fvisibility=hidden", "-Wl,-soname,librenderdoc.so", "-o"]);
        let output = command.arg(&library).arg(source).output();
        let output = output.expect("`cc`, a C compiler, which tools/bootstrap installs");
        assert!(output.status.success(), "cc: {}", String::from_utf8_lossy(&output.stderr));
        RenderDoc { dir, library }
    }

    fn log(&self) -> String {
        std::fs::read_to_string(self.dir.path().join("log")).unwrap_or_default()
    }

    /// Runs nimbus with the library in its process, as renderdoccmd does.
    fn run(&self, args: &[&str], fault: Option<&str>) -> Output {
        let _ = std::fs::remove_file(self.dir.path().join("log"));
        let mut command = nimbus(args);
        command.env("LD_PRELOAD", &self.library).env(LOG, self.dir.path().join("log"));
        command.envs(fault.map(|fault| (FAULT, fault))).output().expect("the program runs")
    }
}

fn error_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

const SMALL: [&str; 3] = ["scenes/hello.toml", "--size", "32x24"];

#[test]
fn render_and_bench_capture_one_frame_and_say_where_it_is() {
    let renderdoc = RenderDoc::new();
    let picture = path(&renderdoc.dir, "a.png");
    let render = [&["render", "-o", &picture][..], &SMALL, &["--capture"]].concat();
    let short = ["--frames", "3", "--warmup", "1", "--repeat", "1", "--no-check"];
    let bench = [&["bench"][..], &SMALL, &short, &["--threading", "serial"]].concat();
    let bench = [&bench[..], &["--no-skip", "--capture", "3"]].concat();
    for (args, frame) in [(&render, 0), (&bench, 3)] {
        let output = renderdoc.run(args, None);
        let said = error_of(&output);
        assert!(output.status.success(), "{said}");
        assert_eq!(renderdoc.log(), "start\nend\n", "{args:?}");
        assert!(said.contains(&format!("RenderDoc captured frame {frame}: {FILE}")), "{said}");
    }
    // Without the option nothing is captured.
    let plain = [&render[..render.len() - 1], &["--force"]].concat();
    assert!(renderdoc.run(&plain, None).status.success());
    assert_eq!(renderdoc.log(), "");
    // A capture that fails is told, and the picture is there all the same.
    std::fs::remove_file(&picture).expect("the picture");
    let output = renderdoc.run(&[&render[..], &["-q"]].concat(), Some("full"));
    assert!(output.status.success() && Path::new(&picture).exists());
    assert!(error_of(&output).contains("RenderDoc could not capture frame 0"));
    // The bench draws frames 0 to 3.
    let beyond = [&bench[..bench.len() - 1], &["4"]].concat();
    let output = renderdoc.run(&beyond, None);
    let said = error_of(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("--capture 4: the bench draws 4 frames"), "{said}");
    assert!(said.contains("expected a number from 0 to 3"), "{said}");
}

#[cfg(feature = "window")]
#[test]
fn a_window_captures_its_frame() {
    let (renderdoc, display) = (RenderDoc::new(), display::Display::open());
    let view = |frame: &str| {
        let _ = std::fs::remove_file(renderdoc.dir.path().join("log"));
        let options = ["--frames", "12", "--capture", frame, "--present", "immediate"];
        let mut command = nimbus(&[&["view"][..], &SMALL, &options].concat());
        command.envs(display.variables()).env("LD_PRELOAD", &renderdoc.library);
        command.env(LOG, renderdoc.dir.path().join("log"));
        let output = command.output().expect("the program runs");
        assert!(output.status.success(), "{}", error_of(&output));
        error_of(&output)
    };
    let said = view("5");
    assert_eq!(renderdoc.log(), "start\nend\n", "{said}");
    assert_eq!(said.matches(&format!("RenderDoc captured frame 5: {FILE}")).count(), 1, "{said}");
    // A frame that the window did not reach.
    let said = view("500");
    assert_eq!(renderdoc.log(), "");
    assert!(said.contains("frame 500 was not drawn"), "{said}");
}

#[test]
fn without_renderdoc_one_message_says_how_to_start_it() {
    let renderdoc = RenderDoc::new();
    let (picture, out) = (path(&renderdoc.dir, "a.png"), path(&renderdoc.dir, "run"));
    let render = [&["render", "-o", &picture][..], &SMALL, &["--capture"]].concat();
    let bench = [&["bench", "--out", &out][..], &SMALL, &["--capture", "0"]].concat();
    let old = renderdoc.run(&render, Some("old"));
    let outputs = [
        (nimbus(&render).output().expect("it runs"), "renderdoccmd capture"),
        (nimbus(&bench).output().expect("it runs"), "renderdoccmd capture"),
        (old, "lacks version 1.1.2 of its interface"),
    ];
    for (output, text) in outputs {
        let said = error_of(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("--capture: ") && said.contains(text), "{said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    }
    assert!(!Path::new(&picture).exists() && !Path::new(&out).exists());
}

#[test]
fn the_frame_of_that_number_is_captured_from_its_beginning_to_its_end() {
    let renderdoc = RenderDoc::new();
    // SAFETY: no other thread of this process reads or sets variables now: the tests of this file
    // that start programs give them variables of their own.
    unsafe { std::env::set_var(LOG, renderdoc.dir.path().join("log")) };
    // SAFETY: the library's functions do nothing when it is loaded.
    let loaded = unsafe { libloading::Library::new(&renderdoc.library) }.expect("the library");
    let mut choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    choice.options.captured_frame = Some(2);
    let context = GpuContext::open(&choice).expect("a device");
    // "auto" draws frames of a trial, which do not count.
    let set = ["film.width=32", "film.height=24", "draw.impostors=\"auto\""].map(str::to_owned);
    let scene = scene_file::load(Path::new(SMALL[0]), &set, None).expect("a scene").scene;
    let mut player = context.player(scene, true).expect("the scene fits");
    for i_frame in 0..4 {
        let packet = player.game.step(i_frame).expect("a packet");
        let pending = player.renderer.begin(packet).expect("a frame");
        let begun = if i_frame < 2 { "" } else { "start\n" };
        assert!(renderdoc.log().starts_with(begun) && i_frame >= 2 || renderdoc.log().is_empty());
        assert_eq!(renderdoc.log().contains("end"), i_frame > 2, "{i_frame}");
        pending.wait().expect("a frame");
        player.renderer.end().expect("a frame");
        let ended = if i_frame < 2 { "" } else { "start\nend\n" };
        assert_eq!(renderdoc.log(), ended, "{i_frame}");
        assert_eq!(context.device.captured().is_some(), i_frame >= 2);
    }
    let captured = context.device.captured().expect("a capture");
    assert_eq!((captured.frame, captured.is_done), (2, true));
    assert_eq!(captured.file.as_deref(), Some(FILE));
    drop(player);
    context.close().expect("no validation messages");
    drop(loaded);
}
