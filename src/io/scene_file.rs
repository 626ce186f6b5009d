//! A scene file (TOML) and what it names, to a complete [`Scene`].

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use glam::DVec3;
use serde_json::{Value as Json, json};
use sha2::{Digest, Sha256};

use super::magnitude::{GREATEST, is_carried_place, shortest};
use super::scene_clouds::{CloudReader, deal, read_cloud};
pub use super::scene_clouds::{Files, OnDisk};
use super::scene_phases::PhaseSpec;
pub use super::scene_sections::MAX_SIDE;
use super::suggest::shown;
use super::toml_section::Section;
use super::toml_tree::Document;
use super::weather::wrf::WeatherFile;
use super::{scene_air, scene_lights, scene_phases, scene_sections, scene_surfaces};
use crate::error::{Error, Place, Result};
use crate::model::scene::Scene;

#[derive(Debug, Clone, PartialEq)]
pub struct LoadedScene {
    /// Without what its phases set.
    pub scene: Scene,
    /// In order; none where the scene is the same throughout.
    pub phases: Vec<Phase>,
    /// Every value the scene came to, defaults and `--set` included, under the scene file's keys.
    pub resolved: Json,
    /// SHA-256 (hex) over the resolved scene, those of its phases, and the content of every file
    /// they name. Where the files lie and how the TOML is laid out do not enter.
    pub hash: String,
    /// What is allowed but hardly meant, with its place.
    pub warnings: Vec<String>,
    pub path: PathBuf,
}

/// Part of a run with settings of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Phase {
    pub name: String,
    pub n_frames: u32,
    /// The whole scene, with what the phase sets.
    pub scene: Scene,
    /// Whether it names the loop it is run in, `threads.mode`.
    pub sets_mode: bool,
}

impl LoadedScene {
    /// The scene as frame `i_frame` has it: of the last phase where there are no further ones.
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

const ROOT_KEYS: &[&str] = &[
    "title", "film", "camera", "time", "lighting", "draw", "threads", "light", "material",
    "surface", "air", "cloud", "phase",
];

/// Reads the scene at `path` with `overrides` (`key.path=VALUE`) laid over it. With `seed` N cloud
/// i has seed N + i, whatever the scene says.
pub fn load(path: &Path, overrides: &[String], seed: Option<u32>) -> Result<LoadedScene> {
    load_document(Document::read(path)?, path, overrides, seed, &OnDisk)
}

/// The same, and the files that it was read from, each once: the scene's own first, then those that
/// it names, in their order, as far as it came. Also where it fails, so that somebody can wait
/// until one of them is put right.
pub fn load_and_name(
    path: &Path,
    overrides: &[String],
    seed: Option<u32>,
) -> (Result<LoadedScene>, Vec<PathBuf>) {
    let named = Named { files: &OnDisk, paths: Mutex::new(vec![path.to_owned()]) };
    let loaded = Document::read(path)
        .and_then(|document| load_document(document, path, overrides, seed, &named));
    (loaded, named.paths.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// Files that remember which of them were asked for.
struct Named<'a> {
    files: &'a dyn Files,
    paths: Mutex<Vec<PathBuf>>,
}

impl Named<'_> {
    fn name(&self, path: &Path) {
        let mut paths = self.paths.lock().unwrap_or_else(PoisonError::into_inner);
        if !paths.iter().any(|named| named == path) {
            paths.push(path.to_owned());
        }
    }
}

impl Files for Named<'_> {
    fn text(&self, path: &Path, first: &str) -> Result<String> {
        self.name(path);
        self.files.text(path, first)
    }

    fn weather(&self, path: &Path) -> Result<WeatherFile> {
        self.name(path);
        self.files.weather(path)
    }
}

/// The same of a text; `path` is what errors call it, and files that it names lie beside that.
pub fn parse(
    text: String,
    path: &Path,
    overrides: &[String],
    seed: Option<u32>,
) -> Result<LoadedScene> {
    parse_beside(text, path, overrides, seed, &OnDisk)
}

