//! Counts of what passes invoke: those of one kernel and of one scene by hand, in parts, and as
//! columns of a bench.

mod harness;
#[path = "harness/program.rs"]
mod program;

use std::path::Path;

use harness::Gpu;
use nimbus::frame::{DeviceChoice, GpuContext, Rendered};
use nimbus::gpu::{Invocations, Kernel};
use nimbus::io::scene_file;
use nimbus::layout::record;
use program::{path, run};
use serde_json::Value;

/// Writes a word in each of 96 invocations a workgroup.
const KERNEL: &str = "#version 460
layout(local_size_x = 96) in;
layout(push_constant) uniform Push { uint first; } push;
layout(std430, binding = 0) writeonly buffer Words { uint words[]; };
void main() { words[gl_GlobalInvocationID.x] = push.first + gl_GlobalInvocationID.x; }
";
const LOCAL_SIZE: u32 = 96;

record! {
    struct Push { first: u32 }
}

fn gpu(counts: bool, max_submit_ms: Option<f64>) -> Gpu {
    Gpu::with_options(|options| {
        options.counts_invocations = counts;
        options.max_submit_ms = max_submit_ms;
    })
}

/// Runs the kernel in two scopes, of 5 and of 7 workgroups, and returns what they invoked.
fn counted(gpu: &mut Gpu, is_on: bool) -> Option<Vec<(&'static str, Invocations)>> {
    let kernel: Kernel = gpu.test_kernel("count", KERNEL, Push::FIELDS);
    assert_eq!(kernel.local_size_x(), LOCAL_SIZE);
    let words = gpu.buffer::<u32>(7 * LOCAL_SIZE as usize);
    gpu.commands.count_invocations(is_on);
    gpu.run(|rec| {
        for (name, n_groups) in [("five", 5), ("seven", 7)] {
            rec.scope(name, |rec| {
                rec.dispatch_blocks(&kernel, &[&words], &Push { first: 1 }, n_groups)
            })?;
        }
        // What no scope holds is not counted.
        rec.dispatch_blocks(&kernel, &[&words], &Push { first: 1 }, 1)
    });
    let found = gpu.commands.invocations().expect("the device is there");
    gpu.commands.count_invocations(false);
    found
}

#[test]
fn invocations_of_a_kernel_are_workgroups_by_their_size() {
    let of = |n_groups: u32| Invocations {
        compute: u64::from(n_groups * LOCAL_SIZE),
        ..Invocations::default()
    };
    let expected = vec![("five", of(5)), ("seven", of(7))];
    let mut device = gpu(true, None);
    assert_eq!(counted(&mut device, true).as_ref(), Some(&expected));
    // Off by default, and again after it was on.
    assert_eq!(counted(&mut device, false), None);
    assert_eq!(counted(&mut device, true).as_ref(), Some(&expected));
    // A device that was not opened for it counts nothing.
    assert_eq!(counted(&mut gpu(false, None), true), None);
    // Submitted in parts, each with queries of its own.
    let mut in_parts = gpu(true, Some(1e-3));
    assert_eq!(counted(&mut in_parts, true).as_ref(), Some(&expected));
    assert!(in_parts.commands.n_parts() > 2, "{} parts", in_parts.commands.n_parts());
}

