//! Commands of Slurm, which may not answer while its controller is away or busy.

use std::io::Read;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use crate::farm::process::POLL;

/// The failure of a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandFailure {
    /// Whether this machine has no such program.
    pub is_missing: bool,
    /// A description for the user.
    pub what: String,
}

/// Runs a program and returns its output without the white space around it. A program that takes
/// longer than `limit` is killed.
///
/// # Errors
/// When the program is missing, fails or is killed; it may have done its work all the same.
pub fn output_of(
    program: &str,
    arguments: &[&str],
    limit: Duration,
) -> Result<String, CommandFailure> {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let begin = Instant::now();
    let mut child = command.spawn().map_err(|cause| CommandFailure {
        is_missing: true,
        what: format!("{program} cannot be run: {cause}"),
    })?;
    let pipes = [read(child.stdout.take()), read(child.stderr.take())];
    let left = || limit.saturating_sub(begin.elapsed());
    // The program's own children may hold the pipes open: their ends are not waited for.
    let [out, errors] = pipes.map(|pipe| pipe.recv_timeout(left()).ok());
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) if out.is_some() => break Some(status),
            _ if left().is_zero() => break None,
            _ => std::thread::sleep(POLL),
        }
    };
    let what = match (status, out) {
        (Some(status), Some(out)) if status.success() => return Ok(out),
        (Some(_), _) => {
            format!("{program} {}: {}", arguments.join(" "), errors.unwrap_or_default())
        }
        (None, _) => {
            // The program may have ended just now.
            let _ = child.kill();
            let _ = child.wait();
            format!("{program} does not answer within {} s", limit.as_secs_f64())
        }
    };
    Err(CommandFailure { is_missing: false, what })
}

/// Reads a pipe to its end on a thread.
fn read(pipe: Option<impl Read + Send + 'static>) -> Receiver<String> {
    let (sender, receiver) = channel();
    let drain = move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            // The program's exit status tells of failures.
            let _ = pipe.read_to_end(&mut bytes);
        }
        // Sending fails only after the caller has given up.
        let _ = sender.send(String::from_utf8_lossy(&bytes).trim().to_owned());
    };
    // Without a thread the sender is dropped, so that the program counts as one that does not
    // answer.
    let _ = std::thread::Builder::new().name("pipe".into()).spawn(drain);
    receiver
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLENTY: Duration = Duration::from_secs(600);

    fn shell(script: &str, limit: Duration) -> Result<String, CommandFailure> {
        output_of("sh", &["-c", script], limit)
    }

    #[test]
    fn output_and_failures_are_returned() {
        // More than a pipe holds.
        let long = shell("head -c 300000 /dev/zero | tr '\\0' x; echo no >&2", PLENTY).unwrap();
        assert_eq!(long.len(), 300_000);
        let failure = shell("echo yes; echo 'not so' >&2; exit 3", PLENTY).unwrap_err();
        assert!(!failure.is_missing && failure.what.ends_with(": not so"), "{failure:?}");
        assert!(output_of("/nowhere/squeue", &[], PLENTY).unwrap_err().is_missing);
    }

    #[test]
    fn a_command_that_does_not_answer_is_given_up() {
        // The shell's child keeps the pipes open after the shell is killed.
        for script in ["sleep 30", "sleep 30 & wait", "exec >&- 2>&-; sleep 30"] {
            let failure = shell(script, Duration::from_millis(100)).unwrap_err();
            let expected = "sh does not answer within 0.1 s";
            assert!(!failure.is_missing && failure.what == expected, "{failure:?}");
        }
    }
}
