//! The charts of `nimbus bench --plot`.

use clap::ColorChoice;

use super::output::chart_text;
use crate::error::Result;
use crate::report::charts::{Chart, frames, passes};
use crate::timing::attachments::{PASSES_CHART, frames_chart};
use crate::timing::frame_rows::FrameRow;
use crate::timing::records::Run;

/// Returns the charts for the terminal: the frame times at every point of a sweep, and the device
/// times of the passes.
///
/// # Errors
/// Fails if a chart cannot be drawn.
pub fn text(run: &Run, rows: &[FrameRow], color: ColorChoice) -> Result<String> {
    let mut out = String::new();
    for chart in frames::charts_of_rows(rows) {
        out += &chart_text(&chart, color)?;
    }
    if let Some(chart) = passes::chart(run) {
        out += &chart_text(&chart, color)?;
    }
    Ok(out)
}

/// Returns the charts as file names and SVG documents.
///
/// # Errors
/// Fails if a chart cannot be drawn.
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
