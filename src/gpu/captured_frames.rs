//! The frames of a device that count for a capture, and the capture's result.

use super::capture::Captured;
use super::commands::Commands;
use super::device::Device;

impl Device {
    /// Sets whether frames that begin count for the frame to capture. Frames of trials do not.
    pub fn count_frames(&self, counts: bool) {
        if let Some(capture) = &self.shared().capture {
            capture.count_frames(counts);
        }
    }

    /// Returns the result of the capture that was asked for; none before its frame has ended.
    pub fn captured(&self) -> Option<Captured> {
        self.shared().capture.as_ref().and_then(|capture| capture.result())
    }
}

impl Commands {
    /// Counts a frame that begins, and starts its capture if one is asked for. Returns whether the
    /// frame is captured.
    pub fn begin_frame(&self) -> bool {
        let instance = self.shared.instance.vulkan.raw.handle();
        self.shared.capture.as_ref().is_some_and(|capture| capture.begin_frame(instance))
    }

    /// Ends the capture of a frame that has ended.
    pub fn end_captured_frame(&self) {
        if let Some(capture) = &self.shared.capture {
            capture.end_frame(self.shared.instance.vulkan.raw.handle());
        }
    }
}
