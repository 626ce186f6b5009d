//! Axes: which values they show, where a value lies on them, and what their ticks say.

use std::ops::Range;

use super::number::number;

/// A named place on an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    pub at: f64,
    pub text: String,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub name: String,
    /// In its own measure: the value, or its decimal logarithm.
    pub range: Range<f64>,
    pub ticks: Vec<Tick>,
    is_log: bool,
    /// Where an axis of logarithms puts 0.
    zero: Option<f64>,
}

/// Beyond the outermost values, of what they span.
const MARGIN: f64 = 0.06;
/// Of an axis of logarithms, which one value would leave without a length, in decades.
const LEAST_MARGIN: f64 = 0.08;

impl Axis {
    /// Of the positive among `values`; `with_zero`: what is 0 is drawn too, below a gap. About
    /// `n_ticks` at most.
    pub fn log(
        name: &str,
        values: impl Iterator<Item = f64>,
        with_zero: bool,
        n_ticks: usize,
    ) -> Axis {
        let of_log = values.filter(|v| v.is_finite() && *v > 0.0).map(f64::log10);
        let (mut low, mut high) =
            of_log.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            (low, high) = (-1.0, 1.0);
        }
        let margin = (MARGIN * (high - low)).max(LEAST_MARGIN);
        let mut ticks: Vec<Tick> = log_ticks(low - margin..high + margin, n_ticks);
        let zero = with_zero.then_some(low - 3.0 * margin);
        if let Some(at) = zero {
            ticks.retain(|tick| tick.at > low - 1.5 * margin);
            ticks.insert(0, Tick { at, text: "0".to_owned() });
        }
        let begin = zero.map_or(low - margin, |at| at - margin);
        Axis { name: name.to_owned(), range: begin..high + margin, ticks, is_log: true, zero }
    }

    /// From `low` to `high`.
    pub fn linear(name: &str, low: f64, high: f64, n_ticks: usize) -> Axis {
        let high = if high > low { high } else { low + 1.0 };
        let named = |at: f64| Tick { at, text: number(at) };
        let ticks = linear_steps(low, high, n_ticks).into_iter().map(named).collect();
        Axis { name: name.to_owned(), range: low..high, ticks, is_log: false, zero: None }
    }

    /// A row for every name, the first on top.
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

    /// Where `value` lies; None of what has no place.
    pub fn at(&self, value: f64) -> Option<f64> {
        match (self.is_log, value) {
            (_, v) if !v.is_finite() => None,
            (false, v) => Some(v),
            (true, v) if v > 0.0 => Some(v.log10()),
            (true, v) => self.zero.filter(|_| v == 0.0),
        }
    }

    /// Whether an interval that ends at `value` ends within the axis.
    pub fn shows(&self, value: f64) -> bool {
        self.at(value).is_some_and(|at| at >= self.range.start && at <= self.range.end)
    }

    /// Where an interval's end lies: at the axis' end where it has no place on it.
    pub fn end_at(&self, value: f64) -> f64 {
        let beyond = if value > 0.0 { self.range.end } else { self.range.start };
        self.at(value).unwrap_or(beyond).clamp(self.range.start, self.range.end)
    }
}

/// The middle of row `i` of `n`, counted from above.
pub fn row_middle(i: usize, n: usize) -> f64 {
    (n - i) as f64 - 0.5
}

/// Ticks of an axis of logarithms: every unit of every decade, or fewer of them, or decades, or
/// every so many.
fn log_ticks(range: Range<f64>, n_most: usize) -> Vec<Tick> {
    let n_most = n_most.max(2);
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
    if values.len() < 3 && range.end - range.start < 1.5 {
        values = linear_steps(10f64.powf(range.start), 10f64.powf(range.end), n_most);
        values.retain(|v| *v > 0.0);
    }
    values.into_iter().map(|v| Tick { at: v.log10(), text: number(v) }).collect()
}

/// Multiples of 1, 2 or 5 times a power of ten within `low` and `high`, `n_most` at most.
fn linear_steps(low: f64, high: f64, n_most: usize) -> Vec<f64> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) {
        return vec![];
    }
    let decade = 10f64.powf((span / n_most.max(1) as f64).log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0, 20.0].map(|unit| unit * decade);
    let multiples = |step: f64| {
        // A hair of tolerance: 0.3 / 0.1 is below 3.
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
    fn ticks_are_round_and_few() {
        let of = |values: &[f64], n| Axis::log("x", values.iter().copied(), false, n);
        assert_eq!(texts(&of(&[1.0, 100.0], 9)), ["1", "2", "5", "10", "20", "50", "100"]);
        assert_eq!(texts(&of(&[1.0, 100.0], 4)), ["1", "10", "100"]);
        assert_eq!(texts(&of(&[1e-6, 1.0], 4)), ["10⁻⁶", "10⁻⁴", "0.01", "1"]);
        // Less than a decade.
        assert_eq!(texts(&of(&[10.5, 13.0], 6)), ["10", "12", "14"]);
    }

    #[test]
    fn values_that_have_no_log_have_no_place_but_zero() {
        let axis = Axis::log("x", [0.0, 1.0, f64::NAN, 10.0, f64::INFINITY].into_iter(), true, 8);
        assert_eq!(axis.at(10.0), Some(1.0));
        assert!(axis.at(0.0).is_some_and(|zero| zero < -0.1 && zero > axis.range.start));
        assert_eq!((axis.at(f64::NAN), axis.at(f64::INFINITY), axis.at(-1.0)), (None, None, None));
        assert_eq!(
            (axis.end_at(f64::INFINITY), axis.end_at(-3.0)),
            (axis.range.end, axis.range.start)
        );
        assert_eq!(
            (axis.shows(10.0), axis.shows(0.0), axis.shows(1e9), axis.shows(-3.0)),
            (true, true, false, false)
        );
        assert_eq!(texts(&axis)[0], "0");
        let without = Axis::log("x", std::iter::empty(), false, 8);
        assert_eq!((without.range.start < without.range.end, without.at(0.0)), (true, None));
    }
}
