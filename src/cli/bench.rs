//! `nimbus bench SCENE…`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::ColorChoice;

use super::args::{BenchArgs, Span, ThreadingArg};
use super::{bench_plot, bench_table, device_choice, load, output, say_sizes, warnings_of};
use crate::error::{Error, Result};
use crate::farm::{Workload, bench_workload};
use crate::frame::Stage;
use crate::frame::limits;
use crate::gpu::ClockFit;
use crate::io::atomic;
use crate::measure::zones::Zones;
use crate::model::scene::Threading;
use crate::timing::attachments::Attachments;
use crate::timing::blocks::{self, BenchPlan, Finished, Outcome};
use crate::timing::cases::{Case, LoopChoice, cases};
use crate::timing::frame_rows::{FrameRow, FrameTable};
use crate::timing::json::ResultFile;
use crate::timing::machine;
use crate::timing::names::sweep_text;
use crate::timing::parts::numbers;
use crate::timing::records::Run;
use crate::timing::results::{prepare_out_dir, write_results};
use crate::timing::sweep::{Axis, SIZE_KEY, overrides, points};
use crate::timing::trace;

/// Of the device's clock beside the host's, before the frames and after them.
const N_CLOCK_READINGS: usize = 8;

/// `zones`: where what the threads do is collected; `color`: of charts.
pub fn run(
    args: &BenchArgs,
    color: ColorChoice,
    stop: &AtomicBool,
    zones: Option<&Zones>,
) -> Result<()> {
    if args.part.is_some() && args.scenes.len() > 1 {
        return Err(Error::usage(format!("--part takes one scene, found {}", args.scenes.len())));
    }
    let outs = out_dirs(args)?;
    if let Some(file) = &args.trace {
        super::refuse_existing(file, args.force)?;
        atomic::check_place(file)?;
        if args.scenes.len() > 1 {
            return Err(Error::usage(format!(
                "--trace takes one scene, found {}",
                args.scenes.len()
            )));
        }
    }
    // All scenes are read before the first is timed, so that a fault in the last does not cost the
    // others, and no folder is made for results that will not come.
    let quiet = super::SceneArgs { quiet: true, verbose: false, ..args.options.clone() };
    for scene in &args.scenes {
        prepare(args, scene, &quiet)?;
    }
    let mut runs = Vec::new();
    let mut ended = None;
    for (scene, out) in args.scenes.iter().zip(&outs) {
        let (run, end) = match bench_one((args, color), scene, out.as_deref(), stop, zones) {
            Ok((run, end)) => (Some(run), end),
            Err(error) => (None, Some(error)),
        };
        runs.extend(run);
        ended = end;
        if ended.is_some() {
            break;
        }
    }
    // Also where a later scene failed: what was finished is told.
    if args.json && !runs.is_empty() {
        let text = if let [run] = &runs[..] {
            serde_json::to_string_pretty(run)
        } else {
            serde_json::to_string_pretty(&runs)
        };
        output::text(
            &(text.map_err(|e| Error::Io { path: "stdout".into(), what: e.to_string() })? + "\n"),
        )?;
    }
    ended.map_or(Ok(()), Err)
}

/// A results folder for every scene. What exists already is refused here, before any work; what
/// does not is made once its scene is ready to run.
fn out_dirs(args: &BenchArgs) -> Result<Vec<Option<PathBuf>>> {
    let Some(out) = &args.out else { return Ok(vec![None; args.scenes.len()]) };
    super::refuse_existing(out, args.force)?;
    if args.scenes.len() == 1 {
        return Ok(vec![Some(out.clone())]);
    }
    let names: Vec<PathBuf> =
        args.scenes.iter().map(|s| PathBuf::from(s.file_stem().unwrap_or_default())).collect();
    if let Some((_, twice)) = names.iter().enumerate().find(|(i, n)| names[..*i].contains(n)) {
        let what =
            format!("--out needs scenes of different names, found {} twice", twice.display());
        return Err(Error::usage(what));
    }
    Ok(names.into_iter().map(|n| Some(out.join(n))).collect())
}

