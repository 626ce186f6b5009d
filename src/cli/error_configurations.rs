//! The configurations that `nimbus error` draws and times.

use std::sync::Arc;

use super::args::{ErrorArgs, SceneArgs};
use super::scene::{StudyScene, load_at, load_study};
use crate::error::{Error, Result};
use crate::farm::{StudyTurns, Workload, study_workload};
use crate::model::film::Film;
use crate::model::scene::Scene;
use crate::studies::error::design::{Design, settings};
use crate::studies::error::knobs::default_axes;
use crate::studies::error::records::name_of;
use crate::studies::error::study::LoadedConfiguration;
use crate::timing::limits::check_cases;
use crate::timing::names::Setting;
use crate::timing::sweep::{Axis, SIZE_KEY};

const ONE_SIZE: &str = "pictures of several sizes cannot be compared with one reference";

/// Returns how the values of the knobs are combined.
pub fn design(args: &ErrorArgs) -> Design {
    if args.grid { Design::Grid } else { Design::Alone }
}

/// Returns the knobs and their values: the named ones, or all that can change the scene. The values
/// of named knobs are loaded once, so that a fault is reported before any work.
///
/// # Errors
/// Fails if a knob cannot be studied or a value is faulty.
pub fn axes(args: &ErrorArgs, options: &SceneArgs, scene: &Scene) -> Result<Vec<Axis>> {
    if args.knob.is_empty() {
        return Ok(default_axes(scene));
    }
    let axes = Axis::parse_all("--knob", &args.knob)?;
    let n_values = || axes.iter().map(|axis| axis.values.len());
    match design(args) {
        Design::Grid => check_cases("--grid", n_values())?,
        Design::Alone => check_cases("--knob", std::iter::once(n_values().sum()))?,
    }
    for Axis { key, .. } in &axes {
        if let Some(what) = refusal(key) {
            return Err(Error::usage(format!("--knob {key}: {what}")));
        }
    }
    for setting in settings(&axes, Design::Alone) {
        let film = load_configuration(args, options, &setting)?.scene.film;
        let Film { width, height, .. } = scene.film;
        if (film.width, film.height) != (width, height) {
            return Err(Error::usage(format!("--knob {}: {ONE_SIZE}", name_of(&setting))));
        }
    }
    Ok(axes)
}

/// Returns why a key is not a knob of a study. Keys that the scene does not know pass: loading the
/// scene reports them.
fn refusal(key: &str) -> Option<&'static str> {
    /// Keys of `film`, `lighting` and `draw` that say what is drawn, and tables as a whole.
    const CONTENT: [&str; 9] = [
        "film.background",
        "film.exposure",
        "film.tone_map",
        "lighting.forward",
        "lighting",
        "draw.particles",
        "draw.texture_seed",
        "draw.error",
        "draw",
    ];
    const IS_CONTENT: &str = "is no knob: a knob changes how the picture is computed, and this \
        key changes what the picture shows, or nothing that is compared; `nimbus error SCENE` \
        without --knob varies all knobs of the scene";
    let last = key.rsplit('.').next().unwrap_or_default().trim();
    match key.split('.').next().unwrap_or_default().trim() {
        _ if key == SIZE_KEY => Some(ONE_SIZE),
        "draw" if last.starts_with("impostor") => {
            Some("a frame alone, as it is compared, is drawn without; bench --sweep times them")
        }
        "film" | "lighting" | "draw" => CONTENT.contains(&key).then_some(IS_CONTENT),
        "surface" => (last != "subdivide").then_some(
            "is no knob: this key changes what the picture shows, and not how the picture is \
             computed; a surface's knob is `subdivide`",
        ),
        "cloud" => (!["particles", "gust_waves"].contains(&last)).then_some(
            "is no knob: this key changes what the picture shows, and not how the picture is \
             computed; a cloud's knobs are `particles` and `gust_waves`",
        ),
        "light" | "material" | "air" => Some(IS_CONTENT),
        "title" | "time" | "threads" | "camera" | "phase" => Some(
            "changes no picture, or which picture it is; expected a key of film, lighting, draw, \
             cloud or surface",
        ),
        _ => None,
    }
}

/// Loads the scene with the settings of a configuration. Every "auto" takes its exact setting, so
/// that two configurations differ in nothing but their settings.
///
/// # Errors
/// Fails if the scene is faulty; a fault of a setting names `--knob`.
pub fn load_configuration(
    args: &ErrorArgs,
    options: &SceneArgs,
    settings: &[Setting],
) -> Result<LoadedConfiguration> {
    let loaded = load_at(&args.scene, options, "--knob", settings)?;
    let hash = loaded.hash().to_owned();
    let scene = loaded.at_frame(args.frame).exact().into_owned();
    Ok(LoadedConfiguration { scene: Arc::new(scene), hash })
}

/// Returns the names of the configurations without the unchanged scene, in the order that
/// `--part` counts in, and the work in them.
///
/// # Errors
/// Fails if the scene or a knob is faulty, or the scene has no such reference.
pub fn configurations(args: &ErrorArgs) -> Result<(Vec<String>, Workload)> {
    let StudyScene { options, scene, time_s, .. } =
        load_study(&args.scene, &args.options, args.plain, args.frame)?;
    let axes = axes(args, &options, &scene)?;
    args.against.check(&scene, time_s)?;
    let all = settings(&axes, design(args));
    let scenes = all.iter().map(|setting| Ok(load_configuration(args, &options, setting)?.scene));
    let turns = StudyTurns {
        i_frame: args.frame,
        n_rounds: args.rounds,
        n_frames: args.frames,
        as_played: args.as_played,
    };
    let workload = study_workload(&scene, scenes, turns)?;
    Ok((all.iter().map(|settings| name_of(settings)).collect(), workload))
}
