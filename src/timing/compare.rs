//! Compares two results of a bench, measure by measure, from the times of single frames.
//!
//! A [`Verdict`] depends on the ratio of the medians and its 95 % interval. Only `frame` is the
//! headline; of twenty other measures of two runs that differ by the margin one will have a wrong
//! verdict.
//!
//! The interval covers the noise within each run, from frame to frame. It does not cover what
//! changes from one start of the program to the next, such as memory layout or other processes. The
//! blocks of one run show some of that: if they differ as much as A and B do, a remark says so.
//!
//! Where nothing moves in A or B, the loops that skip draw nothing and are not compared. The loop
//! without skipping then has the verdict.

use std::collections::BTreeSet;

use serde::Serialize;

use super::difference::{Difference, differences, remarks};
use super::intervals::{
    N_FRAMES_NEEDED, Pairing, block_len, ratio_interval, spread_of_blocks, values,
};
use super::records::Mode;
use super::results::{BenchResults, TimedMode};
use super::verdict::{Verdict, more_frames};
use crate::measure::blocked::Block;
use crate::measure::bootstrap::Interval;
use crate::measure::stats::median;

mod sizes;

pub use sizes::SizeComparison;

/// The measure that decides.
pub const HEADLINE: &str = "frame";

/// One measure of one loop, in A and B.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeasureComparison {
    /// Name of the measure.
    pub measure: String,
    /// Times in A.
    pub n_a: usize,
    /// Times in B.
    pub n_b: usize,
    /// Median of A in ms.
    pub a_ms: Option<f64>,
    /// Median of B in ms.
    pub b_ms: Option<f64>,
    /// median(B) / median(A) and its 95 % interval.
    pub b_by_a: Option<Interval>,
    /// Neighbouring frames that a resample draws together; null if whole blocks are compared.
    pub block_len: Option<usize>,
    /// The answer.
    pub verdict: Verdict,
    /// About how many more frames of A and of B would decide; null if the verdict is no "undecided"
    /// or the ratio lies on the margin.
    pub more_frames: Option<u64>,
}

/// One loop of one case that both A and B ran.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModeComparison {
    /// Phase, sweep and loop in words.
    pub name: String,
    /// `frame` first; without the passes that ran in neither.
    pub measures: Vec<MeasureComparison>,
}

impl ModeComparison {
    /// Returns the measure that decides.
    pub fn headline(&self) -> Option<&MeasureComparison> {
        self.measures.iter().find(|m| m.measure == HEADLINE)
    }
}

/// Two results of a bench, compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The conditions that differ.
    pub differences: Vec<Difference>,
    /// Every loop that both ran, but those that draw nothing.
    pub modes: Vec<ModeComparison>,
    /// The errors of the pictures of every case that both checked.
    pub errors: Vec<SizeComparison>,
    /// The most device memory, in bytes, of every case whose state both read.
    pub memory: Vec<SizeComparison>,
    /// Remarks on the runs and their frames.
    pub remarks: Vec<String>,
}

impl Comparison {
    /// Compares two results. Ratios from 1/(1 + `margin`) to 1 + `margin` count as no difference.
    pub fn new(a: &BenchResults, b: &BenchResults, margin: f64) -> Comparison {
        let left_out = left_out(a, b);
        let mut pairs = pairs(&a.modes, &b.modes);
        pairs.retain(|(of_a, _)| !left_out.contains(of_a.name.as_str()));
        let modes = compare_modes(&pairs, margin);
        let mut remarks = remarks(&a.run, &b.run);
        remarks.extend(still_remark(a, b, &left_out));
        remarks.extend(frame_remarks(&a.modes, &b.modes));
        remarks.extend(steadiness_remarks(&pairs, &modes));
        let errors = sizes::errors(&a.run, &b.run, margin);
        let memory = sizes::memory(&a.run, &b.run, margin);
        Comparison { differences: differences(&a.run, &b.run), modes, errors, memory, remarks }
    }
}

/// Returns a remark if a measure has too few frames for a verdict.
pub fn few_frames_remark(modes: &[ModeComparison]) -> Option<String> {
    let mut measures = modes.iter().flat_map(|mode| &mode.measures);
    measures.any(|m| m.verdict == Verdict::TooFewFrames).then(|| {
        let words = Verdict::TooFewFrames.text();
        let more = "bench --frames or --repeat gives more";
        format!("{words}: a verdict needs {N_FRAMES_NEEDED} timed frames of A and of B; {more}")
    })
}

