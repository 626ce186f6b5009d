//! The scene's clouds, and the files they name.

use std::path::{Path, PathBuf};

use glam::DVec3;
use serde_json::json;
use sha2::{Digest, Sha256};

use super::magnitude::{AMOUNT, COORDINATE, DIVISOR, GREATEST, is_carried_place, shortest};
use super::scene_air::{put_on_base, read_base};
use super::scene_disc::{self, read_disc};
use super::scene_lights::{ground_named, material_named};
use super::scene_weather;
use super::text_file::{DATA_LIMIT, read_text};
use super::toml_section::{Bounds, Section};
use super::weather::wrf::{self, WeatherFile};
use super::weather_steps;
use super::{box_file, magnitude, particle_file};
use crate::error::{Error, Result};
use crate::model::air::Air;
use crate::model::boxes::{CloudBox, Form};
use crate::model::cloud::{Cloud, CloudSource, Facing};
use crate::model::growth::{Growth, MAX_SCALE, MIN_SCALE};
use crate::model::gust::{Gust, MAX_WAVES};
use crate::model::material::Material;
use crate::model::scene::Simulate;
use crate::model::terrain::Terrain;
use crate::model::texture::{Choice, MAX_STRENGTH, Texture};

/// The files that a scene names.
pub trait Files {
    /// The text of one, by its path and what such a file begins with.
    fn text(&self, path: &Path, first: &str) -> Result<String>;

    /// A weather file, opened.
    fn weather(&self, path: &Path) -> Result<WeatherFile> {
        Err(Error::Io {
            path: path.to_owned(),
            what: "weather files are read from the disk alone".to_owned(),
        })
    }
}

impl<F: Fn(&Path, &str) -> Result<String>> Files for F {
    fn text(&self, path: &Path, first: &str) -> Result<String> {
        self(path, first)
    }
}

/// Files as they lie on the disk.
pub struct OnDisk;

impl Files for OnDisk {
    fn text(&self, path: &Path, first: &str) -> Result<String> {
        read_text(path, DATA_LIMIT, first)
    }

    fn weather(&self, path: &Path) -> Result<WeatherFile> {
        wrf::open(path)
    }
}

/// What a cloud's keys refer to.
pub struct CloudReader<'a> {
    folder: &'a Path,
    materials: &'a [Material],
    air: &'a Air,
    seed: Option<u32>,
    simulate: Simulate,
    files: &'a dyn Files,
    /// Of every file read, in order.
    pub digests: Vec<[u8; 32]>,
    /// What the user should know of what was read.
    pub notes: Vec<String>,
    /// The ground under the clouds read so far.
    pub terrains: Vec<Terrain>,
}

/// Keys of every cloud, after those of its source.
macro_rules! with_cloud_keys {
    ($($own:literal),*) => {
        &[$($own,)* "material", "facing", "texture", "texture_strength", "position", "base", "wind", "gust", "gust_length", "gust_period_s", "gust_waves", "grow_to", "grow_time_s", "seed"]
    };
}

const LIST_KEYS: &[&str] = with_cloud_keys!["from", "file"];
const WEATHER_KEYS: &[&str] =
    with_cloud_keys!["from", "file", "step", "particles", "exaggeration", "speed", "ground"];
const BOX_KEYS: &[&str] = with_cloud_keys!["from", "file", "form", "optical_depth", "radius_scale"];

#[derive(Clone, Copy)]
enum SourceKind {
    Boxes,
    Particles,
    Disc,
    Weather,
}

