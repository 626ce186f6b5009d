//! The rules by which the state of the machine judges frames, each with a fixture.
#![cfg(unix)]

mod bench;
mod drift;
mod trees;

use std::path::Path;

use nimbus::timing::state::rules::{FrameSpan, during, flags, others_share};
use nimbus::timing::state::{
    AMD, DeviceNames, Event, Flags, INTEL, Observed, RunState, StateRow, TimedFrame, parse_rows,
};
use trees::{Tree, text_of};

/// Returns the names of a device at a PCI address.
pub fn device(vendor: u32, address: &str) -> DeviceNames {
    DeviceNames { vendor, pci_address: Some(address.to_owned()), ..DeviceNames::default() }
}

/// Frames of `ms` that fill every block from its first to its last reading.
fn frames(rows: &[StateRow], ms: f64) -> Vec<TimedFrame> {
    let of_event = |event| rows.iter().filter(move |row| row.event == event);
    let begin_and_end = of_event(Event::Begin).zip(of_event(Event::End));
    let of_block = |(begin, end): (&StateRow, &StateRow)| {
        assert_eq!(begin.block, end.block);
        let (i_block, length_s) = (begin.block.expect("a block"), end.time_s - begin.time_s);
        let n = (1e3 * length_s / ms).round() as usize;
        let begin_s = begin.time_s;
        (0..n).map(move |i| TimedFrame {
            i_case: 0,
            i_loop: 0,
            span: FrameSpan {
                i_block,
                begin_s: begin_s + 1e-3 * ms * i as f64,
                end_s: begin_s + 1e-3 * ms * (i + 1) as f64,
            },
        })
    };
    begin_and_end.flat_map(of_block).collect()
}

fn judged(rows: &[StateRow], ms: f64, discard: bool) -> (Vec<(TimedFrame, Flags)>, RunState) {
    let frames = frames(rows, ms);
    let sources = ["a fixture".to_owned()];
    let observed =
        Observed { rows, sources: &sources, frames: &frames, is_cpu: false, n_cores: 2, discard };
    let (flags, run, cases) = observed.judge();
    // One case: what is true of the run is true of it.
    assert_eq!(cases[&0], run.all);
    (frames.into_iter().zip(flags).collect(), run)
}

fn csv(name: &str) -> Vec<StateRow> {
    parse_rows(&text_of(name), Path::new(name)).expect("readings")
}

/// Returns the times in s of the flagged frames, from the begin of the first to the end of the
/// last, and their number.
fn flagged(all: &[(TimedFrame, Flags)], is_so: fn(Flags) -> bool) -> (f64, f64, usize) {
    let flagged =
        || all.iter().filter(move |(_, flags)| is_so(*flags)).map(|(frame, _)| frame.span);
    let begin = flagged().map(|span| span.begin_s).fold(f64::INFINITY, f64::min);
    let end = flagged().map(|span| span.end_s).fold(0.0, f64::max);
    (begin, end, flagged().count())
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-6
}

#[test]
fn two_equal_cards_are_told_apart() {
    let tree = Tree::new("two-cards.tree");
    let clocks = |names: &DeviceNames| {
        let row = tree.rows(names).remove(0);
        [row.gpu_mhz, row.gpu_memory_mhz, row.gpu_c, row.gpu_w].map(|v| v.expect("a reading"))
    };
    let [idle, busy] = [[500.0, 96.0, 41.0, 9.0], [2450.0, 1249.0, 67.0, 281.0]];
    assert_eq!(clocks(&device(AMD, "0000:03:00.0")), idle);
    assert_eq!(clocks(&device(AMD, "0000:83:00.0")), busy);
    // A driver that tells no PCI address may tell its node in /dev/dri.
    let node =
        |minor| DeviceNames { vendor: AMD, drm_node: Some([226, minor]), ..DeviceNames::default() };
    assert_eq!((clocks(&node(0)), clocks(&node(1))), (idle, busy));
    // Where neither fits, no card is guessed.
    for (names, why) in [
        (device(AMD, "0000:84:00.0"), "has its address 0000:84:00.0"),
        (node(128), "has its node 226:128"),
        (DeviceNames { vendor: AMD, ..DeviceNames::default() }, "does not tell its PCI address"),
        (device(INTEL, "0000:03:00.0"), "has no clock of i915 or Xe"),
    ] {
        let (mut sources, notes) = tree.open(&names);
        assert!(notes.len() == 1 && notes[0].contains(why), "{notes:?}");
        let row = sources.read(0.0, Event::Start, None);
        assert!(row.gpu_mhz.is_none() && row.throttle.is_none(), "{row:?}");
    }
    let of_no_maker = tree.open(&DeviceNames::default());
    assert_eq!((of_no_maker.1, of_no_maker.0.names()), (vec![], vec![]));
}

