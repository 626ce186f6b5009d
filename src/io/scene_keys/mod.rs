//! Keys of a scene file. Each is declared once (`key.rs`), beside the reader of its table, and
//! [`tables`] lists all of them for the reference, docs/reference/scene.md.

mod air;
mod clouds;
mod device_range;
mod disc;
mod draw;
mod files;
mod grounds;
mod key;
mod lighting;
mod lights;
mod materials;
mod motion;
mod particle_count;
mod phases;
mod picture;
mod right_form;
mod sky;
mod spec;
mod surfaces;
mod weather;

use clouds::{Found, Surroundings};
pub use files::Files;
pub(super) use files::{Listed, OnDisk};
use glam::DVec3;
pub use key::Key;
use key::{Keys, keys, read_tables};
pub use lights::DEFAULT_LIGHTS;
pub(super) use materials::DEFAULT_MATERIAL;
pub(super) use phases::{PhaseSpec, read_phases, set_frames};
pub use picture::MAX_SIDE;
pub use spec::About;
use spec::text;

use super::document::section::Section;
use super::document::tree::{Document, KeyNames, without_numbers};
use super::scene_hash::Content;
use crate::error::{Error, Result};
use crate::model::film::Metering;
use crate::model::scene::{FacetCount, Lighting, LightingMode, Scene};
use crate::model::sky::sunlit_exposure;

/// A table of a scene file and its keys.
pub struct Table {
    /// Name as the scene file has it, such as `[film]`, with the kind where keys depend on one;
    /// empty for the keys before every table.
    pub name: String,
    /// Keys in the order in which the resolved scene has them.
    pub keys: Vec<&'static Key>,
}

impl Table {
    /// Returns the path of the table without numbers of items, as [`KeyNames`] has it, and the kind
    /// that its keys belong to.
    fn path_and_kind(&self) -> (String, Option<&str>) {
        let (table, rest) = self.name.split_once(' ').unwrap_or((&self.name, ""));
        let table = table.trim_matches(['[', ']']);
        match rest {
            "path" => (format!("{table}.path"), None),
            rest => (table.to_owned(), rest.split('"').nth(1)),
        }
    }

    fn has(&self, name: &str) -> bool {
        self.keys.iter().any(|key| key.name == name)
    }
}

/// Names of a scene's keys.
pub(super) const KEY_NAMES: KeyNames = KeyNames { hint, has: has_key };

/// Returns whether a table has a key if it is of this kind, or of any kind where none is given.
fn has_key(path: &str, kind: Option<&str>, name: &str) -> bool {
    tables().iter().any(|table| {
        let (of_path, of_kind) = table.path_and_kind();
        let is_of_kind = of_kind.is_none() || kind.is_none() || of_kind == kind;
        of_path == path && is_of_kind && table.has(name)
    })
}

keys! {
    /// Title of the scene, for reports.
    TITLE: fn title(s) -> String = "title": text("");
}

/// Names of a scene's tables.
const TABLES: [&str; 14] = [
    "film", "camera", "time", "lighting", "draw", "threads", "light", "material", "surface",
    "ground", "air", "sky", "cloud", "phase",
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
    tables.push(table("[sky]", &sky::KEYS));
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
    tables.push(table("[[ground]]", &grounds::KEYS));
    tables.push(table("[[phase]]", &[phases::PHASE]));
    tables
}

/// Keys that are often looked for under another name, and what to do. A name with a dot is that of
/// a key in one table.
const OTHER_NAMES: [(&[&str], &str); 13] = [
    (&["count", "n", "n_particles", "number"], "`draw.particles` sets the number of particles"),
    (&["size", "resolution"], "`film.width` and `film.height` set the size, as --size does"),
    (&["fov", "angle"], "`camera.fov_y_deg` sets the field of view"),
    (&["pos", "eye", "from", "origin"], "`position` sets the place"),
    (
        &["camera.direction", "camera.forward", "camera.yaw", "camera.pitch", "camera.rotation"],
        "the camera looks at the point `camera.target`",
    ),
    (&["look_at", "lookat", "to", "center", "centre"], "`camera.target` sets the direction"),
    (&["light.irradiance"], "`intensity` sets the strength of a point or a spot"),
    (&["light.intensity"], "`irradiance` sets the strength of a directional light, a sky or a sun"),
    (&["light.target"], "`direction` of a light is the way that its light travels"),
    (&["color", "colour", "albedo", "diffuse"], "`kd` of a [[material]] sets its colour"),
    (&["energy", "power", "brightness"], "`irradiance` or `intensity` sets a light's strength"),
    (&["density", "opacity", "kappa", "extinction"], "`optical_depth` sets the density of a cloud"),
    (&["fps", "dt", "duration"], "`time.step_s` and `time.frames` set the times of frames"),
];

