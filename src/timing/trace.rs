//! A bench as a time line: Chrome's trace events, which Perfetto and chrome://tracing show.

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};

use crate::error::Result;
use crate::frame::FrameTimes;
use crate::gpu::ClockFit;
use crate::io::atomic::write_atomic;
use crate::measure::zones::Collected;
use crate::timing::bench::Sample;

/// Tracks, in the order they are shown; those of the threads' zones follow.
const TRACKS: [&str; 3] = ["game step", "render step", "GPU"];

/// What there is beside the samples.
#[derive(Default)]
pub struct Beside<'a> {
    /// What the threads did.
    pub zones: Option<&'a Collected>,
    /// The device's clock by the host's, where it can be read.
    pub clock: Option<ClockFit>,
}

/// What takes the events, one after the other: all of them at once would be a hundred times the
/// size of the zones.
type Emit<'a> = dyn FnMut(Value) -> std::io::Result<()> + 'a;

/// Writes the samples' time line to `path`, by way of a temporary name: one event a step, pass and
/// zone, in µs from the first game step.
///
/// The device's clock is laid on the host's by calibrated timestamps, where it has them; else so
/// that no pass ends after its frame was seen to end, as late as that allows: off by what it took
/// to see the promptest of all frames' ends.
pub fn write(path: &Path, samples: &[Sample], beside: &Beside<'_>) -> Result<()> {
    write_atomic(path, |file| {
        let mut separator = "{\"traceEvents\":[\n";
        emit_all(samples, beside, &mut |event| {
            file.write_all(separator.as_bytes())?;
            separator = ",\n";
            Ok(serde_json::to_writer(&mut *file, &event)?)
        })?;
        write!(file, "\n],\n\"displayTimeUnit\":\"ms\",\"otherData\":{}}}\n", about(beside))
    })
}

fn emit_all(samples: &[Sample], beside: &Beside<'_>, emit: &mut Emit<'_>) -> std::io::Result<()> {
    TRACKS.iter().enumerate().flat_map(|(tid, name)| track(tid, name)).try_for_each(&mut *emit)?;
    let Some(zero) = samples.iter().map(|s| s.times.marks.game[0]).min() else { return Ok(()) };
    let us = |at: Instant| at.saturating_duration_since(zero).as_secs_f64() * 1e6;
    let by_ends = samples
        .iter()
        .filter_map(|s| Some(us(s.times.marks.end) - 1e-3 * last_ns(&s.times)?))
        .reduce(f64::min);
    let gpu_us = |device_ns: f64| match beside.clock {
        Some(clock) => 1e-3 * clock.ns_since(zero, device_ns),
        // There is an offset where there is a pass.
        None => 1e-3 * device_ns + by_ends.unwrap_or(0.0),
    };
    // Frames to warm up with come again.
    let (mut i_block, mut i_in_block) = (0, 0u32);
    for sample in samples {
        if std::mem::replace(&mut i_block, sample.i_block) != sample.i_block {
            i_in_block = 0;
        }
        let id = format!("{}/{i_in_block}", sample.i_block);
        i_in_block += 1;
        let (times, marks) = (&sample.times, &sample.times.marks);
        let event = |tid: usize, name: &str, [begin, end]: [f64; 2]| {
            json!({
                "ph": "X", "pid": 1, "tid": tid, "name": name, "ts": begin, "dur": end - begin,
                "args": { "frame": times.i_frame, "loop": sample.of.name(), "block": sample.i_block, "warm_up": sample.warm_up },
            })
        };
        emit(event(0, "game", marks.game.map(us)))?;
        emit(event(1, "record", marks.record.map(us)))?;
        for pass in &times.passes {
            emit(event(2, pass.name, [pass.begin_ns, pass.end_ns].map(gpu_us)))?;
        }
        // From the game step's begin to the picture: frames in flight overlap, so they are no step
        // of a track.
        for (ph, at) in [("b", marks.game[0]), ("e", marks.end)] {
            emit(
                json!({ "ph": ph, "cat": "frame", "id": id, "pid": 1, "tid": 1, "name": "frame", "ts": us(at) }),
            )?;
        }
    }
    beside.zones.map_or(Ok(()), |zones| emit_zones(zones, zero, emit))
}

/// The name of a track and its place among them.
fn track(tid: usize, name: &str) -> [Value; 2] {
    let about = |what: &str, args: Value| json!({ "ph": "M", "pid": 1, "tid": tid, "name": what, "args": args });
    [
        about("thread_name", json!({ "name": name })),
        about("thread_sort_index", json!({ "sort_index": tid })),
    ]
}

/// A track a thread. What was before the first game step (the scene being made ready) is left out.
fn emit_zones(of: &Collected, zero: Instant, emit: &mut Emit<'_>) -> std::io::Result<()> {
    let tid = |i_thread: usize| TRACKS.len() + i_thread;
    let mut tracks = of
        .threads
        .iter()
        .enumerate()
        .flat_map(|(i, name)| track(tid(i), &format!("thread {name}")));
    tracks.try_for_each(&mut *emit)?;
    let zero_ns = zero.saturating_duration_since(of.epoch).as_nanos() as u64;
    for zone in of.zones.iter().filter(|zone| zone.begin_ns >= zero_ns) {
        let [begin, end] = [zone.begin_ns, zone.end_ns].map(|ns| 1e-3 * (ns - zero_ns) as f64);
        emit(json!({
            "ph": "X", "cat": "zone", "pid": 1, "tid": tid(usize::from(zone.i_thread)),
            "name": of.names[usize::from(zone.i_name)], "ts": begin, "dur": end - begin,
        }))?;
    }
    Ok(())
}

/// How far the time line can be trusted.
fn about(beside: &Beside<'_>) -> Value {
    let mut about = match beside.clock {
        Some(clock) => json!({
            "gpu_clock": "calibrated with the host's clock",
            "gpu_clock_deviation_us": 1e-3 * clock.deviation_ns,
            "gpu_clock_rate": clock.rate,
            "gpu_clock_readings": clock.n_pairs,
        }),
        None => json!({ "gpu_clock": "laid on the host's clock by the ends of frames" }),
    };
    if let Some(zones) = beside.zones {
        about["zones"] = json!(zones.zones.len());
        about["zones_dropped"] = json!(zones.n_dropped);
    }
    about
}

/// When a frame's last pass ended, on the device's clock.
fn last_ns(times: &FrameTimes) -> Option<f64> {
    times.passes.iter().map(|p| p.end_ns).reduce(f64::max)
}
