//! Which of the values that were tried is taken, and how users are told.

/// What is not faster by more than this share is not faster: two runs of the same differ by as
/// much.
const NOISE: f64 = 0.03;

/// And so in this share of the turns, in each of which both were timed: a device that is shared is
/// now fast, now slow.
const MOSTLY: f64 = 0.75;

/// But what takes less than this share of the time, by the median and by the least, is faster
/// whatever single turns say: the least is what a device takes that is left alone.
const CLEARLY: f64 = 0.75;

/// Values whose times are so far apart need not be timed again.
const FAR_APART: f64 = 4.0;

/// A value of a knob.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// As scene files have it.
    pub value: String,
    /// The first changes nothing.
    pub is_first: bool,
    /// Of culling, sorting and drawing, ms of device time (of wall time without timestamps); none
    /// where it does not fit the device.
    pub times_ms: Vec<f64>,
    /// How far its picture is from the exact one, root mean square over all pixels of premultiplied
    /// linear red, green, blue and alpha; none where there is none.
    pub rmse: Option<f64>,
}

impl Tried {
    fn least_ms(&self) -> Option<f64> {
        self.times_ms.iter().copied().min_by(f64::total_cmp)
    }

    /// Median of its times.
    pub fn ms(&self) -> Option<f64> {
        let mut times = self.times_ms.clone();
        times.sort_by(f64::total_cmp);
        times.get(times.len() / 2).copied()
    }
}

/// What came of a knob that is "auto".
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    pub key: &'static str,
    /// Which of `tried`.
    pub taken: usize,
    pub tried: Vec<Tried>,
    /// What was near enough, where the picture changes.
    pub error: Option<f64>,
}

impl Choice {
    /// As users are told.
    pub fn text(&self) -> String {
        let of = |t: &Tried| match (t.ms(), t.rmse) {
            (Some(ms), Some(0.0)) => format!("{} takes {ms:.2} ms (RMSE 0)", t.value),
            (Some(ms), Some(rmse)) => format!("{} takes {ms:.2} ms (RMSE {rmse:.2e})", t.value),
            _ => format!("{} does not fit this device", t.value),
        };
        let (key, value) = (self.key, &self.tried[self.taken].value);
        let error = self.error.map_or(String::new(), |error| format!(" (draw.error {error:.2e})"));
        let all: Vec<String> = self.tried.iter().map(of).collect();
        format!("draw.{key} = \"auto\" took {value}{error}: at the first frame {}", all.join(", "))
    }
}

/// Of those that are allowed the fastest, and of those that are as fast, but for noise, the first;
/// the first of all where none is.
pub fn taken(tried: &[Tried], allows: impl Fn(&Tried) -> bool) -> usize {
    let mut allowed = (0..tried.len()).filter(|i| allows(&tried[*i]));
    let first = allowed.next().unwrap_or(0);
    allowed.fold(first, |best, i| if is_faster(&tried[i], &tried[best]) { i } else { best })
}

/// Whether `a` is faster than `b` by more than noise.
fn is_faster(a: &Tried, b: &Tried) -> bool {
    let is_less = |a: f64, b: f64, by: f64| a < by * b;
    let by_medians = |by: f64| a.ms().zip(b.ms()).is_some_and(|(a, b)| is_less(a, b, by));
    let by_least = |by: f64| a.least_ms().zip(b.least_ms()).is_some_and(|(a, b)| is_less(a, b, by));
    let turns = || a.times_ms.iter().zip(&b.times_ms);
    let n_faster = turns().filter(|(a, b)| is_less(**a, **b, 1.0 - NOISE)).count();
    let mostly = n_faster as f64 >= MOSTLY * turns().count() as f64;
    (by_medians(1.0 - NOISE) && mostly) || (by_medians(CLEARLY) && by_least(CLEARLY))
}

/// Those of `open`, all of which were timed last, that may still be taken.
pub fn still_open(tried: &[Tried], open: &[usize], allows: impl Fn(&Tried) -> bool) -> Vec<usize> {
    let last = |i: usize| tried[i].times_ms.last().copied().unwrap_or(f64::INFINITY);
    let allowed: Vec<usize> = open.iter().copied().filter(|i| allows(&tried[*i])).collect();
    let fastest = allowed.iter().map(|i| last(*i)).fold(f64::INFINITY, f64::min);
    allowed.into_iter().filter(|i| last(*i) <= FAR_APART * fastest).collect()
}

