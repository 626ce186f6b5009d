//! The program as a user runs it: what it prints, what it writes, and its exit codes.

mod bench;
use std::path::Path;
use std::process::Stdio;

use crate::signals;
use nimbus::frame::plan::Pass;

use assert_cmd::Command;
use serde_json::Value;
use sha2::{Digest, Sha256};

fn nimbus() -> Command {
    let mut command = Command::cargo_bin("nimbus").expect("the program is built");
    // Lines about progress come after a time, and a busy machine may need it.
    command.env("NIMBUS_PROGRESS_S", "0");
    command
}

/// Exit code, stdout, stderr.
fn run(args: &[&str]) -> (i32, String, String) {
    let output = nimbus().args(args).output().expect("the program runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("an exit code"), text(output.stdout), text(output.stderr))
}

fn path(dir: &tempfile::TempDir, name: &str) -> String {
    dir.path().join(name).to_str().expect("a UTF-8 path").to_owned()
}

fn temp() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

#[test]
fn render_writes_png_and_exr_without_a_validation_message() {
    let dir = temp();
    for name in ["a.png", "a.exr"] {
        let out = path(&dir, name);
        let (code, stdout, stderr) =
            run(&["render", "scenes/hello.toml", "-o", &out, "--validation"]);
        let wrote = format!("wrote {out}: 320 × 240 pixels\n");
        assert_eq!((code, stdout, stderr), (0, String::new(), wrote));
        let image = image::open(&out).expect("a picture");
        assert_eq!((image.width(), image.height()), (320, 240));
    }
    // The cloud is there: the EXR's alpha is 1 − transmittance.
    let alpha = image::open(path(&dir, "a.exr")).expect("a picture").to_rgba32f();
    let covered = alpha.pixels().filter(|p| p.0[3] > 0.5).count();
    assert!(covered > 2000 && alpha.pixels().any(|p| p.0[3] == 0.0), "{covered} pixels covered");
}

#[test]
fn driver_threads_and_a_second_run_change_no_byte() {
    let dir = temp();
    let mut pictures = Vec::new();
    for threads in ["0", "1", "2", "3", "3"] {
        let out = path(&dir, &format!("{}.exr", pictures.len()));
        let args = ["render", "scenes/cubes-554.toml", "--size", "200x150", "-o", &out];
        nimbus().args(args).env("LP_NUM_THREADS", threads).assert().success();
        pictures.push(std::fs::read(&out).expect("the picture"));
    }
    assert!(pictures.windows(2).all(|w| w[0] == w[1]));
    let out = path(&dir, "other.exr");
    nimbus()
        .args(["render", "scenes/cubes-554.toml", "--size", "200x150", "--seed", "8", "-o", &out])
        .assert()
        .success();
    assert_ne!(
        std::fs::read(&out).expect("the picture"),
        pictures[0],
        "another seed is another cloud"
    );
}

#[test]
fn an_existing_result_is_kept_unless_forced() {
    let dir = temp();
    let out = path(&dir, "kept.png");
    std::fs::write(&out, "mine").expect("a file");
    let (code, _, stderr) = run(&["render", "scenes/hello.toml", "-o", &out]);
    assert_eq!(code, 2);
    assert!(stderr.contains("kept.png") && stderr.contains("--force"), "{stderr}");
    assert_eq!(std::fs::read_to_string(&out).expect("the file"), "mine");
    assert_eq!(run(&["render", "scenes/hello.toml", "-o", &out, "--force"]).0, 0);
    assert!(image::open(&out).is_ok());
}

#[test]
fn bad_input_is_one_clear_message_and_nothing_written() {
    let dir = temp();
    let out = path(&dir, "never.png");
    for (args, expected) in [
        (&["scenes/hello.toml", "--set", "film.widht=3"][..], "film.widht"),
        (&["scenes/none.toml"], "scenes/none.toml"),
        (
            &["scenes/hello.toml", "--device", "no such device"],
            "expected an index or a part of a name",
        ),
        (&["scenes/hello.toml", "--shaders", "scenes"], "none of nimbus's shaders"),
        (
            &["scenes/hello.toml", "--device", ""],
            "expected an index or a part of a name; found: 0: ",
        ),
        (
            &["scenes/hello.toml", "--device", "4090"],
            "expected an index or a part of a name; found: 0: ",
        ),
        (&["scenes/hello.toml", "--set", "film.width=20000"], "film.width"),
        (
            &["scenes/hello.toml", "--size", "20000x10"],
            "'--size <WxH>': expected WIDTHxHEIGHT such as 800x600, each from 1",
        ),
        (&["scenes/hello.toml", "--time", "nan"], "finite"),
        (
            &["scenes/hello.toml", "--time", "1e300"],
            "time 1e300 s: expected a finite number from -1e15 to 1e15",
        ),
        (
            &["scenes/threads.toml", "--set", "cloud.0.wind=[1e9,0,0]", "--time", "1e12"],
            "carries a cloud's origin too far",
        ),
        (&["scenes/hello.toml", "--set", "camera.target=[0,0.55,6.2]"], "camera"),
    ] {
        let (code, stdout, stderr) = run(&[&["render", "-o", &out], args].concat());
        assert_eq!((code, stdout.as_str()), (2, ""), "{args:?}: {stderr}");
        assert!(stderr.starts_with("error: ") && stderr.contains(expected), "{args:?}: {stderr}");
        assert!(!Path::new(&out).exists());
    }
    let (code, _, stderr) = run(&["render", "scenes/hello.toml", "-o", &path(&dir, "a.jpg")]);
    assert!(code == 2 && stderr.contains(".png") && stderr.contains(".exr"), "{stderr}");
    assert_eq!(run(&["rendre"]).0, 2);
}

#[test]
fn a_thousand_million_particles_are_refused_by_the_limit_s_name() {
    let dir = temp();
    let boxes = "1000000000\n1\n1000000000, 1, 1, 1, 0, 0, 0, 2\n";
    std::fs::write(dir.path().join("huge.dat"), boxes).expect("a box file");
    let scene = "[[cloud]]\nfrom = \"boxes\"\nfile = \"huge.dat\"\n";
    std::fs::write(dir.path().join("huge.toml"), scene).expect("a scene");
    let (code, _, stderr) =
        run(&["render", &path(&dir, "huge.toml"), "-o", &path(&dir, "huge.png")]);
    assert_eq!(code, 2);
    assert!(stderr.contains("1000000000") && stderr.contains("maxStorageBufferRange"), "{stderr}");
}

#[test]
fn each_scene_has_a_folder_unless_it_is_faulty() {
    let dir = temp();
    let out = path(&dir, "runs");
    let short = ["--frames", "2", "--warmup", "0", "--repeat", "1", "--no-check", "--out", &out];
    let (code, _, stderr) =
        run(&[&["bench", "scenes/hello.toml", "scenes/absent.toml"], &short[..]].concat());
    assert!(code == 2 && stderr.contains("absent.toml"), "{stderr}");
    assert!(!Path::new(&out).exists(), "no folder for results that did not come");
    let (code, _, stderr) =
        run(&[&["bench", "scenes/hello.toml", "tests/data/modes.toml"], &short[..]].concat());
    let wrote = |name: &str| format!("wrote {out}/{name}: ");
    let is_said = |(line, name): (&str, &str)| line.starts_with(&wrote(name));
    assert!(code == 0 && stderr.lines().zip(["hello", "modes"]).all(is_said), "{stderr}");
    assert_eq!(stderr.lines().count(), 2);
    for name in ["hello", "modes"] {
        assert!(Path::new(&out).join(name).join("run.json").exists(), "{name}");
    }
}

#[test]
fn an_interrupted_render_ends_at_once_and_leaves_nothing() {
    let dir = temp();
    let out = path(&dir, "long.exr");
    // As many pixels as the software device takes: seconds to draw, most of a second to write.
    let args = ["render", "scenes/cubes-554.toml", "--size", "4000x4000", "-o", &out];
    let program = assert_cmd::cargo::cargo_bin("nimbus");
    let names = || std::fs::read_dir(dir.path()).expect("the folder").count();
    let interrupted = |is_begun: &dyn Fn() -> bool| {
        let mut command = std::process::Command::new(&program);
        command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped());
        let (output, _) = signals::interrupt(&mut command, |_| is_begun());
        if output.status.success() {
            return false;
        }
        assert_eq!(
            (output.status.code(), &output.stderr[..]),
            (Some(130), &b"error: interrupted\n"[..])
        );
        assert_eq!(names(), 0, "neither a picture nor a part of one");
        true
    };
    assert!(interrupted(&|| true));
    // While it writes: the first file to appear is the temporary one. On a busy machine the file
    // may be whole before the signal comes.
    let while_writing = |_| {
        let is_interrupted = interrupted(&|| names() > 0);
        let _ = std::fs::remove_file(&out);
        is_interrupted
    };
    assert!((0..10).any(while_writing));
}

