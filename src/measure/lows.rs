//! "1 % low" frame rates. Three definitions have that name and differ on the same frames; all
//! three are computed.

use serde::{Deserialize, Serialize};

use super::stats::{mean, percentile_of_sorted, sorted_finite};

/// The share of frames that counts as the slowest is one in this many.
const N_FRAMES_PER_SLOW_ONE: usize = 100;
/// The share of the time, or of the frames by percentile, that counts as the slowest.
const SLOW_SHARE: f64 = 0.01;

/// Frame rates of the slowest frames, in frames per second.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lows {
    /// "p99": 1000 divided by the 99th percentile of the frame times (`Summary::p99`). It does not
    /// depend on how slow the frames beyond the percentile are.
    pub p99_fps: f64,
    /// "Mean of slowest 1 %": 1000 divided by the mean of the ⌈n/100⌉ longest frame times, which is
    /// the longest one up to n = 100.
    pub slowest_mean_fps: f64,
    /// "1 % of the time": the longest frames are added up until they make 1 % of the total time;
    /// the figure is 1000 divided by the last one added. Frames weigh by their length (CapFrameX's
    /// "1 % low integral").
    pub slowest_time_fps: f64,
}

impl Lows {
    /// Computes the rates from frame times in ms, in any order, without those that are not finite.
    /// None if none is left, or a frame took no time.
    pub fn of(frame_ms: &[f64]) -> Option<Lows> {
        let sorted = sorted_finite(frame_ms);
        if sorted.first().is_none_or(|shortest| *shortest <= 0.0) {
            return None;
        }
        let slowest = &sorted[sorted.len() - sorted.len().div_ceil(N_FRAMES_PER_SLOW_ONE)..];
        Some(Lows {
            p99_fps: fps(percentile_of_sorted(&sorted, 1.0 - SLOW_SHARE)),
            slowest_mean_fps: fps(mean(slowest)),
            slowest_time_fps: fps(reached_by_slowest(&sorted)?),
        })
    }
}

/// Returns the frame rate in frames per second at `ms` a frame.
pub fn fps(ms: f64) -> f64 {
    1000.0 / ms
}

/// Returns the frame time at which the slowest frames first make up their share of the total; None
/// for no frame.
fn reached_by_slowest(sorted: &[f64]) -> Option<f64> {
    let share = SLOW_SHARE * sorted.iter().sum::<f64>();
    let mut sum = 0.0;
    for &ms in sorted.iter().rev() {
        sum += ms;
        if sum >= share {
            return Some(ms);
        }
    }
    // Unreachable but for rounding: a hundredth of the sum is reached before its end.
    sorted.first().copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `n` frames of each length.
    fn frames(of: &[(usize, f64)]) -> Vec<f64> {
        of.iter().flat_map(|&(n, ms)| std::iter::repeat_n(ms, n)).collect()
    }

    fn assert_near(got: Lows, p99: f64, mean: f64, time: f64) {
        for (got, want) in
            [(got.p99_fps, p99), (got.slowest_mean_fps, mean), (got.slowest_time_fps, time)]
        {
            assert!((got - want).abs() < 1e-9 * want, "{got} for {want}");
        }
    }

    #[test]
    fn the_three_differ_on_frames_worked_by_hand() {
        // 300 frames: 297 of 10 ms, 2 of 20 ms, one of 100 ms; in all 2970 + 40 + 100 = 3110 ms.
        let values = frames(&[(297, 10.0), (1, 100.0), (2, 20.0)]);
        // p99 lies at position 299 · 0.99 = 296.01: between the last 10 and the first 20, 10.1 ms.
        // The 3 slowest have the mean (100 + 20 + 20)/3 = 140/3 ms. 1 % of the time is 31.1 ms,
        // within the one of 100.
        assert_near(Lows::of(&values).unwrap(), 1000.0 / 10.1, 3000.0 / 140.0, 10.0);
    }

    #[test]
    fn one_percent_of_the_time_goes_through_frames_until_it_is_full() {
        // 1000 frames: 990 of 9, 8 of 11, 2 of 16 ms: 8910 + 88 + 32 = 9030, 1 % is 90.3: 32 + 5·11
        // = 87, one more reaches it, at 11 ms. The ten slowest have the mean (32 + 88)/10 = 12. p99
        // at position 989.01: 9 + 0.01·2 = 9.02.
        let values = frames(&[(2, 16.0), (990, 9.0), (8, 11.0)]);
        assert_near(Lows::of(&values).unwrap(), 1000.0 / 9.02, 1000.0 / 12.0, 1000.0 / 11.0);
        // Exactly full counts: 100 alike, the slowest is 1 % of the time.
        assert_near(Lows::of(&[5.0; 100]).unwrap(), 200.0, 200.0, 200.0);
    }

    #[test]
    fn the_slowest_percent_is_rounded_up() {
        // 101 frames: the two slowest, (30 + 10)/2 = 20 ms; of 100 it is the one of 30 ms.
        assert!(
            (Lows::of(&frames(&[(100, 10.0), (1, 30.0)])).unwrap().slowest_mean_fps - 50.0).abs()
                < 1e-9
        );
        assert!(
            (Lows::of(&frames(&[(99, 10.0), (1, 30.0)])).unwrap().slowest_mean_fps - 1000.0 / 30.0)
                .abs()
                < 1e-9
        );
    }

    #[test]
    fn one_frame_is_all_three_and_none_is_none() {
        assert_near(Lows::of(&[4.0, f64::NAN]).unwrap(), 250.0, 250.0, 250.0);
        assert_eq!(Lows::of(&[]), None);
        assert_eq!(Lows::of(&[0.0, 1.0]), None);
        assert_eq!(Lows::of(&[f64::INFINITY]), None);
    }
}
