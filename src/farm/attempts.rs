//! The record of attempts: a line for each event, in a file for each node.
//!
//! Two machines never write the same file. Slurm keeps a record, too, but not of tasks that died
//! with their node.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::transient::io_error;
use super::{journal, node};
use crate::error::Result;
use crate::io::atomic;
use crate::timing::machine;

/// An event of a run at a shard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// UTC, ISO 8601.
    pub date: String,
    /// The shard's number.
    pub index: usize,
    /// The shard's key.
    pub key: String,
    /// The machine of the run.
    pub node: String,
    /// The process of the run.
    pub pid: u32,
    /// Slurm's name for the run, with its restart.
    pub job: Option<String>,
    /// The event.
    pub event: Event,
}

/// The events that runs record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// The run has begun to make the shard.
    Begun,
    /// The shard had a verified result.
    Skipped,
    /// The run has put its result into place.
    Done {
        /// Duration of the run.
        seconds: f64,
        /// Files that earlier attempts had finished.
        n_resumed: usize,
    },
    /// Another run put an equal result into place first.
    Beaten {
        /// Duration of the run.
        seconds: f64,
    },
    /// The run has failed.
    Failed {
        /// Duration of the run.
        seconds: f64,
        /// [`crate::error::Error::exit_code`]
        exit_code: u8,
        /// Files that it finished; a later attempt takes them over.
        #[serde(default)]
        n_new: usize,
        /// The error's message.
        what: String,
    },
    /// A broken result was moved aside.
    PutAside {
        /// Its defect.
        what: String,
        /// Its new path.
        to: String,
    },
}

/// The record of this process.
#[derive(Debug, Clone)]
pub struct Log {
    file: PathBuf,
    /// The name of this machine.
    pub node: String,
    /// The number of this process.
    pub pid: u32,
    job: Option<String>,
}

impl Log {
    /// Opens the record of this process in a plan's folder.
    ///
    /// # Errors
    /// When the folder of records cannot be made.
    pub fn open(folder: &Path) -> Result<Log> {
        let folder = folder.join("attempts");
        atomic::make_folder(&folder)?;
        let node = node::node_name();
        let file = folder.join(format!("{node}.jsonl"));
        Ok(Log { file, node, pid: std::process::id(), job: node::job_name() })
    }

    /// Appends an event.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn append(&self, index: usize, key: &str, event: Event) -> Result<()> {
        let Log { file, node, pid, job } = self.clone();
        let date = machine::utc_now();
        journal::append(&file, &Attempt { date, index, key: key.to_owned(), node, pid, job, event })
    }
}

/// Returns all events of the plan in `folder`, in the order of their dates.
///
/// # Errors
/// When a record exists and cannot be read.
pub fn read(folder: &Path) -> Result<Vec<Attempt>> {
    let folder = folder.join("attempts");
    let Ok(entries) = fs::read_dir(&folder) else { return Ok(Vec::new()) };
    let mut all: Vec<Attempt> = Vec::new();
    for entry in entries {
        let path = entry.map_err(io_error(&folder))?.path();
        all.extend(journal::read::<Attempt>(&path).map_err(io_error(&path))?);
    }
    all.sort_by(|a, b| a.date.cmp(&b.date));
    Ok(all)
}

/// Returns how often in a row the Slurm task of this process has failed at a shard without
/// finishing a file.
///
/// Only transient failures count. Where the failure of this process could not be recorded, earlier
/// ones may be missing, too: then the starts of the task count, with those that died.
pub fn n_fruitless(folder: &Path, index: usize) -> usize {
    // A record that cannot be read counts as missing.
    let all = read(folder).unwrap_or_default();
    let (job, node) = (node::job_name(), node::node_name());
    fruitless(&all, index, job.as_deref(), &node, std::process::id())
        .unwrap_or_else(|| node::n_restarts() + 1)
}

/// Returns none where the failure of this process is not recorded.
fn fruitless(
    all: &[Attempt],
    index: usize,
    job: Option<&str>,
    node: &str,
    pid: u32,
) -> Option<usize> {
    let task = job.map(node::task_of);
    let is_of_task = |a: &&Attempt| a.index == index && a.job.as_deref().map(node::task_of) == task;
    let failed = all.iter().rev().filter(is_of_task).filter_map(|a| match &a.event {
        Event::Failed { exit_code: 75, n_new, .. } => Some((a, *n_new)),
        _ => None,
    });
    let is_own = |a: &Attempt| a.job.as_deref() == job && a.node == node && a.pid == pid;
    let mut own = failed.clone().filter(|(a, _)| is_own(a));
    own.next().map(|_| failed.take_while(|(_, n_new)| *n_new == 0).count())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_read_back_and_a_truncated_line_is_left_out() {
        let dir = tempfile::tempdir().unwrap();
        assert!(read(dir.path()).unwrap().is_empty());
        let log = Log::open(dir.path()).unwrap();
        let what = "a \"disk\"\nis full".into();
        let events = [
            Event::Begun,
            Event::Failed { seconds: 1.5, exit_code: 75, n_new: 0, what },
            Event::Done { seconds: 2.0, n_resumed: 3 },
        ];
        for event in &events {
            log.append(4, "abc", event.clone()).unwrap();
        }
        let text = fs::read_to_string(&log.file).unwrap();
        fs::write(&log.file, &text[..text.len() - 20]).unwrap();
        let found = read(dir.path()).unwrap();
        assert_eq!(found.iter().map(|a| a.event.clone()).collect::<Vec<_>>(), events[..2]);
        let pid = std::process::id();
        assert!(found.iter().all(|a| a.index == 4 && a.key == "abc" && a.pid == pid));
    }

    #[test]
    fn fruitless_failures_of_the_own_task_are_counted() {
        let attempt = |job: &str, pid, event| Attempt {
            date: String::new(),
            index: 4,
            key: "abc".into(),
            node: "n1".into(),
            pid,
            job: Some(job.into()),
            event,
        };
        let failed = |exit_code, n_new| Event::Failed {
            seconds: 1.0,
            exit_code,
            n_new,
            what: String::new(),
        };
        let mut all = vec![
            attempt("17_4", 1, failed(75, 0)),
            // This attempt finished files, so that counting starts again after it.
            attempt("17_4 restart 1", 2, failed(75, 3)),
            // This one died with its node.
            attempt("17_4 restart 2", 3, Event::Begun),
            attempt("17_4 restart 3", 4, failed(75, 0)),
            // Another task, another submission and another shard.
            attempt("17_40", 5, failed(75, 0)),
            attempt("9_4", 6, failed(75, 0)),
            Attempt { index: 5, ..attempt("17_4", 7, failed(75, 0)) },
            attempt("17_4 restart 4", 8, Event::Begun),
            attempt("17_4 restart 4", 8, failed(75, 0)),
        ];
        let count = |all: &[Attempt], pid| fruitless(all, 4, Some("17_4 restart 4"), "n1", pid);
        assert_eq!(count(&all, 8), Some(2));
        // The failure of process 9 is not recorded.
        assert_eq!(count(&all, 9), None);
        all.push(attempt("17_4 restart 4", 8, failed(75, 1)));
        assert_eq!(count(&all, 8), Some(0));
    }
}
