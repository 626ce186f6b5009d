//! Turns the samples of a bench into its record, files and tables, at its end or at Ctrl-C.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use clap::ColorChoice;

use super::args::BenchArgs;
use super::bench_cases::precision;
use super::output::{SharedFolder, lock_folder};
use super::{bench_plot, bench_table, output};
use crate::error::{Error, Result};
use crate::gpu::{ClockFit, ClockSample, DeviceInfo};
use crate::io::console::say;
use crate::io::process_info::command_line;
use crate::measure::zones::Zones;
use crate::timing::attachments::Attachments;
use crate::timing::blocks::{self, BenchPlan, Outcome};
use crate::timing::cases::Case;
use crate::timing::frame_rows::FrameTable;
use crate::timing::json::ResultFile;
use crate::timing::machine::{self, Clocks};
use crate::timing::precision::PrecisionRecord;
use crate::timing::records::Run;
use crate::timing::results::write_results;
use crate::timing::roofs::Roofs;
use crate::timing::state::{BenchState, STATE_FILE, rows_text};
use crate::timing::{shares, trace};

/// The conditions of a bench of one scene, and where its results go.
pub struct Recorder {
    /// The arguments.
    pub args: BenchArgs,
    /// Colours of charts.
    pub color: ColorChoice,
    /// The scene file.
    pub path: PathBuf,
    /// The results folder, from when it is claimed.
    pub folder: SharedFolder,
    /// The cases that are timed.
    pub cases: Vec<Case>,
    /// SHA-256 of the scene without a sweep.
    pub scene_hash: String,
    /// The scene with every default filled in.
    pub resolved: serde_json::Value,
    /// The blocks.
    pub plan: BenchPlan,
    /// The time at which the bench began.
    pub date: String,
    /// The device.
    pub info: DeviceInfo,
    /// The precision of the clocks.
    pub clocks: Clocks,
    /// The zones of the threads, if they are collected.
    pub zones: Option<Zones>,
    /// Readings of the device's clock and the host's before the frames.
    pub readings: Vec<ClockSample>,
}

/// The records of the scenes that are done, for `--json`.
pub type Runs = Arc<Mutex<Vec<Run>>>;

impl Recorder {
    /// Writes and prints the results, and returns the record. `later` are the readings of the
    /// clocks after the frames.
    ///
    /// # Errors
    /// Fails if a file or stdout cannot be written.
    pub fn record(&self, outcome: &Outcome, later: &[ClockSample], is_cut: bool) -> Result<Run> {
        let Recorder { args, cases, .. } = self;
        let run = self.run(outcome, is_cut);
        let needs_table = args.out.is_some() || args.plot;
        let table = if needs_table { outcome.table(cases) } else { FrameTable::default() };
        let written = self.write(&run, &table, outcome);
        // The tables appear even where the files cannot be written.
        if !args.json && args.as_start.is_none() {
            self.print(&run, outcome)?;
            if args.plot {
                output::painted(&bench_plot::text(&run, &table.rows, self.color)?)?;
            }
        }
        written?;
        if let Some(file) = &args.trace {
            let readings = [&self.readings[..], later].concat();
            let zones = self.zones.as_ref().map(Zones::take);
            let clock = ClockFit::from_samples(&readings);
            trace::write(file, &outcome.samples, zones.as_ref(), clock)?;
        }
        let quiet = args.options.quiet;
        // The folder of a start is read by its parent and then removed.
        let folder = lock_folder(&self.folder);
        if let Some(folder) = folder.as_ref().filter(|_| args.as_start.is_none()) {
            output::wrote_folder(folder, !run.interrupted, quiet);
        }
        if let Some(file) = &args.trace {
            output::wrote(file, "the zones of all threads and of the device", quiet);
        }
        if !quiet {
            outcome.chosen.iter().for_each(|chosen| say!("note: {chosen}"));
            outcome.notes.iter().for_each(|note| say!("warning: {note}"));
        }
        Ok(run)
    }

    /// Keeps what a bench has finished that takes too long to stop. Returns the error that the
    /// program ends with.
    pub fn keep(&self, outcome: &Mutex<Outcome>, before: &Runs) -> Error {
        let mut outcome = blocks::lock(outcome).clone();
        outcome.interrupted = true;
        if outcome.samples.is_empty() {
            drop(lock_folder(&self.folder).take());
            say!("no frame was finished, nothing is kept");
            return Error::Interrupted;
        }
        outcome.judge();
        let printed = self.record(&outcome, &[], true).and_then(|run| {
            before.lock().unwrap_or_else(PoisonError::into_inner).push(run);
            print_json(&self.args, before)
        });
        printed.err().unwrap_or(Error::Interrupted)
    }

    fn run(&self, outcome: &Outcome, is_cut: bool) -> Run {
        let mut cases = outcome.cases(&self.cases, &self.plan);
        let ceilings = Roofs::kept(&self.info).and_then(|roofs| roofs.ceilings());
        let cold_bytes = self.plan.cold_bytes;
        shares::add(&mut cases, &outcome.amounts, ceilings.as_ref(), cold_bytes.is_some());
        Run {
            schema: Run::SCHEMA,
            nimbus: env!("CARGO_PKG_VERSION").into(),
            revision: machine::revision().into(),
            tool: None,
            date: self.date.clone(),
            command: command_line(),
            scene_hash: self.scene_hash.clone(),
            scene: self.resolved.clone(),
            device: machine::device_record(&self.info),
            cpu: machine::cpu(),
            environment: machine::environment(),
            clocks: self.clocks,
            block_order: outcome.block_order(),
            cases,
            stages: outcome.stages.clone(),
            chosen: outcome.chosen.clone(),
            parts: Vec::new(),
            interrupted: is_cut,
            precision: precision(&self.args).map(|asked| PrecisionRecord {
                wanted: asked.wanted,
                seed: asked.seed,
                limit_s: asked.limit.as_secs_f64(),
            }),
            state: outcome.state.as_ref().map(|state| state.run.clone()),
            ceilings,
            cold_bytes,
        }
    }

    fn write(&self, run: &Run, table: &FrameTable, outcome: &Outcome) -> Result<()> {
        let mut folder = lock_folder(&self.folder);
        let Some(folder) = &mut *folder else { return Ok(()) };
        let charts = if self.args.plot { bench_plot::files(run, &table.rows)? } else { vec![] };
        let pictures = outcome.pictures.clone();
        let readings = |state: &BenchState| Ok((STATE_FILE.to_owned(), rows_text(&state.rows)?));
        let tables = outcome.state.as_ref().map(readings).into_iter().collect::<Result<_>>()?;
        let attachments = Attachments { pictures, charts, tables, copies: vec![] };
        write_results(folder, run, table, &attachments)
    }

    /// Prints the tables.
    fn print(&self, run: &Run, outcome: &Outcome) -> Result<()> {
        let cases = self.cases.iter().enumerate();
        let same = cases.map(|(i, case)| outcome.is_same_picture(i, case));
        let same: Vec<Option<bool>> = same.collect();
        output::text(&bench_table::report(&self.path, run, &same, self.args.options.verbose))
    }
}

/// Prints the records of all scenes that are done, if `--json` is given.
///
/// # Errors
/// Fails if stdout cannot be written.
pub fn print_json(args: &BenchArgs, runs: &Runs) -> Result<()> {
    let runs = runs.lock().unwrap_or_else(PoisonError::into_inner);
    if !args.json || runs.is_empty() {
        return Ok(());
    }
    if let [run] = &runs[..] { output::object(run) } else { output::object(&*runs) }
}
