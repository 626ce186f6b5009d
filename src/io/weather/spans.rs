//! Blobs of a weather file between two steps. A span is made once, ahead of its use by a thread
//! (model.md §15 "Time").

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use super::wrf::WeatherFile;
use crate::error::{Error, Result};
use crate::model::weather::detail::Detail;
use crate::model::weather::interval::{Interval, StepClouds};
use crate::model::weather::particles::{Layout, WeatherBlob};
use crate::model::weather::steps::LONGEST_INTERPOLATED_S;

/// Most steps of a file with one layout for all of them. In a longer file a layout stands for a
/// step and its neighbours, has half of the blobs, and fades into the next layout.
pub const MOST_TOGETHER: usize = 8;
/// Spans that are kept: the last, the current and the next one.
const MOST_KEPT: usize = 3;
/// Steps whose clouds are kept: two neighbouring spans of layouts that fade are made of five.
const MOST_STEPS: usize = 5;

/// Numbers of a span's two steps, which are equal where a step stands alone.
pub type Ends = (usize, usize);

/// How the extinction of a layout's blobs changes over a span.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fade {
    Always,
    /// Whole at the first step, zero at the second.
    Out,
    /// Zero at the first step, whole at the second.
    In,
}

/// Blobs from one step to the next.
pub struct Span {
    /// Blobs of the layouts of even and of odd steps. The first holds all blobs where there is one
    /// layout.
    halves: [Option<(Interval, Fade)>; 2],
    /// Number of slots of the first half.
    n_first: usize,
}

impl Span {
    /// Returns the blobs in `n` slots at `weight` of the way to the second step, with the detail
    /// that they have at a time; `None` in slots that the layout does not use.
    pub fn blobs(&self, n: usize, weight: f64, time_s: f64) -> Vec<Option<WeatherBlob>> {
        let mut all = vec![None; n];
        let (first, second) = all.split_at_mut(self.n_first.min(n));
        for (half, slots) in self.halves.iter().zip([first, second]) {
            let Some((interval, fade)) = half else { continue };
            let share = match fade {
                Fade::Always => 1.0,
                Fade::Out => 1.0 - weight,
                Fade::In => weight,
            };
            let blobs = interval.blobs(weight, time_s);
            for (slot, blob) in slots.iter_mut().zip(blobs) {
                *slot = Some(WeatherBlob { kappa: share * blob.kappa, ..blob });
            }
        }
        all
    }
}

/// A span that a thread is making.
type UnderWay = (Ends, JoinHandle<Result<Arc<Span>>>);

/// Spans of a file, each made once.
pub struct Spans {
    source: Arc<Source>,
    /// Whether time runs backwards.
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
    /// The detail, and its life in the winds of the file.
    detail: (Detail, f64),
    seed: u32,
    /// Layout of all steps, in a file of few.
    layout: Option<Layout>,
    /// Numbers of slots of both halves.
    n_slots: [usize; 2],
    held: Mutex<Vec<(usize, Arc<StepClouds>)>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Spans {
    /// Prepares the spans of a file, of `n` slots. `layout` stands for all steps, if given.
    /// `detail` comes with its life in the winds of the file, s.
    pub fn new(
        file: WeatherFile,
        times_s: Vec<f64>,
        (n, seed, detail): (usize, u32, (Detail, f64)),
        layout: Option<Layout>,
        is_backward: bool,
    ) -> Spans {
        let n_slots = if layout.is_some() { [n, 0] } else { [n - n / 2, n / 2] };
        let held = Mutex::new(vec![]);
        let source = Source { file, times_s, detail, seed, layout, n_slots, held };
        Spans { source: Arc::new(source), is_backward, state: Mutex::new(State::default()) }
    }

    /// Returns the steps of the span that begins with step `i`.
    pub fn ends_from(&self, i: usize) -> Ends {
        (i, if self.source.is_linked(i) { i + 1 } else { i })
    }

    /// Returns a span, made now unless it is ready, and starts a thread that makes the next one.
    ///
    /// # Errors
    /// When a step cannot be read.
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
                // A failure matters only when its span is asked for.
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
            // Without a thread the span is made when it is asked for.
            let started = std::thread::Builder::new().name("weather".into()).spawn(make);
            state.under_way = started.ok().map(|thread| (next, thread));
        }
        Ok(span)
    }

    /// Returns the span that comes next.
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
    /// Returns whether clouds between step `i` and the next are interpolated.
    fn is_linked(&self, i: usize) -> bool {
        self.times_s.get(i + 1).is_some_and(|next| next - self.times_s[i] <= LONGEST_INTERPOLATED_S)
    }

    fn make(&self, (i, j): Ends) -> Result<Span> {
        let first = self.step(i)?;
        let second = if i == j { None } else { Some(self.step(j)?) };
        let laid_out =
            |layout: &Layout| Interval::laid_out(layout, &first, second.as_deref(), self.detail);
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

    /// Returns the layout for step `k` and for the neighbours that it fades from and into.
    fn layout_of(&self, k: usize) -> Result<Layout> {
        let from = if k > 0 && self.is_linked(k - 1) { k - 1 } else { k };
        let to = if self.is_linked(k) { k + 1 } else { k };
        let steps = (from..=to).map(|i| self.step(i)).collect::<Result<Vec<_>>>()?;
        let all: Vec<&[f64]> = steps.iter().map(|s| s.extinction.as_slice()).collect();
        Ok(Layout::new(&self.step(k)?.grid, &all, self.n_slots[k % 2], self.seed))
    }

    fn step(&self, i: usize) -> Result<Arc<StepClouds>> {
        if let Some((_, held)) = lock(&self.held).iter().find(|(of, _)| *of == i) {
            return Ok(held.clone());
        }
        // The lock is free while the step is read, so that another thread can read another step.
        let step = self.file.step(i)?;
        let is_carried = self.detail.0.is_in_winds();
        let winds = if is_carried { Some(Arc::new(self.file.winds(i)?)) } else { None };
        let read = Arc::new(StepClouds { grid: step.grid, extinction: step.extinction, winds });
        let mut held = lock(&self.held);
        held.truncate(MOST_STEPS - 1);
        held.insert(0, (i, read.clone()));
        Ok(read)
    }
}
