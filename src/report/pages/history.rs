//! A series of runs as a page: a chart and a table of every figure, with its changes.

use maud::{Markup, html};

use super::figure::figure;
use super::page::document;
use super::table::{count, figure as figure_cell, table, text, value};
use crate::error::Result;
use crate::measure::figure::Figure;
use crate::report::charts::sweep::{SweptFigure, charts};
use crate::report::charts::with_interval;
use crate::timing::history::{Point, Series, SeriesChange};
use crate::timing::names::Setting;

/// A run of the series.
#[derive(Debug, Clone)]
pub struct HistoryRun {
    /// Its folder.
    pub folder: String,
    /// Its start, UTC.
    pub date: String,
    /// The revision that was measured.
    pub revision: String,
}

/// Returns the HTML page of a series of runs.
///
/// # Errors
/// Fails if plotters cannot draw a chart.
pub fn history_page(runs: &[HistoryRun], series: &[Series]) -> Result<String> {
    let mut sections = Vec::new();
    for (i, of) in series.iter().enumerate() {
        sections.push((title(of), format!("series-{i}"), section(runs, of)?));
    }
    sections.push(("Runs".to_owned(), "runs".to_owned(), runs_table(runs)));
    let name = format!("{} runs", runs.len());
    Ok(document("nimbus history", &name, &sections))
}

fn title(of: &Series) -> String {
    let quantity = if of.unit.is_empty() { "Error" } else { "Frame time" };
    if of.name.is_empty() { quantity.to_owned() } else { format!("{quantity}: {}", of.name) }
}

fn section(runs: &[HistoryRun], of: &Series) -> Result<Markup> {
    let unit = if of.unit.is_empty() { "RMSE" } else { "time of a frame, ms" };
    let point = |p: &Point, series: &str, figure: Figure| SweptFigure {
        point: vec![Setting { key: "run".to_owned(), value: p.run.to_string() }],
        series: series.to_owned(),
        figure,
    };
    let measured = of.points.iter().map(|p| point(p, "run", p.figure));
    let levels = of.points.iter().map(|p| point(p, "level", Figure::alone(p.level)));
    let figures: Vec<SweptFigure> = measured.chain(levels).collect();
    let mut drawn = Vec::new();
    for chart in charts(&title(of), unit, &figures) {
        drawn.push(figure(
            &chart,
            "Medians of runs with the interval within each run, and the level between changes",
        )?);
    }
    let change = |c: &SeriesChange| {
        let [first, last] = c.runs;
        vec![
            count(c.run),
            text(&runs[c.run].revision),
            text(&with_interval(c.by.estimate, Some(c.by.low), Some(c.by.high))),
            text(&format!("{first} to {last}")),
            value(Some(c.p)),
        ]
    };
    let row = |p: &Point| {
        vec![
            count(p.run),
            text(&runs[p.run].revision),
            text(&runs[p.run].date),
            figure_cell(Some(p.figure)),
            value(Some(p.level)),
        ]
    };
    let columns = ["run", "revision", "date", unit, "level"];
    let header = ["first run after", "revision", "after / before", "runs it may be", "chance"];
    Ok(html! {
        @if of.changes.is_empty() { p { "No change beyond the noise." } }
        @else { (table("Changes", &header, of.changes.iter().map(change))) }
        @for chart in &drawn { (chart) }
        (table("Runs of this series", &columns, of.points.iter().map(row)))
    })
}

fn runs_table(runs: &[HistoryRun]) -> Markup {
    let row = |(i, run): (usize, &HistoryRun)| {
        vec![count(i), text(&run.revision), text(&run.date), text(&run.folder)]
    };
    let header = ["run", "revision", "date", "folder"];
    table("All runs in their order", &header, runs.iter().enumerate().map(row))
}
