//! `frames.csv`: every frame of a bench, raw. Writing the rows that were read gives the same bytes.

use std::path::Path;

use csv::StringRecord;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::io::atomic::write_atomic;

/// File name of the table.
pub const FRAMES_FILE: &str = "frames.csv";

/// The rows of all frames, and the passes that their times are of.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrameTable {
    /// Names of the passes, in the order of [`FrameRow::pass_ms`].
    pub pass_names: Vec<String>,
    /// All frames, warm-up included, in the order in which they ran.
    pub rows: Vec<FrameRow>,
}

/// A row of `frames.csv`. Times are in ms; NaN and None are empty fields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameRow {
    /// Name of the phase; empty if the scene has no phases.
    pub phase: String,
    /// "key=value, key=value"; empty without a sweep.
    pub sweep: String,
    /// "serial" or "parallel".
    pub threading: String,
    /// Whether frames skip passes.
    pub skip: bool,
    /// Number of the block over the whole run.
    pub block: u32,
    /// Frame of the scene.
    pub frame: u32,
    /// Scene time in seconds.
    #[serde(with = "number")]
    pub time_s: f64,
    /// Whether the frame belongs to the warm-up.
    pub warm_up: bool,
    /// From the end of the frame before to the end of this one.
    #[serde(with = "number")]
    pub frame_ms: f64,
    /// Game step.
    #[serde(with = "number")]
    pub game_ms: f64,
    /// Uploading, planning and recording.
    #[serde(with = "number")]
    pub record_ms: f64,
    /// Submission to the driver.
    #[serde(with = "number")]
    pub submit_ms: f64,
    /// Wait for the device.
    #[serde(with = "number")]
    pub wait_ms: f64,
    /// Device time of all passes.
    #[serde(with = "optional")]
    pub gpu_ms: Option<f64>,
    /// From the start of the game step to the finished image.
    #[serde(with = "number")]
    pub latency_ms: f64,
    /// Frames that the device still had when it was handed this one.
    pub queue_depth: u32,
    /// Particles drawn.
    pub n_drawn: u32,
    /// Names of the passes that ran, joined by "+".
    pub ran: String,
    /// Device time of each pass of [`FrameTable::pass_names`]; None if it was skipped.
    #[serde(serialize_with = "pass_fields", skip_deserializing)]
    pub pass_ms: Vec<Option<f64>>,
    /// SHA-256 of the image, if it was computed.
    pub image_hash: Option<String>,
    /// End of the frame in seconds since the start of the run, on the clock of `state.csv`; None in
    /// results of versions that did not write it.
    #[serde(default, with = "optional")]
    pub end_s: Option<f64>,
    /// What held the device's clock down, joined by "+": "clock", "slowdown", "power".
    #[serde(default)]
    pub throttled: Option<String>,
    /// Whether the frame is in no statistic, because it was throttled.
    #[serde(default)]
    pub discarded: bool,
}

impl FrameRow {
    /// Whether the frame is in the statistics.
    pub fn is_timed(&self) -> bool {
        !self.warm_up && !self.discarded
    }

    /// Returns the time of recording, submission and waiting, in ms.
    pub fn render_ms(&self) -> f64 {
        self.record_ms + self.submit_ms + self.wait_ms
    }
}

