//! Makes the pictures of a ledger, from the one that the device draws to the whole model, compares
//! each with the next, and times those that the device draws.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::DVec3;

use super::approximations::approximations;
use super::records::{Ledger, Row};
use crate::error::{Error, Result};
use crate::frame::GpuContext;
use crate::measure::figure::Figure;
use crate::measure::stats::median;
use crate::model::scene::{LightingMode, Overlap, Scene};
use crate::reference::picture::{
    BlobModel, Enough, FrameReference, MeanPicture, ModelDrawing, OnProgress, PixelSample, Pixels,
    ReferenceKind, ReferenceRequest, RenderStage, RenderedPixels, expected_path_s, expected_time,
    n_reflections, render_lit_scene, render_model, sums_until,
};
use crate::studies::error::blocks::TimedBlock;
use crate::studies::error::device_runner::{DeviceRunner, FrameChoice};
use crate::studies::error::study::Runner;
use crate::studies::kept_paths::{KeptPaths, Traced};
use crate::studies::picture_error::{RESOLVED, magnitude, picture_error, sampled};
use crate::studies::provenance::Provenance;
use crate::studies::reference_cache;

/// Least number of random paths of a pixel: fewer do not tell their own error.
const LEAST_PATHS: u32 = 32;

/// A ledger and everything that it is made with.
pub struct LedgerStudy<'a> {
    /// The device.
    pub gpu: &'a GpuContext,
    /// The scene, in which nothing is "auto".
    pub scene: &'a Scene,
    /// The frame that is drawn, and those that are timed.
    pub frames: FrameChoice,
    /// Timed blocks of each picture of the device.
    pub n_rounds: usize,
    /// The pixels that are compared.
    pub pixels: &'a Pixels,
    /// Reflections of the last picture by the model.
    pub n_reflections: u32,
    /// Most random paths of a pixel of the picture by radiative transfer; with 0 there is none.
    pub n_paths: u32,
    /// Ends the study early once it is set.
    pub stop: &'a AtomicBool,
    /// Gets the random paths while they are traced.
    pub traced: &'a Traced,
    /// The finished parts, which other threads may look at.
    pub parts: &'a Mutex<LedgerParts>,
}

/// The pictures and times of a ledger so far.
#[derive(Default)]
pub struct LedgerParts {
    chain: Chain,
    /// The blocks of each round by configuration.
    rounds: Vec<Vec<TimedBlock>>,
}

/// Locks the parts of a ledger. A panic elsewhere leaves whole pictures in it.
pub fn lock(parts: &Mutex<LedgerParts>) -> MutexGuard<'_, LedgerParts> {
    parts.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A picture at the pixels that are compared.
struct ChainPicture {
    rgba: Vec<[f64; 4]>,
    /// Root mean square of its own error.
    own_error: f64,
}

/// An approximation: the difference between two neighbours of the chain.
struct Link {
    name: String,
    from: String,
    to: String,
}

impl Link {
    fn new(name: &str, from: &str, to: &str) -> Link {
        let [name, from, to] = [name, from, to].map(str::to_owned);
        Link { name, from, to }
    }
}

/// Pictures, each with one approximation less than the one before, and the links between them.
#[derive(Default)]
struct Chain {
    pictures: Vec<ChainPicture>,
    links: Vec<Link>,
}

impl Chain {
    fn add(&mut self, link: Link, drawn: RenderedPixels) {
        let own_error = drawn.own_error();
        self.links.push(link);
        self.pictures.push(ChainPicture { rgba: drawn.rgba, own_error });
    }
}