#[test]
fn render_describes_the_picture() {
    let dir = temp();
    let out = path(&dir, "a.exr");
    let (code, json, stderr) =
        run(&["render", "scenes/hello.toml", "-o", &out, "--frame", "3", "--json"]);
    assert_eq!((code, stderr), (0, format!("wrote {out}: 320 × 240 pixels\n")));
    let json: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(
        (&json["file"], &json["width"], &json["height"]),
        (&out.as_str().into(), &320.into(), &240.into())
    );
    assert_eq!((&json["frame"], &json["not_finite"]), (&3.into(), &0.into()));
    assert!(json["time_s"].as_f64().is_some_and(|t| t > 0.0) && json["device"]["name"].is_string());
    let pixels = image::open(&out).expect("a picture").into_rgba32f();
    let bytes: Vec<u8> = pixels.as_raw().iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(json["image_hash"], format!("{:x}", Sha256::digest(bytes)));
    let passes = json["passes"].as_array().expect("a list");
    assert_eq!(passes.len(), Pass::ALL.len());
    assert!(
        passes
            .iter()
            .all(|p| p["name"].is_string() && p["reason"].is_string() && p["run"].is_boolean())
    );
    assert!(passes.iter().all(|p| p["ms"].is_null() || p["run"] == true));

    let (_, json, _) =
        run(&["render", "scenes/hello.toml", "-o", &out, "--force", "--time", "0.5", "--json"]);
    let json: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!((&json["frame"], &json["time_s"]), (&Value::Null, &0.5.into()));
}

