//! Hands a plan to Slurm, and asks it what became of it.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::{Duration, SystemTime};

use serde::{Deserialize, Serialize};

use super::ask::{Unanswered, ask};
use super::status::ranges;
use super::synced;
use crate::error::{Error, Result};
use crate::timing::machine;

const FILE: &str = "submitted.jsonl";
/// Jobs' names: all shards have one, all merges the other. What tells jobs apart is their comment.
pub const SHARDS: &str = "nimbus-farm";
pub const MERGE: &str = "nimbus-merge";

/// One submission. It is written down twice: before, so that whatever becomes of it is found in the
/// queue, and with Slurm's ids.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Submitted {
    /// UTC, ISO 8601.
    pub date: String,
    pub arrays: Vec<Array>,
    /// Slurm's id of the merge.
    pub merge: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Array {
    /// Its comment, which no other job has.
    pub mark: String,
    /// Slurm's id.
    pub job: Option<String>,
    /// Task i is shard `offset + i`.
    pub offset: usize,
    pub shards: String,
}

/// Slurm's own default, where it does not say.
const USUAL_ARRAY_SIZE: usize = 1001;
/// How long a question may take: Slurm's own patience with its controller (MessageTimeout) is as
/// long by default.
const ANSWER: Duration = Duration::from_secs(10);
/// How long a submission or a cancellation may: both try again themselves where the controller is
/// busy.
const DONE: Duration = Duration::from_secs(60);
/// A job that is queued although sbatch failed is looked for so often, with pauses.
const N_LOOKS: u32 = 3;
const PAUSE: Duration = Duration::from_secs(1);

/// Submits the tasks of `indices` with the scripts in `scripts`, and the merge that waits for all
/// of them; or nothing: what is queued already when something fails is cancelled.
pub fn submit(folder: &Path, scripts: &Path, indices: &[usize]) -> Result<Submitted> {
    let (mark, size) = (mark(), array_size());
    let mut submitted = Submitted { date: machine::utc_now(), arrays: Vec::new(), merge: None };
    let mut tasks = Vec::new();
    for (k, part) in indices.chunk_by(|a, b| a / size == b / size).enumerate() {
        let offset = part.first().map_or(0, |i| i / size * size);
        tasks.push(ranges(&part.iter().map(|i| i - offset).collect::<Vec<usize>>()));
        submitted.arrays.push(Array {
            mark: format!("{mark}-{k}"),
            job: None,
            offset,
            shards: ranges(part),
        });
    }
    write_down(folder, &submitted)?;
    let queued =
        queue(&mut submitted, scripts, &tasks, &mark).and_then(|()| write_down(folder, &submitted));
    match queued {
        Ok(()) => Ok(submitted),
        Err(error) => {
            let arrays = submitted.arrays.iter().filter_map(|array| array.job.as_deref());
            let jobs: Vec<&str> = arrays.chain(submitted.merge.as_deref()).collect();
            let cancelled =
                if jobs.is_empty() { Ok(String::new()) } else { ask("scancel", &jobs, DONE) };
            Err(match cancelled {
                Ok(_) => error,
                Err(cause) => left(&error, &jobs, &cause),
            })
        }
    }
}

fn queue(submitted: &mut Submitted, scripts: &Path, tasks: &[String], mark: &str) -> Result<()> {
    let [shard, merge] =
        ["shard.sh", "merge.sh"].map(|name| scripts.join(name).display().to_string());
    for (array, tasks) in submitted.arrays.iter_mut().zip(tasks) {
        let (indices, offset) = (format!("--array={tasks}"), array.offset.to_string());
        array.job = Some(sbatch(SHARDS, &array.mark, &[&indices, &shard, &offset])?);
    }
    let ids: Vec<&str> = submitted.arrays.iter().filter_map(|array| array.job.as_deref()).collect();
    // Not afterok: for that an array has failed whose task ran out of time, also where the task
    // went on and ended well. The merge itself looks whether all is there.
    let after = format!("--dependency=afterany:{}", ids.join(":"));
    let merge = sbatch(MERGE, &format!("{mark}-merge"), &[&after, &merge])?;
    submitted.merge = Some(merge);
    Ok(())
}

fn write_down(folder: &Path, submitted: &Submitted) -> Result<()> {
    let line = serde_json::to_string(submitted).map_err(|cause| Error::io(folder, cause))?;
    synced::append(&folder.join(FILE), &line)
}

/// What should be gone and is not.
fn left(error: &Error, jobs: &[&str], cause: &Unanswered) -> Error {
    Error::usage(format!(
        "{error}; and jobs that are queued already stay: scancel {} ({})",
        jobs.join(" "),
        cause.what
    ))
}

/// What no other submission has, on no machine that shares the queue: a millisecond and a process.
fn mark() -> String {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    format!("{SHARDS}-{}-{}", since.as_millis(), std::process::id())
}

