//! Reads back what [`crate::timing::records::write_results`] wrote, and finds out when it is not that, or
//! not all of it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use csv::StringRecord;

use crate::error::{Error, Result};
use crate::io::text_file::{TABLE_LIMIT, read_result};
use crate::timing::records::{FRAMES_FILE, RUN_FILE, Run, case_name, read_run};

/// A results folder.
#[derive(Debug, Clone)]
pub struct Recorded {
    pub run: Run,
    /// In the order of `run.modes`.
    pub modes: Vec<TimedMode>,
}

/// The timed frames of one mode; warm-up is left out.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedMode {
    /// Phase, sweep and loop, in words.
    pub name: String,
    /// Frames of the scene, in the order they ran.
    pub frames: Vec<u32>,
    /// The times of `frame`, block by block.
    pub blocks: Vec<Vec<f64>>,
    /// `frame`, `game`, `render`, `gpu`, then the passes, in the order of the columns.
    pub measures: Vec<Measure>,
}

/// Times in ms in the order they were taken; frames without one (a pass that was skipped) are left
/// out.
#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    pub name: String,
    pub ms: Vec<f64>,
}

/// Reads a folder that `bench --out` made. An error names the file, and the line where there is
/// one.
pub fn read_results(folder: &Path) -> Result<Recorded> {
    if !folder.is_dir() {
        return Err(Error::io(
            folder,
            "no such folder; expected one that nimbus bench --out wrote",
        ));
    }
    if !folder.join(RUN_FILE).exists() {
        return Err(Error::io(folder, format!("holds no {RUN_FILE}; {}", expected_in(folder))));
    }
    let run = read_run(folder)?;
    let path = folder.join(FRAMES_FILE);
    let text = read_result(&path, TABLE_LIMIT)?;
    join(run, &text, &path)
}

/// A run and the text of its `frames.csv`; `path` is for messages.
pub fn join(run: Run, text: &str, path: &Path) -> Result<Recorded> {
    let mut by_mode = read_frames(path, text)?;
    let mut modes = Vec::new();
    for (case, mode) in run.cases.iter().flat_map(|c| c.modes.iter().map(move |m| (c, m))) {
        let name = mode_name(&case.name(), &mode.threading, mode.skip);
        let timed = by_mode.remove(&name);
        let n = timed.as_ref().map_or(0, |timed| timed.frames.len());
        if n != mode.frames {
            let wanted = mode.frames;
            let what = format!(
                "holds {n} timed {name} frames and {RUN_FILE} names {wanted}: cut off, or \
                 another run's"
            );
            return Err(Error::io(path, what));
        }
        modes.extend(timed);
    }
    match by_mode.keys().next() {
        Some(other) => {
            Err(Error::io(path, format!("holds {other} frames, of which {RUN_FILE} knows nothing")))
        }
        None => Ok(Recorded { run, modes }),
    }
}

/// Results of several scenes lie one folder deeper.
fn expected_in(folder: &Path) -> String {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut deeper: Vec<PathBuf> =
        entries.map(|e| e.path()).filter(|p| p.join(RUN_FILE).exists()).collect();
    deeper.sort();
    match deeper.first() {
        Some(first) => format!(
            "it has folders of results in it: name one of those, such as {}",
            first.display()
        ),
        None => "expected a folder that nimbus bench --out wrote".to_owned(),
    }
}

/// A case's loop in words: "dense, size=800x600: serial", or the loop alone where there is one
/// case.
fn mode_name(case: &str, threading: &str, skip: bool) -> String {
    let of = if skip { threading.to_owned() } else { format!("{threading} no-skip") };
    if case.is_empty() { of } else { format!("{case}: {of}") }
}

/// Where the columns are.
struct Columns {
    phase: usize,
    sweep: usize,
    threading: usize,
    skip: usize,
    block: usize,
    frame: usize,
    warm_up: usize,
    frame_ms: usize,
    game_ms: usize,
    record_ms: usize,
    submit_ms: usize,
    wait_ms: usize,
    gpu_ms: usize,
    /// Names and places.
    passes: Vec<(String, usize)>,
    n: usize,
}

