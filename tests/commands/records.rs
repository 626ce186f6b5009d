//! Written results follow the schema, and both have the same keys.

use std::fs;
use std::path::Path;

use crate::results;
use nimbus::frame::Counts;
use nimbus::io::result_folder::Existing;
use nimbus::measure::lows::Lows;
use nimbus::measure::stats::Summary;
use nimbus::timing::difference::{Condition, differences};
use nimbus::timing::frame_rows::{FRAMES_FILE, FrameRow, FrameTable};
use nimbus::timing::json::{read, write};
use nimbus::timing::machine::{Cpu, cpu, environment, revision, utc_now};
use nimbus::timing::names::Setting;
use nimbus::timing::overlap::{Overlap, SerialFrame};
use nimbus::timing::precision::{PrecisionRecord, Reached};
use nimbus::timing::records::{
    BaseTime, Case, Measured, Mode, PartRecord, Pass, Ratio, Reason, Run, Skipping,
};
use nimbus::timing::results::{RUN_FILE, open_results};
use nimbus::timing::roofs::{Bandwidth, Ceilings};
use nimbus::timing::state::{CaseState, Drift, RunState, Spread, ThrottleCount};
use serde_json::{Value, json};

fn schema() -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/schemas/run.schema.json");
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

fn complaints(run: &Value) -> Vec<String> {
    let validator = jsonschema::draft202012::new(&schema()).unwrap();
    validator.iter_errors(run).map(|error| format!("{}: {error}", error.instance_path())).collect()
}

fn mode(threading: &str) -> Mode {
    let measured = |values: &[f64], p50_low, p50_high| {
        Summary::of(values).map(|of| Measured { of, p50_low, p50_high })
    };
    let ms = measured(&[16.5, 17.0, 16.0, 40.25], Some(16.0), Some(17.0));
    Mode {
        frame_ms: ms,
        frame_lows: Lows::of(&[16.5, 17.0, 16.0, 40.25]),
        game_ms: ms,
        record_ms: ms,
        submit_ms: ms,
        wait_ms: ms,
        render_ms: ms,
        latency_ms: measured(&[17.0], None, None),
        queue_depth: Some(0.75),
        drawn: Some([5.0, 6.5, 7.0]),
        passes: vec![
            Pass {
                name: "sort".to_owned(),
                p50_ms: Some(1.25),
                share: Some(1.0),
                n_run: 3,
                n_skipped: 1,
                reason: Some("camera did not move".to_owned()),
                reasons: vec![Reason { reason: "camera did not move".to_owned(), n: 1 }],
                saved_ms: None,
                bytes: Some(5.6e5),
                operations: Some(0.0),
                roof_share: Some(0.25),
            },
            Pass {
                name: "first".to_owned(),
                p50_ms: None,
                share: None,
                n_run: 0,
                n_skipped: 4,
                reason: None,
                reasons: vec![],
                saved_ms: Some(0.5),
                ..Pass::default()
            },
        ],
        image_hash: Some("0123456789abcdef".repeat(4)),
        ..results::mode(threading, 4, 2)
    }
}

/// The state of a machine with every source.
fn run_state() -> RunState {
    let spread = Spread::of(&[1905.0, 1890.0, 1920.0]);
    let all = CaseState {
        n_readings: 3,
        gpu_mhz: spread,
        gpu_memory_mhz: spread,
        gpu_c: spread,
        gpu_w: spread,
        cpu_mhz: spread,
        throttle: Some(vec![ThrottleCount { reason: "sw_power_cap".to_owned(), n: 2 }]),
        peak_process_bytes: Some(1 << 30),
        peak_own_bytes: Some(1 << 29),
        others_share: Some(0.25),
        n_slow_clock: 1,
        n_slowdown: 2,
        n_limited: 3,
        n_discarded: 2,
    };
    RunState {
        sources: vec!["NVML".to_owned()],
        clock: "gpu".to_owned(),
        all,
        drift: Some(Drift { last_by_first: 0.95, low: 0.94, high: 0.96, drifts: true }),
        governor: Some("powersave".to_owned()),
        turbo: Some(true),
        load_at_start: Some(0.5),
        cpu_throttles: Some(1),
        remarks: vec!["the clock drifts".to_owned()],
    }
}

