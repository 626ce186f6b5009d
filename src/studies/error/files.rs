//! A study on disk: `study.json`, `configurations.csv`, `times.csv` and pictures.
//!
//! The files are written after every round, so that a study that ends early keeps its results and
//! can be resumed.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::blocks::TimedBlock;
use super::front::Front;
use super::records::{Configuration, Study};
use super::study::StudyResults;
use crate::error::{Error, Result};
use crate::io::atomic::write_atomic;
use crate::io::result_folder::{Existing, ResultFolder};
use crate::io::text_file::{TABLE_LIMIT, read_result};
use crate::measure::figure::Figure;
use crate::timing::json::{self, ResultFile};

/// File name of the table of configurations.
pub const CONFIGURATIONS_FILE: &str = "configurations.csv";
/// File name of the table of all times.
pub const TIMES_FILE: &str = "times.csv";

/// A frame in `times.csv`.
#[derive(Debug, Serialize, Deserialize)]
struct TimeRow {
    round: usize,
    /// Number of the block.
    turn: usize,
    configuration: usize,
    name: String,
    gpu_ms: Option<f64>,
    frame_ms: f64,
}

/// The reference as a picture.
pub const REFERENCE_FILE: &str = "reference.png";
/// The chart of time against error, which finished and interrupted studies have.
pub const CHART_FILE: &str = "front.svg";

/// Returns the file names of the picture of configuration `i` and of the map of its error.
pub fn picture_files(i: usize) -> [String; 2] {
    [format!("picture-{i}.png"), format!("error-{i}.png")]
}

/// Claims the folder for the results of a study of at most `n` configurations.
///
/// # Errors
/// Fails as [`ResultFolder::open`].
pub fn open(place: &Path, existing: Existing, n: usize) -> Result<ResultFolder> {
    let fixed = [TIMES_FILE, CONFIGURATIONS_FILE, Study::FILE, REFERENCE_FILE, CHART_FILE];
    let pictures = (0..n).flat_map(picture_files);
    let planned: Vec<String> =
        fixed.iter().map(|name| (*name).to_owned()).chain(pictures).collect();
    ResultFolder::open(place, "study", existing, &planned)
}

/// Writes the study and its tables together, while it runs or when it ended early.
///
/// # Errors
/// Fails if a file cannot be written.
pub fn write(folder: &mut ResultFolder, study: &Study, results: &StudyResults) -> Result<()> {
    folder.replace(&[TIMES_FILE, CONFIGURATIONS_FILE, Study::FILE], |to| {
        write_tables(to, study, results)
    })
}

/// Writes the study and its tables, a chart of it and `more` files together. A finished study
/// replaces an earlier one.
///
/// # Errors
/// Fails as [`ResultFolder::write_last`].
pub fn write_last(
    folder: &mut ResultFolder,
    study: &Study,
    results: &StudyResults,
    chart: &str,
    more: &[(String, PathBuf)],
) -> Result<()> {
    let copied = more.iter().map(|(name, _)| name.as_str());
    let names: Vec<&str> =
        copied.chain([CHART_FILE, TIMES_FILE, CONFIGURATIONS_FILE, Study::FILE]).collect();
    let write = |to: &Path| {
        for (name, from) in more {
            let copy = to.join(name);
            fs::copy(from, &copy).map_err(|cause| Error::of_io(&copy, &cause))?;
        }
        write_atomic(&to.join(CHART_FILE), |file| file.write_all(chart.as_bytes()))?;
        write_tables(to, study, results)
    };
    folder.write_last(!study.interrupted, &names, write)
}

fn write_tables(folder: &Path, study: &Study, results: &StudyResults) -> Result<()> {
    let rows = results.blocks.iter().enumerate().flat_map(|(i, b)| time_rows(study, i, b));
    write_csv(&folder.join(TIMES_FILE), rows)?;
    write_csv(&folder.join(CONFIGURATIONS_FILE), study.configurations.iter().map(csv_row))?;
    json::write(&folder.join(Study::FILE), study)
}

fn time_rows(study: &Study, i_block: usize, block: &TimedBlock) -> Vec<TimeRow> {
    let configuration = study.configurations.get(block.i_configuration);
    let row = |(k, frame_ms): (usize, &f64)| TimeRow {
        round: block.i_round,
        turn: i_block,
        configuration: block.i_configuration,
        name: configuration.map_or(String::new(), |c| c.name.clone()),
        gpu_ms: block.gpu_ms.get(k).copied(),
        frame_ms: *frame_ms,
    };
    block.frame_ms.iter().enumerate().map(row).collect()
}

fn write_csv<T: Serialize>(path: &Path, rows: impl Iterator<Item = T>) -> Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(|cause| Error::io(path, cause))?;
    }
    let bytes = writer.into_inner().map_err(|cause| Error::io(path, cause))?;
    write_atomic(path, |file| file.write_all(&bytes))
}

