//! Positions of a chart's elements, read back from its SVG.

#![allow(dead_code, reason = "each test binary uses its own part")]

use nimbus::report::charts::Chart;
use roxmltree::{Document, Node};

/// Tolerance of positions, px: half a pixel of rounding of the point and of the tick.
pub const PX: f64 = 1.01;

/// Returns a numeric attribute.
pub fn number(node: Node, name: &str) -> f64 {
    node.attribute(name)
        .and_then(|v| v.parse().ok())
        .unwrap_or_else(|| panic!("{name} of {node:?}"))
}

/// Returns the text of an element.
pub fn text(node: Node) -> String {
    node.text().unwrap_or_default().trim().to_owned()
}

/// Returns all elements of a name.
pub fn elements<'a>(doc: &'a Document, tag: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    doc.descendants().filter(move |n| n.has_tag_name(tag))
}

/// The axes of a chart, derived from its outermost ticks: value, or decimal logarithm, and px.
pub struct Axes {
    pub x: [(f64, f64); 2],
    pub y: [(f64, f64); 2],
}

/// Parses the label of a tick, such as "2×10⁻⁴".
pub fn value(text: &str) -> Option<f64> {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let (mantissa, power) = match text.split_once("10").filter(|(m, rest)| {
        (m.is_empty() || m.ends_with('×')) && rest.starts_with(|c| c == '⁻' || DIGITS.contains(&c))
    }) {
        Some((mantissa, power)) => (mantissa.trim_end_matches('×'), power),
        None => return text.parse().ok(),
    };
    let digit = |c: char| {
        DIGITS.iter().position(|d| *d == c).map(|i| char::from(b'0' + i as u8)).unwrap_or('-')
    };
    let power: i32 = power.chars().map(digit).collect::<String>().parse().ok()?;
    let mantissa = if mantissa.is_empty() { 1.0 } else { mantissa.parse::<f64>().ok()? };
    Some(mantissa * 10f64.powi(power))
}

impl Axes {
    /// Reads the ticks of a document; `scale` converts values to positions.
    pub fn of(doc: &Document, scale: [fn(f64) -> f64; 2]) -> Axes {
        let ticks = |is_x: bool| -> Vec<(f64, f64)> {
            // Labels of the x axis are below their tick (0.76em), those of y to the left.
            let is_tick = |n: &Node| match is_x {
                true => {
                    n.attribute("text-anchor") == Some("middle")
                        && n.attribute("dy") == Some("0.76em")
                        && n.attribute("transform").is_none()
                }
                false => n.attribute("text-anchor") == Some("end"),
            };
            let at = |n: Node| Some((value(&text(n))?, number(n, if is_x { "x" } else { "y" })));
            elements(doc, "text").filter(is_tick).filter_map(at).collect()
        };
        let ends = |ticks: Vec<(f64, f64)>, scale: fn(f64) -> f64| {
            let ticks: Vec<(f64, f64)> = ticks
                .into_iter()
                .map(|(v, px)| (scale(v), px))
                .filter(|(v, _)| v.is_finite())
                .collect();
            assert!(ticks.len() >= 2, "{ticks:?}");
            [ticks[0], ticks[ticks.len() - 1]]
        };
        Axes { x: ends(ticks(true), scale[0]), y: ends(ticks(false), scale[1]) }
    }

    /// Returns the pixel of a position.
    pub fn px(of: [(f64, f64); 2], v: f64) -> f64 {
        of[0].1 + (v - of[0].0) / (of[1].0 - of[0].0) * (of[1].1 - of[0].1)
    }

    /// Returns the pixel of two values on logarithmic axes.
    pub fn log(&self, x: f64, y: f64) -> (f64, f64) {
        (Self::px(self.x, x.log10()), Self::px(self.y, y.log10()))
    }
}

/// Reads logarithmic axes.
pub fn log_axes(doc: &Document) -> Axes {
    Axes::of(doc, [f64::log10, f64::log10])
}

/// Draws a chart at its preferred size.
pub fn draw(chart: &impl Chart) -> String {
    chart.svg(chart.size()).expect("a chart")
}

/// Parses an SVG document.
pub fn parse(svg: &str) -> Document<'_> {
    Document::parse(svg).unwrap_or_else(|e| panic!("{e}\n{svg}"))
}

/// Returns the centres and the texts of all tooltips.
pub fn tooltips(doc: &Document) -> Vec<((f64, f64), String)> {
    let of = |group: Node| {
        let rect = group.children().find(|n| n.has_tag_name("rect")).expect("a place to point at");
        let middle = |at, size| number(rect, at) + number(rect, size) / 2.0;
        (
            (middle("x", "width"), middle("y", "height")),
            group.attribute("aria-label").expect("a name").to_owned(),
        )
    };
    elements(doc, "g").filter(|n| n.attribute("class") == Some("mark")).map(of).collect()
}

/// Returns the points of a polyline or polygon.
pub fn points(line: Node) -> Vec<(f64, f64)> {
    let pairs = line.attribute("points").expect("points").split_whitespace();
    let pair =
        |p: &str| p.split_once(',').and_then(|(x, y)| Some((x.parse().ok()?, y.parse().ok()?)));
    pairs.map(|p| pair(p).expect("a point")).collect()
}
