//! A bench on a device, whose clock is a file of the test.

use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use nimbus::frame::{DeviceChoice, Stage};
use nimbus::gpu::{DeviceOptions, LoweredLimits};
use nimbus::io::scene_file;
use nimbus::model::scene::Threading;
use nimbus::timing::blocks::{BenchPlan, Outcome};
use nimbus::timing::cases::{Case, LoopChoice, cases};
use nimbus::timing::precision::Precision;
use nimbus::timing::running::{self, Event as BenchEvent};
use nimbus::timing::schedule::Rounds;
use nimbus::timing::state::{DeviceNames, Event, Folders, Judging, Sampler, StateRow};

const N_FRAMES: u32 = 6;
const N_WARM_UP: u32 = 2;
const N_ROUNDS: u32 = 4;

/// Times a small scene in four blocks of one loop, and judges the frames.
fn benched(valid_bits: u32, discard: bool) -> (Vec<Case>, BenchPlan, Outcome) {
    let (cases, plan, mut outcome) = timed(Rounds::Fixed(N_ROUNDS), valid_bits, discard);
    outcome.judge();
    (cases, plan, outcome)
}

/// Times a small scene in one loop; in block 2 the clock is at 60 %.
fn timed(rounds: Rounds, valid_bits: u32, discard: bool) -> (Vec<Case>, BenchPlan, Outcome) {
    let sys = tempfile::tempdir().expect("a folder");
    let clock = sys.path().join("devices/system/cpu/cpu0/cpufreq/scaling_cur_freq");
    fs::create_dir_all(clock.parent().expect("a folder")).expect("room");
    let set = |khz: &str| fs::write(&clock, khz).expect("room");
    set("4000000\n");

    let sizes = ["film.width=32", "film.height=24", "lighting.grid=16"].map(str::to_owned);
    let loaded = scene_file::load(Path::new("tests/data/modes.toml"), &sizes, None);
    let loops = LoopChoice { modes: &[Threading::Serial], skip: false, saved: false };
    let cases = cases(loaded.expect("a scene"), &[], Some(N_FRAMES), loops);
    let limits =
        LoweredLimits { timestamp_valid_bits: Some(valid_bits), ..LoweredLimits::default() };
    let options = DeviceOptions { limits: Some(limits), ..DeviceOptions::default() };
    let choice = DeviceChoice { validation: true, options, ..DeviceChoice::default() };
    let stage = Stage::new(cases[0].scene.clone(), &choice, false).expect("a stage");
    let folders = Folders { sys: sys.path().to_owned(), proc: "/proc".into() };
    let memory = Some(stage.device.memory_probe());
    let sampler = Sampler::with_sources(DeviceNames::default(), memory, folders);
    let log = sampler.log();
    let plan = BenchPlan {
        n_warm_up: N_WARM_UP,
        rounds,
        hash_frames: false,
        pictures: false,
        checked: None,
        cold_bytes: None,
        counts_invocations: false,
    };
    let judging = Judging { log: sampler.log(), is_cpu: true, n_cores: 2, discard };
    let (watch, judging) = (sampler.watch(), Some(judging));
    let outcome = Mutex::new(Outcome { watch, judging, ..Outcome::default() });
    let mut n_frames = 0;
    // The first frame of a block waits until the thread has read the end of the block before, and
    // the last frame of its warm-up has set the clock before the thread reads the begin.
    let mut tick = |event| {
        if event != BenchEvent::Frame {
            return;
        }
        let i_block = n_frames / (N_WARM_UP + N_FRAMES);
        if n_frames % (N_WARM_UP + N_FRAMES) == 0 {
            let has_ended = |row: &StateRow| {
                i_block == 0 || (row.event == Event::End && row.block == Some(i_block - 1))
            };
            wait(|| log.rows().iter().any(has_ended));
            set(if i_block == 2 { "2400000\n" } else { "4000000\n" });
        }
        // The thread has read the begin before the last frame ends.
        if n_frames % (N_WARM_UP + N_FRAMES) == N_WARM_UP {
            let begins = |row: &StateRow| row.event == Event::Begin && row.block == Some(i_block);
            wait(|| log.rows().iter().any(begins));
        }
        n_frames += 1;
    };
    let ended = running::run(stage, &cases, &plan, &AtomicBool::new(false), &outcome, &mut tick);
    assert_eq!(ended.failure, None);
    let n_blocks = n_frames / (N_WARM_UP + N_FRAMES);
    let last = |row: &StateRow| row.event == Event::End && row.block == Some(n_blocks - 1);
    wait(|| log.rows().iter().any(last));
    drop(sampler);
    ended.stage.expect("a stage").close().expect("no validation message");
    (cases, plan, outcome.into_inner().expect("an outcome"))
}

