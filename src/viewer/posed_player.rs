//! A scene on the device whose camera the window sets.

use std::sync::{Arc, Mutex};
use std::time::Instant;

use super::sync::lock;
use crate::error::Result;
use crate::frame::Player;
use crate::model::camera::Pose;

/// A scene on the device whose camera is set before each frame.
pub struct PosedPlayer {
    /// The scene on the device.
    pub player: Player,
    pose: Arc<Mutex<Pose>>,
}

impl PosedPlayer {
    /// Takes over `player`'s camera, which stands at `pose` first.
    pub fn new(player: Player, pose: Pose) -> PosedPlayer {
        let pose = Arc::new(Mutex::new(pose));
        let shared = pose.clone();
        let game = player.game.with_viewpoint(Box::new(move || *lock(&shared)));
        PosedPlayer { player: Player { game, ..player }, pose }
    }

    /// Draws a frame from `pose`. Returns how long the frame took, ms.
    ///
    /// # Errors
    /// The game step or the render step failed.
    pub fn step(&mut self, i_frame: u32, pose: Pose) -> Result<f64> {
        let begin = Instant::now();
        *lock(&self.pose) = pose;
        let packet = self.player.game.step(i_frame)?;
        self.player.renderer.step(packet)?;
        Ok(begin.elapsed().as_secs_f64() * 1e3)
    }
}
