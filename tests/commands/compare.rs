//! `nimbus compare` as a user runs it, on results folders made here: verdicts, refusals, and files
//! that are not whole.

mod results_of_bench;
mod still;

use std::fs;
use std::path::Path;

use crate::results;
use assert_cmd::Command;
use nimbus::measure::stats::Summary;
use nimbus::timing::frame_rows::{FRAMES_FILE, FrameRow, FrameTable};
use nimbus::timing::records::Run;
use nimbus::timing::results::{RUN_FILE, read_results};
use serde_json::{Value, json};

const N_FRAMES: u32 = 60;

/// Exit code, stdout, stderr.
fn compare(args: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("nimbus").expect("the program is built");
    command.env("NIMBUS_PROGRESS_S", "0");
    let output = command.arg("compare").args(args).output().expect("the program runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("an exit code"), text(output.stdout), text(output.stderr))
}

/// Two warm-up frames, then times that scatter by ±1 % about `ms` in a pattern without a drift.
fn rows(threading: &str, ms: f64) -> Vec<FrameRow> {
    let row = |i: u32| {
        let ms = ms * (1.0 + 0.01 * f64::from(i * 7 % 11) / 5.0 - 0.01);
        FrameRow {
            warm_up: i < 2,
            frame_ms: if i < 2 { 1000.0 } else { ms },
            game_ms: 1.0,
            record_ms: 0.1 * ms,
            submit_ms: 0.1 * ms,
            wait_ms: 0.7 * ms,
            gpu_ms: Some(0.5 * ms),
            latency_ms: ms,
            pass_ms: vec![Some(0.5 * ms), None],
            ..results::row(threading, i)
        }
    };
    (0..N_FRAMES + 2).map(row).collect()
}

fn run() -> Run {
    results::run(["serial", "parallel"].map(|of| results::mode(of, N_FRAMES as usize, 2)).to_vec())
}

fn write(folder: &Path, run: &Run, rows: Vec<FrameRow>) {
    let table = FrameTable { pass_names: ["grid", "sort"].map(str::to_owned).to_vec(), rows };
    results::write(folder, run, &table).expect("results");
}

/// A results folder in `dir` whose serial frames take `ms`, and parallel ones 0.9 of it.
fn written(dir: &tempfile::TempDir, name: &str, ms: f64, run: &Run) -> String {
    let folder = dir.path().join(name);
    fs::create_dir(&folder).expect("a folder");
    let rows = [rows("serial", ms), rows("parallel", 0.9 * ms)].concat();
    write(&folder, run, rows);
    folder.to_str().expect("a UTF-8 path").to_owned()
}

fn temp() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

#[test]
fn a_run_does_not_differ_from_itself_and_a_slower_one_is_slower() {
    let dir = temp();
    let a = written(&dir, "a", 10.0, &run());
    let b = written(&dir, "b", 10.5, &run());
    let (code, table, stderr) = compare(&[&a, &a]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(table.contains("serial frame: B takes 1.000 of A's time"), "{table}");
    // frame, game, render, gpu and the one pass that ran of either loop, and two headlines.
    assert_eq!(table.matches("the same").count(), 2 * 5 + 2, "{table}");
    assert!(!table.contains("sort") && !table.contains("note:"), "{table}");

    let (code, table, _) = compare(&[&a, &b]);
    assert_eq!(code, 0, "a verdict is no failure");
    assert!(
        table.contains("parallel frame: B takes 1.050 of A's time") && table.contains("): slower"),
        "{table}"
    );
    let (_, table, _) = compare(&[&b, &a]);
    assert!(
        table.contains("serial frame: B takes 0.952 of A's time") && table.contains("): faster"),
        "{table}"
    );
    for word in ["corrected for many comparisons", "block bootstrap, 2000 resamples", "(frame: 8)"]
    {
        assert!(table.contains(word), "{word} in\n{table}");
    }
}

#[test]
fn too_few_frames_are_remarked_on_once() {
    let dir = temp();
    for (n, is_few) in [(2, true), (29, true), (30, false)] {
        let few = results::run(["serial", "parallel"].map(|of| results::mode(of, n, 2)).to_vec());
        let folder = dir.path().join(n.to_string());
        fs::create_dir(&folder).expect("a folder");
        let all = ["serial", "parallel"].map(|of| rows(of, 10.0)[..n + 2].to_vec());
        write(&folder, &few, all.concat());
        let folder = folder.to_str().expect("UTF-8");
        let (code, table, stderr) = compare(&[folder, folder]);
        assert_eq!((code, stderr.as_str()), (0, ""));
        let remark = "too few frames: a verdict needs 30 timed frames of A and of B";
        assert_eq!(table.matches(remark).count(), usize::from(is_few), "{n}: {table}");
        assert_eq!(table.contains("the same"), !is_few, "{n}: {table}");
    }
}

#[test]
fn an_unsteady_machine_is_remarked_on() {
    let dir = temp();
    let a = written(&dir, "a", 10.2, &run());
    let drifting = dir.path().join("b");
    fs::create_dir(&drifting).expect("a folder");
    let mut all = [rows("serial", 10.0), rows("parallel", 0.9 * 10.2)].concat();
    // Serial, a block of 9 frames at 10 ms and one of 51 at 11: 1.1 between them, and 1.08 from A
    // to B.
    for row in all.iter_mut().filter(|row| row.threading == "serial" && row.frame > 10) {
        row.block = 3;
        row.frame_ms *= 1.1;
    }
    write(&drifting, &run(), all);
    let (code, table, _) = compare(&[&a, drifting.to_str().expect("UTF-8")]);
    assert!(code == 0 && table.matches("note: ").count() == 1, "{table}");
    assert!(table.contains("note: serial: B's own blocks lie a factor of 1.1"), "{table}");
}

#[test]
fn json_has_the_figures_of_the_table() {
    let dir = temp();
    let (a, b) = (written(&dir, "a", 10.0, &run()), written(&dir, "b", 10.5, &run()));
    let (code, text, _) = compare(&[&a, &b, "--json"]);
    let json: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((code, &json["headline"], &json["a"]["folder"]), (0, &json!("frame"), &json!(a)));
    let frame = &json["modes"][0]["measures"][0];
    assert_eq!(
        (&frame["measure"], &frame["verdict"], &frame["n_a"]),
        (&json!("frame"), &json!("slower"), &json!(60))
    );
    let number = |value: &Value| value.as_f64().expect("a number");
    // Medians of a pattern about 10 ms with a step of 0.02 ms, warm-up left out.
    assert!((number(&frame["a_ms"]) - 10.0).abs() < 0.05, "{frame}");
    let ratio = &frame["b_by_a"];
    assert!((number(&ratio["estimate"]) - 1.05).abs() < 1e-12, "{frame}");
    assert!(
        number(&ratio["low"]) > 1.0
            && number(&ratio["low"]) <= 1.05
            && number(&ratio["high"]) >= 1.05,
        "{frame}"
    );
    // render = record + submit + wait = 0.9 of the frame.
    let render = &json["modes"][0]["measures"][2];
    assert_eq!(render["measure"], "render");
    assert!((number(&render["a_ms"]) - 0.9 * number(&frame["a_ms"])).abs() < 1e-9);
    let game = &json["modes"][0]["measures"][1];
    assert_eq!((&game["measure"], &game["verdict"]), (&json!("game"), &json!("same")));
}

/// A change of the run, the kind it is, and what the refusal has to show of it.
type Change = (fn(&mut Run), &'static str, &'static [&'static str]);

const CHANGES: [Change; 8] = [
    (|r| r.device.name = "GeForce".to_owned(), "device", &["device, name: A llvmpipe, B GeForce"]),
    (|r| r.device.driver = "Mesa 23".to_owned(), "device", &["driver: A Mesa 22.3.6, B Mesa 23"]),
    (|r| r.cpu.logical_cores = 3, "device", &["cores: A 2, B 3"]),
    (|r| r.environment.clear(), "device", &["LP_NUM_THREADS: A 1, B not set"]),
    (|r| r.nimbus = "0.2.0".to_owned(), "build", &["build, version: A 0.1.0, B 0.2.0"]),
    (
        |r| r.revision = "ba9876543210".to_owned(),
        "build",
        &["revision: A 0123456789ab, B ba9876543210"],
    ),
    (|r| r.scene_hash = "cd".repeat(32), "scene", &["scene_hash: A abab", "B cdcd"]),
    (
        |r| {
            r.scene_hash = "cd".repeat(32);
            r.scene["lighting"]["grid"] = json!(128);
            r.scene["cloud"][0]["wind"] = json!([1, 0, 0]);
        },
        "scene",
        &["scene, lighting.grid: A 64, B 128", "cloud.0.wind: A [0.5,0.0,0.0], B [1,0,0]"],
    ),
];

#[test]
fn a_difference_is_refused_by_name_unless_allowed() {
    let dir = temp();
    let a = written(&dir, "a", 10.0, &run());
    for (i, (change, kind, shown)) in CHANGES.into_iter().enumerate() {
        let mut changed = run();
        change(&mut changed);
        let b = written(&dir, &format!("b{i}"), 10.0, &changed);
        let others: Vec<&str> =
            ["device", "build", "scene"].into_iter().filter(|k| *k != kind).collect();
        for refused in [compare(&[&a, &b]), compare(&[&a, &b, "--allow", &others.join(",")])] {
            assert_eq!((refused.0, refused.1.as_str()), (2, ""), "{kind}");
            assert!(shown.iter().all(|s| refused.2.contains(s)), "{}", refused.2);
        }
        let (_, _, stderr) = compare(&[&a, &b]);
        assert!(stderr.contains(&format!("--allow {kind} compares them")), "{stderr}");
        let (code, table, stderr) = compare(&[&a, &b, "--allow", kind]);
        assert_eq!((code, stderr.as_str()), (0, ""));
        assert!(
            table.contains("allowed to differ: ") && shown.iter().all(|s| table.contains(s)),
            "{table}"
        );
    }
}

#[test]
fn the_suggested_flag_names_all_differences() {
    let dir = temp();
    let a = written(&dir, "a", 10.0, &run());
    let other = Run { scene_hash: "cd".repeat(32), nimbus: "0.2.0".to_owned(), ..run() };
    let b = written(&dir, "b", 10.0, &other);
    assert!(compare(&[&a, &b]).2.contains("--allow build,scene"));
    let (code, _, stderr) = compare(&[&a, &b, "--allow", "scene"]);
    assert!(
        code == 2 && stderr.contains("--allow build,scene") && !stderr.contains("scene_hash"),
        "{stderr}"
    );
    assert_eq!(compare(&[&a, &b, "--allow", "scene,build"]).0, 0);
    let (code, _, stderr) = compare(&[&a, &b, "--allow", "everything"]);
    assert!(code == 2 && stderr.contains("device, build, scene"), "{stderr}");
}

#[test]
fn small_differences_between_comparable_runs_are_remarked_on() {
    let dir = temp();
    let dirty = Run { revision: "0123456789ab-dirty".to_owned(), ..run() };
    let mut asked = Run { interrupted: true, ..dirty.clone() };
    asked.command.extend(["--no-skip".to_owned(), "-q".to_owned()]);
    let (a, b) = (written(&dir, "a", 10.0, &dirty), written(&dir, "b", 10.0, &asked));
    let (code, table, _) = compare(&[&a, &b]);
    assert_eq!((code, table.matches("note: ").count()), (0, 3), "{table}");
    for word in [
        "-dirty: their sources may differ",
        "B was interrupted",
        "A \"bench a.toml\", B \"bench a.toml --no-skip\"",
    ] {
        assert!(table.contains(word), "{word} in\n{table}");
    }
    let mut serial = run();
    serial.cases[0].modes.remove(0);
    serial.cases[0].modes[0].threading = "elsewhere".to_owned();
    let none = dir.path().join("none");
    fs::create_dir(&none).expect("a folder");
    write(&none, &serial, rows("elsewhere", 1.0));
    let a = written(&dir, "c", 10.0, &run());
    let (code, _, stderr) = compare(&[&a, none.to_str().expect("UTF-8")]);
    assert!(code == 2 && stderr.contains("A has serial, parallel, B has elsewhere"), "{stderr}");
}

/// A change of a good folder, and the two parts of the one message it must give: the file and the
/// fault.
type Damage = (fn(&Path), &'static str, &'static str);

fn edit(path: &Path, change: impl Fn(&str) -> String) {
    let text = fs::read_to_string(path).expect("the file");
    fs::write(path, change(&text)).expect("written");
}

const DAMAGES: [Damage; 14] = [
    (|d| fs::remove_dir_all(d).expect("removed"), "b: ", "no such folder"),
    (|d| fs::remove_file(d.join(RUN_FILE)).expect("removed"), "b: ", "holds no run.json"),
    (|d| fs::remove_file(d.join(FRAMES_FILE)).expect("removed"), "frames.csv", "No such file"),
    (
        |d| edit(&d.join(RUN_FILE), |t| t[..t.len() / 2].to_owned()),
        "run.json",
        "not JSON, or not all of it",
    ),
    (
        |d| edit(&d.join(RUN_FILE), |_| "{\"name\": 1}".to_owned()),
        "run.json",
        "names no schema version",
    ),
    (
        |d| edit(&d.join(RUN_FILE), |_| "{\"schema\": 3}".to_owned()),
        "run.json",
        "not a run.json of nimbus: missing field",
    ),
    (
        |d| edit(&d.join(RUN_FILE), |t| t.replace("\"schema\": 3", "\"schema\": 2")),
        "run.json",
        "schema 2; this nimbus",
    ),
    (
        |d| edit(&d.join(FRAMES_FILE), |t| t[..t.len() - 40].to_owned()),
        "frames.csv: line 125: ",
        "cut off?",
    ),
    (
        |d| edit(&d.join(FRAMES_FILE), |t| whole_lines(t, 100)),
        "frames.csv",
        "holds 35 timed parallel frames and run.json names 60",
    ),
    (|d| edit(&d.join(FRAMES_FILE), |_| String::new()), "frames.csv", "no column phase"),
    (|d| edit(&d.join(FRAMES_FILE), |_| "x,y\n1,2\n".to_owned()), "frames.csv", "no column phase"),
    (
        |d| edit(&d.join(FRAMES_FILE), |t| t.replace(",1,1.0", ",fast,1.0")),
        "frames.csv",
        "expected",
    ),
    (|d| fs::write(d.join(FRAMES_FILE), [0xff, 0xfe, 0]).expect("written"), "frames.csv", "UTF-8"),
    (
        |d| edit(&d.join(FRAMES_FILE), |t| t.replace("parallel", "sideways")),
        "frames.csv",
        "0 timed parallel frames",
    ),
];

fn whole_lines(text: &str, n: usize) -> String {
    text.split_inclusive('\n').take(n).collect()
}

#[test]
fn damaged_or_foreign_files_give_one_message_with_their_path() {
    let dir = temp();
    let a = written(&dir, "a", 10.0, &run());
    for (damage, file, fault) in DAMAGES {
        let inner = temp();
        let b = written(&inner, "b", 10.0, &run());
        damage(Path::new(&b));
        for args in [[&a, &b], [&b, &a]] {
            let (code, stdout, stderr) = compare(&args.map(String::as_str));
            assert_eq!(
                (code, stdout.as_str(), stderr.lines().count()),
                (2, "", 1),
                "{fault}: {stderr}"
            );
            assert!(
                stderr.contains(&b) && stderr.contains(file) && stderr.contains(fault),
                "{fault}: {stderr}"
            );
        }
    }
}

#[test]
fn a_folder_of_results_folders_is_explained() {
    let dir = temp();
    let a = written(&dir, "hello", 10.0, &run());
    let (code, _, stderr) = compare(&[dir.path().to_str().expect("UTF-8"), &a]);
    assert!(
        code == 2 && stderr.contains("name one of those, such as ") && stderr.contains("hello"),
        "{stderr}"
    );
}
