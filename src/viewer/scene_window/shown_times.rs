//! Times at which the pictures of a window became visible.

use std::time::Instant;

use crate::gpu::Shown;
use crate::measure::stats::Summary;

/// A picture that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShownFrame {
    /// Time since the picture before it became visible, ms; `None` for the first of a loop.
    pub interval_ms: Option<f64>,
    /// Time from the start of its game step until it became visible, ms.
    pub to_screen_ms: f64,
}

/// The pictures of a window.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ShownTimes {
    /// The pictures that were seen, in order.
    pub frames: Vec<ShownFrame>,
    /// Pictures that a newer one replaced before they were seen.
    pub n_replaced: usize,
}

impl ShownTimes {
    /// Returns the statistics of the intervals, ms; `None` without any.
    pub fn intervals(&self) -> Option<Summary> {
        intervals(&self.frames)
    }

    /// Returns the statistics of the times to the screen, ms; `None` without any.
    pub fn to_screen(&self) -> Option<Summary> {
        to_screen(&self.frames)
    }
}

/// Returns the statistics of the intervals of frames, ms; `None` without any.
pub fn intervals<'a>(frames: impl IntoIterator<Item = &'a ShownFrame>) -> Option<Summary> {
    Summary::of(&frames.into_iter().filter_map(|f| f.interval_ms).collect::<Vec<_>>())
}

/// Returns the statistics of the times to the screen of frames, ms; `None` without any.
pub fn to_screen<'a>(frames: impl IntoIterator<Item = &'a ShownFrame>) -> Option<Summary> {
    Summary::of(&frames.into_iter().map(|f| f.to_screen_ms).collect::<Vec<_>>())
}

/// Turns the moments of a loop's pictures into times.
#[derive(Debug, Clone, Default)]
pub struct ShownClock {
    last: Option<Instant>,
}

impl ShownClock {
    /// Returns the times of the next picture; `None` if it was never seen.
    pub fn times(&mut self, shown: &Shown) -> Option<ShownFrame> {
        let seen = shown.seen?;
        let ms = |from: Instant| seen.saturating_duration_since(from).as_secs_f64() * 1e3;
        let interval_ms = self.last.replace(seen).map(ms);
        Some(ShownFrame { interval_ms, to_screen_ms: ms(shown.begun) })
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn intervals_go_from_one_seen_picture_to_the_next() {
        let zero = Instant::now();
        let at = |ms: u64| zero + Duration::from_millis(ms);
        let mut clock = ShownClock::default();
        let times = [
            Shown { begun: at(0), seen: Some(at(30)) },
            Shown { begun: at(10), seen: None },
            Shown { begun: at(20), seen: Some(at(62)) },
        ]
        .map(|shown| clock.times(&shown));
        let frame = |interval_ms, to_screen_ms| Some(ShownFrame { interval_ms, to_screen_ms });
        assert_eq!(times, [frame(None, 30.0), None, frame(Some(32.0), 42.0)]);
        let frames = times.into_iter().flatten().collect();
        let all = ShownTimes { frames, n_replaced: 1 };
        assert_eq!(all.intervals().map(|s| (s.n, s.p50)), Some((1, 32.0)));
        assert_eq!(all.to_screen().map(|s| (s.n, s.p50)), Some((2, 36.0)));
        assert!(ShownTimes::default().intervals().is_none());
    }
}
