//! The program as users run it, with pictures in a temporary folder, and differences of pictures.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

pub fn nimbus(args: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("nimbus"));
    // Lines about progress come after a time, and a busy machine may need it.
    command.env("NIMBUS_PROGRESS_S", "0");
    command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Returns the scenes that nimbus comes with.
pub fn scenes() -> Vec<PathBuf> {
    let entries = std::fs::read_dir("scenes").expect("a folder");
    let mut all: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    all.sort();
    assert!(all.len() > 10);
    all
}

pub fn run(args: &[&str]) -> Output {
    nimbus(args).output().expect("the program runs")
}

pub fn path(dir: &TempDir, name: &str) -> String {
    dir.path().join(name).to_str().expect("UTF-8").to_owned()
}

/// Returns RMSE and greatest difference of two pictures.
pub fn differ(dir: &TempDir, a: &str, b: &str) -> (f64, f64) {
    let output = run(&["compare", &path(dir, a), &path(dir, b), "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let of = |name: &str| json["metrics"][name].as_f64().expect("a number");
    (of("rmse"), of("max"))
}
