//! Results of an imaginary bench.

use std::collections::BTreeMap;
use std::path::Path;

use nimbus::error::Result;
use nimbus::gpu::PassTimes;
use nimbus::io::result_folder::Existing;
use nimbus::timing::attachments::Attachments;
use nimbus::timing::frame_rows::{FrameRow, FrameTable};
use nimbus::timing::json::ResultFile;
use nimbus::timing::machine::{Clocks, Cpu, Device};
use nimbus::timing::records::{Block, Case, Mode, Run};
use nimbus::timing::results::{open_results, write_results};
use serde_json::json;

/// Writes results over earlier ones, which tests may have changed.
#[allow(dead_code, reason = "not every test binary writes results")]
pub fn write(folder: &Path, run: &Run, table: &FrameTable) -> Result<()> {
    let mut folder = open_results(folder, Existing::Extend, run.cases.len(), false)?;
    write_results(&mut folder, run, table, &Attachments::default())
}

/// Returns a loop of `frames` timed frames without measurements.
pub fn mode(threading: &str, frames: usize, warm_up: usize) -> Mode {
    Mode {
        threading: threading.to_owned(),
        skip: true,
        simulate: "gpu".to_owned(),
        frames,
        warm_up,
        blocks: 1,
        frame_ms: None,
        frame_lows: None,
        game_ms: None,
        record_ms: None,
        submit_ms: None,
        wait_ms: None,
        render_ms: None,
        gpu_ms: None,
        latency_ms: None,
        queue_depth: None,
        empty_frames: Some(0),
        impostors_reused: 0,
        drawn: None,
        passes: Vec::new(),
        image_hash: None,
        block_spread: None,
    }
}

/// Returns a run of one case with a block per loop.
pub fn run(modes: Vec<Mode>) -> Run {
    let block =
        |m: &Mode| Block { case: 0, threading: m.threading.clone(), skip: m.skip, start: 0 };
    Run {
        schema: Run::SCHEMA,
        nimbus: "0.1.0".to_owned(),
        revision: "0123456789ab".to_owned(),
        tool: None,
        date: "2024-02-29T12:34:56Z".to_owned(),
        command: ["nimbus", "bench", "a.toml", "--out", "a"].map(str::to_owned).to_vec(),
        scene_hash: "ab".repeat(32),
        scene: json!({ "lighting": { "grid": 64 }, "cloud": [{ "wind": [0.5, 0.0, 0.0] }] }),
        device: Device {
            name: "llvmpipe".to_owned(),
            driver: "Mesa 22.3.6".to_owned(),
            api: "1.3.230".to_owned(),
            kind: "cpu".to_owned(),
            uuid: "00".repeat(16),
        },
        cpu: Cpu { model: "a processor".to_owned(), logical_cores: 2 },
        environment: BTreeMap::from([("LP_NUM_THREADS".to_owned(), "1".to_owned())]),
        clocks: Clocks {
            resolution_ns: 1.0,
            overhead_ns: 22.5,
            timestamp_period_ns: None,
            pass_times: PassTimes::Drained,
            timestamp_overhead_ns: None,
        },
        block_order: modes.iter().map(block).collect(),
        cases: vec![Case {
            phase: None,
            sweep: Vec::new(),
            scene_hash: "cd".repeat(32),
            particles: 554,
            width: 800,
            height: 600,
            modes,
            ratio: None,
            overlap: None,
            skipping: None,
            counts: None,
            figure: None,
            check: None,
            precision: None,
            state: None,
            invocations: None,
        }],
        stages: None,
        chosen: Vec::new(),
        parts: Vec::new(),
        interrupted: false,
        precision: None,
        state: None,
        ceilings: None,
        cold_bytes: None,
    }
}

/// Returns the row of frame `frame`, timed, of 1 ms.
#[allow(dead_code, reason = "not every test binary writes frames")]
pub fn row(threading: &str, frame: u32) -> FrameRow {
    FrameRow {
        phase: String::new(),
        sweep: String::new(),
        threading: threading.to_owned(),
        skip: true,
        block: 0,
        frame,
        time_s: f64::from(frame) * 0.1,
        warm_up: false,
        frame_ms: 1.0,
        game_ms: 0.25,
        record_ms: 0.125,
        submit_ms: 0.125,
        wait_ms: 0.5,
        gpu_ms: None,
        latency_ms: 1.0,
        queue_depth: 1,
        n_drawn: 7,
        ran: "sort+sprites".to_owned(),
        pass_ms: Vec::new(),
        image_hash: None,
        end_s: None,
        throttled: None,
        discarded: false,
    }
}
