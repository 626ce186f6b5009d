//! Runs a study: draws the configurations, compares and times them, and finds the front.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::blocks::{TimeKind, TimedBlock, block_times, n_blocks, order};
use super::design::{Design, combinations, settings};
use super::front::{Cost, Metric, places};
use super::records::Configuration;
use crate::error::{Error, Result};
use crate::model::scene::Scene;
use crate::reference::picture::{Pixels, Reference};
use crate::studies::cloud_error::CloudPixels;
use crate::studies::picture_error::{PictureError, picture_error, sampled};
use crate::timing::names::Setting;
use crate::timing::sweep::Axis;

/// Draws and times configurations, which are numbered in the order in which they are added.
pub trait Runner {
    /// Adds a configuration.
    fn add(&mut self, scene: &Arc<Scene>);

    /// Returns the picture of configuration `i`: premultiplied linear RGBA, rows from the top.
    ///
    /// # Errors
    /// Fails with [`Error::Limit`] if the configuration does not fit on the device, and with
    /// another error if drawing fails.
    fn picture(&mut self, i: usize) -> Result<Vec<f32>>;

    /// Times a block of frames of configuration `i`.
    ///
    /// # Errors
    /// Fails if drawing fails.
    fn block(&mut self, i: usize, i_round: usize) -> Result<TimedBlock>;
}

/// The scene of a configuration.
pub struct LoadedConfiguration {
    /// The scene.
    pub scene: Arc<Scene>,
    /// SHA-256 of the scene and its files.
    pub hash: String,
}

/// The configurations of a study, and what they are measured by.
#[derive(Debug, Clone)]
pub struct StudyPlan {
    /// Knobs and their values.
    pub axes: Vec<Axis>,
    /// How the values are combined.
    pub design: Design,
    /// The error that decides.
    pub metric: Metric,
    /// The time that decides.
    pub time: TimeKind,
    /// Blocks of each configuration.
    pub n_rounds: usize,
    /// If set, only these of the configurations are run, and no combinations of the best.
    pub part: Option<Range<usize>>,
}

/// The results of a study so far.
#[derive(Debug, Clone, Default)]
pub struct StudyResults {
    /// All configurations; the first is the unchanged scene.
    pub configurations: Vec<Configuration>,
    /// All blocks, in the order in which they ran.
    pub blocks: Vec<TimedBlock>,
    /// Rounds that were begun.
    pub n_rounds: usize,
}

/// Progress of a study.
pub enum Event<'a> {
    /// This many more pictures and blocks are to come.
    More(usize),
    /// A configuration was drawn.
    Picture {
        /// Number of the configuration.
        i: usize,
        /// The picture.
        rgba: &'a [f32],
        /// The results, with the error of the picture.
        results: &'a mut StudyResults,
    },
    /// A block was timed, or a configuration turned out not to fit.
    Block,
    /// A round has ended; the results so far can be saved.
    Round(&'a StudyResults),
}

const NOT_FINITE: &str = "its picture holds values that are no finite numbers";

/// A study and everything that it runs with.
pub struct ErrorStudy<'a> {
    /// The configurations.
    pub plan: &'a StudyPlan,
    /// Loads the scene with the given settings.
    pub load: &'a dyn Fn(&[Setting]) -> Result<LoadedConfiguration>,
    /// The reference of all pictures.
    pub reference: &'a Reference,
    /// The pixels of the reference.
    pub pixels: &'a Pixels,
    /// The pixels of cloud, where their error is wanted.
    pub cloud: Option<&'a CloudPixels>,
    /// Ends the study early once it is set.
    pub stop: &'a AtomicBool,
}

