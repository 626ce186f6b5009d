//! The rules by which readings of the machine's state judge frames and runs. All are pure functions
//! over series.

use std::collections::BTreeMap;

use super::record::Drift;
use super::row::StateRow;
use crate::measure::bootstrap::Bootstrap;
use crate::measure::stats::{mean, median};

/// Least clock of a frame that is not flagged, as a share of the run's median clock. nvbench
/// discards samples below the same share of the clock that the device names.
pub const LEAST_CLOCK: f64 = 0.75;
/// Longest time from a frame to a reading that stands for it, in s.
const MOST_APART_S: f64 = 0.5;
/// Least readings of a third of a run whose clock may be said to drift.
pub const LEAST_READINGS: usize = 30;
/// Least change of the clock that counts as a drift.
pub const LEAST_DRIFT: f64 = 0.02;
/// Share of the processors' time from which on other processes are remarked on.
pub const MOST_OTHERS: f64 = 0.05;
/// Load a processor from which on a start is remarked on.
pub const MOST_LOAD: f64 = 0.5;
/// Least ticks of all processors that a share is told from: at 10 ms a tick, two tenths of a second
/// of one processor, of which one tick is 5 %.
const LEAST_TICKS: u64 = 20;

/// The time that a frame took, in seconds since the start of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameSpan {
    /// Number of its block.
    pub i_block: u32,
    /// End of the frame before.
    pub begin_s: f64,
    /// End of the frame.
    pub end_s: f64,
}

/// Why a frame's time is not that of the machine at its usual clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Flags {
    /// The clock was below [`LEAST_CLOCK`] of the run's median.
    pub slow_clock: bool,
    /// Heat, or a fault of the power supply, held the clock down.
    pub slowdown: bool,
    /// A limit of power or current held the clock down. A device that works at its limit does so
    /// all the time.
    pub limited: bool,
}

impl Flags {
    /// Whether the frame is flagged at all.
    pub fn any(self) -> bool {
        self.slow_clock || self.slowdown || self.limited
    }

    /// Whether `--discard-throttled` leaves the frame out. A limit of power alone is no reason: its
    /// clock is then the device's usual one, or too slow.
    pub fn is_throttled(self) -> bool {
        self.slow_clock || self.slowdown
    }

    /// Returns the flags as `frames.csv` has them, joined by "+"; empty without one.
    pub fn text(self) -> String {
        let all =
            [(self.slow_clock, "clock"), (self.slowdown, "slowdown"), (self.limited, "power")];
        all.iter()
            .filter(|(is_set, _)| *is_set)
            .map(|(_, name)| *name)
            .collect::<Vec<_>>()
            .join("+")
    }
}

/// The judgement of a frame by the state of the machine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FrameMark {
    /// What held the clock down.
    pub flags: Flags,
    /// Whether the frame is in no statistic.
    pub is_discarded: bool,
}

/// Whether a reason that holds the clock down is heat or a fault, and no limit of power or current.
/// NVML, i915, Xe and amdgpu have names of their own; these words are in the names of such reasons.
pub fn is_slowdown(reason: &str) -> bool {
    const WORDS: [&str; 5] = ["therm", "prochot", "ratl", "slowdown", "temperature"];
    WORDS.iter().any(|word| reason.contains(word))
}

/// Returns the readings that were taken while the given frames of their block ran.
pub fn during<'a>(frames: &[FrameSpan], rows: &'a [StateRow]) -> Vec<&'a StateRow> {
    /// A reading at the end of a block begins after its last frame. Clocks fall more slowly.
    const LATE_S: f64 = 0.02;
    let mut spans: BTreeMap<u32, [f64; 2]> = BTreeMap::new();
    for frame in frames {
        let span = spans.entry(frame.i_block).or_insert([frame.begin_s, frame.end_s]);
        *span = [span[0].min(frame.begin_s), span[1].max(frame.end_s)];
    }
    let is_in = |row: &&StateRow| {
        let span = row.block.and_then(|block| spans.get(&block));
        span.is_some_and(|[begin, end]| (*begin..=end + LATE_S).contains(&row.time_s))
    };
    rows.iter().filter(is_in).collect()
}

/// Returns the flags of each frame. `rows` are the readings [`during`] the frames, in the order of
/// time; `clock` is the clock of the device in one of them.
///
/// A frame has the mean clock and all reasons of the readings during it. If there is none, the
/// nearest reading of its block stands for it, unless that is half a second away.
pub fn flags(
    frames: &[FrameSpan],
    rows: &[&StateRow],
    clock: impl Fn(&StateRow) -> Option<f64>,
) -> Vec<Flags> {
    let mut blocks: BTreeMap<u32, BlockSeries> = BTreeMap::new();
    for row in rows {
        let Some(block) = row.block else { continue };
        let series = blocks.entry(block).or_default();
        series.clocks.extend(clock(row).map(|clock| (row.time_s, clock)));
        if row.throttle.is_some() {
            let slowdown = row.reasons().any(is_slowdown);
            let limited = row.reasons().any(|reason| !is_slowdown(reason));
            series.reasons.push((row.time_s, [slowdown, limited]));
        }
    }
    let all: Vec<f64> = rows.iter().filter_map(|row| clock(row)).collect();
    let least = median(&all).map(|median| LEAST_CLOCK * median);
    let of = |frame: &FrameSpan| {
        let Some(series) = blocks.get(&frame.i_block) else { return Flags::default() };
        let clocks: Vec<f64> = of_frame(&series.clocks, frame).iter().map(|(_, c)| *c).collect();
        let reasons = of_frame(&series.reasons, frame);
        let is_slow = |least: f64| !clocks.is_empty() && mean(&clocks) < least;
        Flags {
            slow_clock: least.is_some_and(is_slow),
            slowdown: reasons.iter().any(|(_, [slowdown, _])| *slowdown),
            limited: reasons.iter().any(|(_, [_, limited])| *limited),
        }
    };
    frames.iter().map(of).collect()
}

