//! Times of the last frames, for the panels: per frame, per pass, and on a common time line.

use std::collections::VecDeque;
use std::time::Instant;

use super::shown_times::{self, ShownFrame};
use crate::frame::FrameTimes;
use crate::measure::stats::{Summary, median};

/// Number of frames that a timeline keeps: four seconds at 60 frames a second.
pub const CAPACITY: usize = 240;

/// Begin and end, ms after the beginning of a time line.
pub type Span = [f64; 2];

/// The median of one pass over the frames of a timeline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassTime {
    /// Name of the pass.
    pub name: &'static str,
    /// Median over the frames that ran the pass.
    pub p50_ms: f64,
    /// Share of all frames that ran the pass.
    pub share: f64,
}

/// Times of the last [`CAPACITY`] frames, oldest first.
#[derive(Debug, Clone, Default)]
pub struct Timeline {
    frames: VecDeque<FrameTimes>,
    shown: VecDeque<ShownFrame>,
}

impl Timeline {
    /// Adds a frame, and drops the oldest where there are too many.
    pub fn push(&mut self, times: &FrameTimes) {
        if self.frames.len() == CAPACITY {
            self.frames.pop_front();
        }
        self.frames.push_back(times.clone());
    }

    /// Adds pictures that became visible, and drops the oldest where there are too many.
    pub fn push_shown(&mut self, shown: &[ShownFrame]) {
        self.shown.extend(shown);
        self.shown.drain(..self.shown.len().saturating_sub(CAPACITY));
    }

    /// Returns the statistics of the intervals between visible pictures, and of the times until
    /// they were visible, ms; `None` where the device does not tell.
    pub fn shown_summaries(&self) -> [Option<Summary>; 2] {
        [shown_times::intervals(&self.shown), shown_times::to_screen(&self.shown)]
    }

    /// Returns the frames, oldest first.
    pub fn frames(&self) -> impl ExactSizeIterator<Item = &FrameTimes> + DoubleEndedIterator {
        self.frames.iter()
    }

    /// Returns the frame that ended last.
    pub fn newest(&self) -> Option<&FrameTimes> {
        self.frames.back()
    }

    /// Returns the statistics of one value of each frame; `None` without frames.
    pub fn summary(&self, value: impl Fn(&FrameTimes) -> f64) -> Option<Summary> {
        Summary::of(&self.frames.iter().map(value).collect::<Vec<_>>())
    }

    /// Returns the median of every pass, in the order of their first appearance.
    pub fn passes(&self) -> Vec<PassTime> {
        let mut times: Vec<(&'static str, Vec<f64>)> = vec![];
        for pass in self.frames.iter().flat_map(|f| &f.passes) {
            match times.iter_mut().find(|(known, _)| *known == pass.name) {
                Some((_, ms)) => ms.push(pass.ms()),
                None => times.push((pass.name, vec![pass.ms()])),
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

/// Returns the time to record and submit a frame, ms.
pub fn recording_ms(frame: &FrameTimes) -> f64 {
    frame.record_ms + frame.submit_ms
}

/// Returns the time from `zero` to `t`, ms.
pub fn ms_after(zero: Instant, t: Instant) -> f64 {
    t.saturating_duration_since(zero).as_secs_f64() * 1e3
}

/// Returns name, begin and end of a frame's passes on the device; none without timestamps.
///
/// The offset between the clocks of device and host is not measured here, so the last pass is
/// assumed to end with the frame. `bench --trace` measures the offset.
pub fn device_spans(
    frame: &FrameTimes,
    zero: Instant,
) -> impl Iterator<Item = (&'static str, Span)> {
    let end = ms_after(zero, frame.marks.end);
    let last_ns = frame.passes.last().map_or(0.0, |p| p.end_ns);
    let on_host = move |ns: f64| end - (last_ns - ns) * 1e-6;
    frame.passes.iter().map(move |p| (p.name, [p.begin_ns, p.end_ns].map(on_host)))
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::frame::Marks;
    use crate::frame::plan::Plan;
    use crate::gpu::ScopeTime;
    use std::time::Duration;

    /// Returns the times of frame `i`, with these passes: name, begin and end, ns.
    pub fn times(zero: Instant, i: u32, passes: &[(&'static str, f64, f64)]) -> FrameTimes {
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
        let frame = |i: usize| line.frames().nth(i).unwrap();
        let device = |i| device_spans(frame(i), zero).map(|(_, span)| span).collect::<Vec<_>>();
        let host = |marks: [Instant; 2]| marks.map(|t| ms_after(zero, t));
        let near = |a: Span, b: Span| (a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6;
        assert!(near(host(frame(0).marks.game), [0.0, 2.0]));
        assert!(near(host(frame(1).marks.record), [12.0, 13.0]));
        let first = device(0);
        assert!(near(first[0], [5.0, 6.0]) && near(first[1], [6.0, 9.0]), "{first:?}");
        assert!(near(device(1)[0], [18.0, 19.0]));
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
