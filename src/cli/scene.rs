//! Loads scenes and opens devices as the arguments say.

use std::path::{Path, PathBuf};

use super::args::SceneArgs;
use super::progress::spinner;
use crate::error::{Error, Result};
use crate::frame::limits::{self, advice};
use crate::frame::{DeviceChoice, DrawnFrame, GpuContext, Stage, light_notes, unseen};
use crate::gpu::DeviceOptions;
use crate::inspect::basis::basis_warnings;
use crate::io::bounds::{GREATEST, is_carried_place, shortest};
use crate::io::console::say;
use crate::io::scene_file::{self, LoadedScene};
use crate::model::scene::Scene;
use crate::reference::picture::{Pixels, check_memory};
use crate::timing::machine::{Clocks, clocks_record};
use crate::timing::names::Setting;
use crate::timing::sweep::{SIZE_KEY, overrides};

/// Returns the scene keys that `--set` and `--size` set, as `--set` takes them.
pub fn typed_overrides(set: &[String], size: Option<(u32, u32)>) -> Vec<String> {
    let size = size
        .map(|(width, height)| [format!("film.width={width}"), format!("film.height={height}")]);
    set.iter().cloned().chain(size.into_iter().flatten()).collect()
}

/// Prints the warnings about a scene unless `quiet` is set.
pub fn print_warnings(loaded: &LoadedScene, quiet: bool) {
    for warning in warnings(loaded).iter().filter(|_| !quiet) {
        say!("warning: {warning}");
    }
}

/// Loads a scene with the keys that the arguments set, and prints its warnings.
///
/// # Errors
/// Fails if the scene or a file that it names is faulty.
pub fn load(path: &Path, args: &SceneArgs) -> Result<LoadedScene> {
    load_with_files(path, args).map(|(loaded, _)| loaded)
}

/// Loads a scene as [`load`] does, and also returns the files that it was read from.
///
/// # Errors
/// Fails if the scene or a file that it names is faulty.
pub fn load_with_files(path: &Path, args: &SceneArgs) -> Result<(LoadedScene, Vec<PathBuf>)> {
    let reading = spinner("reading", args.quiet);
    let (loaded, files) =
        scene_file::load_and_list(path, &typed_overrides(&args.set, args.size), args.seed);
    drop(reading);
    let loaded = loaded?;
    print_warnings(&loaded, args.quiet);
    Ok((loaded, files))
}

/// Loads a scene silently with more settings, which the argument `flag` gave.
///
/// # Errors
/// Fails if the scene or a file that it names is faulty; a fault of a setting names `flag`.
pub fn load_at(
    path: &Path,
    args: &SceneArgs,
    flag: &str,
    settings: &[Setting],
) -> Result<LoadedScene> {
    let overrides = overrides(settings)?;
    let mut with = SceneArgs { quiet: true, ..args.clone() };
    with.set.extend(overrides.iter().cloned());
    if settings.iter().any(|s| s.key == SIZE_KEY) {
        with.size = None;
    }
    load(path, &with).map_err(|mut error| {
        if let Error::Scene { at, .. } = &mut error {
            let set = at.source.strip_prefix("--set ").map(str::to_owned);
            if let Some(set) = set.filter(|set| overrides.contains(set)) {
                at.source = format!("{flag} {set}");
            }
        }
        error
    })
}

/// Returns the arguments, with the textures of all clouds removed if `plain` is set.
fn without_textures(path: &Path, args: &SceneArgs, plain: bool) -> Result<SceneArgs> {
    let mut args = args.clone();
    let quiet = SceneArgs { quiet: true, ..args.clone() };
    if plain && !load(path, &quiet)?.scene.clouds.is_empty() {
        args.set.push("cloud.*.texture=\"none\"".to_owned());
    }
    Ok(args)
}

/// The scene of a study at the frame that is compared.
pub struct StudyScene {
    /// The arguments, with the textures removed that the study leaves out.
    pub options: SceneArgs,
    /// The scene as loaded.
    pub loaded: LoadedScene,
    /// The scene at the frame, of its phase if it has phases.
    pub scene: Scene,
    /// Time of the frame, s.
    pub time_s: f64,
}

/// Loads the scene of a study. `plain` removes the textures of all clouds.
///
/// # Errors
/// Fails if the scene is faulty, or f32 cannot represent it at the frame.
pub fn load_study(path: &Path, args: &SceneArgs, plain: bool, i_frame: u32) -> Result<StudyScene> {
    let options = without_textures(path, args, plain)?;
    let loaded = load(path, &options)?;
    let time_s = loaded.scene.time.at(i_frame);
    let scene = loaded.clone().at_frame(i_frame);
    check_time(&scene, time_s)?;
    Ok(StudyScene { options, loaded, scene, time_s })
}

