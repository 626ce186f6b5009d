//! Two axes, and what every chart draws between them.

use plotters::chart::ChartContext;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::Place;
use super::axis::Axis;
use super::look::{GRID, INK, Look, MUTED, PAPER};

pub struct Plane<'a, DB: DrawingBackend> {
    chart: ChartContext<'a, DB, Cartesian2d<Axis, Axis>>,
    root: &'a DrawingArea<DB, plotters::coord::Shift>,
    pub look: Look,
}

/// Which lines are drawn behind the chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Behind {
    Both,
    /// Only those that rise from the x axis, for rows.
    Vertical,
    /// Only those that start at the y axis.
    Horizontal,
}

/// Half of what is drawn across an interval's end.
const FOOT_PX: i32 = 3;

/// How a point is marked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fill {
    Full,
    Half,
    None,
}

impl<'a, DB: DrawingBackend> Plane<'a, DB> {
    /// Draws the axes.
    pub fn new(
        place: &Place<'a, DB>,
        x: &Axis,
        y: &Axis,
        behind: Behind,
    ) -> DrawResult<Plane<'a, DB>, DB> {
        let look = place.look;
        let widest = y.ticks.iter().map(|t| look.width_of(&t.text)).max().unwrap_or(0);
        // Beside the ticks' text: the tick, and the axis' name, which is written upwards in a
        // picture.
        let left = widest + look.across(if y.name.is_empty() { 22 } else { 40 }, 1);
        let name_above = look.characters && !y.name.is_empty();
        let top = place.top + if name_above { look.line_height() } else { look.down(6, 0) };
        let mut chart = ChartBuilder::on(place.root)
            .margin_top(top)
            .margin_bottom(place.bottom)
            .margin_right(look.across(18, 2))
            .margin_left(look.across(10, 0))
            .set_label_area_size(LabelAreaPosition::Left, left)
            .set_label_area_size(
                LabelAreaPosition::Bottom,
                look.down(46, if x.name.is_empty() { 2 } else { 3 }),
            )
            .build_cartesian_2d(x.clone(), y.clone())?;
        let line = if look.characters { PAPER.mix(0.0) } else { GRID.to_rgba() };
        let mut mesh = chart.configure_mesh();
        mesh.bold_line_style(line).light_line_style(PAPER.mix(0.0)).axis_style(MUTED);
        mesh.label_style(look.text(INK)).axis_desc_style(look.text(INK));
        mesh.x_desc(x.name.clone());
        mesh.set_tick_mark_size(LabelAreaPosition::Bottom, look.down(5, 0).max(2));
        mesh.set_tick_mark_size(LabelAreaPosition::Left, look.across(5, 0).max(1));
        if !look.characters {
            mesh.y_desc(y.name.clone());
        }
        match behind {
            Behind::Both => {}
            Behind::Vertical => drop(mesh.disable_y_mesh()),
            Behind::Horizontal => drop(mesh.disable_x_mesh()),
        }
        mesh.draw()?;
        let plane = Plane { chart, root: place.root, look };
        if name_above {
            plane.write(&y.name, (0, place.top), INK, HPos::Left)?;
        }
        Ok(plane)
    }

    /// px from the upper left corner of the whole.
    pub fn pixel(&self, x: f64, y: f64) -> (i32, i32) {
        self.chart.backend_coord(&(x, y))
    }

    /// Left, upper, right and lower end of what is between the axes, px.
    pub fn bounds(&self) -> [i32; 4] {
        let (x, y) = self.chart.plotting_area().get_pixel_range();
        [x.start, y.start, x.end, y.end]
    }

    /// A line through points of the axes' measures.
    pub fn line(&self, points: &[(f64, f64)], style: impl Into<ShapeStyle>) -> DrawResult<(), DB> {
        let pixels: Vec<(i32, i32)> = points.iter().map(|(x, y)| self.pixel(*x, *y)).collect();
        self.root.draw(&PathElement::new(pixels, style))
    }

    /// A line through points, px.
    pub fn line_px(
        &self,
        pixels: Vec<(i32, i32)>,
        style: impl Into<ShapeStyle>,
    ) -> DrawResult<(), DB> {
        self.root.draw(&PathElement::new(pixels, style))
    }

    /// A line from one place to another along x or along y, with a foot at either end that
    /// `has_foot`: where an interval goes on beyond the axis it has none.
    pub fn whisker(
        &self,
        [from, to]: [(f64, f64); 2],
        has_foot: [bool; 2],
        style: impl Into<ShapeStyle>,
    ) -> DrawResult<(), DB> {
        let (a, b) = (self.pixel(from.0, from.1), self.pixel(to.0, to.1));
        let style = style.into();
        if a == b {
            return Ok(());
        }
        self.line_px(vec![a, b], style)?;
        let (dx, dy) = if a.1 == b.1 { (0, FOOT_PX) } else { (FOOT_PX, 0) };
        for ((x, y), _) in
            [a, b].into_iter().zip(has_foot).filter(|(_, has)| *has && !self.look.characters)
        {
            self.line_px(vec![(x - dx, y - dy), (x + dx, y + dy)], style)?;
        }
        Ok(())
    }

    pub fn area(&self, corners: &[(f64, f64)], style: impl Into<ShapeStyle>) -> DrawResult<(), DB> {
        let pixels: Vec<(i32, i32)> = corners.iter().map(|(x, y)| self.pixel(*x, *y)).collect();
        self.root.draw(&Polygon::new(pixels, style))
    }

    /// From one corner to the other, px.
    pub fn rectangle(
        &self,
        [x0, y0, x1, y1]: [i32; 4],
        style: impl Into<ShapeStyle>,
    ) -> DrawResult<(), DB> {
        self.root.draw(&Rectangle::new([(x0, y0), (x1, y1)], style))
    }

    /// A mark of `radius` px; in a terminal a character, whatever the radius.
    pub fn point(
        &self,
        at: (i32, i32),
        radius: i32,
        fill: Fill,
        color: RGBColor,
    ) -> DrawResult<(), DB> {
        if self.look.characters {
            let glyph = match fill {
                Fill::Full => '●',
                Fill::Half => '◐',
                Fill::None => '○',
            };
            return self.glyph(glyph, at, color);
        }
        marker(self.root, at, radius, fill, color)
    }

    /// A character at a point of a terminal.
    pub fn glyph(&self, glyph: char, at: (i32, i32), color: RGBColor) -> DrawResult<(), DB> {
        self.write(&glyph.to_string(), at, color, HPos::Left)
    }

    /// Text whose middle line is at a point, px; in a terminal in its row.
    pub fn write(
        &self,
        text: &str,
        at: (i32, i32),
        color: RGBColor,
        anchor: HPos,
    ) -> DrawResult<(), DB> {
        self.root.draw_text(text, &self.look.text(color).pos(Pos::new(anchor, VPos::Center)), at)
    }
}

