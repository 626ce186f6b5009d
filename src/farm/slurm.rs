//! Hands a plan to Slurm, and asks it what became of it.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde::{Deserialize, Serialize};

use super::status::ranges;
use super::synced;
use crate::error::{Error, Result};
use crate::study::machine;

const FILE: &str = "submitted.jsonl";

/// One submission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Submitted {
    /// UTC, ISO 8601.
    pub date: String,
    pub arrays: Vec<Array>,
    pub merge: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Array {
    /// Slurm's id.
    pub job: String,
    /// Task i is shard `offset + i`.
    pub offset: usize,
    pub shards: String,
}

/// Slurm's own default, where it does not say.
const USUAL_ARRAY_SIZE: usize = 1001;

/// Submits the tasks of `indices` with the scripts in `scripts`, and the merge that waits for all of them.
pub fn submit(folder: &Path, scripts: &Path, indices: &[usize]) -> Result<Submitted> {
    let [shard, merge] = ["shard.sh", "merge.sh"].map(|name| scripts.join(name).display().to_string());
    let size = array_size();
    let mut arrays: Vec<Array> = Vec::new();
    for part in indices.chunk_by(|a, b| a / size == b / size) {
        let offset = part.first().map_or(0, |i| i / size * size);
        let tasks: Vec<usize> = part.iter().map(|i| i - offset).collect();
        let array = format!("--array={}", ranges(&tasks));
        let job = sbatch(&[&array, &shard, &offset.to_string()]);
        match job {
            Ok(job) => arrays.push(Array { job, offset, shards: ranges(part) }),
            Err(error) => return Err(cancelled(&arrays, error)),
        }
    }
    let ids: Vec<&str> = arrays.iter().map(|array| array.job.as_str()).collect();
    let after = format!("--dependency=afterok:{}", ids.join(":"));
    let merge = sbatch(&[&after, "--kill-on-invalid-dep=yes", &merge]).map_err(|error| cancelled(&arrays, error))?;
    let submitted = Submitted { date: machine::utc_now(), arrays, merge };
    let line = serde_json::to_string(&submitted).map_err(|cause| Error::io(folder, cause))?;
    if let Err(error) = synced::append(&folder.join(FILE), &line) {
        // Jobs that nobody knows of would run all the same.
        let _ = Command::new("scancel").arg(&submitted.merge).status();
        return Err(cancelled(&submitted.arrays, error));
    }
    Ok(submitted)
}

/// What was submitted goes with what could not be.
fn cancelled(arrays: &[Array], error: Error) -> Error {
    for array in arrays {
        let _ = Command::new("scancel").arg(&array.job).status();
    }
    error
}

fn sbatch(arguments: &[&str]) -> Result<String> {
    let output = Command::new("sbatch").arg("--parsable").args(arguments).output().map_err(|cause| {
        Error::usage(format!(
            "sbatch: {cause}; expected Slurm on this machine (`nimbus farm emit slurm` writes the job files alone)"
        ))
    })?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    if !output.status.success() {
        return Err(Error::usage(format!("sbatch {}: {}", arguments.join(" "), text(&output.stderr))));
    }
    // "ID" or "ID;CLUSTER".
    Ok(text(&output.stdout).split(';').next().unwrap_or_default().to_owned())
}

fn array_size() -> usize {
    let output = Command::new("scontrol").args(["show", "config"]).output();
    let text = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
    array_size_in(&text).unwrap_or(USUAL_ARRAY_SIZE)
}

/// The greatest index is one less.
fn array_size_in(config: &str) -> Option<usize> {
    let line = config.lines().find(|line| line.starts_with("MaxArraySize"))?;
    line.split_once('=')?.1.trim().parse().ok().filter(|size| *size > 0)
}

/// All submissions of a plan.
pub fn submitted(folder: &Path) -> Vec<Submitted> {
    let text = fs::read_to_string(folder.join(FILE)).unwrap_or_default();
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

/// What Slurm does with shards now, such as "RUNNING on n2 (17_3)"; nothing of those it does not know any more. None where it does not
/// answer.
pub fn states(submitted: &[Submitted]) -> Option<BTreeMap<usize, String>> {
    let arrays: Vec<&Array> = submitted.iter().flat_map(|s| &s.arrays).collect();
    if arrays.is_empty() {
        return Some(BTreeMap::new());
    }
    // %F array's id, %K task, %T state, %N node.
    // All of them: of an id that Slurm has forgotten it says an error.
    let output = Command::new("squeue").args(["-h", "-r", "-o", "%F %K %T %N", "-n", "nimbus-farm"]).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    output.status.success().then(|| states_in(&arrays, &text))
}

fn states_in(arrays: &[&Array], queue: &str) -> BTreeMap<usize, String> {
    let state = |line: &str| {
        let mut words = line.split_whitespace();
        let (job, task, state) = (words.next()?, words.next()?.parse::<usize>().ok()?, words.next()?);
        let array = arrays.iter().find(|array| array.job == job)?;
        let place = words.next().map_or(String::new(), |node| format!(" on {node}"));
        Some((array.offset + task, format!("{state}{place} ({job}_{task})")))
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
        let array = |job: &str, offset| Array { job: job.into(), offset, shards: String::new() };
        let (a, b) = (array("17", 0), array("18", 1001));
        let states = states_in(&[&a, &b], "17 3 RUNNING n2\n18 4 PENDING \n19 1 RUNNING n1\nnonsense\n");
        let expected = [(3, "RUNNING on n2 (17_3)"), (1005, "PENDING (18_4)")];
        assert_eq!(states, expected.map(|(i, s)| (i, s.to_owned())).into());
    }
}