impl ErrorStudy<'_> {
    /// Runs everything that `results` does not contain yet. Returns whether the study reached its
    /// end.
    ///
    /// # Errors
    /// Fails if a scene cannot be loaded or has changed since `results` were made, if the scene as
    /// it stands cannot be drawn, or if drawing or `on` fails.
    pub fn run(
        &self,
        runner: &mut dyn Runner,
        results: &mut StudyResults,
        on: &mut dyn FnMut(Event<'_>) -> Result<()>,
    ) -> Result<bool> {
        // The configurations of an earlier run come first, in their order; new ones follow.
        for configuration in &results.configurations {
            let loaded = (self.load)(&configuration.settings)?;
            if loaded.hash != configuration.hash {
                let name = &configuration.name;
                let what = "its scene or files have changed since the study began";
                return Err(Error::usage(format!("{name}: {what}")));
            }
            runner.add(&loaded.scene);
        }
        let mut wanted = settings(&self.plan.axes, self.plan.design);
        if let Some(Range { start, end }) = self.plan.part {
            let end = end.min(wanted.len());
            wanted = wanted.drain(start.min(end)..end).collect();
        }
        wanted.insert(0, Vec::new());
        self.add(runner, results, wanted)?;
        let mut is_complete = self.measure(runner, results, on)?;
        if is_complete && self.plan.design == Design::Alone && self.plan.part.is_none() {
            let more = combinations(&results.configurations, self.plan.metric);
            if self.add(runner, results, more)? > 0 {
                is_complete = self.measure(runner, results, on)?;
            }
        }
        Ok(is_complete)
    }

    /// Adds the configurations that are not there yet; returns how many.
    fn add(
        &self,
        runner: &mut dyn Runner,
        results: &mut StudyResults,
        all: Vec<Vec<Setting>>,
    ) -> Result<usize> {
        let n_before = results.configurations.len();
        for settings in all {
            let LoadedConfiguration { scene, hash } = (self.load)(&settings)?;
            if results.configurations.iter().all(|c| c.hash != hash) {
                runner.add(&scene);
                results.configurations.push(Configuration::new(settings, hash));
            }
        }
        Ok(results.configurations.len() - n_before)
    }

    /// Draws and times what is missing; returns false if it was stopped.
    fn measure(
        &self,
        runner: &mut dyn Runner,
        results: &mut StudyResults,
        on: &mut dyn FnMut(Event<'_>) -> Result<()>,
    ) -> Result<bool> {
        let is_stopped = || self.stop.load(Ordering::Relaxed);
        let StudyPlan { n_rounds, time, metric, .. } = *self.plan;
        let is_late = |i: usize, results: &StudyResults| n_blocks(&results.blocks, i) < n_rounds;
        let n = results.configurations.len();
        let is_undrawn = |i: &usize| {
            let c = &results.configurations[*i];
            c.error.is_none() && c.failure.is_none()
        };
        let undrawn: Vec<usize> = (0..n).filter(is_undrawn).collect();
        let mut late: Vec<usize> = (1..n).filter(|&i| is_late(i, results)).collect();
        on(Event::More(undrawn.len() + late.len() * n_rounds))?;
        for i in undrawn {
            if is_stopped() {
                break;
            }
            self.draw(runner, results, on, i)?;
        }
        late.retain(|&i| results.configurations[i].failure.is_none());
        // The unchanged scene is timed even if it is alone.
        while !is_stopped() && (is_late(0, results) || late.iter().any(|&i| is_late(i, results))) {
            late.retain(|&i| is_late(i, results));
            for i in order(&late, results.n_rounds) {
                if is_stopped() {
                    break;
                }
                results.blocks.push(runner.block(i, results.n_rounds)?);
                on(Event::Block)?;
            }
            results.n_rounds += 1;
            results.summarize(time, metric);
            on(Event::Round(results))?;
        }
        results.summarize(time, metric);
        Ok(!is_stopped())
    }

    /// Draws configuration `i` and computes its error. A configuration that does not fit on the
    /// device is marked as failed.
    fn draw(
        &self,
        runner: &mut dyn Runner,
        results: &mut StudyResults,
        on: &mut dyn FnMut(Event<'_>) -> Result<()>,
        i: usize,
    ) -> Result<()> {
        let configuration = &mut results.configurations[i];
        match runner.picture(i) {
            Ok(rgba) => {
                let Reference { rgba: reference, own_error, .. } = self.reference;
                let drawn = sampled(self.pixels, &rgba);
                let cloud = |cloud: &CloudPixels| cloud.error(self.pixels, &drawn, self.reference);
                configuration.error = picture_error(self.pixels, &drawn, reference, *own_error)
                    .map(|error| PictureError { cloud: self.cloud.and_then(cloud), ..error });
                if configuration.error.is_none() {
                    // All times and errors are relative to the unchanged scene.
                    if i == 0 {
                        return Err(Error::usage(format!("{}: {NOT_FINITE}", configuration.name)));
                    }
                    configuration.failure = Some(NOT_FINITE.to_owned());
                }
                on(Event::Picture { i, rgba: &rgba, results })
            }
            Err(Error::Limit { what }) if i > 0 => {
                configuration.failure = Some(what);
                on(Event::Block)
            }
            Err(error) => Err(error),
        }
    }
}

impl StudyResults {
    /// Computes the times and the place of every configuration from the blocks.
    pub fn summarize(&mut self, time: TimeKind, metric: Metric) {
        for (i, c) in self.configurations.iter_mut().enumerate() {
            let [gpu, frame] =
                [TimeKind::Gpu, TimeKind::Frame].map(|time| block_times(&self.blocks, i, time));
            c.gpu_ms = gpu.map(|t| t.ms);
            c.frame_ms = frame.map(|t| t.ms);
            c.by_base = if time == TimeKind::Gpu { gpu } else { frame }.map(|t| t.by_base);
            c.n_turns = n_blocks(&self.blocks, i);
        }
        let cost =
            |c: &Configuration| Some(Cost { time: c.by_base?, error: metric.of(&c.error?)? });
        let costs: Vec<Option<Cost>> = self.configurations.iter().map(cost).collect();
        for (c, front) in self.configurations.iter_mut().zip(places(&costs)) {
            c.front = front;
        }
    }
}
