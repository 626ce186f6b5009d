//! A study on disk: `study.json`, `configurations.csv`, `times.csv` and pictures. Written after
//! every round, so that whatever ends a run early leaves what was finished, and a later run goes on
//! from there.

use std::fs;
use std::io::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::records::{Configuration, Front, STUDY_FILE, Study, TIMES_FILE};
use super::run::Found;
use super::turns::Turn;
use crate::error::{Error, Result};
use crate::io::atomic::write_atomic;
use crate::io::folder::replace_files;
use crate::io::text_file::{TABLE_LIMIT, read_result};
use crate::studies::provenance::Figure;
use crate::timing::json;

pub const CONFIGURATIONS_FILE: &str = "configurations.csv";

/// A frame of times.csv.
#[derive(Debug, Serialize, Deserialize)]
struct TimeRow {
    round: usize,
    turn: usize,
    configuration: usize,
    name: String,
    gpu_ms: Option<f64>,
    frame_ms: f64,
}

/// Writes the study and its tables; all of them, or none.
pub fn write(folder: &Path, study: &Study, found: &Found) -> Result<()> {
    replace_files(folder, &[TIMES_FILE, CONFIGURATIONS_FILE, STUDY_FILE], |folder| {
        write_times(&folder.join(TIMES_FILE), study, &found.turns)?;
        write_csv(&folder.join(CONFIGURATIONS_FILE), study.configurations.iter().map(csv_row))?;
        json::write(&folder.join(STUDY_FILE), study)
    })
}

/// Takes the pictures and charts of an earlier study out of a folder that a new one takes over.
pub fn remove_earlier(folder: &Path) -> Result<()> {
    let is_ours = |name: &str| {
        let number = |begin| name.strip_prefix(begin).and_then(|rest| rest.strip_suffix(".png"));
        let of_configuration = number("picture-").or(number("error-"));
        of_configuration.is_some_and(|n| n.parse::<usize>().is_ok())
            || ["front.svg", "reference.png"].contains(&name)
    };
    for entry in fs::read_dir(folder).map_err(|cause| Error::io(folder, cause))? {
        let entry = entry.map_err(|cause| Error::io(folder, cause))?;
        if entry.file_name().to_str().is_some_and(is_ours) {
            fs::remove_file(entry.path()).map_err(|cause| Error::io(&entry.path(), cause))?;
        }
    }
    Ok(())
}

fn write_times(path: &Path, study: &Study, turns: &[Turn]) -> Result<()> {
    let of_turn = |(i_turn, turn): (usize, &Turn)| {
        let name = study
            .configurations
            .get(turn.i_configuration)
            .map_or(String::new(), |c| c.name.clone());
        let row = |(k, frame_ms): (usize, &f64)| TimeRow {
            round: turn.i_round,
            turn: i_turn,
            configuration: turn.i_configuration,
            name: name.clone(),
            gpu_ms: turn.gpu_ms.get(k).copied(),
            frame_ms: *frame_ms,
        };
        turn.frame_ms.iter().enumerate().map(row).collect::<Vec<_>>()
    };
    write_csv(path, turns.iter().enumerate().flat_map(of_turn))
}

fn write_csv<T: Serialize>(path: &Path, rows: impl Iterator<Item = T>) -> Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(|cause| Error::io(path, cause))?;
    }
    let bytes = writer.into_inner().map_err(|cause| Error::io(path, cause))?;
    write_atomic(path, |file| file.write_all(&bytes))
}

/// A configuration as a row, for programs.
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
    reference_resolves: Option<bool>,
    turns: usize,
    failure: Option<String>,
}

pub fn csv_row(c: &Configuration) -> CsvRow {
    let value = |f: Option<Figure>| f.map(|f| f.value);
    let low = |f: Option<Figure>| f.and_then(|f| f.low);
    let high = |f: Option<Figure>| f.and_then(|f| f.high);
    let rmse = c.error.map(|e| e.rmse);
    CsvRow {
        name: c.name.clone(),
        front: c.front,
        gpu_ms: value(c.gpu_ms),
        gpu_ms_low: low(c.gpu_ms),
        gpu_ms_high: high(c.gpu_ms),
        frame_ms: value(c.frame_ms),
        frame_ms_low: low(c.frame_ms),
        frame_ms_high: high(c.frame_ms),
        by_base: value(c.by_base),
        by_base_low: low(c.by_base),
        by_base_high: high(c.by_base),
        rmse: value(rmse),
        rmse_low: low(rmse),
        rmse_high: high(rmse),
        max: c.error.map(|e| e.max),
        relmse: c.error.map(|e| e.relmse),
        reference_resolves: c.error.map(|e| e.is_resolved),
        turns: c.n_turns,
        failure: c.failure.clone(),
    }
}

/// What no study writes: rounds are counted from 0, and what took no finite time was not timed.
fn check_row(row: &TimeRow) -> std::result::Result<(), String> {
    let times = [Some(row.frame_ms), row.gpu_ms];
    if let Some(ms) = times.into_iter().flatten().find(|ms| !ms.is_finite()) {
        return Err(format!("turn {}: expected a finite time in ms, found {ms}", row.turn));
    }
    if u32::try_from(row.round).is_err() {
        return Err(format!(
            "turn {}: expected a round from 0 to {}, found {}",
            row.turn,
            u32::MAX,
            row.round
        ));
    }
    Ok(())
}

/// What an earlier run in `folder` found, to be gone on with.
pub fn read_found(folder: &Path) -> Result<(Study, Found)> {
    let study = json::read(folder)?;
    let path = folder.join(TIMES_FILE);
    parse_found(study, &read_result(&path, TABLE_LIMIT)?, &path)
}

/// The same of a study and the text of its `times.csv`; `path` is for messages.
pub fn parse_found(study: Study, text: &str, path: &Path) -> Result<(Study, Found)> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let mut turns: Vec<Turn> = Vec::new();
    let mut i_last = None;
    for row in reader.deserialize::<TimeRow>() {
        let row = row.map_err(|cause| Error::io(path, cause))?;
        if row.configuration >= study.configurations.len() {
            return Err(Error::io(
                path,
                format!("names configuration {}; {STUDY_FILE} has none such", row.configuration),
            ));
        }
        check_row(&row).map_err(|what| Error::io(path, what))?;
        if i_last.replace(row.turn) != Some(row.turn) {
            let (i_configuration, i_round) = (row.configuration, row.round);
            turns.push(Turn { i_configuration, i_round, gpu_ms: Vec::new(), frame_ms: Vec::new() });
        }
        if let Some(turn) = turns.last_mut() {
            turn.gpu_ms.extend(row.gpu_ms);
            turn.frame_ms.push(row.frame_ms);
        }
    }
    let n_rounds = turns.iter().map(|turn| turn.i_round + 1).max().unwrap_or(0);
    let configurations = study.configurations.clone();
    Ok((study, Found { configurations, turns, n_rounds }))
}
