//! The time line of a bench: threads' zones that nest, passes inside their frames, on whichever
//! clock.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};

use nimbus::frame::{DeviceChoice, Stage};
use nimbus::gpu::{ClockFit, ClockSample};
use nimbus::io::scene_file;
use nimbus::measure::zones::{Collected, Zones};
use nimbus::model::scene::Threading;
use nimbus::timing::blocks::{self, BenchPlan, Sample};
use nimbus::timing::cases::{LoopChoice, cases};
use nimbus::timing::schedule::Rounds;
use nimbus::timing::{running, trace};
use serde_json::Value;
use tracing_subscriber::layer::SubscriberExt;

const N_FRAMES: u32 = 8;
/// Zones of all threads of this program are collected, and two benches at a time have two threads
/// of one name.
static ONE_BENCH: Mutex<()> = Mutex::new(());

/// Two loops of a lit scene whose particles the game thread moves, with every pass in every frame.
fn benched(zones: &Zones) -> (Vec<Sample>, Stage, Collected) {
    let _alone = ONE_BENCH.lock().unwrap_or_else(PoisonError::into_inner);
    let overrides = ["film.width=64", "film.height=48", "lighting.grid=16", "threads.simulate=cpu"]
        .map(str::to_owned);
    let loaded =
        scene_file::load(Path::new("tests/data/modes.toml"), &overrides, None).expect("a scene");
    let loops =
        LoopChoice { modes: &[Threading::Serial, Threading::Parallel], skip: false, saved: false };
    let cases = cases(loaded, &[], Some(N_FRAMES), loops);
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    let stage = Stage::new(cases[0].scene.clone(), &choice, false).expect("a stage");
    zones.take();
    let plan = BenchPlan {
        n_warm_up: 0,
        rounds: Rounds::Fixed(1),
        hash_frames: false,
        pictures: false,
        checked: None,
        cold_bytes: None,
        counts_invocations: false,
    };
    let outcome = Mutex::default();
    let ran = running::run(stage, &cases, &plan, &AtomicBool::new(false), &outcome, &mut |_| {});
    assert_eq!(ran.failure, None);
    let samples = std::mem::take(&mut blocks::lock(&outcome).samples);
    (samples, ran.stage.expect("a stage"), zones.take())
}

fn written(samples: &[Sample], zones: Option<&Collected>, clock: Option<ClockFit>) -> Value {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("trace.json");
    trace::write(&path, samples, zones, clock).expect("written");
    serde_json::from_slice(&std::fs::read(path).expect("the file")).expect("JSON")
}

fn events(trace: &Value) -> &Vec<Value> {
    trace["traceEvents"].as_array().expect("events")
}

/// [begin, end] in µs.
fn span(event: &Value) -> [f64; 2] {
    let number = |key: &str| event[key].as_f64().expect("a number");
    [number("ts"), number("ts") + number("dur")]
}

/// Names of the tracks by number.
fn tracks(trace: &Value) -> BTreeMap<u64, String> {
    let named = events(trace).iter().filter(|e| e["name"] == "thread_name");
    let name = |e: &Value| e["args"]["name"].as_str().expect("a name").to_owned();
    named.map(|e| (e["tid"].as_u64().expect("a number"), name(e))).collect()
}

/// Times are whole nanoseconds, written as µs: sums of two differ by roundings.
const ROUNDING_US: f64 = 2e-6;

/// Nothing begins before the thread's last open zone began, nor ends after it.
fn check_nesting(track: &str, mut zones: Vec<([f64; 2], &str)>) -> Result<(), String> {
    // Of zones that begin together the longest is the outermost.
    zones.sort_by(|(a, _), (b, _)| a[0].total_cmp(&b[0]).then(b[1].total_cmp(&a[1])));
    let mut open: Vec<([f64; 2], &str)> = Vec::new();
    for (zone, name) in zones {
        if zone[1] < zone[0] || zone[0] < 0.0 {
            return Err(format!("{track}: {name} {zone:?}"));
        }
        while open.last().is_some_and(|(outer, _)| outer[1] <= zone[0] + ROUNDING_US) {
            open.pop();
        }
        if let Some((outer, outer_name)) =
            open.last().filter(|(outer, _)| zone[1] > outer[1] + ROUNDING_US)
        {
            return Err(format!("{track}: {name} {zone:?} ends after {outer_name} {outer:?}"));
        }
        open.push((zone, name));
    }
    Ok(())
}

#[test]
fn the_nesting_check_finds_crossing_zones() {
    assert!(
        check_nesting("x", vec![([0.0, 5.0], "a"), ([1.0, 2.0], "b"), ([2.0, 5.0], "c")]).is_ok()
    );
    assert!(check_nesting("x", vec![([0.0, 5.0], "a"), ([4.0, 6.0], "b")]).is_err());
    assert!(check_nesting("x", vec![([3.0, 2.0], "a")]).is_err());
}

