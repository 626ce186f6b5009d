//! Times of the last frames, for the panels: per frame, per pass, and on a common time line.

use std::collections::VecDeque;
use std::time::Instant;

use crate::frame::FrameTimes;
use crate::measure::stats::{Summary, median};

/// Number of frames that a timeline keeps.
pub const CAPACITY: usize = 240;

/// Begin and end, ms after the timeline's first frame began.
pub type Span = [f64; 2];

/// Times of one frame, ms.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    pub frame_ms: f64,
    pub game_ms: f64,
    /// Recording and submission.
    pub record_ms: f64,
    pub wait_ms: f64,
    pub latency_ms: f64,
    pub game: Span,
    pub record: Span,
    pub end: f64,
    /// Passes of the device in order; empty without timestamps.
    ///
    /// The last pass is assumed to end with the frame, because the offset between the clocks of
    /// device and host is not measured here (`bench --trace` measures it).
    pub passes: Vec<(&'static str, Span)>,
}

/// The median of one pass over the frames of a timeline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassTime {
    pub name: &'static str,
    /// Median over the frames that ran the pass.
    pub p50_ms: f64,
    /// Share of all frames that ran the pass.
    pub share: f64,
}

/// Times of the last [`CAPACITY`] frames, oldest first.
#[derive(Debug, Clone, Default)]
pub struct Timeline {
    zero: Option<Instant>,
    frames: VecDeque<Frame>,
}

impl Timeline {
    /// Adds a frame, and drops the oldest where there are too many.
    pub fn push(&mut self, times: &FrameTimes) {
        let zero = *self.zero.get_or_insert(times.marks.game[0]);
        let at = |t: Instant| t.saturating_duration_since(zero).as_secs_f64() * 1e3;
        let end = at(times.marks.end);
        let last_ns = times.passes.last().map_or(0.0, |p| p.end_ns);
        let on_host = |ns: f64| end - (last_ns - ns) * 1e-6;
        if self.frames.len() == CAPACITY {
            self.frames.pop_front();
        }
        let passes = times.passes.iter();
        self.frames.push_back(Frame {
            frame_ms: times.frame_ms,
            game_ms: times.game_ms,
            record_ms: times.record_ms + times.submit_ms,
            wait_ms: times.wait_ms,
            latency_ms: times.latency_ms,
            game: times.marks.game.map(at),
            record: times.marks.record.map(at),
            end,
            passes: passes.map(|p| (p.name, [p.begin_ns, p.end_ns].map(on_host))).collect(),
        });
    }

    /// Returns the frames, oldest first.
    pub fn frames(&self) -> impl ExactSizeIterator<Item = &Frame> + DoubleEndedIterator {
        self.frames.iter()
    }

    /// Returns the statistics of one value of each frame; `None` without frames.
    pub fn summary(&self, value: impl Fn(&Frame) -> f64) -> Option<Summary> {
        Summary::of(&self.frames.iter().map(value).collect::<Vec<_>>())
    }

    /// Returns the median of every pass, in the order of their first appearance.
    pub fn passes(&self) -> Vec<PassTime> {
        let mut times: Vec<(&'static str, Vec<f64>)> = vec![];
        for (name, [begin, end]) in self.frames.iter().flat_map(|f| &f.passes) {
            match times.iter_mut().find(|(known, _)| known == name) {
                Some((_, ms)) => ms.push(end - begin),
                None => times.push((name, vec![end - begin])),
            }
        }
        let n_frames = self.frames.len() as f64;
        let pass = |(name, ms): (&'static str, Vec<f64>)| PassTime {
            name,
            p50_ms: median(&ms).unwrap_or(0.0),
            share: ms.len() as f64 / n_frames,
        };
        times.into_iter().map(pass).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Marks;
    use crate::frame::plan::Plan;
    use crate::gpu::ScopeTime;
    use std::time::Duration;

    fn times(zero: Instant, i: u32, passes: &[(&'static str, f64, f64)]) -> FrameTimes {
        let at = |ms: f64| zero + Duration::from_secs_f64(1e-3 * (10.0 * f64::from(i) + ms));
        let pass = |(name, begin_ns, end_ns): &(&'static str, f64, f64)| ScopeTime {
            name,
            begin_ns: *begin_ns,
            end_ns: *end_ns,
        };
        FrameTimes {
            i_frame: i,
            time_s: 0.0,
            frame_ms: 10.0 + f64::from(i),
            game_ms: 2.0,
            record_ms: 1.0,
            submit_ms: 0.5,
            wait_ms: 5.0,
            latency_ms: 9.0,
            queue_depth: 0,
            n_drawn: 7,
            n_kept: None,
            marks: Marks { game: [at(0.0), at(2.0)], record: [at(2.0), at(3.0)], end: at(9.0) },
            plan: Plan::of_nothing(),
            passes: passes.iter().map(pass).collect(),
        }
    }

    #[test]
    fn frames_share_one_time_line_and_device_passes_end_with_their_frame() {
        let zero = Instant::now();
        let mut line = Timeline::default();
        line.push(&times(zero, 0, &[("grid", 5e6, 6e6), ("tiles", 6e6, 9e6)]));
        line.push(&times(zero, 1, &[("tiles", 100e6, 101e6)]));
        let [first, second] = [0, 1].map(|i| line.frames().nth(i).unwrap().clone());
        let near = |a: Span, b: Span| (a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6;
        assert!(near(first.game, [0.0, 2.0]) && near(second.record, [12.0, 13.0]));
        assert!(
            near(first.passes[0].1, [5.0, 6.0]) && near(first.passes[1].1, [6.0, 9.0]),
            "{first:?}"
        );
        assert!(near(second.passes[0].1, [18.0, 19.0]));
        assert_eq!(line.summary(|f| f.frame_ms).map(|s| (s.n, s.p50)), Some((2, 10.5)));
        let passes = line.passes();
        assert_eq!(
            passes.iter().map(|p| (p.name, p.share)).collect::<Vec<_>>(),
            [("grid", 0.5), ("tiles", 1.0)]
        );
        assert!((passes[1].p50_ms - 2.0).abs() < 1e-6);
    }

    #[test]
    fn the_oldest_frames_are_dropped() {
        let zero = Instant::now();
        let mut line = Timeline::default();
        assert!(line.summary(|f| f.frame_ms).is_none() && line.passes().is_empty());
        (0..CAPACITY as u32 + 5).for_each(|i| line.push(&times(zero, i, &[])));
        assert_eq!((line.frames().len(), line.frames().next().unwrap().frame_ms), (CAPACITY, 15.0));
    }
}
