//! How long work takes: t = setup + d · steps + a · particles · steps + g · grid cells + b · pixels
//! · samples + c · facet pairs + e · textures (docs/model.md §17), fitted to what a class of
//! devices took, and how far off that is.

use std::ops::{Add, Mul};

use serde::{Deserialize, Serialize};

use super::nnls;
use crate::measure::stats::{median, percentile};

/// What of some work takes time, as counts; f64, since they go beyond 2⁵³ and are multiplied by
/// shares.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Work {
    /// Frames or samples: what each takes whatever is in it.
    #[serde(default)]
    pub steps: f64,
    /// Particles times the steps (frames, mostly) that each is moved, sorted and drawn in.
    pub particle_steps: f64,
    /// Cells of the density grid that particles leave mass in and that light's ways read, in all
    /// steps.
    #[serde(default)]
    pub cells: f64,
    /// Pixels times the samples taken in each: one for what lies behind, and one for every layer
    /// over it.
    pub pixel_samples: f64,
    /// Pairs of facets between which light is exchanged, each once and once more for every
    /// rectangle that may stand between.
    pub facet_pairs: f64,
    /// How often the textures of a scene are made: with each device that begins with it, each time
    /// that it begins anew.
    #[serde(default)]
    pub textures: f64,
}

impl Add for Work {
    type Output = Work;

    fn add(self, other: Work) -> Work {
        Work {
            steps: self.steps + other.steps,
            particle_steps: self.particle_steps + other.particle_steps,
            cells: self.cells + other.cells,
            pixel_samples: self.pixel_samples + other.pixel_samples,
            facet_pairs: self.facet_pairs + other.facet_pairs,
            textures: self.textures + other.textures,
        }
    }
}

impl Mul<f64> for Work {
    type Output = Work;

    fn mul(self, times: f64) -> Work {
        Work {
            steps: self.steps * times,
            particle_steps: self.particle_steps * times,
            cells: self.cells * times,
            pixel_samples: self.pixel_samples * times,
            facet_pairs: self.facet_pairs * times,
            textures: self.textures * times,
        }
    }
}

/// One run of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timed {
    /// How often it started: opened a device, compiled shaders, read a scene.
    pub setups: f64,
    pub work: Work,
    /// By the wall clock, all of it.
    pub seconds: f64,
}

/// The terms in the order of [`terms`], as messages name them.
const TERMS: [&str; 7] =
    ["setups", "steps", "particle steps", "grid cells", "pixel samples", "facet pairs", "textures"];

fn terms(setups: f64, work: &Work) -> [f64; TERMS.len()] {
    let Work { steps, particle_steps, cells, pixel_samples, facet_pairs, textures } = *work;
    [setups, steps, particle_steps, cells, pixel_samples, facet_pairs, textures]
}

/// Seconds that one of each takes on one class of devices. None where no run of the calibration had
/// any: nothing is known of it, and 0 would be a claim.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostModel {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setup_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub particle_step_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel_sample_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub facet_pair_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub texture_s: Option<f64>,
}

impl CostModel {
    /// Seconds that this work takes with so many set-ups. Err where it has something of which the
    /// calibration had nothing, or a number of it is not finite or below 0.
    pub fn seconds(&self, setups: f64, work: &Work) -> Result<f64, String> {
        let mut seconds = 0.0;
        for ((amount, name), each_s) in
            terms(setups, work).into_iter().zip(TERMS).zip(self.each_s())
        {
            if !is_amount(amount) {
                return Err(format!(
                    "the work has {amount} {name}, expected a finite number from 0"
                ));
            }
            match each_s {
                Some(each_s) => seconds += amount * each_s,
                None if amount == 0.0 => {}
                None => {
                    let calibrate = format!(
                        "expected a calibration run with some of them: {amount} are to be done"
                    );
                    return Err(format!("the cost of {name} was not measured, {calibrate}"));
                }
            }
        }
        Ok(seconds)
    }

    /// Of a model that was read from a file: every coefficient finite and not negative, and one of
    /// them there.
    pub fn check(&self) -> Result<(), String> {
        if self.each_s().iter().all(Option::is_none) {
            return Err("the cost model has no coefficient, expected one at least".into());
        }
        for (each_s, name) in self.each_s().into_iter().zip(TERMS) {
            if let Some(each_s) = each_s.filter(|each_s| !is_amount(*each_s)) {
                return Err(format!(
                    "the cost of {name} is {each_s} s, expected a finite number from 0"
                ));
            }
        }
        Ok(())
    }

    fn each_s(&self) -> [Option<f64>; TERMS.len()] {
        [
            self.setup_s,
            self.step_s,
            self.particle_step_s,
            self.cell_s,
            self.pixel_sample_s,
            self.facet_pair_s,
            self.texture_s,
        ]
    }

    fn of(each_s: [Option<f64>; TERMS.len()]) -> Self {
        let [setup_s, step_s, particle_step_s, cell_s, pixel_sample_s, facet_pair_s, texture_s] =
            each_s;
        CostModel {
            setup_s,
            step_s,
            particle_step_s,
            cell_s,
            pixel_sample_s,
            facet_pair_s,
            texture_s,
        }
    }
}

fn is_amount(value: f64) -> bool {
    value.is_finite() && value >= 0.0
}

