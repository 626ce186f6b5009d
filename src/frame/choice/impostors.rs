//! What `draw.impostors = "auto"` takes: the scene's first frames are drawn with and without, and
//! timed.

use crate::error::Result;
use crate::frame::game::Game;
use crate::frame::plan::Pass;
use crate::frame::render::Renderer;

/// Frames of the scene's that "auto" times with impostors and without; before them two in which all
/// is made ready.
const N_FRAMES: u32 = 16;

/// Whether impostors were the faster, and the mean times of sorting and drawing a frame, ms of
/// device time (of wall time without timestamps).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpostorChoice {
    pub on: bool,
    pub off_ms: f64,
    /// None where they do not fit this device.
    pub on_ms: Option<f64>,
}

impl ImpostorChoice {
    /// As users are told.
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
    /// Mean time of what sorts and draws the scene's first frames, ms. The next frame is like a
    /// first one.
    pub fn time_frames(&mut self, game: &mut Game) -> Result<f64> {
        const READY: u32 = 2;
        self.reset();
        let mut sum = 0.0;
        for i in 0..READY + N_FRAMES {
            let done = self.step(game.step(i)?)?;
            if i < READY {
                continue;
            }
            let of = [Pass::Sort, Pass::Surfaces, Pass::Impostors, Pass::Sprites, Pass::Tiles]
                .map(Pass::name);
            let timed: f64 =
                done.passes.iter().filter(|p| of.contains(&p.name)).map(|p| p.ms()).sum();
            sum += if done.passes.is_empty() { done.wait_ms } else { timed };
        }
        self.reset();
        Ok(sum / f64::from(N_FRAMES))
    }
}
