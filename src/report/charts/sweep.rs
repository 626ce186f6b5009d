//! A measure against a swept key: one line for each value of a second key or each loop, and one
//! chart for each combination of the others.

mod bench;
mod study;

pub use bench::charts_of_run;
pub use study::charts_of_study;

use plotters::prelude::*;

use super::axis::{Axis, MARGIN, Tick};
use super::chart::{Chart, LegendEntry, Tooltip};
use super::medium::{SERIES_COLORS, glyph, series};
use super::number::with_interval;
use super::plot_area::{Canvas, GridLines, MarkerFill, PlotArea};
use crate::measure::figure::Figure;
use crate::measure::stats::extremes;
use crate::timing::names::{Setting, sweep_text};
use crate::timing::sweep::SIZE_KEY;

/// Greatest number of charts of a measure: six rows of two, about three screens.
const MOST_CHARTS: usize = 12;
/// Ratio of the greatest to the least value from which on an axis of keys is logarithmic. Swept
/// values that double three times are crowded on a linear axis.
const LOG_X_FROM: f64 = 8.0;
/// The same ratio of an axis of measured values. It is larger because a linear axis begins at 0,
/// which lets times be compared by eye.
const LOG_Y_FROM: f64 = 20.0;
/// Characters of a label that fit between ticks at their usual distance, 64 px or 9 columns, with
/// a gap of one or two characters.
const TICK_CHARS: usize = 7;

/// One measured figure at a point of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct SweptFigure {
    /// The point.
    pub point: Vec<Setting>,
    /// The loop; empty if there is only one kind.
    pub series: String,
    /// The figure.
    pub figure: Figure,
}

/// The chart of a measure against one key.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepChart {
    title: String,
    key: String,
    measure: String,
    /// Values of a key that are no numbers, in order; empty for numbers.
    categories: Vec<String>,
    lines: Vec<Line>,
    notes: Vec<String>,
}

#[derive(Debug, Clone, PartialEq)]
struct Line {
    name: String,
    points: Vec<Point>,
}

#[derive(Debug, Clone, PartialEq)]
struct Point {
    x: f64,
    figure: Figure,
    value: String,
}

/// Returns the charts of one measure; none if no key has two values.
pub fn charts(name: &str, measure: &str, figures: &[SweptFigure]) -> Vec<SweepChart> {
    let keys = varied_keys(figures);
    let Some(i_x) = x_key(&keys) else { return vec![] };
    let (key, values) = &keys[i_x];
    let others: Vec<&(String, Vec<String>)> = keys.iter().filter(|(k, _)| k != key).collect();
    // More lines than colours could not be told apart.
    let fits = |n: usize| (2..=SERIES_COLORS.len()).contains(&n);
    let line_key = others
        .iter()
        .filter(|(_, values)| fits(values.len()))
        .rev()
        .max_by_key(|(_, values)| values.len())
        .map(|(k, _)| k.as_str());
    let value_of = |f: &SweptFigure, key: &str| {
        f.point.iter().find(|s| s.key == key).map_or(String::new(), |s| s.value.clone())
    };
    let numbers = numbers(key, values);
    // With one key the loops are the lines; with several they are charts of their own.
    let line_name = |f: &SweptFigure| match line_key {
        Some(k) => format!("{k}={}", value_of(f, k)),
        None => f.series.clone(),
    };
    let panel_keys: Vec<&str> =
        others.iter().map(|(k, _)| k.as_str()).filter(|k| Some(*k) != line_key).collect();
    let panel_name = |f: &SweptFigure| -> Vec<String> {
        let is_of_panel = |s: &&Setting| panel_keys.contains(&s.key.as_str());
        let rest: Vec<Setting> = f.point.iter().filter(is_of_panel).cloned().collect();
        let series = Some(&f.series).filter(|s| line_key.is_some() && !s.is_empty());
        [sweep_text(&rest)].into_iter().chain(series.cloned()).filter(|s| !s.is_empty()).collect()
    };
    let mut all: Vec<(Vec<String>, SweepChart)> = Vec::new();
    for f in figures.iter().filter(|f| f.figure.value.is_finite()) {
        let (panel, value) = (panel_name(f), value_of(f, key));
        let Some(x) = values.iter().position(|v| *v == value) else { continue };
        let i = all.iter().position(|(name, _)| *name == panel).unwrap_or_else(|| {
            let title = [vec![format!("{name} against {key}")], panel.clone()].concat().join(", ");
            all.push((panel, empty(title, key, measure, values, numbers.is_some())));
            all.len() - 1
        });
        let x = numbers.as_ref().map_or(x as f64, |numbers| numbers[x]);
        all[i].1.add(line_name(f), Point { x, figure: f.figure, value });
    }
    let mut charts: Vec<SweepChart> = all.into_iter().map(|(_, chart)| chart).collect();
    let n_charts = charts.len();
    // A chart of a single value would only repeat the table.
    charts.retain(|chart| chart.swept().len() > 1);
    charts.truncate(MOST_CHARTS);
    let n_more = n_charts - charts.len();
    finish(&mut charts, n_more);
    charts
}