/// Passes lie between the submission of their frame and its end, `slack_us` aside.
fn check_passes(trace: &Value, slack_us: f64) {
    let events = events(trace);
    let recorded = |e: &&Value| e["tid"] == 1 && e["ph"] == "X";
    let mut n = 0;
    for record in events.iter().filter(recorded) {
        let of = |e: &&Value| {
            e["args"]["frame"] == record["args"]["frame"]
                && e["args"]["block"] == record["args"]["block"]
        };
        let id = format!("{}/{}", record["args"]["block"], record["args"]["frame"]);
        let end = events.iter().find(|e| e["ph"] == "e" && e["id"] == *id).expect("it ended")["ts"]
            .as_f64();
        let end = end.expect("a number");
        for pass in events.iter().filter(|e| e["tid"] == 2 && e["ph"] == "X").filter(of) {
            let [from, to] = span(pass);
            assert!(
                from >= span(record)[1] - slack_us && to <= end + slack_us,
                "{pass} of {record}, ended {end}"
            );
            n += 1;
        }
    }
    assert!(n >= 2 * 8 * N_FRAMES as usize, "{n} passes");
}

#[test]
fn zones_are_nested_and_passes_lie_in_their_frames() {
    let zones = Zones::default();
    tracing::subscriber::set_global_default(tracing_subscriber::registry().with(zones.clone()))
        .expect("the first");
    let (samples, stage, collected) = benched(&zones);
    let trace = written(&samples, Some(&collected), None);
    assert_eq!(trace["otherData"]["gpu_clock"], "laid on the host's clock by the ends of frames");
    assert_eq!(trace["otherData"]["zones_dropped"], 0);
    let tracks = tracks(&trace);
    let mut of_tracks: BTreeMap<&str, Vec<([f64; 2], &str)>> = BTreeMap::new();
    for event in events(&trace).iter().filter(|e| e["cat"] == "zone") {
        let track = &tracks[&event["tid"].as_u64().expect("a number")];
        of_tracks
            .entry(track)
            .or_default()
            .push((span(event), event["name"].as_str().expect("a name")));
    }
    for (track, zones) in &of_tracks {
        check_nesting(track, zones.clone()).unwrap_or_else(|what| panic!("{what}"));
    }
    // Every step of every frame, and every pass that ran, where it was done.
    let count =
        |track: &str, name: &str| of_tracks[track].iter().filter(|(_, zone)| *zone == name).count();
    let drawing = format!("thread {}", std::thread::current().name().expect("a name"));
    let n = N_FRAMES as usize;
    for name in ["game step", "setting", "visibility", "groups", "place particles"] {
        assert_eq!((count(&drawing, name), count("thread game", name)), (n, n), "{name}");
    }
    // After each loop its last frame is read back. After the last loop so are facets, light and
    // transmittance, then the picture, to see whether it shows anything. Counts read status, facets
    // and light, and the amounts of passes five buffers more. Each readback is recorded, submitted
    // and waited for.
    for (name, extra) in [
        ("render step", 0),
        ("plan", 0),
        ("upload", 0),
        ("record", 15),
        ("submit", 15),
        ("read back", 4),
    ] {
        let want = if name == "read back" { extra } else { 2 * n + extra };
        assert_eq!(count(&drawing, name), want, "{name}");
    }
    assert_eq!(count("thread wait", "wait"), n);
    let n_passes: usize = samples.iter().map(|s| s.times.passes.len()).sum();
    let of_passes =
        of_tracks[drawing.as_str()].iter().filter(|(_, name)| name.starts_with("record ")).count();
    assert_eq!(of_passes, n_passes);
    // Waiting is noticed a little after it is over, and the promptest frame's a little is what the
    // clock is off by.
    check_passes(&trace, 5000.0);
    stage.close().expect("no validation message");
}

#[test]
fn a_calibrated_clock_places_the_passes_exactly() {
    let (samples, stage, _) = benched(&Zones::default());
    let real = ClockFit::from_samples(&stage.device.read_clocks(4).expect("readings"));
    assert_eq!(real.is_some(), stage.info().clock_calibration.is_some());
    println!("{:?}: {real:?}", stage.info().clock_calibration);
    // A device whose own clock is unknown: the last pass of a frame ends when the frame does, so
    // read there.
    let pairs: Vec<ClockSample> = samples
        .iter()
        .filter_map(|s| Some((s, s.times.passes.last()?.end_ns)))
        .map(|(s, device_ns)| ClockSample {
            device_ns,
            host: s.times.marks.end,
            deviation_ns: 1000.0,
        })
        .collect();
    let clock = ClockFit::from_samples(&pairs).expect("frames");
    for clock in [Some(clock), real].into_iter().flatten() {
        let trace = written(&samples, None, Some(clock));
        let about = &trace["otherData"];
        assert_eq!(about["gpu_clock"], "calibrated with the host's clock");
        assert_eq!(about["gpu_clock_deviation_us"], 1e-3 * clock.deviation_ns);
        check_passes(&trace, 1e-3 * clock.deviation_ns + 1.0);
    }
    stage.close().expect("no validation message");
}