impl<'a> CloudReader<'a> {
    /// Files are looked for in `folder`; `seed` N gives cloud i the seed N + i.
    pub fn new(
        folder: &'a Path,
        (materials, air): (&'a [Material], &'a Air),
        seed: Option<u32>,
        simulate: Simulate,
        files: &'a dyn Files,
    ) -> CloudReader<'a> {
        CloudReader {
            folder,
            materials,
            air,
            seed,
            simulate,
            files,
            digests: Vec::new(),
            notes: Vec::new(),
            terrains: Vec::new(),
        }
    }

    /// The text of the file that `file` names, which begins with `first`. What the file system
    /// refuses is reported where the scene names it; what is wrong inside stays where it is.
    fn read_named(&mut self, s: &mut Section, first: &str) -> Result<(String, PathBuf)> {
        let path = self.folder.join(s.required_string("file")?);
        let text = self.files.text(&path, first).map_err(|e| match e {
            Error::Io { path, what } => s.fault("file", format!("{}: {what}", path.display())),
            other => other,
        })?;
        self.digests.push(Sha256::digest(&text).into());
        Ok((text, path))
    }

    /// The weather file that `file` names, as [`CloudReader::read_named`] reports it.
    fn read_weather(&self, s: &mut Section) -> Result<WeatherFile> {
        let path = self.folder.join(s.required_string("file")?);
        self.files.weather(&path).map_err(|e| match e {
            Error::Io { path, what } => s.fault("file", format!("{}: {what}", path.display())),
            other => other,
        })
    }

    fn read_seed(&self, s: &mut Section, i_cloud: usize) -> Result<u32> {
        // Numbered with wrap-around, so that every u32 is a seed for every number of clouds.
        let i = i_cloud as u32;
        let own = s.u32("seed", i.wrapping_add(1), 0, u32::MAX)?;
        let seed = self.seed.map_or(own, |seed| seed.wrapping_add(i));
        s.record("seed", json!(seed));
        Ok(seed)
    }
}

pub fn read_cloud(s: &mut Section, i_cloud: usize, reader: &mut CloudReader) -> Result<Cloud> {
    let from = [
        ("boxes", SourceKind::Boxes),
        ("particles", SourceKind::Particles),
        ("disc", SourceKind::Disc),
        ("weather", SourceKind::Weather),
    ];
    let mut lines = Vec::new();
    let n_terrains = reader.terrains.len();
    let kind = s.required_choice("from", &from, &[])?;
    let source = match kind {
        SourceKind::Boxes => read_boxes(s, reader)?,
        SourceKind::Particles => {
            s.expect_keys(LIST_KEYS, &[])?;
            let (text, path) = reader.read_named(s, particle_file::FIRST)?;
            let (particles, of_particles) = particle_file::parse_with_lines(&text, &path)?;
            lines = of_particles;
            CloudSource::Particles(particles)
        }
        SourceKind::Disc => {
            s.expect_keys(scene_disc::KEYS, &[])?;
            CloudSource::Disc(read_disc(s, reader.air)?)
        }
        SourceKind::Weather => {
            s.expect_keys(WEATHER_KEYS, &[])?;
            let file = reader.read_weather(s)?;
            let keys = scene_weather::read_keys(s, &file, reader.simulate)?;
            reader.notes.extend(
                scene_weather::notes(&file)
                    .into_iter()
                    .map(|note| format!("cloud {i_cloud}: {note}")),
            );
            let seed = reader.read_seed(s, i_cloud)?;
            if let Some(i_material) = ground_named(s, reader.materials)? {
                let origin = s.vec3("position", DVec3::ZERO, COORDINATE)?;
                let terrain = scene_weather::terrain(s, &file, &keys, origin, i_material)?;
                reader.digests.push(scene_weather::digest_of_ground(&terrain));
                reader.terrains.push(terrain);
            }
            if keys.speed != 0.0 {
                // Whichever of its steps are asked for later.
                reader.digests.push(file.digest()?);
                CloudSource::Animated(weather_steps::moving(file, keys, seed)?)
            } else {
                let particles = scene_weather::particles(&file, &keys, seed)?;
                reader.digests.push(scene_weather::digest(&particles));
                CloudSource::Particles(particles)
            }
        }
    };
    let is_disc = matches!(source, CloudSource::Disc(_));
    let is_weather = matches!(kind, SourceKind::Weather);
    // Of a disc it is where its particles condense.
    let base = if is_disc { None } else { read_base(s)?.height(reader.air) };
    let mut cloud = Cloud {
        source,
        position: s.vec3("position", DVec3::ZERO, COORDINATE)?,
        wind: s.vec3("wind", DVec3::ZERO, COORDINATE)?,
        gust: read_gust(s)?,
        growth: if is_disc { Growth::NONE } else { read_growth(s)? },
        texture: read_texture(s)?,
        i_material: material_named(s, reader.materials)?,
        facing: s.choice(
            "facing",
            if is_weather { "up" } else { "outward" },
            &Facing::NAMES,
            &[],
        )?,
        seed: reader.read_seed(s, i_cloud)?,
    };
    let has_ground = reader.terrains.len() > n_terrains;
    if has_ground && (base.is_some() || cloud.growth != Growth::NONE) {
        return Err(s.fault(
            "ground",
            "expected \"none\" where a `base` or `grow_to` takes the cloud away from its heights",
        ));
    }
    if let Some(base) = base {
        put_on_base(&mut cloud, base);
        if !is_carried_place(cloud.position) {
            let what =
                format!("puts the cloud's origin too far: expected at most {}", shortest(GREATEST));
            return Err(s.fault("base", what));
        }
    }
    if let Some(what) = magnitude::beyond(&cloud, &lines) {
        return Err(s.fault(if is_disc { "from" } else { "file" }, what));
    }
    match magnitude::grown_beyond(&cloud) {
        Some(what) => Err(s.fault("grow_to", what)),
        None => Ok(cloud),
    }
}

