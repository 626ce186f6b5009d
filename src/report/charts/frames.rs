//! Frame times of a bench over the frames of its scene, a line a loop.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::axis::Axis;
use super::bins::{Bin, bins};
use super::look::{Look, MUTED, glyph, series};
use super::number::number;
use super::plane::{Behind, Plane};
use super::{Key, Mark, Place, Plot};
use crate::measure::stats::percentile;
use crate::timing::frame_rows::FrameRow;
use crate::timing::names::sweep_text;
use crate::timing::results::BenchResults;

/// Where single frames take more than so many times the 99th percentile, they do not flatten all
/// others: the axis ends below, and a note counts them.
const CUT_ABOVE: f64 = 3.0;
/// Where it then ends, by the 99th percentile.
const CUT_AT: f64 = 1.5;
/// px of a picture that a bin takes at least.
const BIN_PX: i32 = 3;

/// One point of a sweep, or the whole run where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameChart {
    sweep: String,
    loops: Vec<Loop>,
    /// First frame and name of each, in order.
    phases: Vec<(u32, String)>,
}

#[derive(Debug, Clone, PartialEq)]
struct Loop {
    name: String,
    /// Frame and ms, in the order they ran.
    samples: Vec<(u32, f64)>,
}

/// A timed frame.
struct Sample<'a> {
    sweep: &'a str,
    phase: &'a str,
    loop_name: &'a str,
    frame: u32,
    ms: f64,
}

/// The charts of rows of frames.csv; warm-up is left out.
pub fn charts_of_rows(rows: &[FrameRow]) -> Vec<FrameChart> {
    let mut charts = Vec::new();
    for row in rows.iter().filter(|row| !row.warm_up) {
        let loop_name = loop_name(&row.threading, row.skip);
        let (sweep, phase) = (row.sweep.as_str(), row.phase.as_str());
        let sample =
            Sample { sweep, phase, loop_name: &loop_name, frame: row.frame, ms: row.frame_ms };
        add(&mut charts, &sample);
    }
    charts
}

/// The charts of results that were read back.
pub fn charts_of(recorded: &BenchResults) -> Vec<FrameChart> {
    let mut charts = Vec::new();
    // Loops without a timed frame are not in `recorded.modes`.
    let timed = recorded
        .run
        .cases
        .iter()
        .flat_map(|c| c.modes.iter().filter(|m| m.frames > 0).map(move |m| (c, m)));
    for ((case, mode), times) in timed.zip(&recorded.modes) {
        let (sweep, loop_name) = (sweep_text(&case.sweep), loop_name(&mode.threading, mode.skip));
        let phase = case.phase.as_deref().unwrap_or_default();
        for (frame, ms) in times.frames.iter().zip(times.blocks.iter().flatten()) {
            add(
                &mut charts,
                &Sample { sweep: &sweep, phase, loop_name: &loop_name, frame: *frame, ms: *ms },
            );
        }
    }
    charts
}

fn loop_name(threading: &str, skip: bool) -> String {
    if skip { threading.to_owned() } else { format!("{threading} no-skip") }
}

fn add(charts: &mut Vec<FrameChart>, sample: &Sample<'_>) {
    let Sample { sweep, phase, loop_name, frame, ms } = *sample;
    let i = charts.iter().position(|c| c.sweep == sweep).unwrap_or_else(|| {
        charts.push(FrameChart { sweep: sweep.to_owned(), loops: Vec::new(), phases: Vec::new() });
        charts.len() - 1
    });
    let chart = &mut charts[i];
    match chart.phases.iter_mut().find(|(_, name)| name == phase) {
        Some((first, _)) => *first = frame.min(*first),
        None => chart.phases.push((frame, phase.to_owned())),
    }
    match chart.loops.iter_mut().find(|l| l.name == loop_name) {
        Some(of) => of.samples.push((frame, ms)),
        None => chart.loops.push(Loop { name: loop_name.to_owned(), samples: vec![(frame, ms)] }),
    }
}

impl FrameChart {
    fn times(&self) -> Vec<f64> {
        let all = self.loops.iter().flat_map(|l| &l.samples).map(|(_, ms)| *ms);
        all.filter(|ms| ms.is_finite()).collect()
    }

    /// Where the axis of times ends, and how many frames took longer.
    fn top(&self) -> (f64, usize) {
        let times = self.times();
        let most = times.iter().copied().fold(0.0, f64::max);
        let usual = percentile(&times, 0.99).unwrap_or(0.0);
        let top =
            if most > CUT_ABOVE * usual && usual > 0.0 { CUT_AT * usual } else { 1.05 * most };
        (top, times.iter().filter(|ms| **ms > top).count())
    }

    fn range(&self) -> (u32, u32) {
        let frames = || self.loops.iter().flat_map(|l| &l.samples).map(|(frame, _)| *frame);
        (frames().min().unwrap_or(0), frames().max().unwrap_or(0))
    }