#[test]
fn a_boost_flags_the_frames_before_it() {
    let rows = Tree::new("i915-boost.tree").rows(&device(INTEL, "0000:00:02.0"));
    // A GPU that sleeps has no clock; its power is the energy since the reading before.
    assert_eq!((rows[0].gpu_mhz, rows[0].gpu_w), (None, None));
    assert_eq!((rows[1].gpu_mhz, rows[1].gpu_w), (Some(300.0), Some(1.0)));
    assert!(rows[2].gpu_w.is_some_and(|w| close(w, 25.0)), "{:?}", rows[2]);
    assert_eq!(rows[1].throttle.as_deref(), Some("none"));
    assert_eq!(rows[6].reasons().collect::<Vec<_>>(), ["pl1"]);

    let (all, run) = judged(&rows, 10.0, false);
    // The reading at 1.0 s is the nearest one of the first five frames of 10 ms.
    let (begin, end, n) = flagged(&all, |f| f.slow_clock);
    assert!(close(begin, 1.0) && close(end, 1.05) && n == 5, "{begin} {end} {n}");
    assert!((run.all.n_slow_clock, run.all.n_slowdown) == (5, 0));
    let clock = run.all.gpu_mhz.expect("clocks");
    assert_eq!((clock.median, clock.min, clock.max), (1450.0, 300.0, 1450.0));
    // A limit of power is no heat, and 1400 MHz are no low clock.
    let (begin, end, n) = flagged(&all, |f| f.limited);
    assert!(close(begin, 2.05) && close(end, 2.15) && n == 10, "{begin} {end} {n}");
    assert!(all.iter().all(|(_, f)| !(f.limited && f.is_throttled())));
    let remarks = run.remarks.join("\n");
    for expected in [
        "5 of 50 timed frames ran below 75 % of the run's median clock of 1450 MHz",
        "these frames are in the statistics; --discard-throttled leaves them out",
        "a limit of power or current held the clock down in 10 of 50 timed frames (pl1)",
    ] {
        assert!(remarks.contains(expected), "{remarks}");
    }
}

#[test]
fn heat_flags_frames_and_they_can_be_left_out() {
    let rows = Tree::new("amd-throttle.tree").rows(&device(AMD, "0000:03:00.0"));
    let reasons: Vec<&str> = rows.iter().filter_map(|row| row.throttle.as_deref()).collect();
    let (cold, power, hot) = ("none", "power", "temperature");
    assert_eq!(reasons, [cold, cold, power, power, power, power, hot, hot, cold, cold, cold]);
    assert_eq!((rows[1].gpu_w, rows[1].gpu_busy_percent), (Some(289.5), Some(99.0)));
    let (all, run) = judged(&rows, 10.0, true);
    // From half-way between the readings at 2.0 and 2.1 s to half-way between 2.2 and 2.3 s.
    let (begin, end, n) = flagged(&all, |f| f.slow_clock && f.slowdown);
    assert!(close(begin, 2.05) && close(end, 2.25) && n == 20, "{begin} {end} {n}");
    assert_eq!(all.iter().filter(|(_, f)| f.is_throttled()).count(), 20);
    assert_eq!((run.all.n_discarded, run.all.n_slow_clock, run.all.n_slowdown), (20, 20, 20));
    // Work at the limit of power is flagged, and stays in the statistics.
    assert!(run.all.n_limited > 20 && all.iter().any(|(_, f)| f.text() == "power"));
    assert!(all.iter().any(|(_, f)| f.text() == "clock+slowdown"));
    let remarks = run.remarks.join("\n");
    for expected in [
        "20 of 70 timed frames ran below 75 %",
        "held the clock down in 20 of 70 timed frames (temperature)",
        "20 of 70 timed frames are in no statistic (--discard-throttled)",
    ] {
        assert!(remarks.contains(expected), "{remarks}");
    }
    let (_, kept) = judged(&rows, 10.0, false);
    assert_eq!((kept.all.n_discarded, kept.all.n_slowdown), (0, 20));
}

