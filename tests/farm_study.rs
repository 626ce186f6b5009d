//! An error study in shards: what is merged is the study that one machine makes, and times that
//! cannot be compared are not merged.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml");
const SIZE: [&str; 2] = ["--size", "48x36"];
/// 3 × 2 × 2 configurations; none is the scene as it stands, whose sort_bits are "auto".
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

fn ran(args: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("nimbus"));
    let output =
        command.args(args).env_remove("NIMBUS_EXCLUSIVE").output().expect("the program runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn planned(dir: &TempDir, name: &str, each: &str) -> PathBuf {
    let folder = dir.path().join(name);
    let plan =
        ["farm", "plan", SCENE, "-o", text(&folder), "--error", "--shard-configurations", each];
    let (code, out, said) = ran(&[&plan, &SIZE[..], &["--"], &STUDY].concat());
    assert_eq!((code, said.as_str()), (Some(0), ""), "{out}");
    assert!(out.starts_with("12 configurations in "), "{out}");
    folder
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

fn read(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("study.json")).expect("a study")).expect("JSON")
}

/// Values, picture, error map.
type Exact = (Vec<Value>, Vec<u8>, Vec<u8>);

/// What of every configuration follows from it alone, by its name; and its picture. The scene as it
/// stands has turns in every part.
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
    read(folder)["configurations"].as_array().expect("configurations").iter().map(of).collect()
}

#[test]
fn parts_together_are_the_study_of_one_machine() {
    let dir = tempfile::tempdir().expect("a folder");
    let farm = planned(&dir, "farm", "5");
    let (code, out, said) = ran(&["farm", "local", "--plan", text(&farm)]);
    assert_eq!((code, said.as_str()), (Some(0), ""), "{out}");
    assert!(out.starts_with("3 shards are done"), "{out}");
    let merged = dir.path().join("merged");
    let (code, out, said) = ran(&["farm", "merge", "--plan", text(&farm), "-o", text(&merged)]);
    assert_eq!((code, said.as_str()), (Some(0), ""), "{out}");
    let alone = dir.path().join("alone");
    let (code, _, said) =
        ran(&[&["error", SCENE, "--out", text(&alone), "-q"], &SIZE[..], &STUDY].concat());
    assert_eq!(code, Some(0), "{said}");

    let (ours, theirs) = (exact(&merged), exact(&alone));
    assert_eq!(ours.keys().collect::<Vec<_>>(), theirs.keys().collect::<Vec<_>>());
    for (name, ours) in &ours {
        assert!(*ours == theirs[name], "{name}: {:?} {:?}", ours.0, theirs[name].0);
    }
    assert_eq!(ours.len(), 13);
    // The same form, and statistics of the same kind from as many turns.
    let (merged_study, study) = (read(&merged), read(&alone));
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
    // What reads studies reads it.
    let page = dir.path().join("page.html");
    let (code, _, said) = ran(&["report", text(&merged), "-o", text(&page)]);
    assert_eq!(code, Some(0), "{said}");
    let names = |folder: &Path| {
        let entries = fs::read_dir(folder).expect("a folder").flatten();
        let mut names: Vec<String> =
            entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    };
    assert_eq!(names(&merged), names(&alone));
}

#[test]
fn times_that_cannot_be_compared_are_refused_with_a_list() {
    let dir = tempfile::tempdir().expect("a folder");
    let farm = planned(&dir, "farm", "6");
    // Started by hand nobody says that the node was theirs alone.
    let (code, _, said) = ran(&["farm", "run", "--plan", text(&farm), "--shard", "0"]);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(ran(&["farm", "local", "--plan", text(&farm)]).0, Some(0));
    let merged = dir.path().join("merged");
    let merge = ["farm", "merge", "--plan", text(&farm), "-o", text(&merged)];
    let (code, _, said) = ran(&merge);
    assert!(code == Some(1) && said.contains("NIMBUS_EXCLUSIVE=1 says so): shards 0"), "{said}");
    assert!(!merged.exists());

    // Another driver: as the node would have written it.
    let plan: Value =
        serde_json::from_slice(&fs::read(farm.join("plan.json")).expect("a plan")).expect("JSON");
    let place =
        |i: usize| farm.join("shards").join(plan["shards"][i]["key"].as_str().expect("a key"));
    let hash = |bytes: &[u8]| format!("{:x}", <sha2::Sha256 as sha2::Digest>::digest(bytes));
    let change = |i: usize, file: &str, from: &str, to: &str| {
        let before = fs::read_to_string(place(i).join(file)).expect("a file");
        assert!(before.contains(from), "{from}");
        let after = before.replace(from, to);
        fs::write(place(i).join(file), &after).expect("room");
        let path = place(i).join("shard.json");
        let mut manifest: Value =
            serde_json::from_slice(&fs::read(&path).expect("it")).expect("JSON");
        manifest["exclusive"] = true.into();
        for record in manifest["files"].as_array_mut().expect("files") {
            if record["name"] == file {
                (record["sha256"], record["bytes"]) =
                    (hash(after.as_bytes()).into(), after.len().into());
            }
        }
        fs::write(&path, manifest.to_string()).expect("room");
    };
    let driver = read(&place(0))["device"]["driver"].as_str().expect("a driver").to_owned();
    change(0, "study.json", &driver, "another driver 1.0");
    let (code, _, said) = ran(&merge);
    assert!(
        code == Some(1) && said.contains("\n  device: ") && said.contains("another driver 1.0"),
        "{said}"
    );
    assert!(!said.contains("EXCLUSIVE") && !merged.exists(), "{said}");
    change(0, "study.json", "another driver 1.0", &driver);
    assert_eq!(ran(&merge).0, Some(0));
}

#[test]
fn what_a_farm_decides_itself_is_refused_among_a_study_s_arguments() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("farm");
    let plan = |study: &[&str]| {
        let begin = ["farm", "plan", SCENE, "-o", text(&folder), "--error", "--"];
        ran(&[&begin[..], study].concat())
    };
    for (study, expected) in [
        (&["--out", "a"][..], "expected no --out"),
        (&["--set", "draw.cutoff=2"], "stand before it"),
        (&["--device", "0"], "--device"),
        (&["--knob", "draw.cutoff=-1"], "draw.cutoff"),
        (&["--knob", "light.0.direction=1"], "what is asked for"),
        (&["--nonsense"], "--nonsense"),
    ] {
        let (code, _, said) = plan(study);
        assert!(code == Some(2) && said.contains(expected), "{study:?} {said}");
        assert!(!folder.exists());
    }
}
