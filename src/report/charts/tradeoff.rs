//! Time against error: every configuration of a study with its intervals, and the front of those
//! that none beats in both.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::axis::Axis;
use super::labels::placed;
use super::look::{INK, Look, MUTED, series};
use super::number::{number, with_interval};
use super::plane::{Behind, Fill, Plane};
use super::{Key, Mark, Place, Plot};
use crate::studies::error::records::{Configuration, Front, PictureError, Study};
use crate::studies::provenance::Figure;

/// Lines that say what numbers in the chart stand for.
const N_NAMED: usize = 14;
/// Letters of such a line.
const N_LETTERS: usize = 112;
/// Of the intervals of what is behind the front.
const FAINT: f64 = 0.55;
/// Ends of intervals do not stretch an axis beyond this factor of the outermost values: they run to
/// its end.
const INTERVAL_REACH: f64 = 3.0;

#[derive(Debug, Clone)]
pub struct TradeoffChart {
    title: String,
    time_name: String,
    error_name: String,
    points: Vec<Point>,
    /// Configurations without a time or an error that can be drawn.
    n_left_out: usize,
}

#[derive(Debug, Clone)]
struct Point {
    name: String,
    time: Figure,
    error: Figure,
    front: Front,
    /// On the front, from the fastest.
    number: Option<usize>,
    is_base: bool,
}

/// The chart of a study.
pub fn chart(study: &Study) -> TradeoffChart {
    let numbers = front_numbers(study);
    let of = |(i, c): (usize, &Configuration)| {
        let (time, error) = (time_of(study, c)?, error_of(study, c)?);
        let can_be_drawn = time.value.is_finite()
            && time.value > 0.0
            && error.value.is_finite()
            && error.value >= 0.0;
        let (name, front) = (c.name.clone(), c.front);
        can_be_drawn.then(|| Point {
            name,
            time,
            error,
            front,
            number: numbers[i],
            is_base: i == 0,
        })
    };
    let points: Vec<Point> = study.configurations.iter().enumerate().filter_map(of).collect();
    TradeoffChart {
        title: "Time against error".to_owned(),
        time_name: format!(
            "{} of a frame, ms",
            if study.time == "gpu" { "GPU time" } else { "time" }
        ),
        error_name: format!(
            "{} from the reference \"{}\"",
            metric_name(&study.metric),
            study.reference.against
        ),
        n_left_out: study.configurations.len() - points.len(),
        points,
    }
}

/// A metric as people call it.
pub fn metric_name(metric: &str) -> &str {
    match metric {
        "rmse" => "RMSE",
        "max" => "greatest difference",
        "relmse" => "relMSE",
        other => other,
    }
}

/// The time that decides.
pub fn time_of(study: &Study, configuration: &Configuration) -> Option<Figure> {
    if study.time == "gpu" { configuration.gpu_ms } else { configuration.frame_ms }
}

/// The error that decides.
pub fn error_of(study: &Study, configuration: &Configuration) -> Option<Figure> {
    let bare = |value| Figure { value, low: None, high: None };
    let of = |error: PictureError| match study.metric.as_str() {
        "max" => bare(error.max),
        "relmse" => bare(error.relmse),
        _ => error.rmse,
    };
    configuration.error.map(of)
}

/// For each configuration its number in the chart: those on the front, from the fastest, count from
/// 1.
pub fn front_numbers(study: &Study) -> Vec<Option<usize>> {
    let time =
        |i: usize| time_of(study, &study.configurations[i]).map_or(f64::INFINITY, |t| t.value);
    let on = |i: &usize| study.configurations[*i].front == Front::On;
    let mut front: Vec<usize> = (0..study.configurations.len()).filter(on).collect();
    front.sort_by(|a, b| time(*a).total_cmp(&time(*b)));
    let mut numbers = vec![None; study.configurations.len()];
    for (number, i) in (1..).zip(front) {
        numbers[i] = Some(number);
    }
    numbers
}

impl Point {
    fn says(&self, chart: &TradeoffChart) -> String {
        let figure = |f: Figure| with_interval(f.value, f.low, f.high);
        let place = match self.front {
            Front::On => "on the front",
            Front::Near => "near the front",
            Front::Off => "behind the front",
            Front::Unknown => "not placed",
        };
        let Point { name, time, error, .. } = self;
        let (time_name, error_name) = (chart.time_name.trim_end_matches(", ms"), &chart.error_name);
        format!(
            "{name}\n{time_name}: {} ms\n{error_name}: {}\n{place}",
            figure(*time),
            figure(*error)
        )
    }

    fn look(&self) -> (Fill, RGBColor, i32) {
        match self.front {
            Front::On => (Fill::Full, series(0), 6),
            Front::Near => (Fill::Half, series(1), 5),
            Front::Off | Front::Unknown => (Fill::None, MUTED, 4),
        }
    }
}

impl TradeoffChart {
    /// The front from the fastest.
    fn front(&self) -> Vec<&Point> {
        let mut front: Vec<&Point> = self.points.iter().filter(|p| p.number.is_some()).collect();
        front.sort_by_key(|p| p.number);
        front
    }

    fn axes(&self, look: Look, (width, height): (i32, i32)) -> (Axis, Axis) {
        let axis = |name: &str, of: fn(&Point) -> Figure, with_zero: bool, n_ticks: i32| {
            let values = || self.points.iter().map(of).filter(|f| f.value > 0.0);
            let (least, most) = values()
                .fold((f64::INFINITY, 0.0f64), |(l, m), f| (l.min(f.value), m.max(f.value)));
            let ends = values()
                .flat_map(|f| [f.low, f.high])
                .flatten()
                .filter(|v| *v > 0.0 && v.is_finite());
            let ends = ends.map(|v| v.clamp(least / INTERVAL_REACH, most * INTERVAL_REACH));
            Axis::log(name, values().map(|f| f.value).chain(ends), with_zero, n_ticks as usize)
        };
        let with_zero = self.points.iter().any(|p| p.error.value == 0.0);
        (
            axis(&self.time_name, |p| p.time, false, width / look.across(80, 9)),
            axis(&self.error_name, |p| p.error, with_zero, height / look.down(36, 2)),
        )
    }
}

