//! The choice of `draw.impostors = "auto"`: the scene's first frames are drawn with and without
//! impostors, and timed.

use crate::error::Result;
use crate::frame::game::Game;
use crate::frame::plan::Pass;
use crate::frame::renderer::Renderer;

/// Frames that are timed with and without impostors.
const N_FRAMES: u32 = 16;
/// Frames before them, in which pipelines are made ready.
const N_WARM_UP: u32 = 2;

/// Whether impostors are faster, with the mean times of sorting and drawing a frame: device time in
/// ms, or wall time without timestamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpostorChoice {
    /// Impostors are used.
    pub on: bool,
    /// Mean time without impostors.
    pub off_ms: f64,
    /// Mean time with impostors; `None` if they do not fit the device.
    pub on_ms: Option<f64>,
}

impl ImpostorChoice {
    /// Returns the choice as a sentence for users.
    pub fn text(&self) -> String {
        let (took, off) = (if self.on { "on" } else { "off" }, self.off_ms);
        match self.on_ms {
            Some(on) => format!(
                "draw.impostors = \"auto\" took \"{took}\": {on:.2} ms a frame with, {off:.2} \
                 without over the first {N_FRAMES}"
            ),
            None => {
                "draw.impostors = \"auto\" took \"off\": what they need does not fit this device"
                    .to_owned()
            }
        }
    }
}

impl Renderer {
    /// Returns the mean time of sorting and drawing the scene's first frames, in ms. The next frame
    /// is like a first one.
    ///
    /// # Errors
    /// Fails if a frame cannot be drawn.
    pub(in crate::frame) fn time_frames(&mut self, game: &mut Game) -> Result<f64> {
        let timed = [Pass::Sort, Pass::Surfaces, Pass::Impostors, Pass::Sprites, Pass::Tiles]
            .map(Pass::name);
        self.reset();
        let mut sum = 0.0;
        for i in 0..N_WARM_UP + N_FRAMES {
            let done = self.step(game.step(i)?)?;
            if i < N_WARM_UP {
                continue;
            }
            let times = done.passes.iter().filter(|p| timed.contains(&p.name)).map(|p| p.ms());
            sum += if done.passes.is_empty() { done.wait_ms } else { times.sum() };
        }
        self.reset();
        Ok(sum / f64::from(N_FRAMES))
    }
}
