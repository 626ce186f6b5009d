//! The verdict on a ratio of B by A.

use serde::Serialize;

use crate::measure::bootstrap::Interval;

/// The margin of a comparison without another one. Runs of one program on a quiet machine differ by
/// about as much.
pub const MARGIN: f64 = 0.01;

/// The answer for one measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// B differs from A by no more than the margin: the whole interval lies within it.
    Same,
    /// B takes less time than A by more than the margin: the whole interval lies beyond it.
    Faster,
    /// B takes more time than A by more than the margin.
    Slower,
    /// B's value, which is no time, is less by more than the margin.
    Smaller,
    /// B's value, which is no time, is greater by more than the margin.
    Larger,
    /// An end of the interval lies within the margin, and the other does not.
    Undecided,
    /// A or B has fewer than [`super::N_FRAMES_NEEDED`] frames.
    TooFewFrames,
    /// A has no such value.
    NotMeasuredInA,
    /// B has no such value.
    NotMeasuredInB,
    /// A's value is 0, or is 0 in a resample, so that the ratio is not defined.
    NoRatio,
}

impl Verdict {
    /// Returns the verdict on a ratio whose 95 % interval is known.
    ///
    /// `margin` is the difference that does not matter: ratios from 1/(1 + margin) to 1 + margin
    /// are the same. If the true ratio is one of these two ends, the interval lies wholly on the
    /// wrong side of it in 2.5 % of runs, so that either verdict is wrong as rarely. A margin of 0
    /// asks whether there is any difference.
    pub fn of(ratio: Interval, margin: f64) -> Verdict {
        let (low, high) = (1.0 / (1.0 + margin), 1.0 + margin);
        if ratio.low >= low && ratio.high <= high {
            Verdict::Same
        } else if ratio.high < low {
            Verdict::Faster
        } else if ratio.low > high {
            Verdict::Slower
        } else {
            Verdict::Undecided
        }
    }

    /// Returns the verdict on values that are no times.
    pub fn of_sizes(self) -> Verdict {
        match self {
            Verdict::Faster => Verdict::Smaller,
            Verdict::Slower => Verdict::Larger,
            other => other,
        }
    }

    /// Returns the verdict in words, which complete "B is …".
    pub fn text(self) -> &'static str {
        match self {
            Verdict::Same => "the same",
            Verdict::Faster => "faster",
            Verdict::Slower => "slower",
            Verdict::Smaller => "smaller",
            Verdict::Larger => "larger",
            Verdict::Undecided => "undecided",
            Verdict::TooFewFrames => "too few frames",
            Verdict::NotMeasuredInA => "not measured in A",
            Verdict::NotMeasuredInB => "not measured in B",
            Verdict::NoRatio => "no ratio: A's value is 0, or may be",
        }
    }
}

/// The number of frames that is worth naming, as a multiple of those that were timed. A ratio that
/// needs more lies on the margin as far as anyone can tell.
const MOST_GROWTH: f64 = 100.0;

/// Returns how many more frames each of two runs needs for a verdict, if the ratio stays what it
/// is: the interval narrows with the root of the `n` frames that the shorter run has. None if the
/// ratio is too close to an end of the margin.
pub fn more_frames(ratio: Interval, n: usize, margin: f64) -> Option<u64> {
    let distance = (ratio.estimate.ln().abs() - margin.ln_1p()).abs();
    // The wider half decides where the interval is not symmetric.
    let half = (ratio.high / ratio.estimate).ln().max((ratio.estimate / ratio.low).ln());
    let growth = (half / distance).powi(2);
    let is_known = growth.is_finite() && growth <= MOST_GROWTH;
    is_known.then(|| ((n as f64) * (growth - 1.0)).ceil().max(1.0) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ratio(low: f64, high: f64) -> Interval {
        Interval { estimate: (low * high).sqrt(), low, high }
    }

    #[test]
    fn verdicts_follow_from_where_the_interval_lies() {
        for (low, high, margin, verdict) in [
            (0.995, 1.004, 0.01, Verdict::Same),
            (1.002, 1.008, 0.01, Verdict::Same),
            (1.002, 1.02, 0.01, Verdict::Undecided),
            (0.98, 1.02, 0.01, Verdict::Undecided),
            (1.011, 1.02, 0.01, Verdict::Slower),
            (0.97, 0.98, 0.01, Verdict::Faster),
            (0.985, 0.995, 0.01, Verdict::Undecided),
            // Half as long is as far as twice as long.
            (0.5, 0.5, 1.0, Verdict::Same),
            (1.001, 1.02, 0.0, Verdict::Slower),
            (0.999, 1.001, 0.0, Verdict::Undecided),
            (1.0, 1.0, 0.0, Verdict::Same),
        ] {
            assert_eq!(Verdict::of(ratio(low, high), margin), verdict, "{low} {high} {margin}");
        }
    }

    #[test]
    fn further_frames_narrow_the_interval_with_their_root() {
        // Half width 2 %, distance to the margin of 1 % from a ratio of 1: four times the frames.
        let wide = Interval { estimate: 1.0, low: (-0.02f64).exp(), high: 0.02f64.exp() };
        let more = more_frames(wide, 240, 0.01f64.exp_m1()).unwrap();
        assert!((719..=721).contains(&more), "{more}");
        // 1.03 with a half width of 4 %, 2 % beyond the margin.
        let slower =
            Interval { estimate: 0.03f64.exp(), low: (-0.01f64).exp(), high: 0.07f64.exp() };
        let more = more_frames(slower, 100, 0.01f64.exp_m1()).unwrap();
        assert!((299..=301).contains(&more), "{more}");
        let on_margin = Interval { estimate: 1.01, low: 1.0, high: 1.02 };
        assert_eq!(more_frames(on_margin, 100, 0.01), None);
    }
}
