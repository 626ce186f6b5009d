//! What every window begins and ends with: itself, its surface, and a thread that draws into it.

use std::sync::Arc;
use std::thread::JoinHandle;

use winit::dpi::PhysicalSize;
use winit::event_loop::ActiveEventLoop;
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use winit::window::Window;

use crate::error::{Error, Result};
use crate::gpu::{Instance, Surface};

/// A window of so many pixels, and what Vulkan draws into it by.
pub fn open(
    events: &ActiveEventLoop,
    title: &str,
    [width, height]: [u32; 2],
    validation: bool,
) -> Result<(Window, (Arc<Instance>, Surface))> {
    let fail = |e: String| Error::vulkan("opening a window", e);
    let attributes = Window::default_attributes()
        .with_title(title)
        .with_inner_size(PhysicalSize::new(width, height));
    let window = events.create_window(attributes).map_err(|e| fail(e.to_string()))?;
    let display = window.display_handle().map_err(|e| fail(e.to_string()))?.as_raw();
    let handle = window.window_handle().map_err(|e| fail(e.to_string()))?.as_raw();
    let surface = Surface::open(validation, display, handle)?;
    Ok((window, surface))
}

/// Why there is no window, and what does `without` one.
pub fn no_display(why: &str, without: &str) -> Error {
    let set = |name: &str| std::env::var(name).is_ok_and(|v| !v.is_empty());
    let what = match set("DISPLAY") {
        true => {
            format!("the display {} cannot be opened", std::env::var("DISPLAY").unwrap_or_default())
        }
        false => "there is no display: DISPLAY is not set".to_owned(),
    };
    Error::vulkan("opening a window", format!("{what} ({why}); {without}"))
}

/// The thread that draws.
pub struct Thread<T>(JoinHandle<Result<T>>);

impl<T: Send + 'static> Thread<T> {
    /// Has it `draw`, and then tell that it has ended.
    pub fn start(
        draw: impl FnOnce() -> Result<T> + Send + 'static,
        ended: impl FnOnce() + Send + 'static,
    ) -> Result<Thread<T>> {
        let work = move || {
            // A panic is an end, too, for which a window would wait for ever.
            let _tells = AtEnd(Some(ended));
            draw()
        };
        let started = std::thread::Builder::new().name("draw".into()).spawn(work);
        started.map(Thread).map_err(|e| Error::vulkan("starting the drawing thread", e))
    }

    /// What came of it.
    pub fn end(self) -> Result<T> {
        let panicked = || Error::Fault { what: "the drawing thread panicked".to_owned() };
        self.0.join().unwrap_or_else(|_| Err(panicked()))
    }
}

/// Does it when it goes, whatever for.
struct AtEnd<F: FnOnce()>(Option<F>);

impl<F: FnOnce()> Drop for AtEnd<F> {
    fn drop(&mut self) {
        if let Some(end) = self.0.take() {
            end();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn an_end_is_told_however_it_comes() {
        let (tell, told) = channel();
        let (first, second) = (tell.clone(), tell);
        let well = Thread::start(|| Ok(7), move || first.send(()).unwrap()).unwrap();
        told.recv().unwrap();
        assert_eq!(well.end(), Ok(7));
        let badly = Thread::<u32>::start(|| panic!("on purpose"), move || second.send(()).unwrap())
            .unwrap();
        told.recv().unwrap();
        assert!(matches!(badly.end(), Err(Error::Fault { .. })));
    }
}
