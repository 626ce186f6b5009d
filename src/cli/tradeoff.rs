//! `nimbus error SCENE`.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use clap::ColorChoice;
use indicatif::ProgressBar;

use super::args::{ErrorArgs, MetricArg, TimeArg};
use super::render_reference::Shown;
use super::{device_choice, load, output, say_sizes, tradeoff_table};
use crate::error::{Error, Result};
use crate::farm::{StudyTurns, Workload, study_workload};
use crate::frame::GpuContext;
use crate::frame::limits;
use crate::io::image;
use crate::measure::picture::map::error_map;
use crate::model::film::Film;
use crate::model::scene::Scene;
use crate::reference::picture::{Pixels, RenderStage};
use crate::report::charts::{self, Chart};
use crate::studies::error::design::{Design, name_of, settings};
use crate::studies::error::files;
use crate::studies::error::front::{Metric, best_within_error, best_within_ms};
use crate::studies::error::knobs::default_axes;
use crate::studies::error::players::{Frames, Players};
use crate::studies::error::records::{Configuration, Study};
use crate::studies::error::run::{Event, Found, Loaded, Setup, StudyPlan};
use crate::studies::error::turns::Time;
use crate::studies::provenance::{Provenance, ReferenceRecord};
use crate::studies::reference_cache::{self, Kept};
use crate::timing::json::ResultFile;
use crate::timing::machine;
use crate::timing::names::Setting;
use crate::timing::results::prepare_out_dir;
use crate::timing::sweep::{Axis, SIZE_KEY, overrides};

/// `graceful`: set once there is something to keep on Ctrl-C.
pub fn run(
    args: &ErrorArgs,
    color: ColorChoice,
    stop: &AtomicBool,
    graceful: &AtomicBool,
) -> Result<()> {
    if let (Some(out), false) = (&args.out, args.resume) {
        super::refuse_existing(out, args.force)?;
    }
    let options = plain(args)?;
    let base = load(&args.scene, &options)?;
    let time_s = base.scene.time.at(args.frame);
    let scene = &base.clone().at_frame(args.frame);
    super::check_time(scene, time_s)?;
    let film = scene.film;
    let axes = axes(args, scene)?;
    check_values(args, &options, &axes, &film)?;
    let gpu = GpuContext::open(&device_choice(&args.options))?;
    limits::check(scene, gpu.device.limits())?;
    let clocks =
        machine::clocks_record(gpu.device.info(), &mut gpu.player(scene.clone(), true)?.renderer)?;
    if args.options.verbose {
        say_sizes(scene, None);
    }
    let time = time(args, gpu.device.limits().timestamp_valid_bits > 0)?;
    let metric = metric(args.metric);
    let pixels = Pixels::sample(film.width, film.height, args.pixels);
    let kept = reference(args, scene, time_s, &pixels)?;
    let design = if args.grid { Design::Grid } else { Design::Alone };
    let part = args.part.map(|part| part.first as usize..part.end as usize);
    let plan = StudyPlan { axes, design, metric, time, n_rounds: args.rounds as usize, part };
    let made = Provenance::now(Study::SCHEMA, &args.scene, &base, gpu.device.info(), clocks);
    let reference = ReferenceRecord::of(&kept, args.against, &pixels, args.frame, time_s);
    let mut study = begun(args, made, reference, &plan);
    let mut found = earlier(args, &study)?;
    sum_up(args, &mut study, &found, metric, time);
    if let Some(out) = &args.out {
        prepare_out_dir(out, true)?;
        if !args.resume {
            files::remove_earlier(out)?;
        }
        write_spread(&out.join("reference.png"), &film, &pixels, &kept.reference.rgba)?;
        // However early it is ended, the folder holds a study that can be gone on with, and no
        // earlier one's.
        files::write(out, &Study { interrupted: true, ..study.clone() }, &found)?;
    }
    graceful.store(true, Ordering::Relaxed);
    let frames =
        Frames { i_frame: args.frame, time_s, n_frames: args.frames, as_played: args.as_played };
    let mut players = Players::new(&gpu, frames);
    let loader = |settings: &[Setting]| load_with(args, &options, settings);
    let setup =
        Setup { plan: &plan, load: &loader, reference: &kept.reference, pixels: &pixels, stop };
    let bar = output::progress(0, "configurations", args.options.quiet);
    let done = {
        let mut keeping = Keeping {
            args,
            study: &mut study,
            film: &film,
            pixels: &pixels,
            kept: &kept,
            bar: &bar,
        };
        setup.run(&mut players, &mut found, &mut |event| keeping.on(event))
    };
    bar.finish_and_clear();
    drop(players);
    study.interrupted = !matches!(done, Ok(true));
    sum_up(args, &mut study, &found, metric, time);
    if let Some(out) = &args.out {
        files::write(out, &study, &found)?;
        output::write_chart(&out.join("front.svg"), &charts::error::chart(&study))?;
    }
    done?;
    print(args, color, &study)?;
    gpu.close()?;
    if study.interrupted { Err(Error::Interrupted) } else { Ok(()) }
}