impl LedgerStudy<'_> {
    /// Makes the ledger, or as much of it as was finished before `stop` was set.
    ///
    /// # Errors
    /// Fails if drawing fails, a reference cannot be computed, or a picture is not finite.
    pub fn run(&self, made: Provenance, listener: OnProgress) -> Result<Ledger> {
        let approximations = approximations(self.scene);
        let mut runner = DeviceRunner::new(self.gpu, self.frames);
        let scenes = approximations.iter().map(|a| &a.without);
        let scenes: Vec<&Scene> = std::iter::once(self.scene).chain(scenes).collect();
        scenes.iter().for_each(|scene| runner.add(&Arc::new(Scene::clone(scene))));
        for i in 0..scenes.len() {
            let rgba = sampled(self.pixels, &runner.picture(i)?);
            let chain = &mut lock(self.parts).chain;
            chain.pictures.push(ChainPicture { rgba, own_error: 0.0 });
        }
        let links = approximations.iter().map(|a| Link::new(a.name, &a.from, &a.to));
        lock(self.parts).chain.links.extend(links);
        let last = scenes.len() - 1;
        self.add_references(&mut runner, last, scenes[last], listener)?;
        self.time(&mut runner, scenes.len())?;
        lock(self.parts).ledger(made, self.frames, self.pixels, self.is_stopped())
    }

    fn add(&self, link: Link, drawn: RenderedPixels) {
        lock(self.parts).chain.add(link, drawn);
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Adds the pictures in f64 below the last one of the device, configuration `i` of `scene`.
    fn add_references(
        &self,
        runner: &mut DeviceRunner<'_>,
        i: usize,
        scene: &Scene,
        listener: OnProgress,
    ) -> Result<()> {
        let scene = &ReferenceKind::drawn_by(scene).without_approximations(scene);
        let light = &|n| listener(RenderStage::Lighting, n);
        let exact = FrameReference::with_progress(scene, self.frames.time_s, light)?;
        let is_lit = scene.lighting.mode != LightingMode::None;
        let mut by_device = exact.clone();
        if is_lit {
            let lit = runner.lit(i)?;
            by_device.radiance = lit.iter().map(|l| DVec3::from(l.first.map(f64::from))).collect();
            by_device.second = lit.iter().map(|l| DVec3::from(l.second.map(f64::from))).collect();
            // The device's light counts as exact here; later rows measure its error.
            by_device.second_error = Vec::new();
        }
        let draw = |light: &FrameReference, drawing: BlobModel| {
            render_lit_scene(scene, light, drawing, self.pixels, PixelSample::CENTER, listener)
        };
        self.add(Link::new("drawing", "f32", "f64"), draw(&by_device, BlobModel::AsDrawn));
        if scene.n_particles() > 0 && !self.is_stopped() {
            let link = match scene.draw.overlap {
                Overlap::Slices => Link::new("slices", "slices", "volume"),
                _ => Link::new("thin sprites", "sprites", "volume"),
            };
            self.add(link, draw(&by_device, BlobModel::Volume));
        }
        if !is_lit || self.is_stopped() {
            return Ok(());
        }
        // The reference of the light on surfaces has no density grid.
        let of = match scene.lighting.mode.is_medium() {
            true => "scattering",
            false => "first reflection",
        };
        let link = if scene.n_particles() > 0 && !scene.surfaces.is_empty() {
            Link::new(of, "f32, grid", "f64, closed form on surfaces")
        } else {
            Link::new(of, "f32", "f64")
        };
        let (second, second_error) = (by_device.second, Vec::new());
        let first = FrameReference { second, second_error, ..exact.clone() };
        self.add(link, draw(&first, BlobModel::Volume));
        if n_reflections(scene) > 1 {
            let link = Link::new("second reflection", "pairs in f32", "areas in f64");
            self.add(link, draw(&exact, BlobModel::Volume));
        }
        if !scene.lighting.mode.is_medium() {
            self.add_models(scene, listener)?;
        }
        self.add_transport(scene, listener)
    }

    /// Adds the picture by radiative transfer: the light without the model. Its paths are enough
    /// when their error is resolved.
    fn add_transport(&self, scene: &Scene, listener: OnProgress) -> Result<()> {
        if self.n_paths == 0 || self.is_stopped() {
            return Ok(());
        }
        let last = lock(self.parts).chain.pictures.last().map(|p| p.rgba.clone());
        let last = last.unwrap_or_default();
        let is_enough = |mean: &MeanPicture| {
            let off =
                mean.rgba.iter().zip(&last).flat_map(|(a, b)| [0, 1, 2, 3].map(|k| a[k] - b[k]));
            let squares: f64 = off.map(|d| d * d).sum();
            let rmse = (squares / (4 * last.len()) as f64).sqrt();
            mean.random_error * RESOLVED <= rmse
        };
        let enough = Enough { least: LEAST_PATHS, most: self.n_paths, is_enough: &is_enough };
        let kind = ReferenceKind::Transport;
        let request = ReferenceRequest { kind, scene, time_s: self.frames.time_s };
        let folder = reference_cache::default_folder();
        let kept = KeptPaths::open_study(folder.as_deref(), &request, self.pixels, &enough)?;
        let kept = self.traced.begin(kept);
        let sums = kept.grow(self.stop, listener, |grown| {
            sums_until(&request, self.pixels, true, &enough, grown)
        });
        let mean = match sums {
            Ok(sums) => sums.mean(),
            // The rows that are finished count.
            Err(Error::Interrupted) => return Ok(()),
            Err(error) => return Err(error),
        };
        let from = match self.n_reflections {
            _ if scene.lighting.mode.is_medium() => scene.lighting.mode.name().to_owned(),
            1 => "one reflection".to_owned(),
            n => format!("{n} reflections"),
        };
        self.traced.end();
        let chain = &mut lock(self.parts).chain;
        chain.links.push(Link::new("model", &from, "transport"));
        chain.pictures.push(ChainPicture { rgba: mean.rgba, own_error: mean.random_error });
        Ok(())
    }

    /// Adds the pictures that are lit by the model itself.
    fn add_models(&self, scene: &Scene, listener: OnProgress) -> Result<()> {
        for (link, how) in self.models(scene) {
            if !self.is_stopped() {
                let (time_s, pixels) = (self.frames.time_s, self.pixels);
                self.add(link, render_model(how, scene, time_s, pixels, listener)?);
            }
        }
        Ok(())
    }

    /// Returns the pictures that are lit by the model itself.
    fn models(&self, scene: &Scene) -> Vec<(Link, ModelDrawing)> {
        let (k, n) = (n_reflections(scene), self.n_reflections);
        let picture = |is_made: bool, link: [&str; 3], by_facet: bool, n_reflections: u32| {
            let [name, from, to] = link;
            is_made.then(|| (Link::new(name, from, to), ModelDrawing { n_reflections, by_facet }))
        };
        let has_particles = scene.n_particles() > 0;
        let grid = ["density grid", "grid and march", "closed form"];
        let facets = ["facets of surfaces", "between facets", "every pixel"];
        let more = ["reflections", &k.to_string(), &n.to_string()];
        let all = [
            picture(has_particles, grid, true, k),
            picture(!scene.surfaces.is_empty(), facets, false, k),
            picture(n > k, more, false, n),
        ];
        all.into_iter().flatten().collect()
    }

    /// Estimates the seconds that the pictures in f64 of a lit scene take, which are most of the
    /// ledger's time.
    ///
    /// # Errors
    /// As [`LedgerStudy::run`].
    pub fn expected_s(&self) -> Result<f64> {
        /// Most pictures in the light of the device or of its reference: one for each of the links
        /// "drawing", "thin sprites" or "slices", "first reflection" and "second reflection".
        const N_OTHERS: f64 = 4.0;
        let scene = &ReferenceKind::drawn_by(self.scene).without_approximations(self.scene);
        let (mut sum, mut drawing_s) = (0.0, 0.0);
        for (_, how) in self.models(scene) {
            let time = expected_time(how.n_reflections, scene, self.frames.time_s, self.pixels)?;
            sum += time.lighting_s + time.drawing_s;
            drawing_s = time.drawing_s;
        }
        Ok(sum + N_OTHERS * drawing_s)
    }

    /// Estimates the seconds that the random paths take at most.
    ///
    /// # Errors
    /// As [`LedgerStudy::run`].
    pub fn expected_paths_s(&self) -> Result<f64> {
        if self.n_paths == 0 {
            return Ok(0.0);
        }
        let path_s = expected_path_s(self.scene, self.frames.time_s, self.pixels)?;
        Ok(path_s * f64::from(self.n_paths))
    }

    /// Times rounds of one block for each configuration, every second round in reverse order.
    fn time(&self, runner: &mut DeviceRunner<'_>, n: usize) -> Result<()> {
        for i_round in 0..if n > 1 { self.n_rounds } else { 0 } {
            if self.is_stopped() {
                break;
            }
            let order = (0..n).map(|i| if i_round % 2 == 1 { n - 1 - i } else { i });
            let mut blocks: Vec<TimedBlock> =
                order.map(|i| runner.block(i, i_round)).collect::<Result<_>>()?;
            blocks.sort_by_key(|block| block.i_configuration);
            lock(self.parts).rounds.push(blocks);
        }
        Ok(())
    }
}