#[test]
fn a_log_has_lines_about_progress_unless_they_are_not_wanted() {
    let dir = temp();
    let picture = path(&dir, "a.png");
    let small = ["--size", "32x24", "--set", "cloud.0.texture=none"];
    let bench = ["bench", "scenes/hello.toml", "--frames", "3", "--repeat", "2", "--warmup", "0"];
    let render =
        ["render", "scenes/hello.toml", "--reference", "volume", "-o", &picture, "--force"];
    for (args, line) in [
        ([&bench[..], &small].concat(), "progress: scenes/hello.toml: 1 of 18, about "),
        ([&render[..], &small].concat(), "progress: drawing: 1 of 24, about "),
    ] {
        let said = |step_s: &str, more: &[&str]| {
            let mut command = nimbus();
            command.args(&args).args(more).env("NIMBUS_PROGRESS_S", step_s);
            let output = command.output().expect("the program runs");
            assert!(output.status.success());
            String::from_utf8(output.stderr).expect("UTF-8")
        };
        let lines = said("1e-9", &[]);
        assert!(lines.lines().any(|l| l.starts_with(line) && l.ends_with(" left")), "{lines}");
        for (step_s, more) in [("0", &[][..]), ("3600", &[]), ("1e-9", &["-q"])] {
            let lines = said(step_s, more);
            assert!(!lines.contains("progress"), "{step_s}: {lines}");
        }
    }
}

#[test]
fn inspect_verbose_prints_more_on_stderr() {
    for more in [&[][..], &["--reference"]] {
        let (code, quiet, nothing) = run(&[&["inspect", "scenes/cubes-615.toml"], more].concat());
        assert_eq!((code, nothing.as_str()), (0, ""));
        let (_, stdout, stderr) =
            run(&[&["inspect", "scenes/cubes-615.toml", "-v"], more].concat());
        assert_eq!(stdout, quiet);
        assert!(stderr.contains("615 particles in 23 groups, film "), "{stderr}");
        assert_eq!(stderr.lines().count(), if more.is_empty() { 2 } else { 1 });
    }
}

