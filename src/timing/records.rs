//! Results on disk: `run.json` (what was run, where, and what it says) and `frames.csv` (every
//! frame, raw).
//!
//! The form of `run.json` is docs/run.schema.json; a change of meaning, or of a key, raises
//! `SCHEMA_VERSION`. Both appear whole and together, or not at all ([`crate::io::folder`]).

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::frame::counts::Counts;
use crate::io::atomic::write_atomic;
use crate::io::folder::{check_writable, replace_files};
use crate::io::text_file::{RECORD_LIMIT, read_result};
use crate::measure::lows::Lows;
use crate::measure::stats::Summary;
use crate::timing::cases::sweep_text;
use crate::timing::companions::{self, Beside};
use crate::timing::machine::{Clocks, Cpu, Device};
use crate::timing::overlap::Overlap;
use crate::timing::parts::PartRecord;

pub const SCHEMA_VERSION: u32 = 3;
pub const RUN_FILE: &str = "run.json";
pub const FRAMES_FILE: &str = "frames.csv";

/// The whole of `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    pub schema: u32,
    /// Version of nimbus.
    pub nimbus: String,
    /// Git revision that was built; "unknown" outside a checkout, "-dirty" behind it where sources
    /// differ.
    pub revision: String,
    /// Start of the run, UTC, ISO 8601.
    pub date: String,
    pub command: Vec<String>,
    /// SHA-256 of the resolved scene, in hex.
    pub scene_hash: String,
    /// The scene with every default filled in.
    pub scene: serde_json::Value,
    pub device: Device,
    pub cpu: Cpu,
    /// Variables that change what drivers do.
    pub environment: BTreeMap<String, String>,
    pub clocks: Clocks,
    /// Every block in the order they ran: A B B A and so on, so that drift falls on all alike.
    pub block_order: Vec<Block>,
    /// One a phase and point of a sweep, in their order; a scene with neither has one.
    pub cases: Vec<Case>,
    /// What each case's "auto" came to, and by what: times and errors at its first frame.
    #[serde(default)]
    pub chosen: Vec<String>,
    /// What the nodes of a farm timed, part by part; empty where one process ran all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<PartRecord>,
    /// Ctrl-C, or an error, came before the end; what is here was finished.
    pub interrupted: bool,
}

/// A run of frames without a break.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Block {
    /// Number of its case.
    pub case: usize,
    /// "serial" or "parallel".
    pub threading: String,
    pub skip: bool,
}

/// The scene in one of its phases, at one point of the sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Case {
    pub phase: Option<String>,
    pub sweep: Vec<Setting>,
    /// SHA-256 of the resolved scene at this point of the sweep, with its files and phases.
    pub scene_hash: String,
    pub particles: u64,
    /// Of the film, pixels.
    pub width: u32,
    pub height: u32,
    pub modes: Vec<Mode>,
    /// Parallel against serial frame time, where both ran; below 1 parallel is faster.
    pub ratio: Option<Ratio>,
    /// What overlap could gain and what was gained; null where the serial loop did not run.
    pub overlap: Option<Overlap>,
    /// What leaving out saved; null where frames that leave nothing out were not timed.
    pub skipping: Option<Skipping>,
    /// What of its last frame is odd; null where it did not run to its end.
    #[serde(default)]
    pub counts: Option<Counts>,
}

impl Case {
    /// Phase and sweep in words; empty where there is neither.
    pub fn name(&self) -> String {
        case_name(self.phase.as_deref().unwrap_or_default(), &sweep_text(&self.sweep))
    }
}

/// "phase, key=value", or one of the two, or nothing.
pub fn case_name(phase: &str, sweep: &str) -> String {
    [phase, sweep].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setting {
    pub key: String,
    pub value: String,
}

/// Device time of a frame, ms, in means: what was saved is their difference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Skipping {
    pub gpu_ms: f64,
    pub gpu_no_skip_ms: f64,
    /// Whether the last frames are the same, to the byte; null where one was not reached.
    pub same_bytes: Option<bool>,
}

/// A list of times, and the 95 % bootstrap interval of its median; null where there are too few
/// frames for one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    #[serde(flatten)]
    pub of: Summary,
    pub p50_low: Option<f64>,
    pub p50_high: Option<f64>,
}

