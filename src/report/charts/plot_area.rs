//! The area between two axes, and the shapes that charts draw in it.

use std::f64::consts::PI;
use std::ops::Range;

use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::{Axis, Tick};
use super::medium::{GRID, INK, MUTED, Medium, PAPER};
use super::number::number;
use crate::measure::figure::Figure;

/// The drawing area of a chart, between `top` and `bottom` pixels from the edges of `root`.
pub struct Canvas<'a, DB: DrawingBackend> {
    /// The whole drawing.
    pub root: &'a DrawingArea<DB, Shift>,
    /// The medium, which determines sizes.
    pub medium: Medium,
    /// Height of title and legend, px.
    pub top: i32,
    /// Height of the notes, px.
    pub bottom: i32,
}

impl<DB: DrawingBackend> Canvas<'_, DB> {
    /// Returns width and height without `top` and `bottom`, px.
    pub fn size(&self) -> (i32, i32) {
        let (width, height) = self.root.dim_in_pixel();
        (width as i32, height as i32 - self.top - self.bottom)
    }
}

/// The area between two axes.
pub struct PlotArea<'a, DB: DrawingBackend> {
    chart: ChartContext<'a, DB, Cartesian2d<Axis, Axis>>,
    root: &'a DrawingArea<DB, Shift>,
    /// The medium, which determines sizes.
    pub medium: Medium,
}

/// The lines that are drawn behind a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GridLines {
    /// Lines at the ticks of both axes.
    Both,
    /// Lines at the ticks of the x axis.
    Vertical,
    /// Lines at the ticks of the y axis.
    Horizontal,
}

/// The filling of a marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkerFill {
    /// A disc.
    Full,
    /// A circle with its left half filled.
    Half,
    /// A circle.
    None,
}

/// Half the length of the line across the end of an interval, px: less than the radius of markers.
const CAP_PX: i32 = 3;

