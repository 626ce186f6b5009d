//! `tools/nimbus_results.py`: its own tests, the notebook of docs/how-to, and results that nimbus
//! writes now. Every number that Python computes from frames is the one that nimbus wrote.

#[path = "harness/program.rs"]
mod program;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const READER: &str = "tools/nimbus_results.py";
const COMPARE: &str = "tests/python/check_results.py";

/// The interpreters that are tried, in order. tools/bootstrap tries the same: packages of a system
/// are for its own interpreter, which may not be the first of the path.
const PYTHONS: [&str; 2] = ["python3", "/usr/bin/python3"];

/// Returns a Python that has numpy.
fn interpreter() -> &'static str {
    let has_numpy = |name: &&str| {
        Command::new(name).args(["-c", "import numpy"]).output().is_ok_and(|o| o.status.success())
    };
    PYTHONS.into_iter().find(has_numpy).expect(
        "this test needs Python 3.9 or newer with numpy, and neither python3 nor \
         /usr/bin/python3 has both; run tools/bootstrap tests, or install the packages python3 and \
         python3-numpy",
    )
}

/// Runs a Python program in the folder of the project.
fn python(args: &[&str]) -> Output {
    let mut command = Command::new(interpreter());
    // Compiled files would be written beside the sources.
    command.args(args).current_dir(ROOT).env("PYTHONDONTWRITEBYTECODE", "1");
    command.output().expect("Python runs")
}

/// Returns what a program wrote to stdout and stderr.
fn said(output: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    text(&output.stdout) + &text(&output.stderr)
}

/// Runs a Python program, expects success, and returns what it wrote.
fn succeed(args: &[&str]) -> String {
    let output = python(args);
    assert!(output.status.success(), "{args:?}: {}\n{}", output.status, said(&output));
    said(&output)
}

/// Runs nimbus, expects success, and returns stdout.
fn nimbus(args: &[&str]) -> String {
    let output = program::run(args);
    assert!(output.status.success(), "{args:?}: {}\n{}", output.status, said(&output));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Writes a small bench to the folder `run`: enough frames for intervals, and a sweep.
fn bench(dir: &TempDir) -> String {
    let run = program::path(dir, "run");
    nimbus(&[
        "bench",
        "scenes/threads.toml",
        "--size",
        "32x24",
        "--frames",
        "16",
        "--warmup",
        "1",
        "--repeat",
        "2",
        "--sweep",
        "lighting.grid=16,32",
        "--out",
        &run,
    ]);
    run
}

#[test]
fn its_own_tests_pass() {
    let text = succeed(&["tests/python/test_nimbus_results.py"]);
    let n = text.lines().find_map(|line| line.strip_prefix("Ran ")?.split(' ').next());
    let n: usize = n.and_then(|n| n.parse().ok()).unwrap_or_default();
    assert!(n >= 30 && text.contains("\nOK"), "{n} tests ran:\n{text}");
}

#[test]
fn cells_of_the_notebook_print_what_it_shows() {
    let notebook = "docs/how-to/read-results.ipynb";
    let text = succeed(&["tests/python/run_notebook.py", notebook]);
    assert!(text.contains("code cells"), "{text}");
    // A notebook that shows another number is noticed.
    let dir = tempfile::tempdir().expect("a temporary folder");
    let shown = fs::read_to_string(Path::new(ROOT).join(notebook)).expect("the notebook");
    let wrong = shown.replacen("files verified: True", "files verified: False", 1);
    assert!(wrong != shown, "the notebook shows no verified files");
    let path = program::path(&dir, "wrong.ipynb");
    fs::write(&path, wrong).expect("a notebook");
    let output = python(&["tests/python/run_notebook.py", &path]);
    let text = said(&output);
    assert!(!output.status.success() && text.contains("prints something else"), "{text}");
}

#[test]
fn peers_are_compared_with_their_laws() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut command = Command::new(interpreter());
    command.args(["tests/python/check_peers.py", &program::path(&dir, "")]).current_dir(ROOT);
    command.env("NIMBUS", env!("CARGO_BIN_EXE_nimbus")).env("PYTHONDONTWRITEBYTECODE", "1");
    let output = command.output().expect("Python runs");
    assert!(output.status.success(), "{}", said(&output));
    assert!(said(&output).contains("all as expected"), "{}", said(&output));

    let schema = fs::read_to_string(Path::new(ROOT).join("docs/reference/schemas/run.schema.json"));
    let schema = serde_json::from_str(&schema.expect("a schema")).expect("JSON");
    let schema = jsonschema::validator_for(&schema).expect("a schema");
    for name in ["nimbus", "other"] {
        let run = dir.path().join("runs").join(name);
        let record = fs::read(run.join("run.json")).expect("run.json");
        let record: Value = serde_json::from_slice(&record).expect("JSON");
        let wrong: Vec<_> = schema.iter_errors(&record).map(|error| error.to_string()).collect();
        assert!(wrong.is_empty(), "{name}: {wrong:?}");
        let table = succeed(&[READER, run.to_str().expect("UTF-8")]);
        assert_eq!(table.contains("drawn by other 1.2"), name == "other", "{table}");
    }
}

