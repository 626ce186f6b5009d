//! One frame: `game::step` makes an owned [`packet::Packet`], [`render::Renderer::step`] draws it. [`serial`] and
//! [`parallel`] are two loops around these two; [`plan`] says what a frame can leave out.

pub mod buffers;
pub mod exchange;
pub mod game;
pub mod grouping;
pub mod limits;
pub mod packet;
pub mod parallel;
pub mod plan;
pub mod relay;
pub mod render;
pub mod serial;
pub mod tensor;

use std::time::Instant;

use crate::error::Result;
use crate::gpu::ScopeTime;
use packet::Packet;
use plan::Plan;
use render::Renderer;

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
    /// Submitting, and waiting for the GPU.
    pub submit_wait_ms: f64,
    /// From the start of the game step to the finished image.
    pub latency_ms: f64,
    /// Packets that were ready when the render step asked for one; 0 where it had to wait for the game step.
    pub queue_depth: u32,
    pub plan: Plan,
    /// GPU time of every pass that ran; empty where the device has no timestamps.
    pub passes: Vec<ScopeTime>,
}

/// Told of every frame as it ends; `false` ends the loop after it.
pub type OnFrame<'a> = dyn FnMut(FrameTimes, &mut Renderer) -> Result<bool> + 'a;

/// Draws `packet` and puts the times together; `last_end` is the end of the frame before.
fn render_timed(
    renderer: &mut Renderer,
    packet: Packet,
    queue_depth: u32,
    last_end: &mut Instant,
) -> Result<FrameTimes> {
    let (i_frame, time_s, begin, game_ms) = (packet.i_frame, packet.time_s, packet.begin, packet.game_ms);
    let done = renderer.step(packet)?;
    let end = Instant::now();
    let frame_ms = ms(*last_end, end);
    *last_end = end;
    Ok(FrameTimes {
        i_frame,
        time_s,
        frame_ms,
        game_ms,
        record_ms: done.record_ms,
        submit_wait_ms: done.submit_wait_ms,
        latency_ms: ms(begin, end),
        queue_depth,
        plan: done.plan,
        passes: done.passes,
    })
}

fn ms(begin: Instant, end: Instant) -> f64 {
    end.saturating_duration_since(begin).as_secs_f64() * 1e3
}
