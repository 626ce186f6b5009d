//! Game step and render step side by side: a game thread one frame ahead, an owned packet a frame through a bounded
//! channel, and no lock that both take.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::sync_channel;
use std::time::Instant;

use super::game::Game;
use super::packet::Packet;
use super::render::Renderer;
use super::{OnFrame, render_timed};
use crate::error::{Error, Result};

/// Packets that may wait. 0 hands over from hand to hand: the game thread makes frame n + 1 while frame n is drawn, and
/// then waits, which is one frame ahead. More would only add latency.
const WAITING_PACKETS: usize = 0;

/// Runs `frames`; `on_frame` sees each as it ends. An error or panic on either side ends both.
pub fn run(game: &mut Game, renderer: &mut Renderer, frames: Range<u32>, on_frame: &mut OnFrame<'_>) -> Result<()> {
    let (send, receive) = sync_channel::<Result<Packet>>(WAITING_PACKETS);
    let n_ready = &AtomicU32::new(0);
    std::thread::scope(|scope| {
        let play = move || {
            for i_frame in frames {
                let packet = game.step(i_frame);
                let failed = packet.is_err();
                n_ready.fetch_add(1, Ordering::Relaxed);
                // The receiver is gone when the render side has ended: nothing is left to do.
                if send.send(packet).is_err() || failed {
                    return;
                }
            }
        };
        let named = std::thread::Builder::new().name("game".into()).spawn_scoped(scope, play);
        let player = named.map_err(|e| Error::vulkan("starting the game thread", e))?;
        let mut last_end = Instant::now();
        let mut draw = || -> Result<()> {
            loop {
                let depth = n_ready.load(Ordering::Relaxed);
                let Ok(packet) = receive.recv() else { return Ok(()) };
                n_ready.fetch_sub(1, Ordering::Relaxed);
                let times = render_timed(renderer, packet?, depth, &mut last_end)?;
                if !on_frame(times, renderer)? {
                    return Ok(());
                }
            }
        };
        let drawn = draw();
        // Ends a game thread that still has a packet to hand over.
        drop(receive);
        match player.join() {
            Ok(()) => drawn,
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}
