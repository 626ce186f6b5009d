//! The cost model: the duration of work as a sum over its amounts, fitted to timed runs.
//!
//! t = setup + d · steps + a · particles · steps + g · grid cells + b · pixel samples
//! + c · facet pairs + e · textures (docs/explanation/farm.md).

use std::collections::BTreeMap;
use std::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::amounts::Amounts;
use super::least_squares;
use crate::measure::stats::{median, percentile};

/// The number of terms: the set-up, and one for each amount.
const N: usize = Amounts::N + 1;

/// Key of a coefficient in files, noun in messages, and label in tables.
const TERMS: [(&str, &str, &str); N] = [
    ("setup_s", "setups", "set-up"),
    ("step_s", "steps", "a step"),
    ("particle_step_s", "particle steps", "a particle and step"),
    ("cell_s", "grid cells", "a cell of the grid"),
    ("pixel_sample_s", "pixel samples", "a pixel and sample"),
    ("facet_pair_s", "facet pairs", "a pair of facets"),
    ("texture_s", "textures", "making textures"),
];

/// The duration of a run, measured by the wall clock, and what it did.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimedRun {
    /// Starts: opening a device, compiling shaders, reading a scene.
    pub setups: f64,
    /// The amounts of work.
    pub work: Amounts,
    /// The duration of all of it.
    pub seconds: f64,
}

impl TimedRun {
    fn check(&self) -> Result<(), String> {
        if !(self.seconds.is_finite() && self.seconds > 0.0) {
            return Err(format!("{} s, expected a finite time above 0", self.seconds));
        }
        let mut named = terms(self.setups, &self.work).into_iter().zip(TERMS);
        named.find(|(amount, _)| !is_amount(*amount)).map_or(Ok(()), |(amount, (_, noun, _))| {
            Err(format!("{amount} {noun}, expected a finite number from 0"))
        })
    }
}

/// Returns the factors of all coefficients, in the order of [`TERMS`].
fn terms(setups: f64, work: &Amounts) -> [f64; N] {
    let amounts = work.to_array();
    std::array::from_fn(|term| if term == 0 { setups } else { amounts[term - 1] })
}

fn is_amount(value: f64) -> bool {
    value.is_finite() && value >= 0.0
}

/// The seconds that one unit of each term takes on a class of devices. A term that no run of the
/// calibration had is unknown, which differs from 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CostModel([Option<f64>; N]);

impl Serialize for CostModel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let known = TERMS.iter().zip(self.0).filter_map(|((key, ..), each_s)| Some((key, each_s?)));
        serializer.collect_map(known)
    }
}

impl<'de> Deserialize<'de> for CostModel {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut model = CostModel::default();
        for (key, each_s) in BTreeMap::<String, f64>::deserialize(deserializer)? {
            let term = TERMS.iter().position(|(known, ..)| *known == key);
            let term = term.ok_or_else(|| D::Error::custom(format!("unknown field `{key}`")))?;
            model.0[term] = Some(each_s);
        }
        Ok(model)
    }
}

impl CostModel {
    /// Predicts the duration of some work with so many set-ups, s.
    ///
    /// # Errors
    /// When the work has an amount that was not measured, is not finite or is below 0.
    pub fn seconds(&self, setups: f64, work: &Amounts) -> Result<f64, String> {
        let mut seconds = 0.0;
        for ((amount, each_s), (_, noun, _)) in
            terms(setups, work).into_iter().zip(self.0).zip(TERMS)
        {
            if !is_amount(amount) {
                return Err(format!(
                    "the work has {amount} {noun}, expected a finite number from 0"
                ));
            }
            match each_s {
                Some(each_s) => seconds += amount * each_s,
                None if amount == 0.0 => {}
                None => {
                    return Err(format!(
                        "the cost of {noun} was not measured, expected a calibration run with \
                         some of them: the work has {amount}"
                    ));
                }
            }
        }
        Ok(seconds)
    }

    /// Checks a model that was read from a file.
    ///
    /// # Errors
    /// When it has no coefficient, or one that is not finite or below 0.
    pub fn check(&self) -> Result<(), String> {
        if self.0.iter().all(Option::is_none) {
            return Err("the cost model has no coefficient, expected one at least".into());
        }
        let mut named = self.0.into_iter().zip(TERMS);
        match named.find_map(|(each_s, term)| Some((each_s.filter(|s| !is_amount(*s))?, term))) {
            Some((each_s, (_, noun, _))) => {
                Err(format!("the cost of {noun} is {each_s} s, expected a finite number from 0"))
            }
            None => Ok(()),
        }
    }
}

/// A model and its errors, relative to the measured durations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fit {
    /// The fitted model.
    pub model: CostModel,
    /// The number of runs.
    pub n: usize,
    /// The median of the runs' errors.
    pub median_relative_error: f64,
    /// The greatest of them.
    pub largest_relative_error: f64,
    /// The median error of each run by the model of all others, which is nearer to the error for
    /// unseen work.
    pub left_out_median: Option<f64>,
    /// The number of runs in that median. Runs whose terms the others lack are not predicted.
    pub n_left_out: usize,
    /// Terms that grow together in all runs, so that only their sum is known.
    pub not_told_apart: Vec<String>,
}

