//! Charts of results: SVG for a page, characters for a terminal, both drawn by the same lines
//! through plotters.

pub mod axis;
pub mod bars;
pub mod bins;
pub mod characters;
pub mod frames;
pub mod labels;
pub mod ledger;
pub mod look;
pub mod number;
pub mod passes;
pub mod plane;
pub mod tradeoff;

use std::convert::Infallible;
use std::fmt::Write as _;

use plotters::prelude::*;

use crate::error::{Error, Result};
use characters::{Brush, Characters, sgr_of};
use look::{INK, Look, MUTED, PAPER};
use plane::{Fill, marker};

/// Part of a chart that has something to say of itself when it is pointed at.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Upper left corner, width and height, px.
    pub place: [i32; 4],
    pub says: String,
}

impl Mark {
    /// About a point.
    pub fn around((x, y): (i32, i32), radius: i32, says: String) -> Mark {
        Mark { place: [x - radius, y - radius, 2 * radius, 2 * radius], says }
    }
}

/// What a colour, and without colours a glyph, stands for.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    pub color: RGBColor,
    pub glyph: char,
    pub name: String,
    /// Of points; a key without one is a square of its colour.
    pub mark: Option<Fill>,
}

/// Where a chart may draw itself: between `top` and `bottom` from the edges of the whole.
pub struct Place<'a, DB: DrawingBackend> {
    pub root: &'a DrawingArea<DB, plotters::coord::Shift>,
    pub look: Look,
    pub top: i32,
    pub bottom: i32,
}

impl<DB: DrawingBackend> Place<'_, DB> {
    /// Width and height of what is between them.
    pub fn size(&self) -> (i32, i32) {
        let (width, height) = self.root.dim_in_pixel();
        (width as i32, height as i32 - self.top - self.bottom)
    }
}

/// A chart.
pub trait Plot {
    /// One line; with it come the keys.
    fn title(&self) -> String;

    fn keys(&self, look: Look) -> Vec<Key>;

    /// Lines under the chart: what is not drawn, what numbers in it stand for.
    fn notes(&self) -> Vec<String>;

    /// Width and height that suit what is in it, px.
    fn size(&self) -> (u32, u32) {
        (900, 440 + self.notes().len() as u32 * 18)
    }

    /// Rows of characters that suit it.
    fn rows(&self) -> usize {
        18
    }

    /// Draws the chart without its title, and says what can be pointed at.
    fn draw<DB: DrawingBackend>(&self, place: &Place<'_, DB>) -> DrawResult<Vec<Mark>, DB>;

    /// An SVG document: on white paper, its text text, every mark focusable and with a title of its
    /// own.
    fn svg(&self, (width, height): (u32, u32)) -> Result<String> {
        let look = Look::PICTURE;
        let (keys, notes) = (self.keys(look), self.notes());
        let lines = key_lines(look, &keys, width as i32 - 2 * MARGIN);
        let n_lines = lines.iter().map(|(line, _)| line + 1).max().unwrap_or(0) as i32;
        let top = 34 + n_lines * look.line_height();
        let bottom = notes.len() as i32 * look.line_height() + MARGIN + NOTES_GAP;
        let mut text = String::new();
        let marks = {
            let root = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
            let place = Place { root: &root, look, top, bottom };
            let all = || -> DrawResult<Vec<Mark>, SVGBackend<'_>> {
                root.fill(&PAPER)?;
                root.draw_text(&self.title(), &look.title(), (MARGIN, 8))?;
                for (key, (line, x)) in keys.iter().zip(&lines) {
                    let y = 32 + *line as i32 * look.line_height();
                    let swatch = [(MARGIN + x, y), (MARGIN + x + SWATCH, y + SWATCH)];
                    match key.mark {
                        Some(fill) => marker(
                            &root,
                            (MARGIN + x + SWATCH / 2, y + SWATCH / 2),
                            5,
                            fill,
                            key.color,
                        )?,
                        None => root.draw(&Rectangle::new(swatch, key.color.filled()))?,
                    }
                    root.draw_text(&key.name, &look.text(INK), (MARGIN + x + SWATCH + 5, y))?;
                }
                for (i, note) in (0..).zip(&notes) {
                    let y = height as i32 - bottom + NOTES_GAP + i * look.line_height();
                    root.draw_text(note, &look.text(MUTED), (MARGIN, y))?;
                }
                let marks = self.draw(&place)?;
                root.present()?;
                Ok(marks)
            };
            all().map_err(|cause| Error::Fault {
                what: format!("a chart could not be drawn: {cause}"),
            })?
        };
        // No XML has a place for them.
        text.retain(|c| !c.is_control() || c == '\n');
        Ok(with_marks(text, &self.title(), &marks))
    }

