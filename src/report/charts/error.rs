//! Error studies as a chart of error over time: every configuration with its intervals, and the
//! Pareto front.

use std::cmp::Reverse;

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::axis::Axis;
use super::chart::{Chart, LegendEntry, Tooltip, shortened};
use super::medium::{INK, MUTED, Medium, series};
use super::number::{number, with_interval};
use super::overlap::place_labels;
use super::plot_area::{Canvas, GridLines, MarkerFill, PlotArea};
use crate::measure::figure::Figure;
use crate::measure::stats::extremes;
use crate::studies::error::blocks::TimeKind;
use crate::studies::error::front::{Front, Metric};
use crate::studies::error::records::{Configuration, Study};

/// Number of configurations on the front that are listed below the chart: the list stays shorter
/// than the chart, in a picture and in a terminal.
const N_LISTED: usize = 14;
/// Characters of a line of that list: as many as `Medium::width_of` fits into 900 px less margins.
const LINE_LENGTH: usize = 112;
/// Opacity of the intervals of configurations behind the front: the front stands out, and these
/// intervals stay legible.
const FAINT: f64 = 0.55;
/// An interval extends an axis at most by this factor beyond the outermost values. More would crowd
/// the points into a small part of the chart.
const INTERVAL_REACH: f64 = 3.0;

/// The chart of an error study.
#[derive(Debug, Clone)]
pub struct ErrorChart {
    time_name: String,
    error_name: String,
    points: Vec<Point>,
    /// Number of configurations without a time or an error.
    n_missing: usize,
}

#[derive(Debug, Clone)]
struct Point {
    name: String,
    time: Figure,
    error: Figure,
    front: Front,
    /// Position on the front, counted from 1 at the fastest; `None` for points off the front.
    number: Option<usize>,
    is_base: bool,
}

/// Returns the chart of a study.
pub fn chart(study: &Study) -> ErrorChart {
    let numbers = front_numbers(study);
    let point = |(i, c): (usize, &Configuration)| {
        let (time, error) = (time_of(study, c)?, error_of(study, c)?);
        let is_drawable = time.value.is_finite()
            && time.value > 0.0
            && error.value.is_finite()
            && error.value >= 0.0;
        is_drawable.then(|| Point {
            name: study.label(c),
            time,
            error,
            front: c.front,
            number: numbers[i],
            is_base: i == 0,
        })
    };
    let points: Vec<Point> = study.configurations.iter().enumerate().filter_map(point).collect();
    let time = if study.time == TimeKind::Gpu { "GPU time" } else { "time" };
    let reference = &study.reference.against;
    ErrorChart {
        time_name: format!("{time} of a frame, ms"),
        error_name: format!("{} from the reference \"{reference}\"", metric_name(study.metric)),
        n_missing: study.configurations.len() - points.len(),
        points,
    }
}

/// Returns the usual name of a metric.
pub fn metric_name(metric: Metric) -> &'static str {
    match metric {
        Metric::Rmse => "RMSE",
        Metric::Max => "greatest difference",
        Metric::RelMse => "relMSE",
        Metric::Cloud => "RMS of cloud",
    }
}

/// Returns the time that a study compares, GPU or frame, ms.
pub fn time_of(study: &Study, configuration: &Configuration) -> Option<Figure> {
    configuration.ms(study.time)
}

/// Returns the error that a study compares, by its metric.
pub fn error_of(study: &Study, configuration: &Configuration) -> Option<Figure> {
    configuration.error.and_then(|error| study.metric.of(&error))
}

/// Numbers the configurations on the front from 1, the fastest first.
pub fn front_numbers(study: &Study) -> Vec<Option<usize>> {
    let all = &study.configurations;
    let time = |i: usize| time_of(study, &all[i]).map_or(f64::INFINITY, |t| t.value);
    let mut front: Vec<usize> = (0..all.len()).filter(|i| all[*i].front == Front::On).collect();
    front.sort_by(|a, b| time(*a).total_cmp(&time(*b)));
    let mut numbers = vec![None; all.len()];
    for (number, i) in (1..).zip(front) {
        numbers[i] = Some(number);
    }
    numbers
}

impl Point {
    fn tooltip(&self, chart: &ErrorChart) -> String {
        let figure = |f: Figure| with_interval(f.value, f.low, f.high);
        let front = match self.front {
            Front::On => "on the front",
            Front::Near => "near the front",
            Front::Off => "behind the front",
            Front::Unknown => "not placed",
        };
        let Point { name, time, error, .. } = self;
        let (time_name, error_name) = (chart.time_name.trim_end_matches(", ms"), &chart.error_name);
        let (time, error) = (figure(*time), figure(*error));
        format!("{name}\n{time_name}: {time} ms\n{error_name}: {error}\n{front}")
    }

    fn marker(&self) -> (MarkerFill, RGBColor, i32) {
        match self.front {
            Front::On => (MarkerFill::Full, series(0), 6),
            Front::Near => (MarkerFill::Half, series(1), 5),
            Front::Off | Front::Unknown => (MarkerFill::None, MUTED, 4),
        }
    }
}

impl ErrorChart {
    /// Returns the points on the front, the fastest first.
    fn front(&self) -> Vec<&Point> {
        let mut front: Vec<&Point> = self.points.iter().filter(|p| p.number.is_some()).collect();
        front.sort_by_key(|p| p.number);
        front
    }

