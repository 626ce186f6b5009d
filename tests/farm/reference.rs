//! `nimbus farm` with a reference picture, in tiles and ranges of samples: the merged picture is
//! that of one process, to the byte.

use std::fs;
use std::path::{Path, PathBuf};

use crate::farm::{Farm, fail, json, outcome, path_text, succeed};
use serde_json::Value;

/// The references except for "thin" take plain clouds alone.
const PLAIN: &str = "cloud.0.texture=\"none\"";

fn n_shards(farm: &Farm) -> usize {
    farm.plan()["shards"].as_array().expect("shards").len()
}

/// The file of a shard of one piece.
fn sums_of(farm: &Farm, shard: usize) -> PathBuf {
    farm.place(shard).join(format!("sums-{shard:08}.f64"))
}

#[test]
fn the_merged_picture_is_that_of_one_process() {
    let cubes = ["scenes/cubes-554.toml", "--size", "41x30"];
    let plain = [&cubes[..], &["--set", PLAIN]].concat();
    let room = ["scenes/study-light.toml", "--size", "9x7"];
    for (scene, which, samples, cut, n) in [
        (&cubes[..], "thin", "1", &["--tile", "16x11"][..], 9),
        (&cubes, "thin", "1", &["--tile", "41x7", "--format", "png"], 5),
        (&plain, "volume", "6", &["--tile", "20x30", "--shard-samples", "4"], 6),
        (&plain, "transport", "10", &["--tile", "41x30", "--shard-samples", "2"], 5),
        (&room, "reflections=3", "5", &["--tile", "9x4", "--shard-samples", "2"], 6),
    ] {
        let what = ["--reference", which, "--samples", samples];
        let options = [&["-q"], &scene[1..], &what[..], cut].concat();
        let farm = Farm::of(scene[0], &options);
        assert_eq!(n_shards(&farm), n, "{which}");
        // In reverse order, and without a device.
        for shard in (0..n).rev() {
            let mut command = farm.command(shard);
            let output = command.env("VK_DRIVER_FILES", "/nowhere.json").output().expect("it runs");
            let (code, _, errors) = outcome(&output);
            assert_eq!(code, Some(0), "{which} {shard}: {errors}");
        }
        assert_eq!(farm.merge().0, Some(0));
        let file = if cut.contains(&"png") { "reference.png" } else { "reference.exr" };
        let single = farm.beside(file);
        let render = ["render", "-q", "--json", "-o", path_text(&single)];
        let out = succeed(&[&render, scene, &what].concat());
        let read = |path: &Path| fs::read(path).expect("a picture");
        assert!(read(&farm.merged().join(file)) == read(&single), "{which}");
        let about = json(&farm.merged().join("reference.json"));
        assert_eq!(about["reference"].as_str(), Some(which));
        assert_eq!(about["samples"].to_string(), samples);
        if samples != "1" {
            let rendered: Value = serde_json::from_str(&out).expect("JSON");
            for key in ["own_error", "accuracy"] {
                assert_eq!(about[key], rendered[key], "{which} {key}");
            }
        }
    }
}

#[test]
fn missing_broken_and_mixed_pieces_are_not_merged() {
    let scene = "scenes/hello.toml";
    let cut = ["--reference", "volume", "--samples", "4", "--tile", "12x18", "--shard-samples"];
    let size = ["-q", "--size", "24x18", "--set", PLAIN];
    let farm = Farm::of(scene, &[&size[..], &cut, &["2"]].concat());
    assert_eq!(farm.run(1).0, Some(0));
    let (code, _, errors) = farm.merge();
    assert_eq!(code, Some(1));
    assert!(errors.contains("1 of 4 shards are done"), "{errors}");
    assert!(errors.contains("to do: 0,2-3"), "{errors}");
    farm.local();
    let (sums, other) = (sums_of(&farm, 2), sums_of(&farm, 3));
    let whole = fs::read(&sums).expect("sums");
    let mut flipped = whole.clone();
    flipped[777] ^= 1;
    for (what, content) in [
        ("flipped", flipped),
        ("truncated", whole[..whole.len() - 8].to_vec()),
        ("empty", Vec::new()),
        ("swapped", fs::read(&other).expect("sums")),
    ] {
        fs::write(&sums, content).expect("a file");
        let (code, _, errors) = farm.merge();
        assert_eq!(code, Some(1), "{what}: {errors}");
        assert!(errors.contains("to do: 2"), "{what}: {errors}");
        assert!(errors.contains("shard 2: sums-00000002.f64"), "{what}: {errors}");
        assert!(!farm.merged().exists());
        // The shard is made again, with the same bytes.
        assert_eq!(farm.run(2).0, Some(0));
        assert!(fs::read(&sums).expect("sums") == whole, "{what}");
    }
    // The last digits of another kind of processor may differ.
    farm.change_manifest(2, |manifest| manifest["device"]["name"] = "Abacus".into());
    let (code, _, errors) = farm.merge();
    assert_eq!(code, Some(1));
    assert!(errors.contains("Abacus") && errors.contains("--mixed"), "{errors}");
    let merged = farm.merged();
    succeed(&["farm", "merge", "--mixed", "--plan", farm.path(), "-o", path_text(&merged)]);
}

