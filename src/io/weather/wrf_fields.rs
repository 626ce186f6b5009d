//! One WRF variable at one step: of the shape, the unit and the range that it should be of.

use super::container::{Container, Variable};
use crate::model::weather::grid::Shape;

/// Beyond every number that weather has: NetCDF's own fill value is 9.969e36, WRF's and others' are
/// 1e20 and more.
const FILL: f64 = 1e19;

/// Along which of the cells' dimensions a variable runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    Columns,
    Cells,
    /// Their bottoms and tops.
    Levels,
}

impl Extent {
    pub fn lengths(self, shape: Shape) -> Vec<u64> {
        let plane = [shape.ny as u64, shape.nx as u64];
        let levels = match self {
            Extent::Columns => return plane.to_vec(),
            Extent::Cells => shape.nz,
            Extent::Levels => shape.nz + 1,
        };
        [&[levels as u64], &plane[..]].concat()
    }
}

/// A variable as it is to be read.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    pub name: &'static str,
    pub extent: Extent,
    /// Whether its first dimension is time; else every step has the same.
    pub has_time: bool,
    /// What turns its numbers into the unit that is expected.
    pub scale: f64,
    /// The file's own fill values.
    fills: Vec<f64>,
}

impl Field {
    /// Looks for the variable and at its shape and unit; None where it is not in the file.
    ///
    /// # Errors
    /// Which variable is of which shape or unit, and what was expected.
    pub fn find(
        file: &dyn Container,
        name: &'static str,
        extent: Extent,
        units: &[(&str, f64)],
        shape: Shape,
        n_steps: usize,
    ) -> Result<Option<Field>, String> {
        let Some(variable) = file.variable(name) else { return Ok(None) };
        let expected = extent.lengths(shape);
        let lengths: Vec<u64> = variable.dimensions.iter().map(|d| d.length).collect();
        let has_time = lengths.len() == expected.len() + 1;
        let is_fit = match lengths.split_first() {
            Some((first, rest)) if has_time => *first == n_steps as u64 && rest == expected,
            _ => lengths == expected,
        };
        if !is_fit {
            let expected: Vec<String> = expected.iter().map(u64::to_string).collect();
            return Err(format!(
                "variable {name}: it is {}, expected {n_steps} steps of {}",
                variable.shape_text(),
                expected.join(" x ")
            ));
        }
        let scale = scale(variable, units)?;
        let fills = ["_FillValue", "missing_value"]
            .iter()
            .filter_map(|name| variable.number(name))
            .collect();
        Ok(Some(Field { name, extent, has_time, scale, fills }))
    }

    /// The numbers of a step, in the unit that is expected, fill values among them as NaN.
    ///
    /// # Errors
    /// What cannot be read, with variable and step.
    pub fn read(
        &self,
        file: &dyn Container,
        shape: Shape,
        i_step: usize,
    ) -> Result<Vec<f64>, String> {
        let mut count = self.extent.lengths(shape);
        let mut start = vec![0; count.len()];
        if self.has_time {
            count.insert(0, 1);
            start.insert(0, i_step as u64);
        }
        let mut numbers =
            file.read(self.name, &start, &count).map_err(|what| self.at(i_step, what))?;
        for number in &mut numbers {
            let is_fill = number.abs() > FILL || self.fills.contains(number);
            *number = if is_fill { f64::NAN } else { *number * self.scale };
        }
        Ok(numbers)
    }

    /// The same of a variable that has no gaps: what has no value in it is no air.
    ///
    /// # Errors
    /// As [`read`](Self::read), and how many values are missing and where the first one is.
    pub fn read_whole(
        &self,
        file: &dyn Container,
        shape: Shape,
        i_step: usize,
    ) -> Result<Vec<f64>, String> {
        let numbers = self.read(file, shape, i_step)?;
        let Some(first) = numbers.iter().position(|n| n.is_nan()) else { return Ok(numbers) };
        let n_missing = numbers.iter().filter(|n| n.is_nan()).count();
        let place = place(shape, numbers.len(), first);
        Err(self.at(
            i_step,
            format!(
                "{n_missing} values are NaN or fill values, the first {place}; expected a \
                number everywhere"
            ),
        ))
    }

    /// What is wrong, with variable and step.
    pub fn at(&self, i_step: usize, what: impl std::fmt::Display) -> String {
        format!("variable {}, step {i_step}: {what}", self.name)
    }
}

/// "at level 3, row 2, column 1" of one of so many values; of one a column without the level.
pub fn place(shape: Shape, n_numbers: usize, i: usize) -> String {
    let n = shape.n_columns();
    let level = if n_numbers == n { String::new() } else { format!("level {}, ", i / n) };
    format!("at {level}row {}, column {}", i % n / shape.nx, i % shape.nx)
}

/// What turns a variable's unit into the first one of `units`; no unit is that one.
fn scale(variable: &Variable, units: &[(&str, f64)]) -> Result<f64, String> {
    let Some(unit) = variable.text("units").filter(|unit| !unit.is_empty()) else { return Ok(1.0) };
    match units.iter().find(|(name, _)| *name == unit) {
        Some((_, scale)) => Ok(*scale),
        None => {
            let shown: String = unit.chars().take(32).flat_map(char::escape_default).collect();
            let known: Vec<String> = units.iter().map(|(name, _)| format!("\"{name}\"")).collect();
            Err(format!(
                "variable {}: units \"{shown}\", expected {}",
                variable.name,
                known.join(" or ")
            ))
        }
    }
}