/// One way of running the scene. A summary is null where nothing finite was measured. Warm-up
/// frames are in none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// "serial" or "parallel".
    pub threading: String,
    /// False where every pass was run in every frame.
    pub skip: bool,
    /// "gpu" or "cpu": who moves the particles.
    pub simulate: String,
    pub frames: usize,
    pub warm_up: usize,
    pub blocks: usize,
    /// From the end of one frame to the end of the next: what a viewer would see.
    pub frame_ms: Option<Measured>,
    /// "1 % low" frame rates of `frame_ms`, by all three definitions.
    pub frame_lows: Option<Lows>,
    pub game_ms: Option<Measured>,
    pub record_ms: Option<Measured>,
    pub submit_ms: Option<Measured>,
    pub wait_ms: Option<Measured>,
    /// Recording, submission and the wait for the device.
    pub render_ms: Option<Measured>,
    pub gpu_ms: Option<Measured>,
    /// From the start of a frame's game step to the end of its render step.
    pub latency_ms: Option<Measured>,
    /// Mean of the frames that the device still had when it was handed one.
    pub queue_depth: Option<f64>,
    /// Particles that were drawn in a frame, which distance and view make fewer: least, mean and
    /// most.
    pub drawn: Option<[f64; 3]>,
    /// Frames that showed what is far from a picture that an earlier one made.
    pub impostors_reused: usize,
    pub passes: Vec<Pass>,
    /// SHA-256 of the last frame's pixels, where it was taken.
    pub image_hash: Option<String>,
    /// Greatest median frame time of a block by the least: what the machine's own changes come to.
    /// null of one block.
    pub block_spread: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    pub name: String,
    /// Over the frames it ran in; null where it never ran or was not timed.
    pub p50_ms: Option<f64>,
    /// Of the device time of all passes.
    pub share: Option<f64>,
    pub n_run: usize,
    pub n_skipped: usize,
    /// Why it was skipped, the last time.
    pub reason: Option<String>,
    /// Every reason it was skipped for, the most frequent first.
    pub reasons: Vec<Reason>,
    /// Device time that skipping it saved a frame: its median where nothing is skipped, in the
    /// share of the frames that skipped it. null where that was not measured.
    pub saved_ms: Option<f64>,
}

/// Why a pass was skipped, and in how many frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reason {
    pub reason: String,
    pub n: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// Median parallel frame time by median serial frame time.
    pub parallel_by_serial: f64,
    /// 95 % bootstrap interval; null where there are too few frames for one.
    pub low: Option<f64>,
    pub high: Option<f64>,
}

/// One line of `frames.csv`. Times in ms; NaN and None become an empty field.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameRow {
    /// Empty where the scene has no phases.
    pub phase: String,
    /// "key=value, key=value"; empty without a sweep.
    pub sweep: String,
    pub threading: String,
    pub skip: bool,
    /// Blocks count over the whole run, cases and loops taking turns.
    pub block: usize,
    /// Frame of the scene.
    pub frame: u32,
    /// Scene time.
    pub time_s: f64,
    pub warm_up: bool,
    pub frame_ms: f64,
    pub game_ms: f64,
    pub record_ms: f64,
    pub submit_ms: f64,
    pub wait_ms: f64,
    pub gpu_ms: Option<f64>,
    pub latency_ms: f64,
    /// Frames that the device still had when it was handed this one.
    pub queue_depth: usize,
    /// Particles that were drawn.
    pub n_drawn: u32,
    /// Names of the passes that ran, joined by "+"; what a frame left out is the others.
    pub ran: String,
    /// In the order of the names handed to `write_results`; None where skipped.
    pub pass_ms: Vec<Option<f64>>,
    pub image_hash: Option<String>,
}

pub(crate) const FRAME_COLUMNS: [&str; 19] = [
    "i_row",
    "phase",
    "sweep",
    "threading",
    "skip",
    "block",
    "frame",
    "time_s",
    "warm_up",
    "frame_ms",
    "game_ms",
    "record_ms",
    "submit_ms",
    "wait_ms",
    "gpu_ms",
    "latency_ms",
    "queue_depth",
    "n_drawn",
    "ran",
];

/// Makes the folder results will go to, before anything is measured. What exists is refused unless
/// `force`; then its results are replaced when the new ones are there, and other files in it are
/// left alone.
pub fn prepare_out_dir(path: &Path, force: bool) -> Result<()> {
    match fs::symlink_metadata(path) {
        Ok(_) if !force => {
            let path = path.display();
            Err(Error::usage(format!(
                "{path}: exists already; name another folder, or add --force to overwrite it"
            )))
        }
        Ok(_) if !path.is_dir() => Err(Error::io(path, "is not a folder; results need one")),
        Ok(_) => check_writable(path),
        Err(_) => fs::create_dir_all(path).map_err(|cause| Error::io(path, cause)),
    }
}

/// Both files, at once: never a `run.json` beside another run's frames.
pub fn write_results(
    out_dir: &Path,
    run: &Run,
    pass_names: &[String],
    rows: &[FrameRow],
) -> Result<()> {
    write_results_with(out_dir, run, pass_names, rows, &Beside::default())
}

