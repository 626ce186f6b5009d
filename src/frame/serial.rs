//! Game step and render step one after the other.

use std::time::Instant;

use super::game::Game;
use super::renderer::Renderer;
use super::times::{FrameStart, OnFrame};
use crate::error::Result;

/// Runs `frames` and calls `on_frame` with each as it ends.
///
/// # Errors
/// Fails if a step or `on_frame` fails.
pub fn run(
    game: &mut Game,
    renderer: &mut Renderer,
    frames: impl Iterator<Item = u32>,
    on_frame: &mut OnFrame<'_>,
) -> Result<()> {
    let mut last_end = Instant::now();
    for i_frame in frames {
        let packet = game.step(i_frame)?;
        let start = FrameStart::new(&packet);
        let done = renderer.step(packet)?;
        if !on_frame(start.end(done, Instant::now(), &mut last_end), renderer)? {
            break;
        }
    }
    Ok(())
}
