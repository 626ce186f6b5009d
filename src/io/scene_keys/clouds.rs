//! Tables `[[cloud]]`, and the files that they name.

use std::path::{Path, PathBuf};

use serde_json::json;
use sha2::{Digest, Sha256};

use super::air::{BASE, put_on_base, read_base};
use super::device_range::{out_of_range, out_of_range_when_grown};
use super::disc::{DISC_KEYS, read_disc};
use super::files::{Files, ListText};
use super::key::{Keys, keys, names};
use super::materials::{
    GROUND, GROUND_POINTS, MATERIAL_NAME, ground_named, ground_points, material_named,
};
use super::motion::{
    GROWTH, GUST, POSITION, TEXTURE, read_growth, read_gust, read_position, read_texture,
};
use super::spec::{choice, integer, number, required_text, vector};
use super::weather::{DETAIL, WEATHER, ground_of, read_settings};
use crate::error::{Error, Result};
use crate::io::bounds::{AMOUNT, COORDINATE, GREATEST, is_carried_place, shortest};
use crate::io::document::section::Section;
use crate::io::mapped_file::MappedFile;
use crate::io::near_file::MISSING;
use crate::io::scene_hash::Content;
use crate::io::weather::{blobs, moving};
use crate::io::{box_file, particle_file, ply};
use crate::model::air::Air;
use crate::model::boxes::{BoxLaw, Form};
use crate::model::cloud::{Cloud, CloudSource, Facing};
use crate::model::growth::Growth;
use crate::model::material::Material;
use crate::model::particle_list::ParticleList;
use crate::model::scene::{Simulate, Time};
use crate::model::terrain::Terrain;

/// Settings of a scene that its clouds' keys refer to.
pub struct Surroundings<'a> {
    /// Folder that names of files are relative to.
    pub folder: &'a Path,
    /// Source of the files.
    pub files: &'a dyn Files,
    pub materials: &'a [Material],
    pub air: &'a Air,
    pub time: Time,
    pub simulate: Simulate,
    /// Seed N of the command line: cloud i has the seed N + i.
    pub seed: Option<u32>,
}

/// Results of reading clouds beside the clouds.
#[derive(Default)]
pub struct Found {
    /// The drawn content of every file, in order.
    pub contents: Vec<Content>,
    /// Notes about the files for the user.
    pub notes: Vec<String>,
    /// Ground under the clouds.
    pub terrains: Vec<Terrain>,
    /// Lines of the particles in the last particle list.
    lines: Vec<usize>,
}

/// A cloud while it is read.
struct Reading<'a, 'b> {
    around: &'a Surroundings<'b>,
    found: &'a mut Found,
    i_cloud: usize,
}

impl Reading<'_, '_> {
    /// Notes that the file of the cloud gives it no particles.
    fn note_empty(&mut self, path: &Path, why: &str) {
        let note =
            format!("cloud {}: {}: {why}, so the cloud is empty", self.i_cloud, path.display());
        self.found.notes.push(note);
    }
}

/// A kind of cloud: its keys beside those of every cloud, and the reader of its source.
#[derive(Clone, Copy)]
struct CloudKind {
    lists: &'static [Keys],
    read: fn(&mut Section, &mut Reading) -> Result<CloudSource>,
    default_facing: &'static str,
}

const BOXES_KIND: CloudKind = CloudKind {
    lists: &[FILE, BOX_LAW, BASE, GROWTH],
    read: read_boxes,
    default_facing: "outward",
};

const KINDS: &[(&str, CloudKind)] = &[
    ("boxes", BOXES_KIND),
    ("particles", CloudKind { lists: &[FILE, BASE, GROWTH], read: read_particles, ..BOXES_KIND }),
    (
        "disc",
        CloudKind {
            lists: &DISC_KEYS,
            read: |s, reading| read_disc(s, reading.around.air).map(CloudSource::Disc),
            ..BOXES_KIND
        },
    ),
    (
        "weather",
        CloudKind {
            lists: &[FILE, WEATHER, DETAIL, GROUND, GROUND_POINTS, BASE, GROWTH],
            read: read_weather,
            default_facing: "up",
        },
    ),
];

/// Keys of every cloud.
pub const KEYS: [Keys; 7] = [FROM, POSITION, CLOUD, GUST, TEXTURE, MATERIAL_NAME, SEED];