/// The same, and at once with them what lies beside them; of an earlier run's pictures and charts
/// none is left.
pub fn write_results_with(
    out_dir: &Path,
    run: &Run,
    pass_names: &[String],
    rows: &[FrameRow],
    beside: &Beside,
) -> Result<()> {
    let mut names = companions::names_in(out_dir);
    names.extend([FRAMES_FILE, RUN_FILE].map(str::to_owned));
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    // Those that are only now made, too: RUN_FILE stays the last.
    let made = beside.names();
    let all: Vec<&str> = made
        .iter()
        .map(String::as_str)
        .filter(|name| !names.contains(name))
        .chain(names.clone())
        .collect();
    replace_files(out_dir, &all, |folder| {
        beside.write(folder)?;
        write_frames(&folder.join(FRAMES_FILE), pass_names, rows)?;
        write_run(&folder.join(RUN_FILE), run)
    })
}

pub fn write_run(path: &Path, run: &Run) -> Result<()> {
    let mut text = serde_json::to_string_pretty(run).map_err(|cause| Error::io(path, cause))?;
    text.push('\n');
    write_atomic(path, |file| file.write_all(text.as_bytes()))
}

/// Reads `run.json`, or the `run.json` in a folder.
pub fn read_run(path: &Path) -> Result<Run> {
    let path = if path.is_dir() { path.join(RUN_FILE) } else { path.to_owned() };
    parse_run(&read_result(&path, RECORD_LIMIT)?, &path)
}

/// A `run.json` from its text; `path` is for messages.
pub fn parse_run(text: &str, path: &Path) -> Result<Run> {
    let broken = |cause| Error::io(path, format!("not JSON, or not all of it: {cause}"));
    let value: serde_json::Value = serde_json::from_str(text).map_err(broken)?;
    // The version is looked at first: of another version any other complaint would mislead.
    match value.get("schema").and_then(serde_json::Value::as_u64) {
        Some(version) if version == u64::from(SCHEMA_VERSION) => {}
        Some(version) => {
            return Err(Error::io(
                path,
                format!("results of schema {version}; this nimbus reads {SCHEMA_VERSION}"),
            ));
        }
        None => {
            return Err(Error::io(path, "not a run.json of nimbus: it names no schema version"));
        }
    }
    serde_json::from_value(value)
        .map_err(|cause| Error::io(path, format!("not a run.json of nimbus: {cause}")))
}

pub fn write_frames(path: &Path, pass_names: &[String], rows: &[FrameRow]) -> Result<()> {
    let failed = |cause: csv::Error| Error::io(path, cause);
    let mut writer = csv::Writer::from_writer(Vec::new());
    let columns = FRAME_COLUMNS.iter().map(|name| (*name).to_owned());
    let pass_columns = pass_names.iter().map(|name| format!("gpu_{name}_ms"));
    writer
        .write_record(columns.chain(pass_columns).chain(["image_hash".to_owned()]))
        .map_err(failed)?;
    for (i_row, row) in rows.iter().enumerate() {
        if row.pass_ms.len() != pass_names.len() {
            let (got, wanted) = (row.pass_ms.len(), pass_names.len());
            return Err(Error::io(
                path,
                format!("row {i_row} has {got} pass times for {wanted} passes"),
            ));
        }
        writer.write_record(fields(i_row, row)).map_err(failed)?;
    }
    let bytes = writer.into_inner().map_err(|cause| Error::io(path, cause))?;
    write_atomic(path, |file| file.write_all(&bytes))
}

fn fields(i_row: usize, row: &FrameRow) -> Vec<String> {
    let mut fields = vec![
        i_row.to_string(),
        row.phase.clone(),
        row.sweep.clone(),
        row.threading.clone(),
        row.skip.to_string(),
        row.block.to_string(),
        row.frame.to_string(),
        number(Some(row.time_s)),
        row.warm_up.to_string(),
        number(Some(row.frame_ms)),
        number(Some(row.game_ms)),
        number(Some(row.record_ms)),
        number(Some(row.submit_ms)),
        number(Some(row.wait_ms)),
        number(row.gpu_ms),
        number(Some(row.latency_ms)),
        row.queue_depth.to_string(),
        row.n_drawn.to_string(),
        row.ran.clone(),
    ];
    fields.extend(row.pass_ms.iter().map(|ms| number(*ms)));
    fields.push(row.image_hash.clone().unwrap_or_default());
    fields
}

/// The shortest text that reads back as the same f64.
fn number(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map(|value| value.to_string()).unwrap_or_default()
}
