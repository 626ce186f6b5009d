//! Processes of nimbus that a farm starts.

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

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
    command.stdin(Stdio::null()).stdout(Stdio::null()).process_group(0);
    command
}

/// Waits until a process ends. On `stop` it is asked to keep what it has and to end.
///
/// # Errors
/// When the operating system refuses to tell its state.
pub fn wait(child: &mut Child, stop: &AtomicBool) -> std::io::Result<ExitStatus> {
    let mut is_asked = false;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if !is_asked && stop.load(Ordering::Relaxed) {
            is_asked = true;
            interrupt(child);
        }
        std::thread::sleep(POLL);
    }
}

/// Asks a process to end, as Ctrl-C does.
fn interrupt(child: &Child) {
    let mut kill = Command::new("kill");
    // A failure means that the process has ended; the caller waits for it in any case.
    let _ = kill.args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status();
}