/// A study that has found nothing yet.
fn begun(
    args: &ErrorArgs,
    made: Provenance,
    reference: ReferenceRecord,
    plan: &StudyPlan,
) -> Study {
    Study {
        made,
        reference,
        metric: plan.metric.name().into(),
        time: plan.time.name().into(),
        rounds: 0,
        frames: args.frames,
        as_played: args.as_played,
        own_shaders: args.options.shaders.is_some(),
        configurations: Vec::new(),
        best: Vec::new(),
        interrupted: false,
    }
}

fn print(args: &ErrorArgs, color: ColorChoice, study: &Study) -> Result<()> {
    if args.json {
        return output::object(study);
    }
    if args.csv {
        let rows: Vec<_> = study.configurations.iter().map(files::csv_row).collect();
        return output::rows(&rows, false);
    }
    output::text(&tradeoff_table::report(study))?;
    if !args.plot {
        return Ok(());
    }
    let chart = charts::error::chart(study);
    output::text(&format!(
        "\n{}",
        chart.text(output::columns(), chart.rows(), output::colored(color))?
    ))
}

/// Returns the names of the configurations that a study measures, without the base configuration, in
/// the order that `--part` counts by, and the amount of work in them.
pub(super) fn configurations(args: &ErrorArgs) -> Result<(Vec<String>, Workload)> {
    let options = plain(args)?;
    let scene = load(&args.scene, &options)?.at_frame(args.frame);
    super::check_time(&scene, scene.time.at(args.frame))?;
    let axes = axes(args, &scene)?;
    check_values(args, &options, &axes, &scene.film)?;
    args.against.check(&scene, scene.time.at(args.frame))?;
    let design = if args.grid { Design::Grid } else { Design::Alone };
    let all = settings(&axes, design);
    let scenes = all.iter().map(|settings| Ok(load_with(args, &options, settings)?.scene));
    let turns = StudyTurns {
        i_frame: args.frame,
        n_rounds: args.rounds,
        n_frames: args.frames,
        as_played: args.as_played,
    };
    let workload = study_workload(&scene, scenes, turns)?;
    Ok((all.iter().map(|settings| name_of(settings)).collect(), workload))
}

/// The options, with every cloud plain where that is asked for.
fn plain(args: &ErrorArgs) -> Result<super::SceneArgs> {
    let mut options = args.options.clone();
    let quiet = super::SceneArgs { quiet: true, ..options.clone() };
    if args.plain && !load(&args.scene, &quiet)?.scene.clouds.is_empty() {
        options.set.push("cloud.*.texture=\"none\"".to_owned());
    }
    Ok(options)
}

const ONE_SIZE: &str = "pictures of several sizes cannot be compared with one reference";

