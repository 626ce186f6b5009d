//! Processes of nimbus that a farm starts.

mod system;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::error::{Error, Result};

/// The environment variable by which job scripts of whole nodes, and pools of one process, say that
/// no other work disturbs a run's times.
pub const EXCLUSIVE: &str = "NIMBUS_EXCLUSIVE";

/// The interval at which processes are polled: short beside a shard, which takes a second at least.
pub const POLL: Duration = Duration::from_millis(5);

/// Returns the path of the running program.
///
/// # Errors
/// When the operating system does not tell it.
pub fn program() -> Result<PathBuf> {
    std::env::current_exe().map_err(|cause| Error::io(Path::new("nimbus"), cause))
}

/// Returns a command without input and output. It gets a process group of its own: a terminal's
/// Ctrl-C would otherwise reach the process besides the request of [`wait`], and two end it at
/// once.
pub fn quiet(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.stdin(Stdio::null()).stdout(Stdio::null());
    system::become_own_group(&mut command);
    command
}

/// A process that uses no processor time for this long hangs, as a driver does that waits for a
/// thread which the system refused to start. No submission to a device takes as long.
pub const IDLE_LIMIT: Duration = Duration::from_secs(600);

/// Waits until a process ends. On `stop` it is asked to keep what it has and to end. A process that
/// uses no processor time during `idle_limit` is killed.
///
/// # Errors
/// When the operating system refuses to tell its state.
pub fn wait(
    child: &mut Child,
    stop: &AtomicBool,
    idle_limit: Duration,
) -> std::io::Result<ExitStatus> {
    let mut is_asked = false;
    let (mut used, mut active) = (None, Instant::now());
    let (mut looked, between) = (Instant::now(), idle_limit / 8);
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if !is_asked && stop.load(Ordering::Relaxed) {
            is_asked = true;
            system::interrupt(child);
        }
        if looked.elapsed() >= between {
            looked = Instant::now();
            let now = system::processor_ticks(child);
            // A system that does not tell the time has no limit.
            if now.is_none() || now != used {
                (used, active) = (now, looked);
            } else if active.elapsed() >= idle_limit {
                child.kill()?;
            }
        }
        std::thread::sleep(POLL);
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::process::ExitStatusExt;

    use super::*;

    #[test]
    fn a_process_that_does_nothing_is_killed_and_one_that_works_is_not() {
        let never = AtomicBool::new(false);
        let run = |script: &str, limit: Duration| {
            let mut command = quiet(Path::new("sh"));
            let mut child = command.args(["-c", script]).spawn().expect("a shell");
            wait(&mut child, &never, limit).expect("an end")
        };
        let idle = run("exec sleep 1000", Duration::from_millis(200));
        assert_eq!(idle.signal(), Some(9));
        // The loop uses processor time until it has counted, on a busy machine as well.
        let count = "i=0; while [ $i -lt 300000 ]; do i=$((i+1)); done; exit 7";
        assert_eq!(run(count, Duration::from_secs(30)).code(), Some(7));
        let mut child = quiet(Path::new("sh")).args(["-c", "read line"]).spawn().expect("a shell");
        assert!(system::processor_ticks(&child).is_some());
        child.wait().expect("an end");
    }
}