fn wait(is_so: impl Fn() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < Duration::from_secs(60), "the thread does not read");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn throttled_frames_are_left_out_of_the_statistics_and_stay_in_the_table() {
    let (cases, plan, outcome) = benched(64, true);
    let record = outcome.cases(&cases, &plan).remove(0);
    let table = outcome.table(&cases);
    let n = N_FRAMES as usize;
    assert_eq!(table.rows.len(), 4 * (n + N_WARM_UP as usize));
    for row in &table.rows {
        let is_out = row.block == 2 && !row.warm_up;
        assert_eq!(row.discarded, is_out, "{row:?}");
        assert_eq!(row.throttled.as_deref(), is_out.then_some("clock"), "{row:?}");
    }
    let state = record.state.expect("a state");
    assert_eq!((state.n_slow_clock, state.n_discarded), (n, n));
    let mode = &record.modes[0];
    assert_eq!((mode.frames, mode.blocks), (3 * n, 4));
    let frames = table.rows.iter().filter(|row| row.is_timed());
    assert_eq!(mode.frame_ms.expect("times").of.n, frames.count());
    assert!(state.peak_own_bytes.is_some_and(|bytes| bytes > 0), "{state:?}");
    // Times of the table and of the readings are of one clock.
    let rows = &outcome.state.as_ref().expect("a state").rows;
    for block in 0..N_ROUNDS {
        let of_event = |event| {
            rows.iter().find(|row| row.event == event && row.block == Some(block)).map(|r| r.time_s)
        };
        let [begin, end] = [Event::Begin, Event::End].map(|e| of_event(e).expect("a reading"));
        let of_block = table.rows.iter().filter(|row| row.block == block);
        let ends: Vec<f64> = of_block.filter_map(|row| row.end_s).collect();
        assert_eq!(ends.len(), n + N_WARM_UP as usize);
        assert!(ends.windows(2).all(|w| w[0] <= w[1]) && ends[N_WARM_UP as usize - 1] <= begin);
        assert!(ends[ends.len() - 1] <= end, "{ends:?} {end}");
    }
    assert!(outcome.state.expect("a state").run.clock == "cpu");
}

#[test]
fn frames_are_left_out_before_the_stopping_rule_looks_at_the_intervals() {
    let precision = Precision { wanted: 1e-9, seed: 1, limit: Duration::ZERO };
    for discard in [true, false] {
        let (_, _, outcome) = timed(Rounds::Until(precision), 64, discard);
        // Without the throttled one there are fewer blocks than an interval needs.
        assert_eq!(outcome.reached[&0].reach.is_none(), discard);
        for sample in outcome.samples.iter().filter(|sample| !sample.warm_up) {
            let is_out = discard && sample.i_block == 2;
            assert_eq!(sample.mark.is_discarded, is_out, "block {}", sample.i_block);
        }
    }
}

#[test]
fn flags_need_no_timestamps() {
    let (cases, plan, outcome) = benched(0, false);
    let record = outcome.cases(&cases, &plan).remove(0);
    let n = N_FRAMES as usize;
    assert!(record.modes[0].gpu_ms.is_none(), "a device without timestamps");
    let state = record.state.expect("a state");
    // Without --discard-throttled flagged frames count.
    assert_eq!((state.n_slow_clock, state.n_discarded, record.modes[0].frames), (n, 0, 4 * n));
}

#[test]
fn timestamps_of_few_bits_time_passes() {
    // 36 bits of a nanosecond wrap every 69 s.
    let (_, _, outcome) = benched(36, false);
    let mut last = 0.0;
    for sample in &outcome.samples {
        for pass in &sample.times.passes {
            assert!(pass.begin_ns >= last && pass.end_ns >= pass.begin_ns, "{pass:?} after {last}");
            last = pass.begin_ns;
        }
        assert!(!sample.times.passes.is_empty());
    }
}
