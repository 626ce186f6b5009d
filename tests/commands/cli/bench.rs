//! `nimbus bench` as a user runs it: its table, its files, its time line, and Ctrl-C.

use super::*;

#[test]
fn bench_prints_its_table_and_writes_its_results_once() {
    let dir = temp();
    let out = path(&dir, "run");
    let args = [
        "bench",
        "scenes/hello.toml",
        "--frames",
        "6",
        "--warmup",
        "2",
        "--repeat",
        "2",
        "--out",
        &out,
    ];
    let (code, stdout, stderr) = run(&args);
    assert_eq!((code, stderr.lines().count()), (0, 1), "{stderr}");
    assert!(stderr.starts_with(&format!("wrote {out}: ")) && stderr.contains("run.sha256"));
    for word in [
        "serial",
        "parallel",
        "p50",
        "p99",
        "parallel / serial",
        "tiles",
        "to the byte",
        "A B C C B A",
        "skipping saves",
    ] {
        assert!(stdout.contains(word), "{word} in\n{stdout}");
    }
    let json: Value =
        serde_json::from_slice(&std::fs::read(path(&dir, "run/run.json")).expect("run.json"))
            .expect("JSON");
    let case = &json["cases"][0];
    assert_eq!(
        (json["cases"].as_array().map(Vec::len), case["modes"].as_array().map(Vec::len)),
        (Some(1), Some(3))
    );
    assert_eq!(
        (&case["modes"][0]["frames"], &case["modes"][2]["skip"]),
        (&12.into(), &false.into())
    );
    assert_eq!(json["block_order"].as_array().map(Vec::len), Some(6));
    assert!((0..3).all(|i| case["modes"][i]["image_hash"] == case["modes"][0]["image_hash"]));
    assert_eq!(case["skipping"]["same_bytes"], true);
    // The saving a frame equals the pass's time where nothing is skipped.
    let tiles = |i: usize| {
        let passes = case["modes"][i]["passes"].as_array().expect("passes");
        passes.iter().find(|p| p["name"] == "tiles").expect("tiles")
    };
    assert_eq!((&tiles(0)["n_skipped"], &tiles(2)["n_skipped"]), (&12.into(), &0.into()));
    assert_eq!(tiles(0)["saved_ms"], tiles(2)["p50_ms"]);
    assert_eq!(
        tiles(0)["reasons"],
        serde_json::json!([{ "reason": "the picture is the same", "n": 12 }])
    );
    for word in [
        "1 % low: p99",
        "mean of slowest 1 %",
        "1 % of the time",
        "NOTHING MOVES: 12 of 12 timed frames draw nothing",
        "The figure is serial no-skip: ",
        "host clock",
    ] {
        assert!(stdout.contains(word), "{word} in\n{stdout}");
    }
    let number = |pointer: &str| case.pointer(pointer).and_then(Value::as_f64).expect("a number");
    let overlap = number("/overlap/bound_ms");
    assert_eq!(overlap, number("/overlap/game_ms").max(number("/overlap/render_ms")));
    assert_eq!(number("/overlap/serial_ms"), number("/modes/0/frame_ms/p50"));
    assert_eq!(number("/modes/0/frame_lows/p99_fps"), 1000.0 / number("/modes/0/frame_ms/p99"));
    let rows = std::fs::read_to_string(path(&dir, "run/frames.csv")).expect("frames.csv");
    assert_eq!(rows.lines().count(), 1 + 3 * 2 * (6 + 2));
    let (code, _, stderr) = run(&args);
    assert!(code == 2 && stderr.contains("--force"), "{stderr}");
}

