//! What is done, what is not, and what was tried.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::attempts::{self, Attempt, Event};
use super::cost::Compared;
use super::plan::{Class, Plan, Shard};
use super::slurm;
use super::store::{Other, Standing, Store};
use crate::error::Result;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Status {
    pub shards: Vec<ShardStatus>,
    /// Of `shards`, done.
    pub n_done: usize,
    /// How far what was predicted is off from what it took, of shards that one run did from
    /// beginning to end.
    pub predicted: Option<Compared>,
    /// Shards that a device or processor did for which nothing was predicted; they are not in that.
    pub n_other_class: usize,
    /// Why the engine that shards were submitted to does not say what it does with them.
    pub engine_silent: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShardStatus {
    pub index: usize,
    pub key: String,
    pub state: State,
    /// What is wrong with it, or how its last attempt failed.
    pub what: Option<String>,
    /// Of the run that did it.
    pub seconds: Option<f64>,
    /// What the plan said.
    pub predicted_s: Option<f64>,
    pub node: Option<String>,
    pub device: Option<String>,
    /// Runs that began to work on it.
    pub n_attempts: usize,
    /// Folders of attempts that go on, or were ended.
    pub n_unfinished: usize,
    /// Whole results that contradict the one that is there.
    pub n_differing: usize,
    /// What the engine that it was submitted to does with it now.
    pub engine: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Its result is whole.
    Done,
    /// Something lies under its name that is no result.
    Broken,
    /// What lies there could not be read.
    Unreadable,
    /// The last attempt failed in a way that may pass.
    Transient,
    /// It failed for good.
    Failed,
    /// Somebody works on it, or did when it was ended.
    Begun,
    /// Nobody did.
    Open,
}

impl State {
    pub fn name(self) -> &'static str {
        match self {
            State::Done => "done",
            State::Broken => "broken",
            State::Unreadable => "unreadable",
            State::Transient => "transient",
            State::Failed => "failed",
            State::Begun => "begun",
            State::Open => "open",
        }
    }
}

/// Of the plan in `folder`; reads every result, and asks no engine.
pub fn status(folder: &Path, plan: &Plan) -> Result<Status> {
    let (store, attempts) = (Store::open(folder), attempts::read(folder)?);
    let others = store.others();
    let mut by_key: BTreeMap<&str, Vec<&Attempt>> = BTreeMap::new();
    attempts.iter().for_each(|attempt| by_key.entry(&attempt.key).or_default().push(attempt));
    let (mut pairs, mut n_other_class) = (Vec::new(), 0);
    let of = |shard: &Shard| {
        let standing = store.standing(plan, shard);
        let of_shard = by_key.get(shard.key.as_str()).map_or(&[][..], Vec::as_slice);
        let n_unfinished = others.of(&shard.key, Other::Unfinished).len();
        let (state, what) = state(&standing, of_shard);
        if let (Standing::Verified(manifest), Some(predicted_s)) = (&standing, shard.predicted_s)
            && manifest.n_resumed == 0
        {
            let class = Class { device: manifest.device.class(), cpu: manifest.cpu.class() };
            if plan.predicted_for.as_ref().is_none_or(|of| *of == class) {
                pairs.push((predicted_s, manifest.seconds));
            } else {
                n_other_class += 1;
            }
        }
        let manifest =
            if let Standing::Verified(manifest) = standing { Some(manifest) } else { None };
        ShardStatus {
            index: shard.index,
            key: shard.key.clone(),
            state,
            what,
            seconds: manifest.as_ref().map(|m| m.seconds),
            predicted_s: shard.predicted_s,
            node: manifest.as_ref().map(|m| m.node.clone()),
            device: manifest.map(|m| m.device.name.clone()),
            n_attempts: of_shard.iter().filter(|attempt| attempt.event == Event::Begun).count(),
            n_unfinished,
            n_differing: others.of(&shard.key, Other::Differing).len(),
            engine: None,
        }
    };
    let shards: Vec<ShardStatus> = plan.shards.iter().map(of).collect();
    let n_done = shards.iter().filter(|shard| shard.state == State::Done).count();
    Ok(Status {
        shards,
        n_done,
        predicted: Compared::of(&pairs),
        n_other_class,
        engine_silent: None,
    })
}

fn state(standing: &Standing, attempts: &[&Attempt]) -> (State, Option<String>) {
    match (standing, attempts.last().map(|attempt| &attempt.event)) {
        (Standing::Verified(_), _) => (State::Done, None),
        (Standing::Broken(what), _) => (State::Broken, Some(what.clone())),
        (Standing::Unreadable(error), _) => (State::Unreadable, Some(error.to_string())),
        (_, Some(Event::Failed { exit_code, what, .. })) => {
            let state = if *exit_code == 75 { State::Transient } else { State::Failed };
            (state, Some(what.clone()))
        }
        (_, Some(_)) => (State::Begun, None),
        (_, None) => (State::Open, None),
    }
}

impl Status {
    /// Asks the engine that the plan in `folder` was submitted to, which takes some seconds where
    /// it does not answer.
    pub fn ask_engine(&mut self, folder: &Path) {
        match slurm::states(&slurm::submitted(folder)) {
            Ok(mut states) => {
                self.shards.iter_mut().for_each(|shard| shard.engine = states.remove(&shard.index))
            }
            Err(why) => self.engine_silent = Some(why.what),
        }
    }

    /// Indices that are not done, as Slurm's `--array` takes them: "0,3-5".
    pub fn missing(&self) -> String {
        ranges(&self.open())
    }

    /// The same as numbers.
    pub fn open(&self) -> Vec<usize> {
        self.shards.iter().filter(|s| s.state != State::Done).map(|s| s.index).collect()
    }
}

/// Ascending numbers as engines take them: "0,3-5".
pub fn ranges(indices: &[usize]) -> String {
    let runs = indices.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [first, .., last] => format!("{first}-{last}"),
        [one] => one.to_string(),
        [] => String::new(),
    });
    runs.collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_named_as_engines_take_it() {
        let shard = |index, state| ShardStatus {
            index,
            key: String::new(),
            state,
            what: None,
            seconds: None,
            predicted_s: None,
            node: None,
            device: None,
            n_attempts: 0,
            n_unfinished: 0,
            n_differing: 0,
            engine: None,
        };
        let states = [
            State::Open,
            State::Done,
            State::Failed,
            State::Broken,
            State::Begun,
            State::Done,
            State::Open,
        ];
        let shards: Vec<ShardStatus> =
            states.iter().enumerate().map(|(i, s)| shard(i, *s)).collect();
        let status = |shards| Status {
            shards,
            n_done: 0,
            predicted: None,
            n_other_class: 0,
            engine_silent: None,
        };
        assert_eq!(status(shards).missing(), "0,2-4,6");
        assert_eq!(status(vec![shard(0, State::Done)]).missing(), "");
    }
}
