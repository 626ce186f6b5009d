//! Summarizes the samples of a bench as the records of its cases and the rows of its frames.

use std::collections::{BTreeMap, BTreeSet};

use super::bench_state::end_s;
use super::blocks::{BenchPlan, Outcome, Sample};
use super::cases::{Case, Loop};
use super::frame_rows::{FrameRow, FrameTable};
use super::names::sweep_text;
use super::precision::WIDENING;
use super::records::{self, Mode, Pass as PassRecord, Reason, Skipping};
use super::timed_rows::{self, TimedRows};
use crate::frame::FrameTimes;
use crate::frame::plan::{Pass, Reason as PlanReason};
use crate::measure::blocked::BlockedMedian;
use crate::measure::bootstrap::Interval;
use crate::model::scene::{Impostors, Simulate, Threading};

/// Returns the device time of all passes in ms; 0 if none had to run, None without timestamps.
fn gpu_ms(times: &FrameTimes) -> Option<f64> {
    let is_timed = !times.passes.is_empty() || times.plan.runs_nothing();
    // The sum of nothing is -0.
    is_timed.then(|| times.passes.iter().map(|p| p.ms()).sum::<f64>() + 0.0)
}

fn pass_ms(times: &FrameTimes, pass: Pass) -> Option<f64> {
    times.passes.iter().find(|p| p.name == pass.name()).map(|p| p.ms())
}

/// The rows of a case, each with its loop.
struct CaseRows {
    rows: Vec<(Loop, FrameRow)>,
    /// The factor of intervals.
    widening: f64,
}

impl CaseRows {
    /// Returns the timed rows of one loop.
    fn timed(&self, of: Loop) -> TimedRows<'_> {
        let rows = self.rows.iter().filter(|(row_of, _)| *row_of == of).map(|(_, row)| row);
        // All blocks of a process are of one start.
        TimedRows::new(rows, &[], self.widening)
    }
}

