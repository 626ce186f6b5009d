//! `nimbus farm` with frames: the merged frames are those that `nimbus render` draws, to the byte,
//! and broken results and stale plans are refused.

use std::fs;
use std::path::Path;

use crate::farm::{Farm, content, fail, names, outcome, path_text, ran, sha256, succeed};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/flyby.toml");
const SIZE: &str = "48x36";

/// Plans frames of the fly-by, so many a shard.
fn planned(frames: &str, shard_frames: &str) -> Farm {
    Farm::of(SCENE, &["--frames", frames, "--shard-frames", shard_frames, "--size", SIZE])
}

fn frame(i: u32) -> String {
    format!("frame-{i:08}.png")
}

/// The picture of a frame by `nimbus render`.
fn rendered(farm: &Farm, scene: &str, i: u32) -> Vec<u8> {
    let (out, number) = (farm.beside(&format!("drawn-{i}.png")), i.to_string());
    succeed(&["render", scene, "--frame", &number, "-o", path_text(&out), "-q", "--size", SIZE]);
    fs::read(out).expect("a picture")
}

/// Copies hello.toml, with `more` at its end, to a folder.
fn copied_scene(folder: &Path, more: &str) -> String {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let text = fs::read_to_string(scenes.join("hello.toml")).expect("a scene");
    fs::write(folder.join("hello.toml"), text + more).expect("room");
    fs::copy(scenes.join("hello.csv"), folder.join("hello.csv")).expect("room");
    path_text(&folder.join("hello.toml")).to_owned()
}

#[test]
fn merged_frames_are_those_of_render() {
    let farm = planned("5..19", "4");
    assert_eq!(farm.plan()["shards"].as_array().map(Vec::len), Some(4));
    assert_eq!(farm.missing(), "0-3");
    let out = succeed(&["farm", "local", "--plan", farm.path(), "--jobs", "2"]);
    assert!(out.starts_with("4 shards are done, 4 of them now"), "{out}");
    assert_eq!(farm.missing(), "");
    assert_eq!(farm.merge().0, Some(0));
    let list = "frames.sha256".to_owned();
    assert_eq!(names(&farm.merged()), (5..19).map(frame).chain([list]).collect::<Vec<_>>());
    for i in [5, 8, 9, 18] {
        let merged = fs::read(farm.merged().join(frame(i))).expect("a frame");
        assert!(merged == rendered(&farm, SCENE, i), "frame {i}");
    }
    // A second time nothing is done, and no merged result is replaced.
    let out = farm.local();
    assert!(out.contains("4 shards are done, 0 of them now"), "{out}");
    let (code, _, errors) = farm.merge();
    assert!(code == Some(2) && errors.contains("--force"), "{errors}");
}

#[test]
fn shards_span_the_phases_of_a_scene() {
    let dir = tempfile::tempdir().expect("a folder");
    let phases = "\n[[phase]]\nname = \"a\"\nframes = 2\n\n[[phase]]\nname = \"b\"\nframes = \
        2\nset = { lighting.mode = \"none\" }\n";
    let scene = copied_scene(dir.path(), phases);
    let farm = Farm::of(&scene, &["--shard-frames", "3", "--size", SIZE]);
    farm.local();
    assert_eq!(farm.merge().0, Some(0));
    let frames: Vec<Vec<u8>> =
        (0..4).map(|i| fs::read(farm.merged().join(frame(i))).expect("a frame")).collect();
    for (i, frame) in (0..).zip(&frames) {
        assert!(*frame == rendered(&farm, &scene, i), "frame {i}");
    }
    assert!(frames[1] != frames[2], "the phases differ");
}