    fn axes(&self, medium: Medium, (width, height): (i32, i32)) -> (Axis, Axis) {
        let axis = |name: &str, figure: fn(&Point) -> Figure, with_zero: bool, n_ticks: i32| {
            let figures = || self.points.iter().map(figure).filter(|f| f.value > 0.0);
            let (least, most) = extremes(figures().map(|f| f.value)).unwrap_or((0.0, 0.0));
            let ends = figures()
                .flat_map(|f| [f.low, f.high])
                .flatten()
                .filter(|v| *v > 0.0 && v.is_finite())
                .map(|v| v.clamp(least / INTERVAL_REACH, most * INTERVAL_REACH));
            let values = figures().map(|f| f.value).chain(ends);
            Axis::log(name, values, with_zero, n_ticks as usize)
        };
        let with_zero = self.points.iter().any(|p| p.error.value == 0.0);
        (
            axis(&self.time_name, |p| p.time, false, width / medium.across(80, 9)),
            axis(&self.error_name, |p| p.error, with_zero, height / medium.down(36, 2)),
        )
    }
}

impl Chart for ErrorChart {
    fn title(&self) -> String {
        "Time against error".to_owned()
    }

    fn legend(&self) -> Vec<LegendEntry> {
        [
            (series(0), '●', "on the front: none is both faster and closer", MarkerFill::Full),
            (series(1), '◐', "near the front, within the intervals", MarkerFill::Half),
            (MUTED, '○', "behind the front", MarkerFill::None),
        ]
        .map(|(color, glyph, name, fill)| LegendEntry {
            color,
            glyph,
            name: name.to_owned(),
            marker: Some(fill),
        })
        .to_vec()
    }

    fn notes(&self) -> Vec<String> {
        let front = self.front();
        let line = |p: &&Point| {
            let (i, time, error) = (p.number.unwrap_or(0), p.time.value, p.error.value);
            let line = format!("{i}) {} ms, {}: {}", number(time), number(error), p.name);
            shortened(&line, LINE_LENGTH)
        };
        let mut notes: Vec<String> = front.iter().take(N_LISTED).map(line).collect();
        if front.len() > N_LISTED {
            notes.push(format!("and {} more on the front", front.len() - N_LISTED));
        }
        match self.n_missing {
            0 => {}
            1 => notes.push("1 configuration has no time or no error and is not drawn".to_owned()),
            n => {
                notes.push(format!("{n} configurations have no time or no error and are not drawn"))
            }
        }
        notes
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &Canvas<'_, DB>) -> DrawResult<Vec<Tooltip>, DB> {
        let medium = canvas.medium;
        let (x, y) = self.axes(medium, canvas.size());
        let area = PlotArea::new(canvas, &x, &y, GridLines::Both)?;
        if self.points.is_empty() {
            let [left, top, right, bottom] = area.bounds();
            let middle = ((left + right) / 2, (top + bottom) / 2);
            area.write("nothing was both timed and compared", middle, MUTED, HPos::Center)?;
            return Ok(vec![]);
        }
        let at = |p: &Point| Some((x.position(p.time.value)?, y.position(p.error.value)?));
        let mut drawn: Vec<(&Point, (f64, f64))> =
            self.points.iter().filter_map(|p| Some((p, at(p)?))).collect();
        // The front is drawn last, above the rest.
        let is_behind = |p: &Point| matches!(p.front, Front::Off | Front::Unknown);
        drawn.sort_by_key(|(p, _)| (!is_behind(p), p.front == Front::On, Reverse(p.number)));
        // The front goes right, then down: no configuration faster than the next one has a smaller
        // error.
        let front: Vec<(f64, f64)> = self.front().into_iter().filter_map(at).collect();
        let step = |pair: &[(f64, f64)]| [pair[0], (pair[1].0, pair[0].1), pair[1]];
        let steps: Vec<_> = front.windows(2).flat_map(step).collect();
        area.line(&steps, series(0).stroke_width(2))?;
        for (point, (px, py)) in &drawn {
            if is_behind(point) && medium.is_terminal() {
                // The dots of these intervals would cover the front.
                continue;
            }
            let style = point.marker().1.mix(if is_behind(point) { FAINT } else { 1.0 });
            area.interval(&x, point.time, |at| (at, *py), style)?;
            area.interval(&y, point.error, |at| (*px, at), style)?;
        }
        let (mut tooltips, mut markers, mut labels) = (Vec::new(), Vec::new(), Vec::new());
        for (point, (px, py)) in &drawn {
            let (fill, color, radius) = point.marker();
            let pixel = area.pixel(*px, *py);
            area.marker(pixel, radius, fill, color)?;
            tooltips.push(Tooltip {
                rect: [pixel.0 - 9, pixel.1 - 9, 18, 18],
                text: point.tooltip(self),
            });
            markers.push((pixel, if medium.is_terminal() { 1 } else { radius + 1 }));
            let number = point.number.map(|n| n.to_string());
            let label = number.or_else(|| point.is_base.then(|| point.name.clone()));
            labels.extend(label.map(|label| (pixel, label)));
        }
        labels.reverse();
        let places = place_labels(medium, &labels, &markers, area.bounds());
        for (place, (_, label)) in places.into_iter().zip(&labels) {
            if let Some(place) = place {
                area.write(label, place, INK, HPos::Left)?;
            }
        }
        // A keyboard steps through the front first.
        tooltips.reverse();
        Ok(tooltips)
    }
}
