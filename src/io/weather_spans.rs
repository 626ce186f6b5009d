//! What of a weather file is drawn between two steps: laid out once, read before it is wanted
//! (docs/model.md §15 "Time").

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use super::weather::wrf::WeatherFile;
use crate::error::{Error, Result};
use crate::model::weather::grid::Grid;
use crate::model::weather::interval::{Interval, StepClouds};
use crate::model::weather::particles::{Layout, WeatherBlob};
use crate::model::weather::steps::LONGEST_INTERPOLATED_S;

/// Files of so few steps have one layout for all of them. Of more, a layout stands for a step and
/// its neighbours, and blobs of the two at hand fade into each other: each has half of the blobs.
pub const MOST_TOGETHER: usize = 8;
/// Spans that are kept: the one before, the one at hand and the next.
const MOST_KEPT: usize = 3;
/// Steps whose clouds are kept: what two neighbouring spans of faded layouts are made of.
const MOST_STEPS: usize = 5;

/// A span's two steps: the second is the first where that stands alone.
pub type Ends = (usize, usize);

/// How much of a layout's blobs is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fade {
    Always,
    /// All at the first step, none at the second.
    Out,
    In,
}

/// What is drawn from one step to the next.
pub struct Span {
    /// Blobs of the layouts of even and of odd steps; those of all in the first, where there is one
    /// layout.
    halves: [Option<(Interval, Fade)>; 2],
    /// Slots of the first half.
    n_first: usize,
}

impl Span {
    /// In slot `i`, `weight` of the way to the second step; None in a slot that a layout does not
    /// need.
    pub fn blob(&self, i: usize, weight: f64) -> Option<WeatherBlob> {
        let (half, i) = if i < self.n_first {
            (&self.halves[0], i)
        } else {
            (&self.halves[1], i - self.n_first)
        };
        let (interval, fade) = half.as_ref().filter(|(interval, _)| i < interval.len())?;
        let blob = interval.blob(i, weight);
        let share = match fade {
            Fade::Always => 1.0,
            Fade::Out => 1.0 - weight,
            Fade::In => weight,
        };
        Some(WeatherBlob { kappa: share * blob.kappa, ..blob })
    }
}

/// A step's clouds.
struct Held {
    grid: Grid,
    extinction: Vec<f64>,
}

impl Held {
    fn moment(&self) -> StepClouds<'_> {
        StepClouds { grid: &self.grid, extinction: &self.extinction }
    }
}

/// What is being made before it is asked for.
type UnderWay = (Ends, JoinHandle<Result<Arc<Span>>>);

/// The spans of a file.
pub struct Spans {
    source: Arc<Source>,
    /// Time runs backwards.
    is_backward: bool,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    kept: Vec<(Ends, Arc<Span>)>,
    under_way: Option<UnderWay>,
}

