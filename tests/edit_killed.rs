//! Kills `nimbus edit` while it saves: the box file is then the old one or the new one, whole.

#![cfg(feature = "window")]

#[path = "harness/display.rs"]
mod display;
#[path = "harness/program.rs"]
mod program;

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use display::{Display, wait_for};
use nimbus::io::box_file;
use program::nimbus;

/// Times between the key that saves and SIGKILL, in milliseconds: from before the editor has the key
/// to after its save.
const DELAYS_MS: [u64; 5] = [0, 5, 20, 60, 200];

/// Starts the editor, under strace if options for it are given. Returns the child, the process that
/// is the editor, and its window.
fn open(display: &Display, file: &Path, strace: Option<&[&str]>) -> (Child, u32, String) {
    let dir = file.parent().expect("a folder");
    let plain = nimbus(&["edit", &file.to_string_lossy(), "--size", "640x480"]);
    let mut command = match strace {
        None => plain,
        Some(options) => {
            let mut command = Command::new("strace");
            command.args(["-f", "-o"]).arg(dir.join("trace.log")).args(options).arg("--");
            command.arg(plain.get_program()).args(plain.get_args());
            command
        }
    };
    command.env("DISPLAY", display.name()).env("XDG_CONFIG_HOME", dir);
    let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    let mut pid = child.id();
    if strace.is_some() {
        let children = format!("/proc/{pid}/task/{pid}/children");
        wait_for("editor", || {
            let text = fs::read_to_string(&children).unwrap_or_default();
            text.split_whitespace().next().and_then(|id| id.parse().ok()).is_some_and(|id| {
                pid = id;
                true
            })
        });
    }
    let window = display.window_of(pid);
    wait_for("title", || display.title(&window).contains("| nimbus"));
    // A window may miss the first keys.
    wait_for("new box", || {
        display.key("a");
        display.title(&window).starts_with('*')
    });
    (child, pid, window)
}

/// Returns whether the file has its old bytes.
fn is_old(file: &Path, old: &[u8]) -> bool {
    let found = fs::read(file).expect("the file is there");
    let n_old = box_file::parse(&String::from_utf8_lossy(old), file).expect("boxes").len();
    let text = String::from_utf8(found.clone()).expect("text");
    let boxes = box_file::parse(&text, file).unwrap_or_else(|e| panic!("neither old nor new: {e}"));
    assert!(found == old || boxes.len() > n_old, "neither old nor new:\n{text}");
    found == old
}

#[test]
fn a_killed_editor_leaves_the_old_or_the_new_file() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let file = dir.path().join("boxes.dat");
    fs::copy("scenes/cubes-554.dat", &file).expect("a box file");
    let old = fs::read(&file).expect("its bytes");
    let display = Display::open();

    // At the call that puts the new file into its place.
    let name = file.display().to_string();
    let options =
        ["-P", &name, "-e", "trace=rename,renameat,renameat2", "-e", "inject=all:signal=KILL"];
    let (mut child, _, _) = open(&display, &file, Some(&options));
    display.key("ctrl+s");
    let status = child.wait().expect("it ends");
    let log = fs::read_to_string(dir.path().join("trace.log")).expect("the log");
    assert!(log.contains("boxes.dat") && log.contains("killed by SIGKILL"), "{status}: {log}");
    assert!(is_old(&file, &old), "the call was not reached");

    // At any time after the key.
    let mut n_old = 0;
    for delay_ms in DELAYS_MS {
        fs::write(&file, &old).expect("the old file");
        let (mut child, pid, _) = open(&display, &file, None);
        display.key("ctrl+s");
        std::thread::sleep(Duration::from_millis(delay_ms));
        assert!(
            Command::new("kill").args(["-9", &pid.to_string()]).status().expect("kill").success()
        );
        assert_eq!(child.wait().expect("it ends").signal(), Some(9));
        n_old += usize::from(is_old(&file, &old));
    }
    println!("{n_old} of {} files are the old ones", DELAYS_MS.len());

    // Files of killed editors are in nobody's way.
    let (mut child, _, window) = open(&display, &file, None);
    display.key("ctrl+s");
    wait_for("saved file", || !display.title(&window).starts_with('*'));
    assert!(!is_old(&file, &old));
    child.kill().expect("it ends");
    child.wait().expect("it ends");
}
