//! Frame times of a bench over the frames of its scene, one line per loop.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::axis::Axis;
use super::bins::{Bin, bins};
use super::chart::{Chart, LegendEntry, Tooltip};
use super::medium::{MUTED, glyph, series};
use super::number::number;
use super::plot_area::{Canvas, GridLines, PlotArea};
use crate::measure::stats::percentile;
use crate::timing::compare::HEADLINE;
use crate::timing::frame_rows::FrameRow;
use crate::timing::names::{loop_name, sweep_text};
use crate::timing::results::BenchResults;

/// If a frame takes longer than this multiple of the 99th percentile, the axis is cut. Below that,
/// usual frames still fill a third of the height.
const CUT_ABOVE: f64 = 3.0;
/// End of a cut axis as a multiple of the 99th percentile: usual frames fill two thirds of the
/// height. A note counts the frames above it.
const CUT_AT: f64 = 1.5;
/// Smallest width of a bin in a picture, px: a little more than the median's line, which is 2 px.
const BIN_PX: i32 = 3;

/// The chart of one point of a sweep, or of a whole run without sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameChart {
    sweep: String,
    loops: Vec<Loop>,
    /// First frame and name of every phase, in order.
    phases: Vec<(u32, String)>,
}

#[derive(Debug, Clone, PartialEq)]
struct Loop {
    name: String,
    /// Frame and ms, in the order of execution.
    samples: Vec<(u32, f64)>,
}

/// Returns the charts of rows of frames.csv, without warm-up.
pub fn charts_of_rows<'a>(rows: impl IntoIterator<Item = &'a FrameRow>) -> Vec<FrameChart> {
    let mut charts = Vec::new();
    for row in rows.into_iter().filter(|row| row.is_timed()) {
        let name = loop_name(&row.threading, row.skip);
        add(&mut charts, [&row.sweep, &row.phase, &name], row.frame, row.frame_ms);
    }
    charts
}

/// Returns the charts of a bench's results, without the loops that draw nothing.
pub fn charts_of(results: &BenchResults) -> Vec<FrameChart> {
    let mut charts = Vec::new();
    for (case, mode, times) in results.timed().filter(|(case, mode, _)| !case.is_left_out(mode)) {
        let (sweep, name) = (sweep_text(&case.sweep), mode.name());
        let phase = case.phase.as_deref().unwrap_or_default();
        for (frame, ms) in
            times.frames.iter().zip(times.times(HEADLINE).iter().flat_map(|b| &b.values))
        {
            add(&mut charts, [&sweep, phase, &name], *frame, *ms);
        }
    }
    charts
}

fn add(charts: &mut Vec<FrameChart>, [sweep, phase, name]: [&str; 3], frame: u32, ms: f64) {
    let i = charts.iter().position(|c| c.sweep == sweep).unwrap_or_else(|| {
        charts.push(FrameChart { sweep: sweep.to_owned(), loops: Vec::new(), phases: Vec::new() });
        charts.len() - 1
    });
    let FrameChart { loops, phases, .. } = &mut charts[i];
    match phases.iter_mut().find(|(_, other)| other == phase) {
        Some((first, _)) => *first = frame.min(*first),
        None => phases.push((frame, phase.to_owned())),
    }
    match loops.iter_mut().find(|l| l.name == name) {
        Some(found) => found.samples.push((frame, ms)),
        None => loops.push(Loop { name: name.to_owned(), samples: vec![(frame, ms)] }),
    }
}

impl FrameChart {
    fn samples(&self) -> impl Iterator<Item = &(u32, f64)> {
        self.loops.iter().flat_map(|l| &l.samples)
    }

    fn times(&self) -> Vec<f64> {
        self.samples().map(|(_, ms)| *ms).filter(|ms| ms.is_finite()).collect()
    }

    /// Returns the end of the axis of times, ms.
    fn top(&self) -> f64 {
        let times = self.times();
        let most = times.iter().copied().fold(0.0, f64::max);
        let usual = percentile(&times, 0.99).unwrap_or(0.0);
        if most > CUT_ABOVE * usual && usual > 0.0 { CUT_AT * usual } else { 1.05 * most }
    }

