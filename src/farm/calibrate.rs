//! What work takes on a class of devices: runs of a few frames at several sizes, timed from one end
//! to the other as a shard is, and the cost model that is fitted to them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::amounts::{work_of_beginning, work_of_frames};
use super::cost::{Fit, Timed, fit};
use super::failing::of_io;
use super::plan::{self, PictureFormat, Plan, Wish};
use super::run::{self, How};
use super::store::{Manifest, Standing, Store};
use super::synced;
use crate::error::{Error, Result};
use crate::io::scene_file;
use crate::io::text_file::{RECORD_LIMIT, read_result};
use crate::timing::machine::{self, Cpu, Device};

pub const SCHEMA_VERSION: u32 = 1;

/// A calibration's file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    pub schema: u32,
    pub nimbus: String,
    pub revision: String,
    /// UTC, ISO 8601.
    pub date: String,
    /// The class: what this device and processor take is taken for all of it.
    pub device: Device,
    pub cpu: Cpu,
    pub environment: BTreeMap<String, String>,
    /// [`plan::Work::kind`] of what was timed: other work takes other times.
    pub of: String,
    pub fit: Fit,
    pub rows: Vec<Row>,
}

/// One run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Its scene, and what of it was done.
    pub what: String,
    pub timed: Timed,
}

/// Sizes of the pictures, by the scene's own along each side: what grows with the pixels and what
/// does not come apart.
const SIZES: [f64; 3] = [0.5, 0.75, 1.0];

/// How many runs [`calibrate`] makes of so many scenes.
pub fn n_runs(n_scenes: usize) -> usize {
    // One that is not counted: the first compiles shaders for all that follow.
    1 + 2 * SIZES.len() * n_scenes
}

/// Runs every scene with one frame and with `frames`, at every size, and fits the model.
pub fn calibrate(
    scenes: &[PathBuf],
    set: &[String],
    frames: u32,
    how: &How<'_>,
) -> Result<Calibration> {
    let mut rows = Vec::new();
    let mut device = None;
    for scene in scenes {
        let film = scene_file::load(scene, set, None)?.scene.film;
        for share in SIZES {
            let side = |n: u32| ((f64::from(n) * share).round() as u32).max(1);
            let size = [side(film.width), side(film.height)];
            for n in [1, frames] {
                if rows.is_empty() && device.is_none() {
                    device = Some(timed(scene, set, size, n, how)?.1);
                }
                rows.push(timed(scene, set, size, n, how)?.0);
            }
        }
    }
    let Some(device) = device else { return Err(Error::usage("no scene to calibrate by")) };
    let of = plan::Work::Frames { first: 0, n: 1, format: PictureFormat::Png }.kind();
    fitted(of, rows, (device, machine::cpu(), machine::environment()))
}

/// What of shards has to be the same where their times are one model's.
#[derive(Debug, Clone)]
struct Class {
    of: String,
    code: String,
    device: Device,
    cpu: Cpu,
    environment: BTreeMap<String, String>,
}

impl Class {
    fn words(&self) -> String {
        let Class { of, code, device, cpu, environment } = self;
        format!(
            "{of}, build {code}, {}, {}, environment {environment:?}",
            device.class(),
            cpu.class()
        )
    }
}

/// Fits the model to farms that are done: to every shard of which it is known what takes time in
/// it, and that one run did from its beginning to its end.
pub fn of_farms(folders: &[PathBuf]) -> Result<Calibration> {
    let (mut rows, mut class): (_, Option<Class>) = (Vec::new(), None);
    for folder in folders {
        let plan = Plan::read(folder)?;
        let (store, scene) = (Store::open(folder), plan.scene.file.display());
        for shard in &plan.shards {
            let (Some(work), Standing::Verified(manifest)) =
                (shard.counted, store.standing(&plan, shard))
            else {
                continue;
            };
            let Manifest { device, cpu, environment, seconds, n_resumed, .. } = *manifest;
            let here =
                Class { of: plan.work.kind(), code: plan.code.clone(), device, cpu, environment };
            let class = class.get_or_insert_with(|| here.clone());
            if class.words() != here.words() {
                return Err(Error::usage(format!(
                    "{}: shard {} was done by {}; expected what did the first, {}",
                    folder.display(),
                    shard.index,
                    here.words(),
                    class.words()
                )));
            }
            if n_resumed == 0 {
                let what = format!("{scene}, {} {:?}", plan.work.noun(), shard.items());
                rows.push(Row { what, timed: Timed { setups: 1.0, work, seconds } });
            }
        }
    }
    let Some(Class { of, device, cpu, environment, .. }) = class else {
        return Err(Error::usage(
            "no shard of these farms is done of which it is known what takes time in it",
        ));
    };
    fitted(of, rows, (device, cpu, environment))
}

