//! `nimbus bench SCENE…`.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use clap::ColorChoice;

use super::args::{BenchArgs, SceneArgs};
use super::bench_cases::{BenchCases, bench_cases, plan};
use super::bench_check;
use super::bench_record::{Recorder, Runs, print_json};
use super::capture_note;
use super::interrupt::{self, PATIENCE};
use super::output::{SharedFolder, check_out, claim_file, lock_folder};
use super::progress::progress;
use super::scene::{device_choice, print_sizes};
use crate::error::{Error, Result};
use crate::frame::{Stage, limits};
use crate::gpu::PassTimes;
use crate::io::console::say;
use crate::io::result_folder::Existing;
use crate::measure::zones::Zones;
use crate::timing::blocks::{self, Outcome};
use crate::timing::caches::last_level_bytes;
use crate::timing::cases::Case;
use crate::timing::machine;
use crate::timing::results::open_results;
use crate::timing::running::{self, Event, Finished};
use crate::timing::state::{Judging, Sampler};

/// Readings of the device's clock and the host's, before the frames and again after them.
const N_CLOCK_READINGS: usize = 8;

/// The surroundings of a bench, beside its arguments.
pub struct Context<'a> {
    /// Colours of charts.
    pub color: ColorChoice,
    /// Set by Ctrl-C.
    pub stop: &'a AtomicBool,
    /// The zones of the threads, if they are collected.
    pub zones: Option<&'a Zones>,
}

/// Runs the benches of all scenes in this process.
///
/// # Errors
/// Fails if the arguments or a scene are faulty, the device fails, or Ctrl-C came. Finished results
/// are kept.
pub fn run(args: &BenchArgs, context: &Context<'_>) -> Result<()> {
    let n_scenes = args.scenes.len();
    for (flag, is_set) in [
        ("--part", args.part.is_some()),
        ("--trace", args.trace.is_some()),
        ("--capture", args.capture.is_some()),
    ] {
        if is_set && n_scenes > 1 {
            return Err(Error::usage(format!("{flag} takes one scene, found {n_scenes}")));
        }
    }
    if args.cold.is_some() && args.options.pass_times != PassTimes::Drained {
        let how = args.options.pass_times.name();
        return Err(Error::usage(format!(
            "--cold needs passes that are timed one by one: expected --pass-times drained, found \
             {how}"
        )));
    }
    let outs = out_dirs(args)?;
    if args.out.is_some() {
        interrupt::note_until_keep("interrupted before the first frame: nothing was written");
    }
    let _claim = args.trace.as_ref().map(|file| claim_file(file, args.force)).transpose()?;
    // All scenes are loaded before the first is timed, so that a fault in the last one is reported
    // at once and no folder is made for results that will not come.
    let quiet = SceneArgs { quiet: true, verbose: false, ..args.options.clone() };
    for scene in &args.scenes {
        bench_cases(args, scene, &quiet)?;
    }
    let runs = Runs::default();
    let mut ended = Ok(());
    for (scene, out) in args.scenes.iter().zip(outs) {
        ended = bench_scene(args, scene, out, context, &runs);
        if ended.is_err() {
            break;
        }
    }
    // Finished runs are printed even if a later scene failed.
    print_json(args, &runs)?;
    ended
}

/// Returns the results folder of every scene and refuses those that exist. A folder is made once
/// its scene is ready to run.
pub fn out_dirs(args: &BenchArgs) -> Result<Vec<Option<PathBuf>>> {
    let Some(out) = &args.out else { return Ok(vec![None; args.scenes.len()]) };
    check_out(out, args.force)?;
    if args.scenes.len() == 1 {
        return Ok(vec![Some(out.clone())]);
    }
    let names: Vec<PathBuf> =
        args.scenes.iter().map(|s| PathBuf::from(s.file_stem().unwrap_or_default())).collect();
    if let Some((_, twice)) = names.iter().enumerate().find(|(i, n)| names[..*i].contains(n)) {
        let twice = twice.display();
        let what = format!("--out needs scenes of different names, found {twice} twice");
        return Err(Error::usage(what));
    }
    Ok(names.into_iter().map(|n| Some(out.join(n))).collect())
}

/// Fails if `--capture` names a frame beyond the last one.
fn check_capture(args: &BenchArgs, n_frames: u64) -> Result<()> {
    match args.capture.filter(|frame| u64::from(*frame) >= n_frames) {
        None => Ok(()),
        Some(frame) => Err(Error::usage(format!(
            "--capture {frame}: the bench draws {n_frames} frames; expected a number from 0 to {}",
            n_frames - 1
        ))),
    }
}

/// Opens the device, and checks that every case fits on it.
fn open(args: &BenchArgs, cases: &[Case]) -> Result<Stage> {
    let (mut choice, skip) = (device_choice(&args.options), cases[0].loops[0].skip);
    choice.options.counts_invocations = args.invocations;
    choice.options.captured_frame = args.capture;
    let stage = Stage::new(cases[0].scene.clone(), &choice, skip)?;
    for case in &cases[1..] {
        limits::check(&case.scene, stage.device.limits()).map_err(|e| e.within(&case.name()))?;
    }
    Ok(stage)
}

