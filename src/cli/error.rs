//! `nimbus error SCENE`.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use clap::ColorChoice;

use super::args::ErrorArgs;
use super::error_configurations::{axes, design, load_configuration};
use super::error_table;
use super::interrupt::{self, PATIENCE, graceful_stop};
use super::output::{self, SharedFolder, check_out, lock_folder};
use super::progress::{Progress, ReferenceProgress, progress};
use super::scene::{
    StudyScene, load_study, open_for_study, pixels, print_sizes, with_texture_hint,
};
use crate::error::{Error, Result};
use crate::io::console::say;
use crate::io::image;
use crate::io::result_folder::Existing;
use crate::measure::picture::map::error_map;
use crate::model::backdrop::Backdrop;
use crate::model::film::Film;
use crate::model::scene::Scene;
use crate::reference::picture::{PathLimits, Pixels, ReferenceRequest};
use crate::report::charts::{self, Chart};
use crate::studies::cloud_error::CloudPixels;
use crate::studies::error::blocks::TimeKind;
use crate::studies::error::design::{best_within, settings};
use crate::studies::error::device_runner::{DeviceRunner, FrameChoice};
use crate::studies::error::files::{self, REFERENCE_FILE};
use crate::studies::error::front::Metric;
use crate::studies::error::records::{Budget, Configuration, Study};
use crate::studies::error::study::{ErrorStudy, Event, StudyPlan, StudyResults};
use crate::studies::kept_paths::Traced;
use crate::studies::provenance::{Provenance, ReferenceRecord};
use crate::studies::reference_cache::{self, CachedReference, Making};
use crate::timing::json::ResultFile;
use crate::timing::limits::check_study;
use crate::timing::names::Setting;

/// Runs `nimbus error`.
///
/// # Errors
/// Fails if the arguments or the scene are faulty, the device fails, or Ctrl-C came. Finished
/// results are kept in `--out`.
pub fn run(args: &ErrorArgs, color: ColorChoice) -> Result<()> {
    if let Some(out) = &args.out {
        check_out(out, args.force || args.resume)?;
        interrupt::note_until_keep("interrupted before the first round: nothing was written");
    }
    let StudyScene { options, loaded, scene, time_s } =
        load_study(&args.scene, &args.options, args.plain, args.frame)?;
    let backdrop = Backdrop::of(&scene, time_s);
    if (args.reference_error.is_some() || args.paths.is_some()) && !args.against.is_random() {
        return Err(Error::usage(format!(
            "--reference-error and --paths: only \"transport\" is random; expected neither with \
             --against {}",
            args.against
        )));
    }
    if args.metric == Metric::Cloud && !args.against.is_random() {
        return Err(Error::usage(format!(
            "--metric cloud: only random paths tell it; expected --against transport, found {}",
            args.against
        )));
    }
    let axes = axes(args, &options, &scene)?;
    let (gpu, clocks) = open_for_study(&options, &scene, time_s)?;
    if args.options.verbose {
        print_sizes(&scene, None);
    }
    let plan = StudyPlan {
        axes,
        design: design(args),
        metric: args.metric,
        time: time_kind(args, gpu.device.limits().timestamp_valid_bits > 0)?,
        n_rounds: args.rounds as usize,
        part: args.part.map(|part| part.first as usize..part.end as usize),
    };
    let n_settings = settings(&plan.axes, plan.design).len() as u64;
    check_study(1 + n_settings, args.rounds, args.frames)?;
    let pixels = pixels(&scene, args.pixels)?;
    let existing = if args.resume { Existing::Extend } else { Existing::new(args.force) };
    let stop = graceful_stop();
    let folder = SharedFolder::default();
    let (last_round, traced) = (LastRound::default(), Traced::default());
    let mut keeping = {
        let (args, folder) = (args.clone(), folder.clone());
        let (last_round, traced) = (last_round.clone(), traced.clone());
        interrupt::keep(PATIENCE, move || {
            output::kept_paths(traced.keep());
            cut_short(&args, color, &folder, &last_round)
        })
    };
    // Claimed before the reference is computed, which may take minutes.
    let open = |out| files::open(out, existing, n_configurations(args, &plan));
    *lock_folder(&folder) = args.out.as_deref().map(open).transpose()?;
    let cached = reference(args, (&scene, time_s), &pixels, &traced)?;
    let mut study = Study {
        made: Provenance::now(Study::SCHEMA, &args.scene, &loaded, gpu.device.info(), clocks),
        reference: ReferenceRecord::of(&cached, args.against, &pixels, args.frame, time_s),
        metric: plan.metric,
        time: plan.time,
        rounds: 0,
        frames: args.frames,
        as_played: args.as_played,
        own_shaders: args.options.shaders.is_some(),
        configurations: Vec::new(),
        best: Vec::new(),
        // A study that is killed before its end is one that can be resumed.
        interrupted: true,
    };
    let mut results = earlier(args, &study)?;
    update(args, &mut study, &results);
    if let Some(folder) = &mut *lock_folder(&folder) {
        folder.add(REFERENCE_FILE, |path| {
            write_reference(path, &backdrop, &pixels, &cached.reference.rgba)
        })?;
        files::write(folder, &study, &results)?;
    }
    let (n_frames, as_played) = (args.frames, args.as_played);
    let frames = FrameChoice { i_frame: args.frame, time_s, n_frames, as_played };
    let mut runner = DeviceRunner::new(&gpu, frames);
    let load = |settings: &[Setting]| load_configuration(args, &options, settings);
    let reference = &cached.reference;
    let cloud =
        args.against.is_random().then(|| CloudPixels::new(&scene, time_s, &pixels)).transpose()?;
    let cloud = cloud.as_ref();
    let running = ErrorStudy { plan: &plan, load: &load, reference, pixels: &pixels, cloud, stop };
    let bar = progress(0, "configurations", args.options.quiet);
    let done = {
        let mut recorder = Recorder {
            args,
            folder: &folder,
            last_round: &last_round,
            study: &mut study,
            backdrop: &backdrop,
            pixels: &pixels,
            reference: &cached.reference.rgba,
            bar: &bar,
        };
        running.run(&mut runner, &mut results, &mut |event| recorder.on(event))
    };
    keeping.finish();
    drop(bar);
    drop(runner);
    study.interrupted = !matches!(done, Ok(true));
    update(args, &mut study, &results);
    // The table appears even if the results cannot be written.
    let mut written = Ok(());
    if let Some(folder) = &mut *lock_folder(&folder) {
        let chart = charts::error::chart(&study);
        let svg = chart.svg(chart.size())?;
        written = files::write_last(folder, &study, &results, &svg, &[]);
    }
    if done.is_ok() || study.configurations.iter().any(|c| c.n_turns > 0) {
        print(args, color, &study)?;
    }
    done?;
    written?;
    if let Some(folder) = &*lock_folder(&folder) {
        output::wrote_folder(folder, !study.interrupted, args.options.quiet);
    }
    gpu.close()?;
    if study.interrupted { Err(Error::Interrupted) } else { Ok(()) }
}

