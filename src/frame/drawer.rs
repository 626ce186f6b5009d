//! Pictures of single frames, in any order of a run.

use std::sync::Arc;

use super::player::Player;
use super::stage::GpuContext;
use crate::error::Result;
use crate::model::backdrop::Backdrop;
use crate::model::scene::Scene;

/// Draws frames one after the other. A scene is made ready once for neighbouring frames.
pub struct FrameDrawer<'a> {
    gpu: &'a GpuContext,
    skip: bool,
    playing: Option<(Arc<Scene>, Player)>,
}

impl<'a> FrameDrawer<'a> {
    /// Draws on a device. With `skip`, frames skip passes whose input is unchanged.
    pub fn new(gpu: &'a GpuContext, skip: bool) -> FrameDrawer<'a> {
        FrameDrawer { gpu, skip, playing: None }
    }

    /// Draws a frame of `scene`. Returns premultiplied linear RGBA, rows from the top, and what is
    /// behind it.
    ///
    /// # Errors
    /// Fails if the scene exceeds a limit of the device, has no state at the frame's time, or the
    /// device is lost.
    pub fn draw(&mut self, scene: Scene, i_frame: u32) -> Result<(Vec<f32>, Backdrop)> {
        let (scene, player) = match self.playing.take() {
            Some((same, player)) if *same == scene => self.playing.insert((same, player)),
            previous => {
                // Frees the device's memory before the next scene allocates.
                drop(previous);
                let scene = Arc::new(scene);
                self.playing.insert((scene.clone(), self.gpu.player(scene, self.skip)?))
            }
        };
        let packet = player.game.step(i_frame)?;
        player.renderer.step(packet)?;
        Ok((player.renderer.image()?, Backdrop::of(scene, scene.time.at(i_frame))))
    }
}
