//! Random paths are kept between runs: after Ctrl-C, after a kill, and where a reference is asked
//! for again with a smaller error. A run that goes on from them has the bytes of a run that was
//! never ended.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use crate::program::{nimbus, path};
use crate::signals;
use nimbus::io::scene_file;
use nimbus::model::scene::Scene;
use nimbus::reference::picture::{
    Enough, Grown, Pixels, ReferenceKind, ReferenceRequest, SampleSums, sums, sums_until,
};
use nimbus::studies::kept_paths::{KeptPaths, OnDisk, PathSums};
use serde_json::Value;

/// More paths than any run of these tests traces.
const ENDLESS: &str = "1000000";

fn temp() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// A picture by paths, which are kept in the folder `cache` of `dir`.
fn render(dir: &tempfile::TempDir, cache: &str, more: &[&str]) -> Command {
    let out = path(dir, &format!("{cache}.exr"));
    let scene = ["render", "scenes/study-both.toml", "--size", "40x30", "--reference", "transport"];
    let mut command =
        nimbus(&[&scene[..], &["--json", "--force", "-o", &out, "--samples"], more].concat());
    command.env("NIMBUS_CACHE_DIR", dir.path().join(cache));
    command
}

/// Draws to the end, and returns the JSON and the picture's bytes.
fn drawn(dir: &tempfile::TempDir, cache: &str, more: &[&str]) -> (Value, Vec<u8>) {
    let output = render(dir, cache, more).output().expect("the program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json = serde_json::from_slice(&output.stdout).expect("JSON");
    (json, fs::read(dir.path().join(format!("{cache}.exr"))).expect("a picture"))
}

/// The files of paths in the folder `cache` of `dir`.
fn files(dir: &tempfile::TempDir, cache: &str) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(dir.path().join(cache).join("references")) else {
        return Vec::new();
    };
    let all = entries.map(|entry| entry.expect("an entry").path());
    all.filter(|path| path.extension().is_some_and(|e| e == "paths")).collect()
}

/// Goes on from `n_kept` paths in the folder `cache`, and compares with a run that did not.
fn goes_on(dir: &tempfile::TempDir, cache: &str, n_kept: u32, more: &[&str]) {
    let n = (n_kept + 3).to_string();
    let (json, picture) = drawn(dir, cache, &[&[n.as_str()], more].concat());
    assert_eq!((&json["samples"], &json["samples_kept"]), (&(n_kept + 3).into(), &n_kept.into()));
    let (json, at_once) = drawn(dir, "none", &[&[n.as_str()], more].concat());
    assert_eq!(json["samples_kept"], 0);
    assert!(picture == at_once, "another picture");
    // Fewer paths than are kept have the picture that they have alone, and take nothing away.
    let (json, few) = drawn(dir, cache, &[&["2"], more].concat());
    assert_eq!(json["samples_kept"], 0);
    assert!(few == drawn(dir, "few", &[&["2"], more].concat()).1 && few != picture);
    let (json, again) = drawn(dir, cache, &[&[n.as_str()], more].concat());
    assert_eq!(json["samples_kept"], n_kept + 3);
    assert!(again == picture);
}

#[test]
fn ctrl_c_keeps_the_finished_paths() {
    for more in [&[][..], &["--layers"]] {
        let dir = temp();
        let mut command = render(&dir, "cache", &[&[ENDLESS], more].concat());
        // After a second or more of paths.
        let (output, was_running) = signals::interrupt(&mut command, |used_s| used_s > 3.0);
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(was_running && output.status.code() == Some(130), "{text}");
        let line = text.lines().find(|line| line.contains("paths a pixel are kept"));
        let n_kept = line.and_then(|line| line.split(' ').next()?.parse().ok()).expect(&text);
        assert!(n_kept > 0, "{text}");
        assert!(!dir.path().join("cache.exr").exists());
        goes_on(&dir, "cache", n_kept, more);
    }
}

