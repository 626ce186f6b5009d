//! `nimbus view SCENE`.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};

use super::args::ViewArgs;
use super::capture_note;
use super::interrupt::{self, PATIENCE_WITH_CHILDREN};
use super::output::{self, header};
use super::scene::{device_choice, load_with_files, typed_overrides};
use crate::error::Result;
use crate::measure::stats::Summary;
use crate::viewer::scene_window::{
    self, LoopTimes, Options, RenderTimes, SceneSource, ShownTimes, WindowTimes,
};

/// Runs `nimbus view` until its window is closed.
///
/// # Errors
/// Fails if the scene is faulty, or no window or device can be opened.
pub fn run(args: &ViewArgs, stop: &'static AtomicBool) -> Result<()> {
    let (loaded, files) = load_with_files(&args.scene, &args.options)?;
    let source = SceneSource {
        path: args.scene.clone(),
        overrides: typed_overrides(&args.options.set, args.options.size),
        seed: args.options.seed,
        first: Arc::new(loaded.scene),
        files,
    };
    let _keeping = interrupt::close_window(PATIENCE_WITH_CHILDREN);
    let mut choice = device_choice(&args.options);
    choice.options.captured_frame = args.capture;
    let WindowTimes { frames: RenderTimes { loops, shown }, panels_ms, captured } =
        scene_window::run(Options {
            source,
            choice,
            skips: !args.options.no_skip,
            mode: args.present,
            n_frames: args.frames,
            stop,
            is_quiet: args.options.quiet,
            has_panels: !args.no_panels,
            captures: args.captures.clone(),
        })?;
    capture_note::print(captured, args.capture, args.options.quiet);
    if args.json {
        let rows: Vec<Value> = loops.iter().map(row).collect();
        let panels = Summary::of(&panels_ms).map(|s| numbers(&s));
        return output::object(&json!({
            "loops": rows, "panels": panels, "shown": shown.as_ref().map(shown_json),
        }));
    }
    let mut table = header(["loop", "panels", "n", "p50 ms", "p95", "p99", "max"]);
    table.extend(loops.iter().map(|t| {
        let s = &t.frame_ms;
        let times = [s.p50, s.p95, s.p99, s.max].map(|ms| format!("{ms:.3}"));
        let panels = if t.has_panels { "shown" } else { "hidden" };
        [vec![t.threading.name().to_owned(), panels.to_owned(), s.n.to_string()], times.to_vec()]
            .concat()
    }));
    let mut text = output::table(&table);
    if let Some(line) = shown.as_ref().and_then(shown_line) {
        text.push_str(&line);
    }
    output::text(&text)
}

/// Returns a line on the times at which pictures became visible; `None` without pictures.
fn shown_line(shown: &ShownTimes) -> Option<String> {
    let [interval, to_screen] = [shown.intervals()?, shown.to_screen()?];
    Some(format!(
        "{} pictures were seen, {} were replaced before; one each {:.3} ms (p99 {:.3}), {:.3} ms \
         after the start of its game step (p99 {:.3})\n",
        to_screen.n, shown.n_replaced, interval.p50, interval.p99, to_screen.p50, to_screen.p99
    ))
}

fn shown_json(shown: &ShownTimes) -> Value {
    json!({
        "n": shown.frames.len(),
        "n_replaced": shown.n_replaced,
        "interval_ms": shown.intervals().as_ref().map(numbers),
        "to_screen_ms": shown.to_screen().as_ref().map(numbers),
    })
}

fn row(times: &LoopTimes) -> Value {
    let mut row = json!({ "loop": times.threading.name(), "panels": times.has_panels });
    if let (Value::Object(row), Value::Object(numbers)) = (&mut row, numbers(&times.frame_ms)) {
        row.extend(numbers);
    }
    row
}

/// Returns statistics in ms as JSON.
fn numbers(s: &Summary) -> Value {
    json!({
        "n": s.n, "mean": s.mean, "min": s.min, "p50": s.p50, "p95": s.p95, "p99": s.p99,
        "max": s.max,
    })
}
