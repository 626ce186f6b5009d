//! Joins benches of the same cases that several processes ran, one after the other.
//!
//! Times differ from one start of a program to the next, by where its memory lies and what the
//! driver decides, more than frames of one start tell. The joined run has the frames of all starts,
//! and its intervals compare the starts with each other ([`super::intervals`]).

use std::collections::{BTreeMap, BTreeSet};

use super::difference::{Facts, fact_differences};
use super::frame_rows::{FrameRow, FrameTable};
use super::precision::{Reached, WIDENING, reach};
use super::records::{Block, Case, Mode, Pass, Ratio, Reason, Run};
use super::state::rules::FrameSpan;
use super::state::{CaseState, Observed, RunState, StateRow, TimedFrame};
use super::timed_rows::{self, TimedRows};
use crate::error::{Error, Result};
use crate::measure::bootstrap::Interval;

/// The results of one start.
#[derive(Debug, Clone)]
pub struct Start {
    /// Its record.
    pub run: Run,
    /// Its frames.
    pub table: FrameTable,
    /// Readings of the machine's state; none if it was not read.
    pub readings: Vec<StateRow>,
    /// Its beginning, in seconds since that of the first start.
    pub begin_s: f64,
}

/// Joins starts of one bench, in their order. The record is the first one's where they agree.
///
/// # Errors
/// Fails if there is no start, or starts measured different scenes or devices.
pub fn join(starts: &[Start]) -> Result<Start> {
    let Some(first) = starts.first() else { return Err(Error::usage("no start has ended")) };
    let names: Vec<String> = (0..starts.len()).map(|i| format!("start {i}")).collect();
    let facts: Vec<(&str, Facts)> =
        names.iter().map(String::as_str).zip(starts.iter().map(facts)).collect();
    let differences = fact_differences(&facts);
    if !differences.is_empty() {
        let list = differences.into_iter().collect::<Vec<_>>().join("\n  ");
        return Err(Error::Check { what: format!("starts of one bench differ:\n  {list}") });
    }
    let mut block_order = Vec::new();
    let (mut rows, mut readings) = (Vec::new(), Vec::new());
    for (start, of) in (0..).zip(starts) {
        let n_before = block_order.len() as u32;
        let block = |block: &Block| Block { start, ..block.clone() };
        block_order.extend(of.run.block_order.iter().map(block));
        let row = |row: &FrameRow| FrameRow {
            block: n_before + row.block,
            end_s: row.end_s.map(|s| of.begin_s + s),
            ..row.clone()
        };
        rows.extend(of.table.rows.iter().map(row));
        let reading = |row: &StateRow| StateRow {
            time_s: of.begin_s + row.time_s,
            block: row.block.map(|block| n_before + block),
            ..row.clone()
        };
        readings.extend(of.readings.iter().map(reading));
    }
    let joined = Joined { starts, block_order: &block_order, rows: &rows };
    let (state, states) = joined.states(&readings);
    let of_case = |i: usize| Case { state: states.get(&i).cloned(), ..joined.case(i) };
    let cases = (0..first.run.cases.len()).map(of_case).collect();
    let chosen: BTreeSet<&String> = starts.iter().flat_map(|start| &start.run.chosen).collect();
    let run = Run {
        cases,
        chosen: chosen.into_iter().cloned().collect(),
        state,
        interrupted: starts.iter().any(|start| start.run.interrupted),
        block_order,
        ..first.run.clone()
    };
    let table = FrameTable { pass_names: first.table.pass_names.clone(), rows };
    Ok(Start { run, table, readings, begin_s: 0.0 })
}

/// What starts of one bench share.
fn facts(Start { run, table, .. }: &Start) -> Facts {
    let cases = run.cases.iter().map(|case| {
        let loops = case.modes.iter().map(Mode::name).collect::<Vec<_>>().join(", ");
        format!("{} ({}): {loops}", case.name(), case.scene_hash)
    });
    vec![
        ("revision", run.revision.clone()),
        ("scene", run.scene_hash.clone()),
        ("device", run.device.class()),
        ("cases", cases.collect::<Vec<_>>().join("; ")),
        ("passes", table.pass_names.join(", ")),
    ]
}

struct Joined<'a> {
    starts: &'a [Start],
    block_order: &'a [Block],
    rows: &'a [FrameRow],
}

