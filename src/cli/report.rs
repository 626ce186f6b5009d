//! `nimbus report RUN… -o FILE.html`.

use std::io::Write;

use super::args::ReportArgs;
use super::output::refuse_existing;
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
    refuse_existing(&args.output, args.force)?;
    atomic::check_place(&args.output)?;
    let mut sources = Vec::new();
    for path in &args.runs {
        sources.extend(source::read(path)?);
    }
    let writing = spinner("writing", args.quiet);
    let page = pages::page(&sources)?;
    atomic::write_atomic(&args.output, |file| file.write_all(page.as_bytes()))?;
    drop(writing);
    Ok(())
}
