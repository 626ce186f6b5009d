//! What the device's time of a frame goes to: a bar a loop, a part of it a pass.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::axis::Axis;
use super::bars::{bar, span};
use super::look::{INK, Look, MUTED, SERIES, series};
use super::number::number;
use super::plane::{Behind, Plane};
use super::tradeoff::shortened;
use super::{Key, Mark, Place, Plot};
use crate::timing::records::{Mode, Pass, Run};

/// Passes with a colour of their own; the others are drawn as one.
const N_NAMED: usize = SERIES.len() - 1;
/// Letters of a bar's name.
const N_LETTERS: usize = 40;

#[derive(Debug, Clone, PartialEq)]
pub struct PassChart {
    /// Those with a colour, the dearest, in the order of the frame.
    passes: Vec<String>,
    bars: Vec<Bar>,
}

#[derive(Debug, Clone, PartialEq)]
struct Bar {
    name: String,
    /// ms of `passes`, then of all others.
    parts: Vec<f64>,
    says: String,
}

/// ms that an average frame spends in a pass: its median while it runs, in the share of the frames
/// that run it.
pub fn ms_of_frame(pass: &Pass) -> Option<f64> {
    let n = pass.n_run as f64 + pass.n_skipped as f64;
    pass.p50_ms.filter(|ms| ms.is_finite() && n > 0.0).map(|ms| ms * pass.n_run as f64 / n)
}

/// The chart of a run; None where no pass was timed.
pub fn chart(run: &Run) -> Option<PassChart> {
    let loops: Vec<(String, &Mode)> = run
        .cases
        .iter()
        .flat_map(|c| c.modes.iter().map(move |m| (row_name(&c.name(), m), m)))
        .collect();
    let mut sums: Vec<(String, f64)> = Vec::new();
    for (pass, ms) in
        loops.iter().flat_map(|(_, m)| &m.passes).filter_map(|p| Some((p, ms_of_frame(p)?)))
    {
        match sums.iter_mut().find(|(name, _)| *name == pass.name) {
            Some((_, sum)) => *sum += ms,
            None => sums.push((pass.name.clone(), ms)),
        }
    }
    sums.retain(|(_, sum)| *sum > 0.0);
    sums.sort_by(|a, b| b.1.total_cmp(&a.1));
    sums.truncate(N_NAMED);
    // In the order of the frame, so that two runs of one scene have the same colours.
    let is_named = |pass: &&Pass| sums.iter().any(|(name, _)| *name == pass.name);
    let mut passes: Vec<String> = Vec::new();
    for pass in loops.iter().flat_map(|(_, mode)| &mode.passes).filter(is_named) {
        if !passes.contains(&pass.name) {
            passes.push(pass.name.clone());
        }
    }
    if passes.is_empty() {
        return None;
    }
    let timed =
        loops.into_iter().filter(|(_, mode)| mode.passes.iter().any(|p| ms_of_frame(p).is_some()));
    let bars = timed
        .map(|(name, mode)| Bar { parts: parts(mode, &passes), says: says(&name, mode), name })
        .collect();
    Some(PassChart { passes, bars })
}

/// A case's loop in words.
pub fn row_name(case: &str, mode: &Mode) -> String {
    let of = if mode.skip { mode.threading.clone() } else { format!("{} no-skip", mode.threading) };
    if case.is_empty() { of } else { format!("{case}: {of}") }
}

fn parts(mode: &Mode, passes: &[String]) -> Vec<f64> {
    let of = |name: &String| {
        mode.passes.iter().find(|p| p.name == *name).and_then(ms_of_frame).unwrap_or(0.0)
    };
    let named: Vec<f64> = passes.iter().map(of).collect();
    let others =
        mode.passes.iter().filter(|p| !passes.contains(&p.name)).filter_map(ms_of_frame).sum();
    named.into_iter().chain([others]).collect()
}

fn says(name: &str, mode: &Mode) -> String {
    let line = |p: &Pass| {
        let ms = ms_of_frame(p).filter(|ms| *ms > 0.0)?;
        let n = p.n_run.saturating_add(p.n_skipped);
        let ran = if p.n_skipped > 0 {
            format!(", ran in {} of {n} frames", p.n_run)
        } else {
            String::new()
        };
        Some(format!("{}: {} ms{ran}", p.name, number(ms)))
    };
    std::iter::once(name.to_owned())
        .chain(mode.passes.iter().filter_map(line))
        .collect::<Vec<_>>()
        .join("\n")
}

impl PassChart {
    fn longest(&self) -> f64 {
        self.bars.iter().map(|b| b.parts.iter().sum()).fold(0.0, f64::max)
    }

    /// In a terminal a part is a row of its pass' first letter; of two passes with one letter the
    /// second takes its next.
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

    fn has_others(&self) -> bool {
        self.bars.iter().any(|b| b.parts.last().is_some_and(|ms| *ms > 0.0))
    }
}

impl Plot for PassChart {
    fn title(&self) -> String {
        "GPU time of an average frame by pass".to_owned()
    }

    fn keys(&self, _: Look) -> Vec<Key> {
        let others = self.has_others().then(|| "others".to_owned());
        let names = self.passes.iter().cloned().chain(others).enumerate();
        let letters = self.letters();
        names
            .map(|(i, name)| Key {
                color: self.color(i),
                glyph: letters.get(i).copied().unwrap_or('.'),
                name,
                mark: None,
            })
            .collect()
    }

    fn notes(&self) -> Vec<String> {
        vec![
            "of every pass the median while it runs, times the share of the frames that run it"
                .to_owned(),
        ]
    }

    fn size(&self) -> (u32, u32) {
        (900, 150 + 26 * self.bars.len() as u32)
    }

    fn rows(&self) -> usize {
        self.bars.len() + 3
    }

    fn draw<DB: DrawingBackend>(&self, place: &Place<'_, DB>) -> DrawResult<Vec<Mark>, DB> {
        let (look, (width, _)) = (place.look, place.size());
        let n = self.bars.len();
        let names: Vec<String> = self.bars.iter().map(|b| shortened(&b.name, N_LETTERS)).collect();
        let room = look.across(70, 10);
        // Room for the sum behind the longest bar.
        let end = self.longest()
            * (1.0 + f64::from(room) / f64::from((width - look.across(200, 30)).max(1)));
        let x = Axis::linear("ms of a frame", 0.0, end, (width / look.across(80, 10)) as usize);
        let plane = Plane::new(place, &x, &Axis::rows(&names), Behind::Vertical)?;
        let letters = self.letters();
        let mut marks = Vec::new();
        for (i, of) in self.bars.iter().enumerate() {
            let mut from = 0.0;
            for (part, ms) in of.parts.iter().enumerate() {
                let glyph = letters.get(part).copied().unwrap_or('.');
                bar(&plane, (i, n), (from, from + ms), (self.color(part), 1.0), glyph)?;
                from += ms;
            }
            let (upper, lower) = span(&plane, i, n);
            let (left, right) = (plane.pixel(0.0, 0.0).0, plane.pixel(from, 0.0).0);
            plane.write(
                &number(from),
                (right + look.across(6, 2), (upper + lower) / 2),
                INK,
                HPos::Left,
            )?;
            marks.push(Mark {
                place: [left, upper, (right - left).max(4), lower - upper],
                says: of.says.clone(),
            });
        }
        Ok(marks)
    }
}
