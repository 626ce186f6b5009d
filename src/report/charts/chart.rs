//! The parts that all charts share: title, legend, notes and tooltips, as SVG and as characters.

use std::fmt::{Display, Write as _};

use plotters::prelude::*;

use super::medium::{CELL, INK, MUTED, Medium, PAPER, glyph, series};
use super::plot_area::{Canvas, MarkerFill, draw_marker};
use super::text_canvas::{TextCanvas, sgr_of};
use crate::error::{Error, Result};
use crate::io::plain_text::is_harmful;

/// A rectangle of a chart that shows a text when it is pointed at or focused.
#[derive(Debug, Clone, PartialEq)]
pub struct Tooltip {
    /// Upper left corner, width and height, px.
    pub rect: [i32; 4],
    /// The text; lines are separated by line feeds.
    pub text: String,
}

/// An entry of a legend.
#[derive(Debug, Clone, PartialEq)]
pub struct LegendEntry {
    /// The colour in a picture.
    pub color: RGBColor,
    /// The character in a terminal.
    pub glyph: char,
    /// The explanation.
    pub name: String,
    /// The marker of a point; other entries show a square.
    pub marker: Option<MarkerFill>,
}

impl LegendEntry {
    /// Returns the entry of data series `i`.
    pub fn of_series(i: usize, name: &str, marker: Option<MarkerFill>) -> LegendEntry {
        LegendEntry { color: series(i), glyph: glyph(i), name: name.to_owned(), marker }
    }
}

/// A chart of results.
pub trait Chart {
    /// Returns the title, one line.
    fn title(&self) -> String;

    /// Returns the legend.
    fn legend(&self) -> Vec<LegendEntry>;

    /// Returns the lines below the chart.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// Returns the preferred width and height of a picture, px.
    fn size(&self) -> (u32, u32) {
        (900, 440 + self.notes().len() as u32 * 18)
    }

    /// Returns the preferred number of rows in a terminal.
    fn rows(&self) -> usize {
        18
    }

    /// Draws axes and data, and returns the tooltips.
    ///
    /// # Errors
    /// Fails if the backend fails.
    fn draw<DB: DrawingBackend>(&self, canvas: &Canvas<'_, DB>) -> DrawResult<Vec<Tooltip>, DB>;

    /// Returns the chart as an SVG document of the given width and height, px. Text stays text, and
    /// tooltips are focusable elements with titles.
    ///
    /// # Errors
    /// Fails if plotters cannot draw the chart.
    fn svg(&self, (width, height): (u32, u32)) -> Result<String> {
        let medium = Medium::Picture;
        let (legend, notes) = (self.legend(), self.notes());
        let places = legend_places(medium, &legend, width as i32 - 2 * MARGIN);
        let n_lines = places.last().map_or(0, |(line, _)| line + 1) as i32;
        let line_height = medium.line_height();
        let top = 34 + n_lines * line_height;
        let bottom = notes.len() as i32 * line_height + MARGIN + NOTES_GAP;
        let mut text = String::new();
        let tooltips = {
            let root = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
            let draw = || -> DrawResult<Vec<Tooltip>, SVGBackend<'_>> {
                root.fill(&PAPER)?;
                root.draw_text(&self.title(), &medium.title_style(), (MARGIN, 8))?;
                for (entry, (line, x)) in legend.iter().zip(&places) {
                    let (x, y) = (MARGIN + x, 32 + *line as i32 * line_height);
                    let (middle, end) = (SWATCH / 2, SWATCH);
                    match entry.marker {
                        Some(fill) => {
                            draw_marker(&root, (x + middle, y + middle), 5, fill, entry.color)?;
                        }
                        None => root.draw(&Rectangle::new(
                            [(x, y), (x + end, y + end)],
                            entry.color.filled(),
                        ))?,
                    }
                    root.draw_text(&entry.name, &medium.text_style(INK), (x + end + 5, y))?;
                }
                for (i, note) in (0..).zip(&notes) {
                    let y = height as i32 - bottom + NOTES_GAP + i * line_height;
                    root.draw_text(note, &medium.text_style(MUTED), (MARGIN, y))?;
                }
                let tooltips = self.draw(&Canvas { root: &root, medium, top, bottom })?;
                root.present()?;
                Ok(tooltips)
            };
            draw().map_err(fault)?
        };
        // XML has no representation of control characters.
        text.retain(|c| !is_harmful(c) || c == '\n');
        Ok(with_tooltips(text, &self.title(), &tooltips))
    }

