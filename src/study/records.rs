//! Results on disk: `run.json` (what was run, where, and what it says) and `frames.csv` (every frame, raw).
//!
//! The form of `run.json` is docs/run.schema.json; a change of meaning, or of a key, raises `SCHEMA_VERSION`.
//! Both appear whole and together, or not at all ([`crate::io::folder`]).

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use super::overlap::Overlap;
use crate::error::{Error, Result};
use crate::io::atomic::write_atomic;
use crate::io::folder::{check_writable, replace_files};
use crate::measure::bootstrap::Interval;
use crate::measure::clock::ClockQuality;
use crate::measure::lows::Lows;
use crate::measure::stats::Summary;

pub const SCHEMA_VERSION: u32 = 2;
pub const RUN_FILE: &str = "run.json";
pub const FRAMES_FILE: &str = "frames.csv";

/// The whole of `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    pub schema: u32,
    /// Version of nimbus.
    pub nimbus: String,
    /// Git revision that was built; "unknown" outside a checkout, "-dirty" behind it where sources differ.
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
    /// The threading of every block, in the order they ran: A B B A and so on, so that drift falls on both alike.
    pub block_order: Vec<String>,
    pub modes: Vec<Mode>,
    /// Parallel against serial frame time, where both ran; below 1 parallel is faster.
    pub ratio: Option<Ratio>,
    /// What overlap could gain and what was gained; null where the serial loop did not run.
    pub overlap: Option<Overlap>,
    /// Ctrl-C came before the end; what is here was finished.
    pub interrupted: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Device {
    pub name: String,
    pub driver: String,
    /// Vulkan version, "1.3.230".
    pub api: String,
    /// "discrete", "integrated", "virtual", "cpu" or "other".
    #[serde(rename = "type")]
    pub kind: String,
    /// 32 hex digits.
    pub uuid: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cpu {
    pub model: String,
    /// Logical cores that this process may use.
    pub logical_cores: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Clocks {
    pub resolution_ns: f64,
    pub overhead_ns: f64,
    /// Of the device; null where it has no timestamps.
    pub timestamp_period_ns: Option<f64>,
}

/// One way of running the scene. A summary is null where nothing finite was measured. Warm-up frames are in none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// "serial" or "parallel".
    pub threading: String,
    /// "gpu" or "cpu": who moves the particles.
    pub simulate: String,
    pub frames: usize,
    pub warm_up: usize,
    pub blocks: usize,
    /// From the end of one frame to the end of the next: what a viewer would see.
    pub frame_ms: Option<Summary>,
    /// "1 % low" frame rates of `frame_ms`, by all three definitions.
    pub frame_lows: Option<Lows>,
    pub game_ms: Option<Summary>,
    pub record_ms: Option<Summary>,
    /// Recording, submission and the wait for the device.
    pub render_ms: Option<Summary>,
    pub gpu_ms: Option<Summary>,
    /// From the start of a frame's game step to the end of its render step.
    pub latency_ms: Option<Summary>,
    pub passes: Vec<Pass>,
    /// SHA-256 of the last frame's pixels, where it was taken.
    pub image_hash: Option<String>,
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
    /// Device time a frame saved by skipping, where it was measured against `--no-skip`.
    pub saved_ms: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// Median parallel frame time by median serial frame time.
    pub parallel_by_serial: f64,
    /// 95 % bootstrap interval.
    pub low: f64,
    pub high: f64,
}

impl From<Interval> for Ratio {
    fn from(interval: Interval) -> Self {
        Ratio { parallel_by_serial: interval.estimate, low: interval.low, high: interval.high }
    }
}

impl Clocks {
    pub fn of(clock: &ClockQuality, timestamp_period_ns: Option<f64>) -> Self {
        Clocks { resolution_ns: clock.resolution_ns as f64, overhead_ns: clock.overhead_ns, timestamp_period_ns }
    }
}

/// One line of `frames.csv`. Times in ms; NaN and None become an empty field.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameRow {
    pub threading: String,
    /// Blocks count over the whole run, serial and parallel taking turns.
    pub block: usize,
    /// Frame of the scene.
    pub frame: u32,
    /// Scene time.
    pub time_s: f64,
    pub warm_up: bool,
    pub frame_ms: f64,
    pub game_ms: f64,
    pub record_ms: f64,
    pub submit_wait_ms: f64,
    pub gpu_ms: Option<f64>,
    pub latency_ms: f64,
    /// Packets waiting when this one was taken.
    pub queue_depth: usize,
    /// In the order of the names handed to `write_results`; None where skipped.
    pub pass_ms: Vec<Option<f64>>,
    pub image_hash: Option<String>,
}

const FRAME_COLUMNS: [&str; 13] = [
    "i_row",
    "threading",
    "block",
    "frame",
    "time_s",
    "warm_up",
    "frame_ms",
    "game_ms",
    "record_ms",
    "submit_wait_ms",
    "gpu_ms",
    "latency_ms",
    "queue_depth",
];

/// Makes the folder results will go to, before anything is measured. What exists is refused unless `force`; then its
/// results are replaced when the new ones are there, and other files in it are left alone.
pub fn prepare_out_dir(path: &Path, force: bool) -> Result<()> {
    match fs::symlink_metadata(path) {
        Ok(_) if !force => {
            let path = path.display();
            Err(Error::usage(format!("{path}: exists already; name another folder, or add --force to overwrite it")))
        }
        Ok(_) if !path.is_dir() => Err(Error::io(path, "is not a folder; results need one")),
        Ok(_) => check_writable(path),
        Err(_) => fs::create_dir_all(path).map_err(|cause| Error::io(path, cause)),
    }
}

