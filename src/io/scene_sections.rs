//! The scene's single tables: film, camera, time, lighting, draw, threads.

use glam::DVec3;
use serde_json::json;

use super::magnitude::{AMOUNT, COORDINATE, DIVISOR, GREATEST, GREATEST_EXPONENT, shortest};
use super::toml_section::{Bounds, Section};
use super::toml_tree::Value;
use crate::error::Result;
use crate::model::basis::{MAX_BASES, Sampling};
use crate::model::camera::{Camera, CameraKey};
use crate::model::count::Count;
use crate::model::cutoff::Cutoff;
use crate::model::film::{Film, FilmFormat, ToneMap};
use crate::model::grid::{MAX_CELLS, MAX_MARCH_STEPS, min_step};
use crate::model::resolution::Resolution;
use crate::model::scene::{
    Chunks, Cull, Draw, DrawPath, Gather, Impostors, Lighting, LightingMode, Pairs,
};
use crate::model::scene::{MAX_CHUNKS, MAX_PAIR_LEVELS, Simulate, Threading, Threads, Time};
use crate::model::sort_bits::SortBits;
use crate::model::sums::{Precision, Summation, Sums};

/// The greatest image side that every Vulkan 1.x desktop device offers (maxImageDimension2D).
pub const MAX_SIDE: u32 = 16384;

pub fn read_film(root: &mut Section) -> Result<Film> {
    let mut s = root.section("film")?;
    s.expect_keys(&["width", "height", "format", "background", "exposure", "tone_map"], &[])?;
    let film = Film {
        width: s.u32("width", 800, 1, MAX_SIDE)?,
        height: s.u32("height", 600, 1, MAX_SIDE)?,
        format: s.choice("format", "rgba16f", &FilmFormat::NAMES, &[])?,
        background: s.vec3("background", DVec3::new(0.32, 0.52, 0.80), AMOUNT)?,
        exposure: s.f64("exposure", 1.0, AMOUNT)?,
        tone_map: s.choice("tone_map", "neutral", &ToneMap::NAMES, &[])?,
    };
    root.record("film", s.finish());
    Ok(film)
}

pub fn read_camera(root: &mut Section) -> Result<Camera> {
    let mut s = root.section("camera")?;
    s.expect_keys(&["position", "target", "path", "up", "fov_y_deg", "near"], &[])?;
    let is_path = s.has("path");
    let keys = if is_path { read_path(&mut s)? } else { vec![read_fixed(&mut s)?] };
    let camera = Camera {
        keys,
        up: s.vec3("up", DVec3::Y, COORDINATE)?,
        // Narrower, and pixels are nearer to one another than f32 tells directions apart.
        fov_y_rad: s.f64("fov_y_deg", 45.0, Bounds::Between(1e-6, 180.0))?.to_radians(),
        near: s.f64("near", 0.01, DIVISOR)?,
    };
    if let Some(i) = camera.keys.iter().position(|key| camera.pose(key.time_s).is_none()) {
        let what = "the camera looks nowhere: position equals target, or the view runs along `up`";
        return Err(if is_path {
            s.sections("path")?[i].fault("position", what)
        } else {
            s.fault("position", what)
        });
    }
    root.record("camera", s.finish());
    Ok(camera)
}

fn read_fixed(s: &mut Section) -> Result<CameraKey> {
    let position = s.vec3("position", DVec3::new(0.0, 0.0, 18.0), COORDINATE)?;
    Ok(CameraKey { time_s: 0.0, position, target: s.vec3("target", DVec3::ZERO, COORDINATE)? })
}

