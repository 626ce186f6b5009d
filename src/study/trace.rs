//! A bench as a time line: Chrome's trace events, which Perfetto and chrome://tracing show.

use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};

use super::bench::Sample;
use crate::error::{Error, Result};
use crate::frame::FrameTimes;
use crate::io::atomic::write_atomic;

/// Tracks, in the order they are shown.
const TRACKS: [&str; 3] = ["game step", "render step", "GPU"];

/// Writes the samples' time line to `path`, by way of a temporary name.
pub fn write(path: &Path, samples: &[Sample]) -> Result<()> {
    let text = serde_json::to_string(&time_line(samples)).map_err(|cause| Error::io(path, cause))?;
    write_atomic(path, |file| std::io::Write::write_all(file, text.as_bytes()))
}

/// One event a step and pass, in µs from the first game step. The device's clock is laid on the host's so that no pass ends
/// after its frame was seen to end, as late as that allows: off by what it took to see the promptest of all frames' ends.
pub fn time_line(samples: &[Sample]) -> Value {
    let names = TRACKS
        .iter()
        .enumerate()
        .map(|(tid, name)| json!({ "ph": "M", "pid": 1, "tid": tid, "name": "thread_name", "args": { "name": name } }));
    let mut events: Vec<Value> = names.collect();
    let Some(zero) = samples.iter().map(|s| s.times.marks.game[0]).min() else {
        return json!({ "traceEvents": events });
    };
    let us = |at: Instant| at.saturating_duration_since(zero).as_secs_f64() * 1e6;
    let offset =
        samples.iter().filter_map(|s| Some(us(s.times.marks.end) - 1e-3 * last_ns(&s.times)?)).reduce(f64::min);
    for sample in samples {
        let (times, marks) = (&sample.times, &sample.times.marks);
        let mut push = |tid: usize, name: &str, [begin, end]: [f64; 2]| {
            events.push(json!({
                "ph": "X", "pid": 1, "tid": tid, "name": name, "ts": begin, "dur": end - begin,
                "args": { "frame": times.i_frame, "loop": sample.of.name(), "block": sample.i_block, "warm_up": sample.warm_up },
            }));
        };
        push(0, "game", marks.game.map(us));
        push(1, "record", marks.record.map(us));
        for (pass, offset) in times.passes.iter().zip(offset.into_iter().cycle()) {
            push(2, pass.name, [pass.begin_ns, pass.end_ns].map(|ns| 1e-3 * ns + offset));
        }
        // From the game step's begin to the picture: frames in flight overlap, so they are no step of a track.
        for (ph, at) in [("b", marks.game[0]), ("e", marks.end)] {
            let id = format!("{}/{}", sample.i_block, times.i_frame);
            events
                .push(json!({ "ph": ph, "cat": "frame", "id": id, "pid": 1, "tid": 1, "name": "frame", "ts": us(at) }));
        }
    }
    json!({
        "traceEvents": events,
        "displayTimeUnit": "ms",
        "otherData": { "gpu_clock": "laid on the host's clock by the ends of frames" },
    })
}

/// When a frame's last pass ended, on the device's clock.
fn last_ns(times: &FrameTimes) -> Option<f64> {
    times.passes.iter().map(|p| p.end_ns).reduce(f64::max)
}
