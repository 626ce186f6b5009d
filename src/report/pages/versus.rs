//! Two results of a kind: how much faster, and how far their pictures are apart.

use std::path::Path;

use maud::{Markup, html};

use super::bench::case_name;
use super::pictures;
use super::source::{Found, Source};
use super::table::{Cell, count, ms, table, text, value};
use super::tradeoff;
use crate::error::Result;
use crate::report::charts::number::with_interval;
use crate::timing::attachments::picture_file;
use crate::timing::compare::{Comparison, HEADLINE, MeasureComparison, ModeComparison};
use crate::timing::difference::Difference;
use crate::timing::results::BenchResults;

pub fn section(a: &Source, b: &Source) -> Result<Markup> {
    let inner = match (&a.found, &b.found) {
        (Found::Bench(of_a), Found::Bench(of_b)) => benches(of_a, of_b, [&a.folder, &b.folder])?,
        (Found::Study(of_a), Found::Study(of_b)) => {
            tradeoff::versus(of_a, of_b, [&a.folder, &b.folder])?
        }
        _ => html! {},
    };
    Ok(html! {
        dl class="made" { dt { "A" } dd { (a.name) } dt { "B" } dd { (b.name) } }
        (inner)
    })
}

fn benches(a: &BenchResults, b: &BenchResults, folders: [&Path; 2]) -> Result<Markup> {
    let Comparison { differences, modes, remarks } = Comparison::new(a, b);
    Ok(html! {
        (differing(&differences))
        @if !remarks.is_empty() { ul class="remarks" { @for remark in &remarks { li { (remark) } } } }
        @if modes.is_empty() { p { "A and B have no timed loop in common." } }
        @for mode in &modes { (headline(mode)) }
        @if !modes.is_empty() {
            (ratios(&modes))
            p { (HEADLINE) " decides; the other rows are not corrected for many comparisons: of \
                twenty equal ones, one will seem to differ. "
                "The intervals know the noise within the runs, not from one start to the next." }
        }
        (pictures_of(a, b, folders)?)
    })
}

fn differing(found: &[Difference]) -> Markup {
    let row = |d: &Difference| vec![text(d.kind.name()), text(&d.what), text(&d.a), text(&d.b)];
    let rows: Vec<Vec<Cell>> = found.iter().map(row).collect();
    html! {
        @if rows.is_empty() { p { "Device, build and scene are the same." } }
        @else { (table("What differs between A and B", &["kind", "what", "A", "B"], &rows)) }
    }
}

fn headline(mode: &ModeComparison) -> Markup {
    let Some(of) = mode.headline() else { return html! {} };
    html! {
        p {
            strong { (mode.name) } ": "
            @if let Some(r) = of.b_by_a { "a \
                frame of B takes " (with_interval(r.estimate, Some(r.low), Some(r.high))) " of A's time: " }
            (of.verdict.text())
        }
    }
}

fn ratios(modes: &[ModeComparison]) -> Markup {
    let row = |mode: &ModeComparison, m: &MeasureComparison| -> Vec<Cell> {
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
    let rows: Vec<Vec<Cell>> =
        modes.iter().flat_map(|mode| mode.measures.iter().map(move |m| row(mode, m))).collect();
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
    table("Medians, their ratios and 95 % intervals", &header, &rows)
}

/// Of cases of one name, whatever their places.
fn pictures_of(
    a: &BenchResults,
    b: &BenchResults,
    [folder_a, folder_b]: [&Path; 2],
) -> Result<Markup> {
    let mut shown = Vec::new();
    for (i, of_a) in a.run.cases.iter().enumerate() {
        let Some(j) = b.run.cases.iter().position(|of_b| of_b.name() == of_a.name()) else {
            continue;
        };
        let files = [(folder_a, picture_file(i)), (folder_b, picture_file(j))];
        let [file_a, file_b] = [0, 1].map(|k| (files[k].0, files[k].1.as_str()));
        shown.extend(pictures::versus(&case_name(&a.run, i), [file_a, file_b])?);
    }
    Ok(html! { @if !shown.is_empty() { h3 { "Pictures" } @for pair in &shown { (pair) } } })
}
