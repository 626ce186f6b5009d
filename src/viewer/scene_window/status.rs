//! Status that the render thread reports to the panels.

use std::sync::{Arc, Mutex};

use super::timeline::Timeline;
use crate::frame::plan::Plan;
use crate::frame::{Counts, FrameTimes};
use crate::gpu::PresentMode;
use crate::studies::picture_error::PictureError;
use crate::viewer::error_probe::ProbeStatus;

/// Status of the scene window.
#[derive(Debug, Clone, Default)]
pub struct ViewStatus {
    pub timeline: Timeline,
    pub last_frame: Option<LastFrame>,
    /// Counts of the frame with this number.
    pub counts: Option<(u32, Counts)>,
    pub present_mode: Option<PresentMode>,
    pub device_name: String,
    /// Why the scene's files could not be read.
    pub file_error: Option<String>,
    /// Why the scene could not be drawn.
    pub render_error: Option<String>,
    /// Time of B's last frame, ms; `None` without B.
    pub variant_ms: Option<f64>,
    /// `None` while no error is measured.
    pub error: Option<ErrorStatus>,
}

/// Error of the view against its reference.
#[derive(Debug, Clone, Default)]
pub struct ErrorStatus {
    pub probe: ProbeStatus,
    pub a: Option<PictureError>,
    pub b: Option<PictureError>,
}

/// The frame that ended last.
#[derive(Debug, Clone)]
pub struct LastFrame {
    pub time_s: f64,
    pub n_shown: u32,
    pub n_particles: u64,
    pub plan: Plan,
}

/// A status shared by the window and the render thread.
pub type SharedStatus = Arc<Mutex<ViewStatus>>;

impl ViewStatus {
    /// Adds the times of a frame.
    pub fn push(&mut self, times: &FrameTimes, n_particles: u64) {
        self.timeline.push(times);
        let FrameTimes { time_s, plan, .. } = *times;
        self.last_frame = Some(LastFrame { time_s, n_shown: times.n_shown(), n_particles, plan });
    }

    /// Returns the errors to show over the picture, a line each; `None` where all is well.
    pub fn alarm(&self) -> Option<String> {
        let errors = [&self.file_error, &self.render_error].into_iter().flatten();
        let errors: Vec<&str> = errors.map(String::as_str).collect();
        (!errors.is_empty()).then(|| errors.join("\n"))
    }
}