struct Source {
    file: WeatherFile,
    times_s: Vec<f64>,
    seed: u32,
    /// Of all steps; None of a file of many.
    layout: Option<Layout>,
    /// Slots of both halves.
    n_slots: [usize; 2],
    held: Mutex<Vec<(usize, Arc<Held>)>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Spans {
    /// Of `n` slots; `layout`: one that stands for all steps.
    pub fn new(
        file: WeatherFile,
        times_s: Vec<f64>,
        (n, seed): (usize, u32),
        layout: Option<Layout>,
        is_backward: bool,
    ) -> Spans {
        let n_slots = if layout.is_some() { [n, 0] } else { [n - n / 2, n / 2] };
        let source = Source { file, times_s, seed, layout, n_slots, held: Mutex::new(vec![]) };
        Spans { source: Arc::new(source), is_backward, state: Mutex::new(State::default()) }
    }

    /// What is drawn from step `i` on.
    pub fn ends_from(&self, i: usize) -> Ends {
        (i, if self.source.is_linked(i) { i + 1 } else { i })
    }

    /// That span, made now if nobody has yet; the next one is begun.
    pub fn get(&self, ends: Ends) -> Result<Arc<Span>> {
        let mut state = lock(&self.state);
        let is_ready = state
            .under_way
            .as_ref()
            .is_some_and(|(of, thread)| *of == ends || thread.is_finished());
        if let Some((of, thread)) = state.under_way.take_if(|_| is_ready) {
            let made = thread.join().unwrap_or_else(|_| {
                Err(Error::Fault { what: "reading ahead panicked".to_owned() })
            });
            match made {
                Ok(span) => state.keep(of, span),
                // What nobody has asked for may be wrong.
                Err(error) if of == ends => return Err(error),
                Err(_) => {}
            }
        }
        let span = match state.kept.iter().find(|(of, _)| *of == ends) {
            Some((_, span)) => span.clone(),
            None => {
                let span = Arc::new(self.source.make(ends)?);
                state.keep(ends, span.clone());
                span
            }
        };
        if let Some(next) = self.after(ends)
            && state.under_way.is_none()
            && !state.kept.iter().any(|(of, _)| *of == next)
        {
            let source = self.source.clone();
            let make = move || source.make(next).map(Arc::new);
            // Where there is no thread to be had it is made when it is asked for.
            let started = std::thread::Builder::new().name("weather".into()).spawn(make);
            state.under_way = started.ok().map(|thread| (next, thread));
        }
        Ok(span)
    }

    /// The span that comes next.
    fn after(&self, (i, _): Ends) -> Option<Ends> {
        let next = if self.is_backward { i.checked_sub(1)? } else { i + 1 };
        (next < self.source.file.n_steps).then(|| self.ends_from(next))
    }
}

impl State {
    fn keep(&mut self, ends: Ends, span: Arc<Span>) {
        self.kept.truncate(MOST_KEPT - 1);
        self.kept.insert(0, (ends, span));
    }
}

impl Source {
    /// Whether what lies between step `i` and the next is interpolated.
    fn is_linked(&self, i: usize) -> bool {
        self.times_s.get(i + 1).is_some_and(|next| next - self.times_s[i] <= LONGEST_INTERPOLATED_S)
    }

    fn make(&self, (i, j): Ends) -> Result<Span> {
        let first = self.step(i)?;
        let second = if i == j { None } else { Some(self.step(j)?) };
        let laid_out = |layout: &Layout| {
            Interval::laid_out(layout, first.moment(), second.as_ref().map(|s| s.moment()))
        };
        let mut halves = [None, None];
        match &self.layout {
            Some(layout) => halves[0] = Some((laid_out(layout), Fade::Always)),
            None if i == j => halves[i % 2] = Some((laid_out(&self.layout_of(i)?), Fade::Always)),
            None => {
                halves[i % 2] = Some((laid_out(&self.layout_of(i)?), Fade::Out));
                halves[j % 2] = Some((laid_out(&self.layout_of(j)?), Fade::In));
            }
        }
        Ok(Span { halves, n_first: self.n_slots[0] })
    }

    /// That of step `k` and of those from which and into which it fades.
    fn layout_of(&self, k: usize) -> Result<Layout> {
        let from = if k > 0 && self.is_linked(k - 1) { k - 1 } else { k };
        let to = if self.is_linked(k) { k + 1 } else { k };
        let steps = (from..=to).map(|i| self.step(i)).collect::<Result<Vec<_>>>()?;
        let all: Vec<&[f64]> = steps.iter().map(|s| s.extinction.as_slice()).collect();
        Ok(Layout::new(&self.step(k)?.grid, &all, self.n_slots[k % 2], self.seed))
    }

    fn step(&self, i: usize) -> Result<Arc<Held>> {
        if let Some((_, held)) = lock(&self.held).iter().find(|(of, _)| *of == i) {
            return Ok(held.clone());
        }
        // Read without the lock: who asks for another step need not wait.
        let step = self.file.step(i)?;
        let read = Arc::new(Held { grid: step.grid, extinction: step.extinction });
        let mut held = lock(&self.held);
        held.truncate(MOST_STEPS - 1);
        held.insert(0, (i, read.clone()));
        Ok(read)
    }
}
