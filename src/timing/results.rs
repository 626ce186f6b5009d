//! Results folders: `run.json` and `frames.csv`, with the pictures and charts beside them.
//!
//! All files appear whole and together, or not at all ([`crate::io::folder`]).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::attachments::{self, Attachments};
use super::frame_rows::{FRAMES_FILE, FrameRow, FrameTable, parse_frames, write_frames};
use super::intervals::values;
use super::json::{self, ResultFile};
use super::names::{case_name, mode_name};
use super::precision::WIDENING;
use super::records::{Case, Mode, Run};
use crate::error::{Error, Result};
use crate::io::result_folder::{Existing, ResultFolder};
use crate::io::text_file::{TABLE_LIMIT, read_result};
use crate::measure::blocked::Block;

/// File name of the record of a run.
pub const RUN_FILE: &str = Run::FILE;

/// The results of a bench.
#[derive(Debug, Clone)]
pub struct BenchResults {
    /// The record of the run.
    pub run: Run,
    /// The times of every loop of every case, in the order of `run.cases` and their modes; a loop
    /// without timed frames is missing.
    pub modes: Vec<TimedMode>,
}

impl BenchResults {
    /// Returns every loop that has timed frames, with its case and its record, in order.
    pub fn timed(&self) -> impl Iterator<Item = (&Case, &Mode, &TimedMode)> {
        let recorded = self.run.modes().filter(|(_, mode)| mode.frames > 0);
        recorded.zip(&self.modes).map(|((case, mode), timed)| (case, mode, timed))
    }
}

/// The timed frames of one loop of one case.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedMode {
    /// Case and loop, as "dense, size=800x600: serial"; the loop alone if there is one case.
    pub name: String,
    /// Frames of the scene, in the order in which they ran.
    pub frames: Vec<u32>,
    /// The factor of its intervals.
    pub widening: f64,
    /// `frame`, `game`, `render`, `gpu`, then the passes in the order of the table.
    pub measures: Vec<Measure>,
}

impl TimedMode {
    /// Returns the times of a measure in ms, block by block; empty if there is no such measure.
    pub fn times(&self, name: &str) -> &[Block] {
        self.measures.iter().find(|m| m.name == name).map_or(&[], |m| &m.blocks)
    }
}

/// One kind of time of the frames of a loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    /// Name of the measure.
    pub name: String,
    /// Times in ms, in the order in which they were taken, without the frames that have none. The
    /// stratum of a block is its first timed frame.
    pub blocks: Vec<Block>,
}

impl Measure {
    /// Returns the times of all blocks.
    pub fn ms(&self) -> Vec<f64> {
        values(&self.blocks)
    }
}

/// Claims the folder for the results of a bench of `n_cases` before anything is measured.
///
/// # Errors
/// Fails as [`ResultFolder::open`].
pub fn open_results(
    place: &Path,
    existing: Existing,
    n_cases: usize,
    has_charts: bool,
) -> Result<ResultFolder> {
    let mut planned = attachments::planned(n_cases, has_charts);
    planned.extend([FRAMES_FILE, RUN_FILE].map(str::to_owned));
    ResultFolder::open(place, "run", existing, &planned)
}

/// Writes all files of a bench together. Results of a run that ended early do not replace earlier
/// ones.
///
/// # Errors
/// Fails as [`ResultFolder::write_last`].
pub fn write_results(
    folder: &mut ResultFolder,
    run: &Run,
    table: &FrameTable,
    attachments: &Attachments,
) -> Result<()> {
    let mut names = attachments.names();
    // The record is last: a folder that has it has everything.
    names.extend([FRAMES_FILE, RUN_FILE].map(str::to_owned));
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let write = |folder: &Path| {
        attachments.write(folder)?;
        write_frames(&folder.join(FRAMES_FILE), table)?;
        json::write(&folder.join(RUN_FILE), run)
    };
    folder.write_last(!run.interrupted, &names, write)
}

