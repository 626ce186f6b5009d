//! `nimbus farm plan` and `nimbus farm calibrate`.

use std::sync::atomic::AtomicBool;

use super::args::{CalibrateArgs, PlanArgs, Span};
use super::farm_told;
use super::output::{self, claim_file};
use super::progress::progress;
use super::scene::{print_warnings, typed_overrides};
use crate::error::{Error, Result};
use crate::farm::{
    AnyWork, Cut, CutOptions, Estimate, FileModel, Frames, MOST_ITEMS, Plan, PlanRequest, Rate,
    ReferenceDivision, RunOptions, ShardSize, calibrate, calibrate_by_farms, frames_workload,
    n_frames,
};
use crate::frame::DeviceChoice;
use crate::io::image::ImageKind;
use crate::io::scene_file::{self, LoadedScene};

/// Frames of a shard without a cost model.
const USUAL_FRAMES: u32 = 16;
/// Configurations or cases of a shard without a cost model.
const USUAL_CONFIGURATIONS: u32 = 8;
const USUAL_QUANTUM_S: f64 = 3600.0;
const USUAL_RETRIES: f64 = 0.02;

/// Runs `nimbus farm plan`.
///
/// # Errors
/// When the work cannot be planned, or the plan cannot be written.
pub fn plan(args: &PlanArgs) -> Result<()> {
    let set = typed_overrides(&args.set, args.size);
    let loaded = scene_file::load(&args.scene, &set, args.seed)?;
    print_warnings(&loaded, args.quiet);
    let cut = cut(args, &set, &loaded)?;
    // Errors of the price come before anything is written.
    let rate = args.rate.map(|price_per_quantum| Rate {
        quantum_s: args.quantum.unwrap_or(USUAL_QUANTUM_S),
        price_per_quantum,
        retry_share: args.retries.unwrap_or(USUAL_RETRIES),
    });
    let seconds: Option<Vec<f64>> = cut.parts.iter().map(|part| part.predicted_s).collect();
    let estimate = |seconds: Vec<f64>| Estimate::new(&seconds, args.n_nodes(), rate);
    let estimate = seconds.map(estimate).transpose()?;
    let plan = Plan::new(PlanRequest {
        scene: args.scene.clone(),
        set,
        seed: args.seed,
        shaders: args.shaders.clone(),
        device: args.device.clone(),
        cut,
    })?;
    plan.write(&args.output)?;
    if args.json {
        return output::object(&plan.to_json(&args.output)?);
    }
    let (n_shards, folder) = (plan.shards.len(), args.output.display());
    let items = plan.work.items();
    let (n, noun) = (items.end - items.start, plan.work.noun());
    output::text(&format!(
        "{n} {noun} in {n_shards} shard{}, planned in {folder}\n{}\
         all of them here:      nimbus farm local --plan {folder}\n\
         by Slurm:              nimbus farm submit slurm --plan {folder}\n\
         one of them:           nimbus farm run --plan {folder} --shard I     (I from 0 to {})\n",
        if n_shards == 1 { "" } else { "s" },
        estimate.map_or(String::new(), |estimate| estimate.to_string()),
        n_shards - 1
    ))
}

fn cut(args: &PlanArgs, set: &[String], loaded: &LoadedScene) -> Result<Cut> {
    let options = CutOptions {
        model: args.model.as_deref().map(FileModel::read).transpose()?,
        shard_seconds: args.shard_seconds.unwrap_or((60.0, 600.0)),
        n_nodes: args.n_nodes(),
    };
    let format = |usual| args.format.map_or(usual, Into::into);
    if let Some(of) = args.reference {
        let request = ReferenceDivision {
            of,
            i_frame: args.frame,
            n_samples: args.samples.unwrap_or(of.usual_samples()),
            tile: args.tile,
            range: args.shard_samples,
            format: format(ImageKind::Exr),
        };
        return request.cut(loaded, &options);
    }
    let ((work, workload), asked, usual) = if args.error {
        (farm_told::study(args, set)?, args.shard_configurations, USUAL_CONFIGURATIONS)
    } else if args.bench {
        (farm_told::sweep(args, set)?, args.shard_cases, USUAL_CONFIGURATIONS)
    } else {
        let Span { first, end } = args.frames.unwrap_or_else(|| all_frames(loaded));
        if end - first > MOST_ITEMS {
            return Err(Error::limit(format!(
                "--frames {first}..{end}: {} frames, expected at most {MOST_ITEMS}, whose amounts \
                 of work are counted one by one; make several plans",
                end - first
            )));
        }
        let format = format(ImageKind::Png);
        let work = AnyWork::Frames(Frames { first, n: end - first, format });
        ((work, frames_workload(loaded, first..end)?), args.shard_frames, USUAL_FRAMES)
    };
    Cut::new(work, &workload, ShardSize { asked, usual }, &options)
}

/// Returns all frames of a scene, or of its phases.
fn all_frames(loaded: &LoadedScene) -> Span {
    let phases = loaded.phases.iter().map(|phase| phase.n_frames);
    let end = match &loaded.phases[..] {
        [] => loaded.scene.time.n_frames,
        _ => phases.fold(0, u32::saturating_add),
    };
    Span { first: 0, end }
}

/// Runs `nimbus farm calibrate`.
///
/// # Errors
/// When a run fails, the runs do not determine a model, or the file cannot be written.
pub fn calibrated(args: &CalibrateArgs) -> Result<()> {
    let _claim = claim_file(&args.output, args.force)?;
    let choice = DeviceChoice { device: args.device.clone(), ..DeviceChoice::default() };
    let bar = progress(n_frames(args.scenes.len(), args.frames), "frames", args.quiet);
    let never = AtomicBool::new(false);
    let options = RunOptions { choice: &choice, stop: &never, on_item: &|_| bar.advance() };
    let found = match &args.farm[..] {
        [] => calibrate(&args.scenes, &args.set, args.frames, &options),
        farms => calibrate_by_farms(farms),
    };
    drop(bar);
    let found = found?;
    found.write(&args.output)?;
    output::wrote(&args.output, "the cost model of this device and processor", args.quiet);
    if args.json { output::object(&found) } else { output::text(&found.to_string()) }
}
