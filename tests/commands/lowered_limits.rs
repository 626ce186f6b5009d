//! Scenes under the limits of other devices: each draws the picture of the whole device, or says in
//! one line which limit it needs.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use crate::program;
use nimbus::error::Error;
use nimbus::frame::{DeviceChoice, GpuContext, open_sides};
use nimbus::gpu::{DeviceOptions, LoweredLimits};
use nimbus::io::scene_file;
use nimbus::model::scene::{DrawPath, LightingMode, Scene};

/// Devices on which every scene is drawn.
const CAPABLE: [&str; 6] =
    ["geforce-rtx-4090", "radeon-rx-7900", "arc-a770", "apple-m2", "adreno-740", "mali-g78"];

fn limits(name: &str) -> LoweredLimits {
    let path = format!("tests/data/limits/{name}.toml");
    LoweredLimits::read(Path::new(&path)).unwrap_or_else(|e| panic!("{e}"))
}

fn open(limits: Option<LoweredLimits>) -> GpuContext {
    let options = DeviceOptions { limits, ..DeviceOptions::default() };
    let choice = DeviceChoice { validation: true, options, ..DeviceChoice::default() };
    GpuContext::open(&choice).expect("a device")
}

/// A scene small enough that a test draws it many times: fewer particles and pixels, and a grid
/// that still has more texels than the least that Vulkan promises.
fn scene(path: &Path, draw: DrawPath) -> Scene {
    let text = fs::read_to_string(path).expect("a scene");
    let is_weather = text.contains("from = \"weather\"");
    // Weather has a number of particles of its own.
    let fewer = is_weather.then_some("cloud.0.particles=2000");
    let set: Vec<String> =
        ["film.width=64", "film.height=48"].into_iter().chain(fewer).map(str::to_owned).collect();
    let mut scene = scene_file::load(path, &set, None).expect("a scene").scene;
    scene.draw.n_particles = scene.draw.n_particles.min(2000);
    scene.draw.path = draw;
    scene
}

/// Draws one frame with all knobs exact.
fn picture(context: &GpuContext, scene: &Scene) -> Result<Vec<u8>, Error> {
    let scene = Arc::new(scene.exact().into_owned());
    let (mut renderer, mut game) = open_sides(&context.device, context.compiler(), &scene, true)?;
    renderer.step(game.step(0)?)?;
    renderer.image_bytes()
}

/// Returns how many bytes of two pictures differ, and the first of them.
fn difference(found: &[u8], expected: &[u8]) -> String {
    let differ = |i: &usize| found.get(*i) != expected.get(*i);
    let n = (0..found.len().max(expected.len())).filter(differ).count();
    let first: Vec<_> =
        (0..found.len()).filter(differ).map(|i| (i, found[i], expected.get(i))).take(8).collect();
    format!("{n} of {} bytes differ; (byte, found, expected): {first:?}", expected.len())
}

#[test]
fn every_scene_draws_the_same_picture_under_the_limits_of_other_devices() {
    let whole = open(None);
    let others: Vec<_> = CAPABLE.map(|name| (name, open(Some(limits(name))))).into();
    // Scenes drawn with and without diffuse light.
    let mut n_drawn = [0, 0];
    for path in program::scenes() {
        // Devices and paths take turns, so that each device draws both kinds.
        let is_diffuse = scene(&path, DrawPath::Tiles).lighting.mode == LightingMode::Diffusion;
        let i = n_drawn[usize::from(is_diffuse)];
        n_drawn[usize::from(is_diffuse)] += 1;
        let draw = [DrawPath::Sprites, DrawPath::Tiles][(i + i / others.len()) % 2];
        let (name, context) = &others[i % others.len()];
        let scene = scene(&path, draw);
        let expected = picture(&whole, &scene).expect("a picture");
        let what = format!("{} by {draw:?} on {name}", path.display());
        let found = picture(context, &scene).unwrap_or_else(|e| panic!("{what}: {e}"));
        if found != expected {
            // A picture that differs by chance is another fault than one of a limit.
            let again = |of: &GpuContext| picture(of, &scene).expect("a picture");
            let same = [again(context) == found, again(&whole) == expected];
            let difference = difference(&found, &expected);
            panic!("{what}: {difference}; drawn again, each is the same: {same:?}");
        }
    }
    assert!(n_drawn.iter().all(|n| *n >= others.len()), "{n_drawn:?}");
    whole.close().expect("no messages");
    for (_, context) in others {
        context.close().expect("no messages");
    }
}

#[test]
fn a_device_of_least_limits_is_refused_by_the_limit_that_a_scene_needs() {
    let least = open(Some(limits("vulkan-minimum")));
    for path in program::scenes() {
        let error = picture(&least, &scene(&path, DrawPath::Tiles)).expect_err("too few buffers");
        assert_eq!(error.exit_code(), 2, "{error}");
        let text = error.to_string();
        let named = "storage buffers, this device takes 4 (maxPerStageDescriptorStorageBuffers)";
        assert!(!text.contains('\n') && text.contains(named), "{}: {text}", path.display());
    }
    least.close().expect("no messages");
}

#[test]
fn kernels_of_a_scene_are_listed_once_a_variant_and_differ_by_the_limits() {
    let listed = |more: &[&str]| {
        let args = [&["devices", "--kernels", "scenes/hello.toml", "--json"], more].concat();
        let output = program::run(&args);
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{text}");
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let all = json["scenes"][0]["pipelines"].as_array().expect("pipelines").clone();
        let of = |p: &serde_json::Value| format!("{} {}", p["pipeline"], p["variant"]);
        let names: BTreeSet<String> = all.iter().map(of).collect();
        assert_eq!(names.len(), all.len(), "a pipeline stands twice");
        names
    };
    let own = listed(&[]);
    for pass in ["generate", "grid.deposit", "transmit", "first", "second.gather", "tiles"] {
        assert!(own.iter().any(|name| name.contains(pass)), "{pass}: {own:?}");
    }
    let wide = listed(&["--limits", "tests/data/limits/geforce-rtx-4090.toml"]);
    let is_wide = |names: &BTreeSet<String>| names.iter().any(|n| n.contains("\"WIDE\":1"));
    assert!(is_wide(&wide) && !is_wide(&own));
}
