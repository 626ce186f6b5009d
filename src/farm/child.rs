//! Shards that are measured: a command of nimbus with `--part`, in a process of its own, and who
//! may put such parts together.

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::plan::{Plan, Shard};
use super::pool::ask_to_end;
use super::store::Manifest;
use crate::error::{Error, Result};
use crate::frame::DeviceChoice;

/// Said by job scripts of whole nodes, and by a pool of one process: nobody else's work is in the
/// times.
pub const EXCLUSIVE: &str = "NIMBUS_EXCLUSIVE";

/// How often a child is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// Runs `nimbus NAME` with `arguments` for the part of `shard`, results in the folder `out`. On
/// `stop` it is asked to end.
pub fn run(
    name: &str,
    (plan, shard, arguments): (&Plan, &Shard, &[String]),
    choice: &DeviceChoice,
    out: &Path,
    stop: &AtomicBool,
) -> Result<()> {
    let mut command = Command::new(program()?);
    command.arg(name).arg(&plan.scene.file).args(arguments);
    command
        .arg(format!("--part={}..{}", shard.first, shard.first + shard.n))
        .arg("--out")
        .arg(out)
        .arg("--quiet");
    command.args(plan.scene.set.iter().flat_map(|set| ["--set", set]));
    command.args(plan.scene.seed.iter().map(|seed| format!("--seed={seed}")));
    command.args(choice.shaders.iter().map(|shaders| format!("--shaders={}", shaders.display())));
    command.args(choice.device.iter().map(|device| format!("--device={device}")));
    command.args(choice.validation.then_some("--validation"));
    // A terminal's Ctrl-C would reach it twice, and twice means at once.
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).process_group(0);
    let child = command.spawn().map_err(|cause| Error::io(Path::new("nimbus"), cause))?;
    ended(&format!("nimbus {name}"), child, stop)
}

fn program() -> Result<PathBuf> {
    std::env::current_exe().map_err(|cause| Error::io(Path::new("nimbus"), cause))
}

/// Waits for it; its error as one of ours.
fn ended(name: &str, mut child: Child, stop: &AtomicBool) -> Result<()> {
    let failed = |cause| Error::io(Path::new(name), cause);
    let mut is_asked = false;
    while child.try_wait().map_err(failed)?.is_none() {
        if stop.load(Ordering::Relaxed) && !is_asked {
            is_asked = true;
            ask_to_end(&child);
        }
        std::thread::sleep(LOOK);
    }
    let output = child.wait_with_output().map_err(failed)?;
    let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    match output.status.code() {
        Some(0) => Ok(()),
        _ if is_asked => Err(Error::Interrupted),
        // A device, a signal.
        Some(3 | 130) | None => Err(Error::Transient { what: said }),
        Some(_) if said.contains("No space left") => Err(Error::Transient { what: said }),
        Some(code) => Err(Error::usage(format!("{name} ended with exit code {code}: {said}"))),
    }
}

/// Refuses parts whose times cannot be compared, with a list: they `differ`, or had no node for
/// themselves.
pub fn check_comparable(mut differ: Vec<String>, parts: &[(PathBuf, Manifest)]) -> Result<()> {
    let shared =
        parts.iter().filter(|(_, manifest)| !manifest.exclusive).map(|(_, m)| m.index.to_string());
    let shared: Vec<String> = shared.collect();
    if !shared.is_empty() {
        let what = "not known to have had a node for themselves";
        differ.push(format!("{what} ({EXCLUSIVE}=1 says so): shards {}", shared.join(", ")));
    }
    if differ.is_empty() {
        return Ok(());
    }
    let list = differ.iter().map(|what| format!("\n  {what}")).collect::<String>();
    Err(Error::Check { what: format!("times that cannot be compared are not merged:{list}") })
}
