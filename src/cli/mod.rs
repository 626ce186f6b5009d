//! What was typed ([`args`]) → what it means (one file a command) → an exit code.

pub mod args;
mod attach;
mod bench;
mod bench_plot;
mod bench_table;
mod compare;
mod compare_pictures;
mod devices;
#[cfg(feature = "window")]
mod edit;
mod farm;
mod farm_jobs;
mod farm_plan;
mod farm_told;
mod inspect;
mod ledger;
mod output;
mod render;
mod render_reference;
mod report;
mod stress;
mod tradeoff;
mod tradeoff_table;
#[cfg(feature = "window")]
mod view;
mod weather;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Parser;

use crate::error::{Error, Result};
use crate::frame::light_notes;
use crate::frame::limits::advice;
use crate::frame::{DeviceChoice, Stage};
use crate::inspect::basis::basis_warnings;
use crate::io::atomic;
use crate::io::bounds::{GREATEST, is_carried_place, shortest};
use crate::io::scene_file::{self, LoadedScene};
use crate::model::scene::Scene;
use args::{Args, Command, SceneArgs};

/// Set by Ctrl-C where [`GRACEFUL`] is: the command looks at it between frames.
static STOP: AtomicBool = AtomicBool::new(false);
/// Whether the command keeps what it has finished: then only a second Ctrl-C ends the process at
/// once.
static GRACEFUL: AtomicBool = AtomicBool::new(false);

/// Parses the command line, runs the command, prints an error and gives the exit code.
pub fn main() -> ExitCode {
    let args = Args::parse();
    // Without a handler Ctrl-C still ends the program, only less cleanly.
    let _ = ctrlc::set_handler(interrupted);
    let zones = attach::attach(matches!(&args.command, Command::Bench(a) if a.trace.is_some()));
    let done = match &args.command {
        Command::Render(a) => render::run(a),
        Command::Bench(a) => {
            GRACEFUL.store(true, Ordering::Relaxed);
            bench::run(a, args.color, &STOP, zones.as_ref())
        }
        Command::Compare(a) => compare::run(a),
        Command::Error(a) => tradeoff::run(a, args.color, &STOP, &GRACEFUL),
        Command::Ledger(a) => ledger::run(a, &STOP, &GRACEFUL),
        Command::Report(a) => report::run(a),
        Command::Stress(a) => stress::run(a, &STOP, &GRACEFUL),
        Command::Inspect(a) => inspect::run(a),
        Command::Devices(a) => devices::run(a),
        #[cfg(feature = "window")]
        Command::View(a) => {
            GRACEFUL.store(true, Ordering::Relaxed);
            view::run(a, &STOP)
        }
        #[cfg(feature = "window")]
        Command::Edit(a) => {
            GRACEFUL.store(true, Ordering::Relaxed);
            edit::run(a, &STOP)
        }
        Command::Weather(a) => weather::run(a),
        Command::Farm(a) => farm::run(a, &STOP, &GRACEFUL),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::error(&error, args.color);
            ExitCode::from(error.exit_code())
        }
    }
}

/// Signals so close together are one: an engine tells a job script and all that it runs, and the
/// script tells them, too.
const ONE_SIGNAL: Duration = Duration::from_secs(1);

/// What Ctrl-C does; runs on a thread of its own.
fn interrupted() {
    static FIRST: OnceLock<Instant> = OnceLock::new();
    if GRACEFUL.load(Ordering::Relaxed) {
        if !STOP.swap(true, Ordering::Relaxed) {
            FIRST.get_or_init(Instant::now);
            eprintln!(
                "interrupted: finishes this frame and keeps what is done; once more ends at once"
            );
            return;
        }
        if FIRST.get().is_some_and(|first| first.elapsed() < ONE_SIGNAL) {
            return;
        }
    }
    atomic::abandon();
    // std::process::exit would run the exit handlers of a driver that other threads are still
    // inside of.
    unsafe extern "C" {
        fn _exit(code: std::ffi::c_int) -> !;
    }
    // SAFETY: ends the process; nothing after it runs.
    unsafe { _exit(i32::from(Error::Interrupted.exit_code())) }
}

