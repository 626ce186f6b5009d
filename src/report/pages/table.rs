//! Tables, sortable by every column if scripts run.

use maud::{Markup, html};

use crate::report::charts::{number, with_interval};
use crate::studies::figure::Figure;
use crate::timing::records::Measured;

/// A cell of a table.
pub struct Cell {
    content: Markup,
    /// The number that sorting compares.
    value: Option<f64>,
    is_number: bool,
    is_missing: bool,
}

/// Returns a cell of text.
pub fn text(text: &str) -> Cell {
    // The page does not wrap short texts.
    const SHORT: usize = 18;
    let is_short = text.chars().count() <= SHORT;
    let content = html! { span class=[is_short.then_some("short")] { (text) } };
    Cell { content, value: None, is_number: false, is_missing: text == MISSING }
}

/// Returns a cell of a count.
pub fn count(n: usize) -> Cell {
    let content = html! { (n) };
    Cell { content, value: Some(n as f64), is_number: true, is_missing: false }
}

/// Returns a cell of a number, "—" if there is none.
pub fn value(value: Option<f64>) -> Cell {
    numeric(value, |v| v, number)
}

/// Returns a cell of a time with three decimal places, as in the tables of `bench`.
pub fn ms(value: Option<f64>) -> Cell {
    numeric(value.filter(|v| v.is_finite()), |v| v, |v| format!("{v:.3}"))
}

/// Returns a cell of a share, in percent.
pub fn percent(value: Option<f64>) -> Cell {
    numeric(value.filter(|v| v.is_finite()), |v| v, |v| format!("{:.1} %", 100.0 * v))
}

/// Returns a cell of a number with its interval.
pub fn figure(figure: Option<Figure>) -> Cell {
    numeric(figure, |f| f.value, |f| with_interval(f.value, f.low, f.high))
}

/// Returns a cell of a median with its interval.
pub fn median(measured: Option<Measured>) -> Cell {
    numeric(measured, |m| m.of.p50, |m| with_interval(m.of.p50, m.p50_low, m.p50_high))
}

fn numeric<T: Copy>(item: Option<T>, value: fn(T) -> f64, text: fn(T) -> String) -> Cell {
    let is_missing = item.is_none();
    let content = item.map_or(MISSING.to_owned(), text);
    let value = item.map(value).filter(|v| v.is_finite());
    Cell { content: html! { (content) }, value, is_number: true, is_missing }
}

/// Returns a list of remarks, empty if there are none.
pub fn remark_list(remarks: &[String]) -> Markup {
    html! {
        @if !remarks.is_empty() {
            ul class="remarks" { @for remark in remarks { li { (remark) } } }
        }
    }
}

/// Text of a cell without a value.
const MISSING: &str = "—";

/// Reasons for a cell without a value.
const WHY_MISSING: &str = "— : not measured: the device has no timestamps, the pass or the loop \
    did not run, or the run ended before. A median without an interval has too few values for \
    one: frames of a loop need 30, rounds of a study 2.";

/// Rows from which on a table is folded.
const MOST_UNFOLDED: usize = 30;

/// Returns a table whose first column holds the rows' names; nothing without rows. A long table is
/// folded, and a wide one scrolls in its own box, with its first column in place.
pub fn table(caption: &str, header: &[&str], rows: impl IntoIterator<Item = Vec<Cell>>) -> Markup {
    let rows: Vec<Vec<Cell>> = rows.into_iter().collect();
    if rows.is_empty() {
        return html! {};
    }
    if rows.len() > MOST_UNFOLDED {
        return html! {
            details class="folded" {
                summary { (caption) " (" (rows.len()) " rows)" }
                (unfolded(caption, header, &rows))
            }
        };
    }
    unfolded(caption, header, &rows)
}

fn unfolded(caption: &str, header: &[&str], rows: &[Vec<Cell>]) -> Markup {
    let has_missing = rows.iter().flatten().any(|cell| cell.is_missing);
    let is_number = |i: usize| rows.iter().any(|row| row.get(i).is_some_and(|cell| cell.is_number));
    html! {
        div class="wide" tabindex="0" role="region" aria-label=(caption) {
            table class="sortable" {
                caption { (caption) }
                thead { tr { @for (i, name) in header.iter().enumerate() {
                    th scope="col" class=[is_number(i).then_some("number")] { (name) }
                } } }
                tbody {
                    @for row in rows {
                        tr {
                            @for (i, Cell { content, value, is_number, .. }) in row.iter().enumerate() {
                                @if i == 0 {
                                    th scope="row" data-value=[value] { (content) }
                                } @else {
                                    td class=[is_number.then_some("number")] data-value=[value] {
                                        (content)
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
        @if has_missing { p class="why" { (WHY_MISSING) } }
    }
}
