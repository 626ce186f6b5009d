//! What was tried, where, and how it ended: a line an event, a file a node, so that no two machines
//! write one file. Engines keep such a record as well, but a node that dies leaves none there.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::failing::of_io;
use super::synced;
use crate::error::Result;
use crate::timing::machine;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// UTC, ISO 8601.
    pub date: String,
    pub index: usize,
    pub key: String,
    pub node: String,
    pub pid: u32,
    /// The engine's name for it, where one runs it.
    pub job: Option<String>,
    pub event: Event,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    Begun,
    /// There was a verified result.
    Skipped,
    Done {
        seconds: f64,
        /// Files that an attempt before had finished.
        n_resumed: usize,
    },
    /// Somebody else's result, with the same content, was there first.
    Beaten {
        seconds: f64,
    },
    Failed {
        seconds: f64,
        exit_code: u8,
        /// Files that it had finished, for those after it.
        #[serde(default)]
        n_new: usize,
        what: String,
    },
    /// A result under the right name was not what it says: what was wrong with it, and where it was
    /// put.
    PutAside {
        what: String,
        to: String,
    },
}

/// Who writes.
#[derive(Debug, Clone)]
pub struct Log {
    file: PathBuf,
    pub node: String,
    pub pid: u32,
    job: Option<String>,
}

impl Log {
    /// In a plan's folder, of this process.
    pub fn open(folder: &Path) -> Result<Log> {
        let folder = folder.join("attempts");
        synced::make_folder(&folder)?;
        let node = node();
        let file = folder.join(format!("{node}.jsonl"));
        Ok(Log { file, node, pid: std::process::id(), job: job() })
    }

    pub fn say(&self, index: usize, key: &str, event: Event) -> Result<()> {
        let Log { node, pid, job, .. } = self.clone();
        let attempt =
            Attempt { date: machine::utc_now(), index, key: key.to_owned(), node, pid, job, event };
        let line = serde_json::to_string(&attempt).unwrap_or_default();
        synced::append(&self.file, &line)
    }
}

/// All attempts of a plan, in the order of their dates. A line that was cut off by whatever ended
/// its writer is left out.
pub fn read(folder: &Path) -> Result<Vec<Attempt>> {
    let folder = folder.join("attempts");
    let Ok(entries) = fs::read_dir(&folder) else { return Ok(Vec::new()) };
    let mut all: Vec<Attempt> = Vec::new();
    for entry in entries {
        let path = entry.map_err(|cause| of_io(&folder, &cause))?.path();
        let text = fs::read(&path).map_err(|cause| of_io(&path, &cause))?;
        all.extend(
            String::from_utf8_lossy(&text)
                .lines()
                .filter_map(|line| serde_json::from_str(line).ok()),
        );
    }
    all.sort_by(|a, b| a.date.cmp(&b.date));
    Ok(all)
}

/// How often the task of the engine that this process is has just failed at shard `index` in a row,
/// in ways that may pass and without finishing anything. What finished something ends the row, so
/// that whoever ends by this count ends. Where this failure could not be written down those before
/// may not have been either: then it is how often the engine began the task, with all that died.
pub fn n_fruitless(folder: &Path, index: usize) -> usize {
    // What cannot be read counts as not written.
    let all = read(folder).unwrap_or_default();
    let n_restarts = std::env::var("SLURM_RESTART_COUNT")
        .ok()
        .and_then(|n| n.parse::<usize>().ok())
        .unwrap_or(0);
    fruitless(&all, index, job().as_deref(), &node(), std::process::id()).unwrap_or(n_restarts + 1)
}