/// What was typed about a scene's keys.
fn overrides(args: &SceneArgs) -> Vec<String> {
    let mut overrides = args.set.clone();
    if let Some((width, height)) = args.size {
        overrides.push(format!("film.width={width}"));
        overrides.push(format!("film.height={height}"));
    }
    overrides
}

/// Loads a scene with all that was typed about it; prints what is allowed but hardly meant.
fn load(path: &Path, args: &SceneArgs) -> Result<LoadedScene> {
    load_and_list(path, args).map(|(loaded, _)| loaded)
}

/// The same, and the files that it was read from.
fn load_and_list(path: &Path, args: &SceneArgs) -> Result<(LoadedScene, Vec<PathBuf>)> {
    let (loaded, files) = scene_file::load_and_list(path, &overrides(args), args.seed);
    let loaded = loaded?;
    for warning in warnings_of(&loaded).iter().filter(|_| !args.quiet) {
        eprintln!("warning: {warning}");
    }
    Ok((loaded, files))
}

/// What is allowed but hardly meant in a scene or one of its phases.
fn warnings_of(loaded: &LoadedScene) -> Vec<String> {
    let of_scene =
        |scene: &Scene| basis_warnings(scene).into_iter().chain(advice(scene)).collect::<Vec<_>>();
    let mut all: Vec<String> = loaded.warnings.clone();
    let phases = loaded.phases.iter().map(|p| &p.scene);
    for warning in std::iter::once(&loaded.scene).chain(phases).flat_map(of_scene) {
        if !all.contains(&warning) {
            all.push(warning);
        }
    }
    all
}

fn device_choice(args: &SceneArgs) -> DeviceChoice {
    DeviceChoice {
        device: args.device.clone(),
        shaders: args.shaders.clone(),
        validation: args.validation,
        poison: args.poison,
    }
}

/// Refuses a time at which the scene is where f32 cannot follow; the frames of the scene itself are
/// not such times.
fn check_time(scene: &Scene, time_s: f64) -> Result<()> {
    // Not a number is refused too.
    let in_time = time_s.abs() <= GREATEST;
    if in_time && scene.clouds.iter().all(|c| is_carried_place(c.origin_at(time_s))) {
        return Ok(());
    }
    let greatest = shortest(GREATEST);
    Err(Error::usage(if in_time {
        format!(
            "time {} s: the wind carries a cloud's origin too far: expected at most {greatest}",
            shortest(time_s)
        )
    } else {
        format!(
            "time {} s: expected a finite number from -{greatest} to {greatest}",
            shortest(time_s)
        )
    }))
}

/// What "auto" took, and what is odd about the last frame's light, on stderr.
fn say_notes(stage: &mut Stage, args: &SceneArgs) -> Result<()> {
    if !args.quiet {
        for chosen in stage.take_chosen() {
            eprintln!("note: {chosen}");
        }
        for note in light_notes(stage)? {
            eprintln!("warning: {note}");
        }
    }
    Ok(())
}

/// Device and sizes on stderr, for `-v`.
fn say_sizes(scene: &Scene, stage: Option<&Stage>) {
    if let Some(stage) = stage {
        eprintln!("{} ({})", stage.info().name, stage.info().driver);
    }
    let film = scene.film;
    let (particles, groups) = (scene.n_particles(), scene.groups().len());
    eprintln!("{particles} particles in {groups} groups, film {} x {}", film.width, film.height);
}

/// A result that exists is not replaced unless asked for.
fn refuse_existing(path: &Path, force: bool) -> Result<()> {
    if !force && path.symlink_metadata().is_ok() {
        return Err(Error::io(path, "exists; --force replaces it"));
    }
    Ok(())
}
