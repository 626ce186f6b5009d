//! The render and the game side of a scene.

use std::sync::Arc;

use super::game::Game;
use super::renderer::Renderer;
use crate::error::Result;
use crate::gpu::{Compiler, Device};
use crate::model::scene::{Scene, Simulate};

/// Makes both sides of a scene in which nothing is "auto". With `skip`, frames skip passes whose
/// input is unchanged.
///
/// # Errors
/// Fails if the scene exceeds a limit of the device or a shader does not compile.
pub fn open_sides(
    device: &Device,
    compiler: &Compiler,
    scene: &Arc<Scene>,
    skip: bool,
) -> Result<(Renderer, Game)> {
    let mut renderer = Renderer::new(device, compiler, scene, skip)?;
    let rest = match scene.threads.simulate {
        Simulate::Gpu => None,
        Simulate::Cpu => Some(renderer.generate_now(device)?.0),
    };
    Ok((renderer, Game::new(scene.clone(), rest).with_culling(skip)))
}