impl LedgerParts {
    /// Returns whether there is an approximation whose error is known.
    pub fn has_row(&self) -> bool {
        !self.chain.links.is_empty() && self.chain.pictures.len() > 1
    }

    /// Returns the ledger of the pictures so far, at `pixels` of a frame.
    ///
    /// # Errors
    /// Fails if a picture is not finite, or there is none.
    pub fn ledger(
        &self,
        made: Provenance,
        frames: FrameChoice,
        pixels: &Pixels,
        interrupted: bool,
    ) -> Result<Ledger> {
        let LedgerParts { chain, rounds } = self;
        let compare = |a: &ChainPicture, b: &ChainPicture| {
            let own_error = a.own_error + b.own_error;
            let error = picture_error(pixels, &a.rgba, &b.rgba, own_error);
            let what = "a picture of the scene holds values that are no finite numbers";
            error.map(|e| (e.rmse, own_error)).ok_or_else(|| Error::usage(what))
        };
        let (Some(first), Some(last)) = (chain.pictures.first(), chain.pictures.last()) else {
            return Err(Error::usage("a ledger without pictures"));
        };
        let magnitude = magnitude(&last.rgba);
        let pairs = chain.pictures.windows(2).map(|pair| compare(&pair[0], &pair[1]));
        let errors: Vec<(Figure, f64)> = pairs.collect::<Result<_>>()?;
        let sum: f64 = errors.iter().map(|(error, _)| error.value).sum();
        let share = |value: f64, of: f64| if of > 0.0 { value / of } else { 0.0 };
        let row = |(i, (link, (error, own_error))): (usize, (&Link, &(Figure, f64)))| Row {
            name: link.name.clone(),
            from: link.from.clone(),
            to: link.to.clone(),
            error: *error,
            relative: share(error.value, magnitude),
            share: share(error.value, sum),
            own_error: *own_error,
            is_resolved: own_error * RESOLVED <= error.value,
            time_ratio: time_ratio(rounds, i),
        };
        let (total, _) = compare(first, last)?;
        Ok(Ledger {
            made,
            frame: frames.i_frame,
            time_s: frames.time_s,
            width: pixels.width,
            height: pixels.height,
            n_pixels: pixels.at.len(),
            magnitude,
            rows: chain.links.iter().zip(&errors).enumerate().map(row).collect(),
            total,
            sum,
            quadrature: errors.iter().map(|(error, _)| error.value.powi(2)).sum::<f64>().sqrt(),
            // The root mean square is a norm, so that the triangle inequality holds but for the
            // rounding of both sides.
            holds: total.value <= sum * (1.0 + 1e-9) + 1e-15,
            interrupted,
        })
    }
}

/// Returns the time of configuration `i` divided by that of configuration `i + 1`, which has one
/// approximation less. In every round the two are neighbours. None if the device does not draw
/// both.
fn time_ratio(rounds: &[Vec<TimedBlock>], i: usize) -> Option<Figure> {
    let ms = |block: &TimedBlock| median(&block.gpu_ms).or_else(|| median(&block.frame_ms));
    let of = |round: &Vec<TimedBlock>| {
        ms(round.get(i)?).zip(ms(round.get(i + 1)?)).filter(|(_, b)| *b > 0.0).map(|(a, b)| a / b)
    };
    Figure::median(&rounds.iter().filter_map(of).collect::<Vec<f64>>())
}
