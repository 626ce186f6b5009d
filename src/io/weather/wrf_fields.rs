//! One WRF variable at one step, with its shape and unit checked.

use super::container::{Checked, Variable};
use super::netcdf::NetCdf;
use crate::model::weather::grid::Shape;

/// Numbers beyond this are fill values: NetCDF's own is 9.969e36, WRF's and others' are 1e20 and
/// more.
const FILL: f64 = 1e19;

/// Dimensions of the grid that a variable runs along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// A number for each column.
    Columns,
    /// A number for each cell.
    Cells,
    /// A number for each bottom and top of a cell.
    Levels,
    /// A number for each western and eastern face of a cell.
    EastFaces,
    /// A number for each southern and northern face of a cell.
    NorthFaces,
}

impl Extent {
    /// Returns the lengths of the dimensions, slowest first.
    pub fn lengths(self, shape: Shape) -> Vec<u64> {
        let Shape { nx, ny, nz } = shape;
        let lengths: &[usize] = match self {
            Extent::Columns => &[ny, nx],
            Extent::Cells => &[nz, ny, nx],
            Extent::Levels => &[nz + 1, ny, nx],
            Extent::EastFaces => &[nz, ny, nx + 1],
            Extent::NorthFaces => &[nz, ny + 1, nx],
        };
        lengths.iter().map(|length| *length as u64).collect()
    }

    /// Returns the place of number `i` in words, such as "at level 3, row 2, column 1". The level
    /// is left out where there is one number for each column.
    pub fn place(self, shape: Shape, i: usize) -> String {
        let n_columns = shape.nx + usize::from(self == Extent::EastFaces);
        let n_rows = shape.ny + usize::from(self == Extent::NorthFaces);
        let level = match self {
            Extent::Columns => String::new(),
            _ => format!("level {}, ", i / (n_columns * n_rows)),
        };
        format!("at {level}row {}, column {}", i / n_columns % n_rows, i % n_columns)
    }
}

/// A variable with a checked shape and unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    pub name: &'static str,
    pub extent: Extent,
    /// Whether its first dimension is time; otherwise all steps share its numbers.
    pub has_time: bool,
    /// Factor that converts its numbers to the expected unit.
    pub scale: f64,
    /// The file's own fill values.
    fills: Vec<f64>,
}

impl Field {
    /// Finds the variable and checks its shape and unit. Returns `None` if the file does not have
    /// it.
    ///
    /// # Errors
    /// When the shape or the unit is another one than expected.
    pub fn find(
        file: &NetCdf,
        name: &'static str,
        extent: Extent,
        units: &[(&str, f64)],
        shape: Shape,
        n_steps: usize,
    ) -> Checked<Option<Field>> {
        let Some(variable) = file.variable(name) else { return Ok(None) };
        let expected = extent.lengths(shape);
        let lengths = variable.lengths();
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

    /// Reads the numbers of a step, in the expected unit, with NaN in place of fill values.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn read(&self, file: &NetCdf, shape: Shape, i_step: usize) -> Checked<Vec<f64>> {
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

    /// Reads the numbers of a step of a variable without gaps.
    ///
    /// # Errors
    /// As [`read`](Self::read), and when values are missing.
    pub fn read_whole(&self, file: &NetCdf, shape: Shape, i_step: usize) -> Checked<Vec<f64>> {
        let numbers = self.read(file, shape, i_step)?;
        let Some(first) = numbers.iter().position(|n| n.is_nan()) else { return Ok(numbers) };
        let n_missing = numbers.iter().filter(|n| n.is_nan()).count();
        let place = self.extent.place(shape, first);
        Err(self.at(
            i_step,
            format!(
                "{n_missing} values are NaN or fill values, the first {place}; expected a \
                number everywhere"
            ),
        ))
    }

    /// Adds the variable and the step to a complaint.
    pub fn at(&self, i_step: usize, what: impl std::fmt::Display) -> String {
        format!("variable {}, step {i_step}: {what}", self.name)
    }
}

/// Returns the factor that converts a variable's unit to the first one of `units`. A variable
/// without a unit has that one.
fn scale(variable: &Variable, units: &[(&str, f64)]) -> Checked<f64> {
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