impl Plot for TradeoffChart {
    fn title(&self) -> String {
        self.title.clone()
    }

    fn keys(&self, _: Look) -> Vec<Key> {
        let key = |color, glyph, name: &str, fill| Key {
            color,
            glyph,
            name: name.to_owned(),
            mark: Some(fill),
        };
        vec![
            key(series(0), '●', "on the front: none is faster and nearer", Fill::Full),
            key(series(1), '◐', "near it, within the intervals", Fill::Half),
            key(MUTED, '○', "behind it", Fill::None),
        ]
    }

    fn notes(&self) -> Vec<String> {
        let front = self.front();
        let line = |p: &&Point| {
            let Point { name, time, error, number: n, .. } = p;
            let line = format!(
                "{}) {} ms, {}: {name}",
                n.unwrap_or(0),
                number(time.value),
                number(error.value)
            );
            shortened(&line, N_LETTERS)
        };
        let mut notes: Vec<String> = front.iter().take(N_NAMED).map(line).collect();
        if front.len() > N_NAMED {
            notes.push(format!("and {} more on the front", front.len() - N_NAMED));
        }
        match self.n_left_out {
            0 => {}
            1 => notes.push("1 configuration has no time or no error and is not drawn".to_owned()),
            n => {
                notes.push(format!("{n} configurations have no time or no error and are not drawn"))
            }
        }
        notes
    }

    fn draw<DB: DrawingBackend>(&self, place: &Place<'_, DB>) -> DrawResult<Vec<Mark>, DB> {
        let look = place.look;
        let (x, y) = self.axes(look, place.size());
        let plane = Plane::new(place, &x, &y, Behind::Both)?;
        if self.points.is_empty() {
            let [left, top, right, bottom] = plane.bounds();
            let middle = ((left + right) / 2, (top + bottom) / 2);
            plane.write("nothing was both timed and compared", middle, MUTED, HPos::Center)?;
            return Ok(vec![]);
        }
        let at = |p: &Point| Some((x.at(p.time.value)?, y.at(p.error.value)?));
        let drawn: Vec<(&Point, (f64, f64))> =
            self.points.iter().filter_map(|p| Some((p, at(p)?))).collect();
        // What matters most is drawn last, over the rest.
        let mut order: Vec<usize> = (0..drawn.len()).collect();
        let rank = |p: &Point| match p.front {
            Front::Off | Front::Unknown => 0,
            Front::Near => 1,
            Front::On => 2,
        };
        order.sort_by_key(|i| (rank(drawn[*i].0), std::cmp::Reverse(drawn[*i].0.number)));
        let drawn: Vec<(&Point, (f64, f64))> = order.into_iter().map(|i| drawn[i]).collect();
        // To the right, then down: as slow as the next, no error is less than this one's.
        let on: Vec<(f64, f64)> = self.front().into_iter().filter_map(at).collect();
        let step = |pair: &[(f64, f64)]| [pair[0], (pair[1].0, pair[0].1), pair[1]];
        plane.line(&on.windows(2).flat_map(step).collect::<Vec<_>>(), series(0).stroke_width(2))?;
        for (point, (px, py)) in &drawn {
            let (_, color, _) = point.look();
            let is_behind = matches!(point.front, Front::Off | Front::Unknown);
            if is_behind && look.characters {
                // Lines of dots would cover what matters.
                continue;
            }
            let style = color.mix(if is_behind { FAINT } else { 1.0 });
            if let (Some(low), Some(high)) = (point.time.low, point.time.high) {
                let ends = [(x.end_at(low), *py), (x.end_at(high), *py)];
                plane.whisker(ends, [low, high].map(|v| x.shows(v)), style)?;
            }
            if let (Some(low), Some(high)) = (point.error.low, point.error.high) {
                let ends = [(*px, y.end_at(low)), (*px, y.end_at(high))];
                plane.whisker(ends, [low, high].map(|v| y.shows(v)), style)?;
            }
        }
        let mut marks = Vec::new();
        let mut round = Vec::new();
        for (point, (px, py)) in &drawn {
            let (fill, color, radius) = point.look();
            let pixel = plane.pixel(*px, *py);
            plane.point(pixel, radius, fill, color)?;
            marks.push(Mark::around(pixel, 9, point.says(self)));
            round.push((pixel, if look.characters { 1 } else { radius + 1 }));
        }
        let named = |p: &Point| match p.number {
            Some(number) => Some(number.to_string()),
            None => p.is_base.then(|| p.name.clone()),
        };
        let texts: Vec<_> = drawn
            .iter()
            .filter_map(|(p, at)| Some((plane.pixel(at.0, at.1), named(p)?)))
            .rev()
            .collect();
        for (place, (_, text)) in
            placed(look, &texts, &round, plane.bounds()).into_iter().zip(&texts)
        {
            if let Some(place) = place {
                plane.write(text, place, INK, HPos::Left)?;
            }
        }
        // In the order of the front, and then what is behind it: as a keyboard goes through them.
        marks.reverse();
        Ok(marks)
    }
}

/// At most `n` letters.
pub(super) fn shortened(text: &str, n: usize) -> String {
    if text.chars().count() <= n {
        return text.to_owned();
    }
    text.chars().take(n - 1).chain(['…']).collect()
}
