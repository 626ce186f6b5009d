//! Summarizes the samples of a bench as the records of its cases and the rows of its frames.

use std::collections::{BTreeMap, BTreeSet};

use super::bench_state::end_s;
use super::blocks::{BenchPlan, Outcome, Sample};
use super::cases::{Case, Loop};
use super::frame_rows::{FrameRow, FrameTable};
use super::intervals::{Pairing, measured, ratio_interval, spread_of_blocks, values};
use super::names::sweep_text;
use super::overlap::{Overlap, SerialFrame};
use super::precision::WIDENING;
use super::records::{self, Measured, Mode, Pass as PassRecord, Ratio, Reason, Skipping};
use crate::frame::FrameTimes;
use crate::frame::plan::{Pass, Reason as PlanReason};
use crate::measure::blocked::{Block, BlockedMedian};
use crate::measure::bootstrap::Interval;
use crate::measure::lows::Lows;
use crate::measure::stats::{Summary, mean, median};
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

/// The timed frames of one case in one loop.
struct Timed<'a> {
    samples: Vec<&'a Sample>,
    /// The factor of intervals.
    widening: f64,
}

impl Timed<'_> {
    fn frames(&self) -> impl Iterator<Item = &FrameTimes> {
        self.samples.iter().map(|s| &s.times)
    }

    fn column(&self, of: impl Fn(&FrameTimes) -> Option<f64>) -> Vec<f64> {
        self.frames().filter_map(of).collect()
    }

    /// Returns a column by blocks, in the order in which they ran.
    fn blocks(&self, of: impl Fn(&FrameTimes) -> Option<f64>) -> Vec<Block> {
        let block = |block: &[&Sample]| Block {
            start: 0,
            stratum: block.first().map_or(0, |s| s.times.i_frame),
            values: block.iter().filter_map(|s| of(&s.times)).collect(),
        };
        self.samples.chunk_by(|a, b| a.i_block == b.i_block).map(block).collect()
    }

    fn frame_ms(&self) -> Vec<Block> {
        self.blocks(|t| Some(t.frame_ms))
    }

    fn measured(&self, of: impl Fn(&FrameTimes) -> Option<f64>) -> Option<Measured> {
        measured(&self.blocks(of), self.widening)
    }

    /// Returns whether at least half of the frames drew nothing.
    fn is_mostly_empty(&self) -> bool {
        2 * self.frames().filter(|t| t.plan.runs_nothing()).count() >= self.samples.len()
    }
}

impl Outcome {
    fn of_loop(&self, i_case: usize, of: Loop) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(move |s| s.i_case == i_case && s.of == of)
    }

    fn timed(&self, i_case: usize, of: Loop) -> Timed<'_> {
        let is_timed = |s: &&Sample| !s.warm_up && !s.mark.is_discarded;
        let samples = self.of_loop(i_case, of).filter(is_timed).collect();
        // Where a precision was asked for, the rule has chosen the number of rounds.
        let widening = if self.reached.contains_key(&i_case) { WIDENING } else { 1.0 };
        Timed { samples, widening }
    }

    /// Returns the intervals that a precision is asked of: those of the median frame time in every
    /// loop that draws, and of the ratio of the two threadings. None if one is not known.
    pub(super) fn intervals(
        &self,
        i_case: usize,
        case: &Case,
        widening: f64,
    ) -> Option<Vec<Interval>> {
        let timed = |of: Loop| {
            let timed = Timed { widening, ..self.timed(i_case, of) };
            (of, timed)
        };
        let drawing: Vec<(Loop, BlockedMedian)> = case
            .loops
            .iter()
            .map(|of| timed(*of))
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
        let timed = |of: Loop| case.loops.contains(&of).then(|| self.timed(i, of));
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
            modes: case.loops.iter().map(|of| self.mode(i, case, *of, unskipped, plan)).collect(),
            ratio: serial.as_ref().zip(parallel.as_ref()).and_then(|(s, p)| ratio(s, p)),
            overlap: serial.as_ref().and_then(|serial| overlap(serial, parallel.as_ref())),
            counts: self.counts.get(&i).copied(),
            skipping: unskipped.and_then(|unskipped| self.skipping(i, case, unskipped)),
            figure: None,
            check: self.checks.get(&i).cloned(),
            precision: self.reached.get(&i).copied(),
            state: self.state.as_ref().and_then(|state| state.cases.get(&i).cloned()),
            invocations: self.invocations.get(&i).cloned(),
        };
        record.figure = record.figure_mode().map(Mode::name);
        record
    }

    fn skipping(&self, i: usize, case: &Case, unskipped: Loop) -> Option<Skipping> {
        let loops = [Loop { skip: true, ..unskipped }, unskipped];
        let [gpu, all] = loops.map(|of| self.timed(i, of).column(gpu_ms));
        if gpu.is_empty() || all.is_empty() {
            return None;
        }
        let hashes = loops.map(|of| self.image_hash(i, of).filter(|_| !has_impostors(case)));
        let same_bytes = if let [Some(a), Some(b)] = hashes { Some(a == b) } else { None };
        Some(Skipping { gpu_ms: mean(&gpu), gpu_no_skip_ms: mean(&all), same_bytes })
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
        i: usize,
        case: &Case,
        of: Loop,
        unskipped: Option<Loop>,
        plan: &BenchPlan,
    ) -> Mode {
        let timed = self.timed(i, of);
        let blocks: BTreeSet<u32> = self.of_loop(i, of).map(|s| s.i_block).collect();
        let depths = timed.column(|t| Some(f64::from(t.queue_depth)));
        let drawn = Summary::of(&timed.column(|t| Some(f64::from(t.n_shown()))));
        let unskipped = unskipped.filter(|u| *u != of).map(|u| self.timed(i, u));
        let is_by_cpu = case.scene.threads.simulate == Simulate::Cpu;
        Mode {
            threading: of.threading.name().into(),
            skip: of.skip,
            simulate: if is_by_cpu { "cpu" } else { "gpu" }.into(),
            frames: timed.samples.len(),
            warm_up: plan.n_warm_up as usize,
            blocks: blocks.len(),
            frame_ms: timed.measured(|t| Some(t.frame_ms)),
            frame_lows: Lows::of(&values(&timed.frame_ms())),
            game_ms: timed.measured(|t| Some(t.game_ms)),
            record_ms: timed.measured(|t| Some(t.record_ms)),
            submit_ms: timed.measured(|t| Some(t.submit_ms)),
            wait_ms: timed.measured(|t| Some(t.wait_ms)),
            render_ms: timed.measured(|t| Some(t.render_ms())),
            gpu_ms: timed.measured(gpu_ms),
            latency_ms: timed.measured(|t| Some(t.latency_ms)),
            queue_depth: (!depths.is_empty()).then(|| mean(&depths)),
            drawn: drawn.map(|s| [s.min, s.mean, s.max]),
            empty_frames: Some(timed.frames().filter(|t| t.plan.runs_nothing()).count()),
            impostors_reused: timed.frames().filter(|t| is_impostor_reused(t)).count(),
            passes: Pass::ALL.map(|p| pass_record(p, &timed, unskipped.as_ref())).to_vec(),
            image_hash: self.image_hash(i, of).map(str::to_owned),
            block_spread: spread_of_blocks(&timed.frame_ms()),
        }
    }

    /// Returns the rows of `frames.csv`.
    pub fn table(&self, cases: &[Case]) -> FrameTable {
        let zero = self.state.as_ref().map(|state| state.zero);
        let row = |s: &Sample| FrameRow {
            phase: cases[s.i_case].phase.clone().unwrap_or_default(),
            sweep: sweep_text(&cases[s.i_case].sweep),
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
        };
        let pass_names = Pass::ALL.map(|pass| pass.name().to_owned()).to_vec();
        FrameTable { pass_names, rows: self.samples.iter().map(row).collect() }
    }
}

