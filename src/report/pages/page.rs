//! The page: its head, contents and sections.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::figure::color_rules;
use super::source::{Results, Source, comparable_pairs};
use super::{bench, comparison, error, ledger};
use crate::error::Result;
use crate::io::plain_text::plain_markup;
use crate::report::charts::passes::PassColors;
use crate::timing::records::Run;

/// Style sheet, embedded so that the page needs no other file.
const STYLE: &str = include_str!("page.css");
/// Script, embedded like the style sheet.
const SCRIPT: &str = include_str!("page.js");

/// A content security policy that forbids loading anything.
const POLICY: &str =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// Returns the HTML page of results in their order. Further benches and studies are compared with
/// the first of their kind.
///
/// # Errors
/// Fails if a picture of the results cannot be read.
pub fn page(sources: &[Source]) -> Result<String> {
    let mut sections = Vec::new();
    let colors = PassColors::of(sources.iter().filter_map(run_of));
    for (i, source) in sources.iter().enumerate() {
        let (kind, markup) = section(source, &colors)?;
        sections.push((format!("{kind}: {}", source.name), format!("run-{i}"), markup));
    }
    for (i, (a, b)) in comparable_pairs(sources).into_iter().enumerate() {
        sections.push((
            format!("{} against {}", b.name, a.name),
            format!("versus-{i}"),
            comparison::section(a, b)?,
        ));
    }
    let title = sources.iter().map(|s| s.name.as_str()).collect::<Vec<_>>().join(", ");
    Ok(document("nimbus report", &title, &sections))
}

/// Returns the HTML of a page with its sections, each with its name, its anchor and its content.
pub(super) fn document(
    heading: &str,
    title: &str,
    sections: &[(String, String, Markup)],
) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="color-scheme" content="light dark";
                title { "nimbus: " (title) }
                style { (PreEscaped(color_rules())) (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { (heading) }
                    @if sections.len() > 1 {
                        nav aria-label="Contents" { ul {
                            @for (name, id, _) in sections {
                                li { a href={ "#" (id) } { (name) } }
                            }
                        } }
                    }
                }
                main {
                    @for (name, id, markup) in sections {
                        section id=(id) aria-labelledby={ (id) "-title" } {
                            h2 id={ (id) "-title" } { (name) }
                            (markup)
                        }
                    }
                }
                footer { p { "Made by nimbus " (env!("CARGO_PKG_VERSION")) "." } }
                div id="hint" role="tooltip" hidden {}
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    plain_markup(&markup.into_string()).into_owned()
}

fn run_of(source: &Source) -> Option<&Run> {
    match &source.results {
        Results::Bench(recorded) => Some(&recorded.run),
        Results::Study(_) | Results::Ledger(_) => None,
    }
}

fn section(source: &Source, colors: &PassColors) -> Result<(&'static str, Markup)> {
    Ok(match &source.results {
        Results::Bench(recorded) => ("Bench", bench::section(recorded, &source.folder, colors)?),
        Results::Study(study) => ("Time against error", error::section(study, &source.folder)?),
        Results::Ledger(ledger) => ("Ledger", ledger::section(ledger)?),
    })
}
