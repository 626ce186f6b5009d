//! Tables: complete without a script, and with one sorted by any column.

use maud::{Markup, html};

use crate::report::charts::number::{number, with_interval};
use crate::studies::provenance::Figure;
use crate::timing::records::Measured;

pub struct Cell {
    content: Markup,
    /// What it is sorted by, where that is a number.
    value: Option<f64>,
    is_number: bool,
}

pub fn text(text: &str) -> Cell {
    // A few words are one thing to the eye.
    const N_SHORT: usize = 18;
    let is_short = text.chars().count() <= N_SHORT;
    Cell {
        content: html! { span class=[is_short.then_some("short")] { (text) } },
        value: None,
        is_number: false,
    }
}

pub fn markup(content: Markup) -> Cell {
    Cell { content, value: None, is_number: false }
}

pub fn count(n: usize) -> Cell {
    Cell { content: html! { (n) }, value: Some(n as f64), is_number: true }
}

/// "—" where there is none.
pub fn value(value: Option<f64>) -> Cell {
    shown(value, value.map_or("—".to_owned(), number))
}

/// With three places, as tables of `bench` have them.
pub fn ms(value: Option<f64>) -> Cell {
    shown(value, value.filter(|v| v.is_finite()).map_or("—".to_owned(), |v| format!("{v:.3}")))
}

pub fn percent(value: Option<f64>) -> Cell {
    shown(
        value,
        value.filter(|v| v.is_finite()).map_or("—".to_owned(), |v| format!("{:.1} %", 100.0 * v)),
    )
}

pub fn figure(figure: Option<Figure>) -> Cell {
    let said = |f: Figure| with_interval(f.value, f.low, f.high);
    shown(figure.map(|f| f.value), figure.map_or("—".to_owned(), said))
}

/// The median with its interval.
pub fn median(measured: Option<Measured>) -> Cell {
    let said = |m: Measured| with_interval(m.of.p50, m.p50_low, m.p50_high);
    shown(measured.map(|m| m.of.p50), measured.map_or("—".to_owned(), said))
}

fn shown(value: Option<f64>, text: String) -> Cell {
    Cell { content: html! { (text) }, value: value.filter(|v| v.is_finite()), is_number: true }
}

/// A name, a unit or nothing in brackets behind it.
pub fn table(caption: &str, header: &[&str], rows: &[Vec<Cell>]) -> Markup {
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
                            @for (i, cell) in row.iter().enumerate() {
                                @if i == 0 {
                                    th scope="row" data-value=[cell.value] { (cell.content) }
                                } @else {
                                    td class=[cell.is_number.then_some("number")] data-value=[cell.value] { (cell.content) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
