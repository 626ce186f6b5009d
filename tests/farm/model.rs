//! Cost models of `nimbus farm`: fitting one, predicting and pricing a plan with it, and comparing
//! the prediction with what the plan took.

use std::fs;
use std::path::Path;

use crate::program::{path, run};
use serde_json::{Value, json};
use tempfile::TempDir;

const SCENE: &str = "scenes/flyby.toml";
const HELLO: &str = "scenes/hello.toml";
const SIZE: &str = "48x36";

/// Exit code, stdout, stderr.
fn ran(args: &[&str]) -> (Option<i32>, String, String) {
    let output = run(args);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn good(args: &[&str]) -> String {
    let (code, out, said) = ran(args);
    assert_eq!(code, Some(0), "{args:?}: {said}");
    out
}

fn read(path: impl AsRef<Path>) -> Value {
    serde_json::from_slice(&fs::read(path).expect("a file")).expect("JSON")
}

fn status(folder: &str) -> Value {
    serde_json::from_str(&good(&["farm", "status", "--plan", folder, "--json"])).expect("JSON")
}

/// Fits a model to a few frames of two scenes, none of which has pairs of facets.
fn calibrated(dir: &TempDir) -> String {
    let model = path(dir, "model.json");
    let args = [
        "farm",
        "calibrate",
        SCENE,
        HELLO,
        "--frames",
        "6",
        "-o",
        &model,
        "--set",
        "lighting.mode=first",
    ];
    let out = good(&args);
    assert!(out.contains("12 runs") && out.contains("off by"), "{out}");
    model
}

/// A plan of eight frames by `model`.
fn planned(dir: &TempDir, name: &str, model: &str, more: &[&str]) -> (String, Value) {
    let folder = path(dir, name);
    let by =
        ["farm", "plan", SCENE, "-o", &folder, "--frames", "8", "--size", SIZE, "--model", model];
    let said = good(&[&by[..], more].concat());
    (said, read(Path::new(&folder).join("plan.json")))
}

/// Predicts a shard with so many particle steps, at 48 by 36 pixels.
fn by_hand(fitted: &Value, counted: &Value, n_particles: f64) -> f64 {
    let term = |name: &str| fitted[name].as_f64().unwrap_or(0.0);
    let amount = |name: &str| counted[name].as_f64().expect("a number");
    assert_eq!(amount("particle_steps"), n_particles);
    assert!(amount("cells") > 64.0 * 64.0, "{counted}");
    // One sample a pixel for the background, and one for each layer over it.
    assert!(amount("pixel_samples") > 48.0 * 36.0, "{counted}");
    let of_each = [
        ("step_s", "steps"),
        ("particle_step_s", "particle_steps"),
        ("cell_s", "cells"),
        ("pixel_sample_s", "pixel_samples"),
        ("facet_pair_s", "facet_pairs"),
        ("texture_s", "textures"),
    ];
    term("setup_s") + of_each.iter().map(|(each, of)| term(each) * amount(of)).sum::<f64>()
}

fn sizes(plan: &Value) -> Vec<u64> {
    plan["shards"].as_array().expect("shards").iter().filter_map(|s| s["n"].as_u64()).collect()
}

/// The predicted duration of shard `i`, s.
fn seconds(plan: &Value, i: usize) -> f64 {
    plan["shards"][i]["predicted_s"].as_f64().expect("seconds")
}

#[test]
fn a_plan_is_predicted_and_priced_and_the_status_tells_the_error() {
    let dir = tempfile::tempdir().expect("a folder");
    let model = calibrated(&dir);
    let found = read(&model);
    assert_eq!(
        (found["rows"].as_array().map(Vec::len), found["fit"]["n"].as_u64()),
        (Some(12), Some(12))
    );
    assert!(ran(&["farm", "calibrate", HELLO, "-o", &model]).2.contains("--force"));

    // Eight short frames are one shard. They are eight where a shard may not hold two.
    let price = ["--nodes", "2", "--rate", "3", "--quantum", "1e-3", "--retries", "0"];
    let (said, whole) = planned(&dir, "whole", &model, &price);
    let (_, each) = planned(&dir, "each", &model, &["--shard-seconds", "0,1e-9"]);
    assert_eq!((sizes(&whole), sizes(&each)), (vec![8], vec![1; 8]));
    let n_particles = particles_of(&dir);
    let fitted = &found["fit"]["model"];
    for (plan, i, n) in [(&each, 3, n_particles), (&whole, 0, 8.0 * n_particles)] {
        let expected = by_hand(fitted, &plan["shards"][i]["counted"], n);
        let predicted = seconds(plan, i);
        assert!((predicted - expected).abs() <= 1e-12 * expected, "{predicted} {expected}");
    }
    // One of two nodes works, and is paid for by the millisecond.
    let cost = 3.0 * (seconds(&whole, 0) / 1e-3).ceil();
    assert!(
        said.contains("50 % of their time idle")
            && said.contains(&format!("price: {cost:.2} for ")),
        "{said}"
    );

    let folder = path(&dir, "each");
    good(&["farm", "local", "--plan", &folder]);
    let status_now = status(&folder);
    let off = |i: usize| {
        let taken = status_now["shards"][i]["seconds"].as_f64().expect("seconds");
        (seconds(&each, i) - taken).abs() / taken
    };
    let largest = (0..8).map(off).fold(0.0, f64::max);
    let predicted = &status_now["predicted"];
    assert_eq!((predicted["n"].as_u64(), predicted["largest"].as_f64()), (Some(8), Some(largest)));
    assert_eq!(status_now["n_other_class"], json!(0));

    // Shards of another class of devices do not enter the error.
    let text = fs::read_to_string(Path::new(&folder).join("plan.json")).expect("a plan");
    let name = each["predicted_for"]["device"].as_str().expect("a name");
    fs::write(Path::new(&folder).join("plan.json"), text.replace(name, "another device"))
        .expect("room");
    let other = status(&folder);
    assert_eq!((&other["predicted"], &other["n_other_class"]), (&Value::Null, &json!(8)));
    let said = good(&["farm", "status", "--plan", &folder]);
    assert!(
        said.contains("of 8 shards nothing was predicted: the model is of another device"),
        "{said}"
    );
}

#[test]
fn broken_models_and_unmeasured_amounts_are_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let (model, other, out) = (calibrated(&dir), path(&dir, "other.json"), path(&dir, "out"));
    for (from, to, expected) in [
        ("\"schema\": 1", "\"schema\": 9", "schema 9"),
        ("\"fit\"", "\"fat\"", "fat"),
        ("{", "", "not JSON"),
    ] {
        let text = fs::read_to_string(&model).expect("a model").replacen(from, to, 1);
        fs::write(&other, text).expect("room");
        let (code, _, said) = ran(&["farm", "plan", SCENE, "-o", &out, "--model", &other]);
        assert!(code == Some(2) && said.contains(expected), "{said}");
    }
    let (code, _, said) =
        ran(&["farm", "plan", "scenes/rectangles.toml", "-o", &out, "--model", &model, "-q"]);
    assert!(code == Some(2) && said.contains("facet pairs was not measured"), "{said}");
    assert!(!Path::new(&out).exists());
}

