//! The roofs of the device are measured with results that are checked, and passes are compared with
//! them; cold caches change times and no picture.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use crate::program::{nimbus, path};
use nimbus::error::Error;
use nimbus::frame::plan::Pass;
use nimbus::frame::{Amounts, DeviceChoice, GpuContext, Stage, floor};
use nimbus::gpu::{DeviceOptions, LoweredLimits, Sources};
use nimbus::io::scene_file;
use nimbus::model::scene::Threading;
use nimbus::passes;
use nimbus::roof::{Budget, measure};
use nimbus::timing::roofs::Roofs;
use serde_json::Value;
use tempfile::TempDir;

/// A device with little memory, so that all sets are small, and without 64-bit numbers.
fn choice() -> DeviceChoice {
    let limits = LoweredLimits {
        device_memory_bytes: Some(1 << 24),
        has_int64: Some(false),
        has_float64: Some(false),
        ..LoweredLimits::default()
    };
    let options = DeviceOptions { limits: Some(limits), ..DeviceOptions::default() };
    DeviceChoice { validation: true, options, ..DeviceChoice::default() }
}

/// Measures with the least samples, by these shaders.
fn measured(sources: Sources, stop: bool) -> Result<Roofs, Error> {
    let context = GpuContext::with_sources(&choice(), sources).expect("a device");
    let budget = Budget { time: Duration::ZERO, max_submit_ms: Some(8.0) };
    let roofs = measure(&context, budget, &AtomicBool::new(stop), &mut |_, _| {});
    context.close().expect("no validation messages");
    roofs
}

#[test]
fn every_roof_is_measured_and_its_results_are_right() {
    let roofs = measured(passes::sources(), false).expect("right results");
    let of = |name: &str, way: Option<&str>, set: Option<u64>| {
        let same = |way: Option<&str>, other: &Option<String>| way == other.as_deref();
        roofs
            .roofs
            .iter()
            .filter(|r| r.name == name && r.set_bytes == set && same(way, &r.way))
            .count()
    };
    for set in [1 << 18, 1 << 21] {
        for (name, way) in [
            ("read", "storage"),
            ("write", "storage"),
            ("write", "transfer"),
            ("copy", "storage"),
            ("copy", "transfer"),
        ] {
            assert_eq!(of(name, Some(way), Some(set)), 1, "{name} by {way} of {set}");
        }
    }
    for name in ["f32", "i32", "atomics, one address", "atomics, spread"] {
        assert_eq!(of(name, None, None), 1, "{name}");
    }
    for roof in &roofs.roofs {
        let ordered = 0.0 < roof.p5 && roof.p5 <= roof.p50 && roof.p50 <= roof.p95;
        assert!(ordered && roof.p95 <= roof.max && roof.n >= 3, "{roof:?}");
    }
    assert!(roofs.absent.iter().any(|text| text == "f64: the device has no shaderFloat64"));
    assert!(roofs.absent.iter().any(|text| text == "i64: the device has no shaderInt64"));
    let ceilings = roofs.ceilings().expect("bandwidth and floats");
    assert_eq!(ceilings.bandwidths.len(), 2);
}

#[test]
fn wrong_results_and_a_stop_end_the_measurement() {
    for (file, from, to, what) in [
        ("roof_memory.comp", "sum += from[i];", "sum += from[i ^ 1u] + 1u;", "read"),
        ("roof_memory.comp", "to[i] = 4u * i", "to[i] = 4u * (i | 1u)", "read"),
        ("roof_memory.comp", "to[i] = from[i];", "to[i] = from[i / 2u];", "copy"),
        ("roof_arithmetic.comp", "x = STEP(x);", "if (k > 0u) { x = STEP(x); }", "f32"),
        ("roof_atomics.comp", "k < push.n_loops", "k + 1u < push.n_loops", "atomics"),
    ] {
        let mut sources = passes::sources();
        assert!(sources.replace(file, from, to), "{file} does not contain {from}");
        let error = measured(sources, false).map(|_| ()).expect_err(what);
        assert_eq!(error.exit_code(), 1, "{error}");
        let begin = format!("devices --roof: {what}");
        assert!(error.to_string().contains(&begin), "{begin}: {error}");
    }
    let stopped = measured(passes::sources(), true).map(|_| ());
    assert!(matches!(stopped, Err(Error::Interrupted)), "{stopped:?}");
}

/// A small scene with clouds, a floor, two reflections and textures.
const SCENE: &str = "tests/data/modes.toml";

fn stage(overrides: &[&str]) -> Stage {
    let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
    let scene = scene_file::load(Path::new(SCENE), &overrides, None).expect("a scene").scene;
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    Stage::new(scene, &choice, true).expect("a stage")
}