fn sample() -> Run {
    let blank = results::run(vec![mode("serial"), mode("parallel")]);
    let case = Case {
        phase: Some("dense".to_owned()),
        sweep: vec![Setting { key: "draw.cutoff".to_owned(), value: "2".to_owned() }],
        ratio: Some(Ratio { parallel_by_serial: 0.5, low: Some(0.25), high: Some(0.75) }),
        overlap: Overlap::of(
            &[SerialFrame { frame_ms: 22.0, game_ms: 2.0, render_ms: 20.0 }; 5],
            &[21.0; 5],
        ),
        skipping: Some(Skipping { gpu_ms: 1.0, gpu_no_skip_ms: 3.0, same_bytes: Some(true) }),
        counts: Some(Counts { values: 8, ..Counts::default() }),
        state: Some(run_state().all),
        precision: Some(Reached { reach: Some(0.01), rounds: 8, ended_by: None }),
        ..blank.cases[0].clone()
    };
    let base = BaseTime { threading: "serial".to_owned(), skip: true, p50_ms: Some(1.5) };
    let part = PartRecord {
        first: 0,
        end: 1,
        node: "node".to_owned(),
        date: utc_now(),
        clocks: blank.clocks,
        base: vec![base],
        state: Some(run_state()),
    };
    Run {
        nimbus: env!("CARGO_PKG_VERSION").to_owned(),
        revision: revision().to_owned(),
        tool: Some("another program 1.2".to_owned()),
        date: utc_now(),
        cpu: cpu(),
        cases: vec![case],
        chosen: vec!["draw.path = \"auto\" took \"tiles\"".to_owned()],
        parts: vec![part],
        state: Some(run_state()),
        ceilings: Some(Ceilings {
            date: utc_now(),
            bandwidths: vec![Bandwidth { set_bytes: 1 << 28, bytes_per_s: 2e10 }],
            operations_per_s: 1e11,
        }),
        cold_bytes: Some(1 << 25),
        precision: Some(PrecisionRecord { wanted: 0.02, seed: 1, limit_s: 600.0 }),
        ..blank
    }
}

fn row(i: u32) -> FrameRow {
    FrameRow {
        phase: "dense".to_owned(),
        sweep: "a=1, b=2".to_owned(),
        warm_up: i == 0,
        frame_ms: 16.123456789012345,
        game_ms: 1.0,
        record_ms: 0.5,
        submit_ms: 0.25,
        wait_ms: 14.5,
        latency_ms: f64::NAN,
        pass_ms: vec![Some(1.5), None],
        ..results::row("serial", i)
    }
}

#[test]
fn a_full_and_a_bare_run_satisfy_the_schema() {
    assert_eq!(complaints(&serde_json::to_value(sample()).unwrap()), [""; 0]);
    let bare = Run {
        revision: "unknown".to_owned(),
        cases: vec![Case {
            phase: None,
            sweep: Vec::new(),
            modes: Vec::new(),
            ratio: None,
            overlap: None,
            skipping: None,
            counts: None,
            state: Some(CaseState::default()),
            ..sample().cases[0].clone()
        }],
        state: Some(RunState { clock: "cpu".to_owned(), ..RunState::default() }),
        block_order: Vec::new(),
        parts: Vec::new(),
        ceilings: None,
        cold_bytes: None,
        interrupted: true,
        environment: environment(),
        cpu: Cpu { model: "unknown".to_owned(), logical_cores: 1 },
        ..sample()
    };
    assert_eq!(complaints(&serde_json::to_value(bare).unwrap()), [""; 0]);
}

#[test]
fn a_run_of_one_process_has_no_parts() {
    let value = serde_json::to_value(Run { parts: Vec::new(), ..sample() }).unwrap();
    assert!(value.get("parts").is_none());
    assert!(serde_json::from_value::<Run>(value).unwrap().parts.is_empty());
}

#[test]
fn a_run_of_nimbus_names_no_other_program() {
    let run = Run { tool: None, ..sample() };
    assert_eq!(run.program(), format!("nimbus {} {}", run.nimbus, run.revision));
    let value = serde_json::to_value(run).unwrap();
    assert!(value.get("tool").is_none());
    assert_eq!(complaints(&value), [""; 0]);
}

