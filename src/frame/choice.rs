//! What `draw.path = "auto"` takes: the scene's first frame is drawn in both ways, and timed. And what `draw.impostors =
//! "auto"` takes: its first frames with and without.

use std::time::Instant;

use super::game::Game;
use super::ms;
use super::packet::Packet;
use super::plan::Pass;
use super::render::Renderer;
use crate::error::Result;
use crate::model::scene::DrawPath;

/// Timed turns of each way; before them one that is not, in which a driver may compile.
const N_TURNS: usize = 3;

/// Ways whose first timed turns are this many times apart need no second one.
const FAR_APART: f64 = 4.0;

/// The way that was the faster, and the medians of both, ms of device time (of wall time without timestamps).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    pub path: DrawPath,
    pub sprites_ms: f64,
    /// None where tiles cannot draw the scene on this device.
    pub tiles_ms: Option<f64>,
}

impl Choice {
    /// As users are told.
    pub fn text(&self) -> String {
        let sprites = format!("{:.2} ms of sprites", self.sprites_ms);
        match (self.path, self.tiles_ms) {
            (DrawPath::Tiles, Some(ms)) => {
                format!("draw.path = \"auto\" took \"tiles\": {ms:.2} ms against {sprites} at the first frame")
            }
            (_, Some(ms)) => {
                format!(
                    "draw.path = \"auto\" took \"sprites\": {sprites} against {ms:.2} ms of tiles at the first frame"
                )
            }
            (_, None) => {
                "draw.path = \"auto\" took \"sprites\": tiles cannot draw this scene on this device".to_owned()
            }
        }
    }
}

/// Frames of the scene's that "auto" times with impostors and without; before them two in which all is made ready.
const N_FRAMES: u32 = 16;

/// Whether impostors were the faster, and the mean times of sorting and drawing a frame, ms of device time (of wall time
/// without timestamps).
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
                "draw.impostors = \"auto\" took \"{took}\": {on:.2} ms a frame with, {off:.2} without over the first {N_FRAMES}"
            ),
            None => "draw.impostors = \"auto\" took \"off\": what they need does not fit this device".to_owned(),
        }
    }
}

impl Renderer {
    /// Mean time of what sorts and draws the scene's first frames, ms. The next frame is like a first one.
    pub fn time_frames(&mut self, game: &mut Game) -> Result<f64> {
        const READY: u32 = 2;
        self.reset();
        let mut sum = 0.0;
        for i in 0..READY + N_FRAMES {
            let done = self.step(game.step(i)?)?;
            if i < READY {
                continue;
            }
            let of = [Pass::Sort, Pass::Surfaces, Pass::Impostors, Pass::Sprites, Pass::Tiles].map(Pass::name);
            let timed: f64 = done.passes.iter().filter(|p| of.contains(&p.name)).map(|p| p.ms()).sum();
            sum += if done.passes.is_empty() { done.wait_ms } else { timed };
        }
        self.reset();
        Ok(sum / f64::from(N_FRAMES))
    }

    /// Draws `packet`'s frame in both ways, and from now on in the faster one. What the other needs is given back. The next
    /// frame is like a first one.
    pub fn choose_path(&mut self, packet: &Packet) -> Result<Choice> {
        self.step(packet.clone())?;
        let mut times = [vec![], vec![]];
        let has_tiles = self.drawing.has_tiles();
        for i in 0..=N_TURNS {
            for (k, path) in [DrawPath::Sprites, DrawPath::Tiles].into_iter().enumerate() {
                if path == DrawPath::Sprites || has_tiles {
                    let time = self.time_drawing(path, packet)?;
                    if i > 0 {
                        times[k].push(time);
                    }
                }
            }
            if let [[.., sprites], [.., tiles]] = times.each_ref().map(Vec::as_slice)
                && (*sprites > FAR_APART * tiles || *tiles > FAR_APART * sprites)
            {
                break;
            }
        }
        let [sprites_ms, tiles_ms] = times.map(|mut of| {
            of.sort_by(f64::total_cmp);
            of.get(of.len() / 2).copied()
        });
        let sprites_ms = sprites_ms.unwrap_or(f64::NAN);
        let path = if tiles_ms.is_some_and(|t| t < sprites_ms) { DrawPath::Tiles } else { DrawPath::Sprites };
        self.drawing.keep_only(path);
        self.traits.path = path;
        self.reset();
        Ok(Choice { path, sprites_ms, tiles_ms })
    }

    /// Draws what is sorted once more, ms.
    fn time_drawing(&mut self, path: DrawPath, packet: &Packet) -> Result<f64> {
        let Renderer { host, drawing, buffers, settings, .. } = self;
        let begin = Instant::now();
        let scopes =
            host.run(|rec| rec.scope("draw", |rec| drawing.record_over(rec, path, buffers, packet, settings)))?;
        Ok(scopes.first().map_or(ms(begin, Instant::now()), |scope| scope.ms()))
    }
}
