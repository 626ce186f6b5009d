//! A plotters backend for terminals: Braille dots for lines, whole characters for markers and text.
//!
//! Crates for charts in terminals (textplots, rasciigraph) draw single linear line charts. This
//! backend lets the SVG charts' own code draw logarithmic axes, intervals, bars and labels.

use std::convert::Infallible;

use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
};

use super::medium::{CELL, NEUTRAL_COLORS, SERIES_COLORS};
use crate::io::plain_text::is_harmful;

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    /// Braille dots, as offset from U+2800.
    dots: u8,
    glyph: Option<char>,
    rgb: (u8, u8, u8),
}

/// Rows of characters. Drawing outside of them has no effect.
pub struct TextCanvas {
    n_columns: usize,
    cells: Vec<Cell>,
}

impl TextCanvas {
    /// Creates an empty canvas.
    pub fn new(n_columns: usize, n_rows: usize) -> TextCanvas {
        TextCanvas { n_columns, cells: vec![Cell::default(); n_columns * n_rows] }
    }

    fn cell(&mut self, column: i32, row: i32) -> Option<&mut Cell> {
        let (column, row) = (usize::try_from(column).ok()?, usize::try_from(row).ok()?);
        if column >= self.n_columns {
            None
        } else {
            self.cells.get_mut(row * self.n_columns + column)
        }
    }

    fn dot(&mut self, (x, y): BackendCoord, color: BackendColor) {
        /// Bit of each dot in Unicode's Braille characters, by row and column.
        const BITS: [[u8; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
        let bit = BITS[y.rem_euclid(CELL.1) as usize][x.rem_euclid(CELL.0) as usize];
        if let Some(cell) = self.cell(x.div_euclid(CELL.0), y.div_euclid(CELL.1)) {
            cell.dots |= bit;
            if cell.glyph.is_none() {
                cell.rgb = color.rgb;
            }
        }
    }

    fn glyph(&mut self, (column, row): (i32, i32), glyph: char, color: BackendColor) {
        if let Some(cell) = self.cell(column, row) {
            let glyph = if is_harmful(glyph) { '\u{FFFD}' } else { glyph };
            (cell.glyph, cell.rgb) = (Some(glyph), color.rgb);
        }
    }

    /// Returns the rows without trailing spaces; with `colored`, with ANSI colour codes.
    pub fn text(&self, colored: bool) -> String {
        let mut out = String::new();
        for row in self.cells.chunks(self.n_columns.max(1)) {
            let n = row.iter().rposition(|cell| shown(cell) != ' ').map_or(0, |last| last + 1);
            let mut sgr = 39;
            for cell in &row[..n] {
                let wanted = if shown(cell) == ' ' { sgr } else { sgr_of(cell.rgb) };
                if colored && wanted != sgr {
                    out += &format!("\x1b[{wanted}m");
                    sgr = wanted;
                }
                out.push(shown(cell));
            }
            out += if sgr == 39 { "\n" } else { "\x1b[39m\n" };
        }
        out
    }
}

fn shown(cell: &Cell) -> char {
    match (cell.glyph, cell.dots) {
        (Some(glyph), _) => glyph,
        (None, 0) => ' ',
        (None, dots) => char::from_u32(0x2800 + u32::from(dots)).unwrap_or(' '),
    }
}

/// Returns the SGR code of a chart colour, or that of the terminal's text colour.
pub fn sgr_of(rgb: (u8, u8, u8)) -> u8 {
    let mut all = SERIES_COLORS.iter().chain(&NEUTRAL_COLORS);
    all.find(|s| (s.light.0, s.light.1, s.light.2) == rgb).map_or(39, |shade| shade.sgr)
}

impl DrawingBackend for &mut TextCanvas {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        let (columns, n) = (self.n_columns, self.cells.len());
        (columns as u32 * CELL.0 as u32, (n / columns.max(1)) as u32 * CELL.1 as u32)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Drawn {
        // Transparent areas would hide the lines below them.
        if color.alpha > 0.5 {
            self.dot(point, color);
        }
        Ok(())
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let n = dx.abs().max(dy.abs()).max(1);
        for i in 0..=n {
            let at = |from: i32, d: i32| {
                from + (f64::from(d) * f64::from(i) / f64::from(n)).round() as i32
            };
            self.draw_pixel((at(from.0, dx), at(from.1, dy)), style.color())?;
        }
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let points: Vec<BackendCoord> = path.into_iter().collect();
        points.windows(2).try_for_each(|pair| self.draw_line(pair[0], pair[1], style))
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        let n = text.chars().count() as i32;
        let column = at.0.div_euclid(CELL.0);
        let column = match style.anchor().h_pos {
            HPos::Left => column,
            HPos::Center => column - n / 2,
            HPos::Right => column - n,
        };
        let row = match style.anchor().v_pos {
            VPos::Top | VPos::Center => at.1.div_euclid(CELL.1),
            VPos::Bottom => (at.1 - 1).div_euclid(CELL.1),
        };
        for (i, glyph) in (0..).zip(text.chars()) {
            // Text that would start left of the edge is moved inside.
            self.glyph((column.max(0) + i, row), glyph, style.color());
        }
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        _: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        Ok((text.chars().count() as u32 * CELL.0 as u32, CELL.1 as u32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::charts::medium::{INK, Medium, series};
    use plotters::prelude::*;

    #[test]
    fn draws_dots_markers_and_text_in_their_cells() {
        let mut characters = TextCanvas::new(6, 2);
        let area = (&mut characters).into_drawing_area();
        // The top dots of the first row; the bottom right dot of the second row's last cell.
        area.draw(&PathElement::new(vec![(0, 0), (11, 0)], INK)).unwrap();
        area.draw(&Pixel::new((11, 7), INK)).unwrap();
        area.draw_text("●", &Medium::Terminal.text_style(series(0)), (4, 5)).unwrap();
        area.draw_text("ab", &Medium::Terminal.text_style(INK), (0, 4)).unwrap();
        drop(area);
        assert_eq!(characters.text(false), "⠉⠉⠉⠉⠉⠉\nab●  ⢀\n");
        assert_eq!(characters.text(true), "⠉⠉⠉⠉⠉⠉\nab\x1b[34m●  \x1b[39m⢀\n");
    }

    #[test]
    fn ignores_drawing_outside_of_the_canvas() {
        let mut characters = TextCanvas::new(2, 1);
        let area = (&mut characters).into_drawing_area();
        area.draw(&PathElement::new(vec![(-5, 1), (40, 1)], INK)).unwrap();
        area.draw_text("long text", &Medium::Terminal.text_style(INK), (2, 40)).unwrap();
        drop(area);
        assert_eq!(characters.text(false), "⠒⠒\n");
    }
}