impl Outcome {
    fn of_loop(&self, i_case: usize, of: Loop) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(move |s| s.i_case == i_case && s.of == of)
    }

    /// Returns the rows of a case.
    fn rows_of(&self, i_case: usize, case: &Case) -> CaseRows {
        let of_case = self.samples.iter().filter(|s| s.i_case == i_case);
        let rows = of_case.map(|s| (s.of, self.row(s, case))).collect();
        // Where a precision was asked for, the rule has chosen the number of rounds.
        let widening = if self.reached.contains_key(&i_case) { WIDENING } else { 1.0 };
        CaseRows { rows, widening }
    }

    /// Returns the intervals that a precision is asked of: those of the median frame time in every
    /// loop that draws, and of the ratio of the two threadings. None if one is not known.
    pub(super) fn intervals(
        &self,
        i_case: usize,
        case: &Case,
        widening: f64,
    ) -> Option<Vec<Interval>> {
        let rows = self.rows_of(i_case, case);
        let drawing: Vec<(Loop, BlockedMedian)> = case
            .loops
            .iter()
            .map(|of| (*of, rows.timed(*of)))
            .filter(|(_, timed)| !timed.is_mostly_empty())
            .map(|(of, timed)| Some((of, BlockedMedian::new(&timed.frame_ms())?)))
            .collect::<Option<_>>()?;
        let mut all: Vec<Interval> = drawing.iter().map(|(_, m)| m.interval(widening)).collect();
        let skip = case.loops.iter().any(|of| of.skip);
        let find = |threading| {
            let found = drawing.iter().find(|(of, _)| *of == Loop { threading, skip });
            found.map(|(_, median)| median)
        };
        if let (Some(serial), Some(parallel)) = (find(Threading::Serial), find(Threading::Parallel))
        {
            all.push(parallel.paired_ratio(serial, widening)?);
        }
        Some(all)
    }

    /// Returns the records of all cases, in order.
    pub fn cases(&self, cases: &[Case], plan: &BenchPlan) -> Vec<records::Case> {
        cases.iter().enumerate().map(|(i, case)| self.case(i, case, plan)).collect()
    }

    fn case(&self, i: usize, case: &Case, plan: &BenchPlan) -> records::Case {
        // With --no-skip no loop skips; else a loop that does not measures what skipping saves.
        let skip = case.loops.iter().any(|of| of.skip);
        let rows = self.rows_of(i, case);
        let timed = |of: Loop| case.loops.contains(&of).then(|| rows.timed(of));
        let serial = timed(Loop { threading: Threading::Serial, skip });
        let parallel = timed(Loop { threading: Threading::Parallel, skip });
        let unskipped = case.loops.iter().copied().find(|of| skip && !of.skip);
        let mut record = records::Case {
            phase: case.phase.clone(),
            sweep: case.sweep.clone(),
            scene_hash: case.scene_hash.clone(),
            particles: case.scene.n_particles(),
            width: case.scene.film.width,
            height: case.scene.film.height,
            modes: case
                .loops
                .iter()
                .map(|of| self.mode((i, case), &rows, *of, unskipped, plan))
                .collect(),
            ratio: serial
                .as_ref()
                .zip(parallel.as_ref())
                .and_then(|(s, p)| timed_rows::ratio(s, p)),
            overlap: serial.as_ref().and_then(|s| timed_rows::overlap(s, parallel.as_ref())),
            counts: self.counts.get(&i).copied(),
            skipping: unskipped.and_then(|unskipped| self.skipping((i, case), &rows, unskipped)),
            figure: None,
            check: self.checks.get(&i).cloned(),
            precision: self.reached.get(&i).copied(),
            state: self.state.as_ref().and_then(|state| state.cases.get(&i).cloned()),
            invocations: self.invocations.get(&i).cloned(),
        };
        record.figure = record.figure_mode().map(Mode::name);
        record
    }

    fn skipping(
        &self,
        (i, case): (usize, &Case),
        rows: &CaseRows,
        unskipped: Loop,
    ) -> Option<Skipping> {
        let loops = [Loop { skip: true, ..unskipped }, unskipped];
        let hashes = loops.map(|of| self.image_hash(i, of).filter(|_| !has_impostors(case)));
        let same_bytes = if let [Some(a), Some(b)] = hashes { Some(a == b) } else { None };
        let [with, without] = loops.map(|of| rows.timed(of));
        timed_rows::skipping(&with, &without, same_bytes)
    }

    /// Returns the hash of the last frame of one case in one loop, if it was reached.
    fn image_hash(&self, i_case: usize, of: Loop) -> Option<&str> {
        let mut blocks = self.blocks.iter().filter(|b| b.i_case == i_case && b.of == of);
        blocks.find_map(|b| b.image_hash.as_deref())
    }

    /// Returns whether the last frames of all blocks of a case have the same bytes; None for fewer
    /// than two. If the scene has impostors, only the loops that skip are compared.
    pub fn is_same_picture(&self, i_case: usize, case: &Case) -> Option<bool> {
        let is_exact = !has_impostors(case);
        let blocks = self.blocks.iter().filter(|b| b.i_case == i_case && (is_exact || b.of.skip));
        let hashes: Vec<&str> = blocks.filter_map(|b| b.image_hash.as_deref()).collect();
        (hashes.len() > 1).then(|| hashes.windows(2).all(|w| w[0] == w[1]))
    }

    /// Returns the records of all blocks, in the order in which they ran.
    pub fn block_order(&self) -> Vec<records::Block> {
        let record = |b: &super::blocks::Block| records::Block {
            case: b.i_case,
            threading: b.of.threading.name().to_owned(),
            skip: b.of.skip,
            start: 0,
        };
        self.blocks.iter().map(record).collect()
    }

    fn mode(
        &self,
        (i, case): (usize, &Case),
        rows: &CaseRows,
        of: Loop,
        unskipped: Option<Loop>,
        plan: &BenchPlan,
    ) -> Mode {
        let (timed, whole) =
            (rows.timed(of), unskipped.filter(|u| *u != of).map(|u| rows.timed(u)));
        let blocks: BTreeSet<u32> = self.of_loop(i, of).map(|s| s.i_block).collect();
        let frames: Vec<&FrameTimes> = self
            .of_loop(i, of)
            .filter(|s| !s.warm_up && !s.mark.is_discarded)
            .map(|s| &s.times)
            .collect();
        let passes = Pass::ALL.into_iter().enumerate();
        let pass = |(k, pass)| timed.pass(k, whole.as_ref(), pass_record(pass, &frames));
        let is_by_cpu = case.scene.threads.simulate == Simulate::Cpu;
        let mode = Mode {
            threading: of.threading.name().into(),
            skip: of.skip,
            simulate: if is_by_cpu { "cpu" } else { "gpu" }.into(),
            warm_up: plan.n_warm_up as usize,
            impostors_reused: frames.iter().filter(|t| is_impostor_reused(t)).count(),
            passes: passes.map(pass).collect(),
            image_hash: self.image_hash(i, of).map(str::to_owned),
            ..Mode::default()
        };
        timed.mode(blocks.len(), mode)
    }

    /// Returns the rows of `frames.csv`.
    pub fn table(&self, cases: &[Case]) -> FrameTable {
        let pass_names = Pass::ALL.map(|pass| pass.name().to_owned()).to_vec();
        let rows = self.samples.iter().map(|s| self.row(s, &cases[s.i_case])).collect();
        FrameTable { pass_names, rows }
    }

    fn row(&self, s: &Sample, case: &Case) -> FrameRow {
        let zero = self.state.as_ref().map(|state| state.zero);
        FrameRow {
            phase: case.phase.clone().unwrap_or_default(),
            sweep: sweep_text(&case.sweep),
            threading: s.of.threading.name().into(),
            skip: s.of.skip,
            block: s.i_block,
            frame: s.times.i_frame,
            time_s: s.times.time_s,
            warm_up: s.warm_up,
            frame_ms: s.times.frame_ms,
            game_ms: s.times.game_ms,
            record_ms: s.times.record_ms,
            submit_ms: s.times.submit_ms,
            wait_ms: s.times.wait_ms,
            gpu_ms: gpu_ms(&s.times),
            latency_ms: s.times.latency_ms,
            queue_depth: s.times.queue_depth,
            n_drawn: s.times.n_shown(),
            ran: ran(&s.times),
            pass_ms: Pass::ALL.map(|pass| pass_ms(&s.times, pass)).to_vec(),
            image_hash: s.image_hash.clone(),
            end_s: zero.map(|zero| end_s(s, zero)),
            throttled: Some(s.mark.flags.text()).filter(|text| !text.is_empty()),
            discarded: s.mark.is_discarded,
        }
    }
}

