//! Keys of a scene file. Each is declared once (`key.rs`), beside the reader of its table, and
//! [`tables`] lists all of them for the reference, docs/reference/scene.md.

mod air;
mod clouds;
mod device_range;
mod disc;
mod draw;
mod files;
mod key;
mod lighting;
mod lights;
mod materials;
mod motion;
mod particle_count;
mod phases;
mod picture;
mod right_form;
mod spec;
mod surfaces;
mod weather;

use clouds::{Found, Surroundings};
pub use files::Files;
pub(super) use files::{Listed, OnDisk};
use glam::DVec3;
pub use key::Key;
use key::{Keys, keys, read_tables};
pub(super) use lights::DEFAULT_LIGHTS;
pub(super) use materials::DEFAULT_MATERIAL;
pub(super) use phases::{PhaseSpec, read_phases, set_frames};
pub use picture::MAX_SIDE;
pub use spec::About;
use spec::text;

use super::document::section::Section;
use super::document::tree::Document;
use crate::error::{Error, Result};
use crate::model::scene::Scene;

/// A table of a scene file and its keys.
pub struct Table {
    /// Name as the scene file has it, such as `[film]`, with the kind where keys depend on one;
    /// empty for the keys before every table.
    pub name: String,
    /// Keys in the order in which the resolved scene has them.
    pub keys: Vec<&'static Key>,
}

keys! {
    /// Title of the scene, for reports.
    TITLE: fn title(s) -> String = "title": text("");
}

/// Names of a scene's tables.
const TABLES: [&str; 12] = [
    "film", "camera", "time", "lighting", "draw", "threads", "light", "material", "surface", "air",
    "cloud", "phase",
];

/// Lists the tables of a scene file and their keys.
pub fn tables() -> Vec<Table> {
    let table = |name: &str, lists: &[Keys]| Table {
        name: name.to_owned(),
        keys: lists.iter().copied().flatten().copied().flatten().collect(),
    };
    let mut tables = vec![table("", &[TITLE])];
    tables.extend(picture::TABLES.iter().map(|(name, lists)| table(name, lists)));
    tables.push(table("[draw]", &draw::KEYS));
    tables.push(table("[lighting]", &lighting::KEYS));
    tables.push(table("[air]", &air::KEYS));
    tables.push(table("[[light]]", &[lights::KIND]));
    for (kind, lists) in lights::kinds() {
        tables.push(table(&format!("[[light]] kind = \"{kind}\""), lists));
    }
    tables.push(table("[[material]]", &materials::KEYS));
    tables.push(table("[[material]] path", &materials::PATH_KEYS));
    tables.push(table("[[surface]]", &surfaces::KEYS));
    tables.push(table("[[cloud]]", &clouds::KEYS));
    for (kind, lists) in clouds::kinds() {
        tables.push(table(&format!("[[cloud]] from = \"{kind}\""), lists));
    }
    tables.push(table("[[phase]]", &[phases::PHASE]));
    tables
}

/// Keys that are often looked for under another name, and what to do.
const OTHER_NAMES: [(&[&str], &str); 9] = [
    (&["count", "n", "n_particles", "number"], "`draw.particles` sets the number of particles"),
    (&["size", "resolution"], "`film.width` and `film.height` set the size, as --size does"),
    (&["fov", "angle"], "`camera.fov_y_deg` sets the field of view"),
    (&["pos", "eye", "from", "origin"], "`position` sets the place"),
    (&["look_at", "lookat", "to", "center", "centre"], "`camera.target` sets the direction"),
    (&["color", "colour", "albedo", "diffuse"], "`kd` of a [[material]] sets its colour"),
    (&["energy", "power", "brightness"], "`irradiance` or `intensity` sets a light's strength"),
    (&["density", "opacity", "kappa", "extinction"], "`optical_depth` sets the density of a cloud"),
    (&["fps", "dt", "duration"], "`time.step_s` and `time.frames` set the times of frames"),
];

/// Returns where a key that is unknown at this path may belong.
pub(super) fn hint(path: &str) -> Option<String> {
    let name = path.rsplit('.').next()?;
    let tables = tables();
    let has = |table: &&Table| table.keys.iter().any(|key| key.name == name);
    let of_same_name: Vec<&Table> = tables.iter().filter(has).collect();
    let other = OTHER_NAMES.iter().find(|(names, _)| names.contains(&name)).map(|(_, text)| *text);
    match (&of_same_name[..], other) {
        (_, Some(text)) => Some(text.to_owned()),
        ([], None) => None,
        ([first, ..], None) => Some(match first.name.as_str() {
            "" => format!("`{name}` stands before every table"),
            table => format!("`{name}` is a key of {table}"),
        }),
    }
}

/// A scene and its by-products.
pub(super) struct Read {
    pub scene: Scene,
    /// Every value the scene came to.
    pub resolved: serde_json::Value,
    /// SHA-256 of every file that the scene names, in order.
    pub digests: Vec<[u8; 32]>,
    pub warnings: Vec<String>,
}

/// Adds the lights and the material of a scene that has none.
pub(super) fn add_defaults(document: &mut Document) {
    document.default_to("light", DEFAULT_LIGHTS);
    document.default_to("material", DEFAULT_MATERIAL);
}

/// Reads the scene of a document. `files` gives the files that it names, relative to `folder`. With
/// `seed` N, cloud i has the seed N + i.
pub(super) fn read_scene(
    document: &Document,
    folder: &std::path::Path,
    seed: Option<u32>,
    files: &dyn Files,
) -> Result<Read> {
    let mut root = Section::root(document)?;
    root.expect_keys([&["title"], &TABLES[..]].concat())?;
    let s = &mut root;
    let title = title(s)?;
    let mut warnings = Vec::new();
    let film = picture::read_film(s)?;
    let camera = picture::read_camera(s)?;
    let time = picture::read_time(s)?;
    let draw = draw::read_draw(s)?;
    let threads = picture::read_threads(s)?;
    let lights = lights::read_lights(s)?;
    let materials = materials::read_materials(s, &mut warnings)?;
    let glossy = materials.iter().flat_map(|m| &m.keys).filter(|k| k.brdf.ks != DVec3::ZERO);
    let exponents: Vec<f64> = glossy.map(|k| k.brdf.ns).collect();
    let lighting = lighting::read_lighting(s, &exponents)?;
    let surfaces = surfaces::read_surfaces(s, &materials)?;
    let air = air::read_air(s)?;
    let mut found = Found::default();
    let around = Surroundings {
        folder,
        files,
        materials: &materials,
        air: &air,
        time,
        simulate: threads.simulate,
        seed,
    };
    let read_cloud =
        |s: &mut Section, before: &[_]| clouds::read_cloud(s, before.len(), &around, &mut found);
    let mut clouds = read_tables(s, "cloud", read_cloud)?;
    if draw.n_particles > 0 {
        particle_count::set_particle_count(&mut clouds, draw.n_particles).map_err(
            |what| match s.section("draw") {
                Ok(section) => section.fault("particles", what),
                Err(error) => error,
            },
        )?;
    }
    let Found { digests, notes, terrains, .. } = found;
    warnings.extend(notes);
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
    let (n_particles, n_facets) = (scene.n_particles(), scene.n_solid_facets());
    if u32::try_from(n_particles + n_facets).is_err() {
        let what = format!(
            "{n_particles} particles and {n_facets} facets of surfaces and ground: at most {} \
             together",
            u32::MAX
        );
        return Err(Error::scene(root.place("cloud"), what));
    }
    Ok(Read { scene, resolved: root.finish(), digests, warnings })
}
