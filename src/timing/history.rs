//! A series of runs: how frame times and errors went from run to run, and where they changed.

use serde::Serialize;

use super::compare::HEADLINE;
use super::intervals::{median_interval, values};
use super::records::{Case, Mode};
use super::results::{BenchResults, TimedMode};
use crate::measure::bootstrap::Interval;
use crate::measure::changes::{Change, LEAST_SEGMENT, changes};
use crate::measure::figure::Figure;
use crate::measure::stats::median;

/// The 97.5th percentile of the normal distribution: how many standard errors a 95 % interval
/// reaches to each side.
const Z: f64 = 1.96;

/// Least runs in which a change can be found: some on each side of it.
pub const LEAST_RUNS: usize = 2 * LEAST_SEGMENT;

/// A figure of one loop or case, run after run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// "frame" or "RMSE".
    pub quantity: &'static str,
    /// Unit of the figures; empty for none.
    pub unit: &'static str,
    /// Case and loop in words; empty for an error if there is one case.
    pub name: String,
    /// The runs that have the figure, in order.
    pub points: Vec<Point>,
    /// The changes, in order.
    pub changes: Vec<SeriesChange>,
}

/// A figure of one run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// Number of the run.
    pub run: usize,
    /// The figure, with the interval within the run.
    pub figure: Figure,
    /// The level of its segment: the geometric mean of all runs between two changes.
    pub level: f64,
}

/// A change of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SeriesChange {
    /// The last run before it.
    pub after: usize,
    /// The first run after it.
    pub run: usize,
    /// The runs that may as well be the first after it: a 95 % interval of `run`.
    pub runs: [usize; 2],
    /// Level after by level before, with its 95 % interval.
    pub by: Interval,
    /// The chance of such a change at one place if nothing had changed.
    pub p: f64,
}

/// A figure of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedFigure {
    /// "frame" or "RMSE".
    pub quantity: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// Case and loop in words.
    pub name: String,
    /// The figure.
    pub figure: Figure,
}

/// Returns the median frame time of every loop of a run, and the error of every case. A loop that
/// draws nothing is left out if its case has another loop. Runs with cold caches have no frame
/// times: theirs contain what is written between passes.
pub fn figures(run: &BenchResults) -> Vec<NamedFigure> {
    let is_cold = run.run.cold_bytes.is_some();
    let drawing = run.timed().filter(|(case, mode, _)| !is_cold && !case.is_left_out(mode));
    let time = |(.., timed): (&Case, &Mode, &TimedMode)| {
        let blocks = timed.times(HEADLINE);
        let (low, high) = median_interval(blocks, timed.widening).map(|i| (i.low, i.high)).unzip();
        let figure = Figure { value: median(&values(blocks))?, low, high };
        Some(NamedFigure { quantity: HEADLINE, unit: "ms", name: timed.name.clone(), figure })
    };
    let error = |case: &Case| {
        // Its interval is over the same pixels in all runs, and no noise between them.
        let figure = Figure::alone(case.check.as_ref()?.rmse?.value);
        Some(NamedFigure { quantity: "RMSE", unit: "", name: case.name(), figure })
    };
    drawing.filter_map(time).chain(run.run.cases.iter().filter_map(error)).collect()
}

/// Returns every figure that a run has as a series, times before errors.
pub fn history(runs: &[Vec<NamedFigure>]) -> Vec<Series> {
    let mut kinds: Vec<&NamedFigure> = Vec::new();
    for figure in runs.iter().flatten() {
        if !kinds.iter().any(|k| (k.quantity, &k.name) == (figure.quantity, &figure.name)) {
            kinds.push(figure);
        }
    }
    kinds.sort_by_key(|kind| kind.quantity != HEADLINE);
    let of = |kind: &NamedFigure| {
        let is_it = |f: &&NamedFigure| (f.quantity, &f.name) == (kind.quantity, &kind.name);
        let found = runs.iter().enumerate().filter_map(|(i, all)| {
            let figure = all.iter().find(is_it)?.figure;
            // Levels are compared by their ratio.
            (figure.value > 0.0 && figure.value.is_finite()).then_some((i, figure))
        });
        series(kind, &found.collect::<Vec<_>>())
    };
    kinds.into_iter().map(of).filter(|series| !series.points.is_empty()).collect()
}

