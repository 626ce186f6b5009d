//! Colours, and the sizes that differ between a picture and a terminal.

use plotters::prelude::{IntoFont, RGBColor, TextStyle};

/// Of text and axes.
pub const INK: RGBColor = RGBColor(0x1F, 0x24, 0x2B);
/// Of what matters less: ticks' names, points off the front.
pub const MUTED: RGBColor = RGBColor(0x5B, 0x65, 0x70);
/// Of the lines behind everything.
pub const GRID: RGBColor = RGBColor(0xE3, 0xE6, 0xEA);
pub const PAPER: RGBColor = RGBColor(0xFF, 0xFF, 0xFF);

/// A colour on white, the same on a dark page, and as a terminal has it.
pub struct Shade {
    pub light: RGBColor,
    pub dark: &'static str,
    /// SGR code of the terminal's own palette, which its user made legible; 39 is its text.
    pub sgr: u8,
}

/// Colours of series, told apart by the colour-blind too (after Okabe and Ito 2008), each 3 : 1 or
/// more against the paper on either page (WCAG 2.1, 1.4.11).
pub const SERIES: [Shade; 8] = [
    Shade { light: RGBColor(0x00, 0x5F, 0xA3), dark: "#5BB4F0", sgr: 34 },
    Shade { light: RGBColor(0xC2, 0x4E, 0x00), dark: "#FF9B52", sgr: 31 },
    Shade { light: RGBColor(0x00, 0x7A, 0x5A), dark: "#3FCFA6", sgr: 32 },
    Shade { light: RGBColor(0xA8, 0x3B, 0x80), dark: "#EB8FC6", sgr: 35 },
    Shade { light: RGBColor(0x8A, 0x6D, 0x00), dark: "#E3C53F", sgr: 33 },
    Shade { light: RGBColor(0x1B, 0x87, 0x96), dark: "#67D3E0", sgr: 36 },
    Shade { light: RGBColor(0x6A, 0x4F, 0xC4), dark: "#B3A0FF", sgr: 94 },
    Shade { light: RGBColor(0x9A, 0x3A, 0x3A), dark: "#F59A9A", sgr: 91 },
];

/// The others.
pub const PLAIN: [Shade; 4] = [
    Shade { light: INK, dark: "#E8EBEF", sgr: 39 },
    Shade { light: MUTED, dark: "#A3ADB8", sgr: 90 },
    Shade { light: GRID, dark: "#333B45", sgr: 90 },
    Shade { light: PAPER, dark: "#15191E", sgr: 39 },
];

/// Of the i-th series; they come round again.
pub fn series(i: usize) -> RGBColor {
    SERIES[i % SERIES.len()].light
}

/// Of the i-th series where there are no colours.
pub fn glyph(i: usize) -> char {
    const GLYPHS: [char; 8] = ['●', '○', '◆', '◇', '▲', '△', '■', '□'];
    GLYPHS[i % GLYPHS.len()]
}

/// A size of letters that is read without effort, px.
const FONT_PX: f64 = 13.0;
/// plotters writes a font's size divided by this.
const PLOTTERS_FONT: f64 = 1.24;

/// Of what is drawn on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Look {
    /// On a grid of characters: two dots by four a character.
    pub characters: bool,
}

/// Dots of a character.
pub const CELL: (i32, i32) = (2, 4);

impl Look {
    pub const PICTURE: Look = Look { characters: false };
    pub const TERMINAL: Look = Look { characters: true };

    /// `px` of a picture, `cells` characters' widths of a terminal.
    pub fn across(self, px: i32, cells: i32) -> i32 {
        if self.characters { cells * CELL.0 } else { px }
    }

    /// `px` of a picture, `rows` of a terminal.
    pub fn down(self, px: i32, rows: i32) -> i32 {
        if self.characters { rows * CELL.1 } else { px }
    }

    /// What `text` takes, at most: letters of sans-serif fonts are 0.5 to 0.6 of their size wide on
    /// average.
    pub fn width_of(self, text: &str) -> i32 {
        let n = text.chars().count() as i32;
        if self.characters { n * CELL.0 } else { (f64::from(n) * 0.6 * FONT_PX).ceil() as i32 }
    }

    /// Between the feet of two lines.
    pub fn line_height(self) -> i32 {
        self.down(18, 1)
    }

    pub fn text(self, color: RGBColor) -> TextStyle<'static> {
        ("sans-serif", FONT_PX * PLOTTERS_FONT).into_font().color(&color)
    }

    pub fn title(self) -> TextStyle<'static> {
        let font =
            ("sans-serif", 15.0 * PLOTTERS_FONT, plotters::style::FontStyle::Bold).into_font();
        font.color(&INK)
    }
}
