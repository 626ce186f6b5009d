//! State and events between the scene window and its render thread.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use winit::event_loop::EventLoopProxy;

use super::status::SharedStatus;
use super::view_state::ViewState;
use crate::io::image::ImageKind;
use crate::model::backdrop::Backdrop;
use crate::model::film::Film;
use crate::viewer::egui_layer::SharedWidgets;
use crate::viewer::fly_camera::FlyCamera;
use crate::viewer::sync::lock;

/// An event that the render thread sends to the window.
#[derive(Debug)]
pub enum RenderEvent {
    /// A new window title.
    Title(String),
    /// A message for the window and the terminal.
    Message(String),
    /// A message for the terminal alone.
    Note(String),
    /// A picture to save: premultiplied linear RGBA, rows from the top.
    Capture { format: ImageKind, backdrop: Box<Backdrop>, rgba: Vec<f32> },
    /// Pictures that the error measurement has asked for.
    Readback(Readback),
    /// The status has a new error.
    ErrorChanged,
    /// The thread has ended.
    Ended,
}

/// Pictures of one frame, as [`ViewState::wants_readback`] asked for them.
#[derive(Debug)]
pub struct Readback {
    /// [`ViewState::version`] of the frame.
    pub version: u64,
    /// Camera of the frame.
    pub camera: FlyCamera,
    /// Number of the frame.
    pub i_frame: u32,
    /// Film of the frame, with the size of the pictures.
    pub film: Film,
    /// Picture of A: premultiplied linear RGBA, rows from the top.
    pub a: Vec<f32>,
    /// Picture of B, if there is one.
    pub b: Option<Vec<f32>>,
}

/// State that the window and its render thread share.
#[derive(Clone)]
pub struct RenderLinks {
    /// The state that the thread draws.
    pub state: Arc<Mutex<ViewState>>,
    /// The status that the panels show.
    pub status: SharedStatus,
    /// The widgets over the picture.
    pub widgets: SharedWidgets,
    /// Events to the window.
    pub events: EventLoopProxy<RenderEvent>,
    /// Ends the thread when set.
    pub stop: &'static AtomicBool,
}

impl RenderLinks {
    /// Sends an event to the window.
    pub fn send(&self, event: RenderEvent) {
        // Sending fails only after the event loop has ended, when no event matters any more.
        drop(self.events.send_event(event));
    }

    /// Sends a message for the window and the terminal.
    pub fn message(&self, text: String) {
        self.send(RenderEvent::Message(text));
    }

    /// Sends a message for the terminal alone.
    pub fn note(&self, text: String) {
        self.send(RenderEvent::Note(text));
    }

    /// Returns whether the thread is to end.
    pub fn is_closing(&self) -> bool {
        lock(&self.state).is_closing || self.stop.load(Ordering::Relaxed)
    }
}
