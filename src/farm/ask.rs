//! Programs that may not answer: an engine's, whose controller is away or busy.

use std::io::Read;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unanswered {
    /// There is no such program here.
    pub is_missing: bool,
    pub what: String,
}

/// How often a program is looked at that has said everything and not ended.
const LOOK: Duration = Duration::from_millis(5);

/// What a program says, without the white space around it. One that fails or takes longer than
/// `limit` says nothing: it is killed then, and what it was asked to do may have been done.
pub fn ask(program: &str, arguments: &[&str], limit: Duration) -> Result<String, Unanswered> {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let begin = Instant::now();
    let mut child = command.spawn().map_err(|cause| Unanswered {
        is_missing: true,
        what: format!("{program} cannot be run: {cause}"),
    })?;
    let said = [read(child.stdout.take()), read(child.stderr.take())];
    let left = || limit.saturating_sub(begin.elapsed());
    // Its own children may hold the pipes: nobody waits for their ends.
    let [out, errors] = said.map(|from| from.recv_timeout(left()).ok());
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) if out.is_some() => break Some(status),
            _ if left().is_zero() => break None,
            _ => std::thread::sleep(LOOK),
        }
    };
    let failed = |what: String| Err(Unanswered { is_missing: false, what });
    match (status, out) {
        (Some(status), Some(out)) if status.success() => Ok(out),
        (Some(_), _) => {
            failed(format!("{program} {}: {}", arguments.join(" "), errors.unwrap_or_default()))
        }
        (None, _) => {
            // It may have ended this moment.
            let _ = child.kill();
            let _ = child.wait();
            failed(format!("{program} does not answer within {} s", limit.as_secs_f64()))
        }
    }
}

/// All that comes, at its end.
fn read(from: Option<impl Read + Send + 'static>) -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut from) = from {
            // What came before an error is as good as nothing: the program's status tells.
            let _ = from.read_to_end(&mut bytes);
        }
        // Whoever asked may have given up.
        let _ = sender.send(String::from_utf8_lossy(&bytes).trim().to_owned());
    });
    receiver
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_failures_and_silence_are_told_apart() {
        let sh = |script: &str, limit_ms: u64| {
            ask("sh", &["-c", script], Duration::from_millis(limit_ms))
        };
        // More than a pipe holds.
        let long = sh("head -c 300000 /dev/zero | tr '\\0' x; echo no >&2", 60_000).unwrap();
        assert_eq!(long.len(), 300_000);
        let failed = sh("echo yes; echo 'not so' >&2; exit 3", 60_000).unwrap_err();
        assert!(!failed.is_missing && failed.what.ends_with(": not so"), "{failed:?}");
        let begin = Instant::now();
        // The shell's child has its pipes, and goes on.
        for script in ["sleep 20", "sleep 20 & wait", "exec >&- 2>&-; sleep 20"] {
            let silent = sh(script, 100).unwrap_err();
            assert!(
                !silent.is_missing && silent.what == "sh does not answer within 0.1 s",
                "{silent:?}"
            );
        }
        assert!(begin.elapsed() < Duration::from_secs(10), "{:?}", begin.elapsed());
        assert!(ask("/nowhere/squeue", &[], Duration::from_secs(1)).unwrap_err().is_missing);
    }
}