    /// Rows of characters: title, keys, chart, notes. `columns` and `rows` are the chart's alone.
    fn text(&self, columns: usize, rows: usize, colored: bool) -> Result<String> {
        let mut characters = Characters::new(columns, rows);
        {
            let root = Brush(&mut characters).into_drawing_area();
            let place = Place { root: &root, look: Look::TERMINAL, top: 0, bottom: 0 };
            let drawn: DrawResult<Vec<Mark>, Brush<'_>> = self.draw(&place);
            let failed = |cause: DrawingAreaErrorKind<Infallible>| Error::Fault {
                what: format!("a chart: {cause}"),
            };
            drawn.map_err(failed)?;
        }
        // What a file brought along is no command to the terminal.
        let plain = |text: &str| text.replace(char::is_control, "");
        let mut out = format!("{}\n", plain(&self.title()));
        let keys = self.keys(Look::TERMINAL);
        let widest = columns as i32 * look::CELL.0;
        let lines = key_lines(Look::TERMINAL, &keys, widest);
        for (i, (key, (line, _))) in keys.iter().zip(&lines).enumerate() {
            let before = if i == 0 {
                ""
            } else if lines[i - 1].0 == *line {
                "  "
            } else {
                "\n"
            };
            let sgr = sgr_of((key.color.0, key.color.1, key.color.2));
            let glyph = if colored && sgr != 39 {
                format!("\x1b[{sgr}m{}\x1b[39m", key.glyph)
            } else {
                key.glyph.into()
            };
            let _ = write!(out, "{before}{glyph} {}", plain(&key.name));
        }
        out += if keys.is_empty() { "" } else { "\n" };
        out += &characters.text(colored);
        for note in self.notes() {
            out += &format!("{}\n", plain(&note));
        }
        Ok(out)
    }
}

/// From the edges of a picture, px.
const MARGIN: i32 = 12;
/// Over the notes, px.
const NOTES_GAP: i32 = 8;
/// Side of a key's square, px.
const SWATCH: i32 = 11;

/// Line and place from the left of every key, as many on a line as go on it.
fn key_lines(look: Look, keys: &[Key], width: i32) -> Vec<(usize, i32)> {
    let (mut line, mut x) = (0, 0);
    let mut places = Vec::new();
    for key in keys {
        let taken = look.across(SWATCH + 5, 2) + look.width_of(&key.name);
        if x > 0 && x + taken > width {
            (line, x) = (line + 1, 0);
        }
        places.push((line, x));
        x += taken + look.across(18, 2);
    }
    places
}

/// Puts what can be pointed at over all else, and names the picture to who cannot see it.
fn with_marks(mut text: String, title: &str, marks: &[Mark]) -> String {
    let named = format!(" role=\"group\" aria-label=\"{}\">", escaped(title));
    if let Some(end) = text.find('>') {
        text.replace_range(end..=end, &named);
    }
    let mut over = String::new();
    for Mark { place: [x, y, width, height], says } in marks {
        // A line's end in an attribute of XML would be read as a blank.
        let says = escaped(says).replace('\n', "&#10;");
        let _ = writeln!(
            over,
            "<g class=\"mark\" tabindex=\"0\" role=\"img\" \
             aria-label=\"{says}\"><title>{says}</title>\
             <rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"2\" \
             fill=\"none\" pointer-events=\"all\"/></g>"
        );
    }
    if let Some(end) = text.rfind("</svg>") {
        text.insert_str(end, &over);
    }
    text
}

/// For XML and HTML, in text and in quotes. What XML has no place for at all (control characters)
/// is left out.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            '\n' | '\t' => out.push(c),
            c if c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}') => {}
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_is_written_can_be_taken_for_markup() {
        assert_eq!(escaped("a<b>&\"'\u{0}\u{1b}\n"), "a&lt;b&gt;&amp;&quot;&#39;\n");
    }

    #[test]
    fn keys_go_on_as_many_lines_as_they_need() {
        let keys = ["a", "bb", "a name that takes a line of its own"].map(|name| Key {
            color: INK,
            glyph: '●',
            name: name.to_owned(),
            mark: None,
        });
        let places = key_lines(Look::TERMINAL, &keys, 40 * look::CELL.0);
        assert_eq!(places.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [0, 0, 1]);
        assert_eq!(places[1].1, (2 + 1 + 2) * look::CELL.0);
    }
}