fn read_path(s: &mut Section) -> Result<Vec<CameraKey>> {
    for key in ["position", "target"] {
        if s.has(key) {
            return Err(
                s.fault(key, "a camera has either `position` and `target`, or a `path`, not both")
            );
        }
    }
    let mut keys: Vec<CameraKey> = Vec::new();
    let mut resolved = Vec::new();
    for mut item in s.sections("path")? {
        item.expect_keys(&["time_s", "position", "target"], &[])?;
        let time_s = item.required_f64("time_s", COORDINATE)?;
        if let Some(before) = keys.last().map(|k| k.time_s).filter(|before| time_s <= *before) {
            return Err(
                item.fault("time_s", format!("times must grow, found {time_s} after {before}"))
            );
        }
        let position = item.required_vec3("position", COORDINATE)?;
        keys.push(CameraKey {
            time_s,
            position,
            target: item.required_vec3("target", COORDINATE)?,
        });
        resolved.push(item.finish());
    }
    if keys.is_empty() {
        return Err(s.fault("path", "expected at least one { time_s, position, target }"));
    }
    s.record("path", json!(resolved));
    Ok(keys)
}

pub fn read_time(root: &mut Section) -> Result<Time> {
    let mut s = root.section("time")?;
    s.expect_keys(&["start_s", "step_s", "frames"], &[])?;
    let time = Time {
        start_s: s.f64("start_s", 0.0, COORDINATE)?,
        step_s: s.f64("step_s", 0.0333, AMOUNT)?,
        n_frames: s.u32("frames", 300, 1, u32::MAX)?,
    };
    let last_s = time.at(time.n_frames - 1);
    if last_s > GREATEST {
        let what = format!(
            "the last frame's time: expected at most {}, found {last_s:.3e}",
            shortest(GREATEST)
        );
        return Err(s.fault("step_s", what));
    }
    root.record("time", s.finish());
    Ok(time)
}

/// `exponents` are the n_s of the scene's materials: without a range of its own the basis is made
/// for all of them.
pub fn read_lighting(root: &mut Section, exponents: &[f64]) -> Result<Lighting> {
    let mut s = root.section("lighting")?;
    s.expect_keys(LIGHTING_KEYS, &[])?;
    let lighting = Lighting {
        mode: s.choice("mode", "two-reflection", &LightingMode::NAMES, &[])?,
        // Below 8 cells the margins leave next to no grid.
        grid: s.u32("grid", 64, 8, MAX_CELLS)?,
        step: s.f64("step", 1.0, Bounds::Within(0.05, 16.0))?,
        forward: s.f64("forward", 0.85, Bounds::Within(0.0, 1.0))?,
        bases: s.u32("bases", 8, 1, MAX_BASES)?,
        sampling: s.choice("sampling", "log", &Sampling::NAMES, &[])?,
        exponents: read_exponents(&mut s, exponents)?,
        gather: s.choice("gather", "auto", &Gather::NAMES, &[])?,
        theta: s.f64("theta", 0.4, Bounds::Within(0.0, 2.0))?,
        facets_per_cloud: match s.u32("facets_per_cloud", 0, 0, u32::MAX)? {
            0 => None,
            n => Some(n),
        },
        pairs: Pairs {
            size: s.f64("pair_size", 0.5, Bounds::Within(0.01, 100.0))?,
            levels: s.u32("pair_levels", 6, 0, MAX_PAIR_LEVELS)?,
            steps: s.u32("pair_steps", 16, 1, MAX_MARCH_STEPS)?,
        },
        sums: Sums {
            summation: s.choice("summation", "plain", &Summation::NAMES, &[])?,
            precision: s.choice("precision", "f32", &Precision::NAMES, &[])?,
        },
    };
    let least = min_step(lighting.grid);
    if lighting.step < least {
        let (step, grid) = (lighting.step, lighting.grid);
        let limit = format!("a march takes {MAX_MARCH_STEPS} steps at most");
        return Err(s.fault(
            "step",
            format!(
                "expected at least {least:.4} cells where grid = {grid} ({limit}), found {step}"
            ),
        ));
    }
    root.record("lighting", s.finish());
    Ok(lighting)
}

const LIGHTING_KEYS: &[&str] = &[
    "mode",
    "grid",
    "step",
    "forward",
    "bases",
    "sampling",
    "exponents",
    "gather",
    "theta",
    "facets_per_cloud",
    "pair_size",
    "pair_levels",
    "pair_steps",
    "summation",
    "precision",
];