impl<'a> Joined<'a> {
    /// Returns the timed rows of one case in one loop.
    fn timed(&self, i_case: usize, mode: &Mode) -> TimedRows<'a> {
        let is_of = |row: &&FrameRow| {
            self.block_order.get(row.block as usize).is_some_and(|b| {
                (b.case, &b.threading, b.skip) == (i_case, &mode.threading, mode.skip)
            })
        };
        // Where a precision was asked for, the rule has chosen the number of rounds.
        let has_rule = self.starts[0].run.cases[i_case].precision.is_some();
        let widening = if has_rule { WIDENING } else { 1.0 };
        TimedRows::new(self.rows.iter().filter(is_of), self.block_order, widening)
    }

    /// Returns the state of the machine over all starts, and that of each case.
    fn states(&self, readings: &[StateRow]) -> (Option<RunState>, BTreeMap<usize, CaseState>) {
        let all: Vec<&RunState> = self.starts.iter().filter_map(|s| s.run.state.as_ref()).collect();
        let (Some(first), run) = (all.first(), &self.starts[0].run) else {
            return (None, BTreeMap::new());
        };
        let mut loops = BTreeMap::new();
        let frame = |row: &FrameRow| {
            let block = self.block_order.get(row.block as usize)?;
            let next = loops.len();
            let kind = (block.case, block.threading.as_str(), block.skip);
            let i_loop = *loops.entry(kind).or_insert(next);
            let end_s = row.end_s?;
            let begin_s = end_s - 1e-3 * row.frame_ms;
            let span = FrameSpan { i_block: row.block, begin_s, end_s };
            Some(TimedFrame { i_case: block.case, i_loop, span })
        };
        let frames: Vec<TimedFrame> =
            self.rows.iter().filter(|row| !row.warm_up).filter_map(frame).collect();
        let observed = Observed {
            rows: readings,
            sources: &first.sources,
            frames: &frames,
            is_cpu: run.device.kind == "cpu",
            n_cores: run.cpu.logical_cores,
            discard: self.rows.iter().any(|row| row.discarded),
        };
        let (_, mut state, mut cases) = observed.judge();
        // Times of processors are counted by each process from its own beginning.
        let most =
            |shares: &mut dyn Iterator<Item = Option<f64>>| shares.flatten().reduce(f64::max);
        state.all.others_share = most(&mut all.iter().map(|state| state.all.others_share));
        for (i, case) in &mut cases {
            let of = |start: &Start| start.run.cases[*i].state.as_ref()?.others_share;
            case.others_share = most(&mut self.starts.iter().map(of));
        }
        let remarks = all.iter().enumerate().flat_map(|(i, state)| {
            state.remarks.iter().map(move |remark| format!("start {i}: {remark}"))
        });
        state.remarks = remarks.collect();
        (Some(state), cases)
    }

    fn case(&self, i: usize) -> Case {
        let all: Vec<&Case> = self.starts.iter().map(|start| &start.run.cases[i]).collect();
        let first = all[0];
        let timed: Vec<TimedRows> = first.modes.iter().map(|mode| self.timed(i, mode)).collect();
        let unskipped = first.modes.iter().position(|mode| !mode.skip);
        let modes: Vec<Mode> = (0..first.modes.len())
            .map(|k| {
                let of_starts: Vec<&Mode> = all.iter().map(|case| &case.modes[k]).collect();
                let whole = unskipped.filter(|u| *u != k).map(|u| &timed[u]);
                joined_mode(&of_starts, &timed[k], whole)
            })
            .collect();
        let skip = first.modes.iter().any(|mode| mode.skip);
        let of = |threading: &str| {
            let is_it = |mode: &Mode| mode.threading == threading && mode.skip == skip;
            first.modes.iter().position(is_it).map(|k| &timed[k])
        };
        let (serial, parallel) = (of("serial"), of("parallel"));
        let skipping = unskipped.filter(|_| skip).and_then(|u| {
            let with = first
                .modes
                .iter()
                .position(|mode| mode.skip && mode.threading == first.modes[u].threading)?;
            let same = all.iter().map(|case| case.skipping.and_then(|s| s.same_bytes));
            let same: Option<Vec<bool>> = same.collect();
            let same_bytes = same.map(|same| same.into_iter().all(|is_same| is_same));
            timed_rows::skipping(&timed[with], &timed[u], same_bytes)
        });
        let is_wrong = |case: &&&Case| case.check.as_ref().is_some_and(|check| check.is_wrong());
        // With cold caches loops are not compared (see `shares`).
        let serial = serial.filter(|_| self.starts[0].run.cold_bytes.is_none());
        let ratio = serial.zip(parallel).and_then(|(s, p)| timed_rows::ratio(s, p));
        let reached: Vec<Reached> = all.iter().filter_map(|case| case.precision).collect();
        let precision = (!reached.is_empty()).then(|| Reached {
            reach: widest(&modes, ratio),
            rounds: reached.iter().map(|of| of.rounds).sum(),
            ended_by: reached.iter().find_map(|of| of.ended_by),
        });
        Case {
            ratio,
            overlap: serial.and_then(|serial| timed_rows::overlap(serial, parallel)),
            skipping,
            check: all.iter().find(is_wrong).unwrap_or(&first).check.clone(),
            precision,
            modes,
            ..first.clone()
        }
    }
}