#[test]
fn impossible_references_are_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = dir.path().join("farm");
    let plan = ["farm", "plan", "-o", path_text(&folder)];
    let hello = ["scenes/hello.toml", "--set", PLAIN];
    for (more, expected) in [
        (&["--reference", "thick"][..], "expected thin, slices, volume, model, reflections=K"),
        (&["--reference", "thin", "--samples", "0"], "expected a number of samples from 1 to"),
        (&["--reference", "thin", "--shard-samples", "12"], "expected a power of two"),
        (&["--reference", "thin", "--frames", "4"], "cannot be used with"),
        (&["--reference", "thin", "--device", "0"], "cannot be used with"),
        (&["--samples", "4"], "--reference"),
        (&["--reference", "reflections=2", "--set", "lighting.mode=\"none\""], "nothing reflects"),
    ] {
        let errors = fail(2, &[&plan[..], &hello, more].concat());
        assert!(errors.contains(expected), "{more:?}: {errors}");
        assert!(!folder.exists());
    }
    let cubes = ["scenes/cubes-554.toml", "--reference", "volume"];
    let errors = fail(2, &[&plan[..], &cubes].concat());
    assert!(errors.contains("cloud 0 is textured"), "{errors}");
}

#[test]
fn runs_of_a_reference_take_no_device() {
    let farm = Farm::of("scenes/hello.toml", &["-q", "--set", PLAIN, "--reference", "thin"]);
    for run in [&["run", "--shard", "0"][..], &["local"]] {
        let errors = fail(2, &[&["farm"], run, &["--plan", farm.path(), "--device", "0"]].concat());
        assert!(errors.contains("a reference needs no device"), "{errors}");
    }
}

/// The duration of a shard by known coefficients, s.
fn seconds(counted: &Value) -> f64 {
    let amount = |name: &str| counted[name].as_f64().expect("a number");
    0.5 + 0.01 * amount("steps") + 1e-3 * amount("pixel_samples") + 1e-8 * amount("facet_pairs")
}

/// Plans a reference of study-light.toml by a model, in shards of `lengths`, and returns their
/// predicted durations, s.
fn predicted(model: &str, lengths: &str) -> Vec<f64> {
    let reference = ["-q", "--reference", "model", "--samples", "8", "--size", "40x30"];
    let by = ["--model", model, "--shard-seconds", lengths, "--nodes", "1"];
    let farm = Farm::of("scenes/study-light.toml", &[&reference[..], &by].concat());
    let plan = farm.plan();
    let shards = plan["shards"].as_array().expect("shards").iter();
    let seconds = shards.map(|shard| {
        let predicted = shard["predicted_s"].as_f64().expect("seconds");
        let expected = seconds(&shard["counted"]);
        assert!((predicted / expected - 1.0).abs() < 1e-6, "{predicted} {expected}");
        predicted
    });
    seconds.collect()
}

#[test]
fn a_model_of_finished_shards_divides_the_next_plan() {
    let of = |samples| ["--reference", "model", "--samples", samples, "--shard-samples", "4"];
    let room = "scenes/study-light.toml";
    let farms = [
        Farm::of(room, &[&["-q", "--size", "6x4", "--tile", "2x4"], &of("1")[..]].concat()),
        Farm::of(room, &[&["-q", "--size", "20x15"], &of("4")[..]].concat()),
        Farm::of(
            "scenes/hello.toml",
            &[&["-q", "--size", "16x12", "--set", PLAIN, "--tile", "8x12"], &of("1")[..]].concat(),
        ),
    ];
    let model = farms[0].beside("model.json");
    let model = path_text(&model);
    let errors = fail(2, &["farm", "calibrate", "--farm", farms[0].path(), "-o", model]);
    assert!(errors.contains("no shard of these farms is done"), "{errors}");
    for farm in &farms {
        farm.local();
        // Durations by known coefficients in place of those of this machine.
        for shard in 0..n_shards(farm) {
            let taken = seconds(&farm.plan()["shards"][shard]["counted"]);
            farm.change_manifest(shard, |manifest| manifest["seconds"] = taken.into());
        }
    }
    let folders = farms.iter().flat_map(|farm| ["--farm", farm.path()]);
    let calibrate = ["farm", "calibrate", "-q", "-o", model];
    let out = succeed(&calibrate.into_iter().chain(folders).collect::<Vec<_>>());
    assert!(out.contains("6 runs of reference model"), "{out}");
    // Shards of a third of what the whole takes beside its set-up.
    let whole = predicted(model, "5000,9000");
    assert!(whole.len() == 1 && whole[0] > 0.5, "{whole:?}");
    let most = 0.5 + (whole[0] - 0.5) / 3.0;
    let cut = predicted(model, &format!("0,{most}"));
    assert!((3..=8).contains(&cut.len()) && cut.iter().all(|s| *s <= most), "{whole:?} {cut:?}");
    // The model holds for one kind of work.
    let out = farms[0].beside("out");
    let plan = ["farm", "plan", "scenes/hello.toml", "-o", path_text(&out), "--model", model];
    let errors = fail(2, &plan);
    let expected = "calibrated by reference model; expected one of frames";
    assert!(errors.contains(expected), "{errors}");
    let errors = fail(2, &[&plan[..], &["--set", PLAIN, "--reference", "thin"]].concat());
    assert!(errors.contains("expected one of reference thin"), "{errors}");
}