    fn draw_loop<DB: DrawingBackend>(
        &self,
        plane: &Plane<'_, DB>,
        i: usize,
        found: &[Bin],
        top: f64,
    ) -> DrawResult<(), DB> {
        let at = |bin: &Bin, ms: f64| (bin.middle(), ms.min(top));
        if plane.look.characters {
            for bin in found {
                let [least, most] = [bin.min, bin.max].map(|ms| at(bin, ms));
                plane.line(&[least, most], series(i))?;
            }
            for bin in found {
                let (x, ms) = at(bin, bin.median);
                plane.glyph(glyph(i), plane.pixel(x, ms), series(i))?;
            }
            return Ok(());
        }
        // A gap in the frames is a gap in the line.
        for run in found.chunk_by(|a, b| u64::from(a.last) + 1 >= u64::from(b.first)) {
            let above = run.iter().map(|bin| at(bin, bin.max));
            let below = run.iter().rev().map(|bin| at(bin, bin.min));
            plane.area(&above.chain(below).collect::<Vec<_>>(), series(i).mix(0.2))?;
            let middle: Vec<(f64, f64)> = run.iter().map(|bin| at(bin, bin.median)).collect();
            if let [(x, ms)] = middle[..] {
                plane.line(&[(x - 0.4, ms), (x + 0.4, ms)], series(i).stroke_width(2))?;
            }
            plane.line(&middle, series(i).stroke_width(2))?;
        }
        Ok(())
    }

    fn draw_phases<DB: DrawingBackend>(
        &self,
        plane: &Plane<'_, DB>,
        range: (u32, u32),
        top: f64,
    ) -> DrawResult<(), DB> {
        let [_, upper, right, _] = plane.bounds();
        let mut phases = self.phases.clone();
        phases.sort();
        for (i, (first, name)) in
            phases.iter().enumerate().filter(|(_, (_, name))| !name.is_empty())
        {
            let x = f64::from(*first) - 0.5;
            if *first > range.0 {
                plane.line(&[(x, 0.0), (x, top)], MUTED.stroke_width(1))?;
            }
            let begin = plane.pixel(x, 0.0).0;
            let end = phases
                .get(i + 1)
                .map_or(right, |(next, _)| plane.pixel(f64::from(*next) - 0.5, 0.0).0);
            let (gap, down) = (plane.look.across(5, 1), plane.look.down(9, 0));
            if begin + gap + plane.look.width_of(name) <= end {
                plane.write(name, (begin + gap, upper + down), MUTED, HPos::Left)?;
            }
        }
        Ok(())
    }
}

impl Plot for FrameChart {
    fn title(&self) -> String {
        if self.sweep.is_empty() {
            "Frame time".to_owned()
        } else {
            format!("Frame time, {}", self.sweep)
        }
    }

    fn keys(&self, _: Look) -> Vec<Key> {
        let key = |(i, l): (usize, &Loop)| Key {
            color: series(i),
            glyph: glyph(i),
            name: l.name.clone(),
            mark: None,
        };
        self.loops.iter().enumerate().map(key).collect()
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = vec![
            "middle: median of a frame's blocks, or of neighbouring frames; about it: \
             least to greatest"
                .to_owned(),
        ];
        let (top, n_above) = self.top();
        if n_above > 0 {
            let most = self.times().into_iter().fold(0.0, f64::max);
            let (top, most) = (number(top), number(most));
            notes.push(format!(
                "{n_above} of {} frames took longer than {top} ms, up to {most} ms",
                self.times().len()
            ));
        }
        notes
    }

    fn size(&self) -> (u32, u32) {
        (900, 360)
    }

    fn rows(&self) -> usize {
        16
    }

    fn draw<DB: DrawingBackend>(&self, place: &Place<'_, DB>) -> DrawResult<Vec<Mark>, DB> {
        let (width, height) = place.size();
        let (first, last) = self.range();
        let (top, _) = self.top();
        let n_ticks = (width / place.look.across(70, 9)) as usize;
        let mut x = Axis::linear(
            "frame of the scene",
            f64::from(first) - 0.5,
            f64::from(last) + 0.5,
            n_ticks,
        );
        // Frames are whole.
        x.ticks.retain(|tick| tick.at.fract() == 0.0);
        let y = Axis::linear("ms", 0.0, top, (height / place.look.down(36, 2)) as usize);
        let plane = Plane::new(place, &x, &y, Behind::Horizontal)?;
        let [left, _, right, _] = plane.bounds();
        let n_bins = ((right - left) / place.look.across(BIN_PX, 1)).max(1) as usize;
        self.draw_phases(&plane, (first, last), y.range.end)?;
        for (i, of) in self.loops.iter().enumerate() {
            self.draw_loop(&plane, i, &bins(&of.samples, first..=last, n_bins), y.range.end)?;
        }
        Ok(vec![])
    }
}
