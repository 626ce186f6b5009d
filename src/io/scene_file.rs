//! Scene files (TOML), and the files that they name, to complete [`Scene`]s.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::Value as Json;

use super::document::suggest::shown;
use super::document::tree::Document;
use super::scene_hash::SceneHash;
pub use super::scene_keys::MAX_SIDE;
use super::scene_keys::{
    Files, KEY_NAMES, Listed, OnDisk, PhaseSpec, Read, add_defaults, read_phases, read_scene,
    set_frames,
};
use crate::error::{Error, Place, Result};
use crate::model::scene::Scene;

/// A scene as its file, the files that it names and the command line make it.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedScene {
    /// The scene without the keys that its phases set.
    pub scene: Scene,
    /// Phases in order; empty for a scene that is the same throughout.
    pub phases: Vec<Phase>,
    /// Resolved scene: the value of every key, defaults and `--set` included, under the scene
    /// file's keys.
    pub resolved: Json,
    hash: SceneHash,
    /// Settings that are allowed but hardly meant, with their places.
    pub warnings: Vec<String>,
    /// Path of the scene file.
    pub path: PathBuf,
}

/// Part of a run with settings of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Phase {
    /// Name in results.
    pub name: String,
    /// Number of frames.
    pub n_frames: u32,
    /// The whole scene, with the keys that the phase sets.
    pub scene: Scene,
    /// Whether the phase sets `threads.mode`, the loop that it is run in.
    pub sets_mode: bool,
}

impl LoadedScene {
    /// Returns the SHA-256 (hex) over the resolved scene, those of its phases, and the content of
    /// every file that they name. The places of the files and the layout of the TOML do not enter.
    pub fn hash(&self) -> &str {
        self.hash.hex()
    }

    /// Returns the scene of a frame with every "auto" resolved to what needs no measurement:
    /// measured choices may differ between machines and frames, and the pictures would, too.
    pub fn exact_at_frame(&self, i_frame: u32) -> Scene {
        self.clone().at_frame(i_frame).exact().into_owned()
    }

    /// Returns the scene of frame `i_frame`; beyond the last phase, the last phase's.
    pub fn at_frame(self, i_frame: u32) -> Scene {
        let mut end = 0u64;
        let n = self.phases.len();
        for (i, phase) in self.phases.into_iter().enumerate() {
            end += u64::from(phase.n_frames);
            if u64::from(i_frame) < end || i + 1 == n {
                return phase.scene;
            }
        }
        self.scene
    }
}

/// Reads the scene at `path` with `overrides` (`key.path=VALUE`) laid over it. With `seed` N, cloud
/// i has the seed N + i, whatever the scene says.
///
/// # Errors
/// When a file cannot be read or holds a fault; the message says where and what was expected.
pub fn load(path: &Path, overrides: &[String], seed: Option<u32>) -> Result<LoadedScene> {
    load_document(Document::read(path)?, path, overrides, seed, &OnDisk)
}

/// Reads a scene as [`load`] does, and lists the files that were asked for, each once: the scene's
/// own first, then those that it names, in order. A failed load lists them up to the one that
/// failed, so that a caller can wait until one of them changes.
pub fn load_and_list(
    path: &Path,
    overrides: &[String],
    seed: Option<u32>,
) -> (Result<LoadedScene>, Vec<PathBuf>) {
    let listed = Listed::new(path);
    let loaded = Document::read(path)
        .and_then(|document| load_document(document, path, overrides, seed, &listed));
    (loaded, listed.into_paths())
}

/// Reads a scene from text. `path` is its name in messages, and the files that it names lie beside
/// it.
///
/// # Errors
/// As [`load`].
pub fn parse(
    text: String,
    path: &Path,
    overrides: &[String],
    seed: Option<u32>,
) -> Result<LoadedScene> {
    parse_beside(text, path, overrides, seed, &OnDisk)
}

/// Reads a scene from text as [`parse`] does, with the files that it names from `files`.
///
/// # Errors
/// As [`load`].
pub fn parse_beside(
    text: String,
    path: &Path,
    overrides: &[String],
    seed: Option<u32>,
    files: &dyn Files,
) -> Result<LoadedScene> {
    load_document(Document::parse(text, path)?, path, overrides, seed, files)
}

