//! One frame: `game::step` makes an owned [`packet::Packet`], [`render::Renderer::step`] draws it.
//! [`serial`] and [`parallel`] are two loops around these two; [`plan`] says what a frame can leave
//! out.

pub mod buffers;
pub mod choice;
pub mod chunks;
pub mod counts;
mod culling;
mod drawing;
mod drawn;
pub mod exchange;
pub mod feed;
pub mod game;
pub mod grouping;
mod impostors;
pub mod light_notes;
pub mod limits;
pub mod lives;
pub mod packet;
pub mod parallel;
pub mod plan;
mod readback;
pub mod relay;
pub mod render;
pub mod reshape;
mod scenery;
pub mod serial;
mod settings;
mod shells;
mod shrunk;
pub mod stage;
pub mod tensor;
pub mod tiling;

use std::time::{Duration, Instant};

use crate::error::Result;
use crate::gpu::ScopeTime;
use packet::Packet;
use plan::Plan;
use render::{Rendered, Renderer};

/// What one frame took. Times in ms.
#[derive(Debug, Clone)]
pub struct FrameTimes {
    pub i_frame: u32,
    pub time_s: f64,
    /// From the end of the frame before (of the loop's start, for the first) to this one's.
    pub frame_ms: f64,
    pub game_ms: f64,
    /// Uploading, planning and recording.
    pub record_ms: f64,
    /// Handing the commands to the driver.
    pub submit_ms: f64,
    /// From the end of the submission, or from the end of the frame before where that was later, to
    /// the frame's end.
    pub wait_ms: f64,
    /// From the start of the game step to the finished image.
    pub latency_ms: f64,
    /// Frames that the device still had when this one was handed to it; 0 where it had nothing to
    /// do.
    pub queue_depth: u32,
    /// Particles that were drawn: those of clouds in view, as many as `draw.count` asks for.
    pub n_drawn: u32,
    /// Those of them that can show in a pixel, where `draw.cull` is on.
    pub n_kept: Option<u32>,
    pub marks: Marks,
    pub plan: Plan,
    /// GPU time of every pass that ran; empty where the device has no timestamps.
    pub passes: Vec<ScopeTime>,
}

impl FrameTimes {
    /// Particles that the drawing pass was given.
    pub fn n_shown(&self) -> u32 {
        self.n_kept.unwrap_or(self.n_drawn)
    }

    /// Recording, submission and the wait for the device.
    pub fn render_ms(&self) -> f64 {
        self.record_ms + self.submit_ms + self.wait_ms
    }
}

/// When a frame's steps began and ended, on the host's clock.
#[derive(Debug, Clone, Copy)]
pub struct Marks {
    pub game: [Instant; 2],
    pub record: [Instant; 2],
    /// The picture was finished.
    pub end: Instant,
}

/// Told of every frame as it ends; `false` ends the loop after it.
pub type OnFrame<'a> = dyn FnMut(FrameTimes, &mut Renderer) -> Result<bool> + 'a;

/// What of a packet the times of its frame are made with.
struct Started {
    i_frame: u32,
    time_s: f64,
    begin: Instant,
    game_ms: f64,
    queue_depth: u32,
    n_drawn: u32,
}

impl Started {
    fn of(packet: &Packet, queue_depth: u32) -> Started {
        let Packet { i_frame, time_s, begin, game_ms, n_drawn, .. } = *packet;
        Started { i_frame, time_s, begin, game_ms, queue_depth, n_drawn }
    }

    /// The times of a frame whose picture was finished at `end`; `last_end` is that of the frame
    /// before.
    fn ended(self, done: Rendered, end: Instant, last_end: &mut Instant) -> FrameTimes {
        let frame_ms = ms(std::mem::replace(last_end, end), end);
        FrameTimes {
            i_frame: self.i_frame,
            time_s: self.time_s,
            frame_ms,
            game_ms: self.game_ms,
            record_ms: ms(done.recorded[0], done.recorded[1]),
            submit_ms: ms(done.recorded[1], done.submitted),
            wait_ms: done.wait_ms,
            latency_ms: ms(self.begin, end),
            queue_depth: self.queue_depth,
            n_drawn: self.n_drawn,
            n_kept: done.n_kept,
            marks: Marks {
                game: [self.begin, self.begin + Duration::from_secs_f64(1e-3 * self.game_ms)],
                record: done.recorded,
                end,
            },
            plan: done.plan,
            passes: done.passes,
        }
    }
}

fn ms(begin: Instant, end: Instant) -> f64 {
    end.saturating_duration_since(begin).as_secs_f64() * 1e3
}
