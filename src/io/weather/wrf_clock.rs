//! Times of the steps of a WRF file.

use super::container::{Checked, Variable};
use super::netcdf::NetCdf;
use crate::model::weather::steps::{first_out_of_order, format, parse};

/// Most steps of a file: two years of 10 minutes.
pub const MOST_STEPS: u64 = 105_408;

/// Reads the time of every step, in seconds from 1970-01-01 UTC, from Times or else from XTIME.
/// Returns `None` for a file of one step that has neither.
///
/// # Errors
/// When a time cannot be read or does not come after the one before it.
pub fn times(file: &NetCdf, n_steps: usize) -> Checked<Option<Vec<f64>>> {
    let (name, times_s) = if file.variable("Times").is_some() {
        ("Times", from_text(file, n_steps)?)
    } else if let Some(variable) = file.variable("XTIME") {
        ("XTIME", from_minutes(file, variable, n_steps)?)
    } else if n_steps == 1 {
        return Ok(None);
    } else {
        return Err(
            "no times: expected a variable Times, or XTIME in minutes since a date".to_owned()
        );
    };
    match first_out_of_order(&times_s) {
        None => Ok(Some(times_s)),
        Some(i) => Err(format!(
            "variable {name}, step {i}: {} does not come after step {}, {}",
            format(times_s[i]),
            i - 1,
            format(times_s[i - 1])
        )),
    }
}

fn from_text(file: &NetCdf, n_steps: usize) -> Checked<Vec<f64>> {
    let rows = file.read_rows("Times").map_err(|what| format!("variable Times: {what}"))?;
    if rows.len() != n_steps {
        return Err(format!("variable Times: {} times of {n_steps} steps", rows.len()));
    }
    let time = |(i, row): (usize, &String)| {
        parse(row.trim_end_matches(['\0', ' '])).ok_or_else(|| {
            let shown: String = row.chars().take(32).flat_map(char::escape_default).collect();
            format!(
                "variable Times, step {i}: \"{shown}\" is no time, expected YYYY-MM-DD_HH:MM:SS"
            )
        })
    };
    rows.iter().enumerate().map(time).collect()
}

fn from_minutes(file: &NetCdf, variable: &Variable, n_steps: usize) -> Checked<Vec<f64>> {
    let since = variable
        .text("units")
        .and_then(|units| units.strip_prefix("minutes since "))
        .and_then(parse);
    let Some(since) = since else {
        return Err(
            "variable XTIME: expected units \"minutes since YYYY-MM-DD HH:MM:SS\"".to_owned()
        );
    };
    if variable.lengths() != [n_steps as u64] {
        return Err(format!("variable XTIME: {} values of {n_steps} steps", variable.shape_text()));
    }
    let minutes = file
        .read("XTIME", &[0], &[n_steps as u64])
        .map_err(|what| format!("variable XTIME: {what}"))?;
    match minutes.iter().position(|m| m.is_nan() || m.abs() >= 1e9) {
        Some(i) => Err(format!("variable XTIME, step {i}: {} is no time in minutes", minutes[i])),
        None => Ok(minutes.iter().map(|m| since + m * 60.0).collect()),
    }
}