fn fitted(
    of: String,
    rows: Vec<Row>,
    (device, cpu, environment): (Device, Cpu, BTreeMap<String, String>),
) -> Result<Calibration> {
    let all: Vec<Timed> = rows.iter().map(|row| row.timed).collect();
    Ok(Calibration {
        schema: SCHEMA_VERSION,
        nimbus: env!("CARGO_PKG_VERSION").into(),
        revision: machine::revision().into(),
        date: machine::utc_now(),
        device,
        cpu,
        environment,
        of,
        fit: fit(&all).map_err(Error::usage)?,
        rows,
    })
}

/// A shard of `n` frames, as any farm's, in a folder that goes with it.
fn timed(
    scene: &Path,
    set: &[String],
    [width, height]: [u32; 2],
    n: u32,
    how: &How<'_>,
) -> Result<(Row, Device)> {
    let folder = Folder::new()?;
    let mut set = set.to_vec();
    set.extend([format!("film.width={width}"), format!("film.height={height}")]);
    let work = plan::Work::Frames { first: 0, n, format: PictureFormat::Png };
    let (scene_file, sizes) = (scene.to_owned(), vec![n]);
    let plan = Plan::new(Wish {
        scene: scene_file,
        set,
        seed: None,
        shaders: None,
        device: None,
        work,
        sizes,
        counted: vec![],
        predicted_s: None,
        predicted_for: None,
    })?;
    plan.write(&folder.0)?;
    let loaded = plan.scene_as_planned()?;
    let begin = Instant::now();
    run::run(&folder.0, 0, how)?;
    let seconds = begin.elapsed().as_secs_f64();
    let begin = work_of_beginning(&loaded, 0)?;
    let work = work_of_frames(&loaded, 0..n)?.into_iter().fold(begin, |sum, of| sum + of);
    let device = match Store::open(&folder.0).standing(&plan, &plan.shards[0]) {
        Standing::Verified(manifest) => manifest.device,
        other => {
            return Err(Error::Fault {
                what: format!("a shard that was just done is not there: {other:?}"),
            });
        }
    };
    let timed = Timed { setups: 1.0, work, seconds };
    let what = format!("{}, {width}x{height}, {n} frames", scene.display());
    Ok((Row { what, timed }, device))
}

/// So many names are tried for a folder that nobody else has.
const N_NAMES: u32 = 1000;

/// A new folder that is gone when it is dropped.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Result<Folder> {
        let (base, pid) = (std::env::temp_dir(), std::process::id());
        for k in 0..N_NAMES {
            let path = base.join(format!("nimbus-calibrate-{pid}-{k}"));
            match std::fs::create_dir(&path) {
                Ok(()) => return Ok(Folder(path)),
                // Somebody's of the same number: in another container, or before the machine was
                // started again.
                Err(cause) if cause.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(cause) => return Err(of_io(&path, &cause)),
            }
        }
        Err(Error::io(
            &base,
            format!("{N_NAMES} folders nimbus-calibrate-{pid}-… are there already"),
        ))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What stays is in the system's folder for such.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Calibration {
    /// Whom it is for.
    pub fn class(&self) -> plan::Class {
        plan::Class { device: self.device.class(), cpu: self.cpu.class() }
    }

    pub fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).map_err(|cause| Error::io(path, cause))?;
        synced::write(path, format!("{text}\n").as_bytes())
    }

    pub fn read(path: &Path) -> Result<Calibration> {
        let wrong = |cause: &dyn std::fmt::Display| {
            Error::io(path, format!("not a calibration of nimbus: {cause}"))
        };
        let read: Calibration = serde_json::from_str(&read_result(path, RECORD_LIMIT)?)
            .map_err(|cause| wrong(&cause))?;
        if read.schema != SCHEMA_VERSION {
            return Err(wrong(&format!(
                "it is of schema {}, expected {SCHEMA_VERSION}",
                read.schema
            )));
        }
        read.fit.model.check().map_err(|what| wrong(&what))?;
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_one_s_own_and_go() {
        let [a, b] = [Folder::new().unwrap(), Folder::new().unwrap()];
        let paths = [a.0.clone(), b.0.clone()];
        assert!(paths[0] != paths[1] && paths.iter().all(|path| path.is_dir()));
        drop((a, b));
        assert!(!paths.iter().any(|path| path.exists()));
    }
}
