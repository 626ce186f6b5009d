//! A scene file (TOML) and what it names, to a complete [`Scene`].

use std::path::{Path, PathBuf};

use glam::DVec3;
use serde_json::{Value as Json, json};
use sha2::{Digest, Sha256};

use super::magnitude::{GREATEST, is_carried_place, shortest};
use super::scene_clouds::{CloudReader, deal, read_cloud};
pub use super::scene_sections::MAX_SIDE;
use super::toml_section::Section;
use super::toml_tree::Document;
use super::{scene_lights, scene_sections, scene_surfaces};
use crate::error::{Error, Result};
use crate::model::scene::Scene;

#[derive(Debug, Clone, PartialEq)]
pub struct LoadedScene {
    pub scene: Scene,
    /// Every value the scene came to, defaults and `--set` included, under the scene file's keys.
    pub resolved: Json,
    /// SHA-256 (hex) over the resolved scene and the content of every file it names. Where the files lie and
    /// how the TOML is laid out do not enter.
    pub hash: String,
    /// What is allowed but hardly meant, with its place.
    pub warnings: Vec<String>,
    pub path: PathBuf,
}

const ROOT_KEYS: &[&str] =
    &["title", "film", "camera", "time", "lighting", "draw", "threads", "light", "material", "surface", "cloud"];

/// Reads the scene at `path` with `overrides` (`key.path=VALUE`) laid over it. With `seed` N cloud i has seed
/// N + i, whatever the scene says.
pub fn load(path: &Path, overrides: &[String], seed: Option<u32>) -> Result<LoadedScene> {
    let mut document = Document::read(path)?;
    document.default_to("light", scene_lights::DEFAULT_LIGHTS);
    document.default_to("material", scene_lights::DEFAULT_MATERIAL);
    document.apply(overrides)?;
    let mut root = Section::root(&document)?;
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

    let mut reader = CloudReader::new(path.parent().unwrap_or(Path::new("")), &materials, seed);
    let mut clouds = Vec::new();
    let mut resolved_clouds = Vec::new();
    for (i, mut section) in root.sections("cloud")?.into_iter().enumerate() {
        let cloud = read_cloud(&mut section, i, &mut reader)?;
        // Origins run along straight lines, so the first and the last frame's are the farthest.
        for (time_s, when) in [(time.start_s, "at the first frame"), (time.at(time.n_frames - 1), "at the last frame")]
        {
            if !is_carried_place(cloud.origin_at(time_s)) {
                let expected = shortest(GREATEST);
                let what = format!("carries the cloud's origin too far: expected at most {expected} {when}");
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
    let digests = reader.digests;
    root.record("cloud", json!(resolved_clouds));

    let scene = Scene { title, film, camera, time, lighting, draw, threads, lights, materials, surfaces, clouds };
    // Particles are numbered in u32, on the device as in the model.
    if u32::try_from(scene.n_particles() + scene.n_surface_facets()).is_err() {
        return Err(Error::scene(
            root.place("cloud"),
            format!(
                "{} particles and {} facets of surfaces: at most {} together",
                scene.n_particles(),
                scene.n_surface_facets(),
                u32::MAX
            ),
        ));
    }
    let resolved = root.finish();
    let hash = hash(&resolved, &digests);
    Ok(LoadedScene { scene, resolved, hash, warnings, path: path.to_owned() })
}

/// Digests have a fixed length and follow the JSON's closing brace, so that no two scenes run together.
fn hash(resolved: &Json, digests: &[[u8; 32]]) -> String {
    let mut hasher = Sha256::new();
    hasher.update(resolved.to_string());
    for digest in digests {
        hasher.update(digest);
    }
    format!("{:x}", hasher.finalize())
}
