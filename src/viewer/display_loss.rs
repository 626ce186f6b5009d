//! The end of a window whose display has gone: unsaved work is kept, and the process ends with a
//! message and the exit code of a missing device.
//!
//! Xlib reports a broken connection through a function that must not return. It may be called on
//! any thread, in the middle of a call of the window system.

use std::ffi::c_int;
use std::io::{Write, stderr};
use std::sync::Mutex;

use x11_dl::xlib;

use super::sync::lock;
use crate::error::Error;
use crate::io::atomic;

/// A function that keeps unsaved work.
type Rescue = Box<dyn FnOnce() + Send>;

/// Called once when the display is lost.
static RESCUE: Mutex<Option<Rescue>> = Mutex::new(None);

/// Has `rescue` called when the display is lost. The last call of this function counts.
///
/// Where the system has no Xlib there is no connection that could break.
pub fn on_loss(rescue: impl FnOnce() + Send + 'static) {
    *lock(&RESCUE) = Some(Box::new(rescue));
    if let Ok(library) = xlib::Xlib::open() {
        // SAFETY: the function has the required type, stays valid, and never returns.
        unsafe { (library.XSetIOErrorHandler)(Some(end)) };
    }
}

unsafe extern "C" fn end(_: *mut xlib::Display) -> c_int {
    let rescue = lock(&RESCUE).take();
    if let Some(rescue) = rescue {
        rescue();
    }
    let error = Error::vulkan("window", "the connection to the display is lost");
    // The process ends also where nobody reads its messages.
    let _ = writeln!(stderr(), "error: {error}");
    atomic::abandon();
    // std::process::exit would run exit handlers of the driver, which other threads are still
    // using.
    unsafe extern "C" {
        fn _exit(code: c_int) -> !;
    }
    // SAFETY: ends the process; nothing after it runs.
    unsafe { _exit(c_int::from(error.exit_code())) }
}
