//! A trial of a knob: its candidates are drawn and timed in turns.

use std::time::Instant;

use super::knobs::Knob;
use super::rule::{Candidate, rmse, still_open};
use crate::error::{Error, Result};
use crate::frame::clock::ms;
use crate::frame::constants::FrameConstants;
use crate::frame::culling::Culling;
use crate::frame::features::SceneFeatures;
use crate::frame::limits;
use crate::frame::packet::Packet;
use crate::frame::picture::Picture;
use crate::frame::plan::{Pass, Plan};
use crate::frame::readback::floats;
use crate::frame::renderer::Renderer;
use crate::gpu::{Compiler, Device};
use crate::model::cutoff::Cutoff;
use crate::model::scene::{Cull, Draw, DrawPath, Scene};

/// Timed turns of each candidate; more if all turns together take less than [`ENOUGH_MS`].
const MIN_TURNS: usize = 3;
const MAX_TURNS: usize = 9;
const ENOUGH_MS: f64 = 300.0;

/// The time of a shorter frame depends on what the caches hold, so it is drawn once more before it
/// is timed.
const SHORT_MS: f64 = 100.0;

/// A resource of the renderer that depends on the candidate, and others of its kind.
struct Swap<K, T> {
    /// Key of the resource in use.
    in_use: K,
    others: Vec<(K, T)>,
}

impl<K: PartialEq, T> Swap<K, T> {
    fn new(in_use: K) -> Swap<K, T> {
        Swap { in_use, others: Vec::new() }
    }

    /// Replaces the resource in use by that of `key`, which `make` creates if it is missing.
    fn bring(&mut self, now: &mut T, key: K, make: impl FnOnce() -> Result<T>) -> Result<()> {
        if self.in_use == key {
            return Ok(());
        }
        let i = match self.others.iter().position(|(of, _)| *of == key) {
            Some(i) => i,
            None => {
                self.others.push((key, make()?));
                self.others.len() - 1
            }
        };
        let (of, other) = &mut self.others[i];
        std::mem::swap(of, &mut self.in_use);
        std::mem::swap(other, now);
        Ok(())
    }
}

/// The trial of a scene's knobs on its first frame.
pub struct Trial<'a> {
    device: &'a Device,
    compiler: &'a Compiler,
    packet: &'a Packet,
    /// The scene with the candidate that is drawn now.
    scene: Scene,
    /// `draw.error`.
    error: f64,
    pictures: Swap<Draw, Picture>,
    cullings: Swap<(Cull, bool), Option<Culling>>,
}

/// Returns the part of `draw` that a picture is made for; other numbers are push constants.
fn picture_key(draw: &Draw) -> Draw {
    let threshold = Cutoff::At(if draw.edge().has_threshold() { 1.0 } else { 0.0 });
    Draw { threshold, smallest: Cutoff::NONE, cull: Cull::On, ..*draw }
}

/// Returns the part of `draw` that the pass `cull` is made for.
fn culling_key(draw: &Draw) -> (Cull, bool) {
    (draw.cull, draw.edge().has_threshold())
}