#[test]
fn a_kill_loses_the_last_seconds_alone() {
    let dir = temp();
    let mut child = render(&dir, "cache", &[ENDLESS]).spawn().expect("a child");
    let begin = Instant::now();
    while files(&dir, "cache").is_empty() {
        assert!(begin.elapsed() < Duration::from_secs(300), "it never writes");
        std::thread::sleep(Duration::from_millis(10));
    }
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    let head = fs::read(&files(&dir, "cache")[0]).expect("a file");
    let head: Value = serde_json::from_slice(head.split(|b| *b == b'\n').next().expect("a line"))
        .expect("a head");
    let parts = head["parts"].as_array().expect("parts");
    let n_kept = parts.iter().map(|n| n.as_u64().expect("a number")).sum::<u64>();
    goes_on(&dir, "cache", u32::try_from(n_kept).expect("a number"), &[]);
}

#[test]
fn a_smaller_error_goes_on_from_the_paths_of_a_greater_one() {
    let dir = temp();
    let out = path(&dir, "study");
    let study = |error: &str| {
        let scene = ["error", "scenes/study-cloud.toml", "--size", "40x30", "--json", "--force"];
        let about = ["--against", "transport", "--knob", "draw.cutoff=3", "--rounds", "1"];
        let all = [&scene[..], &about, &["--out", &out, "--reference-error", error]].concat();
        let output = nimbus(&all)
            .env("NIMBUS_CACHE_DIR", dir.path().join("cache"))
            .output()
            .expect("the program runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let reference = &json["reference"];
        let share = |name: &str| reference[name].as_f64().expect("a number");
        assert!(share("own_error") <= error.parse::<f64>().expect("a number") * share("magnitude"));
        let text = |name: &str| reference[name].to_string();
        (text("accuracy"), text("from_cache"), text("hash"))
    };
    let [coarse, again, fine, last] = ["0.4", "0.4", "0.15", "0.4"].map(study);
    assert!(coarse.1 == "false" && again.1 == "true" && fine.1 == "false" && last.1 == "true");
    assert_eq!(coarse.0, again.0);
    // The finer one goes on; who asks for the coarse one gets it, whatever others have added.
    assert!(fine.0 != coarse.0 && fine.2 != coarse.2, "{coarse:?} {fine:?}");
    assert!(again == last && (&last.0, &last.2) == (&coarse.0, &coarse.2), "{coarse:?} {last:?}");
}

/// The scene of the tests of files, and some of its pixels.
fn scene() -> (Scene, Pixels) {
    let loaded =
        scene_file::load(Path::new("scenes/study-cloud.toml"), &[], None).expect("a scene");
    let pixels = Pixels::sample(64, 48, 12);
    let mut scene = loaded.scene;
    (scene.film.width, scene.film.height) = (64, 48);
    (scene, pixels)
}

/// Adds paths to those in `folder` until there are `n`; returns how many there were, and the sums.
fn grown(folder: &Path, n: u32) -> (u32, SampleSums) {
    let (scene, pixels) = scene();
    let request = ReferenceRequest { kind: ReferenceKind::Transport, scene: &scene, time_s: 0.0 };
    let kept = KeptPaths::open(Some(folder), &request, &pixels, PathSums::Spread, Some(n));
    let kept = kept.expect("a frame");
    let enough = Enough { least: n, most: n, is_enough: &|_| false };
    let add = |grown: &Grown<'_>| sums_until(&request, &pixels, false, &enough, grown);
    let found = kept.grow(&AtomicBool::new(false), &|_, _| (), add).expect("sums");
    (kept.n_before(), found)
}

/// The sums of `n` paths that nothing was kept of.
fn at_once(n: u32) -> SampleSums {
    let (scene, pixels) = scene();
    let request = ReferenceRequest { kind: ReferenceKind::Transport, scene: &scene, time_s: 0.0 };
    sums(&request, &pixels, 0..n, &AtomicBool::new(false), &|_, _| ()).expect("sums")
}

#[test]
fn damaged_files_are_made_anew() {
    let dir = temp();
    let folder = dir.path();
    let mut n_before = 0;
    for n in [1, 2, 7, 12, 13, 40] {
        assert_eq!(grown(folder, n), (n_before, at_once(n)), "{n}");
        n_before = n;
    }
    let file = fs::read_dir(folder).expect("a folder").next().expect("a file");
    let file = file.expect("a file").path();
    let whole = fs::read(&file).expect("bytes");
    let head = whole.iter().position(|b| *b == b'\n').expect("a head");
    let text = String::from_utf8(whole[..head].to_vec()).expect("UTF-8");
    assert!(text.contains("\"parts\":[32,8]"), "{text}");
    let with_head =
        |from: &str, to: &str| [text.replace(from, to).as_bytes(), &whole[head..]].concat();
    let mut flipped = whole.clone();
    flipped[head + 9] ^= 1;
    for damaged in [
        flipped,
        whole[..whole.len() - 8].to_vec(),
        whole[..head].to_vec(),
        Vec::new(),
        with_head("[32,8]", "[32,7]"),
        [&whole[..], &[0]].concat(),
        with_head("[32,8]", "[32,4]"),
        with_head("[32,8]", "[8,32]"),
        with_head("[32,8]", "[32,8,4]"),
        with_head("[32,8]", "[]"),
        with_head("\"hash\":\"", "\"hash\":\"0"),
    ] {
        fs::write(&file, &damaged).expect("written");
        assert_eq!(grown(folder, 41), (0, at_once(41)));
        assert_eq!(grown(folder, 42).0, 41);
    }
    // Another scene, pixels or kind of sums has another file. Settings that no path depends on
    // have the same.
    let (scene, pixels) = scene();
    let open = |scene: &Scene, pixels: &Pixels, of: PathSums| {
        let request = ReferenceRequest { kind: ReferenceKind::Transport, scene, time_s: 0.0 };
        KeptPaths::open(Some(folder), &request, pixels, of, None).expect("a frame").n_before()
    };
    let with = |change: fn(&mut Scene)| {
        let mut other = scene.clone();
        change(&mut other);
        open(&other, &pixels, PathSums::Spread)
    };
    assert_eq!(open(&scene, &pixels, PathSums::Spread), 42);
    assert_eq!(with(|s| s.lighting.grid = 32), 42);
    assert_eq!(with(|s| s.time.n_frames += 1), 42);
    assert_eq!(with(|s| s.film.exposure = 2.0), 42);
    assert_eq!(with(|s| s.lighting.forward = 0.5), 0);
    assert_eq!(with(|s| s.clouds[0].seed += 1), 0);
    assert_eq!(with(|s| s.camera.fov_y_rad *= 1.01), 0);
    assert_eq!(open(&scene, &Pixels::sample(64, 48, 200), PathSums::Spread), 0);
    assert_eq!(open(&scene, &pixels, PathSums::Centers), 0);
    assert_eq!(open(&scene, &pixels, PathSums::Layers), 0);
}

/// Two runs at once: the one with fewer paths takes nothing from the other.
#[test]
fn the_run_with_more_paths_stays() {
    let dir = temp();
    let (scene, pixels) = scene();
    let request = ReferenceRequest { kind: ReferenceKind::Transport, scene: &scene, time_s: 0.0 };
    let open = || {
        KeptPaths::open(Some(dir.path()), &request, &pixels, PathSums::Spread, None)
            .expect("a frame")
    };
    let add = |kept: &KeptPaths, n: u32| {
        let enough = Enough { least: n, most: n, is_enough: &|_| false };
        kept.grow(&AtomicBool::new(false), &|_, _| (), |grown| {
            sums_until(&request, &pixels, false, &enough, grown).expect("sums")
        })
    };
    let (few, many) = (open(), open());
    assert_eq!(few.keep(), OnDisk::Nothing);
    add(&many, 9);
    assert_eq!(many.keep(), OnDisk::These(9));
    add(&few, 3);
    assert_eq!(few.keep(), OnDisk::Others(9));
    drop(few);
    assert_eq!(open().n_before(), 9);
}
