//! `[[phase]]` sections and `--sweep`: parts of a run with settings of their own, from the scene
//! file to the results.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use nimbus::io::scene_file::{LoadedScene, load};
use nimbus::model::scene::{LightingMode, Threading};
use nimbus::timing::json;
use nimbus::timing::records::Run;
use nimbus::timing::results::read_results;
use serde_json::{Value, json};

const SCENE: &str = r#"
[film]
width = 64
height = 48

[lighting]
mode = "first"
grid = 16

[camera]
path = [
    { time_s = 0.0, position = [0, 0, 18], target = [0, 0, 0] },
    { time_s = 3.0, position = [9, 0, 15], target = [0, 0, 0] },
]

[time]
step_s = 0.1

[[cloud]]
from = "particles"
file = "points.csv"

[[phase]]
name = "lit"
frames = 4

[[phase]]
name = "unlit and small"
frames = 3
set.lighting.mode = "none"
set.film = { width = 32, height = 24 }
set.cloud.0.position = [1, 0, 0]

[[phase]]
name = "alone"
frames = 5
set."threads.mode" = "serial"
"#;

fn temp(scene: &str) -> (tempfile::TempDir, String) {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("scene.toml");
    fs::write(&path, scene).expect("the scene");
    fs::write(dir.path().join("points.csv"), "x,y,z,radius,kappa\n0,0,0,3,1\n2,1,0,2,1\n")
        .expect("points");
    (dir, path.display().to_string())
}

fn loaded(scene: &str, overrides: &[&str]) -> nimbus::error::Result<LoadedScene> {
    let (_dir, path) = temp(scene);
    load(Path::new(&path), &overrides.iter().map(|s| s.to_string()).collect::<Vec<_>>(), None)
}

