//! A study from its knobs to its front: configurations are drawn, compared, timed in turn, put
//! together, and placed.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::design::{Design, name_of, settings, together};
use super::errors::picture_error;
use super::front::{Metric, place};
use super::records::{Configuration, Front};
use super::turns::{Time, Turn, n_turns, order, timed};
use crate::error::{Error, Result};
use crate::model::scene::Scene;
use crate::reference::picture::{Pixels, Reference};
use crate::timing::names::Setting;
use crate::timing::sweep::Axis;

/// What draws and times configurations, which are numbered in the order they are added.
pub trait Subject {
    fn add(&mut self, scene: &Arc<Scene>);
    /// Its picture: premultiplied linear RGBA, rows from the top.
    fn picture(&mut self, i: usize) -> Result<Vec<f32>>;
    /// A few frames of it, timed.
    fn turn(&mut self, i: usize, i_round: usize) -> Result<Turn>;
}

/// A configuration's scene, and the hash of that and its files.
pub struct Loaded {
    pub scene: Arc<Scene>,
    pub hash: String,
}

const NOT_FINITE: &str = "its picture holds values that are no finite numbers";

/// Which configurations, and how they are measured.
#[derive(Debug, Clone)]
pub struct StudyPlan {
    pub axes: Vec<Axis>,
    pub design: Design,
    pub metric: Metric,
    pub time: Time,
    pub n_rounds: usize,
    /// Only these of the configurations, and none put together of them.
    pub part: Option<Range<usize>>,
}

/// What of a study is there so far.
#[derive(Debug, Clone, Default)]
pub struct Found {
    pub configurations: Vec<Configuration>,
    pub turns: Vec<Turn>,
    /// Rounds that the turns are of.
    pub n_rounds: usize,
}

/// What happens on the way.
pub enum Event<'a> {
    /// So many more pictures and turns are to come.
    More(usize),
    /// Configuration `i` was drawn.
    Picture { i: usize, rgba: &'a [f32], found: &'a mut Found },
    /// One was timed.
    Turn,
    /// A round has ended: what is there may be kept.
    Round(&'a Found),
}

/// All that a study is run with.
pub struct Setup<'a> {
    pub plan: &'a StudyPlan,
    /// The scene with such settings.
    pub load: &'a dyn Fn(&[Setting]) -> Result<Loaded>,
    pub reference: &'a Reference,
    pub pixels: &'a Pixels,
    /// Ends the study early, and cleanly.
    pub stop: &'a AtomicBool,
}

