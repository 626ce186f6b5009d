//! The engine of one machine: every shard in a process of its own, some at a time, tried again where it may go well.

use std::collections::VecDeque;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::error::{Error, Result};

/// What there is to run.
#[derive(Debug, Clone)]
pub struct Pool<'a> {
    /// The program; without arguments.
    pub program: &'a Path,
    /// All but the shard's index, which comes last.
    pub arguments: Vec<String>,
    pub n_processes: usize,
    /// A shard that fails in a way that may pass is tried so often.
    pub n_tries: usize,
}

/// How a shard's last try ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ended {
    pub index: usize,
    /// None where a signal ended it.
    pub exit_code: Option<i32>,
    pub n_tries: usize,
}

/// How often children are looked at: short beside a shard, which takes a second at least.
const LOOK: Duration = Duration::from_millis(5);

impl Pool<'_> {
    /// Runs `indices`; `on_end` is told of each. On `stop` no more begin, and those that run are asked to end: they keep
    /// what they have.
    pub fn run(&self, indices: &[usize], stop: &AtomicBool, on_end: &mut dyn FnMut(&Ended)) -> Result<Vec<Ended>> {
        let mut waiting: VecDeque<(usize, usize)> = indices.iter().map(|i| (*i, 0)).collect();
        let mut running: Vec<(usize, usize, Child)> = Vec::new();
        let mut all = Vec::new();
        let mut is_stopped = false;
        while !waiting.is_empty() || !running.is_empty() {
            if stop.load(Ordering::Relaxed) && !is_stopped {
                is_stopped = true;
                waiting.clear();
                running.iter().for_each(|(.., child)| ask_to_end(child));
            }
            while running.len() < self.n_processes
                && let Some((index, n_tries)) = waiting.pop_front()
            {
                running.push((index, n_tries + 1, self.start(index)?));
            }
            let mut still = Vec::new();
            for (index, n_tries, mut child) in running {
                let failed = |cause| Error::io(self.program, cause);
                let Some(status) = child.try_wait().map_err(failed)? else {
                    still.push((index, n_tries, child));
                    continue;
                };
                // One that was killed is worth another try as well.
                let may_pass = matches!(status.code(), None | Some(75));
                if may_pass && n_tries < self.n_tries && !is_stopped {
                    waiting.push_back((index, n_tries));
                    continue;
                }
                let ended = Ended { index, exit_code: status.code(), n_tries };
                on_end(&ended);
                all.push(ended);
            }
            running = still;
            std::thread::sleep(LOOK);
        }
        if is_stopped { Err(Error::Interrupted) } else { Ok(all) }
    }

    fn start(&self, index: usize) -> Result<Child> {
        let mut command = Command::new(self.program);
        command.args(&self.arguments).arg(index.to_string()).stdin(Stdio::null()).stdout(Stdio::null());
        // A terminal's Ctrl-C would reach them twice, and twice means at once.
        command.process_group(0);
        command.spawn().map_err(|cause| Error::io(self.program, cause))
    }
}

/// As Ctrl-C does.
fn ask_to_end(child: &Child) {
    // One that has ended meanwhile is waited for all the same.
    let _ = Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status();
}
