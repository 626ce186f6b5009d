//! bench compares what it timed with its reference in f64: right pictures of all kinds pass, every
//! faulty shader is found, and the error is that of `nimbus error`.

#[path = "harness/faults.rs"]
mod faults;
#[path = "harness/program.rs"]
mod program;

use std::fs;
use std::process::Output;

use faults::FAULTS;
use nimbus::passes;
use nimbus::stress::cases;
use program::{nimbus, run, scenes};
use serde_json::Value;
use tempfile::TempDir;

/// Few small frames.
const SHORT: [&str; 11] = [
    "--frames",
    "2",
    "--warmup",
    "1",
    "--repeat",
    "1",
    "--threading",
    "serial",
    "--no-saved",
    "-q",
    "--json",
];
const SMALL: [&str; 2] = ["--size", "96x72"];
/// Without the rounding of half floats small errors show.
const SINGLE: [&str; 2] = ["--set", "film.format='rgba32f'"];

fn bench(args: &[&str]) -> (Output, Option<Value>) {
    let output = run(&[&["bench"], args, &SHORT].concat());
    let json = serde_json::from_slice(&output.stdout).ok();
    (output, json)
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn right_pictures_of_all_kinds_pass() {
    let mut all: Vec<Vec<String>> = scenes()
        .iter()
        .map(|path| vec![path.display().to_string(), SMALL[0].into(), SMALL[1].into()])
        .collect();
    for (scene, settings) in [
        ("cubes-554", &["draw.path='sprites'", "draw.chunks=8"][..]),
        ("cubes-554", &["draw.resolution=0.5"]),
        ("cumulus", &["draw.resolution=0.25"]),
        ("flyby", &["draw.impostors='on'"]),
        ("ground", &["film.format='rgba8'", "lighting.gather='tree'"]),
        ("supercell", &["draw.smallest=1.0", "draw.threshold=1e-3"]),
        ("study-both", &["lighting.mode='none'"]),
        ("study-both", &["lighting.mode='diffusion'", "draw.overlap='slices'"]),
        ("cubes-554", &["lighting.mode='diffusion'", "lighting.facets_per_cloud=100"]),
        (
            "study-both",
            &["lighting.mode='diffusion'", "lighting.bounces=2", "draw.overlap='slices'"],
        ),
        ("cumulus", &["lighting.mode='diffusion'", "lighting.bounces=1", "lighting.grid=24"]),
        // From the light that is kept.
        ("cubes-554", &["lighting.mode='diffusion'", "draw.path='sprites'"]),
        ("cubes-554", &["lighting.mode='diffusion'", "draw.cutoff=3.5"]),
        ("cubes-554", &["draw.lod=0.5", "draw.particles=5000", "cloud.*.texture='none'"]),
        ("threads", &["film.format='rgba32f'", "draw.sort_bits=32"]),
        ("static", &["film.format='rgba32f'", "lighting.summation='pairwise'"]),
    ] {
        let mut args = vec![format!("scenes/{scene}.toml"), "--size".into(), "160x120".into()];
        args.extend(settings.iter().flat_map(|s| ["--set".to_owned(), (*s).to_owned()]));
        all.push(args);
    }
    all.push(["tests/data/splats.toml", SMALL[0], SMALL[1]].map(str::to_owned).to_vec());
    for args in all {
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        let (output, json) = bench(&args);
        assert!(output.status.success(), "{args:?}: {}", stderr(&output));
        for case in json.expect("JSON")["cases"].as_array().expect("cases") {
            let check = &case["check"];
            assert_eq!(check["verdict"], "right", "{args:?}: {check}");
            let rmse = check["rmse"]["value"].as_f64().expect("a number");
            let magnitude = check["magnitude"].as_f64().expect("a number");
            assert!(rmse < magnitude, "{args:?}: {check}");
            println!("{args:?}: RMSE {rmse:.2e} of {magnitude:.2}, {}", check["seconds"]);
        }
    }
}

/// The bench that finds a fault that the stages do not show.
fn finder(what: &str) -> &'static [&'static str] {
    match what {
        "a slot's phase is ignored"
        | "no fade-out at the end of life"
        | "a wave's phase is ignored" => &["scenes/puff.toml"],
        "wrong sort key of negative depths" | "optical depth used as opacity" => {
            &["scenes/cubes-554.toml", "--set", "draw.path='sprites'", "--set", "draw.sort_bits=32"]
        }
        "growth is ignored" => {
            &["scenes/cubes-554.toml", "--set", "cloud.0.grow_to=2", "--set", "time.start_s=60"]
        }
        "no depth behind the last boundary"
        | "a colour over twice the depth of its slice"
        | "a slice closed as if it were thin" => {
            &["scenes/cubes-554.toml", "--set", "draw.overlap='slices'"]
        }
        "no light enters diffusion from above"
        | "a blob's front is lit as its back"
        | "diffuse light is not averaged over all directions" => {
            &["scenes/cubes-554.toml", "--set", "lighting.mode='diffusion'"]
        }
        "a part of a blob is lit as its middle" => &[
            "scenes/cubes-554.toml",
            "--set",
            "lighting.mode='diffusion'",
            "--set",
            "draw.overlap='slices'",
        ],
        "a bounce has no light of the sky" | "light that goes straight on is not seen" => &[
            "scenes/cubes-554.toml",
            "--set",
            "lighting.mode='diffusion'",
            "--set",
            "lighting.grid=24",
            "--set",
            "lighting.bounces=2",
        ],
        // A part of the sea lies outside the box of so fine a grid.
        "ground does not hide the sky from clouds" | "clouds do not hide the sky from ground" => &[
            "scenes/katrina.toml",
            "--set",
            "cloud.0.particles=2000",
            "--set",
            "lighting.grid=48",
            "--set",
            "lighting.bounces=0",
        ],
        "the extinction of one member alone"
        | "cells of one size for all sigma"
        | "the masses of a run the wrong way round" => {
            &["tests/data/splats.toml", "--set", "draw.lod=1.0"]
        }
        "air has no light of its own" | "air as dense above as at the sea" => {
            &["scenes/supercell-sunset.toml", "--set", "cloud.0.particles=2000"]
        }
        "a sea mirrors light from where it goes" => {
            &["scenes/katrina-flight.toml", "--set", "cloud.0.particles=2000"]
        }
        "half of each cell of ground throws no shadow" => &[
            "scenes/cumulus-noon.toml",
            "--set",
            "draw.particles=0",
            "--set",
            "ground.0.points=[61,57]",
            "--set",
            "ground.0.relief=0.8",
            "--set",
            "ground.0.relief_length=16",
            "--set",
            "light.0.date='2018-06-21 10:20:00'",
        ],
        "a harmonic of the wrong sign" => &["tests/data/splats.toml"],
        "the sky's light from everywhere is too bright" => {
            &["scenes/cubes-554.toml", "--set", "lighting.mode='single'"]
        }
        _ => &["scenes/cubes-554.toml"],
    }
}

