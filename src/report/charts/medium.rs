//! Colours, and the sizes that differ between a picture and a terminal.

use plotters::prelude::{IntoFont, RGBColor, TextStyle};
use plotters::style::FontStyle;

/// Colour of text and axes.
pub const INK: RGBColor = RGBColor(0x1F, 0x24, 0x2B);
/// Colour of secondary elements, such as points behind the front.
pub const MUTED: RGBColor = RGBColor(0x5B, 0x65, 0x70);
/// Colour of grid lines.
pub const GRID: RGBColor = RGBColor(0xE3, 0xE6, 0xEA);
/// Colour of the background.
pub const PAPER: RGBColor = RGBColor(0xFF, 0xFF, 0xFF);

/// A colour with its counterparts on a dark page and in a terminal.
pub struct ThemeColor {
    /// The colour on white.
    pub light: RGBColor,
    /// The colour on a dark page, CSS.
    pub dark: &'static str,
    /// SGR code of the terminal's own palette; 39 is its text colour.
    pub sgr: u8,
}

const fn theme(light: RGBColor, dark: &'static str, sgr: u8) -> ThemeColor {
    ThemeColor { light, dark, sgr }
}

/// Colours of data series, distinguishable with colour blindness (after Okabe and Ito 2008). Each
/// has a contrast of at least 3 : 1 with either background (WCAG 2.1, 1.4.11).
pub const SERIES_COLORS: [ThemeColor; 8] = [
    theme(RGBColor(0x00, 0x5F, 0xA3), "#5BB4F0", 34),
    theme(RGBColor(0xC2, 0x4E, 0x00), "#FF9B52", 31),
    theme(RGBColor(0x00, 0x7A, 0x5A), "#3FCFA6", 32),
    theme(RGBColor(0xA8, 0x3B, 0x80), "#EB8FC6", 35),
    theme(RGBColor(0x8A, 0x6D, 0x00), "#E3C53F", 33),
    theme(RGBColor(0x1B, 0x87, 0x96), "#67D3E0", 36),
    theme(RGBColor(0x6A, 0x4F, 0xC4), "#B3A0FF", 94),
    theme(RGBColor(0x9A, 0x3A, 0x3A), "#F59A9A", 91),
];

/// Colours of text, axes and background.
pub const NEUTRAL_COLORS: [ThemeColor; 4] = [
    theme(INK, "#E8EBEF", 39),
    theme(MUTED, "#A3ADB8", 90),
    theme(GRID, "#333B45", 90),
    theme(PAPER, "#15191E", 39),
];

/// Returns the colour of data series `i`; colours repeat after eight series.
pub fn series(i: usize) -> RGBColor {
    SERIES_COLORS[i % SERIES_COLORS.len()].light
}

/// Returns the character of data series `i`.
pub fn glyph(i: usize) -> char {
    /// Filled and empty shapes alternate, so that neighbouring series differ without colour.
    const GLYPHS: [char; 8] = ['●', '○', '◆', '◇', '▲', '△', '■', '□'];
    GLYPHS[i % GLYPHS.len()]
}

/// Font size, px: small, so that labels leave room for data, and still legible at 100 % zoom.
const FONT_PX: f64 = 13.0;
/// plotters divides font sizes by this number when it writes SVG.
const PLOTTERS_FONT: f64 = 1.24;

/// Braille dots per character, across and down.
pub const CELL: (i32, i32) = (2, 4);

/// The medium of a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Medium {
    /// SVG, measured in px.
    Picture,
    /// Rows of characters, measured in Braille dots.
    Terminal,
}

impl Medium {
    /// Returns whether the chart is drawn with characters.
    pub fn is_terminal(self) -> bool {
        self == Medium::Terminal
    }

    /// Returns a width: `px` in a picture, `columns` in a terminal.
    pub fn across(self, px: i32, columns: i32) -> i32 {
        if self.is_terminal() { columns * CELL.0 } else { px }
    }

    /// Returns a height: `px` in a picture, `rows` in a terminal.
    pub fn down(self, px: i32, rows: i32) -> i32 {
        if self.is_terminal() { rows * CELL.1 } else { px }
    }

    /// Returns an upper bound on the width of a text: letters of sans-serif fonts are on average
    /// 0.5 to 0.6 of the font size wide.
    pub fn width_of(self, text: &str) -> i32 {
        let n = text.chars().count() as i32;
        self.across((f64::from(n) * 0.6 * FONT_PX).ceil() as i32, n)
    }

    /// Returns the distance of two baselines: px in a picture, Braille dots in a terminal.
    pub fn line_height(self) -> i32 {
        self.down(18, 1)
    }

    /// Returns the style of text.
    pub fn text_style(self, color: RGBColor) -> TextStyle<'static> {
        ("sans-serif", FONT_PX * PLOTTERS_FONT).into_font().color(&color)
    }

    /// Returns the style of titles.
    pub fn title_style(self) -> TextStyle<'static> {
        ("sans-serif", 15.0 * PLOTTERS_FONT, FontStyle::Bold).into_font().color(&INK)
    }
}