/// Returns how far the widest interval reaches, of the loops that draw and of their ratio; none
/// without an interval.
fn widest(modes: &[Mode], ratio: Option<Ratio>) -> Option<f64> {
    let draws = |mode: &&Mode| 2 * mode.empty_frames.unwrap_or(0) < mode.frames;
    let of_modes = modes.iter().filter(draws).map(|mode| {
        let of = mode.frame_ms?;
        Some(reach(Interval { estimate: of.of.p50, low: of.p50_low?, high: of.p50_high? }))
    });
    let of_ratio = ratio.map(|r| {
        Some(reach(Interval { estimate: r.parallel_by_serial, low: r.low?, high: r.high? }))
    });
    let all: Option<Vec<f64>> = of_modes.chain(of_ratio).collect();
    all?.into_iter().reduce(f64::max)
}

/// Joins the records of a loop; `whole` are the rows of the loop without skipping.
fn joined_mode(of_starts: &[&Mode], timed: &TimedRows<'_>, whole: Option<&TimedRows<'_>>) -> Mode {
    let sum = |of: fn(&Mode) -> usize| of_starts.iter().map(|mode| of(mode)).sum::<usize>();
    let mode = timed.mode(sum(|mode| mode.blocks), of_starts[0].clone());
    let passes = (0..mode.passes.len()).map(|k| {
        let of_pass: Vec<&Pass> = of_starts.iter().filter_map(|m| m.passes.get(k)).collect();
        let (first, joined) = (of_pass[0], timed.pass(k, whole, joined_pass(&of_pass)));
        // The same least time, by the median of all starts.
        let least_ms = first.roof_share.zip(first.p50_ms).map(|(share, ms)| share * ms);
        let roof_share = least_ms.zip(joined.p50_ms.filter(|ms| *ms > 0.0)).map(|(a, b)| a / b);
        Pass { roof_share, ..joined }
    });
    Mode {
        impostors_reused: sum(|mode| mode.impostors_reused),
        passes: passes.collect(),
        // Blocks of different starts differ by more than those of one.
        block_spread: of_starts.iter().filter_map(|mode| mode.block_spread).reduce(f64::max),
        ..mode
    }
}

/// Joins the counts and reasons of a pass.
fn joined_pass(of_starts: &[&Pass]) -> Pass {
    let sum = |of: fn(&Pass) -> usize| of_starts.iter().map(|pass| of(pass)).sum::<usize>();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for reason in of_starts.iter().flat_map(|pass| &pass.reasons) {
        *counts.entry(&reason.reason).or_default() += reason.n;
    }
    let mut reasons: Vec<Reason> =
        counts.into_iter().map(|(reason, n)| Reason { reason: reason.to_owned(), n }).collect();
    reasons.sort_by_key(|reason| std::cmp::Reverse(reason.n));
    Pass {
        n_run: sum(|pass| pass.n_run),
        n_skipped: sum(|pass| pass.n_skipped),
        reason: of_starts.iter().rev().find_map(|pass| pass.reason.clone()),
        reasons,
        ..of_starts[0].clone()
    }
}
