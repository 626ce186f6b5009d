//! Judges the timed frames of a bench by the state of the machine.

use std::collections::BTreeMap;
use std::time::Instant;

use super::blocks::{Outcome, Sample};
use super::state::rules::FrameSpan;
use super::state::{BenchState, FrameMark, Judging, Observed, TimedFrame};
use crate::model::scene::Threading;

impl Outcome {
    /// Marks the timed frames that ran at a low clock, and keeps the readings and their summary,
    /// where the state of the machine is read.
    pub fn judge(&mut self) {
        let Some(Judging { log, is_cpu, n_cores, discard }) = self.judging.clone() else { return };
        let (rows, sources, zero) = (log.rows(), log.sources(), log.zero);
        let mut loops = BTreeMap::new();
        let frames: Vec<TimedFrame> = self
            .samples
            .iter()
            .filter(|sample| !sample.warm_up)
            .map(|sample| {
                let is_parallel = sample.of.threading == Threading::Parallel;
                let next = loops.len();
                let i_loop =
                    *loops.entry((sample.i_case, is_parallel, sample.of.skip)).or_insert(next);
                TimedFrame { i_case: sample.i_case, i_loop, span: span(sample, zero) }
            })
            .collect();
        let observed =
            Observed { rows: &rows, sources: &sources, frames: &frames, is_cpu, n_cores, discard };
        let (flags, run, cases) = observed.judge();
        let timed = self.samples.iter_mut().filter(|sample| !sample.warm_up);
        for (sample, flags) in timed.zip(flags) {
            sample.mark = FrameMark { flags, is_discarded: discard && flags.is_throttled() };
        }
        self.state = Some(BenchState { zero, rows, run, cases });
    }
}

/// Returns the time that a frame took, in seconds from `zero`.
fn span(sample: &Sample, zero: Instant) -> FrameSpan {
    let end_s = end_s(sample, zero);
    let begin_s = end_s - 1e-3 * sample.times.frame_ms;
    FrameSpan { i_block: sample.i_block, begin_s, end_s }
}

/// Returns the end of a frame, in seconds from `zero`.
pub fn end_s(sample: &Sample, zero: Instant) -> f64 {
    sample.times.marks.end.saturating_duration_since(zero).as_secs_f64()
}
