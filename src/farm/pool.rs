//! A pool of processes that does the shards of a plan on one machine.

use std::io;
use std::path::Path;
use std::process::Child;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use super::process::{self, EXCLUSIVE, IDLE_LIMIT, POLL};
use crate::error::{Error, Result};

/// The pause before another try, times the tries so far: a transient cause lasts a while.
const PAUSE: Duration = Duration::from_secs(1);

/// Processes to be run, and how many at a time.
#[derive(Debug, Clone)]
pub struct Pool<'a> {
    /// The program.
    pub program: &'a Path,
    /// Its arguments, except for the shard's number, which comes last.
    pub arguments: Vec<String>,
    /// The number of processes at a time. A single one has the node to itself.
    pub n_processes: usize,
    /// The number of tries of a shard that fails transiently.
    pub n_tries: u32,
}

/// The end of a shard's last try.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ended {
    /// The shard's number.
    pub index: usize,
    /// The exit code; none where a signal ended the process.
    pub exit_code: Option<i32>,
}

impl Pool<'_> {
    /// Runs shards and calls `on_end` after each. On `stop` the processes that run are asked to
    /// keep what they have and to end.
    ///
    /// # Errors
    /// When a process cannot be started, or the pool was stopped.
    pub fn run(
        &self,
        indices: &[usize],
        stop: &AtomicBool,
        on_end: &dyn Fn(),
    ) -> Result<Vec<Ended>> {
        let next = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            for i_thread in 0..self.n_processes.min(indices.len()) {
                let (sender, next) = (sender.clone(), &next);
                let work = move || {
                    while let Some(&index) = indices.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let ended = self.try_shard(index, stop);
                        let ended = ended.map(|exit_code| Ended { index, exit_code });
                        // Sending fails after an error of another thread.
                        if sender.send(ended).is_err() {
                            break;
                        }
                    }
                };
                let started = std::thread::Builder::new().spawn_scoped(scope, work);
                if let Err(cause) = started {
                    // The threads that were started do all shards.
                    if i_thread == 0 {
                        return Err(Error::of_io(self.program, &cause));
                    }
                    break;
                }
            }
            drop(sender);
            receiver.into_iter().inspect(|_| on_end()).collect()
        })
    }

    /// Runs a shard until it is done, fails permanently, or has had all its tries. Returns the last
    /// exit code.
    fn try_shard(&self, index: usize, stop: &AtomicBool) -> Result<Option<i32>> {
        let failed = |cause: io::Error| Error::of_io(self.program, &cause);
        let mut n_tries = 1;
        loop {
            let code = self.start(index).map_err(failed).and_then(|mut child| {
                Ok(process::wait(&mut child, stop, IDLE_LIMIT).map_err(failed)?.code())
            });
            let is_stopped = || stop.load(Ordering::Relaxed);
            // A process that was killed, or that could not be started, gets another try, too.
            let may_pass = matches!(code, Ok(None | Some(75)) | Err(Error::Transient { .. }));
            let is_final = !may_pass || n_tries == self.n_tries;
            let until = Instant::now() + PAUSE * n_tries;
            while !is_final && !is_stopped() && Instant::now() < until {
                std::thread::sleep(POLL);
            }
            if is_stopped() {
                return Err(Error::Interrupted);
            }
            if is_final {
                return code;
            }
            n_tries += 1;
        }
    }

    fn start(&self, index: usize) -> io::Result<Child> {
        let mut command = process::quiet(self.program);
        command.args(&self.arguments).arg(index.to_string());
        if self.n_processes == 1 {
            command.env(EXCLUSIVE, "1");
        }
        command.spawn()
    }
}