/// Both files, at once: never a `run.json` beside another run's frames.
pub fn write_results(out_dir: &Path, run: &Run, pass_names: &[String], rows: &[FrameRow]) -> Result<()> {
    replace_files(out_dir, &[FRAMES_FILE, RUN_FILE], |folder| {
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
    let text = fs::read_to_string(&path).map_err(|cause| Error::io(&path, cause))?;
    let broken = |cause| Error::io(&path, format!("not JSON, or not all of it: {cause}"));
    let value: serde_json::Value = serde_json::from_str(&text).map_err(broken)?;
    // The version is looked at first: of another version any other complaint would mislead.
    match value.get("schema").and_then(serde_json::Value::as_u64) {
        Some(version) if version == u64::from(SCHEMA_VERSION) => {}
        Some(version) => {
            return Err(Error::io(&path, format!("results of schema {version}; this nimbus reads {SCHEMA_VERSION}")));
        }
        None => return Err(Error::io(&path, "not a run.json of nimbus: it names no schema version")),
    }
    serde_json::from_value(value).map_err(|cause| Error::io(&path, format!("not a run.json of nimbus: {cause}")))
}

pub fn write_frames(path: &Path, pass_names: &[String], rows: &[FrameRow]) -> Result<()> {
    let failed = |cause: csv::Error| Error::io(path, cause);
    let mut writer = csv::Writer::from_writer(Vec::new());
    let columns = FRAME_COLUMNS.iter().map(|name| (*name).to_owned());
    let pass_columns = pass_names.iter().map(|name| format!("gpu_{name}_ms"));
    writer.write_record(columns.chain(pass_columns).chain(["image_hash".to_owned()])).map_err(failed)?;
    for (i_row, row) in rows.iter().enumerate() {
        if row.pass_ms.len() != pass_names.len() {
            let (got, wanted) = (row.pass_ms.len(), pass_names.len());
            return Err(Error::io(path, format!("row {i_row} has {got} pass times for {wanted} passes")));
        }
        writer.write_record(fields(i_row, row)).map_err(failed)?;
    }
    let bytes = writer.into_inner().map_err(|cause| Error::io(path, cause))?;
    write_atomic(path, |file| file.write_all(&bytes))
}

fn fields(i_row: usize, row: &FrameRow) -> Vec<String> {
    let mut fields = vec![
        i_row.to_string(),
        row.threading.clone(),
        row.block.to_string(),
        row.frame.to_string(),
        number(Some(row.time_s)),
        row.warm_up.to_string(),
        number(Some(row.frame_ms)),
        number(Some(row.game_ms)),
        number(Some(row.record_ms)),
        number(Some(row.submit_wait_ms)),
        number(row.gpu_ms),
        number(Some(row.latency_ms)),
        row.queue_depth.to_string(),
    ];
    fields.extend(row.pass_ms.iter().map(|ms| number(*ms)));
    fields.push(row.image_hash.clone().unwrap_or_default());
    fields
}

/// The shortest text that reads back as the same f64.
fn number(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map(|value| value.to_string()).unwrap_or_default()
}

/// The revision that was built (see build.rs).
pub fn revision() -> &'static str {
    env!("NIMBUS_GIT_REVISION")
}

pub fn cpu() -> Cpu {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':').map(|(_, name)| name));
    Cpu {
        model: model.map_or_else(|| "unknown".to_owned(), |name| name.trim().to_owned()),
        logical_cores: std::thread::available_parallelism().map_or(1, usize::from),
    }
}

/// Of the process: Mesa, its software rasteriser, and the Vulkan loader.
pub fn environment() -> BTreeMap<String, String> {
    relevant(std::env::vars_os().filter_map(|(key, value)| Some((key.into_string().ok()?, value.into_string().ok()?))))
}

fn relevant(variables: impl Iterator<Item = (String, String)>) -> BTreeMap<String, String> {
    const PREFIXES: [&str; 4] = ["LP_", "MESA_", "VK_", "GALLIUM_"];
    variables.filter(|(key, _)| PREFIXES.iter().any(|prefix| key.starts_with(prefix))).collect()
}

/// Now, as "2024-02-29T12:34:56Z". A clock before 1970 gives 1970.
pub fn utc_now() -> String {
    iso_8601_utc(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()))
}

/// Seconds since 1970-01-01T00:00:00Z, without leap seconds. The date is Howard Hinnant's `civil_from_days`: years
/// begin in March, so that the leap day is a year's last, and repeat every 400 years of 146 097 days.
pub fn iso_8601_utc(unix_s: u64) -> String {
    let (days, second) = (unix_s / 86_400, unix_s % 86_400);
    // Days from 0000-03-01 to 1970-01-01.
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    // Months from March have 31, 30, 31, 30, 31 days and again: 153 days in five.
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = 400 * era + year_of_era + u64::from(month <= 2);
    let (hour, minute, second) = (second / 3_600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_dates() {
        // From `date -u -d @N`.
        for (unix_s, text) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (951_868_799, "2000-02-29T23:59:59Z"),
            (1_709_210_096, "2024-02-29T12:34:56Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(iso_8601_utc(unix_s), text);
        }
    }

    #[test]
    fn only_variables_that_matter_are_kept() {
        let given = ["LP_NUM_THREADS", "HOME", "VK_DRIVER_FILES", "MESA_VK_DEVICE_SELECT", "SECRET_VK_KEY"];
        let kept = relevant(given.iter().map(|key| ((*key).to_owned(), "1".to_owned())));
        assert_eq!(kept.keys().collect::<Vec<_>>(), ["LP_NUM_THREADS", "MESA_VK_DEVICE_SELECT", "VK_DRIVER_FILES"]);
    }
}