/// The knobs' values: those named, or all that can change the scene.
fn axes(args: &ErrorArgs, scene: &Scene) -> Result<Vec<Axis>> {
    if args.knob.is_empty() {
        return Ok(default_axes(scene));
    }
    let axes = Axis::parse_all("--knob", &args.knob)?;
    for Axis { key, .. } in &axes {
        let refuse = |what: &str| Err(Error::usage(format!("--knob {key}: {what}")));
        if key == SIZE_KEY {
            return refuse(ONE_SIZE);
        }
        let table = key.split('.').next().unwrap_or_default().trim();
        if key.starts_with("draw.impostor") {
            return refuse(
                "a frame alone, as it is compared, is drawn without; bench --sweep times them",
            );
        }
        const ASKED_FOR: [&str; 8] = [
            "film.background",
            "film.exposure",
            "film.tone_map",
            "lighting.forward",
            "draw.particles",
            "draw.texture_seed",
            "draw.error",
            "draw",
        ];
        if ASKED_FOR.contains(&key.as_str()) || ["light", "material"].contains(&table) {
            return refuse(
                "changes what is asked for, or nothing that is compared, and not how \
                 it is computed",
            );
        }
        if ["title", "time", "threads", "camera", "phase"].contains(&table) {
            return refuse(
                "changes no picture, or which picture it is; expected a key of film, lighting, \
                 draw, cloud or surface",
            );
        }
    }
    Ok(axes)
}

/// Refuses a value that the scene cannot have, before anything takes time and before anything is
/// written.
fn check_values(
    args: &ErrorArgs,
    options: &super::SceneArgs,
    axes: &[Axis],
    film: &Film,
) -> Result<()> {
    // Those that nobody named are checked when they are run.
    let named = if args.knob.is_empty() { &[] } else { axes };
    settings(named, Design::Alone).iter().try_for_each(|alone| {
        let Film { width, height, .. } = load_with(args, options, alone)?.scene.film;
        match (width, height) == (film.width, film.height) {
            true => Ok(()),
            false => Err(Error::usage(format!("--knob {}: {ONE_SIZE}", name_of(alone)))),
        }
    })
}

/// The scene with a configuration's settings. What is wrong with one is the knob's fault.
fn load_with(args: &ErrorArgs, options: &super::SceneArgs, settings: &[Setting]) -> Result<Loaded> {
    let overrides = overrides(settings)?;
    let mut with = super::SceneArgs { quiet: true, ..options.clone() };
    with.set.extend(overrides.iter().cloned());
    let loaded = load(&args.scene, &with).map_err(|error| match error {
        Error::Scene { mut at, what } => {
            if let Some(set) =
                at.source.strip_prefix("--set ").filter(|set| overrides.iter().any(|o| o == set))
            {
                at.source = format!("--knob {set}");
            }
            Error::Scene { at, what }
        }
        other => other,
    })?;
    let hash = loaded.hash.clone();
    // What "auto" would take may differ from one to the next, and they would differ in more than
    // their names.
    Ok(Loaded { scene: Arc::new(loaded.at_frame(args.frame).exact().into_owned()), hash })
}

fn reference(args: &ErrorArgs, scene: &Scene, time_s: f64, pixels: &Pixels) -> Result<Kept> {
    let quiet = args.options.quiet;
    let shown = Mutex::new(Shown::spinner(quiet));
    let on_part = |work: RenderStage, n: usize| {
        shown.lock().unwrap_or_else(PoisonError::into_inner).advance(work, n, quiet);
    };
    let folder = reference_cache::default_folder();
    reference_cache::reference(args.against, scene, time_s, pixels, folder.as_deref(), &on_part)
        .map_err(|error| match error {
            Error::Usage { what } if what.contains("textured") => {
                Error::usage(format!("{what}, or --plain for all clouds, or --against thin"))
            }
            other => other,
        })
}

fn metric(arg: MetricArg) -> Metric {
    match arg {
        MetricArg::Rmse => Metric::Rmse,
        MetricArg::Max => Metric::Max,
        MetricArg::Relmse => Metric::RelMse,
    }
}

fn time(args: &ErrorArgs, has_timestamps: bool) -> Result<Time> {
    match args.time {
        Some(TimeArg::Gpu) if !has_timestamps => {
            Err(Error::usage("--time gpu: this device has no timestamps; expected --time frame"))
        }
        Some(TimeArg::Gpu) => Ok(Time::Gpu),
        Some(TimeArg::Frame) => Ok(Time::Frame),
        None => Ok(if has_timestamps { Time::Gpu } else { Time::Frame }),
    }
}

