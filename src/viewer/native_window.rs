//! A window with its Vulkan surface, and the thread that renders into it.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::thread::JoinHandle;

use winit::dpi::PhysicalSize;
use winit::event::MouseScrollDelta;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use winit::window::Window;

use crate::error::{Error, Result};
use crate::gpu::{Instance, Surface};

/// Pixels of a touchpad's scroll that count as one notch of a wheel. A smaller value approaches
/// faster, a larger one more finely.
const PIXELS_PER_NOTCH: f64 = 40.0;

/// Opens a window with `size` pixels of content, and its Vulkan surface.
///
/// # Errors
/// The window system refuses the window, or Vulkan the surface.
pub fn open_window(
    events: &ActiveEventLoop,
    title: &str,
    [width, height]: [u32; 2],
    validation: bool,
) -> Result<(Window, (Arc<Instance>, Surface))> {
    fn fail(e: impl ToString) -> Error {
        Error::vulkan("opening a window", e.to_string())
    }
    let attributes = Window::default_attributes()
        .with_title(title)
        .with_inner_size(PhysicalSize::new(width, height));
    let window = events.create_window(attributes).map_err(fail)?;
    let display = window.display_handle().map_err(fail)?.as_raw();
    let handle = window.window_handle().map_err(fail)?.as_raw();
    let surface = Surface::open(validation, display, handle)?;
    Ok((window, surface))
}

/// Connects to the display. `alternative` names a command that works without one.
///
/// # Errors
/// There is no display, or it cannot be opened.
pub fn event_loop<T: 'static>(alternative: &str) -> Result<EventLoop<T>> {
    EventLoop::with_user_event().build().map_err(|error| {
        let problem = problem_of_display(|name| std::env::var(name).ok());
        let cause = without_place(&error.to_string()).trim_end_matches('.').to_owned();
        Error::vulkan("opening a window", format!("{problem} ({cause}); {alternative}"))
    })
}

/// Returns why no display can be opened where the environment has these variables. winit takes
/// Wayland where there are both window systems.
fn problem_of_display(variable: impl Fn(&str) -> Option<String>) -> String {
    if cfg!(any(windows, target_os = "macos")) {
        return "the system opens no window; run nimbus in a desktop session".to_owned();
    }
    let set = |name| variable(name).filter(|value| !value.is_empty());
    if let Some(name) = set("WAYLAND_DISPLAY").or_else(|| set("WAYLAND_SOCKET")) {
        return format!(
            "the Wayland display {name} cannot be opened: no compositor answers there, or \
             libwayland-client is not installed (without WAYLAND_DISPLAY, nimbus uses X11)"
        );
    }
    match set("DISPLAY") {
        Some(name) => format!(
            "the display {name} cannot be opened: no X server answers there, or it does not let \
             this user in (over ssh, `ssh -X` forwards a display)"
        ),
        None => "there is no display: neither WAYLAND_DISPLAY nor DISPLAY is set; run nimbus in a \
                 desktop session, over `ssh -X`, or by `xvfb-run`"
            .to_owned(),
    }
}

/// Returns the text of an error of winit without the place in winit's source that it begins with:
/// "os error at FILE:LINE: ".
fn without_place(text: &str) -> &str {
    let cause = || text.strip_prefix("os error at ")?.split_once(": ");
    cause().map_or(text, |(_, cause)| cause)
}

/// Converts a scroll event to notches of a wheel; positive is away from the user.
pub fn wheel_notches(delta: MouseScrollDelta) -> f64 {
    match delta {
        MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
        MouseScrollDelta::PixelDelta(offset) => offset.y / PIXELS_PER_NOTCH,
    }
}

/// The thread that renders into a window.
pub struct RenderThread<T>(JoinHandle<Result<T>>);

impl<T: Send + 'static> RenderThread<T> {
    /// Runs `render` on a new thread. `on_end` is called when it ends, also by a panic.
    ///
    /// # Errors
    /// The system starts no thread.
    pub fn start(
        render: impl FnOnce() -> Result<T> + Send + 'static,
        on_end: impl FnOnce() + Send + 'static,
    ) -> Result<RenderThread<T>> {
        let work = move || {
            // A window would wait forever for a thread that panicked.
            let ended = catch_unwind(AssertUnwindSafe(render));
            on_end();
            let panicked = || Error::Fault { what: "the drawing thread panicked".to_owned() };
            ended.unwrap_or_else(|_| Err(panicked()))
        };
        let started = std::thread::Builder::new().name("draw".into()).spawn(work);
        started.map(RenderThread).map_err(|e| Error::vulkan("starting the drawing thread", e))
    }

    /// Waits for the thread and returns its result.
    ///
    /// # Errors
    /// The thread failed or panicked.
    pub fn join(self) -> Result<T> {
        self.0.join().unwrap_or_else(|payload| resume_unwind(payload))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn a_cause_has_no_place_in_the_source() {
        for (text, cause) in [
            ("os error at /a b/x11/mod.rs:12: no display: :0", "no display: :0"),
            ("Exit Failure: 3", "Exit Failure: 3"),
            ("os error at nothing", "os error at nothing"),
        ] {
            assert_eq!(without_place(text), cause);
        }
    }

    #[test]
    fn the_end_of_a_render_thread_is_signalled_also_after_a_panic() {
        let (sender, receiver) = channel();
        let (first, second) = (sender.clone(), sender);
        let good = RenderThread::start(|| Ok(7), move || first.send(()).unwrap()).unwrap();
        receiver.recv().unwrap();
        assert_eq!(good.join(), Ok(7));
        let bad =
            RenderThread::<u32>::start(|| panic!("on purpose"), move || second.send(()).unwrap())
                .unwrap();
        receiver.recv().unwrap();
        assert!(matches!(bad.join(), Err(Error::Fault { .. })));
    }
}