#[test]
fn inspect_gives_device_and_reference_in_the_same_columns() {
    let (code, device, _) = run(&["inspect", "scenes/cubes-554.toml", "--particles"]);
    assert_eq!(code, 0);
    assert_eq!(device.lines().next(), Some("index,cloud,x,y,z,radius,sigma,kappa,r,g,b"));
    assert_eq!(device.lines().count(), 555);
    let (_, reference, _) =
        run(&["inspect", "scenes/cubes-554.toml", "--particles", "--reference"]);
    let number = |line: &str, column: usize| {
        line.split(',').nth(column).and_then(|t| t.parse::<f64>().ok()).expect("a number")
    };
    for (a, b) in device.lines().zip(reference.lines()).skip(1) {
        for column in 2..5 {
            // tests/passes/generate.rs has the derived bound; here: the columns mean the same.
            assert!((number(a, column) - number(b, column)).abs() < 1e-3, "{a}\n{b}");
        }
    }
    let (code, facets, _) = run(&["inspect", "scenes/hello.toml", "--facets"]);
    assert_eq!(code, 0);
    let header = "index,region,x,y,z,nx,ny,nz,area,id_r,id_g,id_b,ii_r,ii_g,ii_b,\
                  l1_r,l1_g,l1_b,l2_r,l2_g,l2_b";
    assert_eq!(facets.lines().next(), Some(header));
}

#[test]
fn inspect_prints_acceptance_per_box_and_the_plan() {
    let (code, boxes, _) = run(&["inspect", "scenes/cubes-615.toml"]);
    assert_eq!(code, 0);
    assert_eq!(boxes.lines().count(), 1 + 23 + 1);
    assert!(boxes.lines().next().is_some_and(|l| l.contains("acceptance") && l.contains("folded")));
    let (_, json, _) = run(&["inspect", "scenes/cubes-615.toml", "--boxes", "--json"]);
    let rows: Value = serde_json::from_str(&json).expect("JSON");
    assert!(rows[0]["acceptance"].as_f64().is_some_and(|a| a > 0.1 && a < 1.0));
    let (_, plan, _) = run(&["inspect", "scenes/cubes-615.toml", "--plan"]);
    assert!(plan.contains("skip") && plan.contains("the picture is the same"), "{plan}");
    let (_, plan, _) = run(&["inspect", "scenes/cubes-615.toml", "--plan", "--no-skip"]);
    assert!(!plan.contains("the picture is the same"), "{plan}");
}

#[test]
fn particles_without_size_receive_finite_light() {
    let dir = temp();
    std::fs::write(dir.path().join("a.dat"), "9\n1\n9, 1, 1, 1, 0, 0, 0, 0\n").expect("a box");
    let scene = path(&dir, "a.toml");
    std::fs::write(&scene, "[[cloud]]\nfrom = \"boxes\"\nfile = \"a.dat\"\n").expect("a scene");
    let (code, facets, _) = run(&["inspect", &scene, "--facets"]);
    assert_eq!((code, facets.lines().count()), (0, 1 + 9), "{facets}");
    assert!(!facets.contains("NaN") && !facets.contains("inf"), "{facets}");
}

#[test]
fn devices_lists_at_least_the_one_that_is_used() {
    let (code, json, _) = run(&["devices", "--json"]);
    assert_eq!(code, 0);
    let devices: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(devices.as_array().expect("a list").iter().filter(|d| d["used"] == true).count(), 1);
    let (code, table, _) = run(&["devices"]);
    assert!(code == 0 && table.contains("<- used"));
    let (code, validated, stderr) = run(&["devices", "--validation", "-q"]);
    assert_eq!((code, validated.as_str(), stderr.as_str()), (0, table.as_str(), ""));
    let (code, _, stderr) = run(&["devices", "-v"]);
    assert!(code == 0 && stderr.contains(" is used: "), "{stderr}");
    let (code, listed, stderr) = run(&["devices", "--device", ""]);
    assert!(code == 2 && listed.contains("0: ") && stderr.contains("found: 0: "), "{stderr}");
}

#[test]
fn help_lists_commands_and_exit_codes() {
    let (code, help, _) = run(&["--help"]);
    assert_eq!(code, 0);
    for word in
        ["render", "bench", "compare", "inspect", "devices", "Exit codes", "scenes/hello.toml"]
    {
        assert!(help.contains(word), "{word}");
    }
}