#[test]
fn bench_writes_a_time_line_of_every_step_and_pass() {
    let dir = temp();
    let file = path(&dir, "trace.json");
    let args = [
        "bench",
        "scenes/hello.toml",
        "--frames",
        "4",
        "--warmup",
        "0",
        "--repeat",
        "1",
        "--no-skip",
        "-q",
        "--trace",
        &file,
    ];
    assert_eq!(run(&args).0, 0);
    let trace: Value =
        serde_json::from_slice(&std::fs::read(&file).expect("the trace")).expect("JSON");
    let events = trace["traceEvents"].as_array().expect("events");
    let steps = |tid: u64| events.iter().filter(move |e| e["ph"] == "X" && e["tid"] == tid);
    // Four frames of each loop.
    assert_eq!((steps(0).count(), steps(1).count()), (8, 8));
    let span = |e: &Value| {
        [
            e["ts"].as_f64().expect("ts"),
            e["ts"].as_f64().expect("ts") + e["dur"].as_f64().expect("dur"),
        ]
    };
    for frame in steps(0) {
        let same = |e: &&Value| {
            e["args"]["frame"] == frame["args"]["frame"]
                && e["args"]["block"] == frame["args"]["block"]
        };
        let record = span(steps(1).find(same).expect("it was recorded"));
        let id = format!("{}/{}", frame["args"]["block"], frame["args"]["frame"]);
        let end = events.iter().find(|e| e["ph"] == "e" && e["id"] == *id).expect("it ended")["ts"]
            .as_f64()
            .expect("ts");
        let passes: Vec<[f64; 2]> = steps(2).filter(same).map(span).collect();
        assert!(
            passes.len() >= 5 && passes.windows(2).all(|p| p[0][1] <= p[1][0] + 1e-3),
            "passes in their order"
        );
        // Game step, recording, passes, end: in this order, but for a clock that is laid on another
        // one.
        assert!(span(frame)[0] >= 0.0 && span(frame)[1] <= record[0] + 1.0 && record[1] <= end);
        assert!(passes.iter().all(|p| p[1] <= end + 1e-3 && p[0] >= record[0] - 1000.0));
    }
    let (code, _, stderr) = run(&args);
    assert!(code == 2 && stderr.contains("trace.json"), "{stderr}");
    let nowhere = run(&["bench", "scenes/hello.toml", "--trace", &path(&dir, "absent/b.json")]);
    assert!(
        nowhere.0 == 2 && nowhere.1.is_empty() && nowhere.2.contains("does not exist"),
        "{}",
        nowhere.2
    );
    let two = run(&[
        "bench",
        "scenes/hello.toml",
        "scenes/static.toml",
        "--trace",
        &path(&dir, "b.json"),
    ]);
    assert!(two.0 == 2 && two.2.contains("one scene, found 2"), "{}", two.2);
}

#[test]
fn bench_json_is_json_and_nothing_else() {
    let (code, stdout, _) = run(&[
        "bench",
        "scenes/hello.toml",
        "--frames",
        "3",
        "--warmup",
        "1",
        "--repeat",
        "1",
        "--json",
    ]);
    assert_eq!(code, 0);
    let json: Value = serde_json::from_str(&stdout).expect("JSON");
    assert!(json["cases"][0]["ratio"]["parallel_by_serial"].as_f64().is_some_and(|r| r > 0.0));
    let schema: Value =
        serde_json::from_str(include_str!("../../../docs/reference/schemas/run.schema.json"))
            .expect("the schema");
    assert!(jsonschema::is_valid(&schema, &json), "{:?}", jsonschema::validate(&schema, &json));
}

/// Ctrl-C ends a long bench, keeps what was finished, and says so by exit code 130.
#[test]
fn an_interrupted_bench_keeps_its_finished_part() {
    // Machines differ in how long a bench takes to finish its first frame. Each try sends the
    // signal later, until the bench has finished a frame.
    let tries = (0..8).map(|k| 2f64.powi(k) - 1.0);
    let (dir, stderr) = tries
        .map(interrupted_bench)
        .find(|(_, stderr)| !stderr.contains("no frame was finished"))
        .expect("a frame within 127 s of the processor");
    let out = path(&dir, "run");
    let kept = format!("wrote {out}: what was finished, 4 files, listed in run.sha256\n");
    assert!(stderr.contains("keeps what is done") && stderr.contains(&kept), "{stderr}");
    assert_eq!(stderr.lines().count(), 3, "{stderr}");
    let json: Value =
        serde_json::from_slice(&std::fs::read(path(&dir, "run/run.json")).expect("run.json"))
            .expect("JSON");
    assert_eq!(json["interrupted"], true);
    assert!(json["cases"][0]["modes"][0]["frames"].as_u64().is_some_and(|n| n > 0));
}