/// The columns before those of the passes; `image_hash` and [`LATER_COLUMNS`] follow these.
const COLUMNS: [&str; 19] = [
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
const HASH_COLUMN: &str = "image_hash";
/// Columns that results of earlier versions lack.
const LATER_COLUMNS: [&str; 3] = ["end_s", "throttled", "discarded"];

/// Writes the table to `path`.
///
/// # Errors
/// Fails if the file cannot be written, or a row has not one time for each pass.
pub fn write_frames(path: &Path, table: &FrameTable) -> Result<()> {
    let failed = |cause: csv::Error| Error::io(path, cause);
    let FrameTable { pass_names, rows } = table;
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    let columns = COLUMNS.iter().map(|name| (*name).to_owned());
    let pass_columns = pass_names.iter().map(|name| format!("gpu_{name}_ms"));
    let header = columns.chain(pass_columns).chain([HASH_COLUMN.to_owned()]);
    let header = header.chain(LATER_COLUMNS.map(str::to_owned));
    writer.write_record(header).map_err(failed)?;
    for (i_row, row) in rows.iter().enumerate() {
        let (n, n_passes) = (row.pass_ms.len(), pass_names.len());
        if n != n_passes {
            let what = format!("row {i_row} has {n} pass times for {n_passes} passes");
            return Err(Error::io(path, what));
        }
        writer.serialize((i_row, row)).map_err(failed)?;
    }
    let bytes = writer.into_inner().map_err(|cause| Error::io(path, cause))?;
    write_atomic(path, |file| std::io::Write::write_all(file, &bytes))
}

/// Parses the text of a `frames.csv`; errors name `path` and the line.
///
/// # Errors
/// Fails if a column is missing, a row is cut off, or a field has another type.
pub fn parse_frames(text: &str, path: &Path) -> Result<FrameTable> {
    // Rows of another length are found below, for one message that says what is wrong.
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|cause| Error::io(path, cause))?.clone();
    let has = |name: &str| header.iter().any(|column| column == name);
    if let Some(name) = COLUMNS.iter().skip(1).chain([&HASH_COLUMN]).find(|name| !has(name)) {
        let what = format!("no {FRAMES_FILE} of nimbus: it has no column {name}");
        return Err(Error::io(path, what));
    }
    let pass = |column: &str| Some(column.strip_prefix("gpu_")?.strip_suffix("_ms")?.to_owned());
    let passes: Vec<(usize, String)> =
        header.iter().enumerate().filter_map(|(i, column)| Some((i, pass(column)?))).collect();
    let mut rows = Vec::new();
    for line in reader.records() {
        let line = line.map_err(|cause| Error::io(path, cause))?;
        let at = line.position().map_or(0, csv::Position::line);
        rows.push(
            row(&line, &header, &passes)
                .map_err(|what| Error::io(path, format!("line {at}: {what}")))?,
        );
    }
    Ok(FrameTable { pass_names: passes.into_iter().map(|(_, name)| name).collect(), rows })
}

fn row(
    line: &StringRecord,
    header: &StringRecord,
    passes: &[(usize, String)],
) -> std::result::Result<FrameRow, String> {
    let (n, n_expected) = (line.len(), header.len());
    if n != n_expected {
        return Err(format!("expected {n_expected} fields as in the header, found {n}: cut off?"));
    }
    // Checked here, because a deserializer of one field does not know its column.
    for (name, field) in header.iter().zip(line).filter(|(name, _)| is_time(name)) {
        parse_time(field).map_err(|what| format!("{name}: {what}"))?;
    }
    let mut row: FrameRow = line.deserialize(Some(header)).map_err(|cause| {
        let csv::ErrorKind::Deserialize { err, .. } = cause.kind() else {
            return cause.to_string();
        };
        let column = err.field().and_then(|i| header.get(i as usize));
        let column = column.map_or(String::new(), |name| format!("{name}: "));
        format!("{column}{}", err.kind())
    })?;
    row.pass_ms =
        passes.iter().map(|(i, _)| parse_time(&line[*i])).collect::<std::result::Result<_, _>>()?;
    Ok(row)
}

fn is_time(column: &str) -> bool {
    column.ends_with("_ms") || column == "time_s" || column == "end_s"
}

fn parse_time(field: &str) -> std::result::Result<Option<f64>, String> {
    let is_wrong = || format!("expected a finite time, found \"{field}\"");
    if field.is_empty() {
        return Ok(None);
    }
    field.parse().ok().filter(|ms: &f64| ms.is_finite()).map(Some).ok_or_else(is_wrong)
}

/// A time as a field: the shortest text that reads back as the same f64, or empty.
mod optional {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer>(ms: &Option<f64>, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(&ms.filter(|ms| ms.is_finite()).map_or(String::new(), |ms| ms.to_string()))
    }

    pub fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<Option<f64>, D::Error> {
        super::parse_time(&String::deserialize(from)?).map_err(D::Error::custom)
    }
}

