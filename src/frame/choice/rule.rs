//! The rule by which one of several timed candidates is chosen.

/// Share by which one candidate must be faster than another: two runs of the same candidate differ
/// by as much.
const NOISE: f64 = 0.03;

/// Share of the turns, in each of which both were timed, that must agree: the speed of a shared
/// device varies.
const MOSTLY: f64 = 0.75;

/// Share of the time, by median and by minimum, below which a candidate is faster regardless of
/// single turns: the minimum is the time on an idle device.
const CLEARLY: f64 = 0.75;

/// Ratio of times beyond which a candidate is not timed again.
const FAR_APART: f64 = 4.0;

/// A candidate value of a knob.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The value, as scene files write it.
    pub value: String,
    /// It is the first candidate, which changes nothing.
    pub is_first: bool,
    /// Times of culling, sorting and drawing: device time in ms, or wall time without timestamps;
    /// empty if the candidate does not fit the device.
    pub times_ms: Vec<f64>,
    /// Root mean square difference from the exact picture over all pixels' premultiplied linear
    /// red, green, blue and alpha; `None` if the candidate was not drawn.
    pub rmse: Option<f64>,
}

impl Candidate {
    fn least_ms(&self) -> Option<f64> {
        self.times_ms.iter().copied().min_by(f64::total_cmp)
    }

    /// Returns the median of its times.
    pub fn ms(&self) -> Option<f64> {
        let mut times = self.times_ms.clone();
        times.sort_by(f64::total_cmp);
        times.get(times.len() / 2).copied()
    }
}

/// The choice of a knob that is "auto".
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Key in the scene file's `draw`.
    pub key: &'static str,
    /// Index of the chosen candidate.
    pub taken: usize,
    /// The candidates.
    pub candidates: Vec<Candidate>,
    /// The allowed error, if the knob changes the picture.
    pub error: Option<f64>,
}

impl Choice {
    /// Returns the choice as a sentence for users.
    pub fn text(&self) -> String {
        let of = |t: &Candidate| match (t.ms(), t.rmse) {
            (Some(ms), Some(0.0)) => format!("{} takes {ms:.2} ms (RMSE 0)", t.value),
            (Some(ms), Some(rmse)) => format!("{} takes {ms:.2} ms (RMSE {rmse:.2e})", t.value),
            _ => format!("{} does not fit this device", t.value),
        };
        let (key, value) = (self.key, &self.candidates[self.taken].value);
        let error = self.error.map_or(String::new(), |error| format!(" (draw.error {error:.2e})"));
        let all: Vec<String> = self.candidates.iter().map(of).collect();
        format!("draw.{key} = \"auto\" took {value}{error}: at the first frame {}", all.join(", "))
    }
}

/// Returns the index of the fastest allowed candidate: the first of those that are equally fast
/// within noise, or the first of all if none is allowed.
pub fn fastest(candidates: &[Candidate], allows: impl Fn(&Candidate) -> bool) -> usize {
    let mut allowed = (0..candidates.len()).filter(|i| allows(&candidates[*i]));
    let first = allowed.next().unwrap_or(0);
    allowed
        .fold(first, |best, i| if is_faster(&candidates[i], &candidates[best]) { i } else { best })
}

/// Returns whether `a` is faster than `b` by more than noise.
fn is_faster(a: &Candidate, b: &Candidate) -> bool {
    let is_less = |a: f64, b: f64, by: f64| a < by * b;
    let by_medians = |by: f64| a.ms().zip(b.ms()).is_some_and(|(a, b)| is_less(a, b, by));
    let by_least = |by: f64| a.least_ms().zip(b.least_ms()).is_some_and(|(a, b)| is_less(a, b, by));
    let turns = || a.times_ms.iter().zip(&b.times_ms);
    let n_faster = turns().filter(|(a, b)| is_less(**a, **b, 1.0 - NOISE)).count();
    let mostly = n_faster as f64 >= MOSTLY * turns().count() as f64;
    (by_medians(1.0 - NOISE) && mostly) || (by_medians(CLEARLY) && by_least(CLEARLY))
}

/// Returns the candidates of `open`, all of which were just timed, that may still be chosen.
pub fn still_open(
    candidates: &[Candidate],
    open: &[usize],
    allows: impl Fn(&Candidate) -> bool,
) -> Vec<usize> {
    let last = |i: usize| candidates[i].times_ms.last().copied().unwrap_or(f64::INFINITY);
    let allowed: Vec<usize> = open.iter().copied().filter(|i| allows(&candidates[*i])).collect();
    let fastest = allowed.iter().map(|i| last(*i)).fold(f64::INFINITY, f64::min);
    allowed.into_iter().filter(|i| last(*i) <= FAR_APART * fastest).collect()
}

