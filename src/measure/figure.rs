//! A figure with its confidence interval.

use serde::{Deserialize, Serialize};

use crate::measure::bootstrap::Bootstrap;
use crate::measure::stats::median;

/// A figure with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// The figure.
    pub value: f64,
    /// Lower end of the interval; none if there were too few values for one.
    pub low: Option<f64>,
    /// Upper end of the interval.
    pub high: Option<f64>,
}

impl Figure {
    /// Returns a figure without an interval.
    pub fn alone(value: f64) -> Figure {
        Figure { value, low: None, high: None }
    }

    /// Returns the median of positive, independent values with its bootstrap interval; none for no
    /// value.
    pub fn median(values: &[f64]) -> Option<Figure> {
        let value = median(values)?;
        let interval = Bootstrap::default().median(values);
        // The widened interval of few values can reach below 0, which no median of them does.
        let (low, high) = interval.map(|i| (i.low.max(0.0), i.high)).unzip();
        Some(Figure { value, low, high })
    }

    /// Returns the figure with its value and interval multiplied by `factor`.
    pub fn times(self, factor: f64) -> Figure {
        let times = |v: f64| v * factor;
        Figure { value: times(self.value), low: self.low.map(times), high: self.high.map(times) }
    }
}