/// Returns whether the pictures of a case depend on skipping: without it no impostor is used.
fn has_impostors(case: &Case) -> bool {
    case.scene.draw.impostors != Impostors::Off
}

/// Returns whether distant particles were shown from the impostors of an earlier frame.
fn is_impostor_reused(times: &FrameTimes) -> bool {
    matches!(times.plan.decision(Pass::Impostors).reason, PlanReason::Reused { .. })
}

/// Returns the passes that ran, as "sort+sprites".
fn ran(times: &FrameTimes) -> String {
    let passes = Pass::ALL.into_iter().filter(|p| times.plan.runs(*p));
    passes.map(Pass::name).collect::<Vec<_>>().join("+")
}

/// Returns each reason once, the most frequent first.
fn reasons(all: impl Iterator<Item = String>) -> Vec<Reason> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for reason in all {
        *counts.entry(reason).or_default() += 1;
    }
    let mut reasons: Vec<Reason> =
        counts.into_iter().map(|(reason, n)| Reason { reason, n }).collect();
    reasons.sort_by_key(|r| std::cmp::Reverse(r.n));
    reasons
}

/// Returns the record of a pass in timed frames, without its times.
fn pass_record(pass: Pass, frames: &[&FrameTimes]) -> PassRecord {
    let reason = |t: &FrameTimes| t.plan.decision(pass).reason.to_string();
    let skipped: Vec<&FrameTimes> = frames.iter().copied().filter(|t| !t.plan.runs(pass)).collect();
    PassRecord {
        name: pass.name().to_owned(),
        n_run: frames.len() - skipped.len(),
        n_skipped: skipped.len(),
        reason: skipped.last().map(|t| reason(t)),
        reasons: reasons(skipped.iter().map(|t| reason(t))),
        ..PassRecord::default()
    }
}
