//! A reference picture in tiles and ranges of samples: what is merged is the picture that one
//! machine makes, to the byte.

#[path = "harness/program.rs"]
mod program;

use std::fs;
use std::path::{Path, PathBuf};

use program::{nimbus, path, run};
use serde_json::Value;
use tempfile::TempDir;

const PLAIN: &str = "cloud.0.texture=\"none\"";

fn good(args: &[&str]) -> String {
    let output = run(args);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{args:?}: {said}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The exit code and what was said.
fn bad(args: &[&str]) -> (Option<i32>, String) {
    let output = run(args);
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn plan(dir: &TempDir, name: &str, scene: &[&str], more: &[&str]) -> String {
    let folder = path(dir, name);
    good(&[&["farm", "plan", "-q", "-o", &folder], scene, more].concat());
    folder
}

fn shards(folder: &str) -> Vec<Value> {
    let text = fs::read_to_string(Path::new(folder).join("plan.json")).expect("a plan");
    serde_json::from_str::<Value>(&text).expect("JSON")["shards"]
        .as_array()
        .expect("shards")
        .clone()
}

fn sums_of(folder: &str, i: usize) -> PathBuf {
    let key = shards(folder)[i]["key"].as_str().expect("a key").to_owned();
    Path::new(folder).join("shards").join(key).join(format!("sums-{i:08}.f64"))
}

#[test]
fn merged_it_is_the_picture_of_one_machine() {
    let dir = tempfile::tempdir().expect("a folder");
    let cubes = ["scenes/cubes-554.toml", "--size", "41x30"];
    let room = ["scenes/study-light.toml", "--size", "9x7"];
    for (name, scene, which, samples, cut, n_shards) in [
        ("thin", &cubes[..], "thin", "1", &["--tile", "16x11"][..], 9),
        ("shown", &cubes, "thin", "1", &["--tile", "41x7", "--format", "png"], 5),
        (
            "volume",
            &[&cubes[..], &["--set", PLAIN]].concat(),
            "volume",
            "6",
            &["--tile", "20x30", "--shard-samples", "4"],
            6,
        ),
        ("paths", &room, "reflections=3", "5", &["--tile", "9x4", "--shard-samples", "2"], 6),
    ] {
        let what = ["--reference", which, "--samples", samples];
        let folder = plan(&dir, name, scene, &[&what[..], cut].concat());
        assert_eq!(shards(&folder).len(), n_shards, "{name}");
        // Out of order, one by one, and without a device.
        for i in (0..n_shards).rev().map(|i| i.to_string()) {
            let mut command = nimbus(&["farm", "run", "-q", "--plan", &folder, "--shard", &i]);
            let output = command.env("VK_DRIVER_FILES", "/nowhere.json").output().expect("it runs");
            assert!(
                output.status.success(),
                "{name} {i}: {}",
                String::from_utf8_lossy(&output.stderr)
            );
        }
        let merged = path(&dir, &format!("{name}-merged"));
        good(&["farm", "merge", "--plan", &folder, "-o", &merged]);
        let file = if cut.contains(&"png") { "reference.png" } else { "reference.exr" };
        let single = path(&dir, &format!("{name}-{file}"));
        let said = good(&[&["render", "-q", "--json", "-o", &single], scene, &what].concat());
        let read = |path: &Path| fs::read(path).expect("a picture");
        assert!(read(&Path::new(&merged).join(file)) == read(Path::new(&single)), "{name}");
        let about: Value =
            serde_json::from_slice(&read(&Path::new(&merged).join("reference.json")))
                .expect("JSON");
        assert_eq!(
            (about["reference"].as_str(), about["samples"].to_string().as_str()),
            (Some(which), samples)
        );
        let said: Value = serde_json::from_str(&said).expect("JSON");
        if samples != "1" {
            assert_eq!(
                (&about["own_error"], &about["accuracy"]),
                (&said["own_error"], &said["accuracy"])
            );
        }
    }
}

#[test]
fn what_is_not_all_there_or_is_something_else_is_no_picture() {
    let dir = tempfile::tempdir().expect("a folder");
    let scene = ["scenes/hello.toml", "--size", "24x18", "--set", PLAIN];
    let cut =
        ["--reference", "volume", "--samples", "4", "--tile", "12x18", "--shard-samples", "2"];
    let folder = plan(&dir, "farm", &scene, &cut);
    let merge = |name: &str| bad(&["farm", "merge", "--plan", &folder, "-o", &path(&dir, name)]);
    good(&["farm", "run", "-q", "--plan", &folder, "--shard", "1"]);
    let (code, said) = merge("early");
    assert_eq!(code, Some(1));
    assert!(said.contains("1 of 4 shards are done") && said.contains("to do: 0,2-3"), "{said}");
    good(&["farm", "local", "-q", "--plan", &folder]);
    // A flipped bit, a file cut off, an empty one, one of another shard.
    let (sums, other) = (sums_of(&folder, 2), sums_of(&folder, 3));
    let whole = fs::read(&sums).expect("sums");
    let mut flipped = whole.clone();
    flipped[777] ^= 1;
    for (what, content) in [
        ("flipped", flipped),
        ("cut off", whole[..whole.len() - 8].to_vec()),
        ("empty", Vec::new()),
        ("swapped", fs::read(&other).expect("sums")),
    ] {
        fs::write(&sums, content).expect("a file");
        let (code, said) = merge(what);
        assert_eq!(code, Some(1), "{what}: {said}");
        assert!(
            said.contains("to do: 2") && said.contains("shard 2: sums-00000002.f64"),
            "{what}: {said}"
        );
        assert!(!Path::new(&path(&dir, what)).exists());
        // It is made anew, the same.
        good(&["farm", "run", "-q", "--plan", &folder, "--shard", "2"]);
        assert!(fs::read(&sums).expect("sums") == whole, "{what}");
    }
    good(&["farm", "merge", "--plan", &folder, "-o", &path(&dir, "whole")]);
    // Results of another kind of processor: their last digits may differ.
    let manifest = sums.with_file_name("shard.json");
    let text = fs::read_to_string(&manifest).expect("a manifest");
    let mut read: Value = serde_json::from_str(&text).expect("JSON");
    read["device"]["name"] = "Abacus".into();
    fs::write(&manifest, read.to_string()).expect("a file");
    let (code, said) = merge("mixed");
    assert_eq!(code, Some(1));
    assert!(said.contains("Abacus") && said.contains("--mixed"), "{said}");
    good(&["farm", "merge", "--mixed", "--plan", &folder, "-o", &path(&dir, "mixed")]);
}

#[test]
fn what_cannot_be_planned_is_said() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = path(&dir, "farm");
    let hello = ["farm", "plan", "scenes/hello.toml", "-o", &folder, "--set", PLAIN];
    for (more, expected) in [
        (&["--reference", "thick"][..], "expected thin, volume, model or reflections=K"),
        (&["--reference", "thin", "--samples", "0"], "expected a number of samples from 1 to"),
        (&["--reference", "thin", "--shard-samples", "12"], "expected a power of two"),
        (&["--reference", "thin", "--frames", "4"], "cannot be used with"),
        (&["--samples", "4"], "--reference"),
        (&["--reference", "reflections=2", "--set", "lighting.mode=\"none\""], "nothing reflects"),
    ] {
        let (code, said) = bad(&[&hello[..], more].concat());
        assert_eq!(code, Some(2), "{more:?}: {said}");
        assert!(said.contains(expected), "{more:?}: {said}");
        assert!(!Path::new(&folder).exists());
    }
    let cubes = ["farm", "plan", "scenes/cubes-554.toml", "-o", &folder, "--reference", "volume"];
    let (code, said) = bad(&cubes);
    assert!(code == Some(2) && said.contains("cloud 0 is textured"), "{said}");
    // The processor does it.
    let thin = [&hello[..], &["--reference", "thin"]].concat();
    let (code, said) = bad(&[&thin[..], &["--device", "0"]].concat());
    assert!(code == Some(2) && said.contains("cannot be used with"), "{said}");
    good(&thin);
    for run in [&["run", "--shard", "0"][..], &["local"]] {
        let (code, said) = bad(&[&["farm"], run, &["--plan", &folder, "--device", "0"]].concat());
        assert!(code == Some(2) && said.contains("a reference needs no device"), "{said}");
    }
}

#[test]
fn a_model_of_finished_shards_cuts_the_next_plan() {
    let dir = tempfile::tempdir().expect("a folder");
    let of = |samples| ["--reference", "model", "--samples", samples, "--shard-samples", "4"];
    let room = "scenes/study-light.toml";
    let hello = ["scenes/hello.toml", "--size", "16x12", "--set", PLAIN];
    // Of so different sizes that no noise hides what a pixel takes.
    let farms = [
        plan(&dir, "small", &[room, "--size", "6x4", "--tile", "2x4"], &of("1")),
        plan(&dir, "large", &[room, "--size", "20x15"], &of("4")),
        plan(&dir, "other", &[&hello[..], &["--tile", "8x12"]].concat(), &of("1")),
    ];
    let model = path(&dir, "model.json");
    let (code, said) = bad(&["farm", "calibrate", "--farm", &farms[0], "-o", &model]);
    assert!(code == Some(2) && said.contains("no shard of these farms is done"), "{said}");
    farms.iter().for_each(|farm| drop(good(&["farm", "local", "-q", "--plan", farm])));
    let told = farms.iter().flat_map(|farm| ["--farm", farm]);
    let said =
        good(&["farm", "calibrate", "-o", &model].into_iter().chain(told).collect::<Vec<_>>());
    assert!(said.contains("6 runs of reference model"), "{said}");
    // Cut to a third of what it takes beyond a set-up.
    let predicted = |name: &str, lengths: &str| -> Vec<f64> {
        let scene = [room, "--reference", "model", "--samples", "8", "--size", "40x30"];
        let folder = plan(
            &dir,
            name,
            &scene,
            &["--model", &model, "--shard-seconds", lengths, "--nodes", "1"],
        );
        shards(&folder).iter().map(|s| s["predicted_s"].as_f64().expect("seconds")).collect()
    };
    let whole = predicted("whole", "5000,9000");
    let text = fs::read_to_string(&model).expect("a model");
    let read: Value = serde_json::from_str(&text).expect("JSON");
    let setup = read["fit"]["model"]["setup_s"].as_f64().expect("seconds");
    assert!(whole.len() == 1 && whole[0] > setup, "{whole:?} {setup}");
    let most = setup + (whole[0] - setup) / 3.0;
    let cut = predicted("cut", &format!("0,{most}"));
    println!("{setup} {whole:?} {cut:?}");
    assert!(
        (3..=8).contains(&cut.len()) && cut.iter().all(|s| *s <= most),
        "{setup} {whole:?} {cut:?}"
    );
    // Of another kind of work the model says nothing.
    let (code, said) =
        bad(&[&["farm", "plan", "-o", &path(&dir, "frames"), "--model", &model], &hello[..]]
            .concat());
    assert!(
        code == Some(2) && said.contains("calibrated by reference model; expected one of frames"),
        "{said}"
    );
    let thin = ["--reference", "thin", "--model", &model, "-o", &path(&dir, "thin")];
    let (code, said) = bad(&[&["farm", "plan"], &hello[..], &thin].concat());
    assert!(code == Some(2) && said.contains("expected one of reference thin"), "{said}");
}
