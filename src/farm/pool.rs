//! The engine of one machine: every shard in a process of its own, some at a time, tried again
//! where it may go well.

use std::collections::VecDeque;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::child::EXCLUSIVE;
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
    /// Nobody else uses the device, as far as is known here.
    pub exclusive: bool,
}

/// How a shard's last try ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ended {
    pub index: usize,
    /// None where a signal ended it.
    pub exit_code: Option<i32>,
    pub n_tries: usize,
}

/// A shard that is to be run.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    index: usize,
    /// So often it was.
    n_tries: usize,
    from: Instant,
}

/// Before another try, times those before: what may pass takes a while.
const PAUSE: Duration = Duration::from_secs(1);
/// How often children are looked at: short beside a shard, which takes a second at least.
const LOOK: Duration = Duration::from_millis(5);

impl Pool<'_> {
    /// Runs `indices`; `on_end` is told of each. On `stop`, and on an error, no more begin, and
    /// those that run are asked to end: they keep what they have.
    pub fn run(
        &self,
        indices: &[usize],
        stop: &AtomicBool,
        on_end: &mut dyn FnMut(&Ended),
    ) -> Result<Vec<Ended>> {
        let now = Instant::now();
        let mut waiting: VecDeque<Waiting> =
            indices.iter().map(|i| Waiting { index: *i, n_tries: 0, from: now }).collect();
        let mut running: Vec<(Waiting, Child)> = Vec::new();
        let mut all = Vec::new();
        let ended = loop {
            if waiting.is_empty() && running.is_empty() {
                break Ok(());
            }
            if stop.load(Ordering::Relaxed) {
                break Err(Error::Interrupted);
            }
            if let Err(error) = self.step(&mut waiting, &mut running, &mut all, on_end) {
                break Err(error);
            }
            std::thread::sleep(LOOK);
        };
        running.iter().for_each(|(_, child)| ask_to_end(child));
        for (_, child) in &mut running {
            // It was asked to.
            let _ = child.wait();
        }
        ended.map(|()| all)
    }

    /// Starts what there is room for, and looks at what runs.
    fn step(
        &self,
        waiting: &mut VecDeque<Waiting>,
        running: &mut Vec<(Waiting, Child)>,
        all: &mut Vec<Ended>,
        on_end: &mut dyn FnMut(&Ended),
    ) -> Result<()> {
        while running.len() < self.n_processes
            && let Some(i) = waiting.iter().position(|shard| shard.from <= Instant::now())
            && let Some(next) = waiting.remove(i)
        {
            let child = self.start(next.index)?;
            running.push((Waiting { n_tries: next.n_tries + 1, ..next }, child));
        }
        let mut i = 0;
        while let Some((shard, child)) = running.get_mut(i) {
            let Some(status) = child.try_wait().map_err(|cause| Error::io(self.program, cause))?
            else {
                i += 1;
                continue;
            };
            let Waiting { index, n_tries, .. } = *shard;
            running.swap_remove(i);
            // One that was killed is worth another try as well.
            if matches!(status.code(), None | Some(75)) && n_tries < self.n_tries {
                let from = Instant::now() + PAUSE * n_tries as u32;
                waiting.push_back(Waiting { index, n_tries, from });
                continue;
            }
            let ended = Ended { index, exit_code: status.code(), n_tries };
            on_end(&ended);
            all.push(ended);
        }
        Ok(())
    }

    fn start(&self, index: usize) -> Result<Child> {
        let mut command = Command::new(self.program);
        command
            .args(&self.arguments)
            .arg(index.to_string())
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        if self.exclusive {
            command.env(EXCLUSIVE, "1");
        }
        // A terminal's Ctrl-C would reach them twice, and twice means at once.
        command.process_group(0);
        command.spawn().map_err(|cause| Error::io(self.program, cause))
    }
}

/// As Ctrl-C does.
pub(super) fn ask_to_end(child: &Child) {
    // One that has ended meanwhile is waited for all the same.
    let _ =
        Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status();
}