#[test]
fn statistics_of_a_fresh_bench_are_those_of_run_json() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let run = bench(&dir);
    let text = succeed(&[COMPARE, &run]);
    assert!(text.contains(" 0 differences"), "{text}");

    // The program's own JSON has the same medians.
    let output = python(&[READER, "--json", &run]);
    let read: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let record = fs::read_to_string(Path::new(&run).join("run.json")).expect("run.json");
    let written: Value = serde_json::from_str(&record).expect("JSON");
    let loops = read[0]["tables"]["loops"].as_array().expect("loops");
    let cases = written["cases"].as_array().expect("cases");
    let modes: Vec<&Value> =
        cases.iter().flat_map(|case| case["modes"].as_array().expect("modes")).collect();
    assert!(modes.len() == 6 && loops.len() == modes.len(), "{} loops", loops.len());
    for (of, mode) in loops.iter().zip(modes) {
        for (read, written) in [("frame_ms", "p50"), ("frame_ms_low", "p50_low")] {
            let expected = mode["frame_ms"][written].as_f64();
            assert!(expected.is_some(), "no {written} in {mode}");
            assert_eq!(of[read].as_f64(), expected, "{read}");
        }
    }

    // The error that the table has is that of the check.
    let check = &written["cases"][0]["check"];
    assert_eq!(read[0]["tables"]["cases"][0]["rmse"], check["rmse"]["value"], "{check}");
    assert!(check["rmse"]["value"].is_f64() && check["verdict"] == "right", "{check}");

    // The least work of passes is that of the record.
    let passes = read[0]["tables"]["passes"].as_array().expect("passes");
    let of_record = cases.iter().flat_map(|case| case["modes"].as_array().expect("modes"));
    let of_record: Vec<&Value> =
        of_record.flat_map(|mode| mode["passes"].as_array().expect("passes")).collect();
    assert_eq!(passes.len(), of_record.len());
    assert!(of_record.iter().any(|pass| pass["bytes"].is_f64()), "no pass has bytes");
    for (pass, written) in passes.iter().zip(of_record) {
        for key in ["name", "bytes", "operations", "roof_share"] {
            assert_eq!(pass[key], written[key], "{key} of {written}");
        }
    }

    // A comparison of the run with itself.
    let compared = program::path(&dir, "compared.json");
    fs::write(&compared, nimbus(&["compare", &run, &run, "--json"])).expect("a file");
    let table = succeed(&[READER, &compared]);
    let n_loops = table.lines().filter(|line| line.contains("  frame  ")).count();
    assert!(n_loops >= 4 && table.contains("frame decides"), "{table}");

    // A median that is not that of the frames is noticed.
    let median = written["cases"][0]["modes"][0]["frame_ms"]["p50"].to_string();
    let wrong = record.replacen(&format!("\"p50\": {median}"), "\"p50\": 0.125", 1);
    assert!(wrong != record, "run.json has no {median}");
    fs::write(Path::new(&run).join("run.json"), wrong).expect("run.json");
    let refused = python(&[READER, &run]);
    let text = said(&refused);
    assert_eq!(refused.status.code(), Some(2), "{text}");
    assert!(text.contains("run.json: has changed") && text.lines().count() == 1, "{text}");
    fs::remove_file(Path::new(&run).join("run.sha256")).expect("the list");
    let output = python(&[COMPARE, &run]);
    let text = said(&output);
    assert!(!output.status.success() && text.contains("written 0.125"), "{text}");
}

#[test]
fn a_fresh_study_ledger_and_stress_test_are_read() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let [study, ledger, json, csv] =
        ["study", "ledger", "stress.json", "stress.csv"].map(|name| program::path(&dir, name));
    let small = ["--size", "16x12", "--pixels", "32", "--rounds", "2", "--frames", "1"];
    let knobs =
        ["--knob", "draw.cutoff=2,3", "--knob", "lighting.grid=16,32", "--out", study.as_str()];
    nimbus(&[&["error", "scenes/study-cloud.toml"][..], &small, &knobs].concat());
    let options = ["--plain", "--reflections", "2", "--out", ledger.as_str()];
    nimbus(&[&["ledger", "scenes/hello.toml"][..], &small, &options].concat());
    for (path, form) in [(&json, "--json"), (&csv, "--csv")] {
        fs::write(path, nimbus(&["stress", "functions/division", form])).expect("a file");
    }
    let text = succeed(&[COMPARE, &study, &ledger, &json, &csv]);
    assert_eq!(text.matches(" 0 differences").count(), 4, "{text}");
    let table = succeed(&[READER, &study, &ledger, &json, &csv]);
    for expected in ["lighting.grid=16", "thin sprites", "functions"] {
        assert!(table.contains(expected), "{expected} in\n{table}");
    }
}
