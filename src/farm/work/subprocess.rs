//! Shards that are measured by `nimbus error` or `nimbus bench` in a process of its own.

use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};

use super::task::{ShardResult, Task};
use crate::error::{Error, Result};
use crate::farm::process::{self, EXCLUSIVE, IDLE_LIMIT};

/// Runs `nimbus NAME SCENE ARGUMENTS` for the items of a shard, and returns what `read` finds in
/// the folder of its results. The shard's files are then taken over from there.
///
/// # Errors
/// Fails if the process cannot be started or fails, or its results cannot be read.
pub fn run<T>(
    name: &str,
    arguments: &[String],
    task: &mut Task<'_>,
    read: impl FnOnce(&Path) -> Result<T>,
) -> Result<T> {
    let out = task.workplace.path().join("part");
    let Task { scene, choice, items, .. } = task;
    let mut command = process::quiet(&process::program()?);
    command.arg(name).arg(&scene.file).args(arguments);
    command.arg(format!("--part={}..{}", items.start, items.end));
    command.arg("--out").arg(&out).arg("--quiet");
    command.args(scene.set.iter().flat_map(|set| ["--set", set]));
    command.args(scene.seed.iter().map(|seed| format!("--seed={seed}")));
    command.args(choice.shaders.iter().map(|shaders| format!("--shaders={}", shaders.display())));
    command.args(choice.device.iter().map(|device| format!("--device={device}")));
    command.args(choice.validation.then_some("--validation"));
    let child = command.stderr(Stdio::piped()).spawn();
    let child = child.map_err(|cause| Error::of_io(Path::new("nimbus"), &cause))?;
    ended(&format!("nimbus {name}"), child, task.stop)?;
    let found = read(&out)?;
    task.workplace.take(&out)?;
    Ok(found)
}

/// Waits until a child ends and returns its failure as an error of this process.
fn ended(name: &str, mut child: Child, stop: &AtomicBool) -> Result<()> {
    let failed = |cause| Error::io(Path::new(name), cause);
    process::wait(&mut child, stop, IDLE_LIMIT).map_err(failed)?;
    let output = child.wait_with_output().map_err(failed)?;
    let what = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    match output.status.code() {
        Some(0) => Ok(()),
        _ if stop.load(Ordering::Relaxed) => Err(Error::Interrupted),
        // A failure of the device, one that may pass, or a signal.
        Some(3 | 75 | 130) | None => Err(Error::Transient { what }),
        Some(_) if what.to_lowercase().contains("no space left") => Err(Error::Transient { what }),
        Some(code) => Err(Error::usage(format!("{name} ended with exit code {code}: {what}"))),
    }
}

/// Refuses results whose times cannot be compared: those with `differences`, and those of runs that
/// shared their node.
///
/// # Errors
/// Fails if there is such a difference or such a run; the error lists them.
pub fn check_comparable(mut differences: Vec<String>, results: &[ShardResult]) -> Result<()> {
    let manifests = results.iter().map(|result| &result.manifest);
    let shared = manifests.filter(|manifest| !manifest.exclusive).map(|m| m.index.to_string());
    let shared: Vec<String> = shared.collect();
    if !shared.is_empty() {
        let what = "not known to have had a node to themselves";
        differences.push(format!("{what} ({EXCLUSIVE}=1 says so): shards {}", shared.join(", ")));
    }
    if differences.is_empty() {
        return Ok(());
    }
    let list = differences.iter().map(|what| format!("\n  {what}")).collect::<String>();
    Err(Error::Check { what: format!("times that cannot be compared are not merged:{list}") })
}
