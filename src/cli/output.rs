//! Prints results for people and for programs.

use std::io::{IsTerminal, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use clap::ColorChoice;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::io::atomic::{check_folder_of, check_place, write_atomic};
use crate::io::claim::Claim;
pub use crate::io::claim::{refuse_any, refuse_existing};
use crate::io::console::{self, say};
use crate::io::plain_text::{plain, plain_json};
use crate::io::result_folder::ResultFolder;
use crate::measure::figure::Figure;
use crate::report::charts::Chart;
use crate::studies::kept_paths::OnDisk;

/// Prints `error: …` to stderr.
pub fn error(error: &Error, color: ColorChoice) {
    let is_colored = is_colored(color, &std::io::stderr());
    let label = if is_colored { "\x1b[1;31merror:\x1b[0m" } else { "error:" };
    console::write_painted(&format!("{label} {}", plain(&error.to_string())));
}

fn is_colored(color: ColorChoice, stream: &impl IsTerminal) -> bool {
    match color {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => stream.is_terminal() && std::env::var_os("NO_COLOR").is_none(),
    }
}

/// Returns a chart as text for the terminal, after an empty line.
///
/// # Errors
/// Fails if the chart cannot be drawn.
pub fn chart_text(chart: &impl Chart, color: ColorChoice) -> Result<String> {
    /// Columns if stdout is not a terminal.
    const USUAL: usize = 100;
    let width = terminal_size::terminal_size().map_or(USUAL, |(width, _)| usize::from(width.0));
    let is_colored = is_colored(color, &std::io::stdout());
    Ok(format!("\n{}", chart.text(width.clamp(40, 160), chart.rows(), is_colored)?))
}

/// Writes a chart as an SVG file.
///
/// # Errors
/// Fails if the chart cannot be drawn or the file cannot be written.
pub fn write_chart(path: &Path, chart: &impl Chart) -> Result<()> {
    let svg = chart.svg(chart.size())?;
    write_atomic(path, |file| file.write_all(svg.as_bytes()))
}

/// Prints text to stdout, with characters that a terminal would obey escaped. A closed pipe
/// (`| head`) is not an error.
///
/// # Errors
/// Fails if stdout cannot be written.
pub fn text(text: &str) -> Result<()> {
    painted(&plain(text))
}

/// Prints charts of [`chart_text`] to stdout, whose only control characters are their colours.
///
/// # Errors
/// Fails if stdout cannot be written.
pub fn painted(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(fail(e)),
        _ => Ok(()),
    }
}

/// Returns rows as CSV with a header, or as a JSON array.
///
/// # Errors
/// Fails if a row cannot be serialized.
pub fn rows<T: Serialize>(rows: &[T], json: bool) -> Result<String> {
    if json {
        return json_text(rows);
    }
    let mut writer = csv::Writer::from_writer(vec![]);
    for row in rows {
        writer.serialize(row).map_err(fail)?;
    }
    csv_text(writer)
}

/// Returns rows that have no names as CSV under the given column names.
///
/// # Errors
/// Fails if a row cannot be serialized.
pub fn csv_rows<T: Serialize>(
    names: &[impl AsRef<str>],
    rows: impl Iterator<Item = T>,
) -> Result<String> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(vec![]);
    writer.write_record(names.iter().map(AsRef::as_ref)).map_err(fail)?;
    for row in rows {
        writer.serialize(row).map_err(fail)?;
    }
    csv_text(writer)
}

/// Prints a value as JSON.
///
/// # Errors
/// Fails if the value cannot be serialized or stdout cannot be written.
pub fn object<T: Serialize + ?Sized>(object: &T) -> Result<()> {
    text(&json_text(object)?)
}

/// Returns a value as JSON.
///
/// # Errors
/// Fails if the value cannot be serialized.
pub fn json_text<T: Serialize + ?Sized>(object: &T) -> Result<String> {
    let json = serde_json::to_string_pretty(object).map_err(fail)?;
    Ok(format!("{}\n", plain_json(&json)))
}

fn csv_text(writer: csv::Writer<Vec<u8>>) -> Result<String> {
    String::from_utf8(writer.into_inner().map_err(fail)?).map_err(fail)
}

fn fail(what: impl std::fmt::Display) -> Error {
    Error::Io { path: "stdout".into(), what: what.to_string() }
}

