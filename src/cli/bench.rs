//! `nimbus bench SCENE…`.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::ColorChoice;

use super::args::{BenchArgs, SceneArgs};
use super::bench_cases::{BenchCases, bench_cases};
use super::output::refuse_existing;
use super::progress::progress;
use super::scene::{device_choice, print_sizes};
use super::{bench_plot, bench_table, output};
use crate::error::{Error, Result};
use crate::frame::{Stage, limits};
use crate::gpu::ClockFit;
use crate::io::atomic;
use crate::measure::zones::Zones;
use crate::timing::attachments::Attachments;
use crate::timing::blocks::{self, BenchPlan, Finished, Outcome};
use crate::timing::cases::Case;
use crate::timing::frame_rows::FrameTable;
use crate::timing::json::ResultFile;
use crate::timing::machine;
use crate::timing::records::Run;
use crate::timing::results::{prepare_out_dir, write_results};
use crate::timing::trace;

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

/// Runs `nimbus bench`.
///
/// # Errors
/// Fails if the arguments or a scene are faulty, the device fails, or Ctrl-C came. Finished results
/// are kept.
pub fn run(args: &BenchArgs, context: &Context<'_>) -> Result<()> {
    let n_scenes = args.scenes.len();
    for (flag, is_set) in [("--part", args.part.is_some()), ("--trace", args.trace.is_some())] {
        if is_set && n_scenes > 1 {
            return Err(Error::usage(format!("{flag} takes one scene, found {n_scenes}")));
        }
    }
    let outs = out_dirs(args)?;
    if let Some(file) = &args.trace {
        refuse_existing(file, args.force)?;
        atomic::check_place(file)?;
    }
    // All scenes are loaded before the first is timed, so that a fault in the last one is reported
    // at once and no folder is made for results that will not come.
    let quiet = SceneArgs { quiet: true, verbose: false, ..args.options.clone() };
    for scene in &args.scenes {
        bench_cases(args, scene, &quiet)?;
    }
    let mut runs = Vec::new();
    let mut ended = Ok(());
    for (scene, out) in args.scenes.iter().zip(&outs) {
        match bench_scene(args, scene, out.as_deref(), context) {
            Ok((run, end)) => {
                runs.push(run);
                ended = end.map_or(Ok(()), Err);
            }
            Err(error) => ended = Err(error),
        }
        if ended.is_err() {
            break;
        }
    }
    // Finished runs are printed even if a later scene failed.
    if args.json && !runs.is_empty() {
        if let [run] = &runs[..] { output::object(run)? } else { output::object(&runs)? }
    }
    ended
}

/// Returns the results folder of every scene and refuses those that exist. A folder is made once
/// its scene is ready to run.
fn out_dirs(args: &BenchArgs) -> Result<Vec<Option<PathBuf>>> {
    let Some(out) = &args.out else { return Ok(vec![None; args.scenes.len()]) };
    refuse_existing(out, args.force)?;
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

/// Opens the device, and checks that every case fits on it.
fn open(args: &BenchArgs, cases: &[Case]) -> Result<Stage> {
    let (choice, skip) = (device_choice(&args.options), cases[0].loops[0].skip);
    let stage = Stage::new(cases[0].scene.clone(), &choice, skip)?;
    for case in &cases[1..] {
        limits::check(&case.scene, stage.device.limits()).map_err(|e| e.within(&case.name()))?;
    }
    Ok(stage)
}

/// Times one scene. Returns its record, and the error that ended it early, if there was one.
fn bench_scene(
    args: &BenchArgs,
    path: &Path,
    out: Option<&Path>,
    context: &Context<'_>,
) -> Result<(Run, Option<Error>)> {
    let date = machine::utc_now();
    let BenchCases { cases, scene_hash, resolved } = bench_cases(args, path, &args.options)?;
    let plan = BenchPlan {
        n_warm_up: args.warmup,
        n_rounds: args.repeat,
        hash_frames: args.hash_frames,
        pictures: out.is_some(),
    };
    let mut stage = open(args, &cases)?;
    if args.options.verbose {
        print_sizes(&stage.scene, Some(&stage));
    }
    let info = stage.info().clone();
    let clocks = machine::clocks_record(&info, &mut stage.renderer)?;
    // Read before and after the frames, to measure the drift between the two clocks.
    let mut readings = stage.device.read_clocks(N_CLOCK_READINGS)?;
    if let Some(dir) = out {
        // An existing folder was refused, or --force was given.
        prepare_out_dir(dir, true)?;
    }
    let n_frames = blocks::n_frames_total(&cases, &plan);
    let bar = progress(n_frames, &path.display().to_string(), args.options.quiet);
    let Finished { stage, outcome, failure } =
        blocks::run(stage, &cases, &plan, context.stop, &mut || bar.inc(1));
    bar.finish_and_clear();
    if let (Some(failure), true) = (&failure, outcome.samples.is_empty()) {
        // An empty folder would only be refused by the next run.
        let _ = out.map(std::fs::remove_dir);
        return Err(failure.clone());
    }
    let run = Run {
        schema: Run::SCHEMA,
        nimbus: env!("CARGO_PKG_VERSION").into(),
        revision: machine::revision().into(),
        date,
        command: std::env::args().collect(),
        scene_hash,
        scene: resolved,
        device: machine::device_record(&info),
        cpu: machine::cpu(),
        environment: machine::environment(),
        clocks,
        block_order: outcome.block_order(),
        cases: outcome.cases(&cases, &plan),
        chosen: outcome.chosen.clone(),
        parts: Vec::new(),
        interrupted: outcome.interrupted || failure.is_some(),
    };
    let needs_table = out.is_some() || args.plot;
    let table = if needs_table { outcome.table(&cases) } else { FrameTable::default() };
    if let Some(dir) = out {
        let charts = if args.plot { bench_plot::files(&run, &table.rows)? } else { vec![] };
        let pictures = outcome.pictures.clone();
        write_results(dir, &run, &table, &Attachments { pictures, charts, copies: vec![] })?;
    }
    if !args.json {
        print(args, path, &run, &cases, &outcome)?;
        if args.plot {
            output::painted(&bench_plot::text(&run, &table.rows, context.color)?)?;
        }
    }
    if let Some(file) = &args.trace {
        if let Some(stage) = &stage {
            readings.extend(stage.device.read_clocks(N_CLOCK_READINGS)?);
        }
        let zones = context.zones.map(Zones::take);
        trace::write(file, &outcome.samples, zones.as_ref(), ClockFit::from_samples(&readings))?;
    }
    if !args.options.quiet {
        outcome.chosen.iter().for_each(|chosen| eprintln!("note: {chosen}"));
        outcome.notes.iter().for_each(|note| eprintln!("warning: {note}"));
    }
    if failure.is_none() {
        stage.map_or(Ok(()), Stage::close)?;
    }
    let end = failure.or(outcome.interrupted.then_some(Error::Interrupted));
    Ok((run, end))
}

/// Prints the tables.
fn print(
    args: &BenchArgs,
    path: &Path,
    run: &Run,
    cases: &[Case],
    outcome: &Outcome,
) -> Result<()> {
    let same = cases.iter().enumerate().map(|(i, case)| outcome.is_same_picture(i, case));
    let same: Vec<Option<bool>> = same.collect();
    output::text(&bench_table::report(path, run, &same, args.options.verbose))
}