fn read_texture(s: &mut Section) -> Result<Texture> {
    Ok(Texture {
        choice: s.choice("texture", "none", &Choice::NAMES, &[])?,
        strength: s.f64(
            "texture_strength",
            Texture::NONE.strength,
            Bounds::Within(0.0, MAX_STRENGTH),
        )?,
    })
}

fn read_growth(s: &mut Section) -> Result<Growth> {
    Ok(Growth {
        to: s.f64("grow_to", Growth::NONE.to, Bounds::Within(MIN_SCALE, MAX_SCALE))?,
        time_s: s.f64("grow_time_s", Growth::NONE.time_s, DIVISOR)?,
    })
}

/// Gives the clouds that are made from boxes `n` particles together, dealt to the boxes by their
/// counts (largest remainder, of equal ones the first). κ changes against the count, so that the
/// expected optical depth stays. An error says what is wrong with `n`.
pub fn deal(clouds: &mut [Cloud], n: u32) -> std::result::Result<(), String> {
    let counts: Vec<u32> = clouds.iter_mut().flat_map(boxes_of).map(|b| b.n_particles).collect();
    let total: u128 = counts.iter().map(|n| u128::from(*n)).sum();
    if total == 0 {
        return Err("the scene has no cloud made from boxes that has particles".to_owned());
    }
    let quota = |count: u32| {
        (u128::from(n) * u128::from(count) / total, u128::from(n) * u128::from(count) % total)
    };
    let mut shares: Vec<u32> = counts.iter().map(|count| quota(*count).0 as u32).collect();
    let mut by_remainder: Vec<usize> = (0..counts.len()).collect();
    // Stable: of equal ones the first.
    by_remainder.sort_by_key(|i| std::cmp::Reverse(quota(counts[*i]).1));
    let left = n - shares.iter().sum::<u32>();
    for i in by_remainder.into_iter().take(left as usize) {
        shares[i] += 1;
    }
    for (b, share) in clouds.iter_mut().flat_map(boxes_of).zip(shares) {
        b.n_particles = share;
    }
    for (i, cloud) in clouds.iter_mut().enumerate() {
        if let CloudSource::Boxes { optical_depth, .. } = &mut cloud.source {
            *optical_depth *= total as f64 / f64::from(n);
            let wrong = magnitude::beyond(cloud, &[]).or_else(|| magnitude::grown_beyond(cloud));
            if let Some(what) = wrong {
                return Err(format!("makes cloud {i}'s particles too dense: {what}"));
            }
        }
    }
    Ok(())
}

