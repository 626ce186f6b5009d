//! Joins benches of the same cases that several processes ran, one after the other.
//!
//! Times differ from one start of a program to the next, by where its memory lies and what the
//! driver decides, more than frames of one start tell. The joined run has the frames of all starts,
//! and its intervals compare the starts with each other ([`super::intervals`]).

use std::collections::{BTreeMap, BTreeSet};

use super::difference::{Facts, fact_differences};
use super::frame_rows::{FrameRow, FrameTable};
use super::records::{Block, Case, Mode, Pass, Reason, Run};
use super::timed_rows::{self, TimedRows};
use crate::error::{Error, Result};

/// The results of one start.
#[derive(Debug, Clone)]
pub struct Start {
    /// Its record.
    pub run: Run,
    /// Its frames.
    pub table: FrameTable,
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
    let mut rows = Vec::new();
    for (start, of) in (0..).zip(starts) {
        let n_before = block_order.len() as u32;
        let block = |block: &Block| Block { start, ..block.clone() };
        block_order.extend(of.run.block_order.iter().map(block));
        let row = |row: &FrameRow| FrameRow { block: n_before + row.block, ..row.clone() };
        rows.extend(of.table.rows.iter().map(row));
    }
    let joined = Joined { starts, block_order: &block_order, rows: &rows };
    let cases = (0..first.run.cases.len()).map(|i| joined.case(i)).collect();
    let chosen: BTreeSet<&String> = starts.iter().flat_map(|start| &start.run.chosen).collect();
    let run = Run {
        cases,
        chosen: chosen.into_iter().cloned().collect(),
        // Each start has its own.
        state: None,
        interrupted: starts.iter().any(|start| start.run.interrupted),
        block_order,
        ..first.run.clone()
    };
    let table = FrameTable { pass_names: first.table.pass_names.clone(), rows };
    Ok(Start { run, table })
}

/// What starts of one bench share.
fn facts(Start { run, table }: &Start) -> Facts {
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
        TimedRows::new(self.rows.iter().filter(is_of), self.block_order, 1.0)
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
        // Of starts whose precisions differ, the widest counts.
        let precision = all.iter().filter_map(|case| case.precision).max_by(|a, b| {
            (a.ended_by.is_some(), a.half_width.unwrap_or(f64::INFINITY))
                .partial_cmp(&(b.ended_by.is_some(), b.half_width.unwrap_or(f64::INFINITY)))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        Case {
            ratio: serial.zip(parallel).and_then(|(s, p)| timed_rows::ratio(s, p)),
            overlap: serial.and_then(|serial| timed_rows::overlap(serial, parallel)),
            skipping,
            check: all.iter().find(is_wrong).unwrap_or(&first).check.clone(),
            precision,
            state: None,
            modes,
            ..first.clone()
        }
    }
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