/// A model, and how far it is off from the runs that it was made of. Errors are relative,
/// [`relative_error`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fit {
    pub model: CostModel,
    /// Runs.
    pub n: usize,
    pub median_relative_error: f64,
    pub largest_relative_error: f64,
    /// The median of each run's error by the model of all others, which says more of work not seen
    /// yet. None where no run can be left out.
    pub left_out_median: Option<f64>,
    /// Runs in that median. What only one run had, or too few for their terms, the others cannot
    /// predict.
    pub n_left_out: usize,
    /// Terms that the runs cannot tell from each other, since they grow together in all of them:
    /// the sum is right where they go on doing so, and the share of each is not known.
    pub not_told_apart: Vec<String>,
}

/// Coefficients from 0 on for which the sum of squared relative errors is least: every row is
/// divided by its seconds, because a second more matters to a run of ten and not to one of a
/// thousand. Terms that no row has are left out, not measured. Err where a row is not one that can
/// be (it says which and what was expected), there are fewer rows than terms, or no row has
/// anything.
pub fn fit(rows: &[Timed]) -> Result<Fit, String> {
    for (i, row) in rows.iter().enumerate() {
        check(row).map_err(|what| format!("run {} of the calibration: {what}", i + 1))?;
    }
    let model = least_squares(rows)?;
    let error = |model: &CostModel, row: &Timed| {
        let predicted = model.seconds(row.setups, &row.work)?;
        Ok(relative_error(predicted, row.seconds))
    };
    let errors = rows.iter().map(|row| error(&model, row)).collect::<Result<Vec<f64>, String>>()?;
    let left_out: Vec<f64> = (0..rows.len())
        .filter_map(|i| {
            let others = [&rows[..i], &rows[i + 1..]].concat();
            least_squares(&others).and_then(|model| error(&model, &rows[i])).ok()
        })
        .collect();
    let compared = Compared::of_errors(&errors).ok_or("no error of the calibration is finite")?;
    Ok(Fit {
        model,
        n: rows.len(),
        median_relative_error: compared.median,
        largest_relative_error: compared.largest,
        left_out_median: median(&left_out),
        n_left_out: left_out.len(),
        not_told_apart: not_told_apart(rows)?,
    })
}

fn check(row: &Timed) -> Result<(), String> {
    if !(row.seconds.is_finite() && row.seconds > 0.0) {
        return Err(format!("{} s, expected a finite time above 0", row.seconds));
    }
    match terms(row.setups, &row.work)
        .into_iter()
        .zip(TERMS)
        .find(|(amount, _)| !is_amount(*amount))
    {
        Some((amount, name)) => Err(format!("{amount} {name}, expected a finite number from 0")),
        None => Ok(()),
    }
}

fn least_squares(rows: &[Timed]) -> Result<CostModel, String> {
    let (occurring, columns) = weighted_columns(rows);
    if occurring.is_empty() || rows.len() < occurring.len() {
        let (n, some) =
            (rows.len(), occurring.iter().map(|term| TERMS[*term]).collect::<Vec<_>>().join(", "));
        return Err(match occurring.len() {
            0 => format!(
                "the calibration's {n} runs have nothing in them, expected some with \
                 work or set-ups"
            ),
            n_terms => format!(
                "a calibration of {n} runs, expected at least {n_terms}: one for each of {some}"
            ),
        });
    }
    let coefficients = nnls::solve(&columns, &vec![1.0; rows.len()])?;
    let mut each_s = [None; TERMS.len()];
    occurring
        .iter()
        .zip(coefficients)
        .for_each(|(term, coefficient)| each_s[*term] = Some(coefficient));
    Ok(CostModel::of(each_s))
}

/// Which terms occur at all, and for each the amounts in all rows, over their seconds.
fn weighted_columns(rows: &[Timed]) -> (Vec<usize>, Vec<Vec<f64>>) {
    let column = |term: usize| {
        rows.iter().map(|row| terms(row.setups, &row.work)[term] / row.seconds).collect()
    };
    let columns: Vec<(usize, Vec<f64>)> =
        (0..TERMS.len()).map(|term| (term, column(term))).collect();
    columns.into_iter().filter(|(_, column)| column.iter().any(|amount| *amount != 0.0)).unzip()
}

fn not_told_apart(rows: &[Timed]) -> Result<Vec<String>, String> {
    let (occurring, columns) = weighted_columns(rows);
    let apart = nnls::told_apart(&columns)?;
    let mixed = occurring.iter().zip(apart).filter(|(_, apart)| !apart);
    Ok(mixed.map(|(term, _)| TERMS[*term].to_owned()).collect())
}

/// |predicted − actual|/actual, where what actually was is above 0; NaN or infinite where it is 0.
pub fn relative_error(predicted: f64, actual: f64) -> f64 {
    (predicted - actual).abs() / actual
}

/// Relative errors of many predictions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Compared {
    /// Finite errors.
    pub n: usize,
    /// Errors left out because they are NaN or infinite.
    pub n_not_finite: usize,
    pub median: f64,
    pub p90: f64,
    pub largest: f64,
}

impl Compared {
    /// Of pairs (predicted, actual) in the same unit; None where no error is finite.
    pub fn of(pairs: &[(f64, f64)]) -> Option<Compared> {
        let errors = pairs.iter().map(|(predicted, actual)| relative_error(*predicted, *actual));
        Self::of_errors(&errors.collect::<Vec<_>>())
    }

    fn of_errors(errors: &[f64]) -> Option<Compared> {
        let n = errors.iter().filter(|error| error.is_finite()).count();
        Some(Compared {
            n,
            n_not_finite: errors.len() - n,
            median: median(errors)?,
            p90: percentile(errors, 0.9)?,
            largest: percentile(errors, 1.0)?,
        })
    }
}

#[cfg(test)]
mod tests;