/// Selects at most `most` pixels of the picture, at which a study computes its reference.
///
/// # Errors
/// Fails if the reference at so many pixels would not fit in memory.
pub fn pixels(scene: &Scene, most: usize) -> Result<Pixels> {
    let film = scene.film;
    let n_all = u64::from(film.width) * u64::from(film.height);
    check_memory(n_all.min(most as u64), 1, scene.n_particles())?;
    Ok(Pixels::sample(film.width, film.height, most))
}

/// Opens the device of a study, checks that it has room for the scene, and measures its clocks.
/// Warns if nothing can be seen at the time of the frame that is compared.
///
/// # Errors
/// Fails if there is no such device, or the scene does not fit on it.
pub fn open_for_study(
    args: &SceneArgs,
    scene: &Scene,
    time_s: f64,
) -> Result<(GpuContext, Clocks)> {
    let gpu = GpuContext::open(&device_choice(args))?;
    limits::check(scene, gpu.device.limits())?;
    let mut player = gpu.player(scene.clone(), true)?;
    let clocks = clocks_record(gpu.device.info(), args.pass_times, &mut player.renderer)?;
    let packet = player.game.step_at(0, time_s)?;
    let frame = DrawnFrame::of(time_s, &player.renderer.step(packet)?);
    print_unseen(scene, frame, &player.renderer.image()?, args.quiet)?;
    drop(player);
    Ok((gpu, clocks))
}

/// Adds to the error of a textured scene, which has no such reference, how to go on.
pub fn with_texture_hint(error: Error, hint: &str) -> Error {
    match error {
        Error::Usage { what } if what.contains("textured") => {
            Error::usage(format!("{what}, or --plain for all clouds{hint}"))
        }
        other => other,
    }
}

/// Returns the warnings about a scene and its phases: settings that are allowed but hardly meant.
pub fn warnings(loaded: &LoadedScene) -> Vec<String> {
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

/// Returns the device that the arguments choose.
pub fn device_choice(args: &SceneArgs) -> DeviceChoice {
    DeviceChoice {
        device: args.device.clone(),
        shaders: args.shaders.clone(),
        validation: args.validation,
        options: DeviceOptions {
            limits: args.limits.clone(),
            guard: args.guard,
            max_submit_ms: args.max_submit_ms,
            reports_pipelines: false,
            pass_times: args.pass_times,
            ..DeviceOptions::default()
        },
    }
}

/// Checks that f32 can represent the scene at a time that a user asked for. The loader has checked
/// the frames of the scene itself.
///
/// # Errors
/// Fails if the time is too great or not a number, or the wind carries a cloud too far until then.
pub fn check_time(scene: &Scene, time_s: f64) -> Result<()> {
    let is_in_range = time_s.abs() <= GREATEST;
    if is_in_range && scene.clouds.iter().all(|c| is_carried_place(c.origin_at(time_s))) {
        return Ok(());
    }
    let (time, greatest) = (shortest(time_s), shortest(GREATEST));
    let what = if is_in_range {
        format!("the wind carries a cloud's origin too far: expected at most {greatest}")
    } else {
        format!("expected a finite number from -{greatest} to {greatest}")
    };
    Err(Error::usage(format!("time {time} s: {what}")))
}

/// Prints the settings that "auto" chose, and warnings about the light of the last frame and about
/// long submissions.
///
/// # Errors
/// Fails if reading the light back from the device fails.
pub fn print_notes(stage: &mut Stage, args: &SceneArgs) -> Result<()> {
    if !args.quiet {
        for chosen in stage.take_chosen() {
            say!("note: {chosen}");
        }
        for note in light_notes(stage)?.into_iter().chain(stage.device.take_over_limit()) {
            say!("warning: {note}");
        }
    }
    Ok(())
}

/// Warns if nothing of a scene can be seen in a picture, with the reason.
///
/// # Errors
/// Fails if the scene has no state at the time of the frame.
pub fn print_unseen(scene: &Scene, frame: DrawnFrame, rgba: &[f32], quiet: bool) -> Result<()> {
    if let Some(note) = unseen(scene, frame, rgba)?.filter(|_| !quiet) {
        say!("warning: {note}");
    }
    Ok(())
}

/// Prints the device and the sizes of a scene, for `--verbose`.
pub fn print_sizes(scene: &Scene, stage: Option<&Stage>) {
    if let Some(stage) = stage {
        say!("{} ({})", stage.info().name, stage.info().driver);
    }
    let film = scene.film;
    let (particles, groups) = (scene.n_particles(), scene.groups().len());
    say!("{particles} particles in {groups} groups, film {} x {}", film.width, film.height);
}
