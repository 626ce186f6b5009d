//! The worked example of docs/tutorial/adding-a-pass.md: its diff applies to the sources as they
//! are, has the size that the pages name, builds, passes its test and draws.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const DIFF: &str = "docs/tutorial/shrink.diff";

/// Name of the program that the copy builds, so that it does not replace the one under test.
const PROGRAM: &str = "nimbus-tutorial";

/// Files and folders that the build and its tests need.
const NEEDED: [&str; 10] = [
    "Cargo.toml",
    "Cargo.lock",
    "build.rs",
    "src",
    "shaders",
    "tests",
    "benches",
    "scenes",
    "docs",
    "ARCHITECTURE.md",
];

/// Copies a file or folder. Binary data of tests and pages stays where it is.
fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).expect("a folder");
        for entry in fs::read_dir(from).expect("a folder") {
            let name = entry.expect("an entry").file_name();
            copy(&from.join(&name), &to.join(&name));
        }
    } else if !["png", "nc", "svg"].map(OsStr::new).contains(&from.extension().unwrap_or_default())
    {
        fs::copy(from, to).expect("a copy");
    }
}

/// Runs a command and returns what it wrote to stdout.
fn run(command: &mut Command) -> String {
    let output = command.output().expect("the command starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{command:?}\n{out}\n{err}");
    out
}

/// Waits until no other run of this test uses the copy's folder. Two clones may share a target
/// folder.
fn lock() -> fs::File {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("tutorial.lock");
    let file = fs::File::create(path).expect("a lock file");
    rustix::fs::flock(&file, rustix::fs::FlockOperation::LockExclusive).expect("a lock");
    file
}

/// Copies the sources and applies the diff. The program of the copy has a name of its own.
fn patched_copy() -> PathBuf {
    let copied = Path::new(env!("CARGO_TARGET_TMPDIR")).join("tutorial");
    let _ = fs::remove_dir_all(&copied);
    for name in NEEDED {
        fs::create_dir_all(&copied).expect("a folder");
        copy(&Path::new(ROOT).join(name), &copied.join(name));
    }
    // The copy lies in no repository, even where the target folder does.
    let mut git = Command::new("git");
    git.env("GIT_CEILING_DIRECTORIES", env!("CARGO_TARGET_TMPDIR")).current_dir(&copied);
    run(git.arg("apply").arg(Path::new(ROOT).join(DIFF)));
    let manifest = fs::read_to_string(copied.join("Cargo.toml")).expect("a manifest");
    let own = format!("default-run = \"{PROGRAM}\"\nautobins = false");
    let named = manifest.replacen("default-run = \"nimbus\"", &own, 1);
    assert!(named != manifest, "Cargo.toml names no default program");
    let program = format!("\n[[bin]]\nname = \"{PROGRAM}\"\npath = \"src/main.rs\"\n");
    fs::write(copied.join("Cargo.toml"), named + &program).expect("a manifest");
    copied
}

/// Runs cargo on the copy, in the target folder of this build. Optimization takes longer here than
/// the tests themselves.
fn cargo(copied: &Path, args: &[&str]) -> String {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target folder");
    run(Command::new(env!("CARGO"))
        .current_dir(copied)
        .args(["test", "--release", "--offline", "--quiet"])
        .args(["--config", "profile.release.package.nimbus.opt-level = 0"])
        .args(["--config", "profile.release.package.nimbus.debug = false"])
        .args(args)
        .env("CARGO_TARGET_DIR", target))
}

#[test]
fn the_pages_name_the_size_of_the_diff() {
    let diff = fs::read_to_string(Path::new(ROOT).join(DIFF)).expect("the diff");
    let n_files = diff.lines().filter(|line| line.starts_with("+++ ")).count();
    let is_added = |line: &&str| line.starts_with('+') && !line.starts_with("+++ ");
    let n_lines = diff.lines().filter(is_added).count();
    for page in ["CONTRIBUTING.md", "docs/tutorial/adding-a-pass.md"] {
        let text = fs::read_to_string(Path::new(ROOT).join(page)).expect("a page");
        let words: Vec<&str> = text.split_whitespace().collect();
        let text = words.join(" ");
        let (files, lines) = (format!("{n_files} files and"), format!("{n_lines} lines, tests"));
        assert!(text.contains(&files) && text.contains(&lines), "{page}: {files} … {lines}");
    }
}

#[test]
fn the_example_builds_passes_its_test_and_draws() {
    let _lock = lock();
    let copied = patched_copy();
    // These tests name every pass, shader or key. The pass's own test follows.
    const TESTS: [&str; 3] = ["architecture", "layout", "scene_keys"];
    let tests = cargo(&copied, &TESTS.map(|name| ["--test", name]).concat());
    assert_eq!(tests.matches("test result: ok").count(), TESTS.len(), "{tests}");
    let own = cargo(&copied, &["--test", "passes", "shrink"]);
    assert!(own.contains("1 passed"), "{own}");
    let modes = cargo(&copied, &["--test", "modes", "a_still_scene"]);
    assert!(modes.contains("1 passed"), "{modes}");
    let units = cargo(&copied, &["--lib", "--", "reference::shrink", "frame::plan"]);
    assert!(units.contains("test result: ok") && !units.contains("running 0 tests"), "{units}");

    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target folder");
    let program = target.join("release").join(PROGRAM);
    let dir = tempfile::tempdir().expect("a folder");
    let scene = Path::new(ROOT).join("scenes/hello.toml");
    let plan = |factor: &str| {
        let set = format!("draw.shrink={factor}");
        run(Command::new(&program).args(["inspect", "--plan", "--set", &set]).arg(&scene))
    };
    assert!(plan("1.0").contains("draw.shrink is 1") && !plan("0.5").contains("draw.shrink is"));

    let picture = |name: &str, options: &[&str]| {
        let path = dir.path().join(name);
        let mut command = Command::new(&program);
        command.arg("render").arg(&scene).args(["--size", "64x48", "--set", "draw.cutoff=6"]);
        run(command.args(["--set", "cloud.0.texture=\"none\""]).args(options).arg("-o").arg(&path));
        path
    };
    let small = ["--set", "draw.shrink=0.5"];
    let shrunk = picture("small.exr", &small);
    let thin = picture("thin.exr", &[&small[..], &["--reference", "thin"]].concat());
    let rmse = |a: &Path, b: &Path| -> f64 {
        let json = run(Command::new(&program).arg("compare").args([a, b]).arg("--json"));
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        json["metrics"]["rmse"].as_f64().expect("a number")
    };
    // Half floats are off by 2⁻¹¹ of a layer's value, which layers over it shrink.
    assert!(rmse(&shrunk, &thin) < 2e-3);
    assert!(rmse(&shrunk, &picture("large.exr", &[])) > 2e-2);
    // Skipping changes nothing, also where a later frame skips the pass.
    let later = [&small[..], &["--frame", "2"]].concat();
    let skipped = picture("skipped.exr", &later);
    let all = picture("all.exr", &[&later[..], &["--no-skip"]].concat());
    assert!(fs::read(skipped).expect("a picture") == fs::read(all).expect("a picture"));
}