#[test]
fn results_without_a_state_are_read() {
    let mut value = serde_json::to_value(sample()).unwrap();
    for pointer in ["", "/cases/0", "/parts/0"] {
        let object = value.pointer_mut(pointer).and_then(Value::as_object_mut).unwrap();
        assert!(object.remove("state").is_some(), "{pointer}");
    }
    assert_eq!(complaints(&value), [""; 0]);
    let run: Run = serde_json::from_value(value).unwrap();
    assert!(run.state.is_none() && run.cases[0].state.is_none() && run.parts[0].state.is_none());
}

#[test]
fn the_schema_rejects_wrong_values() {
    let good = serde_json::to_value(sample()).unwrap();
    for (pointer, wrong) in [
        ("/schema", json!(1)),
        ("/date", json!("yesterday")),
        ("/device/type", json!("toaster")),
        ("/cpu/logical_cores", json!(0)),
        ("/cases/0/modes/0/threading", json!("both")),
        ("/block_order/0/threading", json!("both")),
        ("/cases/0/skipping/gpu_ms", json!(-1)),
        ("/cases/0/overlap/bound_ms", Value::Null),
        ("/cases/0/modes/0/frame_ms/p50", Value::Null),
        ("/cases/0/modes/0/frame_lows/p99_fps", json!(0)),
        ("/cases/0/modes/0/passes/0/share", json!(1.5)),
        ("/scene_hash", json!("ab")),
        ("/parts/0/node", Value::Null),
        ("/parts/0/base/0/p50_ms", json!(-1)),
        ("/parts", json!([])),
        ("/state/clock", json!("sun")),
        ("/state/all/others_share", json!(1.5)),
        ("/state/drift/drifts", Value::Null),
        ("/cases/0/state/n_discarded", json!(-1)),
    ] {
        let mut bad = good.clone();
        *bad.pointer_mut(pointer).unwrap() = wrong;
        assert_eq!(complaints(&bad).len(), 1, "{pointer}: {:?}", complaints(&bad));
    }
}

/// Every object of a written run, and the part of the schema that describes it.
fn compare_keys(
    written: &Value,
    described: &Value,
    root: &Value,
    at: &str,
    n_compared: &mut usize,
) {
    let described = resolve(described, root);
    match written {
        Value::Object(object) => {
            let Some(properties) = described.get("properties").and_then(Value::as_object) else {
                return;
            };
            let keys: Vec<&String> = object.keys().collect();
            assert_eq!(keys, properties.keys().collect::<Vec<_>>(), "{at}");
            *n_compared += 1;
            for (key, value) in object {
                compare_keys(value, &properties[key], root, &format!("{at}/{key}"), n_compared);
            }
        }
        Value::Array(items) => {
            for item in items {
                compare_keys(item, &described["items"], root, at, n_compared);
            }
        }
        _ => {}
    }
}

/// Through `$ref`, and through the first branch of "this or null".
fn resolve<'a>(described: &'a Value, root: &'a Value) -> &'a Value {
    let described = described.get("anyOf").map_or(described, |branches| &branches[0]);
    match described.get("$ref").and_then(Value::as_str) {
        Some(name) => root.pointer(name.trim_start_matches('#')).unwrap(),
        None => described,
    }
}

#[test]
fn keys_and_their_order_match_the_schema() {
    let mut n_compared = 0;
    compare_keys(
        &serde_json::to_value(sample()).unwrap(),
        &schema(),
        &schema(),
        "",
        &mut n_compared,
    );
    // The run, device, cpu, clocks, two blocks, the case, its setting, ratio, overlap and its
    // share, skipping, counts, ceilings and a bandwidth; both precisions; twice a mode, seven
    // summaries, lows, two passes, a reason. A part, its clocks and its time. The state of the case,
    // with five spreads and a reason; of run and part, each of which has that of all cases, and a
    // drift.
    let of_states = 7 + 2 * (1 + 7 + 1);
    assert_eq!(n_compared, of_states + 3 + 4 + 2 + 7 + 2 + 2 + 2 * (1 + 7 + 1 + 2 + 1));
}

