//! Which configurations are worth having, and what a budget buys.

use super::records::{Best, Configuration, Front};
use crate::studies::provenance::Figure;

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

/// Says of every configuration where it lies. On the front no other is better, as the figures
/// stand: at most as long and at most as far off, and one of the two less. Another one is off it
/// where one that is better is faster by more than the intervals, and near it where none is: errors
/// are those of one picture, the same in every run, and it is the times that chance has a part in.
/// Times are `by_base`, which drifts take no part in.
pub fn place(configurations: &mut [Configuration], metric: Metric) {
    let both: Vec<Option<Both>> = configurations
        .iter()
        .map(|c| c.by_base.zip(metric.of(c)).map(|(time, error)| Both { time, error }))
        .map(|both| both.filter(|b| b.time.value.is_finite() && b.error.value.is_finite()))
        .collect();
    for (own, configuration) in both.iter().zip(configurations) {
        let Some(own) = own else {
            configuration.front = Front::Unknown;
            continue;
        };
        let better = || both.iter().flatten().filter(|other| is_better(other, own));
        configuration.front = if better().any(|other| is_surely_less(&other.time, &own.time)) {
            Front::Off
        } else if better().next().is_some() {
            Front::Near
        } else {
            Front::On
        };
    }
}

/// The least error within `ms`, as the figures stand; of equal ones the faster.
pub fn best_within_ms(
    configurations: &[Configuration],
    metric: Metric,
    ms: f64,
    is_gpu: bool,
) -> Best {
    let within = |time: f64, _: f64| time <= ms;
    Best {
        budget: "ms".into(),
        value: ms,
        configuration: best(configurations, metric, is_gpu, within, |t, e| (e, t)),
    }
}

/// The least time within an error, as the figures stand; of equal ones the more exact.
pub fn best_within_error(
    configurations: &[Configuration],
    metric: Metric,
    error: f64,
    is_gpu: bool,
) -> Best {
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

#[cfg(test)]
mod tests {
    use super::super::design::name_of;
    use super::super::records::PictureError;
    use super::*;

    fn found(time: (f64, f64), error: f64) -> Configuration {
        let figure = |(value, spread): (f64, f64)| Figure {
            value,
            low: Some(value - spread),
            high: Some(value + spread),
        };
        Configuration {
            name: name_of(&[]),
            settings: Vec::new(),
            hash: String::new(),
            gpu_ms: None,
            frame_ms: None,
            by_base: Some(figure(time)),
            n_turns: 8,
            error: Some(PictureError {
                rmse: figure((error, 0.0)),
                max: error,
                relmse: error,
                is_resolved: true,
            }),
            front: Front::Unknown,
            failure: None,
            picture: None,
            error_map: None,
        }
    }

    fn placed(mut all: Vec<Configuration>) -> Vec<Front> {
        place(&mut all, Metric::Rmse);
        all.iter().map(|c| c.front).collect()
    }

    #[test]
    fn off_only_where_something_better_is_surely_faster() {
        use Front::{Near, Off, On};
        // 0.8 is beaten by 0.5 surely, 0.52 by it not.
        let all = vec![
            found((1.0, 0.0), 0.1),
            found((0.5, 0.05), 0.2),
            found((0.8, 0.05), 0.3),
            found((0.52, 0.05), 0.25),
        ];
        assert_eq!(placed(all), [On, On, Off, Near]);
        // Who is surely faster but further off, by however little, beats nobody.
        assert_eq!(placed(vec![found((1.0, 0.0), 0.1), found((0.5, 0.01), 0.1000001)]), [On, On]);
        // Equals do not beat each other; what has no figures is nowhere.
        let bare = Configuration { error: None, ..found((0.1, 0.0), 0.0) };
        assert_eq!(
            placed(vec![found((1.0, 0.0), 0.1), found((1.0, 0.1), 0.1), bare]),
            [On, On, Front::Unknown]
        );
    }
}
