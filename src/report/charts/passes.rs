//! GPU time of a frame by pass: a bar per loop, with a part per pass.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::axis::Axis;
use super::bars::{bar_ends, draw_bar};
use super::chart::{Chart, LegendEntry, Tooltip, shortened};
use super::medium::{INK, MUTED, SERIES_COLORS, series};
use super::number::number;
use super::plot_area::{Canvas, GridLines, PlotArea};
use crate::timing::records::{Case, Mode, Pass, Run};
use crate::timing::still::marked_name;

/// Number of passes of a page with a colour of their own, so that no colour repeats. All others
/// share one.
const N_NAMED: usize = SERIES_COLORS.len() - 1;
/// Characters of a bar's name: about two thirds of a picture's width stay for the bars.
const NAME_LENGTH: usize = 40;

/// The passes that have colours of their own in the charts of a page, so that a pass has one colour
/// in all of them.
#[derive(Debug, Clone, PartialEq)]
pub struct PassColors {
    /// The most expensive passes, in the order of the frame.
    passes: Vec<String>,
}

/// The chart of a run's passes.
#[derive(Debug, Clone, PartialEq)]
pub struct PassChart {
    /// The passes with colours, in the order of the frame.
    passes: Vec<String>,
    bars: Vec<Bar>,
}

#[derive(Debug, Clone, PartialEq)]
struct Bar {
    name: String,
    /// Time of every one of `passes`, then of all others, ms.
    parts: Vec<f64>,
    tooltip: String,
}

impl PassColors {
    /// Returns the colours for the charts of these runs: of the passes with the greatest shares of
    /// the time of a run.
    pub fn of<'a>(runs: impl Iterator<Item = &'a Run> + Clone) -> PassColors {
        let mut shares: Vec<(&str, f64)> = Vec::new();
        for (name, share) in runs.clone().flat_map(shares_of) {
            match shares.iter_mut().find(|(other, _)| *other == name) {
                Some((_, most)) => *most = most.max(share),
                None => shares.push((name, share)),
            }
        }
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        shares.truncate(N_NAMED);
        // In the order of the frame, so that pages of one scene have the same colours.
        let mut passes: Vec<String> = Vec::new();
        for Pass { name, .. } in runs.flat_map(passes_of) {
            if shares.iter().any(|(other, _)| other == name) && !passes.contains(name) {
                passes.push(name.clone());
            }
        }
        PassColors { passes }
    }
}

fn passes_of(run: &Run) -> impl Iterator<Item = &Pass> {
    run.modes().flat_map(|(_, mode)| &mode.passes)
}

/// Returns the passes that take time in a run, and their shares of the time of all passes.
fn shares_of(run: &Run) -> Vec<(&str, f64)> {
    let mut sums: Vec<(&str, f64)> = Vec::new();
    for (pass, ms) in passes_of(run).filter_map(|p| Some((p, ms_of_frame(p)?))) {
        match sums.iter_mut().find(|(name, _)| *name == pass.name) {
            Some((_, sum)) => *sum += ms,
            None => sums.push((&pass.name, ms)),
        }
    }
    sums.retain(|(_, sum)| *sum > 0.0);
    let all: f64 = sums.iter().map(|(_, sum)| sum).sum();
    sums.iter().map(|(name, sum)| (*name, sum / all)).collect()
}

/// Returns the time of a pass in an average frame, ms: the median of the frames that run the pass,
/// times their share of all frames.
pub fn ms_of_frame(pass: &Pass) -> Option<f64> {
    let n = pass.n_run as f64 + pass.n_skipped as f64;
    pass.p50_ms.filter(|ms| ms.is_finite() && n > 0.0).map(|ms| ms * pass.n_run as f64 / n)
}

/// Returns the chart of a run with the colours of its page, or None if no pass was timed.
pub fn chart(run: &Run, PassColors { passes }: &PassColors) -> Option<PassChart> {
    let timed =
        run.modes().filter(|(_, mode)| mode.passes.iter().any(|p| ms_of_frame(p).is_some()));
    let bar = |(case, mode): (&Case, &Mode)| {
        let name = marked_name(case, mode);
        Bar { parts: parts(mode, passes), tooltip: tooltip(&name, mode), name }
    };
    let bars = timed.map(bar).collect();
    let takes_time = passes_of(run).filter_map(ms_of_frame).any(|ms| ms > 0.0);
    takes_time.then(|| PassChart { passes: passes.clone(), bars })
}

