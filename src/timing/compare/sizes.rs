//! Compares what is no time: the errors of pictures, and device memory.

use serde::Serialize;

use crate::measure::bootstrap::Interval;
use crate::measure::figure::Figure;
use crate::timing::records::{Case, Run};
use crate::timing::verdict::Verdict;

/// A value of one case that is no time, in A and B.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SizeComparison {
    /// Phase and sweep in words; empty if there is neither.
    pub name: String,
    /// Value in A.
    pub a: f64,
    /// Value in B.
    pub b: f64,
    /// B / A and its 95 % interval.
    pub b_by_a: Option<Interval>,
    /// The answer.
    pub verdict: Verdict,
}

/// Compares the RMSE of every case that both runs checked.
pub(super) fn errors(a: &Run, b: &Run, margin: f64) -> Vec<SizeComparison> {
    let rmse = |case: &Case| case.check.as_ref().and_then(|check| check.rmse);
    let of_case = |of_a: &Case| {
        let of_b = b.cases.iter().find(|case| case.name() == of_a.name())?;
        Some(compare(of_a.name(), rmse(of_a)?, rmse(of_b)?, margin))
    };
    a.cases.iter().filter_map(of_case).collect()
}

/// Compares the most device memory, in bytes, of every case whose state both runs have.
pub(super) fn memory(a: &Run, b: &Run, margin: f64) -> Vec<SizeComparison> {
    // What nimbus allocates is known on every device, and has no noise.
    let bytes = |case: &Case| {
        let bytes = case.state.as_ref()?.peak_own_bytes?;
        Some(Figure { value: bytes as f64, low: Some(bytes as f64), high: Some(bytes as f64) })
    };
    let of_case = |of_a: &Case| {
        let of_b = b.cases.iter().find(|case| case.name() == of_a.name())?;
        Some(compare(of_a.name(), bytes(of_a)?, bytes(of_b)?, margin))
    };
    a.cases.iter().filter_map(of_case).collect()
}

fn compare(name: String, a: Figure, b: Figure, margin: f64) -> SizeComparison {
    let b_by_a = ratio(a, b);
    let verdict = b_by_a.map_or(Verdict::NoRatio, |ratio| Verdict::of(ratio, margin).of_sizes());
    SizeComparison { name, a: a.value, b: b.value, b_by_a, verdict }
}

/// Returns b / a with an interval. Both errors are of the same pixels, so that equal values are
/// those of equal pictures. Other values are taken for independent, which can only widen the
/// interval: half its width in terms of the logarithm is the root of the sum of both squares.
fn ratio(a: Figure, b: Figure) -> Option<Interval> {
    if a.value == b.value {
        return Some(Interval { estimate: 1.0, low: 1.0, high: 1.0 });
    }
    let half = |of: Figure| {
        let (low, high) = of.low.zip(of.high).filter(|(low, _)| *low > 0.0)?;
        Some(0.5 * (high / low).ln())
    };
    let estimate = b.value / a.value;
    let factor = half(a)?.hypot(half(b)?).exp();
    (estimate > 0.0 && (estimate * factor).is_finite()).then(|| Interval {
        estimate,
        low: estimate / factor,
        high: estimate * factor,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_compared_by_their_ratio() {
        let figure =
            |value: f64, by: f64| Figure { value, low: Some(value / by), high: Some(value * by) };
        let of = |a, b| compare(String::new(), a, b, 0.01);
        let same = of(figure(1e-3, 1.5), figure(1e-3, 1.5));
        assert_eq!((same.verdict, same.b_by_a.unwrap().low), (Verdict::Same, 1.0));
        let larger = of(figure(1e-3, 1.1), figure(2e-3, 1.1));
        // √2 ln 1.1 = 0.1348: 2 times or by 1.1443.
        let ratio = larger.b_by_a.unwrap();
        assert!((ratio.high - 2.0 * 1.1443).abs() < 1e-3, "{ratio:?}");
        assert_eq!(larger.verdict, Verdict::Larger);
        assert_eq!(of(figure(2e-3, 1.1), figure(1e-3, 1.1)).verdict, Verdict::Smaller);
        assert_eq!(of(figure(1e-3, 2.0), figure(1.1e-3, 2.0)).verdict, Verdict::Undecided);
        assert_eq!(of(Figure::alone(0.0), figure(1e-3, 1.1)).verdict, Verdict::NoRatio);
        assert_eq!(of(Figure::alone(0.0), Figure::alone(0.0)).verdict, Verdict::Same);
    }
}
