//! A ledger as bars: the error of every approximation on a logarithmic axis.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::axis::{Axis, row_middle};
use super::bars::{bar_ends, draw_bar};
use super::chart::{Chart, LegendEntry, Tooltip, shortened};
use super::medium::{INK, MUTED, series};
use super::number::{number, with_interval};
use super::plot_area::{Canvas, GridLines, PlotArea};
use crate::measure::figure::Figure;
use crate::studies::ledger::records::{Ledger, Row};

/// Bars begin this much below the smallest error, in decades, so that every bar has a length. It is
/// a factor of about 2.
const BELOW: f64 = 0.33;
/// Characters of a row's name: three quarters of a picture's width stay for the bars.
const NAME_LENGTH: usize = 30;

/// The chart of a ledger.
#[derive(Debug, Clone, PartialEq)]
pub struct LedgerChart {
    rows: Vec<Row>,
    total: Figure,
}

/// Returns the chart of a ledger.
pub fn chart(ledger: &Ledger) -> LedgerChart {
    LedgerChart { rows: ledger.rows.clone(), total: ledger.total }
}

fn tooltip(row: &Row) -> String {
    let Row { name, from, to, error, own_error, is_resolved, .. } = row;
    let rmse = with_interval(error.value, error.low, error.high);
    let mut text = format!("{name}\n{from} for {to}\nRMSE: {rmse}");
    if !is_resolved {
        text += &format!("\nnot resolved: the references' own error is {}", number(*own_error));
    }
    text
}

impl LedgerChart {
    fn errors(&self) -> impl Iterator<Item = f64> + '_ {
        let figures = self.rows.iter().map(|r| r.error).chain([self.total]);
        let values = figures.flat_map(|f| [Some(f.value), f.high]).flatten();
        values.filter(|v| v.is_finite() && *v > 0.0)
    }
}

/// Moves the left end of a text to the right of a vertical line that would cross the text.
fn beside(at: i32, width: i32, line: Option<i32>) -> i32 {
    /// Distance between text and line: 6 px in a picture, 3 columns in a terminal. They would touch
    /// without it.
    const GAP_PX: i32 = 6;
    line.filter(|line| (at - GAP_PX..at + width).contains(line)).map_or(at, |line| line + GAP_PX)
}

impl Chart for LedgerChart {
    fn title(&self) -> String {
        "Error of every approximation".to_owned()
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let entry = |color, glyph, name: &str| LegendEntry {
            color,
            glyph,
            name: name.to_owned(),
            marker: None,
        };
        let mut legend = vec![entry(series(0), '█', "one approximation")];
        if self.rows.iter().any(|r| !r.is_resolved) {
            legend.push(entry(MUTED, '░', "not resolved: below the references' own error"));
        }
        legend.push(entry(series(1), '│', "all together"));
        legend
    }

    fn size(&self) -> (u32, u32) {
        (900, 140 + 30 * self.rows.len() as u32)
    }

    fn rows(&self) -> usize {
        self.rows.len() + 3
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &Canvas<'_, DB>) -> DrawResult<Vec<Tooltip>, DB> {
        let (medium, (width, _)) = (canvas.medium, canvas.size());
        let n = self.rows.len();
        let names: Vec<String> =
            self.rows.iter().map(|r| shortened(&r.name, NAME_LENGTH)).collect();
        let least = self.errors().fold(f64::INFINITY, f64::min);
        let most = self.errors().fold(0.0, f64::max);
        // Room for a number behind the longest bar, in decades.
        let decades = (most / least).log10().max(1.0);
        let room = decades * f64::from(medium.across(110, 12)) / f64::from(width.max(1));
        let ends = [least * 10f64.powf(-BELOW), most * 10f64.powf(room.max(0.1))];
        let n_ticks = (width / medium.across(80, 10)) as usize;
        let x = Axis::log("RMSE", ends.into_iter(), false, n_ticks);
        let area = PlotArea::new(canvas, &x, &Axis::rows(&names), GridLines::Vertical)?;
        let [left, _, right, _] = area.bounds();
        let total = x.position(self.total.value);
        let mut tooltips = Vec::new();
        for (i, row) in self.rows.iter().enumerate() {
            let (y, (upper, lower)) = (row_middle(i, n), bar_ends(&area, i, n));
            let middle = area.pixel(0.0, y).1;
            let rect = [left, upper, right - left, (lower - upper).max(1)];
            tooltips.push(Tooltip { rect, text: tooltip(row) });
            let value = number(row.error.value);
            let Some(end) = x.position(row.error.value) else {
                let n_letters = ((right - left) / medium.width_of("m")).max(2) as usize;
                let at = (left + medium.across(6, 1), middle);
                area.write(&shortened(&value, n_letters), at, MUTED, HPos::Left)?;
                continue;
            };
            let (color, glyph) = if row.is_resolved { (series(0), '█') } else { (MUTED, '░') };
            draw_bar(&area, (i, n), (x.range.start, end), color, glyph)?;
            let mut last = end;
            if let (false, Some(_), Some(high)) =
                (medium.is_terminal(), row.error.low, row.error.high)
            {
                last = end.max(x.clamped(high));
                area.interval(&x, row.error, |at| (at, y), INK)?;
            }
            let at = area.pixel(last, y).0 + medium.across(7, 2);
            let line = total.map(|t| area.pixel(t, y).0);
            let at = beside(at, medium.width_of(&value), line);
            area.write(&value, (at, middle), INK, HPos::Left)?;
        }
        if let Some(at) = total {
            area.line(&[(at, 0.0), (at, n as f64)], series(1).stroke_width(2))?;
        }
        Ok(tooltips)
    }
}
