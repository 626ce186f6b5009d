//! The charts of `nimbus bench --plot`.

use clap::ColorChoice;

use super::output;
use crate::error::Result;
use crate::report::charts::{Chart, frames, passes};
use crate::timing::attachments::{PASSES_CHART, frames_chart};
use crate::timing::frame_rows::FrameRow;
use crate::timing::records::Run;

/// For the terminal: frame times of every point of a sweep, and what the device's time goes to.
pub fn text(run: &Run, rows: &[FrameRow], color: ColorChoice) -> Result<String> {
    let (columns, colored) = (output::columns(), output::colored(color));
    let mut out = String::new();
    for chart in frames::charts_of_rows(rows) {
        out += &format!("\n{}", chart.text(columns, chart.rows(), colored)?);
    }
    if let Some(chart) = passes::chart(run) {
        out += &format!("\n{}", chart.text(columns, chart.rows(), colored)?);
    }
    Ok(out)
}

/// As SVG: file names and documents.
pub fn files(run: &Run, rows: &[FrameRow]) -> Result<Vec<(String, String)>> {
    let frames = frames::charts_of_rows(rows);
    let mut files = Vec::new();
    for (i, chart) in frames.iter().enumerate() {
        files.push((frames_chart(i, frames.len()), chart.svg(chart.size())?));
    }
    if let Some(chart) = passes::chart(run) {
        files.push((PASSES_CHART.to_owned(), chart.svg(chart.size())?));
    }
    Ok(files)
}
