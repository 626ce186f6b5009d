//! A ledger: the error of every approximation, as bars and as a table.

use maud::{Markup, html};

use super::figure::figure as chart_figure;
use super::provenance;
use super::table::{figure, percent, table, text, value};
use crate::error::Result;
use crate::report::charts::ledger::chart;
use crate::report::charts::{number, with_interval};
use crate::studies::ledger::records::{Ledger, Row};

/// Returns the section of a ledger.
///
/// # Errors
/// Fails if the chart cannot be drawn.
pub fn section(ledger: &Ledger) -> Result<Markup> {
    let total = with_interval(ledger.total.value, ledger.total.low, ledger.total.high);
    let caption = "RMSE of two pictures that differ in that approximation alone, with 95 % \
        intervals at the ends of the bars.";
    Ok(html! {
        (provenance::section(ledger)?)
        dl class="made" {
            dt { "Picture" } dd {
                "frame " (ledger.frame) " at " (number(ledger.time_s)) " s, " (ledger.width) "×"
                (ledger.height) " pixels, compared at " (ledger.n_pixels)
            }
            dt { "Magnitude" } dd { (number(ledger.magnitude)) ", root mean square of the \
                last row's reference" }
            dt { "All together" } dd { (total) " RMSE; the rows' sum is " (number(ledger.sum)) ", \
                in quadrature " (number(ledger.quadrature)) }
            dt { "Total at most the sum" } dd { @if ledger.holds { "yes" } @else {
                strong { "no: at least one row is wrong" }
            } }
        }
        h3 { "Rows" }
        (chart_figure(&chart(ledger), caption)?)
        (rows(ledger))
    })
}

fn rows(ledger: &Ledger) -> Markup {
    let row = |r: &Row| {
        let resolved =
            if r.is_resolved { "" } else { "not resolved: below the references' own error" };
        vec![
            text(&r.name),
            text(&r.from),
            text(&r.to),
            figure(Some(r.error)),
            percent(Some(r.relative)),
            percent(Some(r.share)),
            value(Some(r.own_error)),
            figure(r.time_ratio),
            text(resolved),
        ]
    };
    let header = [
        "approximation",
        "drawn",
        "stands for",
        "RMSE",
        "relative",
        "of the sum",
        "references' own",
        "time, by without",
        "remark",
    ];
    let caption = "Every approximation, each against the one below it";
    table(caption, &header, ledger.rows.iter().map(row))
}
