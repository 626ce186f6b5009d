//! Tables `[film]`, `[camera]`, `[time]` and `[threads]`.

use super::key::{Keys, keys, read_path, read_table};
use super::spec::{choice, described, integer, number, required_vector, vector};
use crate::error::Result;
use crate::io::bounds::{AMOUNT, Bounds, COORDINATE, DIVISOR, GREATEST, rounded, shortest};
use crate::io::document::section::Section;
use crate::model::camera::{Camera, CameraKey};
use crate::model::film::{Film, FilmFormat, Metering, ToneMap};
use crate::model::scene::{Simulate, Threading, Threads, Time};

/// The greatest image side that every Vulkan 1.x desktop device offers (maxImageDimension2D).
pub const MAX_SIDE: u32 = 16384;
/// Degrees. In a narrower view, neighbouring pixels have the same direction in f32.
const FIELD_OF_VIEW: Bounds = Bounds::Between(1e-6, 180.0);

keys! { FILM: fn film(s) -> Film { Film;
    /// Width of the picture.
    width: integer(800, 1, MAX_SIDE), "px";
    /// Height of the picture.
    height: integer(600, 1, MAX_SIDE), "px";
    /// Format of the render target that layers are blended in.
    format: choice("rgba16f", &FilmFormat::NAMES);
    /// Linear RGB radiance behind the scene.
    background: vector([0.32, 0.52, 0.80], AMOUNT);
    /// Factor on radiance before the tone map.
    exposure: number(1.0, AMOUNT);
    /// Tone map of PNG files and of the window: Khronos PBR Neutral, cut at 1, or filmic.
    tone_map: choice("neutral", &ToneMap::NAMES);
}}

keys! { VIEW: fn view(s) -> CameraKey { CameraKey;
    time_s => 0.0;
    /// Place of a camera that stands still.
    position: vector([0.0, 0.0, 18.0], COORDINATE), "unit";
    /// Point in the middle of the picture of a camera that stands still.
    target: vector([0.0; 3], COORDINATE), "unit";
}}

keys! { WAYPOINT: fn waypoint(s) -> CameraKey { CameraKey;
    /// Time at which the camera is there. Times must grow.
    time_s: number(0.0, COORDINATE).required(), "s";
    /// Place of the camera then.
    position: required_vector(COORDINATE), "unit";
    /// Point in the middle of the picture then.
    target: required_vector(COORDINATE), "unit";
}}

keys! { CAMERA: fn camera(s) -> Camera { Camera;
    /// Path of a camera that moves (Catmull–Rom), in place of `position` and `target`.
    keys ["path"]: described("array of { time_s, position, target }") => |_| views(s);
    /// Direction that is up in the picture.
    up: vector([0.0, 1.0, 0.0], COORDINATE);
    /// Vertical field of view.
    fov_y_rad ["fov_y_deg"]: number(45.0, FIELD_OF_VIEW).map(f64::to_radians), "degree";
    /// Distance below which nothing is drawn.
    near: number(0.01, DIVISOR), "unit";
}}

keys! { TIME: fn time(s) -> Time { Time;
    /// Time of the first frame.
    start_s: number(0.0, COORDINATE), "s";
    /// Time from one frame to the next.
    step_s: number(0.0333, AMOUNT), "s";
    /// Number of frames; with phases, the sum of theirs.
    n_frames ["frames"]: integer(300, 1, u32::MAX);
}}

keys! { THREADS: fn threads(s) -> Threads { Threads;
    /// Whether game and render step share a thread or run on two.
    mode: choice("parallel", &Threading::NAMES);
    /// Where particles are moved: on the GPU, or by the game thread.
    simulate: choice("gpu", &Simulate::NAMES);
}}

/// Tables of this file and their keys.
pub const TABLES: [(&str, &[Keys]); 5] = [
    ("[film]", &[FILM, METERING]),
    ("[camera]", CAMERA_KEYS),
    ("[camera] path", &[WAYPOINT]),
    ("[time]", &[TIME]),
    ("[threads]", &[THREADS]),
];

const CAMERA_KEYS: &[Keys] = &[VIEW, CAMERA];

keys! {
    /// Light that the exposure goes by: none, or that of suns and skies, in which a white surface
    /// across it gets 0.8 before `exposure` (model.md §19).
    METERING: fn metering(s) -> Metering = "metering": choice("none", &Metering::NAMES);
}

/// Reads `[film]`, and what its exposure goes by.
pub fn read_film(root: &mut Section) -> Result<(Film, Metering)> {
    read_table(root, "film", &[FILM, METERING], |s| Ok((film(s)?, metering(s)?)))
}

/// Reads `[camera]`.
pub fn read_camera(root: &mut Section) -> Result<Camera> {
    read_table(root, "camera", CAMERA_KEYS, |s| {
        let camera = camera(s)?;
        let Some(i) = camera.keys.iter().position(|key| camera.pose(key.time_s).is_none()) else {
            return Ok(camera);
        };
        let what = "the camera looks nowhere: position equals target, or the view runs along `up`";
        let path = s.sections("path")?;
        Err(path.get(i).unwrap_or(s).fault("position", what))
    })
}

fn views(s: &mut Section) -> Result<Vec<CameraKey>> {
    if !s.has("path") {
        return Ok(vec![view(s)?]);
    }
    let not_both = "a camera has either `position` and `target`, or a `path`, not both";
    read_path(s, &[WAYPOINT], (VIEW, not_both), |key| key.time_s, |item, _| waypoint(item))
}

/// Reads `[time]`.
pub fn read_time(root: &mut Section) -> Result<Time> {
    read_table(root, "time", &[TIME], |s| {
        let time = time(s)?;
        let last_s = time.at(time.n_frames - 1);
        if last_s <= GREATEST {
            return Ok(time);
        }
        let (most, found) = (shortest(GREATEST), rounded(last_s));
        let what = format!("the last frame's time: expected at most {most}, found {found}");
        Err(s.fault("step_s", what))
    })
}

/// Reads `[threads]`.
pub fn read_threads(root: &mut Section) -> Result<Threads> {
    read_table(root, "threads", &[THREADS], threads)
}
