//! A bench as a time line of Chrome's trace events, which Perfetto and chrome://tracing show.

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};

use super::blocks::Sample;
use crate::error::Result;
use crate::frame::FrameTimes;
use crate::gpu::ClockFit;
use crate::io::atomic::write_atomic;
use crate::measure::zones::Collected;

/// The first tracks, in the order of display; the tracks of the threads' zones follow.
const TRACKS: [&str; 3] = ["game step", "render step", "GPU"];

/// Receives the events one by one, because all together take a hundred times the memory of the
/// zones.
type Emit<'a> = dyn FnMut(Value) -> std::io::Result<()> + 'a;

/// Writes the time line of the samples to `path`: one event for each step, pass and zone.
///
/// `zones` are the spans of the threads; `clock` maps the device's clock to the host's. Without
/// `clock` the two are aligned so that every pass ends before the end of its frame was seen, as
/// late as that allows.
///
/// *Units*: µs from the first game step.
///
/// # Errors
/// Fails if the file cannot be written.
pub fn write(
    path: &Path,
    samples: &[Sample],
    zones: Option<&Collected>,
    clock: Option<ClockFit>,
) -> Result<()> {
    write_atomic(path, |file| {
        let mut separator = "{\"traceEvents\":[\n";
        let emit = &mut |event| {
            file.write_all(separator.as_bytes())?;
            separator = ",\n";
            Ok(serde_json::to_writer(&mut *file, &event)?)
        };
        for (tid, name) in TRACKS.iter().enumerate() {
            emit_track(tid, name, emit)?;
        }
        if let Some(zero) = samples.iter().map(|s| s.times.marks.game[0]).min() {
            emit_frames(samples, zero, clock, emit)?;
            zones.map_or(Ok(()), |zones| emit_zones(zones, zero, emit))?;
        }
        let about = about(zones, clock);
        write!(file, "\n],\n\"displayTimeUnit\":\"ms\",\"otherData\":{about}}}\n")
    })
}

fn emit_frames(
    samples: &[Sample],
    zero: Instant,
    clock: Option<ClockFit>,
    emit: &mut Emit<'_>,
) -> std::io::Result<()> {
    let us = |at: Instant| at.saturating_duration_since(zero).as_secs_f64() * 1e6;
    let last_ns = |t: &FrameTimes| t.passes.iter().map(|p| p.end_ns).reduce(f64::max);
    let offset_us = samples
        .iter()
        .filter_map(|s| Some(us(s.times.marks.end) - 1e-3 * last_ns(&s.times)?))
        .reduce(f64::min)
        .unwrap_or(0.0);
    let gpu_us = |device_ns: f64| {
        clock.map_or(1e-3 * device_ns + offset_us, |c| 1e-3 * c.ns_since(zero, device_ns))
    };
    // The number of a frame is not unique: warm-up frames are frames of the scene too.
    let (mut i_block, mut i_in_block) = (0, 0u32);
    for sample in samples {
        if std::mem::replace(&mut i_block, sample.i_block) != sample.i_block {
            i_in_block = 0;
        }
        let id = format!("{}/{i_in_block}", sample.i_block);
        i_in_block += 1;
        let (times, marks) = (&sample.times, &sample.times.marks);
        let args = json!({
            "frame": times.i_frame, "loop": sample.of.name(), "block": sample.i_block,
            "warm_up": sample.warm_up,
        });
        let event = |tid: usize, name: &str, [begin, end]: [f64; 2]| {
            json!({
                "ph": "X", "pid": 1, "tid": tid, "name": name, "ts": begin, "dur": end - begin,
                "args": args,
            })
        };
        emit(event(0, "game", marks.game.map(us)))?;
        emit(event(1, "record", marks.record.map(us)))?;
        for pass in &times.passes {
            emit(event(2, pass.name, [pass.begin_ns, pass.end_ns].map(gpu_us)))?;
        }
        // Frames in flight overlap, so that a frame is an asynchronous event of no track.
        for (ph, at) in [("b", marks.game[0]), ("e", marks.end)] {
            emit(json!({
                "ph": ph, "cat": "frame", "id": id, "pid": 1, "tid": 1, "name": "frame",
                "ts": us(at),
            }))?;
        }
    }
    Ok(())
}

/// Emits the name of a track and its place among the tracks.
fn emit_track(tid: usize, name: &str, emit: &mut Emit<'_>) -> std::io::Result<()> {
    let (name, place) = (json!({ "name": name }), json!({ "sort_index": tid }));
    for (what, args) in [("thread_name", name), ("thread_sort_index", place)] {
        emit(json!({ "ph": "M", "pid": 1, "tid": tid, "name": what, "args": args }))?;
    }
    Ok(())
}

/// Emits one track a thread, without the zones before the first game step, which prepare the scene.
fn emit_zones(of: &Collected, zero: Instant, emit: &mut Emit<'_>) -> std::io::Result<()> {
    for (i, name) in of.threads.iter().enumerate() {
        emit_track(TRACKS.len() + i, &format!("thread {name}"), emit)?;
    }
    let zero_ns = zero.saturating_duration_since(of.epoch).as_nanos() as u64;
    for zone in of.zones.iter().filter(|zone| zone.begin_ns >= zero_ns) {
        let [begin, end] = [zone.begin_ns, zone.end_ns].map(|ns| 1e-3 * (ns - zero_ns) as f64);
        emit(json!({
            "ph": "X", "cat": "zone", "pid": 1, "tid": TRACKS.len() + usize::from(zone.i_thread),
            "name": of.names[usize::from(zone.i_name)], "ts": begin, "dur": end - begin,
        }))?;
    }
    Ok(())
}

/// Returns how the clocks were aligned, and how many zones there are.
fn about(zones: Option<&Collected>, clock: Option<ClockFit>) -> Value {
    let mut about = match clock {
        Some(clock) => json!({
            "gpu_clock": "calibrated with the host's clock",
            "gpu_clock_deviation_us": 1e-3 * clock.deviation_ns,
            "gpu_clock_rate": clock.rate,
            "gpu_clock_readings": clock.n_samples,
        }),
        None => json!({ "gpu_clock": "laid on the host's clock by the ends of frames" }),
    };
    if let Some(zones) = zones {
        about["zones"] = json!(zones.zones.len());
        about["zones_dropped"] = json!(zones.n_dropped);
    }
    about
}