/// A scene's cases and what is written of the scene itself.
struct Prepared {
    cases: Vec<Case>,
    scene_hash: String,
    resolved: serde_json::Value,
}

fn prepare(args: &BenchArgs, path: &Path, options: &super::SceneArgs) -> Result<Prepared> {
    let modes: &[Threading] = match args.threading {
        ThreadingArg::Serial => &[Threading::Serial],
        ThreadingArg::Parallel => &[Threading::Parallel],
        ThreadingArg::Both => &[Threading::Serial, Threading::Parallel],
    };
    let axes = axes(args)?;
    let loops = LoopChoice { modes, skip: !options.no_skip, saved: !args.no_saved };
    let loaded = load(path, options)?;
    let (scene_hash, resolved) = (loaded.hash.clone(), loaded.resolved.clone());
    if axes.is_empty() {
        let cases = of_part(args, cases(loaded, &[], args.frames, loops))?;
        return Ok(Prepared { cases, scene_hash, resolved });
    }
    let (mut all, mut said) = (Vec::new(), BTreeSet::from_iter(warnings_of(&loaded)));
    for point in points(&axes) {
        let overrides = overrides(&point)?;
        let mut with = super::SceneArgs { quiet: true, ..options.clone() };
        with.set.extend(overrides.iter().cloned());
        if point.iter().any(|s| s.key == SIZE_KEY) {
            with.size = None;
        }
        let at = load(path, &with).map_err(|e| as_swept(e, &overrides))?;
        for warning in warnings_of(&at).into_iter().filter(|_| !options.quiet) {
            if said.insert(warning.clone()) {
                eprintln!("warning: {}: {warning}", sweep_text(&point));
            }
        }
        all.extend(cases(at, &point, args.frames, loops));
    }
    Ok(Prepared { cases: of_part(args, all)?, scene_hash, resolved })
}

/// Those of `--part`, after the first of all; all of them without.
fn of_part(args: &BenchArgs, cases: Vec<Case>) -> Result<Vec<Case>> {
    let Some(Span { first, end }) = args.part else { return Ok(cases) };
    let (n, range) = (cases.len(), first as usize..end as usize);
    if range.end > n {
        return Err(Error::usage(format!(
            "--part {first}..{end}: expected a part of cases 0..{n}"
        )));
    }
    Ok(numbers(&range).into_iter().map(|i| cases[i].clone()).collect())
}

/// Returns the names of the cases that a bench times, in the order that `--part` counts by, and the
/// amount of work in them.
pub(super) fn case_names(args: &BenchArgs) -> Result<(Vec<String>, Workload)> {
    let [scene] = &args.scenes[..] else {
        return Err(Error::usage(format!("expected one scene, found {}", args.scenes.len())));
    };
    let quiet = super::SceneArgs { quiet: true, verbose: false, ..args.options.clone() };
    let cases = prepare(args, scene, &quiet)?.cases;
    let workload = bench_workload(&cases, args.warmup, args.repeat)?;
    Ok((cases.iter().map(Case::name).collect(), workload))
}

/// The sweep's keys, each once.
fn axes(args: &BenchArgs) -> Result<Vec<Axis>> {
    let axes = Axis::parse_all("--sweep", &args.sweep)?;
    let refuse = |key: &str, what: &str| Err(Error::usage(format!("--sweep {key}: {what}")));
    for axis in &axes {
        let has = |key: &str| axes.iter().any(|a| a.key == key);
        if axis.key == SIZE_KEY && (has("film.width") || has("film.height")) {
            return refuse(
                SIZE_KEY,
                "sets film.width and film.height, which another --sweep sets, too",
            );
        }
        if axis.key == "time.frames" && args.frames.is_some() {
            return refuse("time.frames", "--frames says how many frames are timed");
        }
    }
    Ok(axes)
}