/// The same with the files that it names from elsewhere.
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
    file.default_to("light", scene_lights::DEFAULT_LIGHTS);
    file.default_to("material", scene_lights::DEFAULT_MATERIAL);
    let mut document = file.clone();
    document.apply(overrides)?;
    let specs = scene_phases::read_phases(&document)?;
    if !specs.is_empty() {
        let n_frames: u64 = specs.iter().map(|s| u64::from(s.n_frames)).sum();
        let too_many = |_| {
            Error::scene(
                Place::file(path),
                format!("the phases have {n_frames} frames: at most {}", u32::MAX),
            )
        };
        let n_frames = u32::try_from(n_frames).map_err(too_many)?;
        scene_phases::set_frames(&mut document, n_frames)?;
        scene_phases::set_frames(&mut file, n_frames)?;
    }
    let mut read = read_document(&document, path, seed, files)?;
    let mut hashed = vec![read.resolved.to_string()];
    let mut phases = Vec::new();
    for spec in &specs {
        let mut document = file.clone();
        spec.apply(&mut document)?;
        document.apply(overrides)?;
        // What is wrong may lie in a line that is right without the phase.
        let of_phase = read_document(&document, path, seed, files)
            .map_err(|e| e.within(&format!("phase \"{}\"", shown(&spec.name))))?;
        hashed.push(of_phase.resolved.to_string());
        read.digests.extend(of_phase.digests);
        read.warnings.extend(of_phase.warnings);
        let PhaseSpec { name, n_frames, .. } = spec;
        let (name, sets_mode) = (name.clone(), spec.sets_mode());
        phases.push(Phase { name, n_frames: *n_frames, scene: of_phase.scene, sets_mode });
    }
    // Phases share most of what is to be said of them.
    let mut said = BTreeSet::new();
    read.warnings.retain(|warning| said.insert(warning.clone()));
    let Read { scene, mut resolved, digests, warnings } = read;
    if let (Json::Object(root), false) = (&mut resolved, specs.is_empty()) {
        root.insert("phase".to_owned(), specs.into_iter().map(|s| s.resolved).collect());
    }
    Ok(LoadedScene {
        scene,
        phases,
        resolved,
        hash: hash(&hashed, &digests),
        warnings,
        path: path.to_owned(),
    })
}

/// A document's scene, and what is told of it.
struct Read {
    scene: Scene,
    resolved: Json,
    /// SHA-256 of every file it names, in order.
    digests: Vec<[u8; 32]>,
    warnings: Vec<String>,
}

