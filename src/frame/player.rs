//! A scene on a device, ready to run: its game and render side.

use std::sync::Arc;

use super::choice::{Choice, ImpostorChoice, LightChoice, choose_light};
use super::game::Game;
use super::renderer::Renderer;
use super::sides::open_sides;
use crate::error::{Error, Result};
use crate::gpu::{Compiler, Device};
use crate::model::scene::{Impostors, Scene};

/// A scene's buffers and pipelines on a device, and its game.
pub struct Player {
    /// The render side.
    pub renderer: Renderer,
    /// The game side.
    pub game: Game,
    /// The scene; in its `draw` and lighting nothing is "auto".
    pub scene: Arc<Scene>,
    /// The lighting that "auto" has taken.
    pub light_choice: Option<LightChoice>,
    /// The values that "auto" knobs of the scene's `draw` have taken.
    pub choices: Vec<Choice>,
    /// The choice of `draw.impostors`, if it is "auto".
    pub impostor_choice: Option<ImpostorChoice>,
}

impl Player {
    /// Makes everything that `scene` needs on a device, and chooses the values of "auto" knobs.
    /// With `skip`, frames skip passes whose input is unchanged.
    ///
    /// # Errors
    /// Fails if the scene exceeds a limit of the device or a shader does not compile.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        scene: Arc<Scene>,
        skip: bool,
    ) -> Result<Player> {
        // Frames of trials are none of the scene's.
        device.count_frames(false);
        let player = Player::with_choices(device, compiler, scene, skip);
        device.count_frames(true);
        player
    }

    fn with_choices(
        device: &Device,
        compiler: &Compiler,
        scene: Arc<Scene>,
        skip: bool,
    ) -> Result<Player> {
        let (scene, light_choice) = choose_light(device, compiler, scene)?;
        let player = match scene.draw.impostors {
            Impostors::Auto => with_faster_impostors(device, compiler, &scene, skip)?,
            _ => with_given_impostors(device, compiler, scene, skip)?,
        };
        Ok(Player { light_choice, ..player })
    }
}

/// Makes the player of a scene whose `draw.impostors` is not "auto".
fn with_given_impostors(
    device: &Device,
    compiler: &Compiler,
    mut scene: Arc<Scene>,
    skip: bool,
) -> Result<Player> {
    let (mut renderer, mut game) = open_sides(device, compiler, &scene, skip)?;
    let (draw, choices) = renderer.choose(device, compiler, &scene, &mut game)?;
    if draw != scene.draw {
        Arc::make_mut(&mut scene).draw = draw;
        game = game.with_scene(scene.clone());
    }
    let (light_choice, impostor_choice) = (None, None);
    Ok(Player { renderer, game, scene, light_choice, choices, impostor_choice })
}

/// Makes the player with or without impostors, whichever draws the first frames faster.
fn with_faster_impostors(
    device: &Device,
    compiler: &Compiler,
    scene: &Arc<Scene>,
    skip: bool,
) -> Result<Player> {
    let make = |scene: &Scene, impostors| {
        let mut scene = scene.clone();
        scene.draw.impostors = impostors;
        with_given_impostors(device, compiler, Arc::new(scene), skip)
    };
    let mut off = make(scene, Impostors::Off)?;
    if !skip {
        // Without skipping, no layer is shown again.
        return Ok(off);
    }
    let off_ms = off.renderer.time_frames(&mut off.game)?;
    // One player at a time, since both may not fit; the other choices stay.
    let Player { scene, choices, .. } = off;
    let made = make(&scene, Impostors::On).and_then(|mut on| {
        let ms = on.renderer.time_frames(&mut on.game)?;
        Ok((on, ms))
    });
    let (on, on_ms) = match made {
        Ok((on, ms)) => (Some(on), Some(ms)),
        // Impostors that do not fit are not used.
        Err(Error::Limit { .. }) => (None, None),
        Err(error) => return Err(error),
    };
    let chosen = ImpostorChoice { on: on_ms.is_some_and(|ms| ms < off_ms), off_ms, on_ms };
    let player = match on.filter(|_| chosen.on) {
        Some(on) => on,
        None => make(&scene, Impostors::Off)?,
    };
    Ok(Player { choices, impostor_choice: Some(chosen), ..player })
}