/// A mark of a picture.
pub fn marker<DB: DrawingBackend>(
    on: &DrawingArea<DB, plotters::coord::Shift>,
    at: (i32, i32),
    radius: i32,
    fill: Fill,
    color: RGBColor,
) -> DrawResult<(), DB> {
    if fill == Fill::Full {
        return on.draw(&Circle::new(at, radius, color.filled()));
    }
    // Its own paper, so that lines end at it.
    on.draw(&Circle::new(at, radius, PAPER.filled()))?;
    if fill == Fill::Half {
        let angles = (0..=16).map(|i| std::f64::consts::PI * (0.5 + f64::from(i) / 16.0));
        let along = |v: f64| (f64::from(radius) * v).round() as i32;
        let half =
            angles.map(|a| (at.0 + along(a.cos()), at.1 + along(a.sin()))).collect::<Vec<_>>();
        on.draw(&Polygon::new(half, color.filled()))?;
    }
    on.draw(&Circle::new(at, radius, color.stroke_width(2)))
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    /// The nearest pixel, so that a value is off by half of one at most.
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

    fn range(&self) -> std::ops::Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(at: &f64) -> String {
        super::number::number(*at)
    }

    /// What the tick nearest to a place says: the axis is handed back the place it told.
    fn format_ext(&self, at: &f64) -> String {
        let nearest =
            self.ticks.iter().min_by(|a, b| (a.at - at).abs().total_cmp(&(b.at - at).abs()));
        nearest.map(|tick| tick.text.clone()).unwrap_or_default()
    }
}