/// The range of n_s: as given, and then every lobe must lie in it; else [1, 256], or as wide as the
/// materials need.
fn read_exponents(s: &mut Section, of_materials: &[f64]) -> Result<[f64; 2]> {
    let low = of_materials.iter().copied().fold(1.0, f64::min);
    let high = of_materials.iter().copied().fold(256.0, f64::max);
    let given = s.has("exponents");
    let range = s.numbers("exponents", [low, high], Bounds::Within(0.0, GREATEST_EXPONENT))?;
    if range[0] > range[1] {
        return Err(s.fault(
            "exponents",
            format!("expected [least, greatest], found [{}, {}]", range[0], range[1]),
        ));
    }
    let outside = of_materials.iter().find(|ns| !(range[0]..=range[1]).contains(*ns));
    if let Some(ns) = outside.filter(|_| given) {
        let what = format!("a material's ns = {ns} lies outside [{}, {}]", range[0], range[1]);
        return Err(s.fault("exponents", what));
    }
    Ok(range)
}

pub fn read_draw(root: &mut Section) -> Result<Draw> {
    let mut s = root.section("draw")?;
    s.expect_keys(DRAW_KEYS, &[])?;
    let path = s.choice("path", "tiles", &DrawPath::NAMES, &[])?;
    let impostors = s.choice("impostors", "off", &Impostors::NAMES, &[])?;
    let impostor_error = s.f64("impostor_error", 0.5, Bounds::Within(0.01, 100.0))?;
    let cutoff = s.f64("cutoff", 3.0, Bounds::Within(0.5, 8.0))?;
    let chunks = read_chunks(&mut s)?;
    if path == DrawPath::Tiles && !matches!(chunks, Chunks::Of(0) | Chunks::Auto) {
        let what = "expected 0 where draw.path is \"tiles\", the default: only \"sprites\" are \
            drawn in chunks";
        return Err(s.fault("chunks", what.to_owned()));
    }
    let threshold = read_least(&mut s, "threshold", Bounds::From(0.0, 1.0))?;
    let cull = s.choice("cull", "on", &Cull::NAMES, &[])?;
    let smallest = read_least(&mut s, "smallest", Bounds::Within(0.0, 1000.0))?;
    if smallest != Cutoff::NONE && cull == Cull::Off {
        let found = if let Cutoff::At(found) = smallest {
            found.to_string()
        } else {
            "\"auto\"".to_owned()
        };
        return Err(s.fault("smallest", format!("expected 0 where cull = \"off\", found {found}")));
    }
    let sort_bits = read_sort_bits(&mut s)?;
    let resolution = read_resolution(&mut s)?;
    if impostors != Impostors::Off && (resolution != Resolution::Full || smallest != Cutoff::NONE) {
        let what = "expected \"off\", or draw.resolution = 1 and draw.smallest = 0";
        return Err(s.fault("impostors", what.to_owned()));
    }
    let error = s.f64("error", 1.0 / 1020.0, Bounds::From(0.0, 1.0))?;
    let count = read_count(&mut s)?;
    let n_particles = s.u32("particles", 0, 0, u32::MAX)?;
    let texture_seed = s.u32("texture_seed", 1, 0, u32::MAX)?;
    root.record("draw", s.finish());
    Ok(Draw {
        path,
        impostors,
        impostor_error,
        resolution,
        error,
        cutoff,
        threshold,
        chunks,
        cull,
        smallest,
        sort_bits,
        count,
        texture_seed,
        n_particles,
    })
}

const DRAW_KEYS: &[&str] = &[
    "path",
    "impostors",
    "impostor_error",
    "cutoff",
    "threshold",
    "chunks",
    "cull",
    "smallest",
    "sort_bits",
    "resolution",
    "error",
    "particles",
    "count",
    "count_a",
    "count_d0",
    "count_normalised",
    "count_conserve",
    "texture_seed",
];

