//! Statistics of the timed frames of one case in one loop.

use super::frame_rows::FrameRow;
use super::intervals::{Pairing, measured, ratio_interval, spread_of_blocks, values};
use super::overlap::{Overlap, SerialFrame};
use super::records::{self, Measured, Mode, Pass, Ratio, Skipping};
use crate::measure::blocked::Block;
use crate::measure::lows::Lows;
use crate::measure::stats::{Summary, mean, median};

/// The timed rows of one case in one loop, in the order in which they ran.
pub struct TimedRows<'a> {
    rows: Vec<&'a FrameRow>,
    /// By the blocks' numbers. A block that is not listed belongs to start 0.
    block_order: &'a [records::Block],
    /// The factor of intervals.
    widening: f64,
}

impl<'a> TimedRows<'a> {
    /// Takes the rows that are timed.
    pub fn new(
        rows: impl Iterator<Item = &'a FrameRow>,
        block_order: &'a [records::Block],
        widening: f64,
    ) -> TimedRows<'a> {
        TimedRows { rows: rows.filter(|row| row.is_timed()).collect(), block_order, widening }
    }

    /// Returns a column by blocks.
    pub fn blocks(&self, of: impl Fn(&FrameRow) -> Option<f64>) -> Vec<Block> {
        let block = |rows: &[&FrameRow]| {
            let first = rows.first();
            let order = first.and_then(|row| self.block_order.get(row.block as usize));
            Block {
                start: order.map_or(0, |block| block.start),
                stratum: first.map_or(0, |row| row.frame),
                values: rows.iter().filter_map(|row| of(row)).filter(|ms| ms.is_finite()).collect(),
            }
        };
        self.rows.chunk_by(|a, b| a.block == b.block).map(block).collect()
    }

    /// Returns the frame times by blocks, ms.
    pub fn frame_ms(&self) -> Vec<Block> {
        self.blocks(|row| Some(row.frame_ms))
    }

    /// Whether at least half of the frames drew nothing.
    pub fn is_mostly_empty(&self) -> bool {
        2 * self.n_empty() >= self.rows.len()
    }

    /// Returns a loop's record with the statistics of these rows; the rest is `mode`'s. `n_blocks`
    /// are all blocks of the loop.
    pub fn mode(&self, n_blocks: usize, mode: Mode) -> Mode {
        let of = |column: fn(&FrameRow) -> f64| self.measured(|row| Some(column(row)));
        let column = |of: fn(&FrameRow) -> u32| -> Vec<f64> {
            self.rows.iter().map(|row| f64::from(of(row))).collect()
        };
        let (frame_ms, depths) = (self.frame_ms(), column(|row| row.queue_depth));
        Mode {
            frames: self.rows.len(),
            blocks: n_blocks,
            frame_lows: Lows::of(&values(&frame_ms)),
            frame_ms: measured(&frame_ms, self.widening),
            game_ms: of(|row| row.game_ms),
            record_ms: of(|row| row.record_ms),
            submit_ms: of(|row| row.submit_ms),
            wait_ms: of(|row| row.wait_ms),
            render_ms: of(FrameRow::render_ms),
            gpu_ms: self.measured(|row| row.gpu_ms),
            latency_ms: of(|row| row.latency_ms),
            queue_depth: (!depths.is_empty()).then(|| mean(&depths)),
            drawn: Summary::of(&column(|row| row.n_drawn)).map(|s| [s.min, s.mean, s.max]),
            empty_frames: Some(self.n_empty()),
            block_spread: spread_of_blocks(&frame_ms),
            ..mode
        }
    }

    /// Returns the record of pass `k` with the statistics of these rows; the rest is `pass`'s.
    /// `whole` are the rows of the loop that skips nothing.
    pub fn pass(&self, k: usize, whole: Option<&TimedRows<'_>>, pass: Pass) -> Pass {
        let of = |rows: &TimedRows<'_>| {
            values(&rows.blocks(|row| row.pass_ms.get(k).copied().flatten()))
        };
        let (ms, total) = (of(self), self.gpu_ms().iter().sum::<f64>());
        let whole_ms = whole.and_then(|whole| median(&of(whole))).filter(|_| pass.n_skipped > 0);
        let n = (pass.n_run + pass.n_skipped) as f64;
        Pass {
            p50_ms: median(&ms),
            share: (total > 0.0).then(|| ms.iter().sum::<f64>() / total),
            saved_ms: whole_ms.map(|ms| ms * (pass.n_skipped as f64 / n)),
            ..pass
        }
    }

    fn n_empty(&self) -> usize {
        self.rows.iter().filter(|row| row.ran.is_empty()).count()
    }

    fn measured(&self, of: impl Fn(&FrameRow) -> Option<f64>) -> Option<Measured> {
        measured(&self.blocks(of), self.widening)
    }

    /// Returns the device times of the frames, ms; none without timestamps.
    fn gpu_ms(&self) -> Vec<f64> {
        values(&self.blocks(|row| row.gpu_ms))
    }
}

/// Returns the ratio of the median frame times with its 95 % interval.
pub fn ratio(serial: &TimedRows<'_>, parallel: &TimedRows<'_>) -> Option<Ratio> {
    let [serial_ms, parallel_ms] = [serial, parallel].map(TimedRows::frame_ms);
    let interval = ratio_interval(&parallel_ms, &serial_ms, Pairing::Rounds, serial.widening);
    let (low, high) = interval.map(|i| (i.low, i.high)).unzip();
    let [serial, parallel] = [serial_ms, parallel_ms].map(|blocks| median(&values(&blocks)));
    let parallel_by_serial = parallel? / serial.filter(|ms| *ms > 0.0)?;
    Some(Ratio { parallel_by_serial, low, high })
}

/// Returns what two threads can gain over one, and do gain.
pub fn overlap(serial: &TimedRows<'_>, parallel: Option<&TimedRows<'_>>) -> Option<Overlap> {
    let frame = |row: &&FrameRow| SerialFrame {
        frame_ms: row.frame_ms,
        game_ms: row.game_ms,
        render_ms: row.render_ms(),
    };
    let frames: Vec<SerialFrame> = serial.rows.iter().map(frame).collect();
    Overlap::of(&frames, &parallel.map_or(vec![], |of| values(&of.frame_ms())))
}

/// Returns the device times with and without skipping; `None` without timestamps.
pub fn skipping(
    with: &TimedRows<'_>,
    without: &TimedRows<'_>,
    same_bytes: Option<bool>,
) -> Option<Skipping> {
    let [gpu, all] = [with, without].map(TimedRows::gpu_ms);
    let is_known = !gpu.is_empty() && !all.is_empty();
    is_known.then(|| Skipping { gpu_ms: mean(&gpu), gpu_no_skip_ms: mean(&all), same_bytes })
}