#[test]
fn a_run_is_read_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let out_dir = folder.path().join("a/b");
    let pass_names = ["sort".to_owned(), "first".to_owned()].to_vec();
    let table = FrameTable { pass_names, rows: vec![row(0), row(3)] };
    results::write(&out_dir, &sample_at("2024-02-29T12:34:56Z"), &table).unwrap();
    assert_eq!(read::<Run>(&out_dir).unwrap(), sample_at("2024-02-29T12:34:56Z"));
    assert_eq!(read::<Run>(&out_dir.join(RUN_FILE)).unwrap(), sample_at("2024-02-29T12:34:56Z"));
    let names: Vec<_> =
        fs::read_dir(&out_dir).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names.len(), 3, "record, list and rows, nothing temporary: {names:?}");
    assert_eq!(
        fs::read_to_string(out_dir.join(FRAMES_FILE)).unwrap(),
        "i_row,phase,sweep,threading,skip,block,frame,time_s,warm_up,frame_ms,game_ms,record_ms,\
         submit_ms,wait_ms,gpu_ms,latency_ms,queue_depth,n_drawn,ran,gpu_sort_ms,gpu_first_ms,\
         image_hash,end_s,throttled,discarded\n\
         0,dense,\"a=1, b=2\",serial,true,0,0,0,true,16.123456789012344,\
         1,0.5,0.25,14.5,,,1,7,sort+sprites,1.5,,,,,false\n\
         1,dense,\"a=1, b=2\",serial,true,0,3,0.30000000000000004,false,16.123456789012344,\
         1,0.5,0.25,14.5,,,1,7,sort+sprites,1.5,,,,,false\n"
    );
}

fn sample_at(date: &str) -> Run {
    Run { date: date.to_owned(), ..sample() }
}

#[test]
fn an_existing_folder_is_refused_unless_forced() {
    let folder = tempfile::tempdir().unwrap();
    let open = |place: &Path, existing| open_results(place, existing, 1, true);
    // An empty folder has nothing to lose.
    open(folder.path(), Existing::Refuse).unwrap();
    fs::write(folder.path().join("notes.txt"), "mine").unwrap();
    let refused = open(folder.path(), Existing::Refuse).unwrap_err();
    assert!(refused.to_string().contains("--force"), "{refused}");
    assert_eq!(refused.exit_code(), 2);
    open(folder.path(), Existing::Replace).unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "mine").unwrap();
    for existing in [Existing::Refuse, Existing::Replace, Existing::Extend] {
        assert!(open(&file, existing).is_err(), "a file is never replaced by a folder");
    }
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
}

#[test]
fn another_schema_version_and_another_file_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(RUN_FILE);
    write(&path, &Run { schema: 7, ..sample() }).unwrap();
    assert!(read::<Run>(&path).unwrap_err().to_string().contains("schema 7"));
    fs::write(&path, "{}").unwrap();
    assert!(read::<Run>(&path).unwrap_err().to_string().contains("not a run.json"));
    fs::write(&path, "{").unwrap();
    assert!(read::<Run>(&path).is_err());
    assert!(read::<Run>(&folder.path().join("absent.json")).is_err());
}

#[test]
fn a_row_with_too_few_pass_times_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let table = FrameTable { pass_names: vec!["sort".to_owned()], rows: vec![row(0)] };
    assert!(results::write(folder.path(), &sample(), &table).is_err());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn one_value_has_no_standard_deviation() {
    let one = Summary::of(&[3.0]).unwrap();
    assert_eq!((one.sd, one.n), (None, 1));
}

#[test]
fn the_revision_is_a_git_hash_or_unknown() {
    let digits = revision().trim_end_matches("-dirty");
    assert!(
        revision() == "unknown"
            || (digits.len() >= 12 && digits.chars().all(|c| c.is_ascii_hexdigit()))
    );
}

#[test]
fn hot_and_cold_runs_are_not_compared_unless_allowed() {
    let hot = results::run(vec![mode("serial")]);
    let cold = Run { cold_bytes: Some(1 << 25), ..hot.clone() };
    assert!(differences(&hot, &hot).is_empty() && differences(&cold, &cold).is_empty());
    let found = differences(&hot, &cold);
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].kind, found[0].what.as_str()), (Condition::Device, "caches"));
    assert_eq!(found[0].b, "cold before each pass");
}