/// None where the failure of this process is not there.
fn fruitless(
    all: &[Attempt],
    index: usize,
    job: Option<&str>,
    node: &str,
    pid: u32,
) -> Option<usize> {
    let task =
        |job: Option<&str>| job.map(|job| job.split(RESTART).next().unwrap_or(job).to_owned());
    let ours = all.iter().rev().filter(|a| a.index == index && task(a.job.as_deref()) == task(job));
    let failed: Vec<(&Attempt, usize)> = ours
        .filter_map(|a| match &a.event {
            Event::Failed { exit_code: 75, n_new, .. } => Some((a, *n_new)),
            _ => None,
        })
        .collect();
    let is_ours = |a: &Attempt| a.job.as_deref() == job && a.node == node && a.pid == pid;
    failed
        .iter()
        .any(|(a, _)| is_ours(a))
        .then(|| failed.iter().take_while(|(_, n_new)| *n_new == 0).count())
}

const RESTART: &str = " restart ";

/// This machine, as its engine names it, or as it does itself; fit for a file's name.
pub(super) fn node() -> String {
    let of = |name| std::env::var(name).ok();
    let kernel = || fs::read_to_string("/proc/sys/kernel/hostname").ok();
    // A shell hands its HOSTNAME on to where it is wrong.
    let name = of("SLURMD_NODENAME").or_else(kernel).or_else(|| of("HOSTNAME")).unwrap_or_default();
    let fit = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '-' };
    let name: String = name.trim().chars().map(fit).collect();
    if name.is_empty() { "node".to_owned() } else { name }
}

/// Slurm's name for what runs here; the restart tells a requeued job from the one before.
fn job() -> Option<String> {
    let of = |name| std::env::var(name).ok();
    let id = match (of("SLURM_ARRAY_JOB_ID"), of("SLURM_ARRAY_TASK_ID")) {
        (Some(job), Some(task)) => format!("{job}_{task}"),
        _ => of("SLURM_JOB_ID")?,
    };
    Some(of("SLURM_RESTART_COUNT").map_or(id.clone(), |restart| format!("{id}{RESTART}{restart}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_read_back_and_a_cut_line_is_left_out() {
        let dir = tempfile::tempdir().unwrap();
        assert!(read(dir.path()).unwrap().is_empty());
        let log = Log::open(dir.path()).unwrap();
        let events = [
            Event::Begun,
            Event::Failed {
                seconds: 1.5,
                exit_code: 75,
                n_new: 0,
                what: "a \"disk\"\nis full".into(),
            },
            Event::Done { seconds: 2.0, n_resumed: 3 },
        ];
        for event in &events {
            log.say(4, "abc", event.clone()).unwrap();
        }
        let text = fs::read_to_string(&log.file).unwrap();
        fs::write(&log.file, &text[..text.len() - 20]).unwrap();
        let found = read(dir.path()).unwrap();
        assert_eq!(found.iter().map(|a| a.event.clone()).collect::<Vec<_>>(), events[..2]);
        assert!(
            found.iter().all(|a| a.index == 4 && a.key == "abc" && a.pid == std::process::id())
        );
    }

    #[test]
    fn a_task_s_own_failures_in_a_row_are_counted() {
        let of = |job: &str, pid, event| Attempt {
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
            of("17_4", 1, failed(75, 0)),
            // It got somewhere, and what follows is counted anew; a node that died says nothing.
            of("17_4 restart 1", 2, failed(75, 3)),
            of("17_4 restart 2", 3, Event::Begun),
            of("17_4 restart 3", 4, failed(75, 0)),
            // Another task, an earlier submission's, and another shard.
            of("17_40", 5, failed(75, 0)),
            of("9_4", 6, failed(75, 0)),
            Attempt { index: 5, ..of("17_4", 7, failed(75, 0)) },
            of("17_4 restart 4", 8, Event::Begun),
            of("17_4 restart 4", 8, failed(75, 0)),
        ];
        let count = |all: &[Attempt], pid| fruitless(all, 4, Some("17_4 restart 4"), "n1", pid);
        assert_eq!(count(&all, 8), Some(2));
        // The disk was full.
        assert_eq!(count(&all, 9), None);
        all.push(of("17_4 restart 4", 8, failed(75, 1)));
        assert_eq!(count(&all, 8), Some(0));
    }
}