impl Columns {
    /// None when one is missing, with its name.
    fn of(header: &StringRecord) -> std::result::Result<Columns, &'static str> {
        let find = |name: &'static str| header.iter().position(|field| field == name).ok_or(name);
        let pass = |field: &str| Some(field.strip_prefix("gpu_")?.strip_suffix("_ms")?.to_owned());
        Ok(Columns {
            phase: find("phase")?,
            sweep: find("sweep")?,
            threading: find("threading")?,
            skip: find("skip")?,
            block: find("block")?,
            frame: find("frame")?,
            warm_up: find("warm_up")?,
            frame_ms: find("frame_ms")?,
            game_ms: find("game_ms")?,
            record_ms: find("record_ms")?,
            submit_ms: find("submit_ms")?,
            wait_ms: find("wait_ms")?,
            gpu_ms: find("gpu_ms")?,
            passes: header
                .iter()
                .enumerate()
                .filter_map(|(i, field)| Some((pass(field)?, i)))
                .collect(),
            n: header.len(),
        })
    }

    fn measures(&self) -> Vec<Measure> {
        let names = ["frame", "game", "render", "gpu"]
            .into_iter()
            .chain(self.passes.iter().map(|(name, _)| name.as_str()));
        names.map(|name| Measure { name: name.to_owned(), ms: Vec::new() }).collect()
    }

    /// The times of a line, in the order of `measures`; None where it has none.
    fn times(&self, line: &StringRecord) -> std::result::Result<Vec<Option<f64>>, String> {
        let ms = |column: usize| match &line[column] {
            "" => Ok(None),
            text => text
                .parse::<f64>()
                .ok()
                .filter(|ms| ms.is_finite())
                .map(Some)
                .ok_or_else(|| odd("a time in ms", text)),
        };
        let parts = [ms(self.record_ms)?, ms(self.submit_ms)?, ms(self.wait_ms)?];
        let render = parts.into_iter().try_fold(0.0, |sum, part| part.map(|part| sum + part));
        let mut times = vec![ms(self.frame_ms)?, ms(self.game_ms)?, render, ms(self.gpu_ms)?];
        for (_, column) in &self.passes {
            times.push(ms(*column)?);
        }
        Ok(times)
    }
}

fn odd(expected: &str, found: &str) -> String {
    format!("expected {expected}, found \"{found}\"")
}

/// What is known of a mode while its lines are read.
struct Lines {
    mode: TimedMode,
    /// Number of the block that the last line was of.
    last_block: Option<u32>,
}

/// The timed frames of every mode in the text of a `frames.csv`.
fn read_frames(path: &Path, text: &str) -> Result<BTreeMap<String, TimedMode>> {
    // Lines of another length are found here, for one message that says what is wrong.
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|cause| Error::io(path, cause))?.clone();
    let columns = Columns::of(&header).map_err(|name| {
        Error::io(path, format!("no {FRAMES_FILE} of nimbus: it has no column {name}"))
    })?;
    let mut modes: BTreeMap<String, Lines> = BTreeMap::new();
    for line in reader.records() {
        let line = line.map_err(|cause| Error::io(path, cause))?;
        let at = line.position().map_or(0, csv::Position::line);
        add_line(&columns, &line, &mut modes)
            .map_err(|what| Error::io(path, format!("line {at}: {what}")))?;
    }
    Ok(modes.into_iter().map(|(name, lines)| (name, lines.mode)).collect())
}

fn add_line(
    columns: &Columns,
    line: &StringRecord,
    modes: &mut BTreeMap<String, Lines>,
) -> std::result::Result<(), String> {
    if line.len() != columns.n {
        return Err(format!(
            "expected {} fields as in the header, found {}: cut off?",
            columns.n,
            line.len()
        ));
    }
    let is = |column: usize, of: &str| match &line[column] {
        "true" => Ok(true),
        "false" => Ok(false),
        other => Err(odd(&format!("true or false for {of}"), other)),
    };
    if is(columns.warm_up, "warm_up")? {
        return Ok(());
    }
    let number = |column: usize, what: &str| {
        line[column].parse::<u32>().map_err(|_| odd(what, &line[column]))
    };
    let (block, frame) =
        (number(columns.block, "a block's number")?, number(columns.frame, "a frame's number")?);
    let times = columns.times(line)?;
    let case = case_name(&line[columns.phase], &line[columns.sweep]);
    let name = mode_name(&case, &line[columns.threading], is(columns.skip, "skip")?);
    let lines = modes.entry(name.clone()).or_insert_with(|| Lines {
        mode: TimedMode {
            name,
            frames: Vec::new(),
            blocks: Vec::new(),
            measures: columns.measures(),
        },
        last_block: None,
    });
    if lines.last_block.replace(block) != Some(block) {
        lines.mode.blocks.push(Vec::new());
    }
    lines.mode.frames.push(frame);
    if let (Some(block), Some(Some(frame_ms))) = (lines.mode.blocks.last_mut(), times.first()) {
        block.push(*frame_ms);
    }
    for (measure, ms) in lines.mode.measures.iter_mut().zip(times) {
        measure.ms.extend(ms);
    }
    Ok(())
}
