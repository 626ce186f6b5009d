//! Decides whether B is faster than A, measure by measure, from the times of single frames.
//!
//! The verdict depends on the ratio of the medians and its 95 % bootstrap interval: "faster" or
//! "slower" if the interval excludes 1, else "no difference found", which does not mean "equal".
//! Only `frame` is the headline; of twenty other measures of two equal runs one will seem to
//! differ.
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
use super::intervals::{N_FRAMES_NEEDED, ratio_interval, spread_of_blocks};
use super::records::Mode;
use super::results::{BenchResults, TimedMode};
use crate::measure::bootstrap::{Bootstrap, Interval};
use crate::measure::stats::median;

/// The measure that decides.
pub const HEADLINE: &str = "frame";

/// The answer for one measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// B takes less time than A.
    Faster,
    /// B takes more time than A.
    Slower,
    /// The interval contains 1.
    NoDifferenceFound,
    /// A or B has fewer than [`N_FRAMES_NEEDED`] frames.
    TooFewFrames,
    /// A has no such time.
    NotMeasuredInA,
    /// B has no such time.
    NotMeasuredInB,
    /// A's median is 0, or is 0 in a resample, so that the ratio is not defined.
    NoRatio,
}

impl Verdict {
    /// Returns the verdict in words, which complete "B is …".
    pub fn text(self) -> &'static str {
        match self {
            Verdict::Faster => "faster",
            Verdict::Slower => "slower",
            Verdict::NoDifferenceFound => "no difference found",
            Verdict::TooFewFrames => "too few frames",
            Verdict::NotMeasuredInA => "not measured in A",
            Verdict::NotMeasuredInB => "not measured in B",
            Verdict::NoRatio => "no ratio: A's median is 0, or may be",
        }
    }
}

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
    /// Neighbouring frames that a resample draws together.
    pub block_len: usize,
    /// The answer.
    pub verdict: Verdict,
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
    /// Remarks on the runs and their frames.
    pub remarks: Vec<String>,
}

impl Comparison {
    /// Compares two results.
    pub fn new(a: &BenchResults, b: &BenchResults) -> Comparison {
        let left_out = left_out(a, b);
        let mut pairs = pairs(&a.modes, &b.modes);
        pairs.retain(|(of_a, _)| !left_out.contains(of_a.name.as_str()));
        let modes = compare_modes(&pairs);
        let mut remarks = remarks(&a.run, &b.run);
        remarks.extend(still_remark(a, b, &left_out));
        remarks.extend(frame_remarks(&a.modes, &b.modes));
        remarks.extend(steadiness_remarks(&pairs, &modes));
        Comparison { differences: differences(&a.run, &b.run), modes, remarks }
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

/// Compares the times of one measure, in ms and in the order in which they were taken.
fn compare(measure: &str, a: &[f64], b: &[f64]) -> MeasureComparison {
    let n_least = a.len().min(b.len());
    let interval = ratio_interval(b, a);
    let verdict = match interval {
        _ if a.is_empty() => Verdict::NotMeasuredInA,
        _ if b.is_empty() => Verdict::NotMeasuredInB,
        _ if n_least < N_FRAMES_NEEDED => Verdict::TooFewFrames,
        None => Verdict::NoRatio,
        Some(ratio) if ratio.high < 1.0 => Verdict::Faster,
        Some(ratio) if ratio.low > 1.0 => Verdict::Slower,
        Some(_) => Verdict::NoDifferenceFound,
    };
    MeasureComparison {
        measure: measure.to_owned(),
        n_a: a.len(),
        n_b: b.len(),
        a_ms: median(a),
        b_ms: median(b),
        b_by_a: interval,
        block_len: Bootstrap::of_neighbours(n_least).block_len,
        verdict,
    }
}

/// A loop of A and the same loop of B.
type Pair<'a> = (&'a TimedMode, &'a TimedMode);

/// Compares every measure that either loop of a pair has, in A's order and then B's.
fn compare_modes(pairs: &[Pair<'_>]) -> Vec<ModeComparison> {
    let compare = |(a, b): &Pair<'_>| ModeComparison {
        name: a.name.clone(),
        measures: compare_measures(a, b),
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

fn compare_measures(a: &TimedMode, b: &TimedMode) -> Vec<MeasureComparison> {
    let mut names: Vec<&str> = a.measures.iter().map(|m| m.name.as_str()).collect();
    let only_b = b.measures.iter().map(|m| m.name.as_str()).filter(|name| !names.contains(name));
    names.extend(only_b.collect::<Vec<_>>());
    let of = |name: &str| [a, b].map(|mode| mode.times(name));
    let measured = names.into_iter().map(|name| (name, of(name)));
    let measured = measured.filter(|(_, [a, b])| !a.is_empty() || !b.is_empty());
    measured.map(|(name, [a, b])| compare(name, a, b)).collect()
}

/// Remarks on loops whose headline differs by no more than the blocks of A or B, which ran the same
/// frames: an unsteady machine may have caused the difference.
fn steadiness_remarks(pairs: &[Pair<'_>], compared: &[ModeComparison]) -> Vec<String> {
    let mut remarks = Vec::new();
    for (mode, (a, b)) in compared.iter().zip(pairs) {
        let found = mode.headline().filter(|h| h.verdict != Verdict::NoDifferenceFound);
        let Some(ratio) = found.and_then(|h| h.b_by_a) else { continue };
        for (name, of) in [("A", a), ("B", b)] {
            let spread = spread_of_blocks(of.blocks.iter().map(Vec::as_slice));
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

#[cfg(test)]
mod tests;
