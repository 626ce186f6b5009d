//! `nimbus bench --precision` and `--starts`: the blocks they run, what they record, and how bench says that
//! a precision was not reached. Whether it was is up to the machine, so that only limits of 0 s have
//! a number of rounds that is known.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use assert_cmd::Command;
use nimbus::timing::precision::Limit;
use nimbus::timing::results::{BenchResults, read_results};
use nimbus::timing::state::parse_rows;

fn bench(dir: &Path, name: &str, more: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("nimbus").expect("the program is built");
    command.env("NIMBUS_PROGRESS_S", "0").args([
        "bench",
        "scenes/threads.toml",
        "--size",
        "64x48",
        "--set",
        "draw.particles=500",
        "--frames",
        "25",
        "--no-check",
    ]);
    command.args(more).arg("--out").arg(dir.join(name));
    let output = command.output().expect("the program runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("an exit code"), text(output.stdout), text(output.stderr))
}

/// Cases, loops and frames of all blocks, in order.
fn order(results: &BenchResults) -> Vec<(usize, String, bool)> {
    let blocks = results.run.block_order.iter();
    blocks.map(|b| (b.case, b.threading.clone(), b.skip)).collect()
}

#[test]
fn eight_rounds_of_segments_in_random_order_come_first() {
    let dir = tempfile::tempdir().expect("a folder");
    let least = ["--precision", "0.0000001%", "--time-limit", "0", "--order-seed", "5"];
    let (code, table, stderr) = bench(dir.path(), "a", &least);
    assert_eq!(code, 0, "{stderr}");
    assert!(table.contains("blocks in random order (--order-seed 5)"), "{table}");
    assert!(table.contains("PRECISION NOT REACHED: ±"), "{table}");
    assert!(table.contains("would take longer than --time-limit 0"), "{table}");
    let a = read_results(&dir.path().join("a")).expect("results");
    let asked = a.run.precision.expect("a precision");
    assert_eq!((asked.seed, asked.limit_s), (5, 0.0));
    assert!((asked.wanted / 1e-9 - 1.0).abs() < 1e-12, "{}", asked.wanted);
    let case = &a.run.cases[0];
    let reached = case.precision.expect("a precision");
    assert_eq!((reached.rounds, reached.ended_by), (8, Some(Limit::Time)));
    assert!(reached.reach.is_some_and(|width| width > 1e-9));
    // Three loops in eight rounds; 25 frames in two segments of 12 and 13, four times each.
    assert_eq!(a.run.block_order.len(), 24);
    for mode in &a.modes {
        let mut n_timed: BTreeMap<u32, u32> = BTreeMap::new();
        mode.frames.iter().for_each(|frame| *n_timed.entry(*frame).or_default() += 1);
        assert_eq!(n_timed, (0..25).map(|frame| (frame, 4)).collect());
        let starts: Vec<u32> = mode.times("frame").iter().map(|b| b.stratum).collect();
        let of_cycle = |k: usize| [starts[2 * k], starts[2 * k + 1]];
        // A cycle ends with the last segment.
        assert!((0..4).all(|k| of_cycle(k) == [0, 12]), "{starts:?}");
    }
    // The last frames of all blocks that have them are alike.
    assert!(table.contains("the last frames of all blocks are the same"), "{table}");
    let rounds: Vec<Vec<_>> = order(&a).chunks(3).map(<[_]>::to_vec).collect();
    assert!(rounds.iter().any(|round| *round != rounds[0]), "{rounds:?}");

    let (code, _, stderr) = bench(dir.path(), "b", &least);
    assert_eq!(code, 0, "{stderr}");
    let b = read_results(&dir.path().join("b")).expect("results");
    assert_eq!(order(&a), order(&b), "the order repeats with its seed");
}

#[test]
fn a_precision_that_is_reached_has_narrow_intervals() {
    let dir = tempfile::tempdir().expect("a folder");
    let wide = ["--precision", "50%", "--sweep", "draw.cutoff=2,3"];
    let (code, table, stderr) = bench(dir.path(), "a", &wide);
    assert_eq!(code, 0, "{stderr}");
    let results = read_results(&dir.path().join("a")).expect("results");
    for case in &results.run.cases {
        let reached = case.precision.expect("a precision");
        assert!(reached.rounds >= 8 && reached.rounds % 2 == 0, "{reached:?}");
        if reached.ended_by.is_some() {
            assert!(table.contains("PRECISION NOT REACHED"), "{table}");
            continue;
        }
        assert!(reached.reach.is_some_and(|width| width <= 0.5), "{reached:?}");
        for mode in &case.modes {
            let frame = mode.frame_ms.expect("times");
            let width = frame.p50_high.expect("high") - frame.p50_low.expect("low");
            assert!(0.5 * width / frame.of.p50 <= 0.5, "{} {frame:?}", mode.name());
        }
    }
    assert!(table.contains("±50.00 % wanted"), "{table}");
}

#[test]
fn a_precision_needs_no_number_of_blocks() {
    let dir = tempfile::tempdir().expect("a folder");
    for (words, what) in [
        (&["--precision", "2%", "--repeat", "3"][..], "cannot be used with"),
        (&["--precision", "0"], "expected a share such as 1%"),
        (&["--precision", "2%", "--time-limit=-1"], "expected seconds"),
        (&["--time-limit", "3"], "--precision"),
    ] {
        let (code, _, stderr) = bench(dir.path(), "refused", words);
        assert!(code == 2 && stderr.contains(what), "{words:?}: {code} {stderr}");
    }
    assert!(!dir.path().join("refused").exists());
}

#[test]
fn starts_are_processes_whose_frames_are_joined() {
    let dir = tempfile::tempdir().expect("a folder");
    let three = ["--starts", "3", "--repeat", "1", "--warmup", "2"];
    let (code, table, stderr) = bench(dir.path(), "a", &three);
    assert_eq!(code, 0, "{stderr}");
    assert!(stderr.contains("files, listed in"), "{stderr}");
    assert!(!stderr.contains("as-start") && stderr.lines().count() == 1, "{stderr}");
    let results = read_results(&dir.path().join("a")).expect("results");
    let starts: Vec<u32> = results.run.block_order.iter().map(|b| b.start).collect();
    assert_eq!(starts, [0, 0, 0, 1, 1, 1, 2, 2, 2]);
    let case = &results.run.cases[0];
    for (mode, timed) in case.modes.iter().zip(&results.modes) {
        assert_eq!((mode.frames, mode.blocks, timed.frames.len()), (75, 3, 75));
        let frame = mode.frame_ms.expect("times");
        assert!(frame.p50_low.is_some_and(|low| low <= frame.of.p50), "{frame:?}");
        // The medians of three starts span the interval of their median.
        let of_starts = timed.times("frame").iter().map(|block| block.start).collect::<Vec<_>>();
        assert_eq!(of_starts, [0, 1, 2]);
        assert_eq!(mode.image_hash, case.modes[0].image_hash);
        assert!(mode.passes.iter().all(|p| p.n_run + p.n_skipped == 75), "{:?}", mode.passes);
    }
    assert!(case.ratio.is_some_and(|ratio| ratio.low.is_some()), "{:?}", case.ratio);
    assert!(dir.path().join("a/case-0.png").exists(), "the picture of the first start");
    // The state of the machine is that of all starts, on one clock.
    let state = case.state.as_ref().expect("a state");
    assert!(state.n_readings >= 9 && state.peak_own_bytes.is_some_and(|n| n > 0), "{state:?}");
    let text = std::fs::read_to_string(dir.path().join("a/state.csv")).expect("readings");
    let rows = parse_rows(&text, Path::new("state.csv")).expect("readings");
    assert!(rows.windows(2).all(|w| w[0].time_s <= w[1].time_s));
    let blocks: BTreeSet<u32> = rows.iter().filter_map(|row| row.block).collect();
    assert_eq!(blocks, (0..9).collect());
    assert!(table.contains("the last frames of all blocks are the same"), "{table}");

    // Two starts have no interval, and a faulty scene fails before any process.
    let (code, table, _) = bench(dir.path(), "b", &["--starts", "2", "--repeat", "1"]);
    assert!(code == 0 && table.contains("low, high: - "), "{table}");
    let faulty = ["--starts", "2", "--set", "lighting.grid=-1"];
    let (code, _, stderr) = bench(dir.path(), "c", &faulty);
    assert!(code == 2 && stderr.contains("lighting.grid"), "{stderr}");
    assert!(!dir.path().join("c").exists());
    for words in [["--part", "0..1"], ["--trace", "t.json"]] {
        let (code, _, stderr) = bench(dir.path(), "d", &[&["--starts", "2"][..], &words].concat());
        assert!(code == 2 && stderr.contains("cannot be used with"), "{stderr}");
    }
}