/// The study after its last whole round, which Ctrl-C prints.
type LastRound = Arc<Mutex<Option<Study>>>;

/// Prints what is finished of a study whose present step takes too long to stop, and says what is
/// kept.
fn cut_short(
    args: &ErrorArgs,
    color: ColorChoice,
    folder: &SharedFolder,
    last_round: &LastRound,
) -> Error {
    let printed = match &*last_round.lock().unwrap_or_else(PoisonError::into_inner) {
        Some(study) => print(args, color, study),
        None => Ok(()),
    };
    let mut folder = lock_folder(folder);
    match folder.as_ref().and_then(|folder| folder.unfinished_at()) {
        Some(at) => say!(
            "the step under way was cut short; {} has the rounds before it, and --resume goes on",
            at.display()
        ),
        None => say!("the step under way was cut short; no result is kept"),
    }
    drop(folder.take());
    printed.err().unwrap_or(Error::Interrupted)
}

fn print(args: &ErrorArgs, color: ColorChoice, study: &Study) -> Result<()> {
    if args.json {
        return output::object(study);
    }
    if args.csv {
        let rows: Vec<_> = study.configurations.iter().map(files::csv_row).collect();
        return output::text(&output::rows(&rows, false)?);
    }
    output::text(&error_table::report(study))?;
    if args.plot {
        output::painted(&output::chart_text(&charts::error::chart(study), color)?)?;
    }
    Ok(())
}

/// Returns the reference, from the cache if it is there.
fn reference(
    args: &ErrorArgs,
    (scene, time_s): (&Scene, f64),
    pixels: &Pixels,
    traced: &Traced,
) -> Result<CachedReference> {
    let shown = ReferenceProgress::new(args.options.quiet);
    let folder = reference_cache::default_folder();
    let usual = PathLimits::USUAL;
    let limits = PathLimits {
        error: args.reference_error.unwrap_or(usual.error),
        most: args.paths.unwrap_or(usual.most),
    };
    let how = Making { folder: folder.as_deref(), limits, stop: graceful_stop(), traced };
    let request = ReferenceRequest { kind: args.against, scene, time_s };
    reference_cache::reference(&request, pixels, &how, &|work, n| shown.advance(work, n))
        .inspect_err(|error| {
            if matches!(error, Error::Interrupted) {
                output::kept_paths(traced.keep());
            }
        })
        .map_err(|error| with_texture_hint(error, ", or --against thin or slices"))
}

/// Returns the time that decides.
fn time_kind(args: &ErrorArgs, has_timestamps: bool) -> Result<TimeKind> {
    match args.time {
        Some(TimeKind::Gpu) if !has_timestamps => Err(Error::usage(
            "--time gpu: this device has no timestamps, or --pass-times off is given; expected \
             --time frame",
        )),
        Some(time) => Ok(time),
        None => Ok(if has_timestamps { TimeKind::Gpu } else { TimeKind::Frame }),
    }
}

