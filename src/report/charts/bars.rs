//! Horizontal bars, a row each.

use plotters::prelude::*;

use super::axis::row_middle;
use super::plane::Plane;

/// Of a row's height, what the bar takes.
const THICKNESS: f64 = 0.62;

/// Upper and lower end of the bar in row `i` of `n`, px.
pub fn span<DB: DrawingBackend>(plane: &Plane<'_, DB>, i: usize, n: usize) -> (i32, i32) {
    let edge = |d: f64| plane.pixel(0.0, row_middle(i, n) + d * THICKNESS / 2.0).1;
    (edge(1.0), edge(-1.0))
}

/// A bar in row `i` of `n` between two places of the x axis; in a terminal a row of `glyph`.
pub fn bar<DB: DrawingBackend>(
    plane: &Plane<'_, DB>,
    (i, n): (usize, usize),
    (from, to): (f64, f64),
    (color, opacity): (RGBColor, f64),
    glyph: char,
) -> DrawResult<(), DB> {
    let y = row_middle(i, n);
    let (left, right) = (plane.pixel(from, y).0, plane.pixel(to, y).0);
    if plane.look.characters {
        let cell = super::look::CELL.0;
        let row = plane.pixel(from, y).1;
        // A cell belongs to the bar that covers its middle, so that bars beside each other share
        // none.
        let (first, end) =
            ((left + cell / 2).div_euclid(cell), (right + cell / 2).div_euclid(cell));
        return (first..end).try_for_each(|column| plane.glyph(glyph, (column * cell, row), color));
    }
    let (upper, lower) = span(plane, i, n);
    if right > left {
        plane.rectangle([left, upper, right, lower], color.mix(opacity).filled())
    } else {
        Ok(())
    }
}