/// Returns a folder with a shader in which `from` is replaced by `to`.
fn faulty(what: &str, [file, from, to]: [&str; 3]) -> TempDir {
    let dir = TempDir::new().expect("a folder");
    let mut sources = passes::sources();
    assert!(sources.replace(file, from, to), "{what}: {file} does not contain {from}");
    let path = dir.path().join(file);
    fs::create_dir_all(path.parent().expect("a folder")).expect("room");
    fs::write(&path, sources.text(file).expect("a shader")).expect("room");
    dir
}

#[test]
fn a_wrong_stage_is_told_where_the_picture_is_within_its_bounds() {
    let erf = |(what, ..): &&faults::Fault| what.ends_with("coefficient of erf");
    let (what, file, from, to, _) = FAULTS.iter().find(erf).expect("a fault");
    let dir = faulty(what, [file, from, to]);
    let words = ["bench", "scenes/hello.toml", "--size", "64x48", "--frames", "2", "--repeat", "1"];
    let shaders = ["--shaders", dir.path().to_str().expect("UTF-8"), "-q"];
    let output = run(&[&words[..], &shaders].concat());
    let table = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(table.contains("THE DEVICE IS WRONG in functions/erf"), "{table}");
    assert!(!table.contains("the picture is right") && !table.contains("INTERRUPTED"), "{table}");
}

