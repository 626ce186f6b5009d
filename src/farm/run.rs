//! A run of one shard, from what earlier attempts have left to the verified result.

use std::cell::Cell;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use super::attempts::{Event, Log, n_fruitless};
use super::manifest::{Manifest, SCHEMA_VERSION};
use super::plan::{Plan, Shard};
use super::process::EXCLUSIVE;
use super::store::{Placement, ResultState, Store};
use super::transient::as_transient;
use super::work::Task;
use crate::error::{Error, Result};
use crate::frame::DeviceChoice;
use crate::io::scene_file::LoadedScene;
use crate::timing::machine;

/// The way in which a shard was completed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// A verified result was there.
    Skipped,
    /// This run made the result.
    Done {
        /// Duration of the run.
        seconds: f64,
        /// Files that earlier attempts had finished.
        n_resumed: usize,
    },
    /// Another run put an equal result into place first.
    Beaten,
}

/// The device of a run, its end and its progress.
pub struct RunOptions<'a> {
    /// The device to open. Its shaders are the plan's, and without a name its device is, too.
    pub choice: &'a DeviceChoice,
    /// Set when the run is to keep what is finished and end.
    pub stop: &'a AtomicBool,
    /// Called after every item, with whether this run made it.
    pub on_item: &'a dyn Fn(bool),
}

/// A run whose process may end in the middle of an item.
#[derive(Debug)]
pub struct UnfinishedRun {
    log: Log,
    index: usize,
    key: String,
    begin: Instant,
    n_new: AtomicUsize,
}

impl UnfinishedRun {
    /// Begins a run of shard `index` of the plan in `folder`.
    ///
    /// # Errors
    /// When the plan has no such shard or the folder of records cannot be made.
    pub fn begin(folder: &Path, plan: &Plan, index: usize) -> Result<UnfinishedRun> {
        let key = plan.shard(index)?.key.clone();
        let (log, begin, n_new) = (Log::open(folder)?, Instant::now(), AtomicUsize::new(0));
        Ok(UnfinishedRun { log, index, key, begin, n_new })
    }

    /// Counts an item that this run made.
    pub fn count_item(&self) {
        self.n_new.fetch_add(1, Ordering::Relaxed);
    }

    /// Records that the run ends with `error`. A failure to record is ignored, as in [`run`].
    pub fn record(&self, error: &Error) {
        let event = failed(self.begin, error, self.n_new.load(Ordering::Relaxed));
        let _ = self.log.append(self.index, &self.key, event);
    }
}

fn failed(begin: Instant, error: &Error, n_new: usize) -> Event {
    Event::Failed {
        seconds: begin.elapsed().as_secs_f64(),
        exit_code: error.exit_code(),
        n_new,
        what: error.to_string(),
    }
}

/// Does shard `index` of the plan in `folder` unless it is done.
///
/// # Errors
/// With exit code 75 when another try may succeed, with 70 when the result differs from one that is
/// there, with others when no try helps.
pub fn run(folder: &Path, index: usize, options: &RunOptions<'_>) -> Result<Outcome> {
    let plan = Plan::read(folder)?;
    let shard = plan.shard(index)?;
    let (store, log) = (Store::new(folder, &plan), Log::open(folder)?);
    let begin = Instant::now();
    let run = Run { plan: &plan, shard, store, log, options, begin, n_new: Cell::new(0) };
    // A stale plan is refused even where results are there: they are not of the present files.
    let outcome = plan.scene_as_planned().and_then(|loaded| {
        run.attempt(&loaded).or_else(|error| match run.store.state(shard) {
            // Another run has finished the shard meanwhile, and may have removed the files that
            // this one missed.
            ResultState::Verified(_) if !matches!(error, Error::Conflict { .. }) => {
                Ok(Outcome::Beaten)
            }
            _ => Err(as_transient(error)),
        })
    });
    run.log(match &outcome {
        Ok(Outcome::Skipped) => Event::Skipped,
        Ok(Outcome::Done { seconds, n_resumed }) => {
            Event::Done { seconds: *seconds, n_resumed: *n_resumed }
        }
        Ok(Outcome::Beaten) => Event::Beaten { seconds: begin.elapsed().as_secs_f64() },
        Err(error) => failed(begin, error, run.n_new.get()),
    });
    outcome
}

/// Turns a transient error into a permanent one after `n_tries` failures of the same Slurm task in
/// a row that finished nothing.
pub fn give_up_after(n_tries: u32, folder: &Path, index: usize, error: Error) -> Error {
    let Error::Transient { what } = &error else { return error };
    match n_fruitless(folder, index) {
        n if n >= n_tries as usize => Error::Check {
            what: format!("{what}; nothing was finished {n} times in a row: this task ends here"),
        },
        _ => error,
    }
}

struct Run<'a> {
    plan: &'a Plan,
    shard: &'a Shard,
    store: Store<'a>,
    log: Log,
    options: &'a RunOptions<'a>,
    begin: Instant,
    /// The number of files that this run has finished, also where it fails.
    n_new: Cell<usize>,
}

impl Run<'_> {
    /// Records an event. A failure is ignored: on a full disk nothing can be recorded, and a result
    /// counts without its record.
    fn log(&self, event: Event) {
        let _ = self.log.append(self.shard.index, &self.shard.key, event);
    }

    fn attempt(&self, loaded: &LoadedScene) -> Result<Outcome> {
        let Run { plan, shard, store, log, options, .. } = self;
        let name = format!("{}.{}", log.node, log.pid);
        match store.state(shard) {
            ResultState::Verified(_) => return Ok(Outcome::Skipped),
            ResultState::Missing => {}
            ResultState::Unreadable(error) => return Err(error),
            ResultState::Broken(what) => {
                if let Some(to) = store.put_aside(shard, &name)? {
                    self.log(Event::PutAside { what, to: to.display().to_string() });
                }
            }
        }
        let begun = machine::utc_now();
        self.log(Event::Begun);
        let mut workplace = store.begin(shard, &name)?;
        let device = options.choice.device.clone().or_else(|| plan.device.clone());
        let shaders = plan.scene.shaders.clone();
        let choice = DeviceChoice { device, shaders, ..options.choice.clone() };
        let made = plan.work.run(&mut Task {
            scene: &plan.scene,
            loaded,
            items: shard.items(),
            choice: &choice,
            workplace: &mut workplace,
            stop: options.stop,
            on_item: options.on_item,
        });
        self.n_new.set(workplace.n_new());
        let device = made?;
        let (seconds, n_resumed) = (self.begin.elapsed().as_secs_f64(), workplace.n_resumed());
        workplace.finish(Manifest {
            schema: SCHEMA_VERSION,
            key: shard.key.clone(),
            index: shard.index,
            files: Vec::new(),
            node: log.node.clone(),
            pid: log.pid,
            device,
            cpu: machine::cpu(),
            environment: machine::environment(),
            begun,
            seconds,
            n_resumed,
            exclusive: std::env::var_os(EXCLUSIVE).is_some_and(|value| value == "1"),
        })?;
        match store.put(&workplace, shard, &name)? {
            Placement::First => Ok(Outcome::Done { seconds, n_resumed }),
            Placement::Same => Ok(Outcome::Beaten),
        }
    }
}
