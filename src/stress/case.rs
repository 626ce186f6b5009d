//! Stress cases, the comparisons that they make, and their outcomes.

use std::fmt::Display;
use std::time::Instant;

use glam::DVec3;
use serde::Serialize;

use super::context::StressContext;
use crate::error::Result;

/// A numerical stress test: one computation at the limits of the accepted input.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Name, `family/case`.
    pub name: &'static str,
    /// One-line description of the input.
    pub what: &'static str,
    /// The error bound in short; docs/explanation/stability.md derives it.
    pub bound: &'static str,
    /// Adds the device's values, with their reference values and bounds, to a comparison.
    pub check: fn(&mut StressContext, &mut Comparison) -> Result<()>,
}

impl Case {
    /// Returns the part of the name before the slash.
    pub fn family(&self) -> &'static str {
        self.name.split_once('/').map_or(self.name, |(family, _)| family)
    }

    /// Runs the case. An error of the run becomes the verdict [`Verdict::Broken`].
    pub fn run(&self, context: &mut StressContext) -> Outcome {
        let begin = Instant::now();
        let mut compared = Comparison::default();
        let verdict = match (self.check)(context, &mut compared) {
            Err(error) => {
                compared = Comparison { remark: Some(error.to_string()), ..Comparison::default() };
                Verdict::Broken
            }
            Ok(()) if compared.is_skipped => Verdict::NotHere,
            Ok(()) if compared.n > 0 && compared.n_beyond == 0 => Verdict::Passed,
            Ok(()) => Verdict::Failed,
        };
        Outcome {
            name: self.name.into(),
            what: self.what.into(),
            bound: self.bound.into(),
            verdict,
            n: compared.n,
            n_beyond: compared.n_beyond,
            worst: compared.worst,
            remark: compared.remark,
            seconds: begin.elapsed().as_secs_f64(),
        }
    }
}

/// Values computed by the device, compared with their reference values.
#[derive(Debug, Clone, Default)]
pub struct Comparison {
    n: usize,
    n_beyond: usize,
    worst: Option<Worst>,
    remark: Option<String>,
    is_skipped: bool,
}

/// The compared value whose error is the largest fraction of its bound.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worst {
    /// Which value it is.
    pub at: String,
    /// The device's value.
    pub value: f64,
    /// The reference value.
    pub truth: f64,
    /// |value − truth|; infinite if exactly one of them is NaN.
    pub error: f64,
    /// The largest error that the case allows.
    pub bound: f64,
}

impl Worst {
    /// Returns error / bound: at most 1 if the value is within its bound.
    pub fn share(&self) -> f64 {
        if self.error == 0.0 { 0.0 } else { self.error / self.bound }
    }
}

impl Comparison {
    /// Adds a value of the device; `at` names it.
    pub fn add(
        &mut self,
        value: impl Into<f64>,
        truth: impl Into<f64>,
        bound: f64,
        at: impl Display,
    ) {
        let (value, truth) = (value.into(), truth.into());
        // Equal infinities are equal, and NaN is right if the reference value is NaN.
        let is_same = value == truth || (value.is_nan() && truth.is_nan());
        let error = match (value - truth).abs() {
            _ if is_same => 0.0,
            error if error.is_nan() => f64::INFINITY,
            error => error,
        };
        self.n += 1;
        // An infinite error exceeds every bound, even an infinite one.
        let is_within = error <= bound && error.is_finite();
        self.n_beyond += usize::from(!is_within);
        let found = Worst { at: String::new(), value, truth, error, bound };
        // If every value is exact, the first one is reported.
        if self.worst.as_ref().is_none_or(|worst| found.share() > worst.share()) {
            self.worst = Some(Worst { at: at.to_string(), ..found });
        }
    }

    /// Adds a value that must equal its reference value.
    pub fn exact(&mut self, value: impl Into<f64>, truth: impl Into<f64>, at: impl Display) {
        self.add(value, truth, 0.0, at);
    }

    /// Adds a sequence of values; `bound` returns the bound of a reference value.
    pub fn each(
        &mut self,
        values: impl IntoIterator<Item: Into<f64>>,
        truths: impl IntoIterator<Item: Into<f64>>,
        bound: impl Fn(f64) -> f64,
        at: impl Display,
    ) {
        for (i, (value, truth)) in values.into_iter().zip(truths).enumerate() {
            let truth = truth.into();
            self.add(value, truth, bound(truth), format_args!("{at}, number {i}"));
        }
    }