/// The same for a time that is NaN if it was not measured.
mod number {
    use serde::{Deserializer, Serializer};

    pub fn serialize<S: Serializer>(ms: &f64, to: S) -> Result<S::Ok, S::Error> {
        super::optional::serialize(&Some(*ms), to)
    }

    pub fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<f64, D::Error> {
        Ok(super::optional::deserialize(from)?.unwrap_or(f64::NAN))
    }
}

fn pass_fields<S: serde::Serializer>(
    times: &[Option<f64>],
    to: S,
) -> std::result::Result<S::Ok, S::Error> {
    let text = |ms: &Option<f64>| ms.filter(|ms| ms.is_finite()).map(|ms| ms.to_string());
    to.collect_seq(times.iter().map(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "i_row,phase,sweep,threading,skip,block,frame,time_s,warm_up,frame_ms,\
        game_ms,record_ms,submit_ms,wait_ms,gpu_ms,latency_ms,queue_depth,n_drawn,ran,gpu_sort_ms,\
        gpu_first_ms,image_hash,end_s,throttled,discarded\n";
    const ROWS: &str = "0,dense,\"a=1, b=2\",serial,true,0,0,0,true,16.123456789012344,\
        1,0.5,0.25,14.5,,,1,7,sort+sprites,1.5,,,0.5,,false\n\
        1,,,parallel,false,3,4000000000,-0.1,false,0.1,1e-9,,0,3,7.25,1,0,0,,,0.3,0abc,1.25,\
        clock+slowdown,true\n";

    fn read(text: &str) -> Result<FrameTable> {
        parse_frames(text, Path::new("frames.csv"))
    }

    #[test]
    fn rows_that_were_read_are_written_with_the_same_bytes() {
        let text = format!("{HEADER}{ROWS}").replace("1e-9", "0.000000001");
        let table = read(&text).unwrap();
        assert_eq!(table.pass_names, ["sort", "first"]);
        let rows = &table.rows;
        assert!(
            rows[0].latency_ms.is_nan() && rows[0].gpu_ms.is_none() && rows[1].record_ms.is_nan()
        );
        assert_eq!((rows[1].frame, rows[1].image_hash.as_deref()), (4_000_000_000, Some("0abc")));
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("again.csv");
        write_frames(&path, &table).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }

    #[test]
    fn rows_of_earlier_versions_are_read() {
        let [of_header, of_first, of_second] =
            [",end_s,throttled,discarded", ",0.5,,false", ",1.25,clock+slowdown,true"];
        let text = format!("{HEADER}{ROWS}");
        let old = [of_header, of_first, of_second].iter().fold(text.clone(), |text, added| {
            assert!(text.contains(added));
            text.replace(added, "")
        });
        let (old, new) = (read(&old).unwrap().rows, read(&text).unwrap().rows);
        assert!(old.iter().all(|row| row.end_s.is_none() && row.throttled.is_none()));
        assert!(!old[1].discarded && old[1].is_timed());
        // The frame that is left out stays a row, and the one of the warm-up is not timed either.
        assert!(new[1].discarded && !new[1].is_timed() && !new[0].is_timed());
        assert_eq!(new[1].throttled.as_deref(), Some("clock+slowdown"));
        assert_eq!(new[1].end_s, Some(1.25));
    }

    #[test]
    fn a_faulty_row_is_reported_with_its_line() {
        for (from, to, expected) in [
            ("phase", "stage", "no column phase"),
            ("image_hash", "hash", "no column image_hash"),
            (",serial,true", ",serial,maybe", "line 2: skip: "),
            ("4000000000", "-1", "line 3: frame: "),
            (",0.3,0abc", ",NaN,0abc", "line 3: gpu_first_ms: expected a finite time"),
            (",14.5,", ",x,", "line 2: wait_ms: expected a finite time, found \"x\""),
            (
                ",0.3,0abc",
                ",0.3",
                "line 3: expected 25 fields as in the header, found 24: cut off?",
            ),
        ] {
            let text = format!("{HEADER}{ROWS}");
            assert!(text.contains(from), "{from}");
            let message = read(&text.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
        assert!(read("").is_err());
    }
}