/// Interrupts a bench that has made its results folder and has used `used_s` seconds of the
/// processor. Returns the parent of the results folder, and the text of stderr.
fn interrupted_bench(used_s: f64) -> (tempfile::TempDir, String) {
    let dir = temp();
    let out = path(&dir, "run");
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin("nimbus"));
    command
        .args(["bench", "scenes/hello.toml", "--repeat=1", "--frames=100000", "--warmup=0"])
        .args(["--out", &out])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let is_due = |used: f64| used >= used_s && Path::new(&out).exists();
    let (output, _) = signals::interrupt(&mut command, is_due);
    assert_eq!(output.status.code(), Some(130));
    (dir, String::from_utf8_lossy(&output.stderr).into_owned())
}

/// A sweep names the passes whose work the loops that skip left out, and only these.
#[test]
fn a_sweep_names_the_passes_whose_work_was_skipped() {
    let dir = temp();
    let scene = path(&dir, "a.toml");
    std::fs::write(dir.path().join("a.dat"), "40\n1\n40, 2, 1, 1, 0, 0, 0, 0.4\n").expect("a box");
    let cloud = "[[cloud]]\nfrom = \"boxes\"\nfile = \"a.dat\"\ngust = 0.2\n";
    std::fs::write(&scene, cloud).expect("a scene");
    let small = ["--size", "32x24", "--frames", "4", "--repeat", "1", "--threading", "serial"];
    let args = [&["bench", &scene, "--sweep", "lighting.grid=8,16"], &small[..]].concat();
    let (code, table, _) = run(&args);
    let line =
        table.lines().find_map(|l| l.strip_prefix("skipped in some timed frames or in all: "));
    let names = line.and_then(|l| l.split_once("; ")).expect(&table).0;
    // Gusts move the particles, but their boxes are filled once.
    assert_eq!((code, names), (0, "generate"), "{table}");
    // The line names the loop that times them, and follows the table of the loops' times.
    let after =
        table.lines().skip_while(|l| !l.contains("serial no-skip")).skip(3).collect::<Vec<_>>();
    assert!(after[0].contains("the loop without skipping (serial no-skip) times them"), "{table}");
}

#[test]
fn the_ways_of_timing_passes_draw_the_same_and_are_told() {
    let dir = temp();
    let mut hashes = vec![];
    for (how, told, is_timed) in [
        ("drained", "passes: timed one by one, the device idles between two", true),
        ("overlapping", "passes: timed without waits between them", true),
        ("off", "passes: not timed (--pass-times off)", false),
    ] {
        let out = path(&dir, how);
        let loops = ["--frames", "6", "--warmup", "1", "--repeat", "1"];
        let args = ["bench", "scenes/hello.toml", "--pass-times", how, "-q", "--out", &out];
        let (code, stdout, stderr) = run(&[&args[..], &loops].concat());
        assert_eq!(code, 0, "{stderr}");
        assert!(stdout.contains(told), "{told} in\n{stdout}");
        let reason = "gpu, passes: - : passes are not timed (--pass-times off)";
        assert_eq!(stdout.contains(reason), !is_timed, "{stdout}");
        let json = std::fs::read(path(&dir, &format!("{how}/run.json"))).expect("run.json");
        let json: Value = serde_json::from_slice(&json).expect("JSON");
        assert_eq!(json["clocks"]["pass_times"], how);
        assert_eq!(json["clocks"]["timestamp_period_ns"].is_number(), is_timed);
        // The loop without skipping: every frame has passes to time.
        let mode = &json["cases"][0]["modes"][2];
        assert_eq!(mode["gpu_ms"].is_object(), is_timed, "{mode}");
        hashes.push(mode["image_hash"].as_str().expect("a hash").to_owned());
    }
    assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{hashes:?}");

    // Two runs that were timed in different ways were not made under the same conditions.
    let [a, b] = ["drained", "overlapping"].map(|how| path(&dir, how));
    let (code, _, stderr) = run(&["compare", &a, &b]);
    let told = "device, times of passes: A drained, B overlapping";
    assert!(code == 2 && stderr.contains(told), "{code}: {stderr}");
}
