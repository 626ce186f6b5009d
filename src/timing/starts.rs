//! Joins benches of the same cases that several processes ran, one after the other.
//!
//! Times differ from one start of a program to the next, by where its memory lies and what the
//! driver decides, more than frames of one start tell. The joined run has the frames of all starts,
//! and its intervals compare the starts with each other ([`super::intervals`]).

use std::collections::{BTreeMap, BTreeSet};

use super::difference::{Facts, fact_differences};
use super::frame_rows::{FrameRow, FrameTable};
use super::intervals::{Pairing, measured, ratio_interval, values};
use super::overlap::{Overlap, SerialFrame};
use super::records::{Block, Case, Mode, Pass, Ratio, Reason, Run, Skipping};
use super::results::row_times;
use crate::error::{Error, Result};
use crate::measure::blocked;
use crate::measure::lows::Lows;
use crate::measure::stats::{Summary, mean, median};

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
    fn timed(&self, i_case: usize, mode: &Mode) -> Timed<'a> {
        let is_of = |row: &&FrameRow| {
            row.is_timed()
                && self.block_order.get(row.block as usize).is_some_and(|b| {
                    (b.case, &b.threading, b.skip) == (i_case, &mode.threading, mode.skip)
                })
        };
        Timed { rows: self.rows.iter().filter(is_of).collect(), block_order: self.block_order }
    }

    fn case(&self, i: usize) -> Case {
        let all: Vec<&Case> = self.starts.iter().map(|start| &start.run.cases[i]).collect();
        let first = all[0];
        let timed: Vec<Timed> = first.modes.iter().map(|mode| self.timed(i, mode)).collect();
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
            let [gpu, gpu_no_skip] = [with, u].map(|k| values(&timed[k].blocks(|r| r.gpu_ms)));
            let is_known = !gpu.is_empty() && !gpu_no_skip.is_empty();
            let same = all.iter().map(|case| case.skipping.and_then(|s| s.same_bytes));
            let same: Option<Vec<bool>> = same.collect();
            is_known.then(|| Skipping {
                gpu_ms: mean(&gpu),
                gpu_no_skip_ms: mean(&gpu_no_skip),
                same_bytes: same.map(|same| same.into_iter().all(|is_same| is_same)),
            })
        });
        let is_wrong = |case: &&&Case| case.check.as_ref().is_some_and(|check| check.is_wrong());
        // Of starts whose precisions differ, the widest counts.
        let precision = all.iter().filter_map(|case| case.precision).max_by(|a, b| {
            (a.ended_by.is_some(), a.half_width.unwrap_or(f64::INFINITY))
                .partial_cmp(&(b.ended_by.is_some(), b.half_width.unwrap_or(f64::INFINITY)))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        Case {
            ratio: serial.zip(parallel).and_then(|(serial, parallel)| ratio(serial, parallel)),
            overlap: serial.and_then(|serial| overlap(serial, parallel)),
            skipping,
            check: all.iter().find(is_wrong).unwrap_or(&first).check.clone(),
            precision,
            state: None,
            modes,
            ..first.clone()
        }
    }
}

/// The timed rows of one case in one loop, of all starts.
struct Timed<'a> {
    rows: Vec<&'a FrameRow>,
    block_order: &'a [Block],
}

impl Timed<'_> {
    fn blocks(&self, of: impl Fn(&FrameRow) -> Option<f64>) -> Vec<blocked::Block> {
        let block = |rows: &[&FrameRow]| blocked::Block {
            start: rows
                .first()
                .and_then(|r| self.block_order.get(r.block as usize))
                .map_or(0, |b| b.start),
            stratum: rows.first().map_or(0, |row| row.frame),
            values: rows.iter().filter_map(|row| of(row)).filter(|ms| ms.is_finite()).collect(),
        };
        self.rows.chunk_by(|a, b| a.block == b.block).map(block).collect()
    }
}