/// The readings of a block: times in s with clocks, and with whether heat and power held the clock
/// down.
#[derive(Default)]
struct BlockSeries {
    clocks: Vec<(f64, f64)>,
    reasons: Vec<(f64, [bool; 2])>,
}

/// Returns the part of a series, in the order of time, that stands for a frame.
fn of_frame<'a, T>(series: &'a [(f64, T)], frame: &FrameSpan) -> &'a [(f64, T)] {
    let first = series.partition_point(|(time, _)| *time < frame.begin_s);
    let end = series.partition_point(|(time, _)| *time <= frame.end_s);
    if first < end {
        return &series[first..end];
    }
    let before = first.checked_sub(1).map(|i| (frame.begin_s - series[i].0, i));
    let after = series.get(end).map(|(time, _)| (time - frame.end_s, end));
    let nearest = before.into_iter().chain(after).min_by(|a, b| a.0.total_cmp(&b.0));
    match nearest.filter(|(apart, _)| *apart <= MOST_APART_S) {
        Some((_, i)) => &series[i..=i],
        None => &[],
    }
}

/// A reading of the clock of one loop of one case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockPoint {
    /// Number of the case and loop.
    pub of: usize,
    /// Number of the block.
    pub i_block: u32,
    /// The clock in MHz.
    pub mhz: f64,
}

/// Returns whether the clock changed over a run, from its readings in the order of time.
///
/// Loops need different power, and so have different clocks. Each reading is therefore divided by
/// the median of its case and loop, and loops of one block, which cannot tell a change from their
/// own clock, are left out. The means of the last third and of the first third are compared, with a
/// bootstrap that keeps neighbours together. None for fewer than [`LEAST_READINGS`] in a third.
pub fn drift(points: &[ClockPoint]) -> Option<Drift> {
    let mut loops: BTreeMap<usize, (Vec<f64>, [u32; 2])> = BTreeMap::new();
    for point in points {
        let (all, [least, most]) =
            loops.entry(point.of).or_insert((vec![], [point.i_block, point.i_block]));
        all.push(point.mhz);
        (*least, *most) = ((*least).min(point.i_block), (*most).max(point.i_block));
    }
    let has_several = |(_, [least, most]): &(Vec<f64>, [u32; 2])| least < most;
    let medians: BTreeMap<usize, f64> = loops
        .iter()
        .filter(|(_, of)| has_several(of))
        .filter_map(|(i, (all, _))| Some((*i, median(all).filter(|m| *m > 0.0)?)))
        .collect();
    let relative: Vec<f64> =
        points.iter().filter_map(|p| Some(p.mhz / medians.get(&p.of)?)).collect();
    let n = relative.len() / 3;
    if n < LEAST_READINGS {
        return None;
    }
    let (first, last) = (&relative[..n], &relative[relative.len() - n..]);
    let mean_of = |values: &[f64], rows: &[usize]| {
        rows.iter().map(|i| values[*i]).sum::<f64>() / rows.len() as f64
    };
    let ratio = Bootstrap::of_neighbours(n)
        .interval([n, n], |[a, b]| mean_of(last, b) / mean_of(first, a))?;
    let excludes_1 = ratio.low > 1.0 || ratio.high < 1.0;
    Some(Drift {
        last_by_first: ratio.estimate,
        low: ratio.low,
        high: ratio.high,
        drifts: excludes_1 && (ratio.estimate - 1.0).abs() > LEAST_DRIFT,
    })
}

/// Returns the share of the processors' time that other processes took in all blocks, from the
/// first to the last reading of each. None without such readings, or if they are too close.
pub fn others_share(rows: &[&StateRow]) -> Option<f64> {
    let mut blocks: BTreeMap<u32, [[u64; 3]; 2]> = BTreeMap::new();
    for row in rows {
        let ticks = row.cpu_ticks.zip(row.cpu_busy_ticks).zip(row.cpu_own_ticks);
        let (Some(block), Some(((all, busy), own))) = (row.block, ticks) else { continue };
        let ticks = [all, busy, own];
        blocks.entry(block).or_insert([ticks, ticks])[1] = ticks;
    }
    let mut sums = [0_u64; 3];
    for [first, last] in blocks.values() {
        for (sum, (first, last)) in sums.iter_mut().zip(first.iter().zip(last)) {
            *sum = sum.saturating_add(last.saturating_sub(*first));
        }
    }
    let [all, busy, own] = sums;
    (all >= LEAST_TICKS).then(|| busy.saturating_sub(own) as f64 / all as f64)
}
