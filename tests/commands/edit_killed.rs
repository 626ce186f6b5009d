//! Kills `nimbus edit` while it saves: the box file is then the old one or the new one, whole.
//! Interrupts `nimbus view` and `nimbus edit`, which close their windows.

#![cfg(feature = "window")]

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::display::{Display, wait_for};
use crate::program::nimbus;
use nimbus::io::box_file;

/// Times between the key that saves and SIGKILL, in milliseconds: from before the editor has the
/// key to after its save.
const DELAYS_MS: [u64; 8] = [0, 5, 10, 20, 40, 80, 160, 320];

/// Starts the editor, and adds a box. Returns the editor and its window.
fn open(display: &Display, file: &Path) -> (Child, String) {
    let mut command = nimbus(&["edit", &file.to_string_lossy(), "--size", "640x480"]);
    command.envs(display.variables()).env("XDG_CONFIG_HOME", file.parent().expect("a folder"));
    let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    let window = display.window_of(child.id());
    wait_for("title", || display.title(&window).contains("| nimbus"));
    // A window may miss the first keys.
    wait_for("new box", || {
        display.key("a");
        display.title(&window).starts_with('*')
    });
    (child, window)
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

    let mut n_old = 0;
    for delay_ms in DELAYS_MS {
        fs::write(&file, &old).expect("the old file");
        let (mut child, _) = open(&display, &file);
        display.key("ctrl+s");
        std::thread::sleep(Duration::from_millis(delay_ms));
        child.kill().expect("it is running");
        assert_eq!(child.wait().expect("it ends").signal(), Some(9));
        n_old += usize::from(is_old(&file, &old));
    }
    println!("{n_old} of {} files are the old ones", DELAYS_MS.len());

    // Files of killed editors are in nobody's way.
    let (mut child, window) = open(&display, &file);
    display.key("ctrl+s");
    wait_for("saved file", || !display.title(&window).starts_with('*'));
    assert!(!is_old(&file, &old));
    child.kill().expect("it ends");
    child.wait().expect("it ends");
}

#[test]
fn ctrl_c_closes_a_window_and_says_so() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let display = Display::open();
    let file = dir.path().join("new.dat");
    for (args, says) in [
        (["view", "scenes/hello.toml"], "interrupted: closes the window; once more ends at once"),
        (
            ["edit", &file.to_string_lossy()],
            "interrupted: keeps unsaved changes in a file and closes the window; once more",
        ),
    ] {
        let mut command = nimbus(&[&args[..], &["--size", "320x240"]].concat());
        command.envs(display.variables()).env("XDG_CONFIG_HOME", dir.path());
        let child = command.spawn().expect("it starts");
        let window = display.window_of(child.id());
        wait_for("title", || !display.title(&window).is_empty());
        let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(killed.expect("kill").success());
        let output = child.wait_with_output().expect("it ends");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(stderr.contains(says), "{args:?}: {stderr}");
        // A busy machine may need longer than the patience of the signal's thread.
        let code = output.status.code();
        assert!(code == Some(0) || code == Some(130) && args[0] == "view", "{args:?}: {code:?}");
    }
}
