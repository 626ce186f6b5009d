//! Draws and times configurations on a device.

use std::sync::Arc;
use std::time::Instant;

use super::blocks::TimedBlock;
use super::study::Runner;
use crate::error::{Error, Result};
use crate::frame::{GpuContext, Player, limits};
use crate::layout::facet::LitRecord;
use crate::model::scene::Scene;

/// The frames that are drawn and timed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameChoice {
    /// The frame whose picture is compared, and the first that is timed.
    pub i_frame: u32,
    /// Its time in seconds.
    pub time_s: f64,
    /// Timed frames of a block.
    pub n_frames: u32,
    /// Whether frames skip the work that the scene lets them skip; else everything moves in each.
    pub as_played: bool,
}

/// Warm-up frames of a block: one for the driver and its caches.
const N_WARM: u32 = 1;
/// Warm-up frames of the first block after a renderer was created.
const N_WARM_NEW: u32 = 3;
/// Share of the device's memory that the cached renderers may take.
const MEMORY_SHARE: f64 = 0.25;

/// Most renderers that are cached. On a software device the compiled pipelines of each take some
/// 35 MiB of the host's memory.
const MOST_CACHED: usize = 32;

/// Returns the number of frames that a configuration is drawn in: its picture, and its blocks with
/// their warm-up.
pub fn n_frames_drawn(n_rounds: u32, n_frames: u32) -> u32 {
    1 + N_WARM_NEW - N_WARM + n_rounds * (N_WARM + n_frames)
}

/// Draws and times configurations on a device. A renderer is created when its configuration is
/// first used, and cached as long as memory suffices.
pub struct DeviceRunner<'a> {
    gpu: &'a GpuContext,
    scenes: Vec<Arc<Scene>>,
    frames: FrameChoice,
    /// The least recently used first.
    cache: Vec<Cached>,
}

struct Cached {
    i: usize,
    player: Player,
    n_bytes: u64,
}

impl<'a> DeviceRunner<'a> {
    /// Returns a runner without configurations.
    pub fn new(gpu: &'a GpuContext, frames: FrameChoice) -> DeviceRunner<'a> {
        DeviceRunner { gpu, scenes: Vec::new(), frames, cache: Vec::new() }
    }

    /// Returns the renderer of configuration `i`, and whether it was created now.
    fn player(&mut self, i: usize) -> Result<(&mut Player, bool)> {
        let at = self.cache.iter().position(|cached| cached.i == i);
        let cached = match at {
            Some(at) => self.cache.remove(at),
            None => self.create(i)?,
        };
        self.cache.push(cached);
        let last = self.cache.last_mut().ok_or_else(|| Error::usage("no renderer is cached"))?;
        Ok((&mut last.player, at.is_none()))
    }

    fn create(&mut self, i: usize) -> Result<Cached> {
        let limits = self.gpu.device.limits();
        let n_bytes = limits::check(&self.scenes[i], limits)?;
        let most = (MEMORY_SHARE * limits.device_memory_bytes as f64) as u64;
        while !self.cache.is_empty()
            && (self.cache.len() >= MOST_CACHED
                || self.cache.iter().map(|c| c.n_bytes).sum::<u64>() + n_bytes > most)
        {
            self.cache.remove(0);
        }
        let mut player = self.gpu.player(self.scenes[i].clone(), true)?;
        // The settings that "auto" chose hold for all blocks.
        self.scenes[i] = player.scene.clone();
        if !self.frames.as_played {
            player.renderer.move_all();
        }
        Ok(Cached { i, player, n_bytes })
    }

    /// Returns the light on the facets of configuration `i`, whose picture was drawn last.
    ///
    /// # Errors
    /// Fails if a Vulkan call fails.
    pub fn lit(&mut self, i: usize) -> Result<Vec<LitRecord>> {
        let gpu = self.gpu;
        Ok(self.player(i)?.0.renderer.facets(&gpu.device)?.1)
    }
}

impl Runner for DeviceRunner<'_> {
    fn add(&mut self, scene: &Arc<Scene>) {
        self.scenes.push(scene.clone());
    }

    fn picture(&mut self, i: usize) -> Result<Vec<f32>> {
        let FrameChoice { i_frame, time_s, .. } = self.frames;
        let (player, _) = self.player(i)?;
        player.renderer.reset();
        let packet = player.game.step_at(i_frame, time_s)?;
        player.renderer.step(packet)?;
        player.renderer.image()
    }

    fn block(&mut self, i: usize, i_round: usize) -> Result<TimedBlock> {
        let frames = self.frames;
        let has_timestamps = self.gpu.device.limits().timestamp_valid_bits > 0;
        let (player, is_new) = self.player(i)?;
        player.renderer.reset();
        let n_warm = if is_new { N_WARM_NEW } else { N_WARM };
        let mut block = TimedBlock::new(i, i_round);
        for k in 0..n_warm + frames.n_frames {
            // Every block times the same frames; time runs backwards in the warm-up.
            let i_frame = frames.i_frame.saturating_add(k.abs_diff(n_warm));
            let begin = Instant::now();
            let packet = player.game.step(i_frame)?;
            let done = player.renderer.step(packet)?;
            let frame_ms = begin.elapsed().as_secs_f64() * 1e3;
            if k < n_warm {
                continue;
            }
            block.frame_ms.push(frame_ms);
            if has_timestamps {
                // The sum of nothing is -0.
                block.gpu_ms.push(done.passes.iter().map(|pass| pass.ms()).sum::<f64>() + 0.0);
            }
        }
        Ok(block)
    }
}