fn boxes_of(cloud: &mut Cloud) -> &mut [CloudBox] {
    match &mut cloud.source {
        CloudSource::Boxes { boxes, .. } => boxes,
        CloudSource::Particles(_) | CloudSource::Disc(_) | CloudSource::Animated(_) => &mut [],
    }
}

fn read_gust(s: &mut Section) -> Result<Gust> {
    Ok(Gust {
        amplitude: s.f64("gust", 0.0, AMOUNT)?,
        length: s.f64("gust_length", 4.0, DIVISOR)?,
        period_s: s.f64("gust_period_s", 8.0, DIVISOR)?,
        n_waves: s.u32("gust_waves", 16, 1, MAX_WAVES)?,
    })
}

fn read_boxes(s: &mut Section, reader: &mut CloudReader) -> Result<CloudSource> {
    s.expect_keys(BOX_KEYS, &[])?;
    let (text, path) = reader.read_named(s, box_file::FIRST)?;
    Ok(CloudSource::Boxes {
        boxes: box_file::parse(&text, &path)?,
        form: s.choice("form", "centred", &Form::NAMES, &[])?,
        optical_depth: s.f64("optical_depth", 1.0, AMOUNT)?,
        radius_scale: s.f64("radius_scale", 1.0, AMOUNT)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(counts: &[u32]) -> Cloud {
        let b = |n: &u32| CloudBox {
            n_particles: *n,
            extent: DVec3::ONE,
            center: DVec3::ZERO,
            radius_max: 1.0,
        };
        let boxes = counts.iter().map(b).collect();
        let source = CloudSource::Boxes {
            boxes,
            form: Form::Centred,
            optical_depth: 1.0,
            radius_scale: 1.0,
        };
        let (gust, growth) = (Gust::CALM, Growth::NONE);
        Cloud {
            facing: crate::model::cloud::Facing::Outward,
            source,
            position: DVec3::ZERO,
            wind: DVec3::ZERO,
            gust,
            growth,
            texture: Texture::NONE,
            i_material: 0,
            seed: 1,
        }
    }

    fn counts(clouds: &mut [Cloud]) -> Vec<u32> {
        clouds.iter_mut().flat_map(boxes_of).map(|b| b.n_particles).collect()
    }

    #[test]
    fn particles_are_dealt_by_the_largest_remainder() {
        let mut clouds = [
            cloud(&[3, 0, 4]),
            Cloud { source: CloudSource::Particles(vec![]), ..cloud(&[]) },
            cloud(&[3]),
        ];
        // 5 · (3, 0, 4, 3)/10 is 1.5, 0, 2, 1.5: one is left, and the first of the two has it.
        deal(&mut clouds, 5).unwrap();
        assert_eq!(counts(&mut clouds), [2, 0, 2, 1]);
        for i in [0, 2] {
            assert!(matches!(clouds[i].source, CloudSource::Boxes { optical_depth: 2.0, .. }));
        }
        deal(&mut clouds, 50_000).unwrap();
        assert_eq!(counts(&mut clouds), [20_000, 0, 20_000, 10_000]);
        assert!(matches!(clouds[0].source, CloudSource::Boxes { optical_depth: 2e-4, .. }));
        assert!(deal(&mut [cloud(&[0])], 7).unwrap_err().contains("no cloud made from boxes"));
        let mut dense = cloud(&[u32::MAX]);
        let CloudSource::Boxes { optical_depth, .. } = &mut dense.source else { panic!() };
        *optical_depth = 1e14;
        assert!(deal(&mut [dense], 1).unwrap_err().contains("too dense"));
    }
}
