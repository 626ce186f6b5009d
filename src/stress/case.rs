//! A case of the suite, and what it finds.

use serde::Serialize;

use super::desk::Desk;
use crate::error::Result;

/// One thing that may go wrong at the edge of what can be asked for.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// "family/name".
    pub name: &'static str,
    /// What is tried, in a line.
    pub what: &'static str,
    /// What is allowed, in short; docs/stability.md derives it.
    pub bound: &'static str,
    pub run: fn(&mut Desk) -> Result<Found>,
}

impl Case {
    /// What stands before the slash.
    pub fn family(&self) -> &'static str {
        self.name.split_once('/').map_or(self.name, |(family, _)| family)
    }
}

/// What a case found.
#[derive(Debug, Clone)]
pub enum Found {
    Compared(Comparison),
    /// The device does not have what the case needs.
    NotHere(String),
}

/// Numbers of the device beside what they should be.
#[derive(Debug, Clone, Default)]
pub struct Comparison {
    pub n: usize,
    /// Of those, how many are further off than they may be.
    pub n_beyond: usize,
    /// The one that is the furthest off by its bound.
    pub worst: Option<Worst>,
    /// What else is to be told, such as how many were clamped.
    pub remark: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worst {
    /// Which.
    pub at: String,
    pub value: f64,
    pub truth: f64,
    /// |value - truth|; infinite where one is no number and the other is.
    pub error: f64,
    pub bound: f64,
}

impl Worst {
    /// error / bound: at most 1 where all is well.
    pub fn share(&self) -> f64 {
        if self.error == 0.0 { 0.0 } else { self.error / self.bound }
    }
}

impl Comparison {
    /// Adds a number of the device.
    pub fn add(&mut self, value: f64, truth: f64, bound: f64, at: impl FnOnce() -> String) {
        // Equal infinities are equal, and where no number is what should come out, none is right.
        let is_same = value == truth || (value.is_nan() && truth.is_nan());
        let error = match (value - truth).abs() {
            _ if is_same => 0.0,
            error if error.is_nan() => f64::INFINITY,
            error => error,
        };
        self.n += 1;
        // What is no number is beyond any bound, an infinite one among them.
        let is_within = error <= bound && error.is_finite();
        self.n_beyond += usize::from(!is_within);
        let share = if error == 0.0 { 0.0 } else { error / bound };
        // The first one stands for all that are exact.
        if self.worst.as_ref().is_none_or(|worst| share > worst.share()) {
            self.worst = Some(Worst { at: at(), value, truth, error, bound });
        }
    }

    /// Adds what must be so: 1 where it is and 0 where it is not, against 1.
    pub fn holds(&mut self, is_so: bool, what: impl FnOnce() -> String) {
        self.add(f64::from(u8::from(is_so)), 1.0, 0.0, what);
    }

    /// Adds what must be the same to the bit.
    pub fn same<T: PartialEq>(&mut self, a: &[T], b: &[T], what: &str) {
        self.holds(a.len() == b.len(), || format!("{what}: {} and {} of them", a.len(), b.len()));
        let n_other = a.iter().zip(b).filter(|(a, b)| a != b).count();
        self.add(n_other as f64, 0.0, 0.0, || format!("{what}: how many of {} differ", a.len()));
    }

    pub fn remark(mut self, text: impl Into<String>) -> Comparison {
        self.remark = Some(text.into());
        self
    }
}

impl From<Comparison> for Found {
    fn from(comparison: Comparison) -> Found {
        Found::Compared(comparison)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    Passed,
    /// Something is further off than its bound, or nothing was compared.
    Failed,
    /// It could not be run to its end.
    Broken,
    /// The device does not have what it needs.
    NotHere,
}

/// A case and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    pub name: String,
    pub what: String,
    /// The bound in words.
    pub bound: String,
    pub verdict: Verdict,
    /// Numbers compared, and how many of them are out of their bounds.
    pub n: usize,
    pub n_beyond: usize,
    pub worst: Option<Worst>,
    pub remark: Option<String>,
    pub seconds: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_is_the_furthest_off_by_its_bound() {
        let mut c = Comparison::default();
        for (value, truth, bound) in [(1.0, 1.0, 0.0), (1.5, 1.0, 1.0), (9.0, 1.0, 100.0)] {
            c.add(value, truth, bound, || value.to_string());
        }
        assert_eq!((c.n, c.n_beyond, c.worst.as_ref().unwrap().at.as_str()), (3, 0, "1.5"));
        c.add(2.0, 2.1, 0.05, || "beyond".into());
        assert_eq!((c.n_beyond, c.worst.as_ref().unwrap().at.as_str()), (1, "beyond"));
    }

    #[test]
    fn what_is_no_number_is_beyond_every_bound() {
        for (value, truth) in [
            (f64::NAN, 1.0),
            (1.0, f64::NAN),
            (f64::INFINITY, 1.0),
            (f64::INFINITY, f64::NEG_INFINITY),
        ] {
            let mut c = Comparison::default();
            c.add(value, truth, 1e300, String::new);
            c.add(value, truth, f64::INFINITY, String::new);
            assert_eq!(c.n_beyond, 2, "{value} {truth}");
        }
        let mut c = Comparison::default();
        c.add(f64::NAN, f64::NAN, 0.0, String::new);
        c.add(f64::INFINITY, f64::INFINITY, 0.0, String::new);
        assert_eq!(c.n_beyond, 0);
        c.add(1.0, 1.0, f64::NAN, String::new);
        assert_eq!(c.n_beyond, 1);
    }

    #[test]
    fn sameness_counts_what_differs() {
        let mut c = Comparison::default();
        c.same(&[1, 2, 3], &[1, 2, 3], "same");
        assert_eq!(c.n_beyond, 0);
        c.same(&[1, 2, 3], &[1, 5, 4], "other");
        assert_eq!((c.n_beyond, c.worst.as_ref().unwrap().value), (1, 2.0));
        c.same(&[1], &[1, 2], "longer");
        assert_eq!(c.n_beyond, 2);
    }
}