keys! {
    /// Source of the cloud's particles, which its other keys follow from.
    FROM: fn kind(s) -> CloudKind = "from": choice("", KINDS).required();
}

keys! {
    /// File that the cloud is made from, relative to the scene's folder: a box file (P Table 1), a
    /// particle list (CSV or PLY), or WRF output (NetCDF).
    FILE: fn file(s) -> String = "file": required_text();
}

keys! { BOX_LAW: fn box_law(s) -> BoxLaw { BoxLaw;
    /// How P (1)–(11) are read: with positions centred in the box and radii that obey P (9), or as
    /// printed.
    form: choice("centred", &Form::NAMES);
    /// Optical depth through the centre of a particle of the box's mean radius.
    optical_depth: number(1.0, AMOUNT);
    /// Factor on the radii of the box file.
    radius_scale: number(1.0, AMOUNT);
}}

keys! { CLOUD: fn cloud(s, source: CloudSource, kind: CloudKind, reading: &Reading) -> Cloud {
    Cloud;
    position => read_position(s)?;
    /// Velocity of the cloud; of a disc's particles, which leave the disc where it is.
    wind: vector([0.0; 3], COORDINATE), "unit/s";
    gust => read_gust(s)?;
    growth => match source {
        CloudSource::Disc(_) => Growth::NONE,
        _ => read_growth(s)?,
    };
    texture => read_texture(s)?;
    i_material => material_named(s, reading.around.materials)?;
    /// Direction of facets where the density around them has none: away from the cloud's centre, or
    /// up (the default of weather files).
    facing: choice("outward", &Facing::NAMES)
        => |facing| facing.or(kind.default_facing).take(s, "facing");
    seed => read_seed(s, reading)?;
    source => source;
}}

keys! {
    /// Seed of the cloud's random numbers. Without it, cloud i (from 0) has the seed i + 1.
    SEED: fn own_seed(s, default: u32) -> u32 = "seed": integer(1, 0, u32::MAX)
        => |seed| seed.or(default).take(s, "seed");
}

/// Lists the kinds of clouds and the keys of each beside those of every cloud.
pub fn kinds() -> impl Iterator<Item = (&'static str, &'static [Keys])> {
    KINDS.iter().map(|(name, kind)| (*name, kind.lists))
}

/// Reads cloud `i_cloud`.
pub fn read_cloud(
    s: &mut Section,
    i_cloud: usize,
    around: &Surroundings,
    found: &mut Found,
) -> Result<Cloud> {
    let kind = kind(s)?;
    s.expect_keys(names(&[&KEYS, kind.lists].concat()))?;
    let n_terrains = found.terrains.len();
    found.lines.clear();
    let mut reading = Reading { around, found, i_cloud };
    let source = (kind.read)(s, &mut reading)?;
    // For a disc the base is where its particles condense, and its reader has read it.
    let is_disc = matches!(source, CloudSource::Disc(_));
    let base = if is_disc { None } else { read_base(s)?.height(around.air) };
    let mut cloud = cloud(s, source, kind, &reading)?;
    let has_ground = found.terrains.len() > n_terrains;
    if has_ground && (base.is_some() || cloud.growth != Growth::NONE) {
        return Err(s.fault(
            "ground",
            "expected \"none\" where a `base` or `grow_to` takes the cloud away from its heights",
        ));
    }
    let most = shortest(GREATEST);
    if let Some(base) = base {
        put_on_base(&mut cloud, base);
        if !is_carried_place(cloud.position) {
            let what = format!("puts the cloud's origin too far: expected at most {most}");
            return Err(s.fault("base", what));
        }
    }
    if let Some(what) = out_of_range(&cloud, &found.lines) {
        return Err(s.fault(if is_disc { "from" } else { "file" }, what));
    }
    if let Some(what) = out_of_range_when_grown(&cloud) {
        return Err(s.fault("grow_to", what));
    }
    // Origins run along straight lines, so the first and the last frame's are the farthest.
    let Time { start_s, n_frames, .. } = around.time;
    for (time_s, when) in [(start_s, "first"), (around.time.at(n_frames - 1), "last")] {
        if !is_carried_place(cloud.origin_at(time_s)) {
            let what = format!(
                "carries the cloud's origin too far: expected at most {most} at the {when} frame"
            );
            return Err(s.fault("wind", what));
        }
    }
    Ok(cloud)
}