/// The id of a new job. Where sbatch fails the job may be queued all the same, when only the answer
/// was lost: then it is that one.
fn sbatch(name: &str, mark: &str, arguments: &[&str]) -> Result<String> {
    let own = [format!("--job-name={name}"), format!("--comment={mark}")];
    let all = [&["--parsable", &own[0], &own[1]], arguments].concat();
    match ask("sbatch", &all, DONE) {
        // "ID" or "ID;CLUSTER".
        Ok(text) => Ok(text.split(';').next().unwrap_or_default().to_owned()),
        Err(Unanswered { is_missing: true, what }) => Err(Error::usage(format!(
            "{what}; expected Slurm on this machine (`nimbus farm emit slurm` writes the job \
             files alone)"
        ))),
        Err(Unanswered { what, .. }) => match found(name, mark) {
            Ok(Some(job)) => Ok(job),
            Ok(None) => Err(Error::usage(what)),
            Err(why) => Err(Error::usage(format!(
                "{what}; nobody knows whether it is queued ({}): look for a job with the \
                 comment {mark}",
                why.what
            ))),
        },
    }
}

/// The job of a name and a comment, also one that has ended.
fn found(name: &str, mark: &str) -> std::result::Result<Option<String>, Unanswered> {
    let mut found = Ok(None);
    for look in 0..N_LOOKS {
        if look > 0 {
            std::thread::sleep(PAUSE);
        }
        found = ask("squeue", &["-h", "--states=all", "-o", "%F|%k", "-n", name], ANSWER).map(
            |queue| {
                let job = queue
                    .lines()
                    .filter_map(|line| line.split_once('|'))
                    .find(|(_, comment)| *comment == mark);
                job.map(|(job, _)| job.to_owned())
            },
        );
        if let Ok(Some(_)) = found {
            break;
        }
    }
    found
}

fn array_size() -> usize {
    let text = ask("scontrol", &["show", "config"], ANSWER).unwrap_or_default();
    array_size_in(&text).unwrap_or(USUAL_ARRAY_SIZE)
}

/// The greatest index is one less.
fn array_size_in(config: &str) -> Option<usize> {
    let line = config.lines().find(|line| line.starts_with("MaxArraySize"))?;
    line.split_once('=')?.1.trim().parse().ok().filter(|size| *size > 0)
}

/// All submissions of a plan, also those that failed.
pub fn submitted(folder: &Path) -> Vec<Submitted> {
    let text = fs::read_to_string(folder.join(FILE)).unwrap_or_default();
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

/// What Slurm does with shards now, such as "RUNNING on n2 (17_3)"; nothing of those it does not
/// know any more.
pub fn states(submitted: &[Submitted]) -> std::result::Result<BTreeMap<usize, String>, Unanswered> {
    let offsets: BTreeMap<&str, usize> = submitted
        .iter()
        .flat_map(|s| &s.arrays)
        .map(|array| (array.mark.as_str(), array.offset))
        .collect();
    if offsets.is_empty() {
        return Ok(BTreeMap::new());
    }
    // %F array's id, %K task, %T state, %N node, %k comment.
    // All of them: of an id that Slurm has forgotten it says an error.
    let queue = ask("squeue", &["-h", "-r", "-o", "%F|%K|%T|%N|%k", "-n", SHARDS], ANSWER)?;
    Ok(states_in(&offsets, &queue))
}

fn states_in(offsets: &BTreeMap<&str, usize>, queue: &str) -> BTreeMap<usize, String> {
    let state = |line: &str| {
        // What others say of their jobs may be anything.
        let mut words = line.splitn(5, '|');
        let (job, task, state) =
            (words.next()?, words.next()?.parse::<usize>().ok()?, words.next()?);
        let place = words
            .next()
            .filter(|node| !node.is_empty())
            .map_or(String::new(), |node| format!(" on {node}"));
        let offset = offsets.get(words.next()?)?;
        Some((offset + task, format!("{state}{place} ({job}_{task})")))
    };
    queue.lines().filter_map(state).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_slurm_says_is_read() {
        assert_eq!(array_size_in("A = 3\nMaxArraySize            = 1001\nB = 2"), Some(1001));
        assert_eq!((array_size_in(""), array_size_in("MaxArraySize = n/a")), (None, None));
        let offsets = [("m-0", 0), ("m-1", 1001)].into();
        let queue = "17|3|RUNNING|n2|m-0\n18|4|PENDING||m-1\n19|1|RUNNING|n1|m-10\n20|N/A|RUNNING|n1|m-0\n\
            21|2|RUNNING|n1|what | is\n22|2|RUNNING|n1|(null)\nnonsense\n";
        let expected = [(3, "RUNNING on n2 (17_3)"), (1005, "PENDING (18_4)")];
        assert_eq!(states_in(&offsets, queue), expected.map(|(i, s)| (i, s.to_owned())).into());
    }
}
