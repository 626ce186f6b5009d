//! `nimbus bench SCENE…`.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::args::{BenchArgs, ThreadingArg};
use super::{device_choice, load, output, say_notes, say_sizes};
use crate::error::{Error, Result};
use crate::gpu::{ClockFit, DeviceInfo};
use crate::measure::lows::fps;
use crate::measure::stats::Summary;
use crate::measure::zones::Zones;
use crate::model::scene::Threading;
use crate::study::bench::{self, BenchPlan, Outcome, pass_names};
use crate::study::overlap::Overlap;
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
    for scene in &args.scenes {
        load(scene, &quiet(args))?;
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

fn quiet(args: &BenchArgs) -> super::SceneArgs {
    let c = &args.options;
    super::SceneArgs {
        device: c.device.clone(),
        shaders: c.shaders.clone(),
        set: c.set.clone(),
        quiet: true,
        verbose: false,
        ..*c
    }
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

fn bench_one(
    args: &BenchArgs,
    path: &Path,
    out: Option<&Path>,
    stop: &AtomicBool,
    zones: Option<&Zones>,
) -> Result<Run> {
    let date = records::utc_now();
    let loaded = load(path, &args.options)?;
    let modes = match args.threading {
        ThreadingArg::Serial => vec![Threading::Serial],
        ThreadingArg::Parallel => vec![Threading::Parallel],
        ThreadingArg::Both => vec![Threading::Serial, Threading::Parallel],
    };
    let n_frames = args.frames.unwrap_or(loaded.scene.time.n_frames);
    let plan =
        BenchPlan { modes, n_frames, n_warm_up: args.warmup, n_blocks: args.repeat, hash_frames: args.hash_frames };
    let simulate = loaded.scene.threads.simulate;
    let mut stage = Stage::new(loaded.scene, &device_choice(&args.options), !args.options.no_skip)?;
    if let Some(dir) = out {
        // What stood here was refused or forced above.
        records::prepare_out_dir(dir, true)?;
    }
    if args.options.verbose {
        say_sizes(&stage.scene, Some(&stage));
    }
    let n_total = u64::from(plan.n_blocks) * plan.modes.len() as u64 * (u64::from(n_frames) + u64::from(args.warmup));
    let bar = output::progress(n_total, &path.display().to_string(), args.options.quiet);
    // Before and after, so that what the two clocks drift apart shows.
    let mut clocks = stage.device.read_clocks(N_CLOCK_READINGS)?;
    let outcome = bench::run(&mut stage, &plan, stop, &mut || bar.inc(1));
    bar.finish_and_clear();
    let outcome = outcome?;
    clocks.extend(stage.device.read_clocks(N_CLOCK_READINGS)?);
    let info = stage.info().clone();
    let run = Run {
        schema: records::SCHEMA_VERSION,
        nimbus: env!("CARGO_PKG_VERSION").into(),
        revision: records::revision().into(),
        date,
        command: std::env::args().collect(),
        scene_hash: loaded.hash,
        scene: loaded.resolved,
        device: bench::device_record(&info),
        cpu: records::cpu(),
        environment: records::environment(),
        clocks: bench::clocks_record(&info),
        block_order: outcome.block_order(),
        modes: plan.modes.iter().map(|m| outcome.mode(*m, simulate, &plan)).collect(),
        ratio: outcome.ratio_record(),
        overlap: outcome.overlap(),
        interrupted: outcome.interrupted,
    };
    if let Some(dir) = out {
        records::write_results(dir, &run, &pass_names(), &outcome.rows())?;
    }
    if let Some(file) = &args.trace {
        let zones = zones.map(Zones::take);
        trace::write(file, &outcome.samples, &Beside { zones: zones.as_ref(), clock: ClockFit::of(&clocks) })?;
    }
    if !args.json {
        output::text(&report(path, &run, &info, &outcome, args))?;
    }
    say_notes(&mut stage, &args.options)?;
    stage.close()?;
    Ok(run)
}

/// The human table.
fn report(path: &Path, run: &Run, info: &DeviceInfo, outcome: &Outcome, args: &BenchArgs) -> String {
    let threads = run.environment.get("LP_NUM_THREADS").map_or(String::new(), |n| format!(", LP_NUM_THREADS={n}"));
    let mut out = format!(
        "{}\n{} ({}), {} ({} cores){threads}\n",
        path.display(),
        info.name,
        info.driver,
        run.cpu.model,
        run.cpu.logical_cores
    );
    out += &format!(
        "{}; the first {} frames of every block are not counted{}\n\n",
        blocks_line(&run.block_order),
        args.warmup,
        if outcome.interrupted { "; INTERRUPTED: what was finished" } else { "" }
    );
    out += &output::table(&time_rows(run));
    out.push('\n');
    out += &output::table(&low_rows(run));
    out.push('\n');
    out += &output::table(&pass_rows(run));
    out.push('\n');
    if let Some(ratio) = run.ratio {
        let (low, high) = (ratio.low, ratio.high);
        out += &format!("parallel / serial = {:.3} (95 % interval {low:.3} to {high:.3})\n", ratio.parallel_by_serial);
    }
    if let Some(overlap) = &run.overlap {
        out += &overlap_lines(overlap);
    }
    let hashes: Vec<&String> = outcome.image_hashes.values().collect();
    if let [a, b] = hashes[..] {
        out += if a == b {
            "the last frames are the same, to the byte\n"
        } else {
            "THE LAST FRAMES DIFFER between the two loops\n"
        };
    }
    out + &clocks_line(&run.clocks)
}

/// How the blocks of the loops took turns.
fn blocks_line(order: &[String]) -> String {
    /// Two full turns show the pattern.
    const N_SHOWN: usize = 8;
    let Some(first) = order.first() else { return "no block was begun".to_owned() };
    let Some(second) = order.iter().find(|name| *name != first) else {
        return format!("{} blocks, all {first}", order.len());
    };
    let letter = |name: &String| if name == first { "A" } else { "B" };
    let shown: Vec<&str> = order.iter().take(N_SHOWN).map(letter).collect();
    let more = if order.len() > N_SHOWN { " …" } else { "" };
    // A B B A: a steady drift adds up to the same for both; of an odd number of pairs one is left over.
    let is_balanced = order.len().is_multiple_of(4);
    let balance = if is_balanced { "" } else { " (a steady drift does not cancel; with an even --repeat it does)" };
    format!("{} blocks, {}{more}, A = {first}, B = {second}{balance}", order.len(), shown.join(" "))
}

/// The bound of what overlap can do, and how near the parallel loop came.
fn overlap_lines(o: &Overlap) -> String {
    let (game, render, bound, serial) = (ms(o.game_ms), ms(o.render_ms), ms(o.bound_ms), ms(o.serial_ms));
    let share = o.bound_ms / o.serial_ms;
    let mut out = format!(
        "perfect overlap = max(game {game}, render {render}) = {bound} ms, {share:.3} of the serial {serial} ms\n"
    );
    if let Some(r) = o.reached {
        let [share, low, high] = [r.share, r.low, r.high].map(|s| 100.0 * s);
        let possible = ms(o.serial_ms - o.bound_ms);
        out += &format!(
            "of the possible {possible} ms the parallel loop gained {share:.1} % (95 % interval {low:.1} to {high:.1})\n"
        );
        if r.share > 1.0 {
            out += "that is more than overlapping game and render alone can give: recording overlapped, too, or the \
                    machine changed from block to block\n";
        }
    } else if o.parallel_ms.is_some() {
        out += "that is no certain gain, so what share of it was reached cannot be said\n";
    }
    out
}

/// The host's clock and the device's: a time near these says nothing.
fn clocks_line(clocks: &records::Clocks) -> String {
    let device = clocks.timestamp_period_ns.map_or("none".to_owned(), |ns| format!("{ns} ns a tick"));
    format!(
        "host clock: resolution {} ns, {:.0} ns a reading; device timestamps: {device}\n",
        clocks.resolution_ns, clocks.overhead_ns
    )
}

/// Frame rates: the median's, and that of the slowest frames by each of the three definitions.
fn low_rows(run: &Run) -> Vec<Vec<String>> {
    let header = ["fps", "loop", "p50", "1 % low: p99", "mean of slowest 1 %", "1 % of the time"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for mode in &run.modes {
        let (Some(frame), Some(lows)) = (&mode.frame_ms, &mode.frame_lows) else { continue };
        let rates = [fps(frame.p50), lows.p99_fps, lows.slowest_mean_fps, lows.slowest_time_fps];
        let mut row = vec!["frame".to_owned(), mode.threading.clone()];
        row.extend(rates.map(|rate| format!("{rate:.1}")));
        rows.push(row);
    }
    rows
}

fn time_rows(run: &Run) -> Vec<Vec<String>> {
    let header = ["ms", "loop", "n", "p50", "mean", "sd", "min", "p5", "p95", "p99", "max"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for (what, of) in [
        ("frame", (|m| m.frame_ms.as_ref()) as fn(&records::Mode) -> Option<&Summary>),
        ("game", |m| m.game_ms.as_ref()),
        ("render", |m| m.render_ms.as_ref()),
        ("gpu", |m| m.gpu_ms.as_ref()),
        ("latency", |m| m.latency_ms.as_ref()),
    ] {
        for mode in &run.modes {
            let Some(s) = of(mode) else { continue };
            let mut row = vec![what.to_owned(), mode.threading.clone(), s.n.to_string()];
            let sd = s.sd.map_or("-".to_owned(), ms);
            row.extend([ms(s.p50), ms(s.mean), sd, ms(s.min), ms(s.p5), ms(s.p95), ms(s.p99), ms(s.max)]);
            rows.push(row);
        }
    }
    rows
}

fn pass_rows(run: &Run) -> Vec<Vec<String>> {
    let mut rows = vec![["pass", "loop", "p50", "share", "run", "skipped", "why"].map(str::to_owned).to_vec()];
    let names: Vec<&String> = run.modes.first().map_or(vec![], |m| m.passes.iter().map(|p| &p.name).collect());
    for name in names {
        for mode in &run.modes {
            let Some(p) = mode.passes.iter().find(|p| p.name == *name) else { continue };
            let time = p.p50_ms.map_or("-".to_owned(), ms);
            let share = p.share.filter(|_| p.n_run > 0).map_or("-".to_owned(), |s| format!("{:.1}%", 100.0 * s));
            let why = p.reason.clone().unwrap_or_default();
            rows.push(vec![
                name.clone(),
                mode.threading.clone(),
                time,
                share,
                p.n_run.to_string(),
                p.n_skipped.to_string(),
                why,
            ]);
        }
    }
    rows
}

fn ms(value: f64) -> String {
    format!("{value:.3}")
}
