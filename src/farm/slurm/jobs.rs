//! Submission of a plan's shards, and the state of their tasks.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, SystemTime};

use serde::{Deserialize, Serialize};

use super::command::{CommandFailure, output_of};
use crate::error::{Error, Result};
use crate::farm::journal;
use crate::farm::ranges::ranges;
use crate::timing::machine;

const FILE: &str = "submitted.jsonl";
/// The name of all arrays. Their comments tell them apart.
const ARRAY_NAME: &str = "nimbus-farm";
/// The name of all merges.
const MERGE_NAME: &str = "nimbus-merge";

/// MaxArraySize where Slurm does not tell it: its default.
const USUAL_ARRAY_SIZE: usize = 1001;
/// The time limit of questions. Slurm's own programs wait as long for the controller
/// (MessageTimeout) by default.
const QUESTION_LIMIT: Duration = Duration::from_secs(10);
/// The time limit of submissions and cancellations, which try again while the controller is busy.
const ACTION_LIMIT: Duration = Duration::from_secs(60);
/// How often, and at what interval, a job is looked for after its submission has failed.
const N_LOOKS: u32 = 3;
const LOOK_INTERVAL: Duration = Duration::from_secs(1);

/// A submission. It is recorded twice: before anything is queued, and with Slurm's ids.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Submission {
    /// UTC, ISO 8601.
    pub date: String,
    /// The arrays of shards.
    pub arrays: Vec<Array>,
    /// Slurm's id of the merge.
    pub merge: Option<String>,
}

/// An array of tasks, each a shard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Array {
    /// The job's comment, which no other job has.
    pub mark: String,
    /// Slurm's id.
    pub job: Option<String>,
    /// Task i is shard `offset` + i.
    pub offset: usize,
    /// The shards, as ranges.
    pub shards: String,
}

/// Submits the shards `indices` of the plan in `folder` with the job scripts in `scripts`, and the
/// merge, which waits for them.
///
/// # Errors
/// When Slurm refuses a job or does not answer. Jobs that are queued already are cancelled then.
pub fn submit(folder: &Path, scripts: &Path, indices: &[usize]) -> Result<Submission> {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    // No other submission has the same mark: a millisecond and a process.
    let mark = format!("{ARRAY_NAME}-{}-{}", since.as_millis(), std::process::id());
    let size = array_size();
    let (mut arrays, mut tasks) = (Vec::new(), Vec::new());
    for (k, part) in indices.chunk_by(|a, b| a / size == b / size).enumerate() {
        let offset = part.first().map_or(0, |i| i / size * size);
        tasks.push(ranges(&part.iter().map(|i| i - offset).collect::<Vec<usize>>()));
        arrays.push(Array { mark: format!("{mark}-{k}"), job: None, offset, shards: ranges(part) });
    }
    let mut submission = Submission { date: machine::utc_now(), arrays, merge: None };
    let file = folder.join(FILE);
    journal::append(&file, &submission)?;
    let queued = queue(&mut submission, scripts, &tasks, &mark)
        .and_then(|()| journal::append(&file, &submission));
    match queued {
        Ok(()) => Ok(submission),
        Err(error) => Err(cancelled(&submission, error)),
    }
}

fn queue(submission: &mut Submission, scripts: &Path, tasks: &[String], mark: &str) -> Result<()> {
    let [shard, merge] =
        ["shard.sh", "merge.sh"].map(|name| scripts.join(name).display().to_string());
    let mut ids = Vec::new();
    for (array, tasks) in submission.arrays.iter_mut().zip(tasks) {
        let (tasks, offset) = (format!("--array={tasks}"), array.offset.to_string());
        let id = sbatch(ARRAY_NAME, &array.mark, &[&tasks, &shard, &offset])?;
        ids.push(id.clone());
        array.job = Some(id);
    }
    // With afterok an array would have failed as soon as the time of a task is up, even if the task
    // is queued again and succeeds. The merge itself checks that all results are there.
    let after = format!("--dependency=afterany:{}", ids.join(":"));
    submission.merge = Some(sbatch(MERGE_NAME, &format!("{mark}-merge"), &[&after, &merge])?);
    Ok(())
}

/// Cancels what is queued of a submission that failed. Returns its error, and tells what stays.
fn cancelled(submission: &Submission, error: Error) -> Error {
    let arrays = submission.arrays.iter().filter_map(|array| array.job.as_deref());
    let jobs: Vec<&str> = arrays.chain(submission.merge.as_deref()).collect();
    if jobs.is_empty() {
        return error;
    }
    match output_of("scancel", &jobs, ACTION_LIMIT) {
        Ok(_) => error,
        Err(CommandFailure { what, .. }) => Error::usage(format!(
            "{error}; and jobs that are queued already stay: scancel {} ({what})",
            jobs.join(" ")
        )),
    }
}