/// Draws frame 0 of a scene twice, once to count, and returns the counts and the first frame.
fn frame(file: &str, more: &[&str]) -> (Vec<(&'static str, Invocations)>, Rendered) {
    let set = ["film.width=64", "film.height=48"];
    let set: Vec<String> = set.iter().chain(more).map(|s| (*s).to_owned()).collect();
    let scene = scene_file::load(Path::new(file), &set, None).expect("a scene").scene;
    let mut choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    choice.options.counts_invocations = true;
    let context = GpuContext::open(&choice).expect("a device");
    let mut player = context.player(scene, true).expect("the scene fits");
    let packet = player.game.step(0).expect("a packet");
    let rendered = player.renderer.step(packet.clone()).expect("a frame");
    let picture = player.renderer.image_bytes().expect("a picture");
    let counted = player.renderer.count_invocations(packet.clone()).expect("a frame");
    assert_eq!(player.renderer.image_bytes().expect("a picture"), picture);
    // Later frames have no queries.
    player.renderer.step(packet).expect("a frame");
    drop(player);
    context.close().expect("no validation messages");
    (counted.expect("this device counts"), rendered)
}

fn of(counted: &[(&'static str, Invocations)], name: &str) -> Invocations {
    counted.iter().find(|(of, _)| *of == name).unwrap_or_else(|| panic!("{name}: {counted:?}")).1
}

#[test]
fn triangles_and_vertices_of_a_frame_are_those_of_the_scene() {
    let (counted, rendered) = frame("scenes/cubes-554.toml", &["draw.path=\"sprites\""]);
    // 554 particles: nine workgroups of 64.
    assert_eq!(of(&counted, "place").compute, 9 * 64);
    let n = u64::from(rendered.n_kept.expect("a number of particles"));
    assert!((1..=554).contains(&n), "{n}");
    let sprites = of(&counted, "sprites");
    // Each particle that may show is a point, or a strip of two triangles with four vertices.
    let vertices = if sprites.primitives == n { n..=n } else { 4 * n..=6 * n };
    assert!(sprites.primitives == n || sprites.primitives == 2 * n, "{sprites:?} for {n}");
    assert_eq!(sprites.compute, 0);
    assert!(vertices.contains(&sprites.vertex), "{} for {n}", sprites.vertex);
    assert!(sprites.fragment > n && sprites.clipped_primitives <= sprites.primitives);
    // Every pass ran, those too that a second frame would skip, and only passes of the scene.
    let names: Vec<&str> = counted.iter().map(|(name, _)| *name).collect();
    assert!(names.contains(&"generate") && names.contains(&"grid"), "{names:?}");
    assert!(!names.contains(&"tiles") && !names.contains(&"surfaces"), "{names:?}");

    let (counted, _) = frame("scenes/ground.toml", &["draw.path=\"tiles\"", "lighting.grid=16"]);
    // One surface: a strip of two triangles. Tiles draw nothing by triangles.
    let surfaces = of(&counted, "surfaces");
    assert!(surfaces.primitives > 0 && surfaces.primitives.is_multiple_of(2), "{surfaces:?}");
    assert_eq!(surfaces.compute, 0);
    let tiles = of(&counted, "tiles");
    assert!(tiles.compute > 0 && tiles.primitives == 0 && tiles.fragment == 0, "{tiles:?}");
}

#[test]
fn a_bench_has_the_counts_of_every_case_and_none_without_asking() {
    let dir = tempfile::tempdir().expect("a folder");
    let bench = |name: &str, more: &[&str]| {
        let out = path(&dir, name);
        let scene = ["bench", "scenes/cubes-554.toml", "--size", "64x48", "--frames", "2"];
        let rest = ["--warmup", "0", "--repeat", "1", "--no-check", "--out", &out];
        let output = run(&[&scene[..], &rest, more].concat());
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{error}");
        let text = std::fs::read_to_string(dir.path().join(name).join("run.json")).expect("one");
        let frames =
            std::fs::read_to_string(dir.path().join(name).join("frames.csv")).expect("one");
        let json: Value = serde_json::from_str(&text).expect("JSON");
        (json, frames.lines().count(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let sweep = ["--sweep", "draw.path=\"sprites\",\"tiles\""];
    let (json, n_rows, text) = bench("with", &[&sweep[..], &["--invocations", "-v"]].concat());
    let (plain, n_plain, _) = bench("without", &sweep);
    assert_eq!(n_rows, n_plain, "the frame that counts is no timed frame");
    for (case, path) in json["cases"].as_array().expect("cases").iter().zip(["sprites", "tiles"]) {
        let passes = case["invocations"].as_array().expect("counts");
        let place = passes.iter().find(|p| p["name"] == "place").expect("place");
        assert_eq!(place["compute"], 9 * 64);
        assert!(passes.iter().any(|p| p["name"] == path), "{path}: {passes:?}");
    }
    let schema = std::fs::read_to_string("docs/reference/schemas/run.schema.json").expect("one");
    let schema: Value = serde_json::from_str(&schema).expect("JSON");
    let validator = jsonschema::draft202012::new(&schema).expect("a schema");
    for run in [&json, &plain] {
        let faults: Vec<String> = validator.iter_errors(run).map(|e| e.to_string()).collect();
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }
    let keys = json["cases"][0]["invocations"][0].as_object().expect("counts").keys();
    let described = schema["$defs"]["pass_invocations"]["properties"].as_object().expect("keys");
    assert_eq!(keys.collect::<Vec<_>>(), described.keys().collect::<Vec<_>>());
    assert!(text.contains("invoked") && text.contains("triangles"), "{text}");
    assert!(plain["cases"][0]["invocations"].is_null());
}