#[test]
fn a_long_frame_has_the_mean_clock_of_its_readings() {
    let row = |time_s: f64, mhz: f64| StateRow {
        time_s,
        event: Event::Tick,
        block: Some(0),
        gpu_mhz: Some(mhz),
        ..StateRow::default()
    };
    let clock = |row: &StateRow| row.gpu_mhz;
    let span = |begin_s: f64, end_s: f64| FrameSpan { i_block: 0, begin_s, end_s };
    let rows: Vec<StateRow> =
        (0..20).map(|i| row(f64::from(i) / 10.0, if i == 4 { 300.0 } else { 1000.0 })).collect();
    let rows: Vec<&StateRow> = rows.iter().collect();
    // One low reading of ten makes a mean of 93 %; a frame that is all low is flagged.
    let slow = |frame| flags(&[frame], &rows, clock)[0].slow_clock;
    assert!(!slow(span(0.0, 0.95)) && slow(span(0.38, 0.42)) && slow(span(0.41, 0.43)));
    assert!(!slow(span(0.46, 0.48)));
    // 75 % themselves are not below it.
    let edge =
        [row(0.0, 1000.0), row(0.1, 750.0), row(0.2, 749.9), row(0.3, 1000.0), row(0.4, 1e3)];
    let edge: Vec<&StateRow> = edge.iter().collect();
    let slow = |at: f64| flags(&[span(at, at)], &edge, clock)[0].slow_clock;
    assert!(!slow(0.1) && slow(0.2));
    // A reading that is more than half a second away says nothing about a frame.
    let far = [row(0.0, 300.0), row(3.0, 1000.0), row(4.0, 1000.0)];
    let far: Vec<&StateRow> = far.iter().collect();
    let slow = |at: f64| flags(&[span(at, at)], &far, clock)[0].slow_clock;
    assert!(slow(0.5) && !slow(0.6));
    // Nor does one of another block, nor any without a clock.
    let other = FrameSpan { i_block: 1, begin_s: 0.0, end_s: 0.1 };
    assert_eq!(flags(&[other], &far, clock), [Flags::default()]);
    assert_eq!(flags(&[span(0.0, 0.1)], &far, |_| None), [Flags::default()]);
    assert_eq!(flags(&[span(0.0, 0.1)], &[], clock), [Flags::default()]);
}

#[test]
fn readings_outside_timed_frames_judge_nothing() {
    let row = |time_s, block| StateRow { time_s, block, ..StateRow::default() };
    let rows = [
        row(0.5, Some(0)),
        row(1.0, Some(0)),
        row(1.5, None),
        row(2.01, Some(0)),
        row(2.1, Some(0)),
        row(1.5, Some(1)),
    ];
    let frames = [
        FrameSpan { i_block: 0, begin_s: 1.0, end_s: 1.5 },
        FrameSpan { i_block: 0, begin_s: 1.5, end_s: 2.0 },
    ];
    let times: Vec<f64> = during(&frames, &rows).iter().map(|row| row.time_s).collect();
    // The reading at the end of a block is taken just after its last frame.
    assert_eq!(times, [1.0, 2.01]);
}

