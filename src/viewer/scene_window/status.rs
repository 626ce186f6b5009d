//! Status that the render thread reports to the panels.

use std::sync::{Arc, Mutex};

use super::timeline::Timeline;
use crate::frame::Counts;
use crate::gpu::{Captured, PresentMode};
use crate::studies::picture_error::PictureError;
use crate::viewer::error_probe::ProbeStatus;

/// Status of the scene window.
#[derive(Debug, Clone, Default)]
pub struct ViewStatus {
    /// Whether a picture was presented.
    pub has_picture: bool,
    /// Times of the last frames.
    pub timeline: Timeline,
    /// Counts of the frame with this number.
    pub counts: Option<(u32, Counts)>,
    /// The mode that frames are presented by; `None` before the first.
    pub present_mode: Option<PresentMode>,
    /// Name of the device that draws.
    pub device_name: String,
    /// Why the scene's files could not be read.
    pub file_error: Option<String>,
    /// Why the scene could not be drawn.
    pub render_error: Option<String>,
    /// Time of B's last frame, ms; `None` without B.
    pub variant_ms: Option<f64>,
    /// `None` while no error is measured.
    pub error: Option<ErrorStatus>,
    /// The result of the capture that was asked for.
    pub captured: Option<Captured>,
}

/// Error of the view against its reference.
#[derive(Debug, Clone, Default)]
pub struct ErrorStatus {
    /// State of the reference.
    pub probe: ProbeStatus,
    /// Error of A, once it is measured.
    pub a: Option<PictureError>,
    /// Error of B, once it is measured.
    pub b: Option<PictureError>,
}

/// A status shared by the window and the render thread.
pub type SharedStatus = Arc<Mutex<ViewStatus>>;

impl ViewStatus {
    /// Returns the errors to show over the picture, a line each; `None` where all is well.
    pub fn alarm(&self) -> Option<String> {
        let errors = [&self.file_error, &self.render_error].into_iter().flatten();
        let errors: Vec<&str> = errors.map(String::as_str).collect();
        (!errors.is_empty()).then(|| errors.join("\n"))
    }
}