fn load_document(
    mut file: Document,
    path: &Path,
    overrides: &[String],
    seed: Option<u32>,
    files: &dyn Files,
) -> Result<LoadedScene> {
    let folder = path.parent().unwrap_or(Path::new(""));
    file.source.names = KEY_NAMES;
    add_defaults(&mut file);
    let mut document = file.clone();
    document.apply(overrides)?;
    let specs = read_phases(&document)?;
    if !specs.is_empty() {
        let n_frames: u64 = specs.iter().map(|s| u64::from(s.n_frames)).sum();
        let n_frames = u32::try_from(n_frames).map_err(|_| {
            let what = format!("the phases have {n_frames} frames: at most {}", u32::MAX);
            Error::scene(Place::file(path), what)
        })?;
        set_frames(&mut document, n_frames)?;
        set_frames(&mut file, n_frames)?;
    }
    let mut read = read_scene(&document, folder, seed, files)?;
    let mut resolved = vec![read.resolved.to_string()];
    let mut phases = Vec::new();
    for spec in &specs {
        // Origins of a phase that `--set` adds point into the source that has the overrides.
        let source = document.source.clone();
        let mut document = Document { source, root: file.root.clone() };
        spec.apply(&mut document)?;
        document.apply(overrides)?;
        // The fault may be at a line that is right without the phase.
        let of_phase = read_scene(&document, folder, seed, files)
            .map_err(|e| e.within(&format!("phase \"{}\"", shown(&spec.name))))?;
        resolved.push(of_phase.resolved.to_string());
        read.contents.extend(of_phase.contents);
        read.warnings.extend(of_phase.warnings);
        let PhaseSpec { name, n_frames, .. } = spec;
        let (name, sets_mode) = (name.clone(), spec.sets_mode());
        phases.push(Phase { name, n_frames: *n_frames, scene: of_phase.scene, sets_mode });
    }
    // Phases share most of their warnings.
    let mut seen = BTreeSet::new();
    read.warnings.retain(|warning| seen.insert(warning.clone()));
    let Read { scene, resolved: mut root, contents, warnings } = read;
    let hash = SceneHash::new(resolved, contents);
    if let (Json::Object(root), false) = (&mut root, specs.is_empty()) {
        root.insert("phase".to_owned(), specs.into_iter().map(|s| s.resolved).collect());
    }
    Ok(LoadedScene { scene, phases, resolved: root, hash, warnings, path: path.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(paths: &[PathBuf]) -> Vec<String> {
        paths.iter().map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn files_are_listed_in_order_and_once() {
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
        let (loaded, paths) = load_and_list(&scenes.join("clusters-20.toml"), &[], None);
        assert!(loaded == load(&scenes.join("clusters-20.toml"), &[], None));
        assert_eq!(names(&paths), ["clusters-20.toml", "cubes-554.dat", "cubes-615.dat"]);
        let (loaded, paths) = load_and_list(&scenes.join("supercell.toml"), &[], None);
        assert!(loaded.is_ok());
        assert_eq!(names(&paths), ["supercell.toml", "supercell.nc"]);
    }

    #[test]
    fn a_failed_load_lists_the_files_up_to_the_one_that_failed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scene.toml");
        let cloud = |file: &str| format!("[[cloud]]\nfrom = 'particles'\nfile = '{file}'\n");
        std::fs::write(&path, cloud("a.csv") + &cloud("b.csv") + &cloud("c.csv")).unwrap();
        std::fs::write(dir.path().join("a.csv"), "x,y,z,sigma,kappa\n0,0,0,1,1\n").unwrap();
        let (loaded, paths) = load_and_list(&path, &[], None);
        assert!(loaded.is_err());
        assert_eq!(names(&paths), ["scene.toml", "a.csv", "b.csv"]);
        // A file that is no TOML, and one that does not exist.
        std::fs::write(&path, "[").unwrap();
        assert_eq!(names(&load_and_list(&path, &[], None).1), ["scene.toml"]);
        let (missing, paths) = load_and_list(&dir.path().join("none.toml"), &[], None);
        assert!(missing.is_err() && names(&paths) == ["none.toml"]);
    }
}
