//! Game step and render step one after the other.

use std::time::Instant;

use super::game::Game;
use super::render::Renderer;
use super::{OnFrame, Started};
use crate::error::Result;

/// Runs `frames`; `on_frame` sees each as it ends.
pub fn run(
    game: &mut Game,
    renderer: &mut Renderer,
    frames: impl Iterator<Item = u32>,
    on_frame: &mut OnFrame<'_>,
) -> Result<()> {
    let mut last_end = Instant::now();
    for i_frame in frames {
        let packet = game.step(i_frame)?;
        let started = Started::of(&packet, 0);
        let done = renderer.step(packet)?;
        let times = started.ended(done, Instant::now(), &mut last_end);
        if !on_frame(times, renderer)? {
            break;
        }
    }
    Ok(())
}