impl<'a> Trial<'a> {
    /// Creates the trial on a renderer of the scene with nothing chosen.
    pub fn new(
        device: &'a Device,
        compiler: &'a Compiler,
        scene: &Scene,
        packet: &'a Packet,
    ) -> Trial<'a> {
        let draw = scene.draw.exact();
        let (pictures, cullings) = (Swap::new(picture_key(&draw)), Swap::new(culling_key(&draw)));
        let (error, scene) = (scene.draw.error, Scene { draw, ..scene.clone() });
        Trial { device, compiler, packet, scene, error, pictures, cullings }
    }

    /// Draws and times the candidates `values` of `knob`, and returns their results and pictures.
    /// `exact` is the picture that they are compared with; it becomes the first one's if missing.
    pub fn run(
        &mut self,
        renderer: &mut Renderer,
        knob: &Knob,
        values: &[Draw],
        exact: &mut Option<Vec<f32>>,
    ) -> Result<(Vec<Candidate>, Vec<Vec<f32>>)> {
        let (mut candidates, mut pictures, mut firsts_ms) = (Vec::new(), Vec::new(), Vec::new());
        for (i, draw) in values.iter().enumerate() {
            let (first_ms, picture) = match self.picture(renderer, draw) {
                Err(Error::Limit { .. }) => (f64::INFINITY, None),
                drawn => drawn.map(|(ms, picture)| (ms, Some(picture)))?,
            };
            let rmse = picture.as_ref().map(|p| rmse(p, exact.get_or_insert_with(|| p.clone())));
            let value = knob.label(draw, &values[0]);
            candidates.push(Candidate { value, is_first: i == 0, times_ms: Vec::new(), rmse });
            pictures.push(picture.unwrap_or_default());
            firsts_ms.push(first_ms);
        }
        let mut open: Vec<usize> =
            (0..candidates.len()).filter(|i| candidates[*i].rmse.is_some()).collect();
        let begin = Instant::now();
        for i_turn in 0..MAX_TURNS {
            for &i in &open {
                self.bring(renderer, &values[i])?;
                if firsts_ms[i] < SHORT_MS {
                    self.draw(renderer)?;
                }
                candidates[i].times_ms.push(self.draw(renderer)?);
            }
            open = still_open(&candidates, &open, |c| knob.allows(c, self.error));
            if open.len() < 2 || i_turn + 1 >= MIN_TURNS && ms(begin, Instant::now()) > ENOUGH_MS {
                break;
            }
        }
        Ok((candidates, pictures))
    }

    /// Makes the renderer draw by `draw` from now on, and frees the other candidates' resources.
    pub fn take(&mut self, renderer: &mut Renderer, draw: Draw) -> Result<()> {
        self.bring(renderer, &draw)?;
        self.pictures.others.clear();
        self.cullings.others.clear();
        Ok(())
    }

    /// Returns the picture drawn by `draw` and its time in ms, which may include compilation by the
    /// driver.
    fn picture(&mut self, renderer: &mut Renderer, draw: &Draw) -> Result<(f64, Vec<f32>)> {
        self.scene.draw = *draw;
        limits::check(&self.scene, self.device.limits())?;
        self.bring(renderer, draw)?;
        let first_ms = self.draw(renderer)?;
        let bytes = renderer.bytes_of_picture(renderer.passes.picture.i)?;
        Ok((first_ms, floats(renderer.passes.constants.format, bytes)))
    }

    /// Makes the renderer draw by `draw`.
    fn bring(&mut self, renderer: &mut Renderer, draw: &Draw) -> Result<()> {
        self.scene.draw = *draw;
        let Trial { device, compiler, scene, .. } = self;
        let passes = &mut renderer.passes;
        let make = || Picture::new(device, compiler, scene);
        self.pictures.bring(&mut passes.picture, picture_key(draw), make)?;
        let make = || Culling::new(device, compiler, scene);
        self.cullings.bring(&mut passes.culling, culling_key(draw), make)?;
        passes.constants = FrameConstants::new(scene);
        passes.features = SceneFeatures::new(scene, passes.features.tensors);
        Ok(())
    }

    /// Culls, sorts and draws the frame, and returns the time in ms.
    fn draw(&self, renderer: &mut Renderer) -> Result<f64> {
        let Renderer { host, passes, .. } = renderer;
        let begin = Instant::now();
        let draws_by = match passes.features.path {
            DrawPath::Tiles => Pass::Tiles,
            _ => Pass::Sprites,
        };
        let plan = Plan::running(|pass| {
            let others = [Pass::Cull, Pass::Sort, Pass::Surfaces, Pass::Terrain, Pass::Upsample];
            pass == draws_by || others.contains(&pass)
        });
        let scopes = host
            .run(|rec| rec.scope("draw", |rec| passes.record_picture(rec, self.packet, &plan)))?;
        let whole = scopes.iter().find(|scope| scope.name == "draw");
        Ok(whole.map_or(ms(begin, Instant::now()), |scope| scope.ms()))
    }
}