fn series(kind: &NamedFigure, figures: &[(usize, Figure)]) -> Series {
    let logarithms: Vec<f64> = figures.iter().map(|(_, f)| f.value.ln()).collect();
    let error = |f: &Figure| {
        let ends = f.low.zip(f.high).filter(|(low, _)| *low > 0.0);
        ends.map_or(0.0, |(low, high)| (high / low).ln() / (2.0 * Z))
    };
    let errors: Vec<f64> = figures.iter().map(|(_, f)| error(f)).collect();
    let found = changes(&logarithms, &errors);
    let begins: Vec<usize> = found.iter().map(|change| change.at).collect();
    let level = |i: usize| {
        let begin = begins.iter().rev().find(|at| **at <= i).copied().unwrap_or(0);
        let end = begins.iter().find(|at| **at > i).copied().unwrap_or(logarithms.len());
        let segment = &logarithms[begin..end];
        (segment.iter().sum::<f64>() / segment.len() as f64).exp()
    };
    let point = |(i, (run, figure)): (usize, &(usize, Figure))| Point {
        run: *run,
        figure: *figure,
        level: level(i),
    };
    let change = |Change { at, places, by, p }: &Change| {
        let run = |place: usize| figures[place].0;
        let Interval { estimate, low, high } = *by;
        SeriesChange {
            after: run(at - 1),
            run: run(*at),
            runs: places.map(run),
            by: Interval { estimate: estimate.exp(), low: low.exp(), high: high.exp() },
            p: *p,
        }
    };
    Series {
        quantity: kind.quantity,
        unit: kind.unit,
        name: kind.name.clone(),
        points: figures.iter().enumerate().map(point).collect(),
        changes: found.iter().map(change).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(frame: f64, rmse: Option<f64>) -> Vec<NamedFigure> {
        let of = |quantity, unit, name: &str, value| NamedFigure {
            quantity,
            unit,
            name: name.to_owned(),
            figure: Figure { value, low: Some(0.999 * value), high: Some(1.001 * value) },
        };
        let error = rmse.map(|value| of("RMSE", "", "", value));
        error.into_iter().chain([of(HEADLINE, "ms", "serial", frame)]).collect()
    }

    #[test]
    fn a_step_of_times_is_found_and_the_error_stays() {
        // Ten runs at 20 ms ± 0.2 %, five at 21; the error misses in one run.
        let noise = |i: usize| 1.0 + 0.002 * [0.3, -0.9, 1.0, -0.4, 0.1][i % 5];
        let runs: Vec<Vec<NamedFigure>> = (0..15)
            .map(|i| {
                let ms = if i < 10 { 20.0 } else { 21.0 };
                run(ms * noise(i), Some(1e-3).filter(|_| i != 4))
            })
            .collect();
        let all = history(&runs);
        let names: Vec<_> = all.iter().map(|s| (s.quantity, s.name.as_str())).collect();
        assert_eq!(names, [("frame", "serial"), ("RMSE", "")]);
        let [SeriesChange { after, run, runs, by, .. }] = all[0].changes[..] else {
            panic!("{all:?}")
        };
        assert_eq!((after, run, runs), (9, 10, [10, 10]));
        assert!((by.estimate - 1.05).abs() < 1e-3 && by.low < 1.05 && 1.05 < by.high, "{by:?}");
        assert!((all[0].points[12].level - 21.0).abs() < 0.03 && all[0].points.len() == 15);
        assert!(all[1].changes.is_empty() && all[1].points.len() == 14);
        assert_eq!(all[1].points[4].run, 5);
    }
}
