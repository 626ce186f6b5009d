//! Writing for people and for programs.

use std::io::{IsTerminal, Write};
use std::path::Path;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use clap::ColorChoice;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use crate::error::{Error, Result};
use crate::io::atomic::write_atomic;
use crate::report::charts::Chart;

/// `error: …` on stderr.
pub fn error(error: &Error, color: ColorChoice) {
    let colored = match color {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => {
            std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none()
        }
    };
    let label = if colored { "\x1b[1;31merror:\x1b[0m" } else { "error:" };
    eprintln!("{label} {error}");
}

/// Whether what goes to stdout may be coloured.
pub fn colored(color: ColorChoice) -> bool {
    match color {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => {
            std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none()
        }
    }
}

/// Characters across a chart: the terminal's, where stdout is one, within what can be read.
pub fn columns() -> usize {
    const USUAL: usize = 100;
    terminal_size::terminal_size().map_or(USUAL, |(width, _)| usize::from(width.0)).clamp(40, 160)
}

/// Text to stdout. A reader that has gone away (`| head`) is no error.
pub fn text(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(fail(e)),
        _ => Ok(()),
    }
}

/// A chart as an SVG file.
pub fn write_chart(path: &Path, chart: &impl Chart) -> Result<()> {
    let svg = chart.svg(chart.size())?;
    write_atomic(path, |file| file.write_all(svg.as_bytes()))
}

/// Rows as CSV with a header, or as a JSON array.
pub fn rows<T: Serialize>(rows: &[T], json: bool) -> Result<()> {
    if json {
        return object(rows);
    }
    let mut writer = csv::Writer::from_writer(vec![]);
    for row in rows {
        writer.serialize(row).map_err(fail)?;
    }
    csv_text(writer)
}

/// Rows whose columns are known only now, as CSV.
pub fn numbers(names: &[String], rows: impl Iterator<Item = Vec<f64>>) -> Result<()> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(vec![]);
    writer.serialize(names).map_err(fail)?;
    for row in rows {
        writer.serialize(row).map_err(fail)?;
    }
    csv_text(writer)
}

/// Anything as JSON.
pub fn object<T: Serialize + ?Sized>(object: &T) -> Result<()> {
    text(&(serde_json::to_string_pretty(object).map_err(fail)? + "\n"))
}

fn csv_text(writer: csv::Writer<Vec<u8>>) -> Result<()> {
    text(&String::from_utf8_lossy(&writer.into_inner().map_err(fail)?))
}

fn fail(what: impl std::fmt::Display) -> Error {
    Error::Io { path: "stdout".into(), what: what.to_string() }
}

/// A progress bar on stderr; none when quiet or when stderr is no terminal.
pub fn progress(n: u64, what: &str, quiet: bool) -> ProgressBar {
    let hidden = quiet || !std::io::stderr().is_terminal();
    let target = if hidden { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let bar = ProgressBar::with_draw_target(Some(n), target).with_message(what.to_owned());
    match ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// A bar that is shown once its work has lasted a second, and that any thread may move on. It is
/// gone when it is dropped.
pub struct LateProgress {
    bar: ProgressBar,
    begin: Instant,
    may_show: bool,
}

/// For `n` parts; never shown when quiet or when stderr is no terminal.
pub fn late_progress(n: u64, what: &str, quiet: bool) -> LateProgress {
    LateProgress {
        bar: progress(n, what, true),
        begin: Instant::now(),
        may_show: !quiet && std::io::stderr().is_terminal(),
    }
}

impl LateProgress {
    /// One more part is done.
    pub fn advance(&self) {
        self.bar.inc(1);
        if self.may_show && self.bar.is_hidden() && self.begin.elapsed() > SPINNER_DELAY {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
    }
}

impl Drop for LateProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Work without a count of its parts: dropped when the work ends.
pub struct Spinner {
    /// Never sent on; its end ends the thread.
    done: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// Shows on stderr that work is going on, once it has lasted a second; never when quiet or when
/// stderr is no terminal.
pub fn spinner(what: &'static str, quiet: bool) -> Spinner {
    if quiet || !std::io::stderr().is_terminal() {
        return Spinner { done: None, thread: None };
    }
    let (done, waiting) = mpsc::channel();
    let thread = std::thread::spawn(move || {
        if waiting.recv_timeout(SPINNER_DELAY) != Err(RecvTimeoutError::Timeout) {
            return;
        }
        let spinner =
            ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr()).with_message(what);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
            spinner.set_style(style);
        }
        spinner.set_elapsed(SPINNER_DELAY);
        while waiting.recv_timeout(SPINNER_STEP) == Err(RecvTimeoutError::Timeout) {
            spinner.tick();
        }
        spinner.finish_and_clear();
    });
    Spinner { done: Some(done), thread: Some(thread) }
}

const SPINNER_DELAY: Duration = Duration::from_secs(1);
const SPINNER_STEP: Duration = Duration::from_millis(100);

impl Drop for Spinner {
    fn drop(&mut self) {
        self.done = None;
        // The line is cleared before anything else is printed; a thread that failed has drawn
        // nothing to clear.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Columns aligned: the first to the left, the others to the right.
pub fn table(rows: &[Vec<String>]) -> String {
    let n_columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| {
        rows.iter().filter_map(|r| r.get(c)).map(|t| t.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..n_columns).map(width).collect();
    let mut out = String::new();
    for row in rows {
        let cells = row.iter().enumerate().map(|(c, t)| {
            let pad = " ".repeat(widths[c] - t.chars().count());
            if c == 0 { format!("{t}{pad}") } else { format!("{pad}{t}") }
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
    fn columns_line_up() {
        let rows = vec![vec!["a".into(), "b".into()], vec!["long".into(), "1.25".into()]];
        assert_eq!(table(&rows), "a        b\nlong  1.25\n");
    }
}