/// What an earlier run in `--out` found, where it is to be gone on with and is of the same study.
fn earlier(args: &ErrorArgs, study: &Study) -> Result<Found> {
    let (Some(out), true) = (&args.out, args.resume) else { return Ok(Found::default()) };
    if !out.exists() {
        return Ok(Found::default());
    }
    let (before, found) = files::read_found(out)?;
    let same = [
        ("the scene", before.made.scene_hash == study.made.scene_hash),
        ("the reference", before.reference.hash == study.reference.hash),
        (
            "the device",
            before.made.device == study.made.device
                && before.made.environment == study.made.environment,
        ),
        ("the build", before.made.code == study.made.code),
        ("the time that decides", before.time == study.time),
        ("--frames", before.frames == study.frames),
        ("--frame", before.reference.frame == study.reference.frame),
        ("--as-played", before.as_played == args.as_played),
        // What is in such a folder may have changed.
        ("--shaders", !before.own_shaders && !study.own_shaders),
    ];
    let differ: BTreeSet<&str> =
        same.iter().filter(|(_, same)| !same).map(|(what, _)| *what).collect();
    if !differ.is_empty() {
        let what = differ.into_iter().collect::<Vec<_>>().join(", ");
        return Err(Error::io(out, format!("is of another study; what differs: {what}")));
    }
    Ok(found)
}

fn sum_up(args: &ErrorArgs, study: &mut Study, found: &Found, metric: Metric, time: Time) {
    study.configurations = found.configurations.clone();
    study.rounds = found.n_rounds;
    let is_gpu = time == Time::Gpu;
    let all = &study.configurations;
    let by_ms = args.budget_ms.iter().map(|ms| best_within_ms(all, metric, *ms, is_gpu));
    let by_error =
        args.budget_error.iter().map(|error| best_within_error(all, metric, *error, is_gpu));
    study.best = by_ms.chain(by_error).collect();
}

/// What is shown and kept while a study runs.
struct Keeping<'a> {
    args: &'a ErrorArgs,
    study: &'a mut Study,
    film: &'a Film,
    pixels: &'a Pixels,
    kept: &'a Kept,
    bar: &'a ProgressBar,
}

impl Keeping<'_> {
    fn on(&mut self, event: Event<'_>) -> Result<()> {
        match event {
            Event::More(n) => self.bar.inc_length(n as u64),
            Event::Turn => self.bar.inc(1),
            Event::Picture { i, rgba, found } => {
                self.bar.inc(1);
                if let Some(out) = &self.args.out {
                    self.write_picture(out, i, rgba, &mut found.configurations[i])?;
                }
            }
            Event::Round(found) => {
                if let Some(out) = &self.args.out {
                    self.study.configurations = found.configurations.clone();
                    self.study.rounds = found.n_rounds;
                    self.study.interrupted = true;
                    files::write(out, self.study, found)?;
                }
            }
        }
        Ok(())
    }

    /// The picture, and how far each of its pixels is from the reference's.
    fn write_picture(
        &self,
        out: &Path,
        i: usize,
        rgba: &[f32],
        configuration: &mut Configuration,
    ) -> Result<()> {
        let (Film { width, height, .. }, pixels) = (*self.film, self.pixels);
        let [picture, map] = [format!("picture-{i}.png"), format!("error-{i}.png")];
        image::write(&out.join(&picture), self.film, width, height, rgba)?;
        let at = |k: usize| &rgba[4 * pixels.index(pixels.at[k])..][..4];
        let of = |(k, r): (usize, &[f64; 4])| {
            let sum: f64 = at(k).iter().zip(r).map(|(a, b)| (f64::from(*a) - b).powi(2)).sum();
            (0.25 * sum).sqrt()
        };
        let errors: Vec<f64> = self.kept.reference.rgba.iter().enumerate().map(of).collect();
        image::write_bytes(
            &out.join(&map),
            width,
            height,
            &error_map(width, height, &pixels.spread(&errors)),
        )?;
        (configuration.picture, configuration.error_map) = (Some(picture), Some(map));
        Ok(())
    }
}

/// A picture that shows in every cell the value of its pixel.
fn write_spread(path: &Path, film: &Film, pixels: &Pixels, rgba: &[[f64; 4]]) -> Result<()> {
    let whole: Vec<f32> = pixels.spread(rgba).into_iter().flatten().map(|v| v as f32).collect();
    image::write(path, film, film.width, film.height, &whole)
}