/// Returns whether the pictures of a case depend on skipping: without it no impostor is used.
fn has_impostors(case: &Case) -> bool {
    case.scene.draw.impostors != Impostors::Off
}

/// Returns the ratio of the median frame times with its 95 % bootstrap interval.
fn ratio(serial: &Timed<'_>, parallel: &Timed<'_>) -> Option<Ratio> {
    let [serial_ms, parallel_ms] = [serial, parallel].map(Timed::frame_ms);
    let interval = ratio_interval(&parallel_ms, &serial_ms, Pairing::Rounds, serial.widening);
    let (low, high) = interval.map(|i| (i.low, i.high)).unzip();
    let [serial, parallel] = [serial_ms, parallel_ms].map(|blocks| median(&values(&blocks)));
    let parallel_by_serial = parallel? / serial.filter(|ms| *ms > 0.0)?;
    Some(Ratio { parallel_by_serial, low, high })
}

fn overlap(serial: &Timed<'_>, parallel: Option<&Timed<'_>>) -> Option<Overlap> {
    let frame = |t: &FrameTimes| SerialFrame {
        frame_ms: t.frame_ms,
        game_ms: t.game_ms,
        render_ms: t.render_ms(),
    };
    let serial: Vec<SerialFrame> = serial.frames().map(frame).collect();
    Overlap::of(&serial, &parallel.map_or(vec![], |of| values(&of.frame_ms())))
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

/// Returns the record of a pass; `unskipped` are the frames of the loop that skips nothing.
fn pass_record(pass: Pass, timed: &Timed<'_>, unskipped: Option<&Timed<'_>>) -> PassRecord {
    let total: f64 = timed.column(gpu_ms).iter().sum();
    let n = timed.samples.len();
    let column = |of: &Timed<'_>| of.column(|t| pass_ms(t, pass));
    let ms = column(timed);
    let reason = |t: &FrameTimes| t.plan.decision(pass).reason.to_string();
    let skipped: Vec<&FrameTimes> = timed.frames().filter(|t| !t.plan.runs(pass)).collect();
    let whole_ms = unskipped.and_then(|of| median(&column(of))).filter(|_| !skipped.is_empty());
    PassRecord {
        name: pass.name().to_owned(),
        p50_ms: median(&ms),
        share: (total > 0.0).then(|| ms.iter().sum::<f64>() / total),
        n_run: n - skipped.len(),
        n_skipped: skipped.len(),
        reason: skipped.last().map(|t| reason(t)),
        reasons: reasons(skipped.iter().map(|t| reason(t))),
        saved_ms: whole_ms.map(|ms| ms * (skipped.len() as f64 / n as f64)),
        bytes: None,
        operations: None,
        roof_share: None,
    }
}
