//! Ctrl-C: ends the process, or asks the command to stop where it keeps what it has finished.
//!
//! A command that keeps something holds a [`Keeping`] from its first result on. Before that, and in
//! every other command, Ctrl-C ends the process at once. A command that holds one checks the flag
//! of [`graceful_stop`] between its steps. A step can take longer than a user waits, and most steps
//! cannot be cut short: a frame on the device, a reference. So if the command has not come to its
//! end within [`PATIENCE`], the thread of the signal keeps what is finished and ends the process.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::output;
use crate::error::Error;
use crate::io::atomic;
use crate::io::console::say;

/// Set by Ctrl-C while a command keeps something; commands check it between frames.
static STOP: AtomicBool = AtomicBool::new(false);
/// The way in which the present command keeps what it has finished.
static KEPT: Mutex<Option<Kept>> = Mutex::new(None);

/// The time that a command has for its present step after Ctrl-C.
pub const PATIENCE: Duration = Duration::from_millis(400);
/// The time for a process that waits for a child, which has [`PATIENCE`] and then writes.
pub const PATIENCE_WITH_CHILDREN: Duration = Duration::from_millis(600);
/// The time for a process that waits for processes that wait for children.
pub const PATIENCE_OF_POOL: Duration = Duration::from_millis(800);
/// Signals within this time count as one: a job engine signals a script and its children, and the
/// script signals the children again.
const ONE_SIGNAL: Duration = Duration::from_secs(1);

/// Keeps what is finished and returns the error that the process ends with.
type Save = Box<dyn FnOnce() -> Error + Send>;

/// A command's finished part.
struct Kept {
    /// A phrase that tells the user how the command ends after Ctrl-C.
    does: &'static str,
    patience: Option<Duration>,
    save: Save,
}

/// The phrase of a command that keeps finished steps, such as frames.
const KEEPS: &str = "finishes the present step and keeps what is done";

/// A line about what is kept when Ctrl-C ends the command before it keeps anything.
static NOTE: Mutex<Option<&'static str>> = Mutex::new(None);

/// Sets the line that is printed when Ctrl-C ends the command before its first [`Keeping`].
pub fn note_until_keep(note: &'static str) {
    *NOTE.lock().unwrap_or_else(PoisonError::into_inner) = Some(note);
}

/// Takes the line of [`note_until_keep`].
fn take_note() -> Option<&'static str> {
    NOTE.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// Returns the flag that Ctrl-C sets while a [`Keeping`] exists. The command checks it between
/// frames.
pub fn graceful_stop() -> &'static AtomicBool {
    &STOP
}

/// Ctrl-C does not end the process at once while this value exists.
pub struct Keeping(());

/// Declares that from now on there is something to keep. `save` keeps it, on another thread, if the
/// command has not ended the [`Keeping`] within `patience` of Ctrl-C; it returns the error that the
/// process ends with.
pub fn keep(patience: Duration, save: impl FnOnce() -> Error + Send + 'static) -> Keeping {
    *lock() = Some(Kept { does: KEEPS, patience: Some(patience), save: Box::new(save) });
    take_note();
    Keeping(())
}

/// Declares that the command shows a window, which it closes after Ctrl-C. The process ends at once
/// if that takes longer than `patience`.
#[cfg(feature = "window")]
pub fn close_window(patience: Duration) -> Keeping {
    let save = Box::new(|| Error::Interrupted);
    *lock() = Some(Kept { does: "closes the window", patience: Some(patience), save });
    Keeping(())
}

/// Declares that the command, which has a window, ends by itself after Ctrl-C; `does` says what it
/// does until then.
#[cfg(feature = "window")]
pub fn keep_by_itself(does: &'static str) -> Keeping {
    *lock() = Some(Kept { does, patience: None, save: Box::new(|| Error::Interrupted) });
    Keeping(())
}

impl Keeping {
    /// Declares that the command now keeps what it has finished, so that the thread of the signal
    /// no longer does.
    pub fn finish(&mut self) {
        let save = Box::new(|| Error::Interrupted);
        take_over(Some(Kept { does: KEEPS, patience: None, save }));
    }
}

impl Drop for Keeping {
    fn drop(&mut self) {
        take_over(None);
    }
}

/// Replaces the way in which the command keeps what it has finished. Does not return if the thread
/// of the signal is keeping it, because that thread ends the process.
fn take_over(next: Option<Kept>) {
    let mut kept = lock();
    if kept.is_some() {
        *kept = next;
        return;
    }
    drop(kept);
    loop {
        thread::park();
    }
}

fn lock() -> MutexGuard<'static, Option<Kept>> {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Handles Ctrl-C, on a thread of its own.
pub fn handle() {
    static FIRST: OnceLock<Instant> = OnceLock::new();
    let kept = lock().as_ref().map(|kept| (kept.does, kept.patience));
    if let Some((does, patience)) = kept {
        if !STOP.swap(true, Ordering::Relaxed) {
            FIRST.get_or_init(Instant::now);
            if let Some(patience) = patience {
                wait_and_save(patience);
            }
            say!("interrupted: {does}; once more ends at once");
            return;
        }
        if FIRST.get().is_some_and(|first| first.elapsed() < ONE_SIGNAL) {
            return;
        }
    } else if let Some(note) = take_note() {
        say!("{note}");
    }
    end(&Error::Interrupted);
}

/// Starts a thread that keeps what is finished unless the command does so within `patience`. Where
/// none can be started, the command ends after its present step.
fn wait_and_save(patience: Duration) {
    let work = move || {
        thread::sleep(patience);
        let save = {
            let mut kept = lock();
            // A command that has come to its end waits for nothing but its files.
            kept.take_if(|kept| kept.patience.is_some()).map(|kept| kept.save)
        };
        if let Some(save) = save {
            end(&save());
        }
    };
    let _ = thread::Builder::new().name("interrupt".into()).spawn(work);
}

/// Ends the process at once.
fn end(error: &Error) -> ! {
    output::error(error, clap::ColorChoice::Never);
    atomic::abandon_and_exit(error.exit_code())
}
