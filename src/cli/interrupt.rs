//! Ctrl-C: ends the process, or asks the command to stop where it keeps what it has finished.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::error::Error;
use crate::io::atomic;

/// Set by Ctrl-C if [`GRACEFUL`] is set; commands check it between frames.
static STOP: AtomicBool = AtomicBool::new(false);
/// Whether the command saves what it has finished, so that only a second Ctrl-C ends the process at
/// once.
static GRACEFUL: AtomicBool = AtomicBool::new(false);

/// Returns the flag that the next Ctrl-C sets, in place of ending the process. The command checks
/// it between frames and keeps what is finished.
pub fn graceful_stop() -> &'static AtomicBool {
    GRACEFUL.store(true, Ordering::Relaxed);
    &STOP
}

/// Signals within this time count as one: a job engine signals a script and its children, and the
/// script signals the children again.
const ONE_SIGNAL: Duration = Duration::from_secs(1);

/// Handles Ctrl-C, on a thread of its own.
pub fn handle() {
    static FIRST: OnceLock<Instant> = OnceLock::new();
    if GRACEFUL.load(Ordering::Relaxed) {
        if !STOP.swap(true, Ordering::Relaxed) {
            FIRST.get_or_init(Instant::now);
            eprintln!(
                "interrupted: finishes this frame and keeps what is done; once more ends at once"
            );
            return;
        }
        if FIRST.get().is_some_and(|first| first.elapsed() < ONE_SIGNAL) {
            return;
        }
    }
    atomic::abandon();
    // std::process::exit would run exit handlers of the driver, which other threads are still
    // using.
    unsafe extern "C" {
        fn _exit(code: std::ffi::c_int) -> !;
    }
    // SAFETY: ends the process; nothing after it runs.
    unsafe { _exit(i32::from(Error::Interrupted.exit_code())) }
}