fn empty(
    title: String,
    key: &str,
    measure: &str,
    values: &[String],
    is_number: bool,
) -> SweepChart {
    let categories = if is_number { vec![] } else { values.to_vec() };
    let (key, measure) = (key.to_owned(), measure.to_owned());
    SweepChart { title, key, measure, categories, lines: vec![], notes: vec![] }
}

/// Sorts the points, and adds notes on intervals and on `n_more` charts that are left out.
fn finish(charts: &mut [SweepChart], n_more: usize) {
    for chart in charts.iter_mut() {
        for line in &mut chart.lines {
            line.points.sort_by(|a, b| a.x.total_cmp(&b.x));
        }
        if chart.lines.iter().flat_map(|l| &l.points).any(|p| p.figure.low.is_none()) {
            chart.notes.push(NO_INTERVAL.to_owned());
        }
    }
    if let (Some(last), true) = (charts.last_mut(), n_more > 0) {
        last.notes.push(more_charts_text(n_more));
    }
}

/// Note of a chart with points that have no interval.
const NO_INTERVAL: &str = "a point without a bar has too few values for a confidence interval";

fn more_charts_text(n: usize) -> String {
    let charts = if n == 1 { "chart is" } else { "charts are" };
    format!("{n} more {charts} not drawn; the table has all values")
}

/// Returns the keys with more than one value, and their values, in order.
fn varied_keys(figures: &[SweptFigure]) -> Vec<(String, Vec<String>)> {
    let mut keys: Vec<(String, Vec<String>)> = Vec::new();
    for Setting { key, value } in figures.iter().flat_map(|f| &f.point) {
        match keys.iter_mut().find(|(k, _)| k == key) {
            Some((_, values)) if values.contains(value) => {}
            Some((_, values)) => values.push(value.clone()),
            None => keys.push((key.clone(), vec![value.clone()])),
        }
    }
    keys.retain(|(_, values)| values.len() > 1);
    keys
}

/// Returns the index of the key for the x axis. Keys of numbers are preferred, then keys with more
/// values, then earlier keys.
fn x_key(keys: &[(String, Vec<String>)]) -> Option<usize> {
    let rank = |i: &usize| {
        let (key, values) = &keys[*i];
        (numbers(key, values).is_some(), values.len(), usize::MAX - i)
    };
    (0..keys.len()).max_by_key(rank)
}

/// Returns the values of a key as numbers; `None` if they are not numbers or not distinct. A size
/// of a picture becomes its number of pixels.
fn numbers(key: &str, values: &[String]) -> Option<Vec<f64>> {
    let number = |value: &String| {
        let pixels = || {
            let (w, h) = value.split_once('x')?;
            Some(w.parse::<f64>().ok()? * h.parse::<f64>().ok()?)
        };
        let number = if key == SIZE_KEY { pixels() } else { value.parse().ok() };
        number.filter(|v| v.is_finite())
    };
    let numbers: Option<Vec<f64>> = values.iter().map(number).collect();
    // Two sizes may have the same number of pixels.
    numbers.filter(|all| (1..all.len()).all(|i| !all[..i].contains(&all[i])))
}

impl SweepChart {
    fn add(&mut self, name: String, point: Point) {
        match self.lines.iter_mut().find(|line| line.name == name) {
            Some(line) => line.points.push(point),
            None => self.lines.push(Line { name, points: vec![point] }),
        }
    }

    fn points(&self) -> impl Iterator<Item = &Point> {
        self.lines.iter().flat_map(|line| &line.points)
    }

    /// Returns the swept values in order, each with its text as given.
    fn swept(&self) -> Vec<(f64, &str)> {
        let mut values: Vec<(f64, &str)> = self.points().map(|p| (p.x, p.value.as_str())).collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        values.dedup_by_key(|(x, _)| *x);
        values
    }

