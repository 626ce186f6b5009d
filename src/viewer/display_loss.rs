//! The end of a window whose display has gone: unsaved work is kept, and the process ends with a
//! message and the exit code of a missing device.
//!
//! Xlib reports a broken connection through a function that must not return. It may be called on
//! any thread, in the middle of a call of the window system. winit has a connection of its own, and
//! panics if that connection breaks first. On Wayland, winit ends its loop with an exit code.
//! Windows and macOS have no such connection.

use std::panic::{PanicHookInfo, set_hook, take_hook};
use std::sync::{Mutex, Once};

use winit::error::EventLoopError;

use super::sync::lock;
use crate::error::Error;
use crate::io::atomic;
use crate::io::console::say;

/// A function that keeps unsaved work.
type Rescue = Box<dyn FnOnce() + Send>;

/// Guards the panic hook, so that repeated calls of [`on_loss`] do not stack hooks.
static HOOK: Once = Once::new();
/// The function that keeps unsaved work when the display is lost; called at most once.
static RESCUE: Mutex<Option<Rescue>> = Mutex::new(None);

/// Makes the loss of the display call `rescue`, in place of the function given before.
///
/// A system without Xlib has no such connection, so only winit's panics are handled there.
pub fn on_loss(rescue: impl FnOnce() + Send + 'static) {
    *lock(&RESCUE) = Some(Box::new(rescue));
    HOOK.call_once(|| {
        let others = take_hook();
        set_hook(Box::new(
            move |panic| if is_of_display(panic) { end_process() } else { others(panic) },
        ));
    });
    #[cfg(all(unix, not(target_os = "macos")))]
    x11::on_loss();
}

#[cfg(all(unix, not(target_os = "macos")))]
mod x11 {
    use std::ffi::c_int;

    use x11_dl::xlib;

    /// Makes Xlib end the process when its connection breaks.
    pub fn on_loss() {
        if let Ok(library) = xlib::Xlib::open() {
            // SAFETY: the function has the required type, stays valid, and never returns.
            unsafe { (library.XSetIOErrorHandler)(Some(end)) };
        }
    }

    unsafe extern "C" fn end(_: *mut xlib::Display) -> c_int {
        super::end_process()
    }
}

/// Returns the error of an event loop that has ended with `error`.
pub fn of_loop(error: &EventLoopError) -> Error {
    match error {
        EventLoopError::ExitFailure(_) => lost(),
        other => Error::vulkan("window", other),
    }
}

fn lost() -> Error {
    Error::vulkan("window", "the connection to the display is lost")
}

/// Returns whether winit panicked because its connection to the display broke.
fn is_of_display(panic: &PanicHookInfo<'_>) -> bool {
    let payload = panic.payload();
    let text = payload.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or_default();
    let is_of_winit = panic.location().is_some_and(|at| at.file().contains("winit"));
    is_of_winit && text.contains("Connection(")
}

/// Keeps unsaved work and ends the process.
fn end_process() -> ! {
    // The lock is held until the process ends: another thread that finds the display lost must not
    // end the process while this one keeps unsaved work.
    let mut rescue = lock(&RESCUE);
    if let Some(rescue) = rescue.take() {
        rescue();
    }
    let error = lost();
    say!("error: {error}");
    atomic::abandon_and_exit(error.exit_code())
}
