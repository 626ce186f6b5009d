//! Timed blocks: in every round each configuration runs a few frames, and the unchanged scene
//! runs between every few of them, so that each is compared with the scene just before and just
//! after. A drift of a shared machine over minutes affects both alike.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::measure::figure::Figure;
use crate::measure::stats::median;

/// Configurations between two blocks of the unchanged scene, which is configuration 0.
pub const BETWEEN: usize = 4;

/// Consecutive frames of one configuration; a "turn" in `times.csv`.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedBlock {
    /// Number of the configuration.
    pub i_configuration: usize,
    /// Number of the round.
    pub i_round: usize,
    /// Device time of every frame in ms; empty without timestamps.
    pub gpu_ms: Vec<f64>,
    /// Host time of every frame in ms.
    pub frame_ms: Vec<f64>,
}

impl TimedBlock {
    /// Returns a block without frames.
    pub fn new(i_configuration: usize, i_round: usize) -> TimedBlock {
        TimedBlock { i_configuration, i_round, gpu_ms: Vec::new(), frame_ms: Vec::new() }
    }
}

/// The time that decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum TimeKind {
    /// Device time of all passes
    Gpu,
    /// From the beginning of the game step to the finished picture
    Frame,
}

impl TimeKind {
    /// Returns the name in arguments and records.
    pub fn name(self) -> &'static str {
        if self == TimeKind::Gpu { "gpu" } else { "frame" }
    }

    fn of(self, block: &TimedBlock) -> Option<f64> {
        median(if self == TimeKind::Gpu { &block.gpu_ms } else { &block.frame_ms })
    }
}

/// Returns the order of the blocks of a round over the configurations `others`: 0 a b c d 0 e f 0,
/// with `others` reversed in every second round.
pub fn order(others: &[usize], i_round: usize) -> Vec<usize> {
    let mut others = others.to_vec();
    if i_round % 2 == 1 {
        others.reverse();
    }
    let mut order = vec![0];
    for few in others.chunks(BETWEEN) {
        order.extend(few);
        order.push(0);
    }
    order
}

/// Returns, for every block of configuration `i`, its time divided by the geometric mean of the
/// scene's blocks around it.
fn ratios(blocks: &[TimedBlock], i: usize, time: TimeKind) -> Vec<f64> {
    let is_base = |block: &&TimedBlock| block.i_configuration == 0;
    let mut ratios = Vec::new();
    for (k, block) in blocks.iter().enumerate().filter(|(_, block)| block.i_configuration == i) {
        let in_round = |other: &&TimedBlock| other.i_round == block.i_round;
        let before = blocks[..k].iter().rev().take_while(in_round).find(is_base);
        let after = blocks[k + 1..].iter().take_while(in_round).find(is_base);
        // A round that was cut short has no block after it.
        let around = before.into_iter().chain(after).filter_map(|b| time.of(b));
        let logs: Vec<f64> = around.filter(|ms| *ms > 0.0).map(f64::ln).collect();
        let mean = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
        ratios.extend(time.of(block).filter(|_| !logs.is_empty()).map(|ms| ms / mean));
    }
    ratios
}

/// The times of a configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockTimes {
    /// Its time divided by that of the unchanged scene.
    pub by_base: Figure,
    /// `by_base` times the median of the unchanged scene, in ms. For the scene itself it is its
    /// median, whose interval includes the drift.
    pub ms: Figure,
}

/// Summarizes the blocks of configuration `i`; none if it or the scene has no such times.
pub fn block_times(blocks: &[TimedBlock], i: usize, time: TimeKind) -> Option<BlockTimes> {
    let of_base = blocks.iter().filter(|b| b.i_configuration == 0).filter_map(|b| time.of(b));
    let base = Figure::median(&of_base.collect::<Vec<f64>>())?;
    if i == 0 {
        let one = Figure { value: 1.0, low: Some(1.0), high: Some(1.0) };
        return Some(BlockTimes { by_base: one, ms: base });
    }
    let by_base = Figure::median(&ratios(blocks, i, time))?;
    Some(BlockTimes { by_base, ms: by_base.times(base.value) })
}

/// Returns the number of blocks of configuration `i`.
pub fn n_blocks(blocks: &[TimedBlock], i: usize) -> usize {
    blocks.iter().filter(|block| block.i_configuration == i).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(i_configuration: usize, i_round: usize, ms: f64) -> TimedBlock {
        TimedBlock {
            i_configuration,
            i_round,
            gpu_ms: vec![ms],
            frame_ms: vec![ms + 1.0, ms + 1.0, ms + 90.0],
        }
    }

    #[test]
    fn the_scene_has_a_block_before_and_after_every_few_others() {
        assert_eq!(order(&[1, 2, 3, 4, 5, 6], 0), [0, 1, 2, 3, 4, 0, 5, 6, 0]);
        assert_eq!(order(&[1, 2, 3, 4, 5, 6], 1), [0, 6, 5, 4, 3, 0, 2, 1, 0]);
        assert_eq!(order(&[], 3), [0]);
    }

    #[test]
    fn a_drift_cancels_in_the_ratio() {
        // A machine that gets 3 % slower from block to block; configurations that take 0.8 and 2
        // times the scene's time.
        let mut blocks = Vec::new();
        for i_round in 0..10 {
            for i in order(&[1, 2], i_round) {
                let speed = 1.03f64.powi(blocks.len() as i32);
                blocks.push(block(i, i_round, speed * [10.0, 8.0, 20.0][i]));
            }
        }
        for (i, ratio) in [(1, 0.8), (2, 2.0)] {
            let found = block_times(&blocks, i, TimeKind::Gpu).unwrap();
            assert!((found.by_base.value / ratio - 1.0).abs() < 0.02, "{found:?}");
            assert!(
                found.by_base.low.unwrap() <= ratio * 1.02
                    && found.by_base.high.unwrap() >= ratio * 0.98
            );
            let base = block_times(&blocks, 0, TimeKind::Gpu).unwrap();
            assert!((found.ms.value - base.ms.value * found.by_base.value).abs() < 1e-12);
            assert_eq!(base.by_base.value, 1.0);
        }
        // The median of a block's frames counts: one disturbed frame does not matter.
        let frame = block_times(&blocks[..4], 1, TimeKind::Frame).unwrap();
        assert!((frame.by_base.value - 9.0 / 11.0).abs() < 0.03);
    }

    #[test]
    fn a_round_cut_short_has_a_ratio_and_a_device_without_timestamps_has_none() {
        let cut = [block(0, 0, 10.0), block(1, 0, 5.0)];
        let found = block_times(&cut, 1, TimeKind::Gpu).unwrap();
        // The geometric mean of a single value is rounded.
        assert!((found.by_base.value - 0.5).abs() < 1e-15 && found.by_base.low.is_none());
        assert_eq!(
            (block_times(&cut, 2, TimeKind::Gpu), block_times(&[], 0, TimeKind::Gpu)),
            (None, None)
        );
        let none = [
            TimedBlock { gpu_ms: vec![], ..block(0, 0, 1.0) },
            TimedBlock { gpu_ms: vec![], ..block(1, 0, 1.0) },
        ];
        assert_eq!(block_times(&none, 1, TimeKind::Gpu), None);
        assert!(block_times(&none, 1, TimeKind::Frame).is_some());
        // A block of the scene in another round does not count.
        assert_eq!(block_times(&[block(0, 0, 10.0), block(1, 1, 5.0)], 1, TimeKind::Gpu), None);
        assert_eq!((n_blocks(&cut, 0), n_blocks(&cut, 1), n_blocks(&cut, 2)), (1, 1, 0));
    }
}