    /// Returns the chart as lines of characters: title, legend, chart, notes. `columns` and `rows`
    /// are the size of the chart alone.
    ///
    /// # Errors
    /// Fails if plotters cannot draw the chart.
    fn text(&self, columns: usize, rows: usize, colored: bool) -> Result<String> {
        let medium = Medium::Terminal;
        let mut characters = TextCanvas::new(columns, rows);
        {
            let root = (&mut characters).into_drawing_area();
            let canvas = Canvas { root: &root, medium, top: 0, bottom: 0 };
            let drawn: DrawResult<Vec<Tooltip>, &mut TextCanvas> = self.draw(&canvas);
            drawn.map_err(fault)?;
        }
        // Text of a file must not send commands to the terminal.
        let plain = |text: &str| text.replace(is_harmful, "");
        let mut out = format!("{}\n", plain(&self.title()));
        let legend = self.legend();
        let mut last_line = None;
        for (entry, (line, _)) in
            legend.iter().zip(legend_places(medium, &legend, columns as i32 * CELL.0))
        {
            out += match last_line {
                None => "",
                Some(last) if last == line => "  ",
                Some(_) => "\n",
            };
            last_line = Some(line);
            let LegendEntry { color, glyph, name, .. } = entry;
            let sgr = sgr_of((color.0, color.1, color.2));
            let _ = if colored && sgr != 39 {
                write!(out, "\x1b[{sgr}m{glyph}\x1b[39m {}", plain(name))
            } else {
                write!(out, "{glyph} {}", plain(name))
            };
        }
        out += if legend.is_empty() { "" } else { "\n" };
        out += &characters.text(colored);
        for note in self.notes() {
            out += &format!("{}\n", plain(&note));
        }
        Ok(out)
    }
}

fn fault(cause: impl Display) -> Error {
    Error::Fault { what: format!("cannot draw a chart: {cause}") }
}

/// Distance of text from the edges of a picture, px: about the height of a letter.
const MARGIN: i32 = 12;
/// Gap above the notes, px: about half a line, which sets them off from the x axis.
const NOTES_GAP: i32 = 8;
/// Side of a legend entry's square, px: a little less than the font size, as letters are.
const SWATCH: i32 = 11;

/// Returns line and left end of every legend entry, with as many entries on a line as fit.
fn legend_places(medium: Medium, legend: &[LegendEntry], width: i32) -> Vec<(usize, i32)> {
    let (mut line, mut x) = (0, 0);
    let mut places = Vec::new();
    for entry in legend {
        let taken = medium.across(SWATCH + 5, 2) + medium.width_of(&entry.name);
        if x > 0 && x + taken > width {
            (line, x) = (line + 1, 0);
        }
        places.push((line, x));
        x += taken + medium.across(18, 2);
    }
    places
}

/// Adds the title for assistive technology, and the tooltips above all other elements.
fn with_tooltips(mut svg: String, title: &str, tooltips: &[Tooltip]) -> String {
    let named = format!(" role=\"group\" aria-label=\"{}\">", escape_markup(title));
    if let Some(end) = svg.find('>') {
        svg.replace_range(end..=end, &named);
    }
    let mut over = String::new();
    for Tooltip { rect: [x, y, width, height], text } in tooltips {
        // XML reads a line feed in an attribute as a space.
        let text = escape_markup(text).replace('\n', "&#10;");
        let _ = writeln!(
            over,
            "<g class=\"mark\" tabindex=\"0\" role=\"img\" \
             aria-label=\"{text}\"><title>{text}</title>\
             <rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"2\" \
             fill=\"none\" pointer-events=\"all\"/></g>"
        );
    }
    if let Some(end) = svg.rfind("</svg>") {
        svg.insert_str(end, &over);
    }
    svg
}

/// Escapes text for XML and HTML, within elements and quoted attributes, and removes the control
/// characters that XML cannot represent.
pub fn escape_markup(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            '\n' | '\t' => out.push(c),
            c if is_harmful(c) || matches!(c, '\u{FFFE}' | '\u{FFFF}') => {}
            c => out.push(c),
        }
    }
    out
}

/// Cuts a text to `n` characters, the last one an ellipsis.
pub(super) fn shortened(text: &str, n: usize) -> String {
    if text.chars().count() <= n {
        return text.to_owned();
    }
    text.chars().take(n - 1).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escapes_markup_and_drops_control_characters() {
        assert_eq!(escape_markup("a<b>&\"'\u{0}\u{1b}\n"), "a&lt;b&gt;&amp;&quot;&#39;\n");
    }

    #[test]
    fn legend_continues_on_the_next_line() {
        let legend = ["a", "bb", "a name that takes a line of its own"].map(|name| LegendEntry {
            color: INK,
            glyph: '●',
            name: name.to_owned(),
            marker: None,
        });
        let places = legend_places(Medium::Terminal, &legend, 40 * CELL.0);
        assert_eq!(places.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [0, 0, 1]);
        assert_eq!(places[1].1, (2 + 1 + 2) * CELL.0);
    }
}