/// The times of one measure of a loop.
#[derive(Clone, Copy)]
struct Times<'a> {
    /// In ms, in the order in which they were taken.
    blocks: &'a [Block],
    /// The factor of their interval.
    widening: f64,
}

impl<'a> Times<'a> {
    fn of(mode: &'a TimedMode, name: &str) -> Times<'a> {
        Times { blocks: mode.times(name), widening: mode.widening }
    }

    fn is_measured(self) -> bool {
        self.blocks.iter().any(|block| !block.values.is_empty())
    }
}

/// Compares the times of one measure.
fn compare(measure: &str, a: Times<'_>, b: Times<'_>, margin: f64) -> MeasureComparison {
    let [ms_a, ms_b] = [a, b].map(|of| values(of.blocks));
    let n_least = ms_a.len().min(ms_b.len());
    let widening = a.widening.max(b.widening);
    let interval = ratio_interval(b.blocks, a.blocks, Pairing::None, widening);
    let verdict = match interval {
        _ if ms_a.is_empty() => Verdict::NotMeasuredInA,
        _ if ms_b.is_empty() => Verdict::NotMeasuredInB,
        _ if n_least < N_FRAMES_NEEDED => Verdict::TooFewFrames,
        None => Verdict::NoRatio,
        Some(ratio) => Verdict::of(ratio, margin),
    };
    let undecided = interval.filter(|_| verdict == Verdict::Undecided);
    MeasureComparison {
        measure: measure.to_owned(),
        n_a: ms_a.len(),
        n_b: ms_b.len(),
        a_ms: median(&ms_a),
        b_ms: median(&ms_b),
        b_by_a: interval,
        block_len: block_len(&[a.blocks, b.blocks]),
        verdict,
        more_frames: undecided.and_then(|ratio| more_frames(ratio, n_least, margin)),
    }
}

/// A loop of A and the same loop of B.
type Pair<'a> = (&'a TimedMode, &'a TimedMode);

/// Compares every measure that either loop of a pair has, in A's order and then B's.
fn compare_modes(pairs: &[Pair<'_>], margin: f64) -> Vec<ModeComparison> {
    let compare = |(a, b): &Pair<'_>| ModeComparison {
        name: a.name.clone(),
        measures: compare_measures(a, b, margin),
    };
    pairs.iter().map(compare).collect()
}

/// Returns the loops that both have.
fn pairs<'a>(a: &'a [TimedMode], b: &'a [TimedMode]) -> Vec<Pair<'a>> {
    let of_b = |name: &str| b.iter().find(|of_b| of_b.name == name);
    a.iter().filter_map(|of_a| Some((of_a, of_b(&of_a.name)?))).collect()
}

/// Returns the names of the loops that draw nothing in A or B, of cases that also have a loop
/// without skipping in both. That loop has the figure of the case.
fn left_out<'a>(a: &'a BenchResults, b: &'a BenchResults) -> BTreeSet<&'a str> {
    let names_b: BTreeSet<&str> = b.modes.iter().map(|mode| mode.name.as_str()).collect();
    let with_figure: BTreeSet<String> = a
        .timed()
        .filter(|(_, mode, timed)| !mode.skip && names_b.contains(timed.name.as_str()))
        .map(|(case, ..)| case.name())
        .collect();
    [a, b]
        .into_iter()
        .flat_map(BenchResults::timed)
        .filter(|(case, mode, _)| case.draws_nothing(mode) && with_figure.contains(&case.name()))
        .map(|(.., timed)| timed.name.as_str())
        .collect()
}

/// Returns a remark on cases in which nothing moves. The loops `left_out` are not compared.
fn still_remark(a: &BenchResults, b: &BenchResults, left_out: &BTreeSet<&str>) -> Option<String> {
    let still = |of: &BenchResults| of.run.cases.iter().filter(|case| case.is_still()).count();
    let n = still(a).max(still(b));
    let n_all = a.run.cases.len().max(b.run.cases.len());
    let figures: BTreeSet<String> = [a, b]
        .into_iter()
        .flat_map(|of| &of.run.cases)
        .filter(|case| case.is_still())
        .filter_map(|case| case.figure_mode().map(Mode::name))
        .collect();
    let figures = figures.into_iter().collect::<Vec<_>>().join(", ");
    let what = if left_out.is_empty() {
        "A and B have no loop without skipping in common, so the times are of frames that draw \
         nothing"
            .to_owned()
    } else {
        format!("loops that draw nothing are left out, and the figure is the loop {figures}")
    };
    (n > 0).then(|| format!("nothing moves in {n} of {n_all} cases: {what}"))
}

fn compare_measures(a: &TimedMode, b: &TimedMode, margin: f64) -> Vec<MeasureComparison> {
    let mut names: Vec<&str> = a.measures.iter().map(|m| m.name.as_str()).collect();
    let only_b = b.measures.iter().map(|m| m.name.as_str()).filter(|name| !names.contains(name));
    names.extend(only_b.collect::<Vec<_>>());
    let of = |name: &str| [a, b].map(|mode| Times::of(mode, name));
    let measured = names.into_iter().map(|name| (name, of(name)));
    let measured = measured.filter(|(_, [a, b])| a.is_measured() || b.is_measured());
    measured.map(|(name, [a, b])| compare(name, a, b, margin)).collect()
}

/// Remarks on loops whose headline differs by no more than the blocks of A or B, which ran the same
/// frames: an unsteady machine may have caused the difference.
fn steadiness_remarks(pairs: &[Pair<'_>], compared: &[ModeComparison]) -> Vec<String> {
    let mut remarks = Vec::new();
    for (mode, (a, b)) in compared.iter().zip(pairs) {
        let is_found = |v| matches!(v, Verdict::Faster | Verdict::Slower);
        let found = mode.headline().filter(|h| is_found(h.verdict));
        let Some(ratio) = found.and_then(|h| h.b_by_a) else { continue };
        for (name, of) in [("A", a), ("B", b)] {
            let spread = spread_of_blocks(of.times(HEADLINE));
            if let Some(spread) = spread.filter(|spread| spread.ln() >= ratio.estimate.ln().abs()) {
                let what = "as far as A and B, or further: the machine was not steady";
                remarks.push(format!(
                    "{}: {name}'s own blocks lie a factor of {spread:.3} apart, {what}",
                    mode.name
                ));
            }
        }
    }
    remarks
}

/// Remarks on loops that only A or B has, and on loops that timed different frames.
fn frame_remarks(a: &[TimedMode], b: &[TimedMode]) -> Vec<String> {
    let mut remarks = Vec::new();
    for (name, of, other_name, other) in [("A", a, "B", b), ("B", b, "A", a)] {
        for mode in of.iter().filter(|mode| other.iter().all(|o| o.name != mode.name)) {
            remarks.push(format!(
                "{} frames are in {name} alone and not compared ({other_name} has none)",
                mode.name
            ));
        }
    }
    let numbers = |mode: &TimedMode| mode.frames.iter().copied().collect::<BTreeSet<u32>>();
    for (mode, _) in pairs(a, b).into_iter().filter(|(a, b)| numbers(a) != numbers(b)) {
        let what = "timed different frames of the scene: if the scene changes, so may the median";
        remarks.push(format!("{}: A and B {what}", mode.name));
    }
    remarks
}

/// One loop that all of several runs have: every run compared with every other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoopMatrix {
    /// Phase, sweep and loop in words.
    pub name: String,
    /// Row i, column j: run i compared with run j by the headline; null on the diagonal.
    pub cells: Vec<Vec<Option<MeasureComparison>>>,
}

/// Compares every run with every other by the headline, in the loops that all have. Loops that draw
/// nothing in one of them are left out if their case has another loop.
pub fn matrix(runs: &[BenchResults], margin: f64) -> Vec<LoopMatrix> {
    let Some(first) = runs.first() else { return Vec::new() };
    let left_out: BTreeSet<&str> =
        runs.iter().flat_map(|run| left_out(first, run).into_iter()).collect();
    let of_name = |name: &str| -> Option<Vec<&TimedMode>> {
        runs.iter().map(|run| run.modes.iter().find(|m| m.name == name)).collect()
    };
    let names = first.modes.iter().map(|m| m.name.as_str()).filter(|n| !left_out.contains(n));
    let of_loop = |(name, modes): (&str, Vec<&TimedMode>)| {
        let cell = |i: usize, j: usize| {
            let [a, b] = [j, i].map(|k| Times::of(modes[k], HEADLINE));
            (i != j).then(|| compare(HEADLINE, a, b, margin))
        };
        let row = |i: usize| (0..modes.len()).map(|j| cell(i, j)).collect();
        LoopMatrix { name: name.to_owned(), cells: (0..modes.len()).map(row).collect() }
    };
    names.filter_map(|name| Some((name, of_name(name)?))).map(of_loop).collect()
}

#[cfg(test)]
mod tests;
