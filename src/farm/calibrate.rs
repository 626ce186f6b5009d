//! Timing of work for a cost model: of short animations, or of the shards of finished farms.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::calibration::{Calibration, Row};
use super::cost::{TimedRun, frames_workload};
use super::cut::Cut;
use super::manifest::Manifest;
use super::plan::{Plan, PlanRequest};
use super::run::{self, RunOptions};
use super::store::{ResultState, Store};
use super::work::{AnyWork, Frames};
use crate::error::{Error, Result};
use crate::io::image::ImageKind;
use crate::io::{atomic, scene_file};

/// Sizes of the pictures, relative to the scene's own along each side. They distinguish what grows
/// with the pixels from what does not.
const SIZES: [f64; 3] = [0.5, 0.75, 1.0];

/// Returns the number of frames that [`calibrate`] draws.
pub fn n_frames(n_scenes: usize, frames: u32) -> u64 {
    // The first run, of one frame, is made twice.
    1 + (SIZES.len() * n_scenes) as u64 * u64::from(1 + frames)
}

/// Runs every scene with one frame and with `frames`, at every size, and fits a model.
///
/// # Errors
/// When a scene cannot be drawn, or the runs do not determine a model.
pub fn calibrate(
    scenes: &[PathBuf],
    set: &[String],
    frames: u32,
    options: &RunOptions<'_>,
) -> Result<Calibration> {
    let (mut rows, mut first) = (Vec::new(), None);
    for scene in scenes {
        let film = scene_file::load(scene, set, None)?.scene.film;
        for share in SIZES {
            let side = |n: u32| ((f64::from(n) * share).round() as u32).max(1);
            let size = [side(film.width), side(film.height)];
            for n in [1, frames] {
                if first.is_none() {
                    // This run is not counted: it compiles shaders for all that follow.
                    first = Some(timed(scene, set, size, n, options)?.1);
                }
                rows.push(timed(scene, set, size, n, options)?.0);
            }
        }
    }
    let Some((of, made)) = first else {
        return Err(Error::usage("expected a scene to calibrate by"));
    };
    Calibration::new(of, rows, made)
}

/// Runs a shard of `n` frames in a temporary folder. Returns its duration, the kind of work and the
/// shard's manifest.
fn timed(
    scene: &Path,
    set: &[String],
    [width, height]: [u32; 2],
    n: u32,
    options: &RunOptions<'_>,
) -> Result<(Row, (String, Manifest))> {
    let folder = atomic::temporary_folder("nimbus-calibrate")?;
    let mut set = set.to_vec();
    set.extend([format!("film.width={width}"), format!("film.height={height}")]);
    let work = AnyWork::Frames(Frames { first: 0, n, format: ImageKind::Png });
    let plan = Plan::new(PlanRequest {
        scene: scene.to_owned(),
        set,
        seed: None,
        shaders: None,
        device: None,
        cut: Cut::single(work),
    })?;
    plan.write(folder.path())?;
    let loaded = plan.scene_as_planned()?;
    let begin = Instant::now();
    run::run(folder.path(), 0, options)?;
    let seconds = begin.elapsed().as_secs_f64();
    let work = frames_workload(&loaded, 0..n)?.total();
    let state = Store::new(folder.path(), &plan).state(plan.shard(0)?);
    let ResultState::Verified(made) = state else {
        let what = format!("the shard of a calibration is not there: {state:?}");
        return Err(Error::Fault { what });
    };
    let what = format!("{}, {width}x{height}, {n} frames", scene.display());
    let row = Row { what, timed: TimedRun { setups: 1.0, work, seconds } };
    Ok((row, (plan.work.kind(), *made)))
}

/// Fits a model to the shards of finished farms, as far as their amounts were counted and a single
/// run made them.
///
/// # Errors
/// When the farms were run by different builds or machines, or the shards do not determine a model.
pub fn calibrate_by_farms(folders: &[PathBuf]) -> Result<Calibration> {
    let (mut rows, mut first): (_, Option<(String, String, Manifest)>) = (Vec::new(), None);
    for folder in folders {
        let plan = Plan::read(folder)?;
        let (store, scene) = (Store::new(folder, &plan), plan.scene.file.display());
        let (kind, noun) = (plan.work.kind(), plan.work.noun());
        for shard in &plan.shards {
            let (Some(work), ResultState::Verified(manifest)) = (shard.counted, store.state(shard))
            else {
                continue;
            };
            let (seconds, n_resumed) = (manifest.seconds, manifest.n_resumed);
            let class = manifest.class();
            let words = format!(
                "{kind}, build {}, {}, {}, environment {:?}",
                plan.code, class.device, class.cpu, manifest.environment
            );
            let (expected, ..) =
                first.get_or_insert_with(|| (words.clone(), kind.clone(), *manifest));
            if *expected != words {
                return Err(Error::usage(format!(
                    "{}: shard {} was done by {words}; expected what did the first, {expected}",
                    folder.display(),
                    shard.index
                )));
            }
            if n_resumed == 0 {
                let what = format!("{scene}, {noun} {:?}", shard.items());
                rows.push(Row { what, timed: TimedRun { setups: 1.0, work, seconds } });
            }
        }
    }
    let Some((_, of, made)) = first else {
        return Err(Error::usage("no shard of these farms is done and has its amounts counted"));
    };
    Calibration::new(of, rows, made)
}