#[test]
fn readings_of_nvml_are_judged_alike() {
    let (all, run) = judged(&csv("nvml-throttle.csv"), 4.0, true);
    let heat = run.all.n_slowdown;
    // 25 readings of 240, a tenth of a second each, with frames of 4 ms.
    assert!((575..=650).contains(&heat) && run.all.n_discarded == heat, "{:?}", run.all);
    assert_eq!(run.all.n_slow_clock, heat);
    let names: Vec<&str> =
        run.all.throttle.iter().flatten().map(|count| count.reason.as_str()).collect();
    assert_eq!(names, ["hw_slowdown", "hw_thermal_slowdown"]);
    assert!(run.remarks.iter().any(|r| r.contains("(hw_slowdown, hw_thermal_slowdown)")));
    assert_eq!(flagged(&all, |f| f.limited).2, 0);

    let (all, run) = judged(&csv("nvml-boost.csv"), 4.0, false);
    let (begin, end, n) = flagged(&all, |f| f.slow_clock);
    assert!(close(begin, 0.0) && (0.7..0.8).contains(&end) && n == run.all.n_slow_clock);

    // A GPU at its limit of power all the time: nothing to leave out.
    let (all, run) = judged(&csv("nvml-steady.csv"), 4.0, true);
    assert_eq!((run.all.n_limited, run.all.n_discarded), (all.len(), 0));
    assert_eq!((run.remarks.len(), run.all.peak_own_bytes), (1, Some(1 << 29)));
    assert!(run.remarks[0].contains("(sw_power_cap)"), "{:?}", run.remarks);
}

#[test]
fn levels_tell_the_clock_where_no_sensor_does() {
    let row = Tree::new("amd-levels.tree").rows(&device(AMD, "0000:0a:00.0")).remove(0);
    assert_eq!((row.gpu_mhz, row.gpu_memory_mhz), (Some(1180.0), Some(945.0)));
    // These gpu_metrics are of another version.
    assert_eq!((row.gpu_w, row.throttle), (None, None));
}

#[test]
fn the_driver_xe_has_a_folder_of_reasons() {
    let rows = Tree::new("xe.tree").rows(&device(INTEL, "0000:03:00.0"));
    assert_eq!((rows[0].gpu_mhz, rows[0].gpu_c), (Some(2400.0), Some(55.0)));
    assert_eq!(rows[0].throttle.as_deref(), Some("none"));
    assert_eq!(rows[1].throttle.as_deref(), Some("mem_thermal+pl1"));
    assert!(rows[1].gpu_w.is_some_and(|w| close(w, 120.0)), "{:?}", rows[1]);
    // The counter of energy has begun again: no power rather than a negative one.
    assert_eq!(rows[2].gpu_w, None);
}

#[test]
fn a_host_is_remarked_on() {
    let tree = Tree::new("host.tree");
    let names = tree.open(&DeviceNames::default()).0.names();
    assert_eq!(names, ["/proc/stat", "cpufreq", "thermal_throttle"]);
    let rows = tree.rows(&DeviceNames::default());
    assert_eq!(rows[0].governor.as_deref(), Some("performance+powersave"));
    assert_eq!((rows[0].turbo, rows[0].load), (Some(true), Some(3.25)));
    // Each core's events, and those of the package once; the clock of the core at work.
    assert_eq!((rows[0].cpu_throttles, rows[0].cpu_mhz), (Some(17), Some(4100.0)));
    let during: Vec<&StateRow> = rows[1..].iter().collect();
    assert_eq!(others_share(&during), Some(0.3));
    // Two readings of the same moment have no share, nor has a reading alone.
    assert_eq!((others_share(&during[..1]), others_share(&[])), (None, None));

    let (_, run) = judged(&rows, 10.0, false);
    assert_eq!((run.cpu_throttles, run.all.others_share), (Some(2), Some(0.3)));
    let remarks = run.remarks.join("\n");
    for expected in [
        "heat held the processor's clock down 2 times",
        "other processes took 30 % of the processors' time",
        "the load was 3.2 on 2 cores when the run began",
        "the processors' governor is performance+powersave, not performance",
    ] {
        assert!(remarks.contains(expected), "{remarks}");
    }
    assert_eq!(run.remarks.len(), 4);
}

#[test]
fn a_machine_without_any_source_has_nothing_to_say() {
    let (all, run) = judged(
        &[Event::Start, Event::Begin, Event::End].map(|event| StateRow {
            time_s: f64::from(u8::from(event == Event::End)),
            event,
            block: (event != Event::Start).then_some(0),
            ..StateRow::default()
        }),
        10.0,
        true,
    );
    assert_eq!((all.len(), run.remarks.len(), run.all.throttle.clone()), (100, 0, None));
    assert!(all.iter().all(|(_, flags)| !flags.any()) && run.drift.is_none());
}