/// Returns the root mean square difference; infinite if a number is NaN.
pub fn rmse(a: &[f32], b: &[f32]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    let rmse = (sum / a.len().max(1) as f64).sqrt();
    if rmse.is_nan() { f64::INFINITY } else { rmse }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns candidates by value, median time and error.
    fn candidates(of_all: &[(&str, f64, f64)]) -> Vec<Candidate> {
        let of = |(i, (value, ms, rmse)): (usize, &(&str, f64, f64))| Candidate {
            value: (*value).to_owned(),
            is_first: i == 0,
            times_ms: vec![1.1 * ms, *ms, 0.99 * ms],
            rmse: Some(*rmse),
        };
        of_all.iter().enumerate().map(of).collect()
    }

    fn near(error: f64) -> impl Fn(&Candidate) -> bool {
        move |t| t.rmse.is_some_and(|rmse| rmse <= error)
    }

    #[test]
    fn the_fastest_candidate_within_the_error_is_chosen() {
        let sizes =
            |half_ms| candidates(&[("1.0", 4.0, 0.0), ("0.5", half_ms, 1e-4), ("0.25", 0.5, 2e-3)]);
        assert_eq!(fastest(&sizes(1.0), near(1e-3)), 1);
        assert_eq!(fastest(&sizes(5.0), near(1e-3)), 0);
        assert_eq!(fastest(&sizes(1.0), near(1e-2)), 2);
        assert_eq!(fastest(&sizes(1.0), near(0.0)), 0);
        // No candidate is within the error if the exact picture has NaN.
        assert_eq!(
            fastest(
                &candidates(&[("1.0", 4.0, f64::INFINITY), ("0.5", 1.0, f64::INFINITY)]),
                near(0.5)
            ),
            0
        );
    }

    #[test]
    fn a_candidate_that_is_faster_by_noise_alone_is_not_chosen() {
        let two = |ms| candidates(&[("0", 100.0, 0.0), ("0.1", ms, 0.0)]);
        assert_eq!([97.5, 97.1, 96.9, 50.0].map(|ms| fastest(&two(ms), near(1.0))), [0, 0, 1, 1]);
        // Faster in two turns of three is not enough, unless clearly so.
        let mut twice = two(80.0);
        twice[0].times_ms = vec![100.0; 3];
        for (ms, i) in [(80.0, 0), (70.0, 1)] {
            twice[1].times_ms = vec![101.0, ms, ms];
            assert_eq!(fastest(&twice, near(1.0)), i, "{ms}");
        }
        // If the other is as fast in one turn, the rest was slowed by other work.
        (twice[0].times_ms[2], twice[1].times_ms) = (70.0, vec![101.0, 60.0, 60.0]);
        assert_eq!(fastest(&twice, near(1.0)), 0);
        // Of equally fast candidates, the one with the lower error is chosen.
        let three = candidates(&[("0", 100.0, 0.0), ("0.1", 51.0, 1e-5), ("0.2", 50.0, 1e-4)]);
        assert_eq!(fastest(&three, near(1.0)), 1);
    }

    #[test]
    fn a_candidate_that_does_not_fit_is_not_chosen() {
        let mut two = candidates(&[("a", 4.0, 0.0), ("b", 1.0, 0.0)]);
        (two[1].times_ms, two[1].rmse) = (vec![], None);
        assert_eq!(fastest(&two, near(1.0)), 0);
        let choice = Choice { key: "path", taken: 0, candidates: two, error: None };
        let text = "draw.path = \"auto\" took a: at the first frame a takes 4.00 ms (RMSE 0), b \
            does not fit this device";
        assert_eq!(choice.text(), text);
    }

    #[test]
    fn only_candidates_that_may_still_be_chosen_are_timed_again() {
        let open =
            |of: &[(&str, f64, f64)], error| still_open(&candidates(of), &[0, 1, 2], near(error));
        let far = [("1.0", 4.9, 0.0), ("0.5", 1.2, 1e-4), ("0.25", 0.2, 2e-3)];
        assert_eq!(open(&far, 1e-3), [1]);
        assert_eq!(open(&far, 1e-5), [0]);
        assert_eq!(
            open(&[("1.0", 4.4, 0.0), ("0.5", 1.2, 1e-4), ("0.25", 0.2, 2e-3)], 1e-3),
            [0, 1]
        );
    }

    #[test]
    fn the_text_lists_all_candidates() {
        let candidates = candidates(&[("0", 4.0, 0.0), ("0.001", 1.0, 1e-4)]);
        let choice = Choice { key: "threshold", taken: 1, candidates, error: Some(1e-3) };
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
