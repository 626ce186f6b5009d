//! The last frames of a loop as panels show them: how long they took, what each pass took, and who
//! did what when.

use std::collections::VecDeque;
use std::time::Instant;

use crate::frame::FrameTimes;
use crate::measure::stats::{Summary, median};
use crate::model::scene::Threading;

/// So many frames are kept.
pub const KEPT: usize = 240;

/// A stretch of time, ms from the timeline's zero.
pub type Span = [f64; 2];

/// One frame's times, ms.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    pub threading: Threading,
    pub frame_ms: f64,
    pub game_ms: f64,
    pub record_ms: f64,
    pub submit_ms: f64,
    pub wait_ms: f64,
    pub latency_ms: f64,
    pub game: Span,
    pub record: Span,
    pub end: f64,
    /// The device's passes in order, the last one ending with the frame: the device's clock is not
    /// the host's, and how far apart they are is not asked for here (`bench --trace` does). Empty
    /// without timestamps.
    pub passes: Vec<(&'static str, Span)>,
}

#[derive(Debug, Clone, Default)]
pub struct Timeline {
    zero: Option<Instant>,
    frames: VecDeque<Frame>,
}

impl Timeline {
    pub fn push(&mut self, threading: Threading, times: &FrameTimes) {
        let zero = *self.zero.get_or_insert(times.marks.game[0]);
        let at = |t: Instant| t.saturating_duration_since(zero).as_secs_f64() * 1e3;
        let span = |[begin, end]: [Instant; 2]| [at(begin), at(end)];
        let end = at(times.marks.end);
        let last_ns = times.passes.last().map_or(0.0, |p| p.end_ns);
        let on_host = |ns: f64| end - (last_ns - ns) * 1e-6;
        if self.frames.len() == KEPT {
            self.frames.pop_front();
        }
        self.frames.push_back(Frame {
            threading,
            frame_ms: times.frame_ms,
            game_ms: times.game_ms,
            record_ms: times.record_ms,
            submit_ms: times.submit_ms,
            wait_ms: times.wait_ms,
            latency_ms: times.latency_ms,
            game: span(times.marks.game),
            record: span(times.marks.record),
            end,
            passes: times
                .passes
                .iter()
                .map(|p| (p.name, [on_host(p.begin_ns), on_host(p.end_ns)]))
                .collect(),
        });
    }

    /// Oldest first.
    pub fn frames(&self) -> impl ExactSizeIterator<Item = &Frame> + DoubleEndedIterator {
        self.frames.iter()
    }

    /// Of what `of` says of each frame; none without frames.
    pub fn summary(&self, of: impl Fn(&Frame) -> f64) -> Option<Summary> {
        Summary::of(&self.frames.iter().map(of).collect::<Vec<_>>())
    }

    /// Every pass that ran in one of the frames: its median over those that it ran in, ms, and in
    /// what share of all frames that was; in the order that they were first met in.
    pub fn passes(&self) -> Vec<(&'static str, f64, f64)> {
        let mut names: Vec<&'static str> = vec![];
        for (name, _) in self.frames.iter().flat_map(|f| &f.passes) {
            if !names.contains(name) {
                names.push(name);
            }
        }
        let of = |name: &'static str| {
            let passes = self.frames.iter().flat_map(|f| &f.passes).filter(|p| p.0 == name);
            let ms: Vec<f64> = passes.map(|(_, [begin, end])| end - begin).collect();
            let share = ms.len() as f64 / self.frames.len() as f64;
            (name, median(&ms).unwrap_or(0.0), share)
        };
        names.into_iter().map(of).collect()
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
    fn frames_lie_on_one_line_and_the_device_ends_with_them() {
        let zero = Instant::now();
        let mut line = Timeline::default();
        line.push(Threading::Serial, &times(zero, 0, &[("grid", 5e6, 6e6), ("tiles", 6e6, 9e6)]));
        line.push(Threading::Parallel, &times(zero, 1, &[("tiles", 100e6, 101e6)]));
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
            passes.iter().map(|p| (p.0, p.2)).collect::<Vec<_>>(),
            [("grid", 0.5), ("tiles", 1.0)]
        );
        assert!((passes[1].1 - 2.0).abs() < 1e-6);
    }

    #[test]
    fn old_frames_go() {
        let zero = Instant::now();
        let mut line = Timeline::default();
        assert!(line.summary(|f| f.frame_ms).is_none() && line.passes().is_empty());
        (0..KEPT as u32 + 5).for_each(|i| line.push(Threading::Serial, &times(zero, i, &[])));
        assert_eq!((line.frames().len(), line.frames().next().unwrap().frame_ms), (KEPT, 15.0));
    }
}
