//! Summarizes readings and the flags of frames for `run.json`.

use std::collections::BTreeMap;
use std::time::Instant;

use super::record::{CaseState, RunState, Spread, ThrottleCount};
use super::row::{Event, StateRow};
use super::rules::{self, ClockPoint, Flags, FrameSpan};
use super::sampler::StateLog;
use super::text;

/// A timed frame of a bench.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedFrame {
    /// Number of its case.
    pub i_case: usize,
    /// Number of its loop, over all cases.
    pub i_loop: usize,
    /// The time that it took.
    pub span: FrameSpan,
}

/// The readings and the timed frames of a bench.
#[derive(Debug, Clone, Copy)]
pub struct Observed<'a> {
    /// All readings, in the order of time.
    pub rows: &'a [StateRow],
    /// The names of their sources.
    pub sources: &'a [String],
    /// All timed frames.
    pub frames: &'a [TimedFrame],
    /// Whether the device is the processor, whose clock then judges frames.
    pub is_cpu: bool,
    /// Logical cores of the processor.
    pub n_cores: usize,
    /// Whether throttled frames are left out of the statistics.
    pub discard: bool,
}

/// The conditions by which frames are judged.
#[derive(Debug, Clone)]
pub struct Judging {
    /// The readings of the machine's state.
    pub log: StateLog,
    /// Whether the device is the processor.
    pub is_cpu: bool,
    /// Logical cores of the processor.
    pub n_cores: usize,
    /// Whether throttled frames are left out of the statistics.
    pub discard: bool,
}

/// The state of the machine during a bench.
#[derive(Debug, Clone)]
pub struct BenchState {
    /// The start of the run, from which times count.
    pub zero: Instant,
    /// All readings, in the order of time.
    pub rows: Vec<StateRow>,
    /// The record of the run.
    pub run: RunState,
    /// The records of the cases that have timed frames, by their numbers.
    pub cases: BTreeMap<usize, CaseState>,
}

impl Observed<'_> {
    /// Returns the flags of the frames, the record of the run and those of the cases.
    pub fn judge(&self) -> (Vec<Flags>, RunState, BTreeMap<usize, CaseState>) {
        let is_cpu = self.is_cpu;
        let clock = |row: &StateRow| if is_cpu { row.cpu_mhz } else { row.gpu_mhz };
        let spans: Vec<FrameSpan> = self.frames.iter().map(|frame| frame.span).collect();
        let rows = rules::during(&spans, self.rows);
        let flags = rules::flags(&spans, &rows, clock);

        let of_block: BTreeMap<u32, &TimedFrame> =
            self.frames.iter().map(|frame| (frame.span.i_block, frame)).collect();
        let frame_of = |row: &StateRow| of_block.get(&row.block?).copied();
        let point = |row: &&StateRow| {
            let frame = frame_of(row)?;
            Some(ClockPoint { of: frame.i_loop, i_block: row.block?, mhz: clock(row)? })
        };
        let drift = rules::drift(&rows.iter().filter_map(point).collect::<Vec<_>>());

        let mut of_cases: BTreeMap<usize, (Vec<&StateRow>, Vec<Flags>)> = BTreeMap::new();
        for (frame, flags) in self.frames.iter().zip(&flags) {
            of_cases.entry(frame.i_case).or_default().1.push(*flags);
        }
        for row in &rows {
            if let Some(frame) = frame_of(row) {
                of_cases.entry(frame.i_case).or_default().0.push(row);
            }
        }
        let case = |(i, (rows, flags)): (usize, (Vec<&StateRow>, Vec<Flags>))| {
            (i, self.case(&rows, &flags))
        };
        let cases = of_cases.into_iter().map(case).collect();
        let start = self.rows.iter().find(|row| row.event == Event::Start);
        let mut counts = self.rows.iter().filter_map(|row| row.cpu_throttles);
        let counted = counts.clone().next().zip(counts.next_back());
        let mut run = RunState {
            sources: self.sources.to_vec(),
            clock: if is_cpu { "cpu" } else { "gpu" }.to_owned(),
            all: self.case(&rows, &flags),
            drift,
            governor: start.and_then(|row| row.governor.clone()),
            turbo: start.and_then(|row| row.turbo),
            load_at_start: start.and_then(|row| row.load),
            cpu_throttles: counted.map(|(first, last)| last.saturating_sub(first)),
            remarks: vec![],
        };
        run.remarks = text::remarks(&run, self.frames.len(), self.n_cores);
        (flags, run, cases)
    }

    /// Summarizes the readings and flags of some frames.
    fn case(&self, rows: &[&StateRow], flags: &[Flags]) -> CaseState {
        let spread = |of: fn(&StateRow) -> Option<f64>| {
            Spread::of(&rows.iter().filter_map(|row| of(row)).collect::<Vec<_>>())
        };
        let most = |of: fn(&StateRow) -> Option<u64>| rows.iter().filter_map(|row| of(row)).max();
        let n_frames = |of: fn(Flags) -> bool| flags.iter().filter(|f| of(**f)).count();
        CaseState {
            n_readings: rows.len(),
            gpu_mhz: spread(|row| row.gpu_mhz),
            gpu_memory_mhz: spread(|row| row.gpu_memory_mhz),
            gpu_c: spread(|row| row.gpu_c),
            gpu_w: spread(|row| row.gpu_w),
            cpu_mhz: spread(|row| row.cpu_mhz),
            throttle: throttle(rows),
            peak_process_bytes: most(|row| row.process_bytes),
            peak_own_bytes: most(|row| row.own_peak_bytes),
            others_share: rules::others_share(rows),
            n_slow_clock: n_frames(|f| f.slow_clock),
            n_slowdown: n_frames(|f| f.slowdown),
            n_limited: n_frames(|f| f.limited),
            n_discarded: if self.discard { n_frames(Flags::is_throttled) } else { 0 },
        }
    }
}

/// Counts the reasons that held the clock down.
fn throttle(rows: &[&StateRow]) -> Option<Vec<ThrottleCount>> {
    if rows.iter().all(|row| row.throttle.is_none()) {
        return None;
    }
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for reason in rows.iter().flat_map(|row| row.reasons()) {
        *counts.entry(reason).or_default() += 1;
    }
    let count = |(reason, n): (&str, usize)| ThrottleCount { reason: reason.to_owned(), n };
    let mut all: Vec<ThrottleCount> = counts.into_iter().map(count).collect();
    all.sort_by_key(|count| std::cmp::Reverse(count.n));
    Some(all)
}