#[test]
fn broken_results_are_refused_and_made_again() {
    let farm = planned("0..3", "3");
    assert_eq!(farm.run(0).0, Some(0));
    let good = content(&farm.place(0));
    let at = |name: &str| farm.place(0).join(name);
    let whole = fs::read(at(&frame(1))).expect("a frame");
    let swapped = fs::read(at(&frame(2))).expect("a frame");
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 4;
    let truncated = whole[..whole.len() - 7].to_vec();
    for (n, (name, bytes)) in [
        (frame(1), Some(truncated)),
        (frame(1), Some(vec![])),
        (frame(1), Some(flipped)),
        (frame(1), Some(swapped)),
        (frame(1), None),
        ("shard.json".to_owned(), Some(vec![])),
        ("shard.json".to_owned(), Some(b"{".to_vec())),
        ("shard.json".to_owned(), None),
    ]
    .into_iter()
    .enumerate()
    {
        match bytes {
            Some(bytes) => fs::write(at(&name), bytes).expect("room"),
            None => fs::remove_file(at(&name)).expect("a file"),
        }
        assert_eq!(farm.state(0), "broken", "{n} {name}");
        let (code, _, errors) = farm.merge();
        assert!(code == Some(1) && errors.contains(&name), "{n} {errors}");
        assert!(!farm.merged().exists());
        let (code, out, errors) = farm.run(0);
        assert!(code == Some(0) && out.contains("done in"), "{n} {out}{errors}");
        assert_eq!((farm.state(0).as_str(), farm.leftovers(0, "bad").len()), ("done", n + 1));
        assert!(content(&farm.place(0))[..3] == good[..3], "{n}");
    }
    // A hash that has no eight bytes to print at a border of characters.
    let manifest = fs::read_to_string(at("shard.json")).expect("a manifest");
    fs::write(at("shard.json"), manifest.replace(&sha256(&whole), "aéééééé")).expect("room");
    assert!(farm.state(0) == "broken" && farm.run(0).0 == Some(0) && farm.state(0) == "done");
    // A file in place of the folder.
    fs::remove_dir_all(farm.place(0)).expect("a result");
    fs::write(farm.place(0), b"no folder").expect("room");
    assert!(farm.state(0) == "broken" && farm.run(0).0 == Some(0) && farm.state(0) == "done");
    succeed(&["farm", "gc", "--plan", farm.path(), "--all"]);
    assert!(farm.leftovers(0, "bad").is_empty() && farm.state(0) == "done");
}

#[test]
fn permanent_failures_have_exit_code_2() {
    let farm = planned("0..1", "1");
    let output = farm.command(0).args(["--device", "no such device"]).output().expect("it runs");
    let (code, _, errors) = outcome(&output);
    assert!(code == Some(2) && errors.contains("no such device"), "{errors}");
    assert_eq!((farm.state(0).as_str(), farm.run(0).0), ("failed", Some(0)));
    // No device is opened for a shard that is done.
    let output = farm.command(0).args(["--device", "no such device"]).output().expect("it runs");
    assert_eq!(output.status.code(), Some(0));
    let (code, _, errors) = farm.run(1);
    assert!(code == Some(2) && errors.contains("expected 0 to 0"), "{errors}");
    let errors = fail(2, &["farm", "run", "--plan", "/nowhere", "--shard", "0"]);
    assert!(errors.contains("plan.json"), "{errors}");
}

#[test]
fn a_stale_plan_is_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let scene = copied_scene(dir.path(), "");
    let farm = Farm::of(&scene, &["--frames", "2", "--size", SIZE]);
    let text = fs::read_to_string(&scene).expect("a scene");
    let changed = text.replace("[film]", "[film]\nexposure = 0.5");
    fs::write(&scene, &changed).expect("room");
    let (code, _, errors) = farm.run(0);
    assert!(code == Some(2) && errors.contains("stale"), "{errors}");
    assert!(errors.contains("has changed since"), "{errors}");
    // The status tells it later.
    assert_eq!(farm.state(0), "failed");
    let what = farm.status()["shards"][0]["what"].to_string();
    assert!(what.contains("has changed since"), "{what}");
    let errors = fail(2, &["farm", "local", "--plan", farm.path()]);
    assert!(errors.contains("stale"), "{errors}");
    fs::write(&scene, text).expect("room");
    // With the code of another build the keys are wrong.
    let path = farm.folder.join("plan.json");
    let plan = fs::read_to_string(&path).expect("a plan");
    let code_of = farm.plan()["code"].as_str().expect("a digest").to_owned();
    fs::write(&path, plan.replace(&code_of, "0123456789abcdef")).expect("room");
    let (code, _, errors) = farm.run(0);
    assert!(code == Some(2) && errors.contains("key"), "{errors}");
    fs::write(&path, plan).expect("room");
    assert_eq!(farm.run(0).0, Some(0));
    // A stale plan is refused for shards that are done, too.
    fs::write(&scene, changed).expect("room");
    let (code, _, errors) = ran(&["farm", "run", "--plan", farm.path(), "--shard", "0"]);
    assert!(code == Some(2) && errors.contains("stale"), "{errors}");
}
