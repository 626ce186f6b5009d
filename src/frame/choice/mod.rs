//! What "auto" takes of the knobs of a drawing: the scene's first frame is drawn with each value
//! that may be taken, timed, and compared with the exact picture. A further knob is a line in
//! [`knobs`].

pub mod impostors;
mod knobs;
pub use knobs::named;
mod rule;
mod trial;

use super::game::Game;
use super::render::Renderer;
use crate::error::Result;
use crate::gpu::{Compiler, Device};
use crate::model::scene::{Draw, Scene};
use knobs::{Changes, KNOBS, Knob};
pub use rule::{Choice, Tried};
use trial::Trial;

impl Renderer {
    /// Settles every "auto" of `scene`, which `game` plays, one knob after the other, each with
    /// what was taken before in force; all errors are by the one exact picture, so that those of
    /// all knobs together stay within `draw.error`. What is drawn by from now on, and what was
    /// tried. The next frame is like a first one.
    pub fn choose(
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
            let (tried, mut pictures) = trial.of(self, knob, &values, &mut exact)?;
            let taken = rule::taken(&tried, |t| knob.allows(t, scene.draw.error));
            if knob.changes == Changes::Rounding {
                exact = Some(pictures.swap_remove(taken));
            }
            draw = values[taken];
            trial.take(self, draw)?;
            let error = (knob.changes == Changes::Picture).then_some(scene.draw.error);
            choices.push(Choice { key: knob.key, taken, tried, error });
        }
        self.reset();
        Ok((draw, choices))
    }
}