/// Reads a folder that `nimbus bench --out` wrote.
///
/// # Errors
/// Fails if a file is missing, damaged or from another run. The error names the file, and the line
/// if there is one.
pub fn read_results(folder: &Path) -> Result<BenchResults> {
    if !folder.is_dir() {
        let what = "no such folder; expected one that nimbus bench --out wrote";
        return Err(Error::io(folder, what));
    }
    if !folder.join(RUN_FILE).exists() {
        return Err(Error::io(folder, format!("holds no {RUN_FILE}; {}", expected_in(folder))));
    }
    let run = json::read(folder)?;
    let path = folder.join(FRAMES_FILE);
    parse_results(run, &read_result(&path, TABLE_LIMIT)?, &path)
}

/// Joins a run with the text of its `frames.csv`; errors name `path`.
///
/// # Errors
/// Fails if the text is not such a table, or its frames are not those of the run.
pub fn parse_results(run: Run, text: &str, path: &Path) -> Result<BenchResults> {
    join(run, &parse_frames(text, path)?, path)
}

/// Joins a run with its frames; errors name `path`, the file of the frames.
///
/// # Errors
/// Fails if the frames are not those of the run.
pub(super) fn join(run: Run, table: &FrameTable, path: &Path) -> Result<BenchResults> {
    let mut by_name = timed_modes(&run, table);
    let mut modes = Vec::new();
    for (case, mode) in run.modes() {
        let name = mode.name_in(case);
        let timed = by_name.remove(&name);
        let (n, n_expected) = (timed.as_ref().map_or(0, |m| m.frames.len()), mode.frames);
        if n != n_expected {
            let what = format!("holds {n} timed {name} frames and {RUN_FILE} names {n_expected}");
            return Err(Error::io(path, format!("{what}: cut off, or another run's")));
        }
        let widening = if case.precision.is_some() { WIDENING } else { 1.0 };
        modes.extend(timed.map(|timed| TimedMode { widening, ..timed }));
    }
    match by_name.keys().next() {
        Some(other) => {
            Err(Error::io(path, format!("holds {other} frames, which {RUN_FILE} does not name")))
        }
        None => Ok(BenchResults { run, modes }),
    }
}

/// Returns a hint for a folder without results: those of several scenes lie one folder deeper.
fn expected_in(folder: &Path) -> String {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let deeper: Option<PathBuf> =
        entries.map(|e| e.path()).filter(|p| p.join(RUN_FILE).exists()).min();
    deeper.map_or("expected a folder that nimbus bench --out wrote".to_owned(), |first| {
        let first = first.display();
        format!("it has folders of results in it: name one of those, such as {first}")
    })
}

/// Groups the timed frames by case and loop.
fn timed_modes(run: &Run, table: &FrameTable) -> BTreeMap<String, TimedMode> {
    let mut modes: BTreeMap<String, TimedMode> = BTreeMap::new();
    let mut last_blocks: BTreeMap<String, u32> = BTreeMap::new();
    for row in table.rows.iter().filter(|row| row.is_timed()) {
        let case = case_name(&row.phase, &row.sweep);
        let name = mode_name(&case, &row.threading, row.skip);
        let mode = modes.entry(name.clone()).or_insert_with(|| {
            let names = ["frame", "game", "render", "gpu"].into_iter();
            let names = names.chain(table.pass_names.iter().map(String::as_str));
            let measure = |name: &str| Measure { name: name.to_owned(), blocks: Vec::new() };
            let measures = names.map(measure).collect();
            TimedMode { name: name.clone(), frames: Vec::new(), widening: 1.0, measures }
        });
        if last_blocks.insert(name, row.block) != Some(row.block) {
            let start = run.block_order.get(row.block as usize).map_or(0, |block| block.start);
            let begin = || Block { start, stratum: row.frame, values: Vec::new() };
            mode.measures.iter_mut().for_each(|measure| measure.blocks.push(begin()));
        }
        mode.frames.push(row.frame);
        for (measure, ms) in mode.measures.iter_mut().zip(row_times(row)) {
            if let Some(block) = measure.blocks.last_mut() {
                block.values.extend(ms);
            }
        }
    }
    modes
}

/// Returns the times of a frame in the order of [`TimedMode::measures`].
pub(super) fn row_times(row: &FrameRow) -> Vec<Option<f64>> {
    let of_frame = [row.frame_ms, row.game_ms, row.render_ms()].map(Some).into_iter();
    let times = of_frame.chain([row.gpu_ms]).chain(row.pass_ms.iter().copied());
    times.map(|ms| ms.filter(|ms| ms.is_finite())).collect()
}