/// Returns the greatest number of configurations that the study in `--out` may have in the end. The
/// earlier results are read again once the folder is claimed, because another run may extend them
/// until then.
fn n_configurations(args: &ErrorArgs, plan: &StudyPlan) -> usize {
    let earlier = args.out.as_ref().filter(|_| args.resume);
    let earlier = earlier.and_then(|out| files::read_earlier(out).ok());
    let n_earlier = earlier.map_or(0, |(study, _)| study.configurations.len());
    n_earlier + settings(&plan.axes, plan.design).len()
}

/// Returns the results in `--out` if they are to be resumed.
fn earlier(args: &ErrorArgs, study: &Study) -> Result<StudyResults> {
    let Some(out) = args.out.as_ref().filter(|out| args.resume && out.exists()) else {
        return Ok(StudyResults::default());
    };
    let (before, results) = files::read_earlier(out)?;
    let (made, made_before) = (&study.made, &before.made);
    let is_same_device =
        made_before.device == made.device && made_before.environment == made.environment;
    let mut differ: Vec<&str> = [
        ("the scene", made_before.scene_hash == made.scene_hash),
        ("the reference", before.reference.hash == study.reference.hash),
        ("the device", is_same_device),
        ("the build", made_before.code == made.code),
        ("the time that decides", before.time == study.time),
        ("--frames", before.frames == study.frames),
        ("--frame", before.reference.frame == study.reference.frame),
        ("--as-played", before.as_played == args.as_played),
        // The shaders in a folder may have changed.
        ("--shaders", !before.own_shaders && !study.own_shaders),
    ]
    .into_iter()
    .filter(|(_, is_same)| !is_same)
    .map(|(what, _)| what)
    .collect();
    if differ.is_empty() {
        return Ok(results);
    }
    differ.sort_unstable();
    let what = format!("is of another study; what differs: {}", differ.join(", "));
    Err(Error::io(out, what))
}

/// Copies the results into the record, and finds the best configuration for each budget.
fn update(args: &ErrorArgs, study: &mut Study, results: &StudyResults) {
    study.configurations = results.configurations.clone();
    study.rounds = results.n_rounds;
    let by_ms = args.budget_ms.iter().map(|value| (Budget::Ms, *value));
    let by_error = args.budget_error.iter().map(|value| (Budget::Error, *value));
    let best = |(budget, value)| {
        best_within(&study.configurations, study.metric, study.time, budget, value)
    };
    study.best = by_ms.chain(by_error).map(best).collect();
}

/// Shows the progress of a study and saves its results on the way.
struct Recorder<'a> {
    args: &'a ErrorArgs,
    folder: &'a SharedFolder,
    last_round: &'a LastRound,
    study: &'a mut Study,
    backdrop: &'a Backdrop,
    pixels: &'a Pixels,
    reference: &'a [[f64; 4]],
    bar: &'a Progress,
}

impl Recorder<'_> {
    fn on(&mut self, event: Event<'_>) -> Result<()> {
        match event {
            Event::More(n) => self.bar.add_parts(n as u64),
            Event::Block => self.bar.advance(),
            Event::Picture { i, rgba, results } => {
                self.bar.advance();
                self.write_picture(i, rgba, &mut results.configurations[i])?;
            }
            Event::Round(results) => {
                update(self.args, self.study, results);
                let mut last = self.last_round.lock().unwrap_or_else(PoisonError::into_inner);
                *last = Some(self.study.clone());
                drop(last);
                if let Some(folder) = &mut *lock_folder(self.folder) {
                    files::write(folder, self.study, results)?;
                }
            }
        }
        Ok(())
    }

    /// Writes the picture of a configuration, and the map of its error.
    fn write_picture(
        &self,
        i: usize,
        rgba: &[f32],
        configuration: &mut Configuration,
    ) -> Result<()> {
        let mut folder = lock_folder(self.folder);
        let Some(folder) = &mut *folder else { return Ok(()) };
        let (Film { width, height, .. }, pixels) = (self.backdrop.film, self.pixels);
        let [picture, map] = files::picture_files(i);
        folder.add(&picture, |path| image::write(path, self.backdrop, width, height, rgba))?;
        let at = |k: usize| &rgba[4 * pixels.index(pixels.at[k])..][..4];
        let error = |(k, r): (usize, &[f64; 4])| {
            let sum: f64 = at(k).iter().zip(r).map(|(a, b)| (f64::from(*a) - b).powi(2)).sum();
            (0.25 * sum).sqrt()
        };
        let errors: Vec<f64> = self.reference.iter().enumerate().map(error).collect();
        let colors = error_map(width, height, &pixels.spread(&errors));
        folder.add(&map, |path| image::write_bytes(path, width, height, &colors))?;
        (configuration.picture, configuration.error_map) = (Some(picture), Some(map));
        Ok(())
    }
}

/// Writes the reference as a picture in which every cell has the value of its pixel.
fn write_reference(
    path: &Path,
    shown: &Backdrop,
    pixels: &Pixels,
    rgba: &[[f64; 4]],
) -> Result<()> {
    let whole: Vec<f32> = pixels.spread(rgba).into_iter().flatten().map(|v| v as f32).collect();
    image::write(path, shown, shown.film.width, shown.film.height, &whole)
}
