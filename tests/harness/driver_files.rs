//! The fake driver `tests/fake_driver/icd.c`: compiled, with its manifests for Vulkan's loader.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;

/// Folders in which the loader looks for the manifests of drivers.
const MANIFEST_FOLDERS: [&str; 3] =
    ["/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/usr/share/vulkan/icd.d"];
/// Variables that name manifests, the newer one first.
pub const MANIFEST_VARIABLES: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];
/// The drivers "first" and "second", which a folder holds until this is dropped.
pub struct DriverFiles {
    folder: TempDir,
    /// Library of the driver that does the work.
    real: String,
}

impl DriverFiles {
    /// Compiles the drivers.
    pub fn new() -> DriverFiles {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, define) in [("first", "-DFIRST"), ("second", "-DSECOND")] {
            let library = folder.path().join(format!("lib{name}.so"));
            compile(&library, define);
            let manifest = serde_json::json!({
                "file_format_version": "1.0.0",
                "ICD": { "library_path": library, "api_version": "1.3.0" },
            });
            let path = folder.path().join(format!("{name}.json"));
            fs::write(path, manifest.to_string()).expect("room");
        }
        DriverFiles { folder, real: lavapipe() }
    }

    /// Returns the folder.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Returns the manifests of drivers of these names, as the loader's variables list them.
    pub fn manifests(&self, names: &[&str]) -> String {
        let path =
            |name: &&str| self.folder.path().join(format!("{name}.json")).display().to_string();
        names.iter().map(path).collect::<Vec<_>>().join(":")
    }

    /// Returns the variables with which a program runs on the first driver.
    pub fn variables(&self) -> Vec<(&'static str, String)> {
        let manifests = self.manifests(&["first"]);
        let mut all = MANIFEST_VARIABLES.map(|name| (name, manifests.clone())).to_vec();
        all.push(("NIMBUS_FAKE_REAL", self.real.clone()));
        all
    }
}

/// Compiles the fake driver.
fn compile(library: &Path, define: &str) {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fake_driver/icd.c");
    let options = ["-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"];
    let mut command = Command::new("cc");
    command.args(options).args(["-fvisibility=hidden", define, "-o"]).arg(library).arg(source);
    let output = command.args(["-ldl", "-lpthread"]).output();
    let output = output.expect("`cc`, a C compiler, which tools/bootstrap installs");
    assert!(output.status.success(), "cc: {}", String::from_utf8_lossy(&output.stderr));
}

/// Returns the library of Mesa's software driver.
fn lavapipe() -> String {
    let named = MANIFEST_VARIABLES.iter().filter_map(std::env::var_os);
    let places = named.flat_map(|paths| std::env::split_paths(&paths).collect::<Vec<_>>());
    let files = |place: PathBuf| match fs::read_dir(&place) {
        Ok(entries) => entries.flatten().map(|entry| entry.path()).collect(),
        Err(_) => vec![place],
    };
    let is_lavapipe = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("lvp_icd") && name.ends_with(".json") && path.is_file()
    };
    let manifest = places
        .chain(MANIFEST_FOLDERS.map(PathBuf::from))
        .flat_map(files)
        .find(is_lavapipe)
        .expect("lavapipe's manifest lvp_icd.*.json, which tools/bootstrap installs");
    let text = fs::read_to_string(&manifest).expect("the manifest");
    let json: Value = serde_json::from_str(&text).expect("JSON");
    let library = json["ICD"]["library_path"].as_str().expect("a path");
    // A name without a folder is searched for by the linker, another one from the manifest on.
    match library.contains('/') {
        true => manifest.with_file_name(library).display().to_string(),
        false => library.to_owned(),
    }
}
