//! Tables, sortable by every column if scripts run.

use maud::{Markup, html};

use crate::measure::figure::Figure;
use crate::report::charts::{number, with_interval};
use crate::timing::N_FRAMES_NEEDED;
use crate::timing::records::Measured;

/// A cell of a table.
pub struct Cell {
    content: Markup,
    /// The number that sorting compares.
    value: Option<f64>,
    is_number: bool,
    is_missing: bool,
    lacks_interval: bool,
}

/// Returns a cell of text.
pub fn text(text: &str) -> Cell {
    /// Longest text that the page does not wrap, characters. Longer texts would widen the table; a
    /// lower limit would make its rows taller.
    const SHORT: usize = 18;
    let is_short = text.chars().count() <= SHORT;
    let content = html! { span class=[is_short.then_some("short")] { (text) } };
    let is_missing = text == MISSING;
    Cell { content, value: None, is_number: false, is_missing, lacks_interval: false }
}

/// Returns a cell of a count.
pub fn count(n: usize) -> Cell {
    numeric(Some(n), |n| n as f64, |n| n.to_string())
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
    let lacks_interval = figure.is_some_and(|f| f.low.is_none());
    let cell = numeric(figure, |f| f.value, |f| with_interval(f.value, f.low, f.high));
    Cell { lacks_interval, ..cell }
}

/// Returns a cell of a median with its interval.
pub fn median(measured: Option<Measured>) -> Cell {
    figure(measured.map(|m| Figure { value: m.of.p50, low: m.p50_low, high: m.p50_high }))
}

fn numeric<T: Copy>(item: Option<T>, value: fn(T) -> f64, text: fn(T) -> String) -> Cell {
    let is_missing = item.is_none();
    let content = item.map_or(MISSING.to_owned(), text);
    let value = item.map(value).filter(|v| v.is_finite());
    let content = html! { (content) };
    Cell { content, value, is_number: true, is_missing, lacks_interval: false }
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
const WHY_MISSING: &str = "— : there is no value: passes were not timed, the pass or the loop did \
    not run, or the run ended before it.";

/// Number of rounds of a study that a confidence interval needs: one round has no scatter.
const N_ROUNDS_NEEDED: usize = 2;

/// Returns the remarks below a table on values and intervals that it lacks.
fn gaps(rows: &[Vec<Cell>]) -> Markup {
    let any = |is: fn(&Cell) -> bool| rows.iter().flatten().any(is);
    html! {
        @if any(|cell| cell.is_missing) { p class="why" { (WHY_MISSING) } }
        @if any(|cell| cell.lacks_interval) {
            p class="why" {
                "A value alone has too few values for a confidence interval, which needs "
                (N_FRAMES_NEEDED) " frames of a loop, or " (N_ROUNDS_NEEDED) " rounds of a study."
            }
        }
    }
}

/// Most rows of a table that is not folded: more do not fit a screen.
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
    let is_number = |i: usize| rows.iter().any(|row| row.get(i).is_some_and(|cell| cell.is_number));
    html! {
        div class="wide" tabindex="0" role="region" aria-label=(caption) {
            table class="sortable" {
                caption { (caption) }
                thead { tr { @for (i, name) in header.iter().enumerate() {
                    th scope="col" class=[is_number(i).then_some("number")] { (name) }
                } } }
                tbody { @for row in rows { tr {
                    @for (i, cell) in row.iter().enumerate() { (cell_of_row(i, cell)) }
                } } }
            }
        }
        (gaps(rows))
    }
}

/// Returns the cell of column `i`; the first is the row's name.
fn cell_of_row(i: usize, Cell { content, value, is_number, .. }: &Cell) -> Markup {
    html! {
        @if i == 0 {
            th scope="row" data-value=[value] { (content) }
        } @else {
            td class=[is_number.then_some("number")] data-value=[value] { (content) }
        }
    }
}
