//! Horizontal bars, one per row.

use plotters::prelude::*;

use super::axis::row_middle;
use super::medium::CELL;
use super::plot_area::PlotArea;

/// Thickness of a bar as a share of its row. The rest is the gap between bars of adjacent rows.
const THICKNESS: f64 = 0.62;

/// Returns the upper and the lower end of the bar in row `i` of `n`, px.
pub fn bar_ends<DB: DrawingBackend>(area: &PlotArea<'_, DB>, i: usize, n: usize) -> (i32, i32) {
    let edge = |d: f64| area.pixel(0.0, row_middle(i, n) + d * THICKNESS / 2.0).1;
    (edge(1.0), edge(-1.0))
}

/// Draws a bar in row `i` of `n` between two positions of the x axis; in a terminal a row of
/// `glyph`.
///
/// # Errors
/// Fails if the backend fails.
pub fn draw_bar<DB: DrawingBackend>(
    area: &PlotArea<'_, DB>,
    (i, n): (usize, usize),
    (from, to): (f64, f64),
    color: RGBColor,
    glyph: char,
) -> DrawResult<(), DB> {
    let y = row_middle(i, n);
    let (left, row) = area.pixel(from, y);
    let right = area.pixel(to, y).0;
    if area.medium.is_terminal() {
        // A cell belongs to the bar that covers its middle, so that adjacent bars share none.
        let column = |x: i32| (x + CELL.0 / 2).div_euclid(CELL.0);
        return (column(left)..column(right))
            .try_for_each(|column| area.glyph(glyph, (column * CELL.0, row), color));
    }
    let (upper, lower) = bar_ends(area, i, n);
    if right > left { area.rectangle([left, upper, right, lower], color.filled()) } else { Ok(()) }
}
