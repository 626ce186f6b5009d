//! Comparison of two results of one kind: ratios of times, and differences of pictures.

use std::path::Path;

use maud::{Markup, html};

use super::bench::case_name;
use super::source::{Results, Source};
use super::table::{count, ms, remark_list, table, text, value};
use super::{error, pictures};
use crate::error::Result;
use crate::report::charts::with_interval;
use crate::timing::attachments::picture_file;
use crate::timing::compare::{
    Comparison, HEADLINE, MeasureComparison, ModeComparison, SizeComparison, few_frames_remark,
};
use crate::timing::difference::Difference;
use crate::timing::results::BenchResults;
use crate::timing::verdict::MARGIN;

/// Returns the comparison of two results. Results of different kinds have none.
///
/// # Errors
/// Fails if a picture cannot be read.
pub fn section(a: &Source, b: &Source) -> Result<Markup> {
    let folders = [a.folder.as_path(), &b.folder];
    let inner = match (&a.results, &b.results) {
        (Results::Bench(a), Results::Bench(b)) => benches(a, b, folders)?,
        (Results::Study(a), Results::Study(b)) => error::comparison(a, b, folders)?,
        _ => html! {},
    };
    Ok(html! {
        dl class="made" { dt { "A" } dd { (a.name) } dt { "B" } dd { (b.name) } }
        (inner)
    })
}

fn benches(a: &BenchResults, b: &BenchResults, folders: [&Path; 2]) -> Result<Markup> {
    let Comparison { differences, modes, errors, memory, remarks } = Comparison::new(a, b, MARGIN);
    Ok(html! {
        (differing(&differences))
        (remark_list(&remarks))
        @if modes.is_empty() { p { "A and B have no timed loop in common." } }
        @for mode in &modes { (headline(mode)) }
        @if !modes.is_empty() {
            (ratios(&modes))
            @if let Some(remark) = few_frames_remark(&modes) { p class="why" { (remark) } }
            p {
                "The verdict is that of the measure " (HEADLINE) ". Ratios within a margin of 1 % \
                are the same. The intervals of the other measures are not corrected for multiple \
                comparisons: of twenty about one is beyond its interval. " (covered(a, b))
            }
        }
        @if !errors.is_empty() { (sizes_table("RMSE against f64, and its ratio", &errors)) }
        @if !memory.is_empty() { (sizes_table("Most device memory, bytes", &memory)) }
        (pictures_of(a, b, folders)?)
    })
}

/// Says what the intervals include.
fn covered(a: &BenchResults, b: &BenchResults) -> &'static str {
    match a.run.n_starts().min(b.run.n_starts()) {
        0 | 1 => {
            "The intervals include the noise within the runs, not the variation between starts of \
             the program."
        }
        _ => "The intervals include the variation between starts of the program.",
    }
}

fn differing(found: &[Difference]) -> Markup {
    let row = |d: &Difference| vec![text(d.kind.name()), text(&d.what), text(&d.a), text(&d.b)];
    let header = ["kind", "what", "A", "B"];
    html! {
        @if found.is_empty() { p { "Device, build and scene are the same." } }
        (table("What differs between A and B", &header, found.iter().map(row)))
    }
}

fn headline(mode: &ModeComparison) -> Markup {
    let Some(measure) = mode.headline() else { return html! {} };
    html! {
        p {
            strong { (mode.name) } ": "
            @if let Some(r) = measure.b_by_a {
                "a frame of B takes " (with_interval(r.estimate, Some(r.low), Some(r.high)))
                " of A's time: "
            }
            (measure.verdict.text())
        }
    }
}

fn ratios(modes: &[ModeComparison]) -> Markup {
    let row = |mode: &ModeComparison, m: &MeasureComparison| {
        vec![
            text(&m.measure),
            text(&mode.name),
            ms(m.a_ms),
            ms(m.b_ms),
            value(m.b_by_a.map(|r| r.estimate)),
            value(m.b_by_a.map(|r| r.low)),
            value(m.b_by_a.map(|r| r.high)),
            count(m.n_a),
            count(m.n_b),
            text(m.verdict.text()),
        ]
    };
    let rows = modes.iter().flat_map(|mode| mode.measures.iter().map(move |m| row(mode, m)));
    let header = [
        "measure",
        "loop",
        "A p50, ms",
        "B p50, ms",
        "B / A",
        "95 % low",
        "high",
        "n of A",
        "n of B",
        "B is",
    ];
    table("Medians, their ratios and 95 % intervals", &header, rows)
}

fn sizes_table(caption: &str, sizes: &[SizeComparison]) -> Markup {
    let row = |e: &SizeComparison| {
        vec![
            text(if e.name.is_empty() { "scene" } else { &e.name }),
            value(Some(e.a)),
            value(Some(e.b)),
            value(e.b_by_a.map(|r| r.estimate)),
            value(e.b_by_a.map(|r| r.low)),
            value(e.b_by_a.map(|r| r.high)),
            text(e.verdict.text()),
        ]
    };
    let header = ["case", "A", "B", "B / A", "95 % low", "high", "B is"];
    table(caption, &header, sizes.iter().map(row))
}

/// Compares the pictures of cases with equal names.
fn pictures_of(
    a: &BenchResults,
    b: &BenchResults,
    [folder_a, folder_b]: [&Path; 2],
) -> Result<Markup> {
    let mut pairs = Vec::new();
    for (i, case) in a.run.cases.iter().enumerate() {
        if let Some(j) = b.run.cases.iter().position(|other| other.name() == case.name()) {
            let (file_a, file_b) = (picture_file(i), picture_file(j));
            let files = [(folder_a, file_a.as_str()), (folder_b, &file_b)];
            pairs.extend(pictures::comparison(&case_name(case), files)?);
        }
    }
    Ok(html! { @if !pairs.is_empty() { h3 { "Pictures" } @for pair in &pairs { (pair) } } })
}
