//! The worked example of docs/tutorial/adding-a-pass.md: its diff applies to the sources as they
//! are, has the size that the pages name, builds, passes its test and draws.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const DIFF: &str = "docs/tutorial/flatten.diff";

/// Name of the program that the copy builds, so that it does not replace the one under test.
const PROGRAM: &str = "nimbus-tutorial";

/// Files and folders that the build and its tests need.
const NEEDED: [&str; 11] = [
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
    "CHANGELOG.md",
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
    let copied = patched_copy();
    let tests = cargo(&copied, &["--test", "pass_flatten", "--test", "architecture"]);
    assert_eq!(tests.matches("test result: ok").count(), 2, "{tests}");
    assert!(cargo(&copied, &["--lib", "flatten"]).contains("1 passed"));

    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target folder");
    let program = target.join("release").join(PROGRAM);
    let dir = tempfile::tempdir().expect("a folder");
    let scene = Path::new(ROOT).join("scenes/hello.toml");
    let plan = |factor: &str| {
        let set = format!("draw.flatten={factor}");
        run(Command::new(&program).args(["inspect", "--plan", "--set", &set]).arg(&scene))
    };
    assert!(plan("1.0").contains("draw.flatten is 1") && !plan("0.5").contains("draw.flatten is"));

    let picture = |name: &str, options: &[&str]| {
        let path = dir.path().join(name);
        let mut command = Command::new(&program);
        command.arg("render").arg(&scene).args(["--size", "64x48", "--set", "draw.cutoff=6"]);
        run(command.args(["--set", "cloud.0.texture=\"none\""]).args(options).arg("-o").arg(&path));
        path
    };
    let flat = ["--set", "draw.flatten=0.5"];
    let flattened = picture("flat.exr", &flat);
    let thin = picture("thin.exr", &[&flat[..], &["--reference", "thin"]].concat());
    let rmse = |a: &Path, b: &Path| -> f64 {
        let json = run(Command::new(&program).arg("compare").args([a, b]).arg("--json"));
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        json["metrics"]["rmse"].as_f64().expect("a number")
    };
    // Half floats are off by 2⁻¹¹ of a layer's value, which layers over it shrink.
    assert!(rmse(&flattened, &thin) < 2e-3);
    assert!(rmse(&flattened, &picture("tall.exr", &[])) > 2e-2);
}
