//! The front: the configurations that no other one beats in both time and error.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::measure::figure::Figure;
use crate::studies::picture_error::PictureError;

/// The error that decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
#[value(rename_all = "lower")]
pub enum Metric {
    /// Root mean square over premultiplied linear red, green, blue and alpha
    Rmse,
    /// Greatest difference at the compared pixels
    Max,
    /// Mean square relative to the reference's
    RelMse,
    /// Root mean square over the pixels that clouds cover, by their mean; against "transport"
    Cloud,
}

impl Metric {
    /// Returns the name in arguments and records.
    pub fn name(self) -> &'static str {
        match self {
            Metric::Rmse => "rmse",
            Metric::Max => "max",
            Metric::RelMse => "relmse",
            Metric::Cloud => "cloud",
        }
    }

    /// Returns this error of a picture, if it has one. "max" and "relmse" have no interval.
    pub fn of(self, error: &PictureError) -> Option<Figure> {
        match self {
            Metric::Rmse => Some(error.rmse),
            Metric::Max => Some(Figure::alone(error.max)),
            Metric::RelMse => Some(Figure::alone(error.relmse)),
            Metric::Cloud => error.cloud,
        }
    }
}

/// The place of a configuration among all.
///
/// One configuration is better than another if it takes no longer and errs no more, and is less in
/// one of the two, by the values without their intervals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Front {
    /// No configuration is better.
    On,
    /// Some are better, but none is faster beyond the intervals.
    Near,
    /// One is better, and faster beyond the intervals.
    Off,
    /// It has no time or no error.
    Unknown,
}

/// The time and the error of a configuration.
#[derive(Debug, Clone, Copy)]
pub struct Cost {
    /// Time divided by that of the unchanged scene, so that a drift cancels.
    pub time: Figure,
    /// Error.
    pub error: Figure,
}

impl Cost {
    fn is_better(&self, other: &Cost) -> bool {
        let (t, e) = (self.time.value, self.error.value);
        let (other_t, other_e) = (other.time.value, other.error.value);
        t <= other_t && e <= other_e && (t < other_t || e < other_e)
    }

    fn is_surely_faster(&self, other: &Cost) -> bool {
        let high = self.time.high.unwrap_or(self.time.value);
        high < other.time.low.unwrap_or(other.time.value)
    }
}

/// Returns the place of every configuration, given their costs.
///
/// Only times are compared by their intervals: the errors are those of one picture and the same in
/// every run.
pub fn places(costs: &[Option<Cost>]) -> Vec<Front> {
    let is_finite = |c: &Cost| c.time.value.is_finite() && c.error.value.is_finite();
    let costs: Vec<Option<Cost>> = costs.iter().map(|cost| cost.filter(is_finite)).collect();
    let place = |own: &Option<Cost>| {
        let Some(own) = own else { return Front::Unknown };
        let better = || costs.iter().flatten().filter(|other| other.is_better(own));
        if better().any(|other| other.is_surely_faster(own)) {
            Front::Off
        } else if better().next().is_some() {
            Front::Near
        } else {
            Front::On
        }
    };
    costs.iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost((value, spread): (f64, f64), error: f64) -> Option<Cost> {
        let time = Figure { value, low: Some(value - spread), high: Some(value + spread) };
        Some(Cost { time, error: Figure::alone(error) })
    }

    #[test]
    fn a_configuration_is_off_the_front_if_a_better_one_is_surely_faster() {
        use Front::{Near, Off, On};
        // 0.5 surely beats 0.8, but not 0.52.
        let all = [
            cost((1.0, 0.0), 0.1),
            cost((0.5, 0.05), 0.2),
            cost((0.8, 0.05), 0.3),
            cost((0.52, 0.05), 0.25),
        ];
        assert_eq!(places(&all), [On, On, Off, Near]);
        // A faster configuration with a greater error, by however little, beats no other.
        assert_eq!(places(&[cost((1.0, 0.0), 0.1), cost((0.5, 0.01), 0.1000001)]), [On, On]);
        // Equal ones do not beat each other; one without figures has no place.
        let all = [cost((1.0, 0.0), 0.1), cost((1.0, 0.1), 0.1), None];
        assert_eq!(places(&all), [On, On, Front::Unknown]);
    }
}
