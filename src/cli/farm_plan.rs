//! `nimbus farm plan` and `calibrate`: what there is to do, and what it will take.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use serde_json::{Value, json};

use super::args::{Args, CalibrateArgs, Command, ErrorArgs, FormatArg, PlanArgs, Span};
use super::farm_cut::{Amounts, Cut, cut};
use super::{farm_bench, farm_reference, output, tradeoff};
use crate::error::{Error, Result};
use crate::farm::amounts::{work_of_beginning, work_of_frames};
use crate::farm::calibrate::{calibrate, n_runs, of_farms};
use crate::farm::pack::{Packing, Rate, pack, price};
use crate::farm::plan::{PictureFormat, Plan, Wish, Work};
use crate::farm::run::How;
use crate::frame::DeviceChoice;
use crate::io::atomic;
use crate::io::scene_file::{self, LoadedScene};

/// Frames of a shard where nothing is known of what they take.
const USUAL_FRAMES: u32 = 16;
/// Configurations, or cases.
const USUAL_CONFIGURATIONS: u32 = 8;
const USUAL_QUANTUM_S: f64 = 3600.0;
const USUAL_RETRIES: f64 = 0.02;

pub fn plan(args: &PlanArgs) -> Result<()> {
    let mut set = args.set.clone();
    if let Some((width, height)) = args.size {
        set.extend([format!("film.width={width}"), format!("film.height={height}")]);
    }
    let loaded = scene_file::load(&args.scene, &set, args.seed)?;
    for warning in super::warnings_of(&loaded).iter().filter(|_| !args.quiet) {
        eprintln!("warning: {warning}");
    }
    let Cut { work, sizes, counted, predicted_s, predicted_for } = match args.reference {
        Some(of) => farm_reference::cut(args, of, &loaded)?,
        None if args.error => study(args, &set)?,
        None if args.bench => bench(args, &set)?,
        None => frames(args, &loaded)?,
    };
    // What is to be said of the price is known to be right before anything is written.
    let packing = predicted_s.as_deref().map(|seconds| pack(seconds, args.n_nodes()));
    let estimate = packing.map(|packing| estimate(args, &packing)).transpose()?;
    let plan = Plan::new(Wish {
        scene: args.scene.clone(),
        set,
        seed: args.seed,
        shaders: args.shaders.clone(),
        device: args.device.clone(),
        work,
        sizes,
        counted,
        predicted_s,
        predicted_for,
    })?;
    plan.write(&args.output)?;
    if args.json {
        return output::object(&told(&plan, &args.output)?);
    }
    let (n_shards, folder) = (plan.shards.len(), args.output.display());
    let items = plan.work.items();
    let (n, noun) = (items.end - items.start, plan.work.noun());
    output::text(&format!(
        "{n} {noun} in {n_shards} shard{}\n{}\
         all of them here:      nimbus farm local --plan {folder}\n\
         by Slurm:              nimbus farm submit slurm --plan {folder}\n\
         one, by any engine:    nimbus farm run --plan {folder} --shard I     (I from 0 to {})\n",
        if n_shards == 1 { "" } else { "s" },
        estimate.unwrap_or_default(),
        n_shards - 1
    ))
}

/// The plan, and with each shard what `nimbus` is to be called with and which files come of it.
fn told(plan: &Plan, folder: &Path) -> Result<Value> {
    let wrong = |cause| Error::io(folder, cause);
    let mut value = serde_json::to_value(plan).map_err(|cause| wrong(cause.to_string()))?;
    let shards = value.get_mut("shards").and_then(Value::as_array_mut);
    for (said, shard) in shards.into_iter().flatten().zip(&plan.shards) {
        let folder = folder.display().to_string();
        said["arguments"] =
            json!(["farm", "run", "--plan", folder, "--shard", shard.index.to_string()]);
        said["outputs"] = json!(plan.outputs(shard));
    }
    Ok(value)
}

/// All frames of a scene, or of its phases.
fn whole(loaded: &LoadedScene) -> Span {
    let of_phases = loaded.phases.iter().map(|phase| phase.n_frames).fold(0, u32::saturating_add);
    Span {
        first: 0,
        end: if loaded.phases.is_empty() { loaded.scene.time.n_frames } else { of_phases },
    }
}

fn frames(args: &PlanArgs, loaded: &LoadedScene) -> Result<Cut> {
    let Span { first, end } = args.frames.unwrap_or_else(|| whole(loaded));
    let n = end - first;
    let format = match args.format {
        Some(FormatArg::Exr) => PictureFormat::Exr,
        Some(FormatArg::Png) | None => PictureFormat::Png,
    };
    let work = Work::Frames { first, n, format };
    let amounts = Amounts {
        items: work_of_frames(loaded, first..end)?,
        of_shard: work_of_beginning(loaded, first)?,
    };
    cut(args, work, &amounts, (args.shard_frames, USUAL_FRAMES))
}