impl<'a, DB: DrawingBackend> PlotArea<'a, DB> {
    /// Draws two axes.
    ///
    /// # Errors
    /// Fails if the backend fails.
    pub fn new(
        canvas: &Canvas<'a, DB>,
        x: &Axis,
        y: &Axis,
        lines: GridLines,
    ) -> DrawResult<PlotArea<'a, DB>, DB> {
        let medium = canvas.medium;
        let widest = y.ticks.iter().map(|t| medium.width_of(&t.text)).max().unwrap_or(0);
        // Room for the tick and, in a picture, for the vertical label of the axis.
        let left = widest + medium.across(if y.name.is_empty() { 22 } else { 40 }, 1);
        let is_name_above = medium.is_terminal() && !y.name.is_empty();
        let top = canvas.top + medium.down(6, i32::from(is_name_above));
        let mut chart = ChartBuilder::on(canvas.root)
            .margin_top(top)
            .margin_bottom(canvas.bottom)
            .margin_right(medium.across(18, 2))
            .margin_left(medium.across(10, 0))
            .set_label_area_size(LabelAreaPosition::Left, left)
            .set_label_area_size(
                LabelAreaPosition::Bottom,
                medium.down(46, if x.name.is_empty() { 2 } else { 3 }),
            )
            .build_cartesian_2d(x.clone(), y.clone())?;
        let line = if medium.is_terminal() { PAPER.mix(0.0) } else { GRID.to_rgba() };
        let mut mesh = chart.configure_mesh();
        mesh.bold_line_style(line).light_line_style(PAPER.mix(0.0)).axis_style(MUTED);
        mesh.label_style(medium.text_style(INK)).axis_desc_style(medium.text_style(INK));
        mesh.x_desc(x.name.clone());
        mesh.set_tick_mark_size(LabelAreaPosition::Bottom, medium.down(5, 0).max(2));
        mesh.set_tick_mark_size(LabelAreaPosition::Left, medium.across(5, 0).max(1));
        if !medium.is_terminal() {
            mesh.y_desc(y.name.clone());
        }
        match lines {
            GridLines::Both => {}
            GridLines::Vertical => drop(mesh.disable_y_mesh()),
            GridLines::Horizontal => drop(mesh.disable_x_mesh()),
        }
        mesh.draw()?;
        let area = PlotArea { chart, root: canvas.root, medium };
        if is_name_above {
            area.write(&y.name, (0, canvas.top), INK, HPos::Left)?;
        }
        Ok(area)
    }

    /// Returns the pixel of a position on the axes, from the upper left corner of the drawing.
    pub fn pixel(&self, x: f64, y: f64) -> (i32, i32) {
        self.chart.backend_coord(&(x, y))
    }

    /// Returns the left, upper, right and lower end of the area, px.
    pub fn bounds(&self) -> [i32; 4] {
        let (x, y) = self.chart.plotting_area().get_pixel_range();
        [x.start, y.start, x.end, y.end]
    }

    fn pixels(&self, points: &[(f64, f64)]) -> Vec<(i32, i32)> {
        points.iter().map(|(x, y)| self.pixel(*x, *y)).collect()
    }

    /// Draws a line through positions on the axes.
    ///
    /// # Errors
    /// Fails if the backend fails.
    pub fn line(&self, points: &[(f64, f64)], style: impl Into<ShapeStyle>) -> DrawResult<(), DB> {
        self.root.draw(&PathElement::new(self.pixels(points), style))
    }

    /// Draws the interval of a figure along `axis`, with a cap at the ends that lie within the
    /// axis. `at` returns the place of a position on the axis.
    ///
    /// # Errors
    /// Fails if the backend fails.
    pub fn interval(
        &self,
        axis: &Axis,
        figure: Figure,
        at: impl Fn(f64) -> (f64, f64),
        style: impl Into<ShapeStyle>,
    ) -> DrawResult<(), DB> {
        let (Some(low), Some(high)) = (figure.low, figure.high) else { return Ok(()) };
        let [a, b] = [low, high].map(|v| at(axis.clamped(v))).map(|(x, y)| self.pixel(x, y));
        let style = style.into();
        if a == b {
            return Ok(());
        }
        self.root.draw(&PathElement::new(vec![a, b], style))?;
        if self.medium.is_terminal() {
            return Ok(());
        }
        let (dx, dy) = if a.1 == b.1 { (0, CAP_PX) } else { (CAP_PX, 0) };
        for ((x, y), _) in [(a, low), (b, high)].into_iter().filter(|(_, v)| axis.contains(*v)) {
            self.root.draw(&PathElement::new(vec![(x - dx, y - dy), (x + dx, y + dy)], style))?;
        }
        Ok(())
    }

    /// Fills a polygon.
    ///
    /// # Errors
    /// Fails if the backend fails.
    pub fn polygon(
        &self,
        corners: &[(f64, f64)],
        style: impl Into<ShapeStyle>,
    ) -> DrawResult<(), DB> {
        self.root.draw(&Polygon::new(self.pixels(corners), style))
    }

    /// Draws a rectangle between two corners, px.
    ///
    /// # Errors
    /// Fails if the backend fails.
    pub fn rectangle(
        &self,
        [x0, y0, x1, y1]: [i32; 4],
        style: impl Into<ShapeStyle>,
    ) -> DrawResult<(), DB> {
        self.root.draw(&Rectangle::new([(x0, y0), (x1, y1)], style))
    }

    /// Draws a marker of `radius` px at a pixel; in a terminal a character.
    ///
    /// # Errors
    /// Fails if the backend fails.
    pub fn marker(
        &self,
        at: (i32, i32),
        radius: i32,
        fill: MarkerFill,
        color: RGBColor,
    ) -> DrawResult<(), DB> {
        if !self.medium.is_terminal() {
            return draw_marker(self.root, at, radius, fill, color);
        }
        let glyph = match fill {
            MarkerFill::Full => '●',
            MarkerFill::Half => '◐',
            MarkerFill::None => '○',
        };
        self.glyph(glyph, at, color)
    }

    /// Draws a character of a terminal.
    ///
    /// # Errors
    /// Fails if the backend fails.
    pub fn glyph(&self, glyph: char, at: (i32, i32), color: RGBColor) -> DrawResult<(), DB> {
        self.write(&glyph.to_string(), at, color, HPos::Left)
    }

    /// Draws text whose middle line goes through a pixel.
    ///
    /// # Errors
    /// Fails if the backend fails.
    pub fn write(
        &self,
        text: &str,
        at: (i32, i32),
        color: RGBColor,
        anchor: HPos,
    ) -> DrawResult<(), DB> {
        let style = self.medium.text_style(color).pos(Pos::new(anchor, VPos::Center));
        self.root.draw_text(text, &style, at)
    }
}

/// Draws a marker of a picture.
///
/// # Errors
/// Fails if the backend fails.
pub fn draw_marker<DB: DrawingBackend>(
    root: &DrawingArea<DB, Shift>,
    at: (i32, i32),
    radius: i32,
    fill: MarkerFill,
    color: RGBColor,
) -> DrawResult<(), DB> {
    if fill == MarkerFill::Full {
        return root.draw(&Circle::new(at, radius, color.filled()));
    }
    // A background, so that lines end at the circle.
    root.draw(&Circle::new(at, radius, PAPER.filled()))?;
    if fill == MarkerFill::Half {
        let along = |v: f64| (f64::from(radius) * v).round() as i32;
        let corner = |i: i32| {
            let (sin, cos) = (PI * (0.5 + f64::from(i) / 16.0)).sin_cos();
            (at.0 + along(cos), at.1 + along(sin))
        };
        root.draw(&Polygon::new((0..=16).map(corner).collect::<Vec<_>>(), color.filled()))?;
    }
    root.draw(&Circle::new(at, radius, color.stroke_width(2)))
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    /// Returns the nearest pixel, which is at most half a pixel off.
    fn map(&self, at: &f64, (begin, end): (i32, i32)) -> i32 {
        let part = (at - self.range.start) / (self.range.end - self.range.start);
        begin + (f64::from(end - begin) * part).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() {
            vec![]
        } else {
            self.ticks.iter().map(|tick| tick.at).collect()
        }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(at: &f64) -> String {
        number(*at)
    }

    /// Returns the label of the tick at a position. plotters passes positions of ticks only.
    fn format_ext(&self, at: &f64) -> String {
        let distance = |tick: &Tick| (tick.at - at).abs();
        let nearest = self.ticks.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map(|tick| tick.text.clone()).unwrap_or_default()
    }
}