    /// Adds the components of a vector.
    pub fn vector(&mut self, value: [f32; 3], truth: DVec3, bound: DVec3, at: impl Display) {
        for axis in 0..3 {
            self.add(value[axis], truth[axis], bound[axis], format_args!("{at}, axis {axis}"));
        }
    }

    /// Adds a condition as 1 (true) or 0 (false), compared with 1.
    pub fn holds(&mut self, is_true: bool, condition: impl Display) {
        self.exact(u8::from(is_true), 1.0, condition);
    }

    /// Adds the number of non-finite values, which must be 0.
    pub fn finite<'a>(&mut self, values: impl IntoIterator<Item = &'a f32>, at: impl Display) {
        let n = values.into_iter().filter(|v| !v.is_finite()).count();
        self.exact(n as f64, 0.0, format_args!("non-finite values, {at}"));
    }

    /// Adds the number of elements that differ, which must be 0.
    pub fn same<T: PartialEq>(&mut self, a: &[T], b: &[T], what: impl Display) {
        self.holds(a.len() == b.len(), format_args!("{what}: lengths {} and {}", a.len(), b.len()));
        let n_different = a.iter().zip(b).filter(|(a, b)| a != b).count();
        let n = a.len();
        self.exact(n_different as f64, 0.0, format_args!("{what}: number of {n} that differ"));
    }

    /// Sets a remark that is printed with the outcome.
    pub fn remark(&mut self, text: impl Into<String>) {
        self.remark = Some(text.into());
    }

    /// Marks the case as not applicable to this device, with the reason.
    pub fn skip(&mut self, reason: &str) {
        self.is_skipped = true;
        self.remark(reason);
    }
}

/// The result of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Every value is within its bound.
    Passed,
    /// A value exceeds its bound, or no value was compared.
    Failed,
    /// The case ended with an error.
    Broken,
    /// The device lacks a feature that the case needs.
    NotHere,
}

impl Verdict {
    /// Returns whether the device, or the case itself, is at fault.
    pub fn is_bad(self) -> bool {
        matches!(self, Verdict::Failed | Verdict::Broken)
    }
}

/// A case that was run, with its result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Name, `family/case`.
    pub name: String,
    /// One-line description of the input.
    pub what: String,
    /// The error bound in short.
    pub bound: String,
    /// The result.
    pub verdict: Verdict,
    /// Number of compared values.
    pub n: usize,
    /// Number of compared values that exceed their bounds.
    pub n_beyond: usize,
    /// The value whose error is the largest fraction of its bound.
    pub worst: Option<Worst>,
    /// A remark for the reader, or the message of the error that ended the case.
    pub remark: Option<String>,
    /// Duration of the case, s.
    pub seconds: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_value_with_the_largest_fraction_of_its_bound() {
        let mut c = Comparison::default();
        for (value, truth, bound) in [(1.0, 1.0, 0.0), (1.5, 1.0, 1.0), (9.0, 1.0, 100.0)] {
            c.add(value, truth, bound, value);
        }
        assert_eq!((c.n, c.n_beyond, c.worst.as_ref().unwrap().at.as_str()), (3, 0, "1.5"));
        c.add(2.0, 2.1, 0.05, "beyond");
        assert_eq!((c.n_beyond, c.worst.as_ref().unwrap().at.as_str()), (1, "beyond"));
    }

    #[test]
    fn counts_nan_and_infinite_errors_beyond_every_bound() {
        for (value, truth) in [
            (f64::NAN, 1.0),
            (1.0, f64::NAN),
            (f64::INFINITY, 1.0),
            (f64::INFINITY, f64::NEG_INFINITY),
        ] {
            let mut c = Comparison::default();
            c.add(value, truth, 1e300, "");
            c.add(value, truth, f64::INFINITY, "");
            assert_eq!(c.n_beyond, 2, "{value} {truth}");
        }
        let mut c = Comparison::default();
        c.exact(f64::NAN, f64::NAN, "");
        c.exact(f64::INFINITY, f64::INFINITY, "");
        assert_eq!(c.n_beyond, 0);
        c.add(1.0, 1.0, f64::NAN, "");
        assert_eq!(c.n_beyond, 1);
    }

    #[test]
    fn counts_the_elements_that_differ() {
        let mut c = Comparison::default();
        c.same(&[1, 2, 3], &[1, 2, 3], "same");
        assert_eq!(c.n_beyond, 0);
        c.same(&[1, 2, 3], &[1, 5, 4], "other");
        assert_eq!((c.n_beyond, c.worst.as_ref().unwrap().value), (1, 2.0));
        c.same(&[1], &[1, 2], "longer");
        assert_eq!(c.n_beyond, 2);
    }
}