    fn draw_loop<DB: DrawingBackend>(
        &self,
        area: &PlotArea<'_, DB>,
        i: usize,
        bins: &[Bin],
        top: f64,
    ) -> DrawResult<(), DB> {
        let at = |bin: &Bin, ms: f64| (bin.middle(), ms.min(top));
        let color = series(i);
        if area.medium.is_terminal() {
            for bin in bins {
                area.line(&[bin.min, bin.max].map(|ms| at(bin, ms)), color)?;
            }
            return bins.iter().try_for_each(|bin| {
                let (x, ms) = at(bin, bin.median);
                area.glyph(glyph(i), area.pixel(x, ms), color)
            });
        }
        // Missing frames leave a gap in the line.
        for run in bins.chunk_by(|a, b| u64::from(a.last) + 1 >= u64::from(b.first)) {
            let above = run.iter().map(|bin| at(bin, bin.max));
            let below = run.iter().rev().map(|bin| at(bin, bin.min));
            area.polygon(&above.chain(below).collect::<Vec<_>>(), color.mix(0.2))?;
            let mut middle: Vec<(f64, f64)> = run.iter().map(|bin| at(bin, bin.median)).collect();
            if let [(x, ms)] = middle[..] {
                middle = vec![(x - 0.4, ms), (x + 0.4, ms)];
            }
            area.line(&middle, color.stroke_width(2))?;
        }
        Ok(())
    }

    fn draw_phases<DB: DrawingBackend>(
        &self,
        area: &PlotArea<'_, DB>,
        first_frame: u32,
        top: f64,
    ) -> DrawResult<(), DB> {
        let [_, upper, right, _] = area.bounds();
        let mut phases = self.phases.clone();
        phases.sort();
        let begin = |first: u32| f64::from(first) - 0.5;
        for (i, (first, name)) in
            phases.iter().enumerate().filter(|(_, (_, name))| !name.is_empty())
        {
            let x = begin(*first);
            if *first > first_frame {
                area.line(&[(x, 0.0), (x, top)], MUTED.stroke_width(1))?;
            }
            let left = area.pixel(x, 0.0).0 + area.medium.across(5, 1);
            let end = phases.get(i + 1).map_or(right, |(next, _)| area.pixel(begin(*next), 0.0).0);
            if left + area.medium.width_of(name) <= end {
                area.write(name, (left, upper + area.medium.down(9, 0)), MUTED, HPos::Left)?;
            }
        }
        Ok(())
    }
}

impl Chart for FrameChart {
    fn title(&self) -> String {
        let separator = if self.sweep.is_empty() { "" } else { ", " };
        format!("Frame time{separator}{}", self.sweep)
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let entry = |(i, l): (usize, &Loop)| LegendEntry::of_series(i, &l.name, None);
        self.loops.iter().enumerate().map(entry).collect()
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = vec![
            "line: median over the blocks of a frame or of neighbouring frames; band: minimum to \
             maximum"
                .to_owned(),
        ];
        let (times, top) = (self.times(), self.top());
        let n_above = times.iter().filter(|ms| **ms > top).count();
        if n_above > 0 {
            let most = number(times.iter().copied().fold(0.0, f64::max));
            let (n, top) = (times.len(), number(top));
            notes.push(format!(
                "{n_above} of {n} frames took longer than {top} ms, up to {most} ms"
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

    fn draw<DB: DrawingBackend>(&self, canvas: &Canvas<'_, DB>) -> DrawResult<Vec<Tooltip>, DB> {
        let (medium, (width, height)) = (canvas.medium, canvas.size());
        let frames = || self.samples().map(|(frame, _)| *frame);
        let (first, last) = (frames().min().unwrap_or(0), frames().max().unwrap_or(0));
        let ends = (f64::from(first) - 0.5, f64::from(last) + 0.5);
        let n_ticks = (width / medium.across(70, 9)) as usize;
        let mut x = Axis::linear("frame of the scene", ends.0, ends.1, n_ticks);
        // A tick between two frames would name a frame that does not exist.
        x.ticks.retain(|tick| tick.at.fract() == 0.0);
        let y = Axis::linear("ms", 0.0, self.top(), (height / medium.down(36, 2)) as usize);
        let area = PlotArea::new(canvas, &x, &y, GridLines::Horizontal)?;
        let [left, _, right, _] = area.bounds();
        let n_bins = ((right - left) / medium.across(BIN_PX, 1)).max(1) as usize;
        self.draw_phases(&area, first, y.range.end)?;
        for (i, l) in self.loops.iter().enumerate() {
            self.draw_loop(&area, i, &bins(&l.samples, first..=last, n_bins), y.range.end)?;
        }
        Ok(vec![])
    }
}
