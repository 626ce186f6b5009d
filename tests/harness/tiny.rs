//! A scene of four blobs in its own folder, which every command renders quickly, and runs of the
//! program on it.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Output};

use nimbus::gpu::Compiler;
use serde_json::Value;
use tempfile::TempDir;

use super::program::nimbus;

pub const WIDTH: u32 = 24;
pub const HEIGHT: u32 = 16;
pub const N_PIXELS: usize = (WIDTH * HEIGHT) as usize;

const SCENE: &str = r#"
[film]
width = 24
height = 16
format = "rgba32f"

[draw]
cutoff = 3.0

[camera]
position = [0, 0, 9]
target = [0, 0, 0]

[time]
step_s = 0.1

[lighting]
mode = "first"
grid = 8

[[cloud]]
from = "particles"
file = "blobs.csv"
"#;
const BLOBS: &str =
    "x,y,z,radius,kappa\n-2,0,0,1.2,0.8\n0.5,1,1,1,1.1\n1.5,-1,-1,1.4,0.6\n3,0.5,0,0.7,1.5\n";

/// Arguments of a short study of the scene; knobs are added.
pub const SHORT: [&str; 7] =
    ["error", "scene.toml", "-q", "--rounds=2", "--frames=1", "--pixels=all", "--time=frame"];
pub const OUT: [&str; 2] = ["--out", "out"];

pub fn study(json: &Value) -> &Vec<Value> {
    json["configurations"].as_array().expect("configurations")
}

pub fn names(json: &Value) -> Vec<&str> {
    study(json).iter().map(|c| c["name"].as_str().expect("a name")).collect()
}

/// Writes the scene, with its own cache of references.
pub struct Tiny {
    dir: TempDir,
}

impl Tiny {
    pub fn new() -> Tiny {
        Tiny::with("")
    }

    /// Writes the scene with `more` at its end.
    pub fn with(more: &str) -> Tiny {
        let dir = tempfile::tempdir().expect("a folder");
        let tiny = Tiny { dir };
        fs::write(tiny.path("scene.toml"), format!("{SCENE}{more}")).expect("the scene");
        fs::write(tiny.path("blobs.csv"), BLOBS).expect("the blobs");
        // The shader cache is shared: compiling shaders again would take most of the time.
        let spirv = Compiler::default_cache().expect("a place for caches");
        fs::create_dir_all(&spirv).expect("the shaders' cache");
        fs::create_dir(tiny.cache()).expect("the cache");
        std::os::unix::fs::symlink(spirv, tiny.cache().join("spirv")).expect("a link");
        tiny
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).expect(name)
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.text(name)).expect(name)
    }

    fn cache(&self) -> PathBuf {
        self.path("cache")
    }

    /// The cached references.
    pub fn kept(&self) -> Vec<PathBuf> {
        let folder = self.cache().join("references");
        folder
            .read_dir()
            .map_or(Vec::new(), |files| files.map(|file| file.expect("a file").path()).collect())
    }

    /// Runs the program in the scene's folder.
    pub fn command(&self, args: &[&str]) -> std::process::Command {
        let mut command = nimbus(args);
        command.current_dir(self.dir.path()).env("NIMBUS_CACHE_DIR", self.cache());
        command
    }

    pub fn run(&self, args: &[&str]) -> Output {
        self.command(args).output().expect("the program runs")
    }

    pub fn start(&self, args: &[&str]) -> Child {
        self.command(args).spawn().expect("the program begins")
    }

    /// Returns the output of a run that must succeed.
    pub fn good(&self, args: &[&str]) -> String {
        let output = self.run(args);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{args:?}: {stderr}");
        String::from_utf8(output.stdout).expect("UTF-8")
    }

    /// Returns the only message of a run that must be refused.
    pub fn refused(&self, args: &[&str]) -> String {
        let output = self.run(args);
        let stderr = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{args:?}: {stderr}");
        let message =
            stderr.strip_prefix("error: ").unwrap_or_else(|| panic!("{args:?}: {stderr}"));
        // clap adds a hint below its message.
        let message =
            message.trim_end().trim_end_matches("For more information, try '--help'.").trim_end();
        assert!(!message.contains('\n'), "{args:?}: {stderr}");
        message.to_owned()
    }
}

/// Asserts that `json` has no violation of a schema in docs/reference/schemas.
pub fn assert_valid(json: &Value, schema: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/schemas").join(schema);
    let schema: Value =
        serde_json::from_str(&fs::read_to_string(path).expect("the schema")).expect("JSON");
    let validator = jsonschema::draft202012::new(&schema).expect("a schema");
    let complaints: Vec<String> = validator
        .iter_errors(json)
        .map(|error| format!("{}: {error}", error.instance_path()))
        .collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
}

/// Returns width and height of a picture.
pub fn size(path: &Path) -> (u32, u32) {
    image::image_dimensions(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Returns the rows of a CSV file by the names of its columns.
pub struct Table {
    header: csv::StringRecord,
    pub rows: Vec<csv::StringRecord>,
}

impl Table {
    pub fn of(text: &str) -> Table {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let header = reader.headers().expect("a header").clone();
        let rows = reader.records().map(|row| row.expect("a whole row")).collect();
        Table { header, rows }
    }

    pub fn text<'a>(&self, row: &'a csv::StringRecord, column: &str) -> &'a str {
        let i = self
            .header
            .iter()
            .position(|name| name == column)
            .unwrap_or_else(|| panic!("no column {column}"));
        &row[i]
    }

    /// None for an empty field.
    pub fn number(&self, row: &csv::StringRecord, column: &str) -> Option<f64> {
        let text = self.text(row, column);
        (!text.is_empty()).then(|| text.parse().unwrap_or_else(|_| panic!("{column}: {text}")))
    }
}
