//! The state of every shard of a farm.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use serde::Serialize;

use super::attempts::{self, Attempt, Event};
use super::cost::ErrorSummary;
use super::plan::{Plan, Shard};
use super::ranges::ranges;
use super::slurm;
use super::store::{Leftover, ResultState, Store};
use crate::error::Result;

/// The state of a farm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Status {
    /// Every shard, in the plan's order.
    pub shards: Vec<ShardStatus>,
    /// The number of shards that are done.
    pub n_done: usize,
    /// Errors of the predicted durations, of shards that a single run made on the hardware that
    /// they were predicted for.
    pub predicted: Option<ErrorSummary>,
    /// The number of shards that other hardware made.
    pub n_other_class: usize,
    /// The reason why Slurm does not answer.
    pub engine_silent: Option<String>,
}

/// The state of a shard.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShardStatus {
    /// Its number.
    pub index: usize,
    /// Its key.
    pub key: String,
    /// Its state.
    pub state: State,
    /// The defect of its result, or the failure of its last attempt.
    pub what: Option<String>,
    /// Duration of the run that made it.
    pub seconds: Option<f64>,
    /// Duration that the plan predicted.
    pub predicted_s: Option<f64>,
    /// The machine that made it.
    pub node: Option<String>,
    /// The device that made it.
    pub device: Option<String>,
    /// The number of runs that began to make it.
    pub n_attempts: usize,
    /// The number of unfinished folders.
    pub n_unfinished: usize,
    /// The number of whole results that differ from the one in place.
    pub n_differing: usize,
    /// The state of the shard's Slurm task, such as "RUNNING on n2 (17_3)".
    pub engine: Option<String>,
}

/// The states of a shard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Its result is whole.
    Done,
    /// Its result differs from its manifest.
    Broken,
    /// Its result could not be read.
    Unreadable,
    /// Its last attempt failed in a way that another try may not.
    Transient,
    /// Its last attempt failed, and no try helps.
    Failed,
    /// An attempt has begun, and may be running.
    Begun,
    /// No attempt has begun.
    Open,
}

/// The state's name, as in JSON.
impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl Status {
    /// Returns the state of the plan in `folder`. Reads every result, and does not ask Slurm.
    ///
    /// # Errors
    /// When the attempts cannot be read.
    pub fn new(folder: &Path, plan: &Plan) -> Result<Status> {
        let (store, attempts) = (Store::new(folder, plan), attempts::read(folder)?);
        let leftovers = store.leftovers();
        let mut by_key: BTreeMap<&str, Vec<&Attempt>> = BTreeMap::new();
        attempts.iter().for_each(|attempt| by_key.entry(&attempt.key).or_default().push(attempt));
        let (mut pairs, mut n_other_class) = (Vec::new(), 0);
        let of = |shard: &Shard| {
            let result = store.state(shard);
            let events = by_key.get(shard.key.as_str()).map_or(&[][..], Vec::as_slice);
            let (state, what) = state_of(&result, events.last().map(|attempt| &attempt.event));
            let manifest =
                if let ResultState::Verified(manifest) = result { Some(manifest) } else { None };
            if let (Some(manifest), Some(predicted_s)) = (&manifest, shard.predicted_s)
                && manifest.n_resumed == 0
            {
                if plan.predicted_for.as_ref().is_none_or(|class| *class == manifest.class()) {
                    pairs.push((predicted_s, manifest.seconds));
                } else {
                    n_other_class += 1;
                }
            }
            ShardStatus {
                index: shard.index,
                key: shard.key.clone(),
                state,
                what,
                seconds: manifest.as_ref().map(|m| m.seconds),
                predicted_s: shard.predicted_s,
                node: manifest.as_ref().map(|m| m.node.clone()),
                device: manifest.map(|m| m.device.name.clone()),
                n_attempts: events.iter().filter(|a| a.event == Event::Begun).count(),
                n_unfinished: leftovers.of(shard, Leftover::Unfinished).len(),
                n_differing: leftovers.of(shard, Leftover::Differing).len(),
                engine: None,
            }
        };
        let shards: Vec<ShardStatus> = plan.shards.iter().map(of).collect();
        let n_done = shards.iter().filter(|shard| shard.state == State::Done).count();
        let predicted = ErrorSummary::new(&pairs);
        Ok(Status { shards, n_done, predicted, n_other_class, engine_silent: None })
    }

    /// Asks Slurm for the tasks of the plan in `folder`. That takes some seconds where Slurm does
    /// not answer.
    pub fn ask_slurm(&mut self, folder: &Path) {
        match slurm::states(folder) {
            Ok(mut states) => {
                self.shards.iter_mut().for_each(|shard| shard.engine = states.remove(&shard.index))
            }
            Err(failure) => self.engine_silent = Some(failure.what),
        }
    }

    /// Returns the numbers of the shards that are not done.
    pub fn open(&self) -> Vec<usize> {
        self.shards.iter().filter(|s| s.state != State::Done).map(|s| s.index).collect()
    }

    /// Returns those numbers as Slurm's `--array` takes them: "0,3-5".
    pub fn missing(&self) -> String {
        ranges(&self.open())
    }
}

fn state_of(result: &ResultState, last: Option<&Event>) -> (State, Option<String>) {
    match (result, last) {
        (ResultState::Verified(_), _) => (State::Done, None),
        (ResultState::Broken(what), _) => (State::Broken, Some(what.clone())),
        (ResultState::Unreadable(error), _) => (State::Unreadable, Some(error.to_string())),
        (_, Some(Event::Failed { exit_code, what, .. })) => {
            let state = if *exit_code == 75 { State::Transient } else { State::Failed };
            (state, Some(what.clone()))
        }
        (_, Some(_)) => (State::Begun, None),
        (_, None) => (State::Open, None),
    }
}
