//! Scenes as texts: folders with a scene, loading, and error messages.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::fs;
use std::path::PathBuf;

use nimbus::error::Error;
use nimbus::io::scene_file::{LoadedScene, load};
use serde_json::Value;
use tempfile::TempDir;

pub const BOXES: &str = "3\n1\n3, 1, 1, 1, 0, 0, 0, 1\n";
pub const CLOUD: &str = "[[cloud]]\nfrom = 'boxes'\nfile = 'b.dat'\n";

/// Writes a folder with `scene.toml` and the box file `b.dat`.
pub fn folder(scene: &str) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("scene.toml");
    fs::write(&path, scene).unwrap();
    fs::write(dir.path().join("b.dat"), BOXES).unwrap();
    (dir, path)
}

pub fn load_with(scene: &str, overrides: &[&str], seed: Option<u32>) -> Result<LoadedScene, Error> {
    let (_dir, path) = folder(scene);
    load(&path, &overrides.iter().map(|s| s.to_string()).collect::<Vec<_>>(), seed)
}

pub fn good(scene: &str) -> LoadedScene {
    load_with(scene, &[], None).unwrap()
}

/// Returns the message for `scene`, without the folder's path.
pub fn message(scene: &str, overrides: &[&str]) -> String {
    let (dir, path) = folder(scene);
    let overrides: Vec<String> = overrides.iter().map(|s| s.to_string()).collect();
    let error = load(&path, &overrides, None).expect_err(scene);
    assert_eq!(error.exit_code(), 2);
    error.to_string().replace(&format!("{}/", dir.path().display()), "")
}

pub fn assert_message(scene: &str, expected: &str) {
    assert_eq!(message(scene, &[]), expected, "for\n{scene}");
}

/// Reads a table of tests/data: `== line:column: message`, then the scene with that error.
pub fn assert_table(table: &str) {
    for case in table.strip_prefix("== ").unwrap().split("\n== ") {
        let (expected, scene) = case.split_once('\n').unwrap();
        assert_message(scene, &format!("scene.toml:{expected}"));
    }
}

/// Strings, numbers and lists of JSON are valid TOML; `:` becomes `=`.
pub fn to_toml(resolved: &Value) -> String {
    fn inline(v: &Value) -> String {
        match v {
            Value::Object(map) => {
                format!(
                    "{{ {} }}",
                    map.iter()
                        .map(|(k, v)| format!("{k} = {}", inline(v)))
                        .collect::<Vec<_>>()
                        .join(", ")
                )
            }
            Value::Array(list) => {
                format!("[{}]", list.iter().map(inline).collect::<Vec<_>>().join(", "))
            }
            other => other.to_string(),
        }
    }
    resolved.as_object().unwrap().iter().map(|(k, v)| format!("{k} = {}\n", inline(v))).collect()
}
