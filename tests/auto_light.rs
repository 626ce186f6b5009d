//! Auto light: a budget of time or error takes a setting of the list. A scene that names the setting
//! draws the same picture. nimbus tells the choice, and keeps it with the results.

mod harness;

use std::path::Path;
use std::process::Command;

use nimbus::frame::{DeviceChoice, LightChoice, Stage};
use nimbus::io::scene_file;
use nimbus::model::scene::{LightingMode, Overlap, RUNGS, Scene};

const SCENE: &str = "[film]\nwidth = 64\nheight = 48\n[camera]\nposition = [0.0, 0.0, 6.0]\n\
    [lighting]\nmode = 'auto'\n[[light]]\nkind = 'directional'\ndirection = [-0.5, -0.8, -0.3]\n\
    irradiance = [3, 2.9, 2.7]\n[[material]]\nname = 'm'\nkd = [0.9, 0.9, 0.9]\n[[cloud]]\n\
    from = 'boxes'\nfile = 'boxes.dat'\nmaterial = 'm'\noptical_depth = 1\n";
const BOXES: &str = "80\n1\n80, 2, 1, 1, 0, 0, 0, 0.6\n";

fn written(dir: &Path) -> std::path::PathBuf {
    let file = dir.join("scene.toml");
    std::fs::write(&file, SCENE).expect("room");
    std::fs::write(dir.join("boxes.dat"), BOXES).expect("room");
    file
}

fn scene(overrides: &[&str]) -> Scene {
    let dir = tempfile::tempdir().expect("a folder");
    let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
    let loaded = scene_file::load(&written(dir.path()), &overrides, None);
    loaded.unwrap_or_else(|e| panic!("{e}")).scene
}

/// Draws the first frame: what was taken, the scene as it was drawn, and the picture.
fn drawn(scene: Scene) -> (Option<LightChoice>, Scene, Vec<u8>) {
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    let mut stage = Stage::new(scene, &choice, true).expect("a stage");
    stage.renderer.step(stage.game.step(0).expect("a packet")).expect("a frame");
    let (bytes, of) = (stage.renderer.image_bytes().expect("bytes"), Scene::clone(&stage.scene));
    let taken = stage.light_choice.take();
    stage.close().expect("no message");
    (taken, of, bytes)
}

/// Checks that what was taken is drawn as where the scene names it.
fn check(asked: &Scene) -> LightChoice {
    let (taken, as_drawn, bytes) = drawn(asked.clone());
    let taken = taken.expect("a choice");
    println!("{}", taken.text());
    let named = asked.on(&RUNGS[taken.taken]);
    assert_eq!(as_drawn, named.exact().into_owned());
    let (none, _, other) = drawn(named);
    assert!(none.is_none() && bytes == other, "another picture");
    taken
}

#[test]
fn the_fastest_of_those_near_enough_is_taken() {
    for most in [RUNGS[1].errors[0], RUNGS[3].errors[0]] {
        let asked = scene(&[&format!("lighting.budget_error={most}")]);
        let choice = check(&asked);
        assert!(choice.errors[choice.taken] <= most && choice.first_ms.is_none());
        let times = choice.times_ms.iter().zip(&choice.errors);
        let least = times.filter(|(_, e)| **e <= most).filter_map(|(ms, _)| *ms);
        assert_eq!(choice.times_ms[choice.taken], least.min_by(f64::total_cmp));
        // Rungs that err more are not even timed.
        let is_left_out = |i: usize| choice.errors[i] > most && choice.times_ms[i].is_none();
        assert!((0..RUNGS.len()).all(|i| choice.errors[i] <= most || is_left_out(i)));
    }
}

#[test]
fn the_nearest_in_time_is_taken() {
    let any = check(&scene(&["lighting.budget_ms=1e6"]));
    assert!(any.errors.iter().all(|error| any.errors[any.taken] <= *error));
    assert!(any.times_ms.iter().all(|ms| ms.is_some_and(|ms| ms > 0.0)));
    // A time that none has: the first one, which is not near enough to time another.
    let none = check(&scene(&["lighting.budget_ms=1e-6"]));
    assert_eq!((none.taken, none.times_ms[1]), (0, None));
    // Slices where the drawing leaves it free.
    let free = check(&scene(&["lighting.budget_ms=1e6", "draw.overlap='auto'"]));
    assert_eq!(free.taken, RUNGS.len() - 1);
    assert_eq!(free.errors[free.taken], RUNGS[free.taken].errors[1]);
}

#[test]
fn without_a_budget_light_takes_no_longer_than_the_first_reflection() {
    let choice = check(&scene(&[]));
    let (first, taken) = (choice.first_ms.expect("a time"), choice.times_ms[choice.taken]);
    let is_fastest = choice.times_ms.iter().flatten().all(|ms| taken.is_some_and(|t| t <= *ms));
    assert!(taken.is_some_and(|ms| ms <= first) || is_fastest, "{choice:?}");
}

#[test]
fn what_no_device_draws_has_the_nearest_light() {
    let asked = scene(&["draw.overlap='auto'"]);
    let exact = asked.exact();
    let last = RUNGS[RUNGS.len() - 1];
    assert_eq!((exact.lighting.mode, exact.lighting.grid), (LightingMode::Diffusion, last.grid));
    assert_eq!((exact.lighting.diffusion.bounces, exact.draw.overlap), (2, Overlap::Slices));
    // Nothing to light: nothing is timed or told.
    let empty = Scene { clouds: vec![], ..asked };
    let (choice, as_drawn, _) = drawn(empty.clone());
    assert!(choice.is_none() && as_drawn == empty.exact().into_owned());
}

#[test]
fn the_command_line_gives_a_budget_that_is_told_and_kept() {
    let dir = tempfile::tempdir().expect("a folder");
    let (file, out) = (written(dir.path()), dir.path().join("run"));
    let run = |arguments: &[&str]| {
        let done = Command::new(env!("CARGO_BIN_EXE_nimbus"))
            .args(arguments)
            .output()
            .expect("the program runs");
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(done.status.success(), "{said}");
        said
    };
    let (file, out) = (file.to_str().expect("a path"), out.to_str().expect("a path"));
    let picture = format!("{out}.png");
    let said = run(&["render", file, "--budget-error", "0.3", "-o", &picture]);
    let told = "note: lighting.mode = \"auto\" took \"diffusion\"";
    assert!(said.contains(told) && said.contains("lighting.budget_error 0.3"), "{said}");
    // A setting replaces what the budget asks for.
    let more = ["--set", "lighting.mode='first'", "--force"];
    let said = run(&[&["render", file, "--budget-ms", "5", "-o", &picture][..], &more].concat());
    assert!(!said.contains("took"), "{said}");
    let few = ["--frames", "4", "--warmup", "1", "--repeat", "2"];
    run(&[&["bench", file, "--budget-ms", "1e6", "--out", out][..], &few].concat());
    let kept = std::fs::read_to_string(Path::new(out).join("run.json")).expect("run.json");
    let kept: serde_json::Value = serde_json::from_str(&kept).expect("JSON");
    let chosen = kept["chosen"].as_array().expect("a list");
    let of_light = |s: &&serde_json::Value| s.as_str().is_some_and(|s| s.contains("lighting.mode"));
    // Once for the case, and not again for each block.
    assert_eq!(chosen.iter().filter(of_light).count(), 1, "{chosen:?}");
}
