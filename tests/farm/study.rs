//! `nimbus farm` with an error study: except for times, the merged study is that of one process,
//! and times that cannot be compared are not merged.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::farm::{Farm, fail, json, names, path_text, succeed};
use serde_json::Value;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml");
const SIZE: [&str; 2] = ["--size", "48x36"];
/// 3 × 2 × 2 configurations. None is the base configuration, whose sort_bits are "auto".
const STUDY: [&str; 15] = [
    "--grid",
    "--knob",
    "draw.cutoff=2,3,4",
    "--knob",
    "lighting.grid=16,32",
    "--knob",
    "draw.sort_bits=16,32",
    "--against",
    "thin",
    "--pixels",
    "64",
    "--rounds",
    "3",
    "--frames",
    "1",
];

/// Plans the study, so many configurations a shard.
fn planned(each: &str) -> Farm {
    let plan = ["--error", "--shard-configurations", each];
    Farm::of(SCENE, &[&SIZE, &plan[..], &["--"], &STUDY].concat())
}

fn study_in(folder: &Path) -> Value {
    json(&folder.join("study.json"))
}

/// Values, picture, error map.
type Exact = (Vec<Value>, Vec<u8>, Vec<u8>);

/// Everything of each configuration that does not depend on times, by its name. The base
/// configuration has turns in every part, so that their number is left out.
fn exact(folder: &Path) -> BTreeMap<String, Exact> {
    let of = |c: &Value| {
        let keys = ["settings", "hash", "error", "failure", "n_turns"];
        let is_base = c["name"] == "as it stands";
        let keys = if is_base { &keys[..4] } else { &keys[..] };
        let values: Vec<Value> = keys.iter().map(|key| c[*key].clone()).collect();
        let file =
            |key: &str| fs::read(folder.join(c[key].as_str().expect("a name"))).expect("a picture");
        (
            c["name"].as_str().expect("a name").to_owned(),
            (values, file("picture"), file("error_map")),
        )
    };
    study_in(folder)["configurations"].as_array().expect("configurations").iter().map(of).collect()
}

#[test]
fn the_merged_study_is_that_of_one_process() {
    let farm = planned("5");
    let out = farm.local();
    assert!(out.starts_with("3 shards are done"), "{out}");
    let (merged, alone) = (farm.merged(), farm.beside("alone"));
    let (code, out, errors) = farm.merge();
    assert_eq!((code, errors.as_str()), (Some(0), ""), "{out}");
    succeed(&[&["error", SCENE, "--out", path_text(&alone), "-q"], &SIZE[..], &STUDY].concat());

    let (ours, theirs) = (exact(&merged), exact(&alone));
    assert_eq!(ours.keys().collect::<Vec<_>>(), theirs.keys().collect::<Vec<_>>());
    for (name, ours) in &ours {
        assert!(*ours == theirs[name], "{name}: {:?} {:?}", ours.0, theirs[name].0);
    }
    assert_eq!(ours.len(), 13);
    // The same form, and statistics of the same kind from as many turns.
    let (merged_study, study) = (study_in(&merged), study_in(&alone));
    let keys =
        |value: &Value| value.as_object().expect("an object").keys().cloned().collect::<Vec<_>>();
    assert_eq!(keys(&merged_study), keys(&study));
    for key in [
        "schema",
        "code",
        "scene_hash",
        "device",
        "metric",
        "time",
        "rounds",
        "frames",
        "interrupted",
    ] {
        assert_eq!(merged_study[key], study[key], "{key}");
    }
    let all = |study: &Value| study["configurations"].as_array().expect("configurations").clone();
    for (c, other) in all(&merged_study).iter().zip(&all(&study)) {
        assert_eq!(keys(c), keys(other));
        assert!(c["by_base"]["value"].as_f64() > Some(0.0) && c["front"] != "unknown", "{c}");
    }
    let page = farm.beside("page.html");
    succeed(&["report", path_text(&merged), "-o", path_text(&page)]);
    assert_eq!(names(&merged), names(&alone));
}

#[test]
fn times_that_cannot_be_compared_are_refused_with_a_list() {
    let farm = planned("6");
    // A run that is started by hand may share its node.
    assert_eq!(farm.run(0).0, Some(0));
    farm.local();
    let (code, _, errors) = farm.merge();
    let expected = "NIMBUS_EXCLUSIVE=1 says so): shards 0";
    assert!(code == Some(1) && errors.contains(expected), "{errors}");
    assert!(!farm.merged().exists());

    let study = study_in(&farm.place(0));
    let driver = study["device"]["driver"].as_str().expect("a driver");
    farm.change_file(0, "study.json", driver, "another driver 1.0");
    let (code, _, errors) = farm.merge();
    assert!(code == Some(1) && errors.contains("\n  device: "), "{errors}");
    assert!(errors.contains("another driver 1.0") && !errors.contains("EXCLUSIVE"), "{errors}");
    assert!(!farm.merged().exists());
    farm.change_file(0, "study.json", "another driver 1.0", driver);
    assert_eq!(farm.merge().0, Some(0));
}

#[test]
fn arguments_that_the_plan_determines_are_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("farm");
    for (arguments, expected) in [
        (&["--out", "a"][..], "expected no --out"),
        (&["--set", "draw.cutoff=2"], "stand before it"),
        (&["--device", "0"], "--device"),
        (&["--knob", "draw.cutoff=-1"], "draw.cutoff"),
        (&["--knob", "light.0.direction=1"], "is no knob"),
        (&["--nonsense"], "--nonsense"),
    ] {
        let begin = ["farm", "plan", SCENE, "-o", path_text(&folder), "--error", "--"];
        let errors = fail(2, &[&begin[..], arguments].concat());
        assert!(errors.contains(expected), "{arguments:?} {errors}");
        assert!(!folder.exists());
    }
}