fn read_document(
    document: &Document,
    path: &Path,
    seed: Option<u32>,
    files: &dyn Files,
) -> Result<Read> {
    let mut root = Section::root(document)?;
    root.expect_keys(ROOT_KEYS, &[])?;
    let title = root.string("title", "")?;

    let mut warnings = Vec::new();
    let film = scene_sections::read_film(&mut root)?;
    let camera = scene_sections::read_camera(&mut root)?;
    let time = scene_sections::read_time(&mut root)?;
    let draw = scene_sections::read_draw(&mut root)?;
    let threads = scene_sections::read_threads(&mut root)?;
    let lights = scene_lights::read_lights(&mut root)?;
    let materials = scene_lights::read_materials(&mut root, &mut warnings)?;
    let glossy = materials.iter().flat_map(|m| &m.keys).filter(|k| k.brdf.ks != DVec3::ZERO);
    let exponents: Vec<f64> = glossy.map(|k| k.brdf.ns).collect();
    let lighting = scene_sections::read_lighting(&mut root, &exponents)?;
    let surfaces = scene_surfaces::read_surfaces(&mut root, &materials)?;

    let air = scene_air::read_air(&mut root)?;
    let mut reader = CloudReader::new(
        path.parent().unwrap_or(Path::new("")),
        (&materials, &air),
        seed,
        threads.simulate,
        files,
    );
    let mut clouds = Vec::new();
    let mut resolved_clouds = Vec::new();
    for (i, mut section) in root.sections("cloud")?.into_iter().enumerate() {
        let cloud = read_cloud(&mut section, i, &mut reader)?;
        // Origins run along straight lines, so the first and the last frame's are the farthest.
        for (time_s, when) in [
            (time.start_s, "at the first frame"),
            (time.at(time.n_frames - 1), "at the last frame"),
        ] {
            if !is_carried_place(cloud.origin_at(time_s)) {
                let expected = shortest(GREATEST);
                let what = format!(
                    "carries the cloud's origin too far: expected at most {expected} {when}"
                );
                return Err(section.fault("wind", what));
            }
        }
        clouds.push(cloud);
        resolved_clouds.push(section.finish());
    }
    if draw.n_particles > 0 {
        deal(&mut clouds, draw.n_particles).map_err(|what| match root.section("draw") {
            Ok(section) => section.fault("particles", what),
            Err(e) => e,
        })?;
    }
    let (digests, terrains) = (reader.digests, reader.terrains);
    warnings.extend(reader.notes);
    root.record("cloud", json!(resolved_clouds));

    let scene = Scene {
        title,
        film,
        camera,
        time,
        lighting,
        draw,
        threads,
        lights,
        materials,
        surfaces,
        terrains,
        clouds,
        air,
    };
    // Particles are numbered in u32, on the device as in the model.
    if u32::try_from(scene.n_particles() + scene.n_solid_facets()).is_err() {
        return Err(Error::scene(
            root.place("cloud"),
            format!(
                "{} particles and {} facets of surfaces and ground: at most {} together",
                scene.n_particles(),
                scene.n_solid_facets(),
                u32::MAX
            ),
        ));
    }
    Ok(Read { scene, resolved: root.finish(), digests, warnings })
}

/// Digests have a fixed length and follow the JSON's closing brace, so that no two scenes run
/// together.
fn hash(resolved: &[String], digests: &[[u8; 32]]) -> String {
    let mut hasher = Sha256::new();
    for text in resolved {
        hasher.update(text);
    }
    for digest in digests {
        hasher.update(digest);
    }
    format!("{:x}", hasher.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(paths: &[PathBuf]) -> Vec<String> {
        paths.iter().map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn files_are_named_in_order_and_once() {
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
        let (loaded, paths) = load_and_name(&scenes.join("clusters-20.toml"), &[], None);
        assert!(loaded == load(&scenes.join("clusters-20.toml"), &[], None));
        assert_eq!(names(&paths), ["clusters-20.toml", "cubes-554.dat", "cubes-615.dat"]);
        let (loaded, paths) = load_and_name(&scenes.join("supercell.toml"), &[], None);
        assert!(loaded.is_ok());
        assert_eq!(names(&paths), ["supercell.toml", "supercell.nc"]);
    }

    #[test]
    fn what_fails_names_what_could_be_put_right() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scene.toml");
        let cloud = |file: &str| format!("[[cloud]]\nfrom = 'particles'\nfile = '{file}'\n");
        std::fs::write(&path, cloud("a.csv") + &cloud("b.csv") + &cloud("c.csv")).unwrap();
        std::fs::write(dir.path().join("a.csv"), "x,y,z,sigma,kappa\n0,0,0,1,1\n").unwrap();
        let (loaded, paths) = load_and_name(&path, &[], None);
        assert!(loaded.is_err());
        assert_eq!(names(&paths), ["scene.toml", "a.csv", "b.csv"]);
        // No TOML, no file at all.
        std::fs::write(&path, "[").unwrap();
        assert_eq!(names(&load_and_name(&path, &[], None).1), ["scene.toml"]);
        let (missing, paths) = load_and_name(&dir.path().join("none.toml"), &[], None);
        assert!(missing.is_err() && names(&paths) == ["none.toml"]);
    }
}
