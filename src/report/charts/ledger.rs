//! The ledger as bars: what every approximation is off by, on an axis of logarithms.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::axis::{Axis, row_middle};
use super::bars::{bar, span};
use super::look::{INK, Look, MUTED, series};
use super::number::{number, with_interval};
use super::plane::{Behind, Plane};
use super::tradeoff::shortened;
use super::{Key, Mark, Place, Plot};
use crate::studies::ledger::records::{Ledger, Row};
use crate::studies::provenance::Figure;

/// Bars begin a decade and a bit below the least error, so that it has a length.
const BELOW: f64 = 0.08;
const N_LETTERS: usize = 30;

#[derive(Debug, Clone, PartialEq)]
pub struct LedgerChart {
    rows: Vec<Row>,
    total: Figure,
}

pub fn chart(ledger: &Ledger) -> LedgerChart {
    LedgerChart { rows: ledger.rows.clone(), total: ledger.total }
}

fn says(row: &Row) -> String {
    let Row { name, from, to, error, own_error, is_resolved, .. } = row;
    let rmse = with_interval(error.value, error.low, error.high);
    let mut lines = vec![name.clone(), format!("{from} for {to}"), format!("RMSE: {rmse}")];
    if !is_resolved {
        lines.push(format!("not resolved: the references' own error is {}", number(*own_error)));
    }
    lines.join("\n")
}

impl LedgerChart {
    fn errors(&self) -> impl Iterator<Item = f64> + '_ {
        let of_rows = self.rows.iter().flat_map(|r| [Some(r.error.value), r.error.high]);
        of_rows
            .chain([Some(self.total.value), self.total.high])
            .flatten()
            .filter(|v| v.is_finite() && *v > 0.0)
    }
}

/// Where a text of a width begins so that the line, if there is one, does not go through it.
fn beside(at: i32, width: i32, line: Option<i32>) -> i32 {
    const GAP_PX: i32 = 6;
    line.filter(|line| (at - GAP_PX..at + width).contains(line)).map_or(at, |line| line + GAP_PX)
}

impl Plot for LedgerChart {
    fn title(&self) -> String {
        "What every approximation is off by".to_owned()
    }

    fn keys(&self, _: Look) -> Vec<Key> {
        let key =
            |color, glyph, name: &str| Key { color, glyph, name: name.to_owned(), mark: None };
        let mut keys = vec![key(series(0), '█', "one approximation")];
        if self.rows.iter().any(|r| !r.is_resolved) {
            keys.push(key(MUTED, '░', "not resolved: its references are no better"));
        }
        keys.push(key(series(1), '│', "all together"));
        keys
    }

    fn notes(&self) -> Vec<String> {
        vec![]
    }

    fn size(&self) -> (u32, u32) {
        (900, 140 + 30 * self.rows.len() as u32)
    }

    fn rows(&self) -> usize {
        self.rows.len() + 3
    }

    fn draw<DB: DrawingBackend>(&self, place: &Place<'_, DB>) -> DrawResult<Vec<Mark>, DB> {
        let (look, (width, _)) = (place.look, place.size());
        let n = self.rows.len();
        let names: Vec<String> = self.rows.iter().map(|r| shortened(&r.name, N_LETTERS)).collect();
        let least = self.errors().fold(f64::INFINITY, f64::min);
        let most = self.errors().fold(0.0, f64::max);
        // Behind the longest bar there is room for its number.
        let room = ((most / least).log10().max(1.0) * f64::from(look.across(110, 12))
            / f64::from(width.max(1)))
        .max(0.1);
        let values = [least * 10f64.powf(-BELOW - 0.25), most * 10f64.powf(room)].into_iter();
        let x = Axis::log("RMSE", values, false, (width / look.across(80, 10)) as usize);
        let plane = Plane::new(place, &x, &Axis::rows(&names), Behind::Vertical)?;
        let mut marks = Vec::new();
        for (i, row) in self.rows.iter().enumerate() {
            let (y, (upper, lower)) = (row_middle(i, n), span(&plane, i, n));
            let middle = plane.pixel(0.0, y).1;
            let [left, _, right, _] = plane.bounds();
            marks.push(Mark {
                place: [left, upper, right - left, (lower - upper).max(1)],
                says: says(row),
            });
            let Some(end) = x.at(row.error.value) else {
                let why = number(row.error.value);
                let n_letters = ((right - left) / look.width_of("m")).max(2) as usize;
                plane.write(
                    &shortened(&why, n_letters),
                    (left + look.across(6, 1), middle),
                    MUTED,
                    HPos::Left,
                )?;
                continue;
            };
            let (color, glyph) = if row.is_resolved { (series(0), '█') } else { (MUTED, '░') };
            bar(&plane, (i, n), (x.range.start, end), (color, 1.0), glyph)?;
            let mut last = end;
            if let (Some(low), Some(high)) = (row.error.low, row.error.high) {
                last = x.end_at(high);
                if !look.characters {
                    plane.whisker(
                        [(x.end_at(low), y), (last, y)],
                        [low, high].map(|v| x.shows(v)),
                        INK,
                    )?;
                }
            }
            let at = plane.pixel(if look.characters { end } else { last.max(end) }, y).0
                + look.across(7, 2);
            let at = beside(
                at,
                look.width_of(&number(row.error.value)),
                x.at(self.total.value).map(|t| plane.pixel(t, y).0),
            );
            plane.write(&number(row.error.value), (at, middle), INK, HPos::Left)?;
        }
        if let Some(at) = x.at(self.total.value) {
            plane.line(&[(at, 0.0), (at, n as f64)], series(1).stroke_width(2))?;
        }
        Ok(marks)
    }
}
