//! A bench of a scene in which nothing moves, and pictures in which nothing can be seen.

use proptest::prelude::*;
use serde_json::Value;

use crate::generated;
use crate::program::run;

/// A scene without its texture, which would take most of the time.
const SCENE: [&str; 5] =
    ["scenes/hello.toml", "--size", "32x24", "--set", "cloud.0.texture=\"none\""];

fn bench(more: &[&str]) -> (String, String) {
    let output = run(&[&["bench"], &SCENE[..], more].concat());
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    (stdout, stderr)
}

/// Whatever is drawn, in however many frames and loops: a bench of a scene that stands still
/// has the loop without skipping as its figure, and its frames drew something.
#[test]
fn the_figure_of_a_still_scene_is_the_loop_without_skipping() {
    let threadings = prop::sample::select(vec!["serial", "parallel", "both"]);
    let paths = prop::sample::select(vec!["sprites", "tiles"]);
    let flags = (any::<bool>(), any::<bool>());
    let settings = (2.0f64..4.0, 3u32..6, 0u32..2, threadings, flags, paths);
    generated::check(6, settings, |(cutoff, frames, warm_up, threading, flags, path)| {
        let (is_saved, is_swept) = flags;
        let set = format!("draw.cutoff={cutoff}");
        let sweep = format!("draw.path={path},auto");
        let [frames, warm_up] = [frames, warm_up].map(|n| n.to_string());
        let mut args = vec![
            "--set",
            &set,
            "--frames",
            &frames,
            "--warmup",
            &warm_up,
            "--threading",
            threading,
            "--repeat",
            "1",
        ];
        if !is_saved {
            args.push("--no-saved");
        }
        if is_swept {
            args.extend(["--sweep", &sweep]);
        }
        let (json, _) = bench(&[&args[..], &["--json"]].concat());
        let found: Value = serde_json::from_str(&json).expect("JSON");
        for case in found["cases"].as_array().expect("cases") {
            let figure = case["figure"].as_str().expect("a figure");
            prop_assert!(figure.ends_with(" no-skip"), "{}", figure);
            let modes = case["modes"].as_array().expect("modes");
            let whole = modes.iter().find(|m| m["skip"] == false).expect("a loop");
            prop_assert_eq!(&whole["empty_frames"], 0);
            for mode in modes.iter().filter(|m| m["skip"] == true) {
                let [n, n_empty] = ["frames", "empty_frames"].map(|key| mode[key].as_u64());
                prop_assert!(2 * n_empty.expect("a count") >= n.expect("a count"));
            }
        }
        let (text, _) = bench(&args);
        let place = |word: &str| text.find(word).unwrap_or_else(|| panic!("no {word}: {text}"));
        prop_assert!(place("NOTHING MOVES") < place("p50"), "{}", text);
        Ok(())
    });
}

/// With anything that moves, the first loop is the figure.
#[test]
fn a_moving_scene_has_its_first_loop_as_the_figure() {
    let settings = prop::sample::select(vec![
        "cloud.0.wind=[1,0,0]",
        "cloud.0.gust=0.3",
        "cloud.0.grow_to=2",
        "camera={ path = [{ time_s = 0, position = [0,0,6], target = [0,0,0] }, \
         { time_s = 1, position = [1,0,6], target = [0,0,0] }] }",
    ]);
    let flags = prop::sample::select(vec!["--no-saved", "--no-skip", "--quiet"]);
    generated::check(6, (settings, flags), |(set, more)| {
        let args = ["--set", set, "--frames", "3", "--repeat", "1", "--warmup", "1", more];
        let (json, _) = bench(&[&args[..], &["--json"]].concat());
        let found: Value = serde_json::from_str(&json).expect("JSON");
        let name = if more == "--no-skip" { "serial no-skip" } else { "serial" };
        prop_assert_eq!(&found["cases"][0]["figure"], name);
        let (text, _) = bench(&args);
        prop_assert!(!text.contains("NOTHING MOVES"), "{}", text);
        Ok(())
    });
}

#[test]
fn a_dash_has_its_reason() {
    let (text, _) =
        bench(&["--set", "cloud.0.wind=[1,0,0]", "--frames", "2", "--repeat", "1", "--no-saved"]);
    assert!(text.contains("an interval needs 30 timed frames of a loop, found 2"), "{text}");
    assert!(text.contains("saved: - : the loop without skipping was not timed"), "{text}");
}

#[test]
fn a_picture_that_shows_nothing_warns_with_the_reason() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("a.png");
    let out = out.to_str().expect("UTF-8");
    let study = ["--pixels", "64", "--rounds", "2", "--frames", "1", "--knob", "draw.cutoff=2"];
    for (set, reason) in [
        ("camera.target=[0,0.55,12]", Some("the camera looks away")),
        ("camera.target=[20,0.55,6]", Some("the camera looks past the scene")),
        ("cloud.0.position=[0,0,99]", Some("the camera looks away")),
        ("film.exposure=1", None),
    ] {
        let commands: [&[&str]; 3] = [
            &["render", "-o", out, "--force"],
            &["bench", "--frames", "2", "--warmup", "0", "--repeat", "1"],
            &[&["error"], &study[..]].concat(),
        ];
        for command in commands {
            let args = [&command[..1], &SCENE[..], &["--set", set], &command[1..]].concat();
            let output = run(&args);
            let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(0), "{args:?}: {stderr}");
            match reason {
                Some(reason) => assert!(
                    stderr.contains("warning: nothing can be seen") && stderr.contains(reason),
                    "{args:?}: {stderr}"
                ),
                None => assert!(!stderr.contains("nothing can be seen"), "{args:?}: {stderr}"),
            }
        }
        let output =
            run(&[&["render", "-q", "-o", out, "--force"], &SCENE[..], &["--set", set]].concat());
        assert!(output.stderr.is_empty(), "-q");
    }
}