fn parts(mode: &Mode, passes: &[String]) -> Vec<f64> {
    let mut parts = vec![0.0; passes.len() + 1];
    for pass in &mode.passes {
        let i = passes.iter().position(|name| *name == pass.name).unwrap_or(passes.len());
        parts[i] += ms_of_frame(pass).unwrap_or(0.0);
    }
    parts
}

fn tooltip(name: &str, mode: &Mode) -> String {
    let mut text = name.to_owned();
    for p in &mode.passes {
        let Some(ms) = ms_of_frame(p).filter(|ms| *ms > 0.0) else { continue };
        text += &format!("\n{}: {} ms", p.name, number(ms));
        if p.n_skipped > 0 {
            let n = p.n_run.saturating_add(p.n_skipped);
            text += &format!(", ran in {} of {n} frames", p.n_run);
        }
    }
    text
}

impl PassChart {
    /// Returns a character for every pass and for the others: the first letter of the pass's name
    /// that no pass before it has.
    fn letters(&self) -> Vec<char> {
        let mut letters: Vec<char> = Vec::new();
        for name in &self.passes {
            let free = name.chars().find(|c| !letters.contains(c) && *c != '.').unwrap_or('#');
            letters.push(free);
        }
        letters.push('.');
        letters
    }

    fn color(&self, i: usize) -> RGBColor {
        if i < self.passes.len() { series(i) } else { MUTED }
    }
}

impl Chart for PassChart {
    fn title(&self) -> String {
        "GPU time of an average frame by pass".to_owned()
    }

    fn legend(&self) -> Vec<LegendEntry> {
        // Passes of other charts of the page do not appear in the legend.
        let is_shown = |i: usize| self.bars.iter().any(|bar| bar.parts[i] > 0.0);
        let names = self.passes.iter().cloned().chain(["others".to_owned()]);
        let entry = |(i, (name, glyph))| {
            is_shown(i).then(|| LegendEntry { color: self.color(i), glyph, name, marker: None })
        };
        names.zip(self.letters()).enumerate().filter_map(entry).collect()
    }

    fn notes(&self) -> Vec<String> {
        vec![
            "for every pass: the median of the frames that run it, times their share of all frames"
                .to_owned(),
        ]
    }

    fn size(&self) -> (u32, u32) {
        (900, 150 + 26 * self.bars.len() as u32)
    }

    fn rows(&self) -> usize {
        self.bars.len() + 3
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &Canvas<'_, DB>) -> DrawResult<Vec<Tooltip>, DB> {
        let (medium, (width, _)) = (canvas.medium, canvas.size());
        let n = self.bars.len();
        let names: Vec<String> =
            self.bars.iter().map(|b| shortened(&b.name, NAME_LENGTH)).collect();
        let longest = self.bars.iter().map(|b| b.parts.iter().sum()).fold(0.0, f64::max);
        // Room for the sum behind the longest bar, if names take 200 px or 30 columns of the width.
        let room =
            f64::from(medium.across(70, 10)) / f64::from((width - medium.across(200, 30)).max(1));
        let n_ticks = (width / medium.across(80, 10)) as usize;
        let x = Axis::linear("ms of a frame", 0.0, longest * (1.0 + room), n_ticks);
        let area = PlotArea::new(canvas, &x, &Axis::rows(&names), GridLines::Vertical)?;
        let letters = self.letters();
        let mut tooltips = Vec::new();
        for (i, bar) in self.bars.iter().enumerate() {
            let mut from = 0.0;
            for (part, (ms, glyph)) in bar.parts.iter().zip(&letters).enumerate() {
                draw_bar(&area, (i, n), (from, from + ms), self.color(part), *glyph)?;
                from += ms;
            }
            let (upper, lower) = bar_ends(&area, i, n);
            let (left, right) = (area.pixel(0.0, 0.0).0, area.pixel(from, 0.0).0);
            let at = (right + medium.across(6, 2), (upper + lower) / 2);
            area.write(&number(from), at, INK, HPos::Left)?;
            let rect = [left, upper, (right - left).max(4), lower - upper];
            tooltips.push(Tooltip { rect, text: bar.tooltip.clone() });
        }
        Ok(tooltips)
    }
}
