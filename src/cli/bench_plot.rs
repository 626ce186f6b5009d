//! The charts of `nimbus bench --plot`.

use std::collections::BTreeSet;

use clap::ColorChoice;

use super::output::chart_text;
use crate::error::Result;
use crate::report::charts::frames::FrameChart;
use crate::report::charts::passes::PassColors;
use crate::report::charts::{Chart, frames, passes};
use crate::timing::attachments::{PASSES_CHART, frames_chart};
use crate::timing::frame_rows::FrameRow;
use crate::timing::names::{case_name, mode_name};
use crate::timing::records::Run;

/// Returns the charts for the terminal: the frame times at every point of a sweep, and the device
/// times of the passes.
///
/// # Errors
/// Fails if a chart cannot be drawn.
pub fn text(run: &Run, rows: &[FrameRow], color: ColorChoice) -> Result<String> {
    let mut out = String::new();
    for chart in frame_charts(run, rows) {
        out += &chart_text(&chart, color)?;
    }
    if let Some(chart) = passes::chart(run, &PassColors::of(std::iter::once(run))) {
        out += &chart_text(&chart, color)?;
    }
    Ok(out)
}

/// Returns the charts as file names and SVG documents.
///
/// # Errors
/// Fails if a chart cannot be drawn.
pub fn files(run: &Run, rows: &[FrameRow]) -> Result<Vec<(String, String)>> {
    let frames = frame_charts(run, rows);
    let mut files = Vec::new();
    for (i, chart) in frames.iter().enumerate() {
        files.push((frames_chart(i, frames.len()), chart.svg(chart.size())?));
    }
    if let Some(chart) = passes::chart(run, &PassColors::of(std::iter::once(run))) {
        files.push((PASSES_CHART.to_owned(), chart.svg(chart.size())?));
    }
    Ok(files)
}

/// Returns the charts of the frame times, without the loops that draw nothing.
fn frame_charts(run: &Run, rows: &[FrameRow]) -> Vec<FrameChart> {
    let left_out: BTreeSet<String> = run
        .modes()
        .filter(|(case, mode)| case.is_left_out(mode))
        .map(|(case, mode)| mode.name_in(case))
        .collect();
    let name =
        |row: &FrameRow| mode_name(&case_name(&row.phase, &row.sweep), &row.threading, row.skip);
    let is_drawn = |row: &&FrameRow| left_out.is_empty() || !left_out.contains(&name(row));
    frames::charts_of_rows(rows.iter().filter(is_drawn))
}
