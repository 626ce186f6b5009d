//! `nimbus report RUN… -o FILE.html`.

use std::io::Write;

use super::args::ReportArgs;
use super::{output, refuse_existing};
use crate::error::{Error, Result};
use crate::io::atomic;
use crate::report::pages::{self, source};

pub fn run(args: &ReportArgs) -> Result<()> {
    // All that can be known to be wrong is said before any work.
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
    let spinner = output::spinner("writing", args.quiet);
    let page = pages::page(&sources)?;
    atomic::write_atomic(&args.output, |file| file.write_all(page.as_bytes()))?;
    drop(spinner);
    Ok(())
}