/// A configuration as a row of `configurations.csv`.
#[derive(Debug, Serialize)]
pub struct CsvRow {
    name: String,
    front: Front,
    gpu_ms: Option<f64>,
    gpu_ms_low: Option<f64>,
    gpu_ms_high: Option<f64>,
    frame_ms: Option<f64>,
    frame_ms_low: Option<f64>,
    frame_ms_high: Option<f64>,
    by_base: Option<f64>,
    by_base_low: Option<f64>,
    by_base_high: Option<f64>,
    rmse: Option<f64>,
    rmse_low: Option<f64>,
    rmse_high: Option<f64>,
    max: Option<f64>,
    relmse: Option<f64>,
    cloud: Option<f64>,
    cloud_low: Option<f64>,
    cloud_high: Option<f64>,
    reference_resolves: Option<bool>,
    turns: usize,
    failure: Option<String>,
}

/// Returns a configuration as a row.
pub fn csv_row(c: &Configuration) -> CsvRow {
    let fields =
        |f: Option<Figure>| [f.map(|f| f.value), f.and_then(|f| f.low), f.and_then(|f| f.high)];
    let [gpu_ms, gpu_ms_low, gpu_ms_high] = fields(c.gpu_ms);
    let [frame_ms, frame_ms_low, frame_ms_high] = fields(c.frame_ms);
    let [by_base, by_base_low, by_base_high] = fields(c.by_base);
    let [rmse, rmse_low, rmse_high] = fields(c.error.map(|e| e.rmse));
    let [cloud, cloud_low, cloud_high] = fields(c.error.and_then(|e| e.cloud));
    CsvRow {
        name: c.name.clone(),
        front: c.front,
        gpu_ms,
        gpu_ms_low,
        gpu_ms_high,
        frame_ms,
        frame_ms_low,
        frame_ms_high,
        by_base,
        by_base_low,
        by_base_high,
        rmse,
        rmse_low,
        rmse_high,
        max: c.error.map(|e| e.max),
        relmse: c.error.map(|e| e.relmse),
        cloud,
        cloud_low,
        cloud_high,
        reference_resolves: c.error.map(|e| e.is_resolved),
        turns: c.n_turns,
        failure: c.failure.clone(),
    }
}

/// Rejects rows that no study writes: times are finite, and rounds are numbered from 0.
fn check_row(row: &TimeRow, n_configurations: usize) -> std::result::Result<(), String> {
    let TimeRow { round, turn, configuration, .. } = row;
    if *configuration >= n_configurations {
        return Err(format!("names configuration {configuration}; {} has none such", Study::FILE));
    }
    let times = [Some(row.frame_ms), row.gpu_ms];
    if let Some(ms) = times.into_iter().flatten().find(|ms| !ms.is_finite()) {
        return Err(format!("turn {turn}: expected a finite time in ms, found {ms}"));
    }
    match u32::try_from(*round) {
        Ok(_) => Ok(()),
        Err(_) => {
            Err(format!("turn {turn}: expected a round from 0 to {}, found {round}", u32::MAX))
        }
    }
}

/// Reads the results of an earlier run in `folder`, so that it can be resumed.
///
/// # Errors
/// Fails if a file is missing or damaged, or the two do not belong together.
pub fn read_earlier(folder: &Path) -> Result<(Study, StudyResults)> {
    let study = json::read(folder)?;
    let path = folder.join(TIMES_FILE);
    parse_earlier(study, &read_result(&path, TABLE_LIMIT)?, &path)
}

/// Joins a study with the text of its `times.csv`; errors name `path`.
///
/// # Errors
/// Fails if the text is not such a table or not that of the study.
pub fn parse_earlier(study: Study, text: &str, path: &Path) -> Result<(Study, StudyResults)> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let mut blocks: Vec<TimedBlock> = Vec::new();
    let mut i_last = None;
    for row in reader.deserialize::<TimeRow>() {
        let row = row.map_err(|cause| Error::io(path, cause))?;
        check_row(&row, study.configurations.len()).map_err(|what| Error::io(path, what))?;
        if i_last.replace(row.turn) != Some(row.turn) {
            blocks.push(TimedBlock::new(row.configuration, row.round));
        }
        if let Some(block) = blocks.last_mut() {
            block.gpu_ms.extend(row.gpu_ms);
            block.frame_ms.push(row.frame_ms);
        }
    }
    let n_rounds = blocks.iter().map(|block| block.i_round + 1).max().unwrap_or(0);
    let configurations = study.configurations.clone();
    Ok((study, StudyResults { configurations, blocks, n_rounds }))
}