/// Times one scene and adds its record to `runs`.
fn bench_scene(
    args: &BenchArgs,
    path: &Path,
    out: Option<PathBuf>,
    context: &Context<'_>,
    runs: &Runs,
) -> Result<()> {
    let date = machine::utc_now();
    let BenchCases { cases, scene_hash, resolved } = bench_cases(args, path, &args.options)?;
    let mut plan = plan(args);
    check_capture(args, blocks::n_frames_at_least(&cases, &plan))?;
    let mut stage = open(args, &cases)?;
    if args.options.verbose {
        print_sizes(&stage.scene, Some(&stage));
    }
    let info = stage.info().clone();
    // 0 stands for the size of the last cache level.
    plan.cold_bytes = plan.cold_bytes.map(|bytes| match bytes {
        0 => last_level_bytes(&info),
        bytes => bytes,
    });
    let pass_times = args.options.pass_times;
    let clocks = machine::clocks_record(&info, pass_times, &mut stage.renderer)?;
    // Read before and after the frames, to measure the drift between the two clocks.
    let readings = stage.device.read_clocks(N_CLOCK_READINGS)?;
    let sampler = (!args.no_state).then(|| Sampler::start(&stage.device));
    if args.options.verbose {
        let notes = sampler.as_ref().map(|sampler| sampler.log().notes());
        notes.into_iter().flatten().for_each(|note| say!("note: {note}"));
    }
    let (color, zones) = (context.color, context.zones.cloned());
    let (args, path) = (args.clone(), path.to_owned());
    let recorder = Arc::new(Recorder {
        args,
        color,
        path,
        folder: SharedFolder::default(),
        cases,
        scene_hash,
        resolved,
        plan,
        date,
        info,
        clocks,
        zones,
        readings,
    });
    let judging = sampler.as_ref().map(|sampler| Judging {
        log: sampler.log(),
        is_cpu: recorder.info.kind == "cpu",
        n_cores: machine::cpu().logical_cores,
        discard: recorder.args.discard_throttled,
    });
    let watch = sampler.as_ref().map(Sampler::watch).unwrap_or_default();
    let outcome = Arc::new(Mutex::new(Outcome { watch, judging, ..Outcome::default() }));
    let mut keeping = {
        let (recorder, outcome, runs) = (recorder.clone(), outcome.clone(), runs.clone());
        interrupt::keep(PATIENCE, move || recorder.keep(&outcome, &runs))
    };
    if let Some(dir) = &out {
        let Recorder { args, cases, .. } = &*recorder;
        let folder = open_results(dir, Existing::new(args.force), cases.len(), args.plot)?;
        *lock_folder(&recorder.folder) = Some(folder);
    }
    let begin = Instant::now();
    let ended = time(stage, &recorder, context.stop, &outcome);
    drop(sampler);
    // After a failure the device may be lost or hung.
    if ended.failure.is_none() {
        bench_check::run(&recorder, begin.elapsed(), context.stop, &outcome);
    }
    keeping.finish();
    let mut outcome = std::mem::take(&mut *blocks::lock(&outcome));
    outcome.judge();
    let Finished { stage, failure } = ended;
    if let (Some(failure), true) = (&failure, outcome.samples.is_empty()) {
        drop(lock_folder(&recorder.folder).take());
        if *failure == Error::Interrupted {
            say!("no frame was finished, nothing is kept");
        }
        return Err(failure.clone());
    }
    let later = match (&recorder.args.trace, &stage) {
        (Some(_), Some(stage)) => stage.device.read_clocks(N_CLOCK_READINGS)?,
        _ => Vec::new(),
    };
    if let Some(stage) = &stage {
        let BenchArgs { capture, options, .. } = &recorder.args;
        capture_note::print(stage.device.captured(), *capture, options.quiet);
    }
    let missed = stage.as_ref().map_or((0, 0), |stage| stage.device.executed());
    let wrong = bench_check::not_executed(&recorder.args, missed)
        .or_else(|| bench_check::wrong(&outcome, &recorder.cases));
    let is_cut = outcome.interrupted || failure.is_some();
    let run = recorder.record(&outcome, &later, is_cut)?;
    runs.lock().unwrap_or_else(PoisonError::into_inner).push(run);
    if failure.is_none() {
        stage.map_or(Ok(()), Stage::close)?;
    }
    failure.or(outcome.interrupted.then_some(Error::Interrupted)).or(wrong).map_or(Ok(()), Err)
}

/// Runs all blocks, with a progress bar.
fn time(
    stage: Stage,
    recorder: &Recorder,
    stop: &AtomicBool,
    outcome: &Mutex<Outcome>,
) -> Finished {
    let Recorder { args, path, cases, plan, .. } = recorder;
    let n_frames = blocks::n_frames_at_least(cases, plan);
    let bar = progress(n_frames, &path.display().to_string(), args.options.quiet);
    let ended = running::run(stage, cases, plan, stop, outcome, &mut |event| match event {
        Event::Frame => bar.advance(),
        Event::More(n) => bar.add_parts(n),
    });
    drop(bar);
    ended
}