#[test]
fn cold_caches_change_no_picture_and_no_list_of_passes() {
    let frames = |cold: Option<u64>| {
        let mut stage = stage(&["film.width=64", "film.height=48"]);
        if let Some(bytes) = cold {
            stage.set_cold(bytes).expect("memory");
        }
        let mut all = Vec::new();
        let on_frame = &mut |times: nimbus::frame::FrameTimes,
                             renderer: &mut nimbus::frame::Renderer| {
            let names: Vec<&str> = times.passes.iter().map(|p| p.name).collect();
            all.push((names, renderer.image_bytes()?));
            Ok(true)
        };
        stage.run(Threading::Parallel, 0..4, on_frame).expect("frames");
        stage.close().expect("no validation messages");
        all
    };
    let hot = frames(None);
    assert!(hot.len() == 4 && hot.iter().all(|(names, _)| names.len() > 5));
    assert!(hot == frames(Some(3 << 20)), "cold caches change the frames");
}

#[test]
fn amounts_of_a_frame_are_those_of_its_scene() {
    let mut stage = stage(&["film.width=64", "film.height=48", "draw.path='tiles'"]);
    let scene = stage.scene.clone();
    let before = Amounts::measured(&mut stage.renderer, &stage.device, &scene).expect("a device");
    assert_eq!(before, None);
    stage.run(Threading::Serial, 0..1, &mut |_, _| Ok(true)).expect("a frame");
    let of = Amounts::measured(&mut stage.renderer, &stage.device, &scene).expect("a device");
    let of = of.expect("a frame was drawn");
    assert_eq!(of.particles, scene.n_particles() as f64);
    assert_eq!(of.facets, scene.n_facets() as f64);
    assert_eq!(of.cloud_facets, 900f64.min(of.particles));
    assert_eq!((of.film_pixels, of.pixel_bytes), (64.0 * 48.0, 8.0));
    assert!(of.box_particles > 0.0 && of.box_particles < of.particles);
    assert!(of.culls && of.kept > 0.0 && of.kept <= of.drawn && of.drawn <= of.particles);
    assert!(of.is_grouped && of.has_second && of.is_glossy && of.waves > 0.0);
    // Each facet of a cloud takes a sample toward each light at least; the floor hides nothing.
    assert!(of.march_samples >= of.cloud_facets, "{of:?}");
    assert!(of.deposits >= of.particles && of.cells >= 512.0, "{of:?}");
    // The floor is below the clouds, so that layers before it are certain.
    let blobs = of.blobs.expect("a picture");
    assert!(blobs.pixels == of.film_pixels && blobs.layers > 0.0, "{blobs:?}");
    for pass in [Pass::Place, Pass::Grid, Pass::Facets, Pass::Transmit, Pass::Sort, Pass::Tiles] {
        let work = floor(pass, &of).expect("a floor");
        assert!(work.bytes > 0.0 && work.bytes.is_finite(), "{pass:?}: {work:?}");
    }
    stage.close().expect("no validation messages");
}

/// Runs a short bench of the small scene, with a cache of its own.
fn bench(dir: &TempDir, args: &[&str]) -> (Option<i32>, String, String) {
    let short = ["bench", "scenes/hello.toml", "--frames", "3", "--warmup", "1", "--repeat", "1"];
    let more = ["--threading", "serial", "--no-check", "--size", "64x48"];
    let output = nimbus(&[&short[..], &more, args].concat())
        .env("NIMBUS_CACHE_DIR", dir.path().join("cache"))
        .output()
        .expect("the program runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn bench_records_floors_and_cold_caches() {
    let dir = TempDir::new().expect("a folder");
    let (code, stdout, stderr) = bench(&dir, &["--json", "--cold=2", "--out", &path(&dir, "cold")]);
    assert_eq!(code, Some(0), "{stderr}");
    let run: Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!(run["cold_bytes"], 2 << 20);
    assert_eq!(run["cases"][0]["figure"], Value::Null);
    assert_eq!(run["ceilings"], Value::Null, "bench measures no roof");
    let modes = run["cases"][0]["modes"].as_array().expect("loops");
    let passes = || modes.iter().flat_map(|m| m["passes"].as_array().expect("passes"));
    let place: Vec<&Value> = passes().filter(|p| p["name"] == "place").collect();
    let n = run["cases"][0]["particles"].as_f64().expect("a number");
    // 16 bytes in and out for each particle.
    assert!(!place.is_empty() && place.iter().all(|p| p["bytes"].as_f64() == Some(32.0 * n)));
    assert!(passes().all(|p| p["roof_share"].is_null()));

    let (code, stdout, stderr) = bench(&dir, &["-v", "--cold=2"]);
    assert_eq!(code, Some(0), "{stderr}");
    for part in ["COLD CACHES: the device wrote 2 MiB", "least MB", "nimbus devices --roof"] {
        assert!(stdout.contains(part), "{part}: {stdout}");
    }
    let (code, _, stderr) = bench(&dir, &["--cold", "--pass-times", "overlapping"]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("--cold needs passes that are timed one by one"), "{stderr}");
}
