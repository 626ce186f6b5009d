//! `nimbus report RUN… -o FILE.html`.

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use super::args::ReportArgs;
use super::output::{claim_file, wrote};
use super::progress::spinner;
use crate::error::{Error, Result};
use crate::io::atomic;
use crate::report::pages::{self, source};

/// Runs `nimbus report`.
///
/// # Errors
/// Fails if a result cannot be read or the page cannot be written.
pub fn run(args: &ReportArgs) -> Result<()> {
    // Faults of the arguments are reported before any work.
    let is_html = args
        .output
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("html") || e.eq_ignore_ascii_case("htm"));
    if !is_html {
        return Err(Error::usage(format!(
            "{}: expected a file name that ends in .html",
            args.output.display()
        )));
    }
    let _claim = claim_file(&args.output, args.force)?;
    check_sizes(&args.runs)?;
    let mut sources = Vec::new();
    for path in &args.runs {
        sources.extend(source::read(path)?);
    }
    let writing = spinner("writing", args.quiet);
    let page = pages::page(&sources)?;
    atomic::write_atomic(&args.output, |file| file.write_all(page.as_bytes()))?;
    drop(writing);
    let (n, plural) = (sources.len(), if sources.len() == 1 { "" } else { "s" });
    wrote(&args.output, &format!("{n} result{plural} on one page"), args.quiet);
    Ok(())
}

/// Refuses results that do not fit in memory together: their tables and pictures.
fn check_sizes(runs: &[PathBuf]) -> Result<()> {
    /// Most bytes of all files. Rows take three times their text, and pictures three times their
    /// file, encoded in the page.
    const MOST_BYTES: u64 = 384 << 20;
    let mut bytes = 0u64;
    for run in runs {
        let folder = if run.is_dir() { Some(run.as_path()) } else { run.parent() };
        let entries = folder.and_then(|folder| fs::read_dir(folder).ok()).into_iter().flatten();
        for entry in entries.flatten() {
            let path = entry.path();
            let kind = path.extension().and_then(|extension| extension.to_str());
            if matches!(kind, Some("csv" | "json" | "png")) {
                bytes = bytes.saturating_add(entry.metadata().map_or(0, |about| about.len()));
            }
        }
    }
    if bytes > MOST_BYTES {
        return Err(Error::limit(format!(
            "the tables and pictures of {} results take {} MiB, the limit of a page is {} MiB; \
             expected fewer results",
            runs.len(),
            bytes >> 20,
            MOST_BYTES >> 20
        )));
    }
    Ok(())
}
