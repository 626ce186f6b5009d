//! The times of a frame.

use std::time::{Duration, Instant};

use super::clock::ms;
use super::packet::Packet;
use super::plan::Plan;
use super::renderer::{Rendered, Renderer};
use crate::error::Result;
use crate::gpu::ScopeTime;

/// The times and results of one frame. Times are in ms.
#[derive(Debug, Clone)]
pub struct FrameTimes {
    /// Number of the frame.
    pub i_frame: u32,
    /// Time of the scene, in seconds.
    pub time_s: f64,
    /// From the end of the previous frame, or the start of the run, to the end of this one.
    pub frame_ms: f64,
    /// Game step.
    pub game_ms: f64,
    /// Uploading, planning and recording.
    pub record_ms: f64,
    /// Submission to the driver.
    pub submit_ms: f64,
    /// From the submission, or the end of the previous frame if that was later, to the frame's end.
    pub wait_ms: f64,
    /// From the start of the game step to the finished picture.
    pub latency_ms: f64,
    /// Unfinished frames on the device when this one was submitted.
    pub queue_depth: u32,
    /// Drawn particles: those of clouds in view, as many as `draw.count` asks for.
    pub n_drawn: u32,
    /// Drawn particles that can show in a pixel, if `draw.cull` is on.
    pub n_kept: Option<u32>,
    /// Times at which the steps began and ended.
    pub marks: Marks,
    /// The plan of the frame.
    pub plan: Plan,
    /// Device time of every pass that ran; empty without timestamps.
    pub passes: Vec<ScopeTime>,
}

impl FrameTimes {
    /// Returns the number of particles that the drawing pass was given.
    pub fn n_shown(&self) -> u32 {
        self.n_kept.unwrap_or(self.n_drawn)
    }

    /// Returns the time of recording, submission and waiting, in ms.
    pub fn render_ms(&self) -> f64 {
        self.record_ms + self.submit_ms + self.wait_ms
    }
}

/// The times at which a frame's steps began and ended, on the host's clock.
#[derive(Debug, Clone, Copy)]
pub struct Marks {
    /// Game step.
    pub game: [Instant; 2],
    /// Uploading, planning and recording.
    pub record: [Instant; 2],
    /// The picture was finished.
    pub end: Instant,
}

/// A function that is called with every frame as it ends; `false` ends the run.
pub type OnFrame<'a> = dyn FnMut(FrameTimes, &mut Renderer) -> Result<bool> + 'a;

/// The parts of a packet that the times of its frame are made from.
pub(super) struct FrameStart {
    i_frame: u32,
    time_s: f64,
    begin: Instant,
    game_ms: f64,
    pub queue_depth: u32,
    n_drawn: u32,
}

impl FrameStart {
    /// Returns the start of `packet`'s frame.
    pub fn new(packet: &Packet) -> FrameStart {
        let Packet { i_frame, time_s, begin, game_ms, n_drawn, .. } = *packet;
        FrameStart { i_frame, time_s, begin, game_ms, queue_depth: 0, n_drawn }
    }

    /// Returns the times of a frame that ended at `end`, and replaces the end of the previous
    /// frame.
    pub fn end(self, done: Rendered, end: Instant, last_end: &mut Instant) -> FrameTimes {
        let game_end = self.begin + Duration::from_secs_f64(1e-3 * self.game_ms);
        FrameTimes {
            i_frame: self.i_frame,
            time_s: self.time_s,
            frame_ms: ms(std::mem::replace(last_end, end), end),
            game_ms: self.game_ms,
            record_ms: ms(done.recorded[0], done.recorded[1]),
            submit_ms: ms(done.recorded[1], done.submitted),
            wait_ms: done.wait_ms,
            latency_ms: ms(self.begin, end),
            queue_depth: self.queue_depth,
            n_drawn: self.n_drawn,
            n_kept: done.n_kept,
            marks: Marks { game: [self.begin, game_end], record: done.recorded, end },
            plan: done.plan,
            passes: done.passes,
        }
    }
}
