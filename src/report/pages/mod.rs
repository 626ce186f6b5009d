//! Results as one HTML page that needs nothing else: no network, no font, no file beside it. Tables
//! say everything; the script adds only what is done with a pointer: hints, sliders, sorting.

mod bench;
mod ledger;
mod pictures;
mod provenance;
pub mod source;
mod table;
mod tradeoff;
mod versus;

use std::fmt::Write as _;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::error::Result;
use crate::report::charts::Plot;
use crate::report::charts::look::{PLAIN, SERIES, Shade};
use source::{Found, Source};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Nothing may be loaded, from anywhere.
const POLICY: &str =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// The page of `sources`, in their order; later benches and studies are compared with the first of
/// their kind.
pub fn page(sources: &[Source]) -> Result<String> {
    let mut sections = Vec::new();
    for (i, source) in sources.iter().enumerate() {
        sections.push((heading(source), format!("run-{i}"), section(source)?));
    }
    for (i, (a, b)) in source::pairs(sources).into_iter().enumerate() {
        sections.push((
            format!("{} against {}", b.name, a.name),
            format!("versus-{i}"),
            versus::section(a, b)?,
        ));
    }
    let title = sources.iter().map(|s| s.name.as_str()).collect::<Vec<_>>().join(", ");
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="color-scheme" content="light dark";
                title { "nimbus: " (title) }
                style { (PreEscaped(colors())) (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { "nimbus report" }
                    @if sections.len() > 1 {
                        nav aria-label="Contents" { ul { @for (name, id, _) in &sections { li { a href={ "#" (id) } { (name) } } } } }
                    }
                }
                main {
                    @for (name, id, markup) in &sections { section id=(id) aria-labelledby={ (id) "-title" } {
                        h2 id={ (id) "-title" } { (name) }
                        (markup)
                    } }
                }
                footer { p { "Made by nimbus " (env!("CARGO_PKG_VERSION")) "." } }
                div id="hint" role="tooltip" hidden {}
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    Ok(markup.into_string())
}

fn heading(source: &Source) -> String {
    let kind = match &source.found {
        Found::Bench(_) => "Bench",
        Found::Study(_) => "Time against error",
        Found::Ledger(_) => "Ledger",
    };
    format!("{kind}: {}", source.name)
}

fn section(source: &Source) -> Result<Markup> {
    match &source.found {
        Found::Bench(recorded) => bench::section(recorded, &source.folder),
        Found::Study(study) => tradeoff::section(study, &source.folder),
        Found::Ledger(ledger) => ledger::section(ledger),
    }
}

/// A chart and what is said of it.
fn chart(plot: &impl Plot, caption: &str) -> Result<Markup> {
    let svg = plot.svg(plot.size())?;
    Ok(html! { figure class="chart" { (PreEscaped(svg)) figcaption { (caption) } } })
}

/// The colours that charts are drawn in as variables, so that a dark page has its own. A rule is
/// stronger than an attribute.
fn colors() -> String {
    let all = || SERIES.iter().chain(&PLAIN).enumerate();
    let hex = |s: &Shade| format!("#{:02X}{:02X}{:02X}", s.light.0, s.light.1, s.light.2);
    let variables = |of: &dyn Fn(&Shade) -> String| {
        all().fold(String::new(), |mut text, (i, shade)| {
            let _ = write!(text, "--c{i}:{};", of(shade));
            text
        })
    };
    let rules = all().fold(String::new(), |mut text, (i, shade)| {
        let hex = hex(shade);
        let _ = write!(
            text,
            ".chart [fill=\"{hex}\"]{{fill:var(--c{i})}}.chart \
                [stroke=\"{hex}\"]{{stroke:var(--c{i})}}"
        );
        text
    });
    format!(
        ":root{{{}}}@media (prefers-color-scheme:dark){{:root{{{}}}}}@media \
         print{{:root{{{}}}}}{rules}",
        variables(&hex),
        variables(&|s| s.dark.to_owned()),
        variables(&hex)
    )
}
