//! `nimbus bench SCENE…`.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::args::{BenchArgs, ThreadingArg};
use super::{bench_table, device_choice, load, output, say_notes, say_sizes};
use crate::error::{Error, Result};
use crate::gpu::ClockFit;
use crate::measure::zones::Zones;
use crate::model::scene::Threading;
use crate::study::bench::{self, BenchPlan};
use crate::study::cases::{Axis, Case, SIZE_KEY, cases, overrides, points};
use crate::study::machine;
use crate::study::outcome::pass_names;
use crate::study::records::{self, Run};
use crate::study::stage::Stage;
use crate::study::trace::{self, Beside};

/// Of the device's clock beside the host's, before the frames and after them.
const N_CLOCK_READINGS: usize = 8;

/// `zones`: where what the threads do is collected.
pub fn run(args: &BenchArgs, stop: &AtomicBool, zones: Option<&Zones>) -> Result<()> {
    let outs = out_dirs(args)?;
    if let Some(file) = &args.trace {
        super::refuse_existing(file, args.force)?;
        if args.scenes.len() > 1 {
            return Err(Error::usage(format!("--trace takes one scene, found {}", args.scenes.len())));
        }
    }
    // All scenes are read before the first is timed, so that a fault in the last does not cost the others, and no folder
    // is made for results that will not come.
    let quiet = super::SceneArgs { quiet: true, verbose: false, ..args.options.clone() };
    for scene in &args.scenes {
        prepare(args, scene, &quiet)?;
    }
    let mut runs = Vec::new();
    let mut interrupted = false;
    for (scene, out) in args.scenes.iter().zip(&outs) {
        let run = bench_one(args, scene, out.as_deref(), stop, zones)?;
        interrupted = run.interrupted;
        runs.push(run);
        if interrupted {
            break;
        }
    }
    if args.json {
        let text =
            if let [run] = &runs[..] { serde_json::to_string_pretty(run) } else { serde_json::to_string_pretty(&runs) };
        output::text(&(text.map_err(|e| Error::Io { path: "stdout".into(), what: e.to_string() })? + "\n"))?;
    }
    if interrupted { Err(Error::Interrupted) } else { Ok(()) }
}

/// A results folder for every scene. What exists already is refused here, before any work; what does not is made once
/// its scene is ready to run.
fn out_dirs(args: &BenchArgs) -> Result<Vec<Option<PathBuf>>> {
    let Some(out) = &args.out else { return Ok(vec![None; args.scenes.len()]) };
    super::refuse_existing(out, args.force)?;
    if args.scenes.len() == 1 {
        return Ok(vec![Some(out.clone())]);
    }
    let names: Vec<PathBuf> = args.scenes.iter().map(|s| PathBuf::from(s.file_stem().unwrap_or_default())).collect();
    if let Some((_, twice)) = names.iter().enumerate().find(|(i, n)| names[..*i].contains(n)) {
        let what = format!("--out needs scenes of different names, found {} twice", twice.display());
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
    let axes = args.sweep.iter().map(|text| Axis::parse(text)).collect::<Result<Vec<Axis>>>()?;
    if let Some((_, twice)) = axes.iter().enumerate().find(|(i, axis)| axes[..*i].iter().any(|a| a.key == axis.key)) {
        return Err(Error::usage(format!("--sweep {}: the key twice; name all its values in one", twice.key)));
    }
    let flags = [!options.no_skip, !args.no_saved];
    let loaded = load(path, options)?;
    let (scene_hash, resolved) = (loaded.hash.clone(), loaded.resolved.clone());
    if axes.is_empty() {
        return Ok(Prepared { cases: cases(loaded, &[], modes, args.frames, flags), scene_hash, resolved });
    }
    let mut all = Vec::new();
    for point in points(&axes) {
        let mut with = super::SceneArgs { quiet: true, verbose: false, ..options.clone() };
        with.set.extend(overrides(&point)?);
        if point.iter().any(|s| s.key == SIZE_KEY) {
            with.size = None;
        }
        all.extend(cases(load(path, &with)?, &point, modes, args.frames, flags));
    }
    Ok(Prepared { cases: all, scene_hash, resolved })
}

fn bench_one(
    args: &BenchArgs,
    path: &Path,
    out: Option<&Path>,
    stop: &AtomicBool,
    zones: Option<&Zones>,
) -> Result<Run> {
    let date = machine::utc_now();
    let Prepared { cases, scene_hash, resolved } = prepare(args, path, &args.options)?;
    let plan = BenchPlan { n_warm_up: args.warmup, n_rounds: args.repeat, hash_frames: args.hash_frames };
    let stage = Stage::new(cases[0].scene.clone(), &device_choice(&args.options), cases[0].loops[0].skip)?;
    if let Some(dir) = out {
        // What stood here was refused or forced above.
        records::prepare_out_dir(dir, true)?;
    }
    if args.options.verbose {
        say_sizes(&stage.scene, Some(&stage));
    }
    let bar = output::progress(bench::n_frames_total(&cases, &plan), &path.display().to_string(), args.options.quiet);
    // Before and after, so that what the two clocks drift apart shows.
    let mut readings = stage.device.read_clocks(N_CLOCK_READINGS)?;
    let outcome = bench::run(stage, &cases, &plan, stop, &mut || bar.inc(1));
    bar.finish_and_clear();
    let (mut stage, outcome) = outcome?;
    readings.extend(stage.device.read_clocks(N_CLOCK_READINGS)?);
    let info = stage.info().clone();
    let run = Run {
        schema: records::SCHEMA_VERSION,
        nimbus: env!("CARGO_PKG_VERSION").into(),
        revision: machine::revision().into(),
        date,
        command: std::env::args().collect(),
        scene_hash,
        scene: resolved,
        device: machine::device_record(&info),
        cpu: machine::cpu(),
        environment: machine::environment(),
        clocks: machine::clocks_record(&mut stage)?,
        block_order: outcome.block_order(),
        cases: outcome.cases(&cases, &plan),
        interrupted: outcome.interrupted,
    };
    if let Some(dir) = out {
        records::write_results(dir, &run, &pass_names(), &outcome.rows(&cases))?;
    }
    if let Some(file) = &args.trace {
        let zones = zones.map(Zones::take);
        trace::write(file, &outcome.samples, &Beside { zones: zones.as_ref(), clock: ClockFit::of(&readings) })?;
    }
    if !args.json {
        let same: Vec<Option<bool>> = (0..cases.len()).map(|i| outcome.is_same_picture(i)).collect();
        output::text(&bench_table::report(path, &run, &same, args.options.verbose))?;
    }
    say_notes(&mut stage, &args.options)?;
    stage.close()?;
    Ok(run)
}