/// Returns where a key that is unknown at this path may belong.
fn hint(path: &str) -> Option<String> {
    let (table, name) = (path.split('.').next()?, path.rsplit('.').next()?);
    let in_table = format!("{table}.{name}");
    let is_other = |other: &&str| *other == name || *other == in_table;
    let other = OTHER_NAMES.iter().find(|(names, _)| names.iter().any(is_other));
    if let Some((_, text)) = other {
        return Some((*text).to_owned());
    }
    let tables = tables();
    let of_same_name: Vec<&Table> = tables.iter().filter(|table| table.has(name)).collect();
    let at = without_numbers(path);
    let at = at.rsplit_once('.').map_or("", |(table, _)| table);
    // A table of the same name and another kind is nearer than any other.
    let is_near = |of: &&&Table| of.path_and_kind().0 == at;
    let near: Vec<&str> = of_same_name.iter().filter(is_near).map(|of| of.name.as_str()).collect();
    if !near.is_empty() {
        return Some(format!("`{name}` is a key of {}", near.join(" and of ")));
    }
    let first = of_same_name.first()?;
    Some(match (first.name.as_str(), first.path_and_kind().0) {
        ("", _) => format!("`{name}` stands before every table"),
        (table, path) if table.starts_with("[[") && !path.contains('.') => {
            format!("`{name}` is a key of {table} (`{path}.0.{name}`)")
        }
        (table, path) if !path.contains('.') => {
            format!("`{name}` is a key of {table} (`{path}.{name}`)")
        }
        (table, _) => format!("`{name}` is a key of {table}"),
    })
}

/// A scene and its by-products.
pub(super) struct Read {
    pub scene: Scene,
    /// Every value the scene came to.
    pub resolved: serde_json::Value,
    /// The drawn content of every file that the scene names, in order.
    pub contents: Vec<Content>,
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
    let (mut film, metering) = picture::read_film(s)?;
    let camera = picture::read_camera(s)?;
    let time = picture::read_time(s)?;
    let draw = draw::read_draw(s)?;
    let threads = picture::read_threads(s)?;
    let materials = materials::read_materials(s, &mut warnings)?;
    let sky = sky::read_sky(s, &materials)?;
    let sky = sky.map(|settings| lights::under_sky(s, settings)).transpose()?;
    let lights = lights::read_lights(s, sky.as_ref())?;
    if metering == Metering::Sunlit {
        film.exposure *= sunlit_exposure(&lights);
    }
    let glossy = materials.iter().flat_map(|m| &m.keys).filter(|k| k.brdf.ks != DVec3::ZERO);
    let exponents: Vec<f64> = glossy.map(|k| k.brdf.ns).collect();
    let lighting = lighting::read_lighting(s, &exponents)?;
    let surfaces = surfaces::read_surfaces(s, &materials)?;
    let mut terrains = grounds::read_grounds(s, &materials)?;
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
    let Found { contents, notes, terrains: of_files, .. } = found;
    warnings.extend(notes);
    terrains.extend(of_files);
    let terrains = terrains.into_iter().map(|t| t.covered(&materials)).collect();
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
        sky,
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
    warnings.extend(grouped(&scene));
    if scene.sky.is_none() && scene.seas().any(|sea| sea.is_some()) {
        warnings.push("cover = \"sea\" mirrors nothing without a [sky]: set sky.model".to_owned());
    }
    Ok(Read { scene, resolved: root.finish(), contents, warnings })
}

/// Says for which clouds the default makes fewer facets than particles.
fn grouped(scene: &Scene) -> impl Iterator<Item = String> {
    let Lighting { facets_per_cloud, mode, .. } = scene.lighting;
    let is_default = facets_per_cloud == FacetCount::Auto && mode != LightingMode::None;
    let clouds = scene.clouds.iter().enumerate().filter(move |_| is_default);
    clouds.filter_map(|(i, cloud)| {
        let (n, n_facets) = (cloud.n_particles(), scene.n_cloud_facets(cloud));
        (n_facets < n).then(|| {
            format!(
                "cloud {i}: {n} particles share the light and colour of {n_facets} facets; \
                 lighting.facets_per_cloud = 0 makes one facet for each"
            )
        })
    })
}
