//! The configurations on a device: made ready when their turn comes, and kept as long as they fit
//! side by side.

use std::sync::Arc;
use std::time::Instant;

use super::run::Subject;
use super::turns::Turn;
use crate::error::{Error, Result};
use crate::frame::limits;
use crate::frame::{GpuContext, Player};
use crate::layout::facet::LitRecord;
use crate::model::scene::Scene;

/// How frames are timed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frames {
    /// The one whose picture is compared, and the first that is timed.
    pub i_frame: u32,
    pub time_s: f64,
    /// Timed frames of a turn.
    pub n_frames: u32,
    /// Frames leave out what the scene lets them leave out; else everything that can move is done
    /// anew in each.
    pub as_played: bool,
}

/// Untimed frames before a turn's: one that a driver and its caches warm up in, and two more of
/// what was just made.
const N_WARM: u32 = 1;
const N_WARM_NEW: u32 = 3;
/// Share of the device's memory that what is kept may take.
const MEMORY_SHARE: f64 = 0.25;

/// Frames that a configuration is drawn in: its picture, and its turns with what leads up to them.
pub fn frames_of_turns(n_rounds: u32, n_frames: u32) -> u32 {
    1 + N_WARM_NEW - N_WARM + n_rounds * (N_WARM + n_frames)
}

pub struct Players<'a> {
    bed: &'a GpuContext,
    scenes: Vec<Arc<Scene>>,
    frames: Frames,
    kept: Vec<Kept>,
}

struct Kept {
    i: usize,
    player: Player,
    n_bytes: u64,
}

impl<'a> Players<'a> {
    pub fn new(bed: &'a GpuContext, frames: Frames) -> Players<'a> {
        Players { bed, scenes: Vec::new(), frames, kept: Vec::new() }
    }

    /// The player of configuration `i`, and whether it was just made.
    fn player(&mut self, i: usize) -> Result<(&mut Player, bool)> {
        let at = self.kept.iter().position(|kept| kept.i == i);
        let is_new = at.is_none();
        // The one used last is last.
        let kept = match at {
            Some(at) => self.kept.remove(at),
            None => {
                let scene = &self.scenes[i];
                let limits = self.bed.device.limits();
                let n_bytes = limits::check(scene, limits)?;
                let most = (MEMORY_SHARE * limits.device_memory_bytes as f64) as u64;
                while !self.kept.is_empty()
                    && self.kept.iter().map(|k| k.n_bytes).sum::<u64>() + n_bytes > most
                {
                    self.kept.remove(0);
                }
                let mut player = self.bed.player(scene.clone(), true)?;
                // What "auto" took holds for all turns.
                self.scenes[i] = player.scene.clone();
                if !self.frames.as_played {
                    player.renderer.move_all();
                }
                Kept { i, player, n_bytes }
            }
        };
        self.kept.push(kept);
        let last = self.kept.last_mut().ok_or_else(|| Error::usage("nothing is kept"))?;
        Ok((&mut last.player, is_new))
    }
}

impl Players<'_> {
    /// The light on the facets of configuration `i`, whose picture was drawn last.
    pub fn lit(&mut self, i: usize) -> Result<Vec<LitRecord>> {
        let bed = self.bed;
        Ok(self.player(i)?.0.renderer.facets(&bed.device)?.1)
    }
}

impl Subject for Players<'_> {
    fn add(&mut self, scene: &Arc<Scene>) {
        self.scenes.push(scene.clone());
    }

    fn picture(&mut self, i: usize) -> Result<Vec<f32>> {
        let Frames { i_frame, time_s, .. } = self.frames;
        let (player, _) = self.player(i)?;
        player.renderer.reset();
        let packet = player.game.step_at(i_frame, time_s)?;
        player.renderer.step(packet)?;
        player.renderer.image()
    }

    fn turn(&mut self, i: usize, i_round: usize) -> Result<Turn> {
        let frames = self.frames;
        let has_timestamps = self.bed.device.limits().timestamp_valid_bits > 0;
        let (player, is_new) = self.player(i)?;
        player.renderer.reset();
        let n_warm = if is_new { N_WARM_NEW } else { N_WARM };
        let mut turn =
            Turn { i_configuration: i, i_round, gpu_ms: Vec::new(), frame_ms: Vec::new() };
        for k in 0..n_warm + frames.n_frames {
            // The same frames in every turn, whatever came before them; what leads up to them runs
            // backwards in time.
            let i_frame = frames.i_frame.saturating_add(k.abs_diff(n_warm));
            let begin = Instant::now();
            let packet = player.game.step(i_frame)?;
            let done = player.renderer.step(packet)?;
            let frame_ms = begin.elapsed().as_secs_f64() * 1e3;
            if k < n_warm {
                continue;
            }
            turn.frame_ms.push(frame_ms);
            if has_timestamps {
                turn.gpu_ms.push(done.passes.iter().map(|pass| pass.ms()).sum::<f64>() + 0.0);
            }
        }
        Ok(turn)
    }
}
