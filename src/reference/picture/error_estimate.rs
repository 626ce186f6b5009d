//! Error estimates of a reference's own values.

use std::ops::{Add, Mul};

/// Estimated error of a value in its greatest channel, by cause. *Units*: those of the value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ErrorEstimate {
    /// Error of integrals. It does not shrink when samples are averaged.
    pub quadrature: f64,
    /// One standard error of random paths. It shrinks when independent samples are averaged.
    pub chance: f64,
}

impl ErrorEstimate {
    /// Returns an estimate that is due to quadrature alone.
    pub fn from_quadrature(quadrature: f64) -> ErrorEstimate {
        ErrorEstimate { quadrature, chance: 0.0 }
    }

    /// Returns both parts together.
    pub fn total(self) -> f64 {
        self.quadrature + self.chance
    }

    /// Returns the root mean square of each part over several estimates.
    pub(super) fn root_mean_square(
        all: impl Iterator<Item = ErrorEstimate> + Clone,
    ) -> ErrorEstimate {
        ErrorEstimate {
            quadrature: root_mean_square(all.clone().map(|e| e.quadrature)),
            chance: root_mean_square(all.map(|e| e.chance)),
        }
    }
}

impl Add for ErrorEstimate {
    type Output = ErrorEstimate;

    fn add(self, other: ErrorEstimate) -> ErrorEstimate {
        ErrorEstimate {
            quadrature: self.quadrature + other.quadrature,
            chance: self.chance + other.chance,
        }
    }
}

impl Mul<f64> for ErrorEstimate {
    type Output = ErrorEstimate;

    fn mul(self, share: f64) -> ErrorEstimate {
        ErrorEstimate { quadrature: share * self.quadrature, chance: share * self.chance }
    }
}

/// Returns the root mean square of `values`, 0 if there are none.
pub(super) fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0u64, 0.0), |(n, sum), v| (n + 1, sum + v * v));
    if n == 0 { 0.0 } else { (sum / n as f64).sqrt() }
}