fn read_seed(s: &mut Section, reading: &Reading) -> Result<u32> {
    // Seeds wrap around, so that every u32 is a seed for every number of clouds.
    let i = reading.i_cloud as u32;
    let own = own_seed(s, i.wrapping_add(1))?;
    let seed = reading.around.seed.map_or(own, |seed| seed.wrapping_add(i));
    s.record("seed", json!(seed));
    Ok(seed)
}

/// Calls `open` with the path that `file` names. A failure of the file system is reported at the
/// key; a fault inside the file keeps its place there.
fn open_file<T>(
    s: &mut Section,
    folder: &Path,
    open: impl FnOnce(&Path) -> Result<T>,
) -> Result<(T, PathBuf)> {
    let name = file(s)?;
    let path = folder.join(&name);
    match open(&path) {
        Err(Error::Io { path, what }) => {
            let is_lost = what == MISSING && Path::new(&name).is_relative();
            let remark = if is_lost { "; names are relative to the scene's folder" } else { "" };
            Err(s.fault("file", format!("{}: {what}{remark}", path.display())))
        }
        opened => Ok((opened?, path)),
    }
}

/// Reads the text file that `file` names.
fn read_named(s: &mut Section, reading: &mut Reading, first: &str) -> Result<(String, PathBuf)> {
    let around = reading.around;
    let (text, path) = open_file(s, around.folder, |path| around.files.text(path, first))?;
    reading.found.contents.push(Content::Digest(Sha256::digest(&text).into()));
    Ok((text, path))
}

fn read_boxes(s: &mut Section, reading: &mut Reading) -> Result<CloudSource> {
    let (text, path) = read_named(s, reading, box_file::FIRST)?;
    let boxes = box_file::parse(&text, &path)?;
    if boxes.iter().all(|b| b.n_particles == 0) {
        reading.note_empty(&path, "its boxes have no particles");
    }
    Ok(CloudSource::Boxes { boxes, law: box_law(s)? })
}

fn read_particles(s: &mut Section, reading: &mut Reading) -> Result<CloudSource> {
    enum Opened {
        Text(ListText),
        Ply(MappedFile),
    }
    let files = reading.around.files;
    let open = |path: &Path| match ply::is_named(path) {
        true => files.mapped(path).map(Opened::Ply),
        false => files.list(path, particle_file::FIRST).map(Opened::Text),
    };
    let (opened, path) = open_file(s, reading.around.folder, open)?;
    let particles = match opened {
        Opened::Text(text) => {
            let text = text.text(&path, particle_file::FIRST)?;
            reading.found.contents.push(Content::Digest(Sha256::digest(text).into()));
            let (particles, lines) = particle_file::parse(text, &path)?;
            reading.found.lines = lines;
            particles.into()
        }
        Opened::Ply(file) => {
            let ply::Read { particles, harmonics } = ply::parse(file.bytes(), &path)?;
            let list = ParticleList::with_harmonics(particles, harmonics);
            reading.found.contents.push(Content::List(list.clone()));
            list
        }
    };
    if particles.is_empty() {
        reading.note_empty(&path, "it has a header and no particles");
    }
    Ok(CloudSource::Particles(particles))
}

fn read_weather(s: &mut Section, reading: &mut Reading) -> Result<CloudSource> {
    let around = reading.around;
    let (file, _) = open_file(s, around.folder, |path| around.files.weather(path))?;
    let seed = read_seed(s, reading)?;
    let settings = read_settings(s, &file, around.simulate, seed)?;
    if let Some(note) = blobs::note(&file) {
        reading.found.notes.push(format!("cloud {}: {note}", reading.i_cloud));
    }
    let found = &mut *reading.found;
    let n_points = ground_points(s)?;
    if let Some(i_material) = ground_named(s, around.materials)? {
        let origin = read_position(s)?;
        let terrain = ground_of(s, &file, &settings, origin, (i_material, n_points))?;
        found.contents.push(blobs::digest_of_ground(&terrain).into());
        found.terrains.push(terrain);
    }
    if settings.speed != 0.0 {
        // Any of its steps may be asked for later.
        found.contents.push(file.digest()?.into());
        return Ok(CloudSource::Animated(moving::moving(file, settings, seed)?));
    }
    let list = ParticleList::from(blobs::particles(&file, &settings, seed)?);
    found.contents.push(Content::List(list.clone()));
    Ok(CloudSource::Particles(list))
}