    fn x_axis(&self, n_ticks: usize) -> Axis {
        let n = self.categories.len();
        if n > 0 {
            let mut axis = Axis::linear(&self.key, -0.5, n as f64 - 0.5, n_ticks);
            let tick = |(i, text): (usize, &String)| Tick { at: i as f64, text: text.clone() };
            axis.ticks = self.categories.iter().enumerate().map(tick).collect();
            return axis;
        }
        let name = if self.key == SIZE_KEY { "size, pixels" } else { &self.key };
        let values = || self.points().map(|p| p.x);
        let (low, high) = extremes(values()).unwrap_or((0.0, 1.0));
        let mut axis = if low > 0.0 && high / low >= LOG_X_FROM {
            Axis::log(name, values(), false, n_ticks)
        } else {
            let margin = MARGIN * (high - low);
            Axis::linear(name, low - margin, high + margin, n_ticks)
        };
        let tick =
            |(v, text): (f64, &str)| Some(Tick { at: axis.position(v)?, text: text.to_owned() });
        let ticks: Vec<Tick> = self.swept().into_iter().filter_map(tick).collect();
        // The swept values themselves are the ticks where their labels have room.
        let apart = (axis.range.end - axis.range.start) / n_ticks.max(1) as f64;
        let has_room = |pair: &[Tick]| {
            let n_chars = pair[0].text.chars().count().max(pair[1].text.chars().count());
            let share = n_chars as f64 / TICK_CHARS as f64;
            pair[1].at - pair[0].at >= apart * share.max(1.0)
        };
        if ticks.windows(2).all(has_room) {
            axis.ticks = ticks;
        }
        axis
    }

    fn y_axis(&self, n_ticks: usize) -> Axis {
        let ends = |p: &Point| [Some(p.figure.value), p.figure.low, p.figure.high];
        let values = || self.points().flat_map(ends).flatten().filter(|v| v.is_finite());
        let (least, most) = extremes(self.points().map(|p| p.figure.value)).unwrap_or((0.0, 1.0));
        if least > 0.0 && most / least >= LOG_Y_FROM {
            return Axis::log(&self.measure, values(), false, n_ticks);
        }
        let high = values().fold(0.0, f64::max);
        Axis::linear(&self.measure, 0.0, (1.0 + MARGIN) * high, n_ticks)
    }

    fn tooltip(&self, line: &Line, point: &Point) -> String {
        let Figure { value, low, high } = point.figure;
        let name = if line.name.is_empty() { String::new() } else { format!("\n{}", line.name) };
        format!(
            "{}={}{name}\n{}: {}",
            self.key,
            point.value,
            self.measure,
            with_interval(value, low, high)
        )
    }
}

impl Chart for SweepChart {
    fn title(&self) -> String {
        self.title.clone()
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let entry = |(i, line): (usize, &Line)| {
            LegendEntry::of_series(i, &line.name, Some(MarkerFill::Full))
        };
        self.lines.iter().enumerate().filter(|(_, l)| !l.name.is_empty()).map(entry).collect()
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn size(&self) -> (u32, u32) {
        (640, 380 + 18 * self.notes.len() as u32)
    }

    fn rows(&self) -> usize {
        16
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &Canvas<'_, DB>) -> DrawResult<Vec<Tooltip>, DB> {
        let (medium, (width, height)) = (canvas.medium, canvas.size());
        let x = self.x_axis((width / medium.across(64, 9)) as usize);
        let y = self.y_axis((height / medium.down(36, 2)) as usize);
        let area = PlotArea::new(canvas, &x, &y, GridLines::Both)?;
        if self.lines.is_empty() {
            return Ok(vec![]);
        }
        let mut tooltips = Vec::new();
        let n_lines = self.lines.len() as f64;
        for (i, line) in self.lines.iter().enumerate() {
            let color = series(i);
            // Points of one category lie side by side, so that their intervals do not overlap.
            let aside = if self.categories.is_empty() {
                0.0
            } else {
                0.4 * (i as f64 - 0.5 * (n_lines - 1.0)) / n_lines
            };
            let at = |p: &Point| Some((x.position(p.x)? + aside, y.position(p.figure.value)?));
            let places: Vec<(f64, f64)> = line.points.iter().filter_map(at).collect();
            if self.categories.is_empty() {
                area.line(&places, color.stroke_width(2))?;
            }
            for point in &line.points {
                let Some((px, py)) = at(point) else { continue };
                area.interval(&y, point.figure, |v| (px, v), color.stroke_width(1))?;
                let pixel = area.pixel(px, py);
                if medium.is_terminal() {
                    area.glyph(glyph(i), pixel, color)?;
                } else {
                    area.marker(pixel, 4, MarkerFill::Full, color)?;
                }
                tooltips.push(Tooltip {
                    rect: [pixel.0 - 8, pixel.1 - 8, 16, 16],
                    text: self.tooltip(line, point),
                });
            }
        }
        Ok(tooltips)
    }
}