/// A line for each coefficient and a line on errors.
impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (each_s, (_, _, label)) in self.model.0.iter().zip(TERMS) {
            let each = each_s.map_or("not measured".to_owned(), |s| format!("{s:.3e} s"));
            writeln!(f, "{label:>28}: {each}")?;
        }
        let [median, largest] =
            [self.median_relative_error, self.largest_relative_error].map(|share| 100.0 * share);
        write!(f, "off by {median:.0} % (median), {largest:.0} % at most")?;
        if let Some(error) = self.left_out_median {
            write!(f, "; of runs left out in turn {:.0} %", 100.0 * error)?;
        }
        writeln!(f)?;
        self.not_told_apart
            .iter()
            .try_for_each(|term| writeln!(f, "not distinguished from other terms: {term}"))
    }
}

/// Fits the coefficients, all from 0 on, for which the sum of squared relative errors is least.
///
/// Errors are relative since a second more matters to a run of ten and not to one of a thousand.
/// Terms that no run has stay unknown.
///
/// # Errors
/// When a run is impossible, no run has anything in it, or there are fewer runs than terms.
pub fn fit(runs: &[TimedRun]) -> Result<Fit, String> {
    for (i, run) in runs.iter().enumerate() {
        run.check().map_err(|what| format!("run {} of the calibration: {what}", i + 1))?;
    }
    let model = least_squares(runs)?;
    let error = |model: &CostModel, run: &TimedRun| {
        Ok::<f64, String>(relative_error(model.seconds(run.setups, &run.work)?, run.seconds))
    };
    let errors = runs.iter().map(|run| error(&model, run)).collect::<Result<Vec<f64>, _>>()?;
    let by_others = |i: usize| {
        let others = [&runs[..i], &runs[i + 1..]].concat();
        least_squares(&others).and_then(|model| error(&model, &runs[i])).ok()
    };
    let left_out: Vec<f64> = (0..runs.len()).filter_map(by_others).collect();
    let summary =
        ErrorSummary::of_errors(&errors).ok_or("no error of the calibration is finite")?;
    let (occurring, columns) = weighted_columns(runs);
    let independent = least_squares::independent(&columns)?;
    let mixed = occurring.iter().zip(independent).filter(|(_, is_independent)| !is_independent);
    Ok(Fit {
        model,
        n: runs.len(),
        median_relative_error: summary.median,
        largest_relative_error: summary.largest,
        left_out_median: median(&left_out),
        n_left_out: left_out.len(),
        not_told_apart: mixed.map(|(term, _)| TERMS[*term].1.to_owned()).collect(),
    })
}

fn least_squares(runs: &[TimedRun]) -> Result<CostModel, String> {
    let (occurring, columns) = weighted_columns(runs);
    let (n, n_terms) = (runs.len(), occurring.len());
    if n_terms == 0 {
        return Err(format!(
            "the calibration's {n} runs have nothing in them, expected some with work or set-ups"
        ));
    }
    if n < n_terms {
        let names = occurring.iter().map(|term| TERMS[*term].1).collect::<Vec<_>>().join(", ");
        return Err(format!(
            "a calibration of {n} runs, expected at least {n_terms}: one for each of {names}"
        ));
    }
    let coefficients = least_squares::solve(&columns, &vec![1.0; n])?;
    let mut model = CostModel::default();
    occurring.iter().zip(coefficients).for_each(|(term, each_s)| model.0[*term] = Some(each_s));
    Ok(model)
}

/// Returns the terms that occur, and for each its amounts in all runs divided by their seconds.
fn weighted_columns(runs: &[TimedRun]) -> (Vec<usize>, Vec<Vec<f64>>) {
    let amount = |term: usize, run: &TimedRun| terms(run.setups, &run.work)[term] / run.seconds;
    let column = |term| (term, runs.iter().map(|run| amount(term, run)).collect::<Vec<f64>>());
    let columns = (0..N).map(column);
    columns.filter(|(_, column)| column.iter().any(|amount| *amount != 0.0)).unzip()
}

/// Returns |predicted − actual|/actual.
fn relative_error(predicted: f64, actual: f64) -> f64 {
    (predicted - actual).abs() / actual
}

/// Relative errors of many predictions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorSummary {
    /// Finite errors.
    pub n: usize,
    /// Errors that are left out because they are NaN or infinite.
    pub n_not_finite: usize,
    /// The median of the finite errors.
    pub median: f64,
    /// Their 90th percentile.
    pub p90: f64,
    /// The greatest of them.
    pub largest: f64,
}

impl ErrorSummary {
    /// Summarises pairs (predicted, actual) of one unit; none where no error is finite.
    pub fn new(pairs: &[(f64, f64)]) -> Option<ErrorSummary> {
        let errors = pairs.iter().map(|(predicted, actual)| relative_error(*predicted, *actual));
        Self::of_errors(&errors.collect::<Vec<_>>())
    }

    fn of_errors(errors: &[f64]) -> Option<ErrorSummary> {
        let n = errors.iter().filter(|error| error.is_finite()).count();
        Some(ErrorSummary {
            n,
            n_not_finite: errors.len() - n,
            median: median(errors)?,
            p90: percentile(errors, 0.9)?,
            largest: percentile(errors, 1.0)?,
        })
    }
}

impl fmt::Display for ErrorSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [median, p90, largest] = [self.median, self.p90, self.largest].map(|e| 100.0 * e);
        write!(f, "off by {median:.0} % (median), {p90:.0} % (p90), {largest:.0} % at most")
    }
}

#[cfg(test)]
mod tests;
