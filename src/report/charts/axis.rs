//! Linear and logarithmic axes with their ticks.

use std::ops::Range;

use super::number::number;
use crate::measure::stats::extremes;

/// A labelled position on an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// Position on the axis.
    pub at: f64,
    /// Label.
    pub text: String,
}

/// An axis. Positions on it are values, or decimal logarithms of values.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Label of the axis.
    pub name: String,
    /// First and last position.
    pub range: Range<f64>,
    /// Labelled positions.
    pub ticks: Vec<Tick>,
    is_log: bool,
    /// Position of the value 0 on a logarithmic axis.
    zero: Option<f64>,
}

/// Margin beyond the outermost values, as a share of their span: a marker is about as wide.
pub const MARGIN: f64 = 0.06;
/// Smallest margin of a logarithmic axis, in decades: a single value spans nothing, and its axis
/// then covers a factor of about 1.4.
const MIN_MARGIN: f64 = 0.08;

impl Axis {
    /// Returns a logarithmic axis for the positive numbers among `values`, with about `n_ticks`
    /// ticks at most. With `with_zero`, the value 0 has a position below a gap.
    pub fn log(
        name: &str,
        values: impl Iterator<Item = f64>,
        with_zero: bool,
        n_ticks: usize,
    ) -> Axis {
        let of_log = values.filter(|v| v.is_finite() && *v > 0.0).map(f64::log10);
        let (low, high) = extremes(of_log).unwrap_or((-1.0, 1.0));
        let margin = (MARGIN * (high - low)).max(MIN_MARGIN);
        let mut ticks: Vec<Tick> = log_ticks(low - margin..high + margin, n_ticks);
        let zero = with_zero.then_some(low - 3.0 * margin);
        if let Some(at) = zero {
            ticks.retain(|tick| tick.at > low - 1.5 * margin);
            ticks.insert(0, Tick { at, text: "0".to_owned() });
        }
        let begin = zero.map_or(low - margin, |at| at - margin);
        Axis { name: name.to_owned(), range: begin..high + margin, ticks, is_log: true, zero }
    }

    /// Returns a linear axis from `low` to `high`.
    pub fn linear(name: &str, low: f64, high: f64, n_ticks: usize) -> Axis {
        let high = if high > low { high } else { low + 1.0 };
        let named = |at: f64| Tick { at, text: number(at) };
        let ticks = linear_steps(low, high, n_ticks).into_iter().map(named).collect();
        Axis { name: name.to_owned(), range: low..high, ticks, is_log: false, zero: None }
    }

    /// Returns an axis with a row for every name, the first on top.
    pub fn rows(names: &[String]) -> Axis {
        let n = names.len();
        let ticks = names
            .iter()
            .enumerate()
            .map(|(i, name)| Tick { at: row_middle(i, n), text: name.clone() });
        Axis {
            name: String::new(),
            range: 0.0..n.max(1) as f64,
            ticks: ticks.collect(),
            is_log: false,
            zero: None,
        }
    }

    /// Returns the position of a value, if it has one.
    pub fn position(&self, value: f64) -> Option<f64> {
        match (self.is_log, value) {
            (_, v) if !v.is_finite() => None,
            (false, v) => Some(v),
            (true, v) if v > 0.0 => Some(v.log10()),
            (true, v) => self.zero.filter(|_| v == 0.0),
        }
    }

    /// Returns whether the axis contains a value.
    pub fn contains(&self, value: f64) -> bool {
        self.position(value).is_some_and(|at| at >= self.range.start && at <= self.range.end)
    }

    /// Returns the position of an interval's end, clamped to the axis.
    pub fn clamped(&self, value: f64) -> f64 {
        let beyond = if value > 0.0 { self.range.end } else { self.range.start };
        self.position(value).unwrap_or(beyond).clamp(self.range.start, self.range.end)
    }
}

/// Returns the position of the middle of row `i` of `n`, counted from the top.
pub fn row_middle(i: usize, n: usize) -> f64 {
    (n - i) as f64 - 0.5
}