/// Exit code, stdout, stderr.
fn nimbus(args: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("nimbus")
        .expect("the program is built")
        .env("NIMBUS_PROGRESS_S", "0")
        .args(args)
        .output()
        .expect("it runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("an exit code"), text(output.stdout), text(output.stderr))
}

#[test]
fn a_phase_is_the_scene_with_what_it_sets() {
    let all = loaded(SCENE, &[]).expect("the scene loads");
    let names: Vec<(&str, u32, bool)> =
        all.phases.iter().map(|p| (p.name.as_str(), p.n_frames, p.sets_mode)).collect();
    assert_eq!(names, [("lit", 4, false), ("unlit and small", 3, false), ("alone", 5, true)]);
    let [lit, unlit, alone] = [0, 1, 2].map(|i| all.phases[i].scene.clone());
    assert_eq!(lit, all.scene);
    assert_eq!(
        (lit.time.n_frames, lit.film.width, lit.lighting.mode),
        (12, 64, LightingMode::First)
    );
    assert_eq!(
        (unlit.film.width, unlit.film.height, unlit.lighting.mode),
        (32, 24, LightingMode::None)
    );
    assert_eq!((unlit.clouds[0].position.x, alone.clouds[0].position.x), (1.0, 0.0));
    assert_eq!((alone.threads.mode, lit.threads.mode), (Threading::Serial, Threading::Parallel));
    // The command line wins in every phase.
    let typed = loaded(SCENE, &["film.width=16", "lighting.grid=8"]).expect("the scene loads");
    assert!(typed.phases.iter().all(|p| (p.scene.film.width, p.scene.lighting.grid) == (16, 8)));
    assert_eq!(typed.phases[1].scene.film.height, 24);
    assert_eq!(all.resolved["phase"][1]["set"]["film.width"], 32);
    assert_eq!(all.resolved["time"]["frames"], 12);
}

#[test]
fn phases_can_be_set_on_the_command_line() {
    let scene = SCENE.split("[[phase]]").next().expect("a scene before its phases");
    let phase = |set: &str| format!("phase=[{{name='a',frames=3,set={{{set}}}}}]");
    let good = loaded(scene, &[&phase("film.width=9")]).expect("the scene loads");
    assert_eq!((good.phases[0].scene.film.width, good.phases[0].n_frames), (9, 3));
    let bad = phase("film.width=0");
    let message = loaded(scene, &[&bad]).expect_err("refused").to_string();
    assert!(message.contains("`film.width`: expected an integer from 1 to 16384"), "{message}");
    let message = loaded(scene, &[&phase("'film.width.x'=1")]).expect_err("refused").to_string();
    assert!(message.contains("`film.width` is no table"), "{message}");
}

#[test]
fn frames_are_of_the_phase_they_fall_in() {
    for (i_frame, width) in [(0, 64), (3, 64), (4, 32), (6, 32), (7, 64), (11, 64), (99, 64)] {
        assert_eq!(
            loaded(SCENE, &[]).expect("the scene loads").at_frame(i_frame).film.width,
            width,
            "{i_frame}"
        );
    }
}

#[test]
fn the_hash_depends_on_the_keys_that_phases_set() {
    let hash = |scene: &str| loaded(scene, &[]).expect("the scene loads").hash().to_owned();
    assert_eq!(hash(SCENE), hash(SCENE));
    assert_ne!(hash(SCENE), hash(&SCENE.replace("height = 24", "height = 25")));
    assert_ne!(hash(SCENE), hash(SCENE.split("[[phase]]").next().expect("a part")));
}

#[test]
fn faults_in_a_phase_are_reported_at_their_place() {
    let refusal = |from: &str, to: &str| {
        assert!(SCENE.contains(from), "{from}");
        loaded(&SCENE.replace(from, to), &[]).expect_err(to).to_string()
    };
    for (from, to, parts) in [
        (
            "set.lighting.mode = \"none\"",
            "set.lighting.mode = \"nine\"",
            &["toml:30:", "`nine`", "small\")"][..],
        ),
        (
            "set.lighting.mode = \"none\"",
            "set.lightning.mode = 1",
            &["toml:30:", "unknown key `lightning`", "in phase"],
        ),
        (
            "set.lighting.mode = \"none\"",
            "set.time.step_s = 1",
            &["toml:30:", "cannot set `title`, `time`, `phase`"],
        ),
        (
            "set.lighting.mode = \"none\"",
            "set.cloud.3.seed = 1",
            &["toml:30:", "phase \"unlit and small\"", "has 1 item"],
        ),
        ("set.\"threads.mode\" = \"serial\"", "set = 3", &["toml:37:", "expected a table of keys"]),
        ("name = \"lit\"", "name = \"alone\"", &["toml:", "another phase's name already"]),
        ("frames = 4", "", &["missing key `phase.0.frames`"]),
        ("frames = 4", "frames = 0", &["expected an integer from 1"]),
        ("step_s = 0.1", "frames = 7", &["toml:17:", "the phases have 12 frames in all"]),
        (
            "[[phase]]\nname = \"lit\"",
            "[[phase]]\nnme = 1\nname = \"lit\"",
            &["unknown key `phase.0.nme`"],
        ),
    ] {
        let message = refusal(from, to);
        assert!(parts.iter().all(|part| message.contains(part)), "{to}: {message}");
    }
    assert!(loaded(SCENE, &["time.frames=12"]).is_ok());
    assert!(
        loaded(SCENE, &["time.frames=13"])
            .expect_err("13")
            .to_string()
            .contains("--set time.frames=13")
    );
}

#[test]
fn every_phase_and_point_of_a_sweep_is_a_case_of_the_results() {
    let (dir, path) = temp(SCENE);
    let out = dir.path().join("run").display().to_string();
    let args = [
        "bench",
        &path,
        "--warmup",
        "2",
        "--repeat",
        "2",
        "--sweep",
        "draw.cutoff=2,3",
        "--out",
        &out,
    ];
    let (code, table, stderr) = nimbus(&args);
    assert!(code == 0 && stderr.starts_with("wrote ") && stderr.lines().count() == 1, "{stderr}");
    let cases: Vec<&str> =
        table.lines().filter(|l| l.contains(" serial  ") && !l.contains("no-skip")).collect();
    assert_eq!(cases.len(), 6, "{table}");
    assert!(table.contains("6 of 6 cases gave the same last frame"), "{table}");
    let run: Run = json::read(Path::new(&out)).expect("the run");
    let names: Vec<String> = run.cases.iter().map(|c| c.name()).collect();
    let phases = ["lit", "unlit and small", "alone"];
    let all = ["2", "3"].map(|v| phases.map(|p| format!("{p}, draw.cutoff={v}"))).concat();
    assert_eq!(names, all);
    let loops: Vec<usize> = run.cases.iter().map(|c| c.modes.len()).collect();
    // Serial, parallel, and serial without skipping; the last phase names its loop.
    assert_eq!(loops, [3, 3, 2, 3, 3, 2]);
    assert_eq!((run.cases[4].width, run.cases[4].particles), (32, 2));
    assert_eq!(run.block_order.len(), 2 * 16);
    // There and back.
    assert!(run.block_order.iter().eq(run.block_order.iter().rev()));
    let recorded = read_results(Path::new(&out)).expect("the results");
    // Timed frames are those of the scene, and follow each other from phase to phase.
    let frames = |name: &str| {
        let mode = recorded.modes.iter().find(|m| m.name == name).expect(name);
        mode.frames.clone()
    };
    assert_eq!(frames("lit, draw.cutoff=2: serial"), [0, 1, 2, 3, 0, 1, 2, 3]);
    assert_eq!(frames("unlit and small, draw.cutoff=3: parallel"), [4, 5, 6, 4, 5, 6]);
    assert_eq!(frames("alone, draw.cutoff=3: serial no-skip"), [7, 8, 9, 10, 11, 7, 8, 9, 10, 11]);
    let csv = fs::read_to_string(Path::new(&out).join("frames.csv")).expect("frames.csv");
    assert!(
        csv.lines().filter(|l| l.contains(",unlit and small,draw.cutoff=3,")).count() == 2 * 3 * 5,
        "{csv}"
    );
    // Read back, every case meets itself.
    let (code, table, _) = nimbus(&["compare", &out, &out]);
    assert!(code == 0 && table.contains("lit, draw.cutoff=2: serial frame"), "{table}");
}

#[test]
fn each_setting_of_a_sweep_reaches_the_picture() {
    let (_dir, path) = temp(SCENE.split("[[phase]]").next().expect("a part"));
    let sweep = ["--sweep", "size=32x24,40x30", "--sweep", "cloud.0.position=[0,0,0],[1,0,0]"];
    let short = [
        "--frames",
        "2",
        "--warmup",
        "0",
        "--repeat",
        "1",
        "--threading",
        "serial",
        "--no-saved",
        "--json",
    ];
    let (code, text, stderr) = nimbus(&[&["bench", path.as_str()][..], &sweep, &short].concat());
    assert_eq!(code, 0, "{stderr}");
    let run: Value = serde_json::from_str(&text).expect("JSON");
    let cases = run["cases"].as_array().expect("cases");
    let sizes: Vec<String> =
        cases.iter().map(|c| format!("{}x{}", c["width"], c["height"])).collect();
    assert_eq!(sizes, ["32x24", "32x24", "40x30", "40x30"]);
    let mut hashes: Vec<&Value> = cases.iter().map(|c| &c["modes"][0]["image_hash"]).collect();
    hashes.dedup();
    assert_eq!(hashes.len(), 4, "four pictures");
    let has_one_mode = |c: &Value| c["modes"].as_array().map(Vec::len) == Some(1);
    assert!(cases.iter().all(|c| has_one_mode(c) && c["skipping"] == Value::Null));
    assert_eq!(cases[1]["sweep"][1], json!({ "key": "cloud.0.position", "value": "[1,0,0]" }));
}

#[test]
fn a_sweep_that_makes_no_scene_is_refused_before_anything_runs() {
    let (dir, path) = temp(SCENE);
    let out = dir.path().join("run").display().to_string();
    for (sweep, part) in [
        ("draw.cutoff=2,900", "--sweep draw.cutoff=900: "),
        ("draw.cutof=2", "--sweep draw.cutof=2: unknown key `draw.cutof`"),
        ("size=2", "expected WIDTHxHEIGHT"),
        ("draw.cutoff", "no `=`"),
        ("draw.cutoff=2,2", "2 twice"),
    ] {
        let (code, stdout, stderr) = nimbus(&["bench", &path, "--sweep", sweep, "--out", &out]);
        assert!(code == 2 && stdout.is_empty() && stderr.contains(part), "{sweep}: {stderr}");
        assert!(!Path::new(&out).exists());
    }
    let twice = |a, b| nimbus(&["bench", &path, "--sweep", a, "--sweep", b]).2;
    assert!(twice("draw.cutoff=2", "draw.cutoff=3").contains("the key twice"));
    assert!(twice("size=8x8,9x9", "film.width=4").contains("which another --sweep sets"));
    let frames = nimbus(&["bench", &path, "--sweep", "time.frames=12", "--frames", "3"]);
    assert!(frames.0 == 2 && frames.2.contains("--frames says"), "{}", frames.2);
}

#[test]
fn a_case_that_cannot_run_is_named_before_any_does() {
    let scene = SCENE.replace(
        "from = \"particles\"\nfile = \"points.csv\"",
        "from = \"boxes\"\nfile = \"box.dat\"",
    );
    let (dir, path) = temp(&scene);
    fs::write(dir.path().join("box.dat"), "5\n1\n5, 1, 1, 1, 0, 0, 0, 0.5\n").expect("a box");
    let out = dir.path().join("run").display().to_string();
    let args = ["bench", &path, "--sweep", "draw.particles=5,2000000000", "--out", &out];
    let (code, stdout, stderr) = nimbus(&args);
    assert!(code == 2 && stdout.is_empty(), "{stderr}");
    assert!(stderr.contains("draw.particles=2000000000"), "{stderr}");
    assert!(!Path::new(&out).exists(), "nothing stands in the way of the next run");
}

#[test]
fn a_sweep_over_files_knows_what_is_in_them() {
    let (dir, path) = temp(SCENE.split("[[phase]]").next().expect("a part"));
    let other = |radius: &str| {
        let text = format!("x,y,z,radius,kappa\n0,0,0,{radius},1\n");
        fs::write(dir.path().join("other.csv"), text).expect("points");
    };
    let run = |name: &str| {
        let out = dir.path().join(name).display().to_string();
        let args = [
            "bench",
            &path,
            "--sweep",
            "cloud.0.file=points.csv,other.csv",
            "--frames",
            "2",
            "--no-saved",
        ];
        assert_eq!(
            nimbus(&[&args[..], &["--warmup", "0", "--repeat", "1", "--out", &out]].concat()).0,
            0
        );
        out
    };
    other("3");
    let a = run("a");
    other("4");
    let b = run("b");
    let (code, _, stderr) = nimbus(&["compare", &a, &b]);
    assert!(
        code == 2
            && stderr.contains("cloud.0.file=other.csv, hash")
            && !stderr.contains("=points.csv, hash"),
        "{stderr}"
    );
    assert_eq!(nimbus(&["compare", &a, &b, "--allow", "scene"]).0, 0);
}

#[test]
fn one_loop_alone_is_not_compared_with_what_measures_skipping() {
    let (_dir, path) = temp(SCENE.split("[[phase]]").next().expect("a part"));
    let short =
        ["--frames", "3", "--warmup", "1", "--repeat", "1", "--threading", "parallel", "--json"];
    let (code, text, stderr) = nimbus(&[&["bench", path.as_str()][..], &short].concat());
    assert_eq!(code, 0, "{stderr}");
    let run: Value = serde_json::from_str(&text).expect("JSON");
    let case = &run["cases"][0];
    assert_eq!((&case["overlap"], &case["ratio"]), (&Value::Null, &Value::Null));
    // The loop that skips nothing is of the same kind.
    let loops: Vec<_> =
        (0..2).map(|i| (&case["modes"][i]["threading"], &case["modes"][i]["skip"])).collect();
    assert_eq!(loops, [(&json!("parallel"), &json!(true)), (&json!("parallel"), &json!(false))]);
    assert_eq!(case["skipping"]["same_bytes"], true);
}
