//! The values of a knob, drawn and timed one beside the other.

use std::time::Instant;

use super::knobs::Knob;
use super::rule::{Tried, rmse, still_open};
use crate::error::{Error, Result};
use crate::frame::buffers::kept;
use crate::frame::culling::{Culling, record_sort};
use crate::frame::drawing::Drawing;
use crate::frame::limits;
use crate::frame::ms;
use crate::frame::packet::Packet;
use crate::frame::readback::floats;
use crate::frame::render::Renderer;
use crate::frame::settings::Settings;
use crate::gpu::{Buffer, Compiler, Device, Recorder};
use crate::model::cutoff::Cutoff;
use crate::model::scene::{Cull, Draw, Scene};

/// Timed turns of each value; more of frames that are so short that all turns take less than
/// [`ENOUGH_MS`].
const LEAST_TURNS: usize = 3;
const MOST_TURNS: usize = 9;
const ENOUGH_MS: f64 = 300.0;

/// A frame that takes less depends on whose data the caches hold: it is drawn once more before it
/// is timed.
const SHORT_MS: f64 = 100.0;

/// What draws one way and waits for its turn.
struct Spare<K, T> {
    /// Of what is not here but in use.
    in_use: K,
    others: Vec<(K, T)>,
}

impl<K: PartialEq, T> Spare<K, T> {
    /// Changes what is in use for what `key` asks for, made where it is not here.
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

/// What keeps particles, and where their number is; none where all are drawn.
type Culls = (Option<Culling>, Option<Buffer>);

pub struct Trial<'a> {
    device: &'a Device,
    compiler: &'a Compiler,
    packet: &'a Packet,
    /// As it is drawn now.
    scene: Scene,
    /// `draw.error`.
    error: f64,
    drawings: Spare<Draw, Drawing>,
    cullings: Spare<(Cull, bool), Culls>,
}

/// What a drawing is made for; other numbers it is told.
fn key_of_drawing(draw: &Draw) -> Draw {
    let threshold = Cutoff::At(if draw.threshold.is_active() { 1.0 } else { 0.0 });
    Draw { threshold, smallest: Cutoff::NONE, cull: Cull::On, ..*draw }
}

fn key_of_culling(draw: &Draw) -> (Cull, bool) {
    (draw.cull, draw.threshold.is_active())
}

impl<'a> Trial<'a> {
    /// On a renderer of the scene with nothing chosen.
    pub fn new(
        device: &'a Device,
        compiler: &'a Compiler,
        scene: &Scene,
        packet: &'a Packet,
    ) -> Trial<'a> {
        let draw = scene.draw.exact();
        let drawings = Spare { in_use: key_of_drawing(&draw), others: Vec::new() };
        let cullings = Spare { in_use: key_of_culling(&draw), others: Vec::new() };
        let (error, scene) = (scene.draw.error, Scene { draw, ..scene.clone() });
        Trial { device, compiler, packet, scene, error, drawings, cullings }
    }

    /// What came of `knob`'s values, and their pictures; `exact`: the picture that they are
    /// compared with, the first one's where there is none.
    pub fn of(
        &mut self,
        renderer: &mut Renderer,
        knob: &Knob,
        values: &[Draw],
        exact: &mut Option<Vec<f32>>,
    ) -> Result<(Vec<Tried>, Vec<Vec<f32>>)> {
        let (mut tried, mut pictures, mut firsts_ms) = (Vec::new(), Vec::new(), Vec::new());
        for (i, draw) in values.iter().enumerate() {
            let (first_ms, picture) = match self.picture(renderer, draw) {
                Err(Error::Limit { .. }) => (f64::INFINITY, None),
                drawn => drawn.map(|(ms, picture)| (ms, Some(picture)))?,
            };
            let rmse = picture.as_ref().map(|p| rmse(p, exact.get_or_insert_with(|| p.clone())));
            let value = knob.told(draw, &values[0]);
            tried.push(Tried { value, is_first: i == 0, times_ms: Vec::new(), rmse });
            pictures.push(picture.unwrap_or_default());
            firsts_ms.push(first_ms);
        }
        let mut open: Vec<usize> = (0..tried.len()).filter(|i| tried[*i].rmse.is_some()).collect();
        let begin = Instant::now();
        for i_turn in 0..MOST_TURNS {
            for &i in &open {
                self.bring(renderer, &values[i])?;
                if firsts_ms[i] < SHORT_MS {
                    self.draw(renderer)?;
                }
                tried[i].times_ms.push(self.draw(renderer)?);
            }
            open = still_open(&tried, &open, |t| knob.allows(t, self.error));
            if open.len() < 2 || i_turn + 1 >= LEAST_TURNS && ms(begin, Instant::now()) > ENOUGH_MS
            {
                break;
            }
        }
        Ok((tried, pictures))
    }

    /// Draws by `draw` from now on, and gives back what others need.
    pub fn take(&mut self, renderer: &mut Renderer, draw: Draw) -> Result<()> {
        self.bring(renderer, &draw)?;
        self.drawings.others.clear();
        self.cullings.others.clear();
        Ok(())
    }

    /// The picture as `draw` has it, and its time, ms, in which a driver may have compiled
    /// something.
    fn picture(&mut self, renderer: &mut Renderer, draw: &Draw) -> Result<(f64, Vec<f32>)> {
        self.scene.draw = *draw;
        limits::check(&self.scene, self.device.limits())?;
        self.bring(renderer, draw)?;
        let first_ms = self.draw(renderer)?;
        let Renderer { host, drawing, readback, traits, settings, .. } = renderer;
        host.run(|rec| {
            drawing.record_read(rec, traits.path, drawing.i_picture(), readback);
            Ok(())
        })?;
        Ok((first_ms, floats(settings.format, readback.read(settings.n_bytes() as usize)?)))
    }

    fn bring(&mut self, renderer: &mut Renderer, draw: &Draw) -> Result<()> {
        self.scene.draw = *draw;
        let Trial { device, compiler, scene, .. } = self;
        let format = renderer.settings.format;
        let make = || Drawing::new(device, compiler, scene, format);
        self.drawings.bring(&mut renderer.drawing, key_of_drawing(draw), make)?;
        let make = || Ok((Culling::of_scene(device, compiler, scene)?, kept(device, scene)?));
        let mut now = (renderer.culling.take(), renderer.buffers.kept.take());
        let brought = self.cullings.bring(&mut now, key_of_culling(draw), make);
        (renderer.culling, renderer.buffers.kept) = now;
        renderer.settings = Settings::of(scene);
        renderer.traits = renderer.traits.drawn_by(scene);
        brought
    }

    /// Culls, sorts and draws with all that belongs to the picture, and gives the time, ms.
    fn draw(&self, renderer: &mut Renderer) -> Result<f64> {
        let Renderer { host, drawing, buffers: b, settings: s, culling, sort, traits, .. } =
            renderer;
        let begin = Instant::now();
        let draw = |rec: &mut Recorder<'_>| {
            if let Some(culling) = culling {
                culling.record(rec, b, (self.packet, drawing), s)?;
            }
            record_sort(rec, sort, b, self.packet, s)?;
            drawing.record_all(rec, traits.path, b, self.packet, s)
        };
        let scopes = host.run(|rec| rec.scope("draw", draw))?;
        Ok(scopes.first().map_or(ms(begin, Instant::now()), |scope| scope.ms()))
    }
}
