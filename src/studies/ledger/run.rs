//! The pictures of a ledger, from the one that is drawn down to the whole model, each compared with
//! the next; and the times of those that the device draws, in turn.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;

use super::records::{Ledger, Row};
use super::steps::{Step, steps, ungrouped};
use crate::error::{Error, Result};
use crate::frame::GpuContext;
use crate::measure::bootstrap::Bootstrap;
use crate::measure::stats::median;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::picture::{
    BlobModel, FrameReference, ModelDrawing, OnProgress, PixelSample, Pixels, ReferenceKind,
    RenderStage, RenderedPixels, n_reflections, render_lit_scene, render_model,
};
use crate::studies::error::errors::{RESOLVED, picture_error};
use crate::studies::error::players::{Frames, Players};
use crate::studies::error::run::Subject;
use crate::studies::error::turns::Turn;
use crate::studies::provenance::{Figure, Provenance};

/// What a ledger is made of and how.
pub struct Setup<'a> {
    pub bed: &'a GpuContext,
    /// Nothing in it is "auto".
    pub scene: &'a Scene,
    pub frames: Frames,
    pub n_rounds: usize,
    pub pixels: &'a Pixels,
    /// Reflections of the last row.
    pub n_reflections: u32,
    pub stop: &'a AtomicBool,
}

/// One of the pictures: what it is called, and what of it is off.
struct Shown {
    rgba: Vec<[f64; 4]>,
    own_error: f64,
}

/// What stands between two pictures that follow each other.
struct Between {
    name: String,
    from: String,
    to: String,
    /// Both are drawn by the device, by players `i` and `i + 1`.
    on_device: bool,
}

/// Pictures and what is between them.
struct Chain {
    pictures: Vec<Shown>,
    between: Vec<Between>,
}

impl Chain {
    fn add(&mut self, name: &str, [from, to]: [String; 2], on_device: bool, drawn: Shown) {
        self.between.push(Between { name: name.to_owned(), from, to, on_device });
        self.pictures.push(drawn);
    }
}