/// Submits a job and returns its id. A job that is queued although sbatch failed, because only the
/// answer was lost, is found by its mark.
fn sbatch(name: &str, mark: &str, arguments: &[&str]) -> Result<String> {
    let own = [format!("--job-name={name}"), format!("--comment={mark}")];
    let all = [&["--parsable", &own[0], &own[1]], arguments].concat();
    match output_of("sbatch", &all, ACTION_LIMIT) {
        // "ID" or "ID;CLUSTER".
        Ok(text) => Ok(text.split(';').next().unwrap_or_default().to_owned()),
        Err(CommandFailure { is_missing: true, what }) => Err(Error::usage(format!(
            "{what}; expected Slurm on this machine (`nimbus farm emit slurm` writes the job \
             scripts alone)"
        ))),
        Err(CommandFailure { what, .. }) => match found(name, mark) {
            Ok(Some(job)) => Ok(job),
            Ok(None) => Err(Error::usage(what)),
            Err(failure) => Err(Error::usage(format!(
                "{what}; it is unknown whether it is queued ({}): look for a job with the \
                 comment {mark}",
                failure.what
            ))),
        },
    }
}

/// Returns the id of the job with a mark, even if it has ended.
fn found(name: &str, mark: &str) -> std::result::Result<Option<String>, CommandFailure> {
    let mut found = Ok(None);
    for look in 0..N_LOOKS {
        if look > 0 {
            std::thread::sleep(LOOK_INTERVAL);
        }
        let arguments = ["-h", "--states=all", "-o", "%F|%k", "-n", name];
        found = output_of("squeue", &arguments, QUESTION_LIMIT).map(|queue| {
            let mut jobs = queue.lines().filter_map(|line| line.split_once('|'));
            jobs.find(|(_, comment)| *comment == mark).map(|(job, _)| job.to_owned())
        });
        if let Ok(Some(_)) = found {
            break;
        }
    }
    found
}

fn array_size() -> usize {
    let text = output_of("scontrol", &["show", "config"], QUESTION_LIMIT).unwrap_or_default();
    array_size_in(&text).unwrap_or(USUAL_ARRAY_SIZE)
}

/// Reads MaxArraySize. The greatest index is less by one.
fn array_size_in(config: &str) -> Option<usize> {
    let line = config.lines().find(|line| line.starts_with("MaxArraySize"))?;
    line.split_once('=')?.1.trim().parse().ok().filter(|size| *size > 0)
}

/// Asks Slurm for the tasks of the plan in `folder`. Returns a state such as "RUNNING on n2 (17_3)"
/// for each shard that is queued.
///
/// # Errors
/// When Slurm does not answer.
pub fn states(folder: &Path) -> std::result::Result<BTreeMap<usize, String>, CommandFailure> {
    // A plan that was never submitted has no file.
    let submissions = journal::read::<Submission>(&folder.join(FILE)).unwrap_or_default();
    let arrays = submissions.iter().flat_map(|submission| &submission.arrays);
    let offsets: BTreeMap<&str, usize> =
        arrays.map(|array| (array.mark.as_str(), array.offset)).collect();
    if offsets.is_empty() {
        return Ok(BTreeMap::new());
    }
    // %F id of the array, %K task, %T state, %N node, %k comment. All arrays are asked for: Slurm
    // answers with an error to an id that it has forgotten.
    let arguments = ["-h", "-r", "-o", "%F|%K|%T|%N|%k", "-n", ARRAY_NAME];
    let queue = output_of("squeue", &arguments, QUESTION_LIMIT)?;
    Ok(states_in(&offsets, &queue))
}

fn states_in(offsets: &BTreeMap<&str, usize>, queue: &str) -> BTreeMap<usize, String> {
    let state = |line: &str| {
        // The comment comes last, since those of other jobs may contain anything.
        let mut words = line.splitn(5, '|');
        let (job, task, state) =
            (words.next()?, words.next()?.parse::<usize>().ok()?, words.next()?);
        let node = words.next().filter(|node| !node.is_empty());
        let place = node.map_or(String::new(), |node| format!(" on {node}"));
        let offset = offsets.get(words.next()?)?;
        Some((offset + task, format!("{state}{place} ({job}_{task})")))
    };
    queue.lines().filter_map(state).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_of_slurm_are_read() {
        assert_eq!(array_size_in("A = 3\nMaxArraySize            = 1001\nB = 2"), Some(1001));
        assert_eq!((array_size_in(""), array_size_in("MaxArraySize = n/a")), (None, None));
        let offsets = [("m-0", 0), ("m-1", 1001)].into();
        let queue = "17|3|RUNNING|n2|m-0\n18|4|PENDING||m-1\n19|1|RUNNING|n1|m-10\n\
            20|N/A|RUNNING|n1|m-0\n21|2|RUNNING|n1|what | is\n22|2|RUNNING|n1|(null)\nnonsense\n";
        let expected = [(3, "RUNNING on n2 (17_3)"), (1005, "PENDING (18_4)")];
        assert_eq!(states_in(&offsets, queue), expected.map(|(i, s)| (i, s.to_owned())).into());
    }
}
