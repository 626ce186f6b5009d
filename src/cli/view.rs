//! `nimbus view SCENE`.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};

use super::args::{PresentArg, ViewArgs};
use super::{device_choice, load, output};
use crate::error::Result;
use crate::gpu::PresentMode;
use crate::viewer::screen::LoopTimes;
use crate::viewer::wanted::help;
use crate::viewer::window::{self, Options};

pub fn run(args: &ViewArgs, stop: &'static AtomicBool) -> Result<()> {
    let loaded = load(&args.scene, &args.options)?;
    if !args.options.quiet {
        eprint!("{}", help());
    }
    let mode = match args.present {
        PresentArg::Fifo => PresentMode::Fifo,
        PresentArg::Mailbox => PresentMode::Mailbox,
        PresentArg::Immediate => PresentMode::Immediate,
    };
    let times = window::run(Options {
        scene: Arc::new(loaded.scene),
        scene_path: args.scene.clone(),
        choice: device_choice(&args.options),
        skip: !args.options.no_skip,
        mode,
        n_frames: args.frames,
        stop,
        quiet: args.options.quiet,
    })?;
    if args.json {
        let rows: Vec<Value> = times.iter().map(row).collect();
        return output::text(&format!("{:#}\n", json!({ "loops": rows })));
    }
    let mut table = vec![["loop", "n", "p50 ms", "p95", "p99", "max"].map(str::to_owned).to_vec()];
    table.extend(times.iter().map(|t| {
        let s = &t.frame_ms;
        let times = [s.p50, s.p95, s.p99, s.max].map(|ms| format!("{ms:.3}"));
        [vec![t.threading.name().to_owned(), s.n.to_string()], times.to_vec()].concat()
    }));
    output::text(&output::table(&table))
}

fn row(times: &LoopTimes) -> Value {
    let s = &times.frame_ms;
    json!({
        "loop": times.threading.name(), "n": s.n, "mean": s.mean, "min": s.min, "p50": s.p50, "p95": s.p95, "p99": s.p99,
        "max": s.max,
    })
}