impl Setup<'_> {
    /// The ledger so far as it came.
    pub fn run(&self, made: Provenance, listener: OnProgress) -> Result<Ledger> {
        let on_device = self.device_steps();
        let mut players = Players::new(self.bed, self.frames);
        let scenes: Vec<Arc<Scene>> = std::iter::once(self.scene.clone())
            .chain(on_device.iter().map(|step| step.without.clone()))
            .map(Arc::new)
            .collect();
        scenes.iter().for_each(|scene| players.add(scene));
        let mut chain = Chain { pictures: Vec::new(), between: Vec::new() };
        for (i, scene) in scenes.iter().enumerate() {
            let picture = Shown { rgba: self.picked(&players.picture(i)?), own_error: 0.0 };
            match i.checked_sub(1).map(|i| &on_device[i]) {
                None => chain.pictures.push(picture),
                Some(Step { name, from, to, .. }) => {
                    chain.add(name, [from.clone(), to.clone()], true, picture)
                }
            }
            if i + 1 == scenes.len() {
                self.references(&mut players, i, scene, &mut chain, listener)?;
            }
        }
        let turns = self.turns(&mut players, scenes.len())?;
        self.sum_up(made, &chain, &turns)
    }

    fn device_steps(&self) -> Vec<Step> {
        let mut all = steps(self.scene);
        let last = all.last().map_or(self.scene, |step| &step.without);
        let groups = ungrouped(last);
        all.extend(groups);
        all
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn picked(&self, rgba: &[f32]) -> Vec<[f64; 4]> {
        let whole: Vec<[f64; 4]> =
            rgba.chunks_exact(4).map(|p| [0, 1, 2, 3].map(|k| f64::from(p[k]))).collect();
        self.pixels.pick(&whole)
    }

    /// The pictures in f64, below the one that player `i` drew of `scene`, which nothing but what
    /// follows makes inexact.
    fn references(
        &self,
        players: &mut Players<'_>,
        i: usize,
        scene: &Scene,
        chain: &mut Chain,
        listener: OnProgress,
    ) -> Result<()> {
        let (time_s, pixels) = (self.frames.time_s, self.pixels);
        let scene = &ReferenceKind::without_approximations(scene);
        let truth =
            FrameReference::with_progress(scene, time_s, &|n| listener(RenderStage::Lighting, n))?;
        let is_lit = scene.lighting.mode != LightingMode::None;
        let mut by_device = truth.clone();
        if is_lit {
            let lit = players.lit(i)?;
            by_device.radiance = lit.iter().map(|l| DVec3::from(l.first.map(f64::from))).collect();
            by_device.second = lit.iter().map(|l| DVec3::from(l.second.map(f64::from))).collect();
            // As it is, it is exact: what it should be is told by the rows below.
            by_device.second_error = Vec::new();
        }
        let draw = |truth: &FrameReference, drawing: BlobModel| {
            Shown::of(render_lit_scene(
                scene,
                truth,
                drawing,
                pixels,
                PixelSample::CENTER,
                listener,
            ))
        };
        chain.add("drawing", words("f32", "f64"), false, draw(&by_device, BlobModel::Thin));
        if self.is_stopped() {
            return Ok(());
        }
        if scene.n_particles() > 0 {
            chain.add(
                "thin sprites",
                words("sprites", "volume"),
                false,
                draw(&by_device, BlobModel::Volume),
            );
        }
        if !is_lit || self.is_stopped() {
            return Ok(());
        }
        self.light(scene, &truth, &by_device, chain, listener)
    }

    /// The pictures that differ in light alone, from the device's, which `by_device` has, to that
    /// of more reflections.
    fn light(
        &self,
        scene: &Scene,
        truth: &FrameReference,
        by_device: &FrameReference,
        chain: &mut Chain,
        listener: OnProgress,
    ) -> Result<()> {
        let (time_s, pixels) = (self.frames.time_s, self.pixels);
        let draw = |truth: &FrameReference| {
            Shown::of(render_lit_scene(
                scene,
                truth,
                BlobModel::Volume,
                pixels,
                PixelSample::CENTER,
                listener,
            ))
        };
        let first = FrameReference {
            second: by_device.second.clone(),
            second_error: Vec::new(),
            ..truth.clone()
        };
        // The reference of surfaces' light knows no density grid.
        let on_both = scene.n_particles() > 0 && !scene.surfaces.is_empty();
        let of_first = if on_both {
            words("f32, grid", "f64, closed form on surfaces")
        } else {
            words("f32", "f64")
        };
        chain.add("first reflection", of_first, false, draw(&first));
        if n_reflections(scene) > 1 {
            chain.add(
                "second reflection",
                words("pairs in f32", "areas in f64"),
                false,
                draw(truth),
            );
        }
        let k = n_reflections(scene);
        let mut model =
            |name: &str, [from, to]: [String; 2], by_facet: bool, n: u32| -> Result<()> {
                if !self.is_stopped() {
                    let how = ModelDrawing { n_reflections: n, by_facet };
                    let drawn = render_model(how, scene, time_s, pixels, listener)?;
                    chain.add(name, [from, to], false, Shown::of(drawn));
                }
                Ok(())
            };
        if scene.n_particles() > 0 {
            model("density grid", words("grid and march", "closed form"), true, k)?;
        }
        if !scene.surfaces.is_empty() {
            model("facets of surfaces", words("between facets", "every pixel"), false, k)?;
        }
        if self.n_reflections > k {
            model(
                "reflections",
                [k.to_string(), self.n_reflections.to_string()],
                false,
                self.n_reflections,
            )?;
        }
        Ok(())
    }

    /// Rounds in which every player has a turn, there and back.
    fn turns(&self, players: &mut Players<'_>, n: usize) -> Result<Vec<Vec<Turn>>> {
        let mut rounds = Vec::new();
        for i_round in 0..if n > 1 { self.n_rounds } else { 0 } {
            if self.is_stopped() {
                break;
            }
            let mut order: Vec<usize> = (0..n).collect();
            if i_round % 2 == 1 {
                order.reverse();
            }
            let mut turns = order
                .into_iter()
                .map(|i| players.turn(i, i_round))
                .collect::<Result<Vec<Turn>>>()?;
            turns.sort_by_key(|turn| turn.i_configuration);
            rounds.push(turns);
        }
        Ok(rounds)
    }

    fn sum_up(&self, made: Provenance, chain: &Chain, rounds: &[Vec<Turn>]) -> Result<Ledger> {
        let nothing = Figure { value: 0.0, low: None, high: None };
        let compare = |a: &Shown, b: &Shown| {
            let own_error = a.own_error + b.own_error;
            let found = picture_error(self.pixels, &a.rgba, &b.rgba, own_error);
            let what = "a picture of the scene holds values that are no finite numbers";
            found.map(|error| (error.rmse, own_error)).ok_or_else(|| Error::usage(what))
        };
        let (Some(first), Some(last)) = (chain.pictures.first(), chain.pictures.last()) else {
            return Ok(self.empty(made, nothing));
        };
        let squares: f64 = last.rgba.iter().flatten().map(|v| v * v).sum();
        let magnitude = (squares / (4 * last.rgba.len()).max(1) as f64).sqrt();
        let pairs = chain.pictures.windows(2).map(|pair| compare(&pair[0], &pair[1]));
        let errors: Vec<(Figure, f64)> = pairs.collect::<Result<_>>()?;
        let sum: f64 = errors.iter().map(|(error, _)| error.value).sum();
        let row = |(i, (between, (error, own_error))): (usize, (&Between, &(Figure, f64)))| Row {
            name: between.name.clone(),
            from: between.from.clone(),
            to: between.to.clone(),
            error: *error,
            relative: if magnitude > 0.0 { error.value / magnitude } else { 0.0 },
            share: if sum > 0.0 { error.value / sum } else { 0.0 },
            own_error: *own_error,
            is_resolved: own_error * RESOLVED <= error.value,
            time_ratio: if between.on_device { ratio(rounds, i) } else { None },
        };
        let rows: Vec<Row> = chain.between.iter().zip(&errors).enumerate().map(row).collect();
        let (total, _) = compare(first, last)?;
        // A root mean square is a norm: of differences that follow each other the sum's is at most
        // the sum of theirs, but for the rounding of both.
        let holds = total.value <= sum * (1.0 + 1e-9) + 1e-15;
        let interrupted = self.is_stopped();
        let quadrature = errors.iter().map(|(error, _)| error.value.powi(2)).sum::<f64>().sqrt();
        Ok(Ledger {
            magnitude,
            rows,
            total,
            sum,
            quadrature,
            holds,
            interrupted,
            ..self.empty(made, nothing)
        })
    }

    fn empty(&self, made: Provenance, nothing: Figure) -> Ledger {
        Ledger {
            made,
            frame: self.frames.i_frame,
            time_s: self.frames.time_s,
            width: self.pixels.width,
            height: self.pixels.height,
            n_pixels: self.pixels.at.len(),
            magnitude: 0.0,
            rows: Vec::new(),
            total: nothing,
            sum: 0.0,
            quadrature: 0.0,
            holds: true,
            interrupted: self.is_stopped(),
        }
    }
}

impl Shown {
    fn of(drawn: RenderedPixels) -> Shown {
        let own_error = drawn.own_error();
        Shown { rgba: drawn.rgba, own_error }
    }
}

fn words(from: &str, to: &str) -> [String; 2] {
    [from.to_owned(), to.to_owned()]
}

/// Time of player `i` by that of player `i + 1`, which does without one more; in every round they
/// are neighbours.
fn ratio(rounds: &[Vec<Turn>], i: usize) -> Option<Figure> {
    let ms = |turn: &Turn| median(&turn.gpu_ms).or_else(|| median(&turn.frame_ms));
    let of = |round: &Vec<Turn>| {
        ms(round.get(i)?).zip(ms(round.get(i + 1)?)).filter(|(_, b)| *b > 0.0).map(|(a, b)| a / b)
    };
    let ratios: Vec<f64> = rounds.iter().filter_map(of).collect();
    let interval = Bootstrap::default().median(&ratios);
    median(&ratios).map(|value| Figure {
        value,
        low: interval.map(|i| i.low.max(0.0)),
        high: interval.map(|i| i.high),
    })
}