/// Beginnings of the names of cases of `nimbus stress` that a bench runs with new shaders.
const STAGES: [&str; 4] = ["functions/", "brdf/", "generation/", "transport/sum"];

fn stage_of(case: &str) -> Option<usize> {
    STAGES.iter().position(|stage| case.starts_with(stage))
}

/// A bench runs every case of the stages, and each of their faults fails its case
/// (tests/mutations.rs). So one fault of each stage stands for the others here.
#[test]
fn every_faulty_shader_is_found() {
    let (_, right) = bench(&[&["scenes/hello.toml"][..], &SMALL].concat());
    let n_cases = cases().iter().filter(|case| stage_of(case.name).is_some()).count();
    assert_eq!(right.expect("JSON")["stages"]["n_cases"], n_cases);
    let mut missed = vec![];
    let mut is_tried = [false; STAGES.len()];
    for (what, file, from, to, case) in FAULTS {
        if let Some(stage) = stage_of(case)
            && std::mem::replace(&mut is_tried[stage], true)
        {
            continue;
        }
        let dir = faulty(what, [file, from, to]);
        let shaders = ["--shaders", dir.path().to_str().expect("UTF-8")];
        let (output, json) = bench(&[finder(what), &SMALL, &SINGLE, &shaders].concat());
        let error = stderr(&output);
        let is_told = error.contains("the device's picture is wrong");
        println!("{what}: {:?} {error}", output.status.code());
        if output.status.code() != Some(1) || !is_told || json.is_none() {
            missed.push(*what);
        }
    }
    assert!(missed.is_empty(), "not found: {missed:?}");
    assert_eq!(is_tried, [true; STAGES.len()]);
}

#[test]
fn the_error_is_that_of_nimbus_error() {
    for scene in ["cubes-554", "rectangles", "study-light", "hello", "cumulus"] {
        let file = format!("scenes/{scene}.toml");
        let size = ["--size", "120x90"];
        let (output, json) = bench(&[&[&file[..]], &size[..]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let of_bench = json.expect("JSON")["cases"][0]["check"].clone();
        let error = run(&[
            &["error", &file, "--against", "thin", "--knob", "draw.sort_bits=32", "--frame", "1"],
            &["--rounds", "1", "--frames", "1", "--pixels", "4096", "--json", "-q"],
            &size[..],
        ]
        .concat());
        assert!(error.status.success(), "{}", stderr(&error));
        let study: Value = serde_json::from_slice(&error.stdout).expect("JSON");
        let of_error = study["configurations"]
            .as_array()
            .and_then(|all| {
                all.iter().find(|c| c["settings"].as_array().is_some_and(Vec::is_empty))
            })
            .expect("the scene itself")["error"]["rmse"]
            .clone();
        let ends = |of: &Value| ["low", "high"].map(|end| of[end].as_f64().expect("a number"));
        let ([low, high], [low_too, high_too]) = (ends(&of_bench["rmse"]), ends(&of_error));
        println!("{scene}: {} against {of_error}", of_bench["rmse"]);
        assert!(low <= high_too && low_too <= high, "{scene}: {of_bench} against {of_error}");
    }
}

#[test]
fn without_a_check_the_results_say_so() {
    let mut command = nimbus(&["bench", "scenes/hello.toml", "--size", "64x48", "--no-check"]);
    let output = command.args(&SHORT[..10]).output().expect("the program runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success() && text.contains("NOT CHECKED against f64: --no-check"),
        "{text}"
    );
}