/// Infinite where a number is none.
pub fn rmse(a: &[f32], b: &[f32]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    let rmse = (sum / a.len().max(1) as f64).sqrt();
    if rmse.is_nan() { f64::INFINITY } else { rmse }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values with the medians of their times, and their errors.
    fn tried(of_all: &[(&str, f64, f64)]) -> Vec<Tried> {
        let of = |(i, (value, ms, rmse)): (usize, &(&str, f64, f64))| Tried {
            value: (*value).to_owned(),
            is_first: i == 0,
            times_ms: vec![1.1 * ms, *ms, 0.99 * ms],
            rmse: Some(*rmse),
        };
        of_all.iter().enumerate().map(of).collect()
    }

    fn near(error: f64) -> impl Fn(&Tried) -> bool {
        move |t| t.rmse.is_some_and(|rmse| rmse <= error)
    }

    #[test]
    fn the_fastest_that_is_near_enough_is_taken() {
        let sizes =
            |half_ms| tried(&[("1.0", 4.0, 0.0), ("0.5", half_ms, 1e-4), ("0.25", 0.5, 2e-3)]);
        assert_eq!(taken(&sizes(1.0), near(1e-3)), 1);
        assert_eq!(taken(&sizes(5.0), near(1e-3)), 0);
        assert_eq!(taken(&sizes(1.0), near(1e-2)), 2);
        assert_eq!(taken(&sizes(1.0), near(0.0)), 0);
        // Nor where nothing is, as where the exact picture holds what is no number.
        assert_eq!(
            taken(&tried(&[("1.0", 4.0, f64::INFINITY), ("0.5", 1.0, f64::INFINITY)]), near(0.5)),
            0
        );
    }

    #[test]
    fn what_is_faster_by_noise_alone_is_not_taken() {
        let two = |ms| tried(&[("0", 100.0, 0.0), ("0.1", ms, 0.0)]);
        assert_eq!([97.5, 97.1, 96.9, 50.0].map(|ms| taken(&two(ms), near(1.0))), [0, 0, 1, 1]);
        // Nor what was faster in two turns of three, but for clearly.
        let mut twice = two(80.0);
        twice[0].times_ms = vec![100.0; 3];
        for (ms, i) in [(80.0, 0), (70.0, 1)] {
            twice[1].times_ms = vec![101.0, ms, ms];
            assert_eq!(taken(&twice, near(1.0)), i, "{ms}");
        }
        // Where the other is as fast in one turn it is a neighbour that slowed it down.
        (twice[0].times_ms[2], twice[1].times_ms) = (70.0, vec![101.0, 60.0, 60.0]);
        assert_eq!(taken(&twice, near(1.0)), 0);
        // Nor the one that errs more where one that errs less is as fast.
        let three = tried(&[("0", 100.0, 0.0), ("0.1", 51.0, 1e-5), ("0.2", 50.0, 1e-4)]);
        assert_eq!(taken(&three, near(1.0)), 1);
    }

    #[test]
    fn what_does_not_fit_is_not_taken() {
        let mut two = tried(&[("a", 4.0, 0.0), ("b", 1.0, 0.0)]);
        (two[1].times_ms, two[1].rmse) = (vec![], None);
        assert_eq!(taken(&two, near(1.0)), 0);
        let choice = Choice { key: "path", taken: 0, tried: two, error: None };
        let text = "draw.path = \"auto\" took a: at the first frame a takes 4.00 ms (RMSE 0), b \
            does not fit this device";
        assert_eq!(choice.text(), text);
    }

    #[test]
    fn only_what_may_still_be_taken_is_timed_again() {
        let open = |of: &[(&str, f64, f64)], error| still_open(&tried(of), &[0, 1, 2], near(error));
        let far = [("1.0", 4.9, 0.0), ("0.5", 1.2, 1e-4), ("0.25", 0.2, 2e-3)];
        assert_eq!(open(&far, 1e-3), [1]);
        assert_eq!(open(&far, 1e-5), [0]);
        assert_eq!(
            open(&[("1.0", 4.4, 0.0), ("0.5", 1.2, 1e-4), ("0.25", 0.2, 2e-3)], 1e-3),
            [0, 1]
        );
    }

    #[test]
    fn all_that_was_tried_is_told() {
        let tried = tried(&[("0", 4.0, 0.0), ("0.001", 1.0, 1e-4)]);
        let choice = Choice { key: "threshold", taken: 1, tried, error: Some(1e-3) };
        let text = "draw.threshold = \"auto\" took 0.001 (draw.error 1.00e-3): at the first frame \
            0 takes 4.00 ms (RMSE 0), \
                    0.001 takes 1.00 ms (RMSE 1.00e-4)";
        assert_eq!(choice.text(), text);
    }

    #[test]
    fn rmse_by_hand() {
        // Half of two numbers is off by 0.2: sqrt(0.04/2).
        assert!((rmse(&[1.0, 0.2], &[1.0, 0.0]) - 0.02f64.sqrt()).abs() < 1e-8);
        assert_eq!(rmse(&[f32::NAN], &[0.0]), f64::INFINITY);
    }
}