/// Joins the records of a loop; `whole` is the loop without skipping.
fn joined_mode(of_starts: &[&Mode], timed: &Timed<'_>, whole: Option<&Timed<'_>>) -> Mode {
    let first = of_starts[0];
    let column = |of: &dyn Fn(&FrameRow) -> f64| timed.blocks(|row| Some(of(row)));
    let measured_of = |of: &dyn Fn(&FrameRow) -> f64| measured(&column(of), 1.0);
    let depths: Vec<f64> = timed.rows.iter().map(|row| f64::from(row.queue_depth)).collect();
    let drawn: Vec<f64> = timed.rows.iter().map(|row| f64::from(row.n_drawn)).collect();
    let sum = |of: fn(&Mode) -> usize| of_starts.iter().map(|mode| of(mode)).sum::<usize>();
    let frame = column(&|row| row.frame_ms);
    let spread = of_starts.iter().filter_map(|mode| mode.block_spread).reduce(f64::max);
    let passes = (0..first.passes.len()).map(|k| {
        let of_pass: Vec<&Pass> = of_starts.iter().filter_map(|m| m.passes.get(k)).collect();
        joined_pass(&of_pass, k, timed, whole)
    });
    Mode {
        frames: timed.rows.len(),
        blocks: sum(|mode| mode.blocks),
        frame_ms: measured(&frame, 1.0),
        frame_lows: Lows::of(&values(&frame)),
        game_ms: measured_of(&|row| row.game_ms),
        record_ms: measured_of(&|row| row.record_ms),
        submit_ms: measured_of(&|row| row.submit_ms),
        wait_ms: measured_of(&|row| row.wait_ms),
        render_ms: measured_of(&|row| row_times(row)[2].unwrap_or(f64::NAN)),
        gpu_ms: measured(&timed.blocks(|row| row.gpu_ms), 1.0),
        latency_ms: measured_of(&|row| row.latency_ms),
        queue_depth: (!depths.is_empty()).then(|| mean(&depths)),
        drawn: Summary::of(&drawn).map(|s| [s.min, s.mean, s.max]),
        empty_frames: of_starts.iter().map(|mode| mode.empty_frames).sum(),
        impostors_reused: sum(|mode| mode.impostors_reused),
        passes: passes.collect(),
        block_spread: spread,
        ..first.clone()
    }
}

fn joined_pass(
    of_starts: &[&Pass],
    k: usize,
    timed: &Timed<'_>,
    whole: Option<&Timed<'_>>,
) -> Pass {
    let of = |timed: &Timed<'_>| values(&timed.blocks(|row| row.pass_ms.get(k).copied().flatten()));
    let (first, ms) = (of_starts.first(), of(timed));
    let total: f64 = values(&timed.blocks(|row| row.gpu_ms)).iter().sum();
    let sum = |of: fn(&Pass) -> usize| of_starts.iter().map(|pass| of(pass)).sum::<usize>();
    let (n_run, n_skipped) = (sum(|p| p.n_run), sum(|p| p.n_skipped));
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for reason in of_starts.iter().flat_map(|pass| &pass.reasons) {
        *counts.entry(&reason.reason).or_default() += reason.n;
    }
    let mut reasons: Vec<Reason> =
        counts.into_iter().map(|(reason, n)| Reason { reason: reason.to_owned(), n }).collect();
    reasons.sort_by_key(|reason| std::cmp::Reverse(reason.n));
    let whole_ms = whole.and_then(|whole| median(&of(whole))).filter(|_| n_skipped > 0);
    Pass {
        name: first.map_or_else(String::new, |pass| pass.name.clone()),
        p50_ms: median(&ms),
        share: (total > 0.0).then(|| ms.iter().sum::<f64>() / total),
        n_run,
        n_skipped,
        reason: of_starts.iter().rev().find_map(|pass| pass.reason.clone()),
        reasons,
        saved_ms: whole_ms.map(|ms| ms * (n_skipped as f64 / (n_run + n_skipped) as f64)),
        // The least time, by the median of all starts.
        roof_share: first.and_then(|pass| {
            Some(pass.roof_share? * pass.p50_ms? / median(&ms).filter(|ms| *ms > 0.0)?)
        }),
        bytes: first.and_then(|pass| pass.bytes),
        operations: first.and_then(|pass| pass.operations),
    }
}

fn ratio(serial: &Timed<'_>, parallel: &Timed<'_>) -> Option<Ratio> {
    let [serial, parallel] = [serial, parallel].map(|of| of.blocks(|row| Some(row.frame_ms)));
    let (low, high) =
        ratio_interval(&parallel, &serial, Pairing::Rounds, 1.0).map(|i| (i.low, i.high)).unzip();
    let base = median(&values(&serial)).filter(|ms| *ms > 0.0)?;
    Some(Ratio { parallel_by_serial: median(&values(&parallel))? / base, low, high })
}

fn overlap(serial: &Timed<'_>, parallel: Option<&Timed<'_>>) -> Option<Overlap> {
    let frame = |row: &&FrameRow| SerialFrame {
        frame_ms: row.frame_ms,
        game_ms: row.game_ms,
        render_ms: row_times(row)[2].unwrap_or(f64::NAN),
    };
    let frames: Vec<SerialFrame> = serial.rows.iter().map(frame).collect();
    let parallel = parallel.map(|of| values(&of.blocks(|row| Some(row.frame_ms))));
    Overlap::of(&frames, &parallel.unwrap_or_default())
}