/// Whether a key's value is "auto", which is written down then.
fn is_auto(s: &mut Section, key: &str) -> bool {
    let is_auto =
        s.value(key).is_some_and(|node| matches!(&node.value, Value::String(s) if s == "auto"));
    if is_auto {
        s.record(key, json!("auto"));
    }
    is_auto
}

/// A bound, 0 where there is none, or "auto".
fn read_least(s: &mut Section, key: &str, bounds: Bounds) -> Result<Cutoff> {
    if is_auto(s, key) {
        return Ok(Cutoff::Auto);
    }
    if let Some(text) = s.value(key).filter(|node| matches!(&node.value, Value::String(_))) {
        return Err(s.fault(
            key,
            format!("expected {bounds} or \"auto\", found {}", text.value.describe()),
        ));
    }
    Ok(Cutoff::At(s.f64(key, 0.0, bounds)?))
}

/// A number that there is a way to draw in, or "auto".
fn read_resolution(s: &mut Section) -> Result<Resolution> {
    if is_auto(s, "resolution") {
        return Ok(Resolution::Auto);
    }
    let Some(node) = s.value("resolution") else {
        s.record("resolution", json!(1.0));
        return Ok(Resolution::Full);
    };
    let given = node.value.as_f64();
    match Resolution::ALL.into_iter().find(|(of, _)| Some(*of) == given) {
        Some((of, resolution)) => {
            s.record("resolution", json!(of));
            Ok(resolution)
        }
        None => Err(s.fault(
            "resolution",
            format!("expected 1.0, 0.5, 0.25 or \"auto\", found {}", node.value.describe()),
        )),
    }
}

/// 16, 32 or "auto".
fn read_sort_bits(s: &mut Section) -> Result<SortBits> {
    let bits = match s.value("sort_bits").map(|node| &node.value) {
        None => SortBits::Auto,
        Some(Value::String(text)) if text == "auto" => SortBits::Auto,
        Some(Value::Integer(16)) => SortBits::Narrow,
        Some(Value::Integer(32)) => SortBits::Wide,
        Some(found) => {
            let what = format!("expected 16, 32 or \"auto\", found {}", found.describe());
            return Err(s.fault("sort_bits", what));
        }
    };
    s.record("sort_bits", bits.number().map_or(json!("auto"), |n| json!(n)));
    Ok(bits)
}

/// A number of chunks, or "auto".
fn read_chunks(s: &mut Section) -> Result<Chunks> {
    if is_auto(s, "chunks") {
        return Ok(Chunks::Auto);
    }
    if let Some(node) = s.value("chunks")
        && !matches!(node.value, Value::Integer(n) if (0..=i128::from(MAX_CHUNKS)).contains(&n))
    {
        let found = node.value.describe();
        let what = format!("expected an integer from 0 to {MAX_CHUNKS} or \"auto\", found {found}");
        return Err(s.fault("chunks", what));
    }
    Ok(Chunks::Of(s.u32("chunks", 0, 0, MAX_CHUNKS)?))
}

fn read_count(s: &mut Section) -> Result<Option<Count>> {
    let by_distance = s.choice("count", "all", &[("all", false), ("distance", true)], &[])?;
    let count = Count {
        a: s.f64("count_a", 280.0, DIVISOR)?,
        d0: s.f64("count_d0", 1.0, DIVISOR)?,
        normalised: s.bool("count_normalised", false)?,
        conserve: s.bool("count_conserve", true)?,
    };
    Ok(by_distance.then_some(count))
}

pub fn read_threads(root: &mut Section) -> Result<Threads> {
    let mut s = root.section("threads")?;
    s.expect_keys(&["mode", "simulate"], &[])?;
    let threads = Threads {
        mode: s.choice("mode", "parallel", &Threading::NAMES, &[])?,
        simulate: s.choice("simulate", "gpu", &Simulate::NAMES, &[])?,
    };
    root.record("threads", s.finish());
    Ok(threads)
}
