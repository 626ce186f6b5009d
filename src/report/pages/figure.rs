//! Charts as figures of a page, with colours for light and dark pages.

use std::fmt::Write as _;

use maud::{Markup, PreEscaped, html};

use crate::error::Result;
use crate::report::charts::{Chart, NEUTRAL_COLORS, SERIES_COLORS, ThemeColor};

/// Returns a chart with a caption.
///
/// # Errors
/// Fails if plotters cannot draw the chart.
pub fn figure(chart: &impl Chart, caption: &str) -> Result<Markup> {
    let svg = chart.svg(chart.size())?;
    Ok(html! { figure class="chart" { (PreEscaped(svg)) figcaption { (caption) } } })
}

/// Returns style rules that replace the charts' colours by variables, so that a dark page has its
/// own. Style rules take precedence over the colour attributes of SVG elements.
pub fn color_rules() -> String {
    let hex = |s: &ThemeColor| format!("#{:02X}{:02X}{:02X}", s.light.0, s.light.1, s.light.2);
    let (mut light, mut dark, mut rules) = (String::new(), String::new(), String::new());
    for (i, color) in SERIES_COLORS.iter().chain(&NEUTRAL_COLORS).enumerate() {
        let hex = hex(color);
        let _ = write!(light, "--c{i}:{hex};");
        let _ = write!(dark, "--c{i}:{};", color.dark);
        for attribute in ["fill", "stroke"] {
            let _ = write!(rules, ".chart [{attribute}=\"{hex}\"]{{{attribute}:var(--c{i})}}");
        }
    }
    format!(
        ":root{{{light}}}@media (prefers-color-scheme:dark){{:root{{{dark}}}}}\
         @media print{{:root{{{light}}}}}{rules}"
    )
}