/// Claims the place of a file that a command writes, before its work.
///
/// # Errors
/// Fails if the file exists and `force` is not set, it cannot be written, or another run writes it.
pub fn claim_file(path: &Path, force: bool) -> Result<Option<Claim>> {
    refuse_existing(path, force)?;
    check_place(path)?;
    let claim = Claim::take(path)?;
    // Another run may have written it meanwhile.
    refuse_any(path, force)?;
    Ok(claim)
}

/// Checks the place of a results folder before the work of a command, which makes this one folder
/// and none above it.
///
/// # Errors
/// Fails if the folder above it does not exist, or if it exists and `force` is not set.
pub fn check_out(out: &Path, force: bool) -> Result<()> {
    check_folder_of(out)?;
    refuse_existing(out, force)
}

/// Says on stderr what a command has written, and where.
pub fn wrote(place: &Path, what: &str, quiet: bool) {
    if !quiet {
        say!("wrote {}: {what}", place.display());
    }
}

/// Says on stderr that a command has written a picture.
pub fn wrote_picture(path: &Path, width: u32, height: u32, quiet: bool) {
    wrote(path, &format!("{width} × {height} pixels"), quiet);
}

/// Says on stderr what the disk has of the random paths of a command that ended early.
pub fn kept_paths(on_disk: Option<OnDisk>) {
    match on_disk {
        Some(OnDisk::These(n)) => {
            say!("{n} paths a pixel are kept; the same command goes on from them");
        }
        Some(OnDisk::Others(n)) => {
            say!("another run has kept {n} paths a pixel; those of this run are not kept");
        }
        Some(OnDisk::Nothing) => say!("no path is kept"),
        None => {}
    }
}

/// Says on stderr where the results of a run are. A run that ended early may have kept its results
/// apart from earlier ones.
pub fn wrote_folder(folder: &ResultFolder, is_finished: bool, quiet: bool) {
    let (n, list) = folder.n_files();
    let files = format!("{n} files, listed in {list}");
    let place = folder.place();
    match (is_finished, folder.unfinished_at()) {
        (true, _) => wrote(place, &files, quiet),
        (false, Some(at)) if at == place => {
            wrote(place, &format!("what was finished, {files}"), quiet);
        }
        (false, Some(at)) if !quiet => {
            let (place, at) = (place.display(), at.display());
            say!("note: {place} keeps its earlier results; the new ones are in {at}");
        }
        (false, _) => {}
    }
}

/// A results folder that the thread of Ctrl-C may take over; none before it is claimed.
pub type SharedFolder = Arc<Mutex<Option<ResultFolder>>>;

/// Locks a shared folder.
pub fn lock_folder(folder: &SharedFolder) -> MutexGuard<'_, Option<ResultFolder>> {
    folder.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the rows of a table that has only its header yet.
pub fn header<const N: usize>(names: [&str; N]) -> Vec<Vec<String>> {
    vec![names.map(str::to_owned).to_vec()]
}

/// Returns the value as text, or "-" if there is none.
pub fn or_dash<T>(value: Option<T>, text: impl Fn(T) -> String) -> String {
    value.map_or("-".to_owned(), text)
}

/// Returns an interval as "low to high", or "-" if there is none.
pub fn interval(figure: Option<Figure>, text: impl Fn(f64) -> String) -> String {
    let ends = figure.and_then(|f| f.low.zip(f.high));
    or_dash(ends, |(low, high)| format!("{} to {}", text(low), text(high)))
}

/// Returns a value in scientific notation with three digits; "0" for zero.
pub fn scientific(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.2e}") }
}

/// Returns a table with aligned columns: the first to the left, the others to the right.
pub fn table(rows: &[Vec<String>]) -> String {
    let n_columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| {
        rows.iter().filter_map(|r| r.get(c)).map(|t| t.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..n_columns).map(width).collect();
    let mut out = String::new();
    for row in rows {
        let cells = row.iter().zip(&widths).enumerate().map(|(c, (t, width))| match c {
            0 => format!("{t:width$}"),
            _ => format!("{t:>width$}"),
        });
        out += cells.collect::<Vec<_>>().join("  ").trim_end();
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned() {
        let rows = vec![vec!["a".into(), "b".into()], vec!["long".into(), "1.25".into()]];
        assert_eq!(table(&rows), "a        b\nlong  1.25\n");
    }
}