#[test]
fn a_plan_as_json_has_arguments_and_outputs_of_each_shard() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = path(&dir, "farm");
    let plan = [
        "farm",
        "plan",
        HELLO,
        "--frames",
        "3",
        "--shard-frames",
        "2",
        "--size",
        SIZE,
        "-o",
        &folder,
    ];
    let told = good(&[&plan[..], &["--device", "no such device", "--json"]].concat());
    let told: Value = serde_json::from_str(&told).expect("JSON");
    assert_eq!(told["device"], json!("no such device"));
    let of = |i: usize, key: &str| -> Vec<String> {
        serde_json::from_value(told["shards"][i][key].clone()).expect("texts")
    };
    assert_eq!(of(0, "outputs"), ["frame-00000000.png", "frame-00000001.png"]);
    assert_eq!(of(1, "outputs"), ["frame-00000002.png"]);
    let arguments = of(1, "arguments");
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (code, _, said) = ran(&arguments);
    assert!(code == Some(2) && said.contains("no such device"), "{said}");
    // The run's own --device comes before the plan's.
    good(&[&arguments[..], &["--device", "0"]].concat());
    let key = told["shards"][1]["key"].as_str().expect("a key");
    for name in of(1, "outputs") {
        assert!(Path::new(&folder).join("shards").join(key).join(&name).is_file(), "{name}");
    }
}

/// The number of particles of the fly-by, as `render -v` prints it.
fn particles_of(dir: &TempDir) -> f64 {
    let out = path(dir, "counted.png");
    let args = ["render", SCENE, "--size", SIZE, "-o", &out, "-v"];
    let (_, _, said) = ran(&args);
    let line = said.lines().find(|line| line.contains(" particles in ")).expect("a count");
    line.split_whitespace().next().and_then(|n| n.parse().ok()).expect("a number")
}