/// A fault in what a sweep set is the sweep's.
fn as_swept(error: Error, overrides: &[String]) -> Error {
    match error {
        Error::Scene { mut at, what } => {
            if let Some(set) =
                at.source.strip_prefix("--set ").filter(|set| overrides.iter().any(|o| o == set))
            {
                at.source = format!("--sweep {set}");
            }
            Error::Scene { at, what }
        }
        other => other,
    }
}

/// Opens the device, and checks what every case asks of it before the first is run.
fn open(args: &BenchArgs, cases: &[Case]) -> Result<Stage> {
    let stage =
        Stage::new(cases[0].scene.clone(), &device_choice(&args.options), cases[0].loops[0].skip)?;
    for case in &cases[1..] {
        limits::check(&case.scene, stage.device.limits()).map_err(|e| e.within(&case.name()))?;
    }
    Ok(stage)
}

/// What people read.
fn print(
    (args, color): (&BenchArgs, ColorChoice),
    path: &Path,
    (run, rows): (&Run, &[FrameRow]),
    (cases, outcome): (&[Case], &Outcome),
) -> Result<()> {
    let same: Vec<Option<bool>> =
        cases.iter().enumerate().map(|(i, case)| outcome.is_same_picture(i, case)).collect();
    output::text(&bench_table::report(path, run, &same, args.options.verbose))?;
    if args.plot {
        output::text(&bench_plot::text(run, rows, color)?)?;
    }
    Ok(())
}

/// The run, and why it ended before its end, if it did.
fn bench_one(
    (args, color): (&BenchArgs, ColorChoice),
    path: &Path,
    out: Option<&Path>,
    stop: &AtomicBool,
    zones: Option<&Zones>,
) -> Result<(Run, Option<Error>)> {
    let date = machine::utc_now();
    let Prepared { cases, scene_hash, resolved } = prepare(args, path, &args.options)?;
    let plan = BenchPlan {
        n_warm_up: args.warmup,
        n_rounds: args.repeat,
        hash_frames: args.hash_frames,
        pictures: out.is_some(),
    };
    let mut stage = open(args, &cases)?;
    if args.options.verbose {
        say_sizes(&stage.scene, Some(&stage));
    }
    let info = stage.info().clone();
    let clocks = machine::clocks_record(&info, &mut stage.renderer)?;
    // Before and after, so that what the two clocks drift apart shows.
    let mut readings = stage.device.read_clocks(N_CLOCK_READINGS)?;
    if let Some(dir) = out {
        // What stood here was refused or forced above.
        prepare_out_dir(dir, true)?;
    }
    let bar = output::progress(
        blocks::n_frames_total(&cases, &plan),
        &path.display().to_string(),
        args.options.quiet,
    );
    let Finished { stage, outcome, failure } =
        blocks::run(stage, &cases, &plan, stop, &mut || bar.inc(1));
    bar.finish_and_clear();
    if let (Some(failure), true) = (&failure, outcome.samples.is_empty()) {
        // A folder that holds nothing would only be in the way of the next run.
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
    let table =
        if out.is_some() || args.plot { outcome.table(&cases) } else { FrameTable::default() };
    if let Some(dir) = out {
        let charts = if args.plot { bench_plot::files(&run, &table.rows)? } else { vec![] };
        let beside =
            Attachments { pictures: outcome.pictures.clone(), charts, ..Attachments::default() };
        write_results(dir, &run, &table, &beside)?;
    }
    if !args.json {
        print((args, color), path, (&run, &table.rows), (&cases, &outcome))?;
    }
    if let Some(file) = &args.trace {
        if let Some(stage) = &stage {
            readings.extend(stage.device.read_clocks(N_CLOCK_READINGS)?);
        }
        let zones = zones.map(Zones::take);
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