/// Returns at most `n_most` ticks of a logarithmic axis, or two if `n_most` is less. Each decade
/// has as many as fit. On a long axis only every second, third, … decade has one.
fn log_ticks(range: Range<f64>, n_most: usize) -> Vec<Tick> {
    let n_most = n_most.max(2);
    /// Multiples of a power of ten that get a tick, the densest choice first.
    const UNITS: [&[f64]; 4] =
        [&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
    let decades = range.start.floor() as i32..=range.end.floor() as i32;
    let of = |units: &[f64], step: i32| -> Vec<f64> {
        let decades = decades.clone().filter(|d| d.rem_euclid(step) == 0);
        let all = decades.flat_map(|d| units.iter().map(move |unit| unit * 10f64.powi(d)));
        all.filter(|v| range.contains(&v.log10())).collect()
    };
    let finest = UNITS.iter().map(|units| of(units, 1)).find(|values| values.len() <= n_most);
    let coarser = || (2..).map(|step| of(UNITS[3], step)).find(|values| values.len() <= n_most);
    let mut values = finest.or_else(coarser).unwrap_or_default();
    // A short axis may contain hardly any of these multiples; evenly spaced ticks fill it.
    if values.len() < 3 && range.end - range.start < 1.5 {
        values = linear_steps(10f64.powf(range.start), 10f64.powf(range.end), n_most);
        values.retain(|v| *v > 0.0);
    }
    values.into_iter().map(|v| Tick { at: v.log10(), text: number(v) }).collect()
}

/// Returns the multiples of 1, 2 or 5 times a power of ten from `low` to `high`, at most `n_most`.
fn linear_steps(low: f64, high: f64, n_most: usize) -> Vec<f64> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) {
        return vec![];
    }
    let decade = 10f64.powf((span / n_most.max(1) as f64).log10().floor());
    if !decade.is_normal() {
        return vec![];
    }
    let steps = [1.0, 2.0, 5.0, 10.0, 20.0].map(|unit| unit * decade);
    let multiples = |step: f64| {
        // With a tolerance, because 0.3 / 0.1 is below 3 in f64.
        let (first, last) =
            ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
        (first..=last).map(|i| i as f64 * step).collect::<Vec<f64>>()
    };
    steps
        .into_iter()
        .map(multiples)
        .find(|values| values.len() <= n_most.max(2))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().map(|t| t.text.as_str()).collect()
    }

    #[test]
    fn ticks_are_round_numbers_within_the_limit() {
        let of = |values: &[f64], n| Axis::log("x", values.iter().copied(), false, n);
        assert_eq!(texts(&of(&[1.0, 100.0], 9)), ["1", "2", "5", "10", "20", "50", "100"]);
        assert_eq!(texts(&of(&[1.0, 100.0], 4)), ["1", "10", "100"]);
        assert_eq!(texts(&of(&[1e-6, 1.0], 4)), ["10⁻⁶", "10⁻⁴", "0.01", "1"]);
        // Less than a decade.
        assert_eq!(texts(&of(&[10.5, 13.0], 6)), ["10", "12", "14"]);
    }

    #[test]
    fn only_positive_values_and_zero_have_a_position() {
        let axis = Axis::log("x", [0.0, 1.0, f64::NAN, 10.0, f64::INFINITY].into_iter(), true, 8);
        assert_eq!(axis.position(10.0), Some(1.0));
        assert!(axis.position(0.0).is_some_and(|zero| zero < -0.1 && zero > axis.range.start));
        assert_eq!(
            (axis.position(f64::NAN), axis.position(f64::INFINITY), axis.position(-1.0)),
            (None, None, None)
        );
        assert_eq!(
            (axis.clamped(f64::INFINITY), axis.clamped(-3.0)),
            (axis.range.end, axis.range.start)
        );
        assert_eq!(
            (axis.contains(10.0), axis.contains(0.0), axis.contains(1e9), axis.contains(-3.0)),
            (true, true, false, false)
        );
        assert_eq!(texts(&axis)[0], "0");
        let without = Axis::log("x", std::iter::empty(), false, 8);
        assert_eq!((without.range.start < without.range.end, without.position(0.0)), (true, None));
    }
}
