//! The choice of "auto" lighting, and of "auto" knobs of a scene's `draw`. The scene's first frame
//! is drawn with each candidate value, timed, and compared with the exact picture. A further knob
//! is a row in [`knobs::KNOBS`].

mod impostors;
mod knobs;
mod light;
mod rule;
mod trial;

pub use impostors::ImpostorChoice;
#[cfg(test)]
pub use knobs::tests::ASKED;
pub use knobs::toml_name;
pub use light::LightChoice;
pub(super) use light::choose_light;
pub use rule::{Candidate, Choice};

use super::game::Game;
use super::renderer::Renderer;
use crate::error::Result;
use crate::gpu::{Compiler, Device};
use crate::model::scene::{Draw, Scene};
use knobs::{Changes, KNOBS, Knob};
use trial::Trial;

/// Returns what "auto" settings have taken as sentences for users.
pub fn chosen_texts(
    light: Option<LightChoice>,
    choices: &[Choice],
    impostors: Option<ImpostorChoice>,
) -> Vec<String> {
    let (light, impostors) = (light.map(|c| c.text()), impostors.map(|c| c.text()));
    light.into_iter().chain(choices.iter().map(Choice::text)).chain(impostors).collect()
}

impl Renderer {
    /// Chooses a value for every "auto" knob of `scene`, which `game` plays, and returns the chosen
    /// `draw` with the candidates.
    ///
    /// Knobs are settled one after the other, each with the values of those before. All errors are
    /// measured against one exact picture, so that the error of all knobs together stays within
    /// `draw.error`. The next frame is like a first one.
    ///
    /// # Errors
    /// Fails if a frame cannot be drawn, other than by exceeding a limit of the device.
    pub(super) fn choose(
        &mut self,
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        game: &mut Game,
    ) -> Result<(Draw, Vec<Choice>)> {
        let mut draw = scene.draw.exact();
        let knobs: Vec<&Knob> = KNOBS.iter().filter(|knob| (knob.is_auto)(&scene.draw)).collect();
        if knobs.is_empty() || scene.n_particles() == 0 {
            return Ok((draw, Vec::new()));
        }
        let (mut choices, mut exact) = (Vec::new(), None);
        let packet = game.step(0)?;
        self.step(packet.clone())?;
        let mut trial = Trial::new(device, compiler, scene, &packet);
        for knob in knobs {
            let values = (knob.values)(&draw);
            if values.len() < 2 {
                continue;
            }
            if knob.changes == Changes::Model {
                exact = None;
            }
            let (candidates, mut pictures) = trial.run(self, knob, &values, &mut exact)?;
            let taken = rule::fastest(&candidates, |c| knob.allows(c, scene.draw.error));
            if knob.changes == Changes::Rounding {
                exact = Some(pictures.swap_remove(taken));
            }
            draw = values[taken];
            trial.take(self, draw)?;
            let changes_picture = matches!(knob.changes, Changes::Picture | Changes::Model);
            let error = changes_picture.then_some(scene.draw.error);
            choices.push(Choice { key: knob.key, taken, candidates, error });
        }
        self.reset();
        Ok((draw, choices))
    }
}