impl Setup<'_> {
    /// Runs what `found` does not have yet, and says where every configuration lies; whether it ran
    /// to its end.
    pub fn run(
        &self,
        subject: &mut dyn Subject,
        found: &mut Found,
        on: &mut dyn FnMut(Event<'_>) -> Result<()>,
    ) -> Result<bool> {
        // Those of an earlier run come first, in their order; what is asked for and not among them
        // follows.
        for configuration in &found.configurations {
            let Loaded { scene, hash } = (self.load)(&configuration.settings)?;
            if hash != configuration.hash {
                let name = &configuration.name;
                return Err(Error::usage(format!(
                    "{name}: its scene or files have changed since the study began"
                )));
            }
            subject.add(&scene);
        }
        let mut wanted = settings(&self.plan.axes, self.plan.design);
        if let Some(Range { start, end }) = self.plan.part {
            let end = end.min(wanted.len());
            wanted = wanted.drain(start.min(end)..end).collect();
        }
        self.add(subject, found, std::iter::once(Vec::new()).chain(wanted))?;
        let mut is_whole = self.measure(subject, found, on)?;
        if is_whole && self.plan.design == Design::Alone && self.plan.part.is_none() {
            let more = together(&found.configurations, self.plan.metric);
            if self.add(subject, found, more.into_iter())? > 0 {
                is_whole = self.measure(subject, found, on)?;
            }
        }
        Ok(is_whole)
    }

    /// Adds what is not there yet; how many.
    fn add(
        &self,
        subject: &mut dyn Subject,
        found: &mut Found,
        all: impl Iterator<Item = Vec<Setting>>,
    ) -> Result<usize> {
        let n_before = found.configurations.len();
        for settings in all {
            let Loaded { scene, hash } = (self.load)(&settings)?;
            if found.configurations.iter().any(|c| c.hash == hash) {
                continue;
            }
            subject.add(&scene);
            found.configurations.push(Configuration {
                name: name_of(&settings),
                settings,
                hash,
                gpu_ms: None,
                frame_ms: None,
                by_base: None,
                n_turns: 0,
                error: None,
                front: Front::Unknown,
                failure: None,
                picture: None,
                error_map: None,
            });
        }
        Ok(found.configurations.len() - n_before)
    }

    /// Draws and times what was not; false where it was stopped.
    fn measure(
        &self,
        subject: &mut dyn Subject,
        found: &mut Found,
        on: &mut dyn FnMut(Event<'_>) -> Result<()>,
    ) -> Result<bool> {
        let is_open = |c: &Configuration| c.error.is_none() && c.failure.is_none();
        let open: Vec<usize> = (0..found.configurations.len())
            .filter(|&i| is_open(&found.configurations[i]))
            .collect();
        let late = |i: usize, found: &Found| n_turns(&found.turns, i) < self.plan.n_rounds;
        let mut late: Vec<usize> =
            (1..found.configurations.len()).filter(|&i| late(i, found)).collect();
        on(Event::More(open.len() + late.len() * self.plan.n_rounds))?;
        for i in open {
            if self.stop.load(Ordering::Relaxed) {
                break;
            }
            self.draw(subject, found, on, i)?;
        }
        late.retain(|&i| found.configurations[i].failure.is_none());
        // The scene as it stands alone is timed, too.
        while !self.stop.load(Ordering::Relaxed)
            && (late.iter().any(|&i| n_turns(&found.turns, i) < self.plan.n_rounds)
                || n_turns(&found.turns, 0) < self.plan.n_rounds)
        {
            late.retain(|&i| n_turns(&found.turns, i) < self.plan.n_rounds);
            for i in order(&late, found.n_rounds) {
                if self.stop.load(Ordering::Relaxed) {
                    break;
                }
                found.turns.push(subject.turn(i, found.n_rounds)?);
                on(Event::Turn)?;
            }
            found.n_rounds += 1;
            self.sum_up(found);
            on(Event::Round(found))?;
        }
        self.sum_up(found);
        Ok(!self.stop.load(Ordering::Relaxed))
    }

    /// Draws configuration `i` and compares it; what does not fit the device is told and left out.
    fn draw(
        &self,
        subject: &mut dyn Subject,
        found: &mut Found,
        on: &mut dyn FnMut(Event<'_>) -> Result<()>,
        i: usize,
    ) -> Result<()> {
        match subject.picture(i) {
            Ok(rgba) => {
                let whole: Vec<[f64; 4]> =
                    rgba.chunks_exact(4).map(|p| [0, 1, 2, 3].map(|k| f64::from(p[k]))).collect();
                let drawn = self.pixels.pick(&whole);
                let error = picture_error(
                    self.pixels,
                    &drawn,
                    &self.reference.rgba,
                    self.reference.own_error,
                );
                match error {
                    Some(error) => found.configurations[i].error = Some(error),
                    None if i > 0 => found.configurations[i].failure = Some(NOT_FINITE.to_owned()),
                    None => {
                        return Err(Error::usage(format!("the scene as it stands: {NOT_FINITE}")));
                    }
                }
                on(Event::Picture { i, rgba: &rgba, found })
            }
            // The scene as it stands is what all are measured by.
            Err(Error::Limit { what }) if i > 0 => {
                found.configurations[i].failure = Some(what);
                on(Event::Turn)
            }
            Err(error) => Err(error),
        }
    }

    fn sum_up(&self, found: &mut Found) {
        found.sum_up(self.plan.time, self.plan.metric);
    }
}

impl Found {
    /// What the turns say of every configuration, and where each lies.
    pub fn sum_up(&mut self, time: Time, metric: Metric) {
        let Found { configurations, turns, .. } = self;
        for (i, c) in configurations.iter_mut().enumerate() {
            let [gpu, frame] = [Time::Gpu, Time::Frame].map(|time| timed(turns, i, time));
            c.gpu_ms = gpu.map(|t| t.ms);
            c.frame_ms = frame.map(|t| t.ms);
            c.by_base = if time == Time::Gpu { gpu } else { frame }.map(|t| t.by_base);
            c.n_turns = n_turns(turns, i);
        }
        place(configurations, metric);
    }
}