/// The configurations that `nimbus error` would measure, told the same.
fn study(args: &PlanArgs, set: &[String]) -> Result<Cut> {
    let parsed = |more: &[String]| {
        let begin = ["nimbus".into(), "error".into(), args.scene.display().to_string()];
        match Args::try_parse_from(begin.iter().chain(more).chain(&args.told)) {
            Ok(Args { command: Command::Error(of), .. }) => Ok(of),
            Ok(_) => Err(Error::usage("expected arguments of nimbus error after \"--\"")),
            Err(cause) => Err(Error::usage(format!(
                "after \"--\": {}",
                cause.to_string().trim_start_matches("error: ")
            ))),
        }
    };
    let ErrorArgs {
        out,
        resume,
        force,
        plot,
        json,
        csv,
        part,
        budget_ms,
        budget_error,
        options,
        ..
    } = parsed(&[])?;
    let is_results = out.is_some() || resume || force || plot || json || csv || part.is_some();
    let is_budget = !budget_ms.is_empty() || !budget_error.is_empty();
    let is_scene = !options.set.is_empty() || options.seed.is_some() || options.size.is_some();
    let is_device = options.device.is_some()
        || options.shaders.is_some()
        || options.validation
        || options.poison;
    if is_results || is_budget || is_scene || is_device {
        return Err(Error::usage(
            "after \"--\": expected no --out, --resume, --force, --plot, --json, --csv, --part, \
             --budget-… or \
             --validation; --set, --seed, --size, --device and --shaders stand before it",
        ));
    }
    let of_scene = set
        .iter()
        .map(|set| format!("--set={set}"))
        .chain(args.seed.iter().map(|n| format!("--seed={n}")));
    let (configurations, amounts) =
        tradeoff::configurations(&parsed(&of_scene.collect::<Vec<_>>())?)?;
    let work = Work::Error { arguments: args.told.clone(), configurations };
    cut(args, work, &amounts, (args.shard_configurations, USUAL_CONFIGURATIONS))
}

/// The cases that `nimbus bench` would time, told the same.
fn bench(args: &PlanArgs, set: &[String]) -> Result<Cut> {
    let (work, amounts) = farm_bench::work(args, set)?;
    cut(args, work, &amounts, (args.shard_cases, USUAL_CONFIGURATIONS))
}

/// What all of it takes and costs, in words.
fn estimate(args: &PlanArgs, packing: &Packing) -> Result<String> {
    let all_s: f64 = packing.node_seconds.iter().sum();
    let mut text = format!(
        "predicted: {} of runs; on {} nodes done after {}, {:.0} % of their time idle\n",
        duration(all_s),
        args.n_nodes(),
        duration(packing.makespan_s),
        100.0 * packing.idle_share
    );
    if let Some(price_per_quantum) = args.rate {
        let quantum_s = args.quantum.unwrap_or(USUAL_QUANTUM_S);
        let rate = Rate {
            quantum_s,
            price_per_quantum,
            retry_share: args.retries.unwrap_or(USUAL_RETRIES),
        };
        let price = price(packing, &rate).map_err(Error::usage)?;
        text += &format!(
            "price: {:.2} for {} pieces of {} s, and {:.2} for retries to be expected: {:.2}\n",
            price.without_retries, price.quanta, quantum_s, price.retries, price.total
        );
    }
    Ok(text)
}

fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.1} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

fn runs(n: usize) -> String {
    if n == 1 { "1 run".to_owned() } else { format!("{n} runs") }
}

pub fn calibrated(args: &CalibrateArgs, stop: &AtomicBool) -> Result<()> {
    atomic::check_place(&args.output)?;
    super::refuse_existing(&args.output, args.force)?;
    let choice = DeviceChoice { device: args.device.clone(), ..DeviceChoice::default() };
    let n_frames = n_runs(args.scenes.len()) as u64 * u64::from(args.frames + 1) / 2;
    let bar = output::progress(n_frames, "frames", args.quiet);
    let how = How { choice: &choice, stop, on_item: &|| bar.inc(1) };
    let found = match &args.farm[..] {
        [] => calibrate(&args.scenes, &args.set, args.frames, &how),
        farms => of_farms(farms),
    };
    bar.finish_and_clear();
    let found = found?;
    found.write(&args.output)?;
    if args.json {
        return output::object(&found);
    }
    let (fit, percent) = (&found.fit, |share: f64| format!("{:.0} %", 100.0 * share));
    let mut text =
        format!("{} of {}, {} ({})\n", runs(fit.n), found.of, found.device.name, found.cpu.model);
    let model = fit.model;
    for (name, each_s) in [
        ("set-up", model.setup_s),
        ("a step", model.step_s),
        ("a particle and step", model.particle_step_s),
        ("a cell of the grid", model.cell_s),
        ("a pixel and sample", model.pixel_sample_s),
        ("a pair of facets", model.facet_pair_s),
        ("making textures", model.texture_s),
    ] {
        let each = each_s.map_or("not measured".to_owned(), |s| format!("{s:.3e} s"));
        text += &format!("{name:>28}: {each}\n");
    }
    let left_out = fit
        .left_out_median
        .map_or(String::new(), |e| format!("; of runs left out in turn {}", percent(e)));
    text += &format!(
        "off by {} (median), {} at most{left_out}\n",
        percent(fit.median_relative_error),
        percent(fit.largest_relative_error)
    );
    for what in &fit.not_told_apart {
        text += &format!("not told apart from the others: {what}\n");
    }
    output::text(&text)
}
