//! Which configurations are worth having, and what a budget buys.

use super::records::{Best, Configuration, Front};
use crate::study::provenance::Figure;

/// The error that decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    Rmse,
    Max,
    RelMse,
}

impl Metric {
    pub const NAMES: [(&'static str, Metric); 3] =
        [("rmse", Metric::Rmse), ("max", Metric::Max), ("relmse", Metric::RelMse)];

    pub fn name(self) -> &'static str {
        Metric::NAMES.iter().find(|(_, metric)| *metric == self).map_or("", |(name, _)| name)
    }

    /// Of a configuration; only the RMSE has an interval.
    pub fn of(self, configuration: &Configuration) -> Option<Figure> {
        let error = configuration.error?;
        let alone = |value| Figure { value, low: None, high: None };
        Some(match self {
            Metric::Rmse => error.rmse,
            Metric::Max => alone(error.max),
            Metric::RelMse => alone(error.relmse),
        })
    }
}

/// The time and the error of a configuration.
#[derive(Debug, Clone, Copy)]
struct Both {
    time: Figure,
    error: Figure,
}

fn low(f: &Figure) -> f64 {
    f.low.unwrap_or(f.value)
}

fn high(f: &Figure) -> f64 {
    f.high.unwrap_or(f.value)
}

/// Less by more than the intervals.
fn is_surely_less(a: &Figure, b: &Figure) -> bool {
    high(a) < low(b)
}

/// `a` is no worse in either and better in one, as the figures stand.
fn is_better(a: &Both, b: &Both) -> bool {
    let (t, e) = (a.time.value <= b.time.value, a.error.value <= b.error.value);
    t && e && (a.time.value < b.time.value || a.error.value < b.error.value)
}

/// Says of every configuration where it lies: on the front where no other is better; off it where another is, and surely so
/// (better in one by more than chance, and not worse in the other by more than chance); near it where only one of the two can
/// be said. Times are `by_base`, which drifts take no part in; `is_nearer(i, j)`: i's error is surely less than j's.
pub fn place(configurations: &mut [Configuration], metric: Metric, is_nearer: impl Fn(usize, usize) -> bool) {
    let both: Vec<Option<Both>> = configurations
        .iter()
        .map(|c| c.by_base.zip(metric.of(c)).map(|(time, error)| Both { time, error }))
        .map(|both| both.filter(|b| b.time.value.is_finite() && b.error.value.is_finite()))
        .collect();
    let is_surely_better = |i: usize, j: usize, a: &Both, b: &Both| {
        let (faster, slower) = (is_surely_less(&a.time, &b.time), is_surely_less(&b.time, &a.time));
        (faster && !is_nearer(j, i)) || (!slower && is_nearer(i, j))
    };
    for (j, configuration) in configurations.iter_mut().enumerate() {
        let Some(own) = &both[j] else {
            configuration.front = Front::Unknown;
            continue;
        };
        let others = || both.iter().enumerate().filter_map(|(i, o)| o.as_ref().map(|o| (i, o)));
        let is_off = others().any(|(_, o)| is_better(o, own));
        let is_surely_off = others().any(|(i, o)| i != j && is_surely_better(i, j, o, own));
        configuration.front = match (is_off, is_surely_off) {
            (false, false) => Front::On,
            (true, true) => Front::Off,
            _ => Front::Near,
        };
    }
}

/// The least error within `ms`, as the figures stand; of equal ones the faster.
pub fn best_within_ms(configurations: &[Configuration], metric: Metric, ms: f64, is_gpu: bool) -> Best {
    let within = |time: f64, _: f64| time <= ms;
    Best { budget: "ms".into(), value: ms, configuration: best(configurations, metric, is_gpu, within, |t, e| (e, t)) }
}

/// The least time within an error, as the figures stand; of equal ones the more exact.
pub fn best_within_error(configurations: &[Configuration], metric: Metric, error: f64, is_gpu: bool) -> Best {
    let within = |_: f64, e: f64| e <= error;
    Best {
        budget: "error".into(),
        value: error,
        configuration: best(configurations, metric, is_gpu, within, |t, e| (t, e)),
    }
}

fn best(
    configurations: &[Configuration],
    metric: Metric,
    is_gpu: bool,
    within: impl Fn(f64, f64) -> bool,
    key: impl Fn(f64, f64) -> (f64, f64),
) -> Option<usize> {
    let figures = |c: &Configuration| {
        let time = if is_gpu { c.gpu_ms } else { c.frame_ms };
        time.zip(metric.of(c)).map(|(t, e)| (t.value, e.value))
    };
    let all = configurations.iter().enumerate().filter_map(|(i, c)| figures(c).map(|f| (i, f)));
    let fit = all.filter(|(_, (t, e))| within(*t, *e));
    let least = |(t, e): (f64, f64)| key(t, e);
    fit.min_by(|(_, a), (_, b)| {
        let (a, b) = (least(*a), least(*b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    })
    .map(|(i, _)| i)
}
