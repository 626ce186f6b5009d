//! An error study: its chart, its configurations, the best ones for every budget, and pictures.

use std::path::Path;

use maud::{Markup, html};

use super::figure::figure as chart_figure;
use super::pictures::{self, Png};
use super::provenance;
use super::table::{count, figure, remark_list, table, text, value};
use crate::error::Result;
use crate::measure::figure::Figure;
use crate::report::charts::error::{chart, error_of, front_numbers, metric_name, time_of};
use crate::report::charts::{number, sweep};
use crate::studies::error::blocks::TimeKind;
use crate::studies::error::front::Front;
use crate::studies::error::records::{Best, Budget, Configuration, Study};
use crate::studies::picture_error::PictureError;

/// File name of the reference's picture.
const REFERENCE_FILE: &str = "reference.png";

/// Caption of the chart of a knob.
const KNOBS: &str = "With 95 % intervals; lower is better. Point at a marker for its value.";

/// Returns the section of a study.
///
/// # Errors
/// Fails if the chart cannot be drawn or a picture cannot be read.
pub fn section(study: &Study, folder: &Path) -> Result<Markup> {
    let caption = "Lower is more accurate, left is faster. Bars are 95 % intervals. The line joins \
        the configurations that no other configuration beats in both time and error. Point at a \
        configuration, or step through them with the Tab key, to see its settings.";
    let knobs = sweep::charts_of_study(study);
    let knobs = knobs.iter().map(|c| chart_figure(c, KNOBS)).collect::<Result<Vec<_>>>()?;
    Ok(html! {
        (provenance::section(study)?)
        (reference(study))
        h3 { "Time against error" }
        (chart_figure(&chart(study), caption)?)
        @if !knobs.is_empty() {
            h3 { "Time and error by setting" }
            div class="panels" { @for chart in &knobs { (chart) } }
        }
        (configurations(study))
        (best(study))
        (gallery(study, folder)?)
    })
}

fn reference(study: &Study) -> Markup {
    let r = &study.reference;
    html! {
        h3 { "Reference" }
        dl class="made" {
            dt { "Reference" } dd {
                (r.against) ", frame " (r.frame) " at " (number(r.time_s)) " s, " (r.width) "×"
                (r.height) " pixels"
            }
            dt { "Known at" } dd {
                @if r.is_everywhere() { "every pixel" }
                @else { (r.n_pixels) " of " (r.n_all_pixels()) " pixels" }
            }
            dt { "Its own error" } dd {
                @if let Some(rmse) = r.own_error { (number(rmse)) " RMSE: " }
                @else { "no bound: " }
                (r.accuracy)
            }
            dt { "Magnitude" } dd { (number(r.magnitude)) ", root mean square" }
            dt { "Computed in" } dd {
                (number(r.seconds)) " s" @if r.from_cache { ", in an earlier run" }
            }
            dt { "Reference hash" } dd { code { (r.hash) } }
            dt { "Times" } dd { (study.rounds) " rounds of " (study.frames) " frames of every \
                configuration in turn" }
        }
    }
}

fn configurations(study: &Study) -> Markup {
    let row = |(c, number): (&Configuration, Option<usize>)| {
        vec![
            text(&study.label(c)),
            number.map_or_else(|| text(""), count),
            text(front_name(c.front)),
            figure(c.gpu_ms),
            figure(c.frame_ms),
            figure(c.by_base),
            figure(c.error.map(|e| e.rmse)),
            value(c.error.map(|e| e.max)),
            value(c.error.map(|e| e.relmse)),
            figure(c.error.and_then(|e| e.cloud)),
            text(&c.failure.clone().unwrap_or_else(|| remark(c.error).to_owned())),
        ]
    };
    let rows = study.configurations.iter().zip(front_numbers(study)).map(row);
    let header = [
        "configuration",
        "№",
        "front",
        "GPU, ms",
        "frame, ms",
        "by the scene's",
        "RMSE",
        "max",
        "relMSE",
        "of cloud",
        "remark",
    ];
    let decides = if study.time == TimeKind::Gpu { "GPU time" } else { "frame time" };
    let caption = format!(
        "Every configuration with 95 % intervals; {decides} and {} determine the front; № is the \
         number in the chart",
        metric_name(study.metric)
    );
    html! {
        (table(&caption, &header, rows))
        @if let Some(line) = study.base_line() { p class="why" { (line) } }
    }
}

fn front_name(front: Front) -> &'static str {
    match front {
        Front::On => "on",
        Front::Near => "near",
        Front::Off => "off",
        Front::Unknown => "—",
    }
}

fn remark(error: Option<PictureError>) -> &'static str {
    match error {
        Some(error) if !error.is_resolved => "not resolved: below the reference's own error",
        _ => "",
    }
}

fn best(study: &Study) -> Markup {
    let row = |b: &Best| {
        let found = b.configuration.and_then(|i| study.configurations.get(i));
        let unit = match b.budget {
            Budget::Ms => " ms".to_owned(),
            Budget::Error => format!(" {}", metric_name(study.metric)),
        };
        vec![
            text(&format!("at most {}{unit}", number(b.value))),
            text(&found.map_or("none".to_owned(), |c| study.label(c))),
            figure(found.and_then(|c| time_of(study, c))),
            figure(found.and_then(|c| error_of(study, c))),
        ]
    };
    let header = ["budget", "best", "time, ms", "error"];
    table("The best configuration for every budget", &header, study.best.iter().map(row))
}

fn gallery(study: &Study, folder: &Path) -> Result<Markup> {
    let read = |name: &Option<String>| match name {
        Some(name) => Png::read(folder, name),
        None => Ok(None),
    };
    let reference = Png::read(folder, REFERENCE_FILE)?;
    let reference_caption = if study.reference.is_everywhere() {
        "the reference"
    } else {
        "the reference: every cell has the colour of its computed pixel"
    };
    let mut shown = Vec::new();
    for c in &study.configurations {
        let (picture, map) = (read(&c.picture)?, read(&c.error_map)?);
        let name = study.label(c);
        let map = map.map(|map| {
            map.figure(&format!("Difference of {name} from the reference"), "difference")
        });
        let error = error_of(study, c).map_or(String::new(), |e: Figure| {
            format!(", {} {}", metric_name(study.metric), number(e.value))
        });
        match (picture, &reference) {
            (Some(picture), Some(reference)) => {
                // The page embeds the reference once, and the script shows it in every slider.
                let caption = format!("{name}{error}");
                shown.push(html! {
                    div
                        class="pair against-reference"
                        data-label=(name)
                        data-width=(reference.width)
                    {
                        (picture.figure(&caption, &caption))
                        @if let Some(map) = &map { (map) }
                    }
                });
            }
            (Some(picture), None) => shown.push(html! {
                div class="pair" {
                    (picture.figure(&name, &name))
                    @if let Some(map) = &map { (map) }
                }
            }),
            (None, _) => shown.extend(map),
        }
    }
    Ok(html! {
        @if reference.is_some() || !shown.is_empty() { h3 { "Pictures" } }
        @if let Some(reference) = &reference {
            div class="reference" { (reference.figure("The reference", reference_caption)) }
        }
        @for pair in &shown { (pair) }
    })
}

/// Compares the configurations that two studies have in common.
///
/// # Errors
/// Fails if a picture cannot be read.
pub fn comparison(a: &Study, b: &Study, [folder_a, folder_b]: [&Path; 2]) -> Result<Markup> {
    let remarks: Vec<String> = [
        ("scenes", a.made.scene_hash != b.made.scene_hash),
        ("references", a.reference.hash != b.reference.hash),
        ("devices", a.made.device != b.made.device),
        ("metrics", a.metric != b.metric),
        ("times", a.time != b.time),
    ]
    .into_iter()
    .filter(|(_, differs)| *differs)
    .map(|(what, _)| format!("A and B have different {what}: compare with care"))
    .collect();
    let both = || {
        a.configurations
            .iter()
            .filter_map(|of_a| Some((of_a, b.configurations.iter().find(|c| c.name == of_a.name)?)))
    };
    let row = |(of_a, of_b): (&Configuration, &Configuration)| {
        let times = time_of(a, of_a).zip(time_of(b, of_b));
        vec![
            text(&of_a.name),
            figure(time_of(a, of_a)),
            figure(time_of(b, of_b)),
            value(times.filter(|(a, _)| a.value > 0.0).map(|(a, b)| b.value / a.value)),
            figure(error_of(a, of_a)),
            figure(error_of(b, of_b)),
            text(&format!("{} / {}", front_name(of_a.front), front_name(of_b.front))),
        ]
    };
    let mut shown = Vec::new();
    for (of_a, of_b) in both() {
        if let (Some(name_a), Some(name_b)) = (&of_a.picture, &of_b.picture) {
            shown.extend(pictures::comparison(
                &of_a.name,
                [(folder_a, name_a), (folder_b, name_b)],
            )?);
        }
    }
    let header =
        ["configuration", "A, ms", "B, ms", "B / A", "A, error", "B, error", "front in A / B"];
    Ok(html! {
        (remark_list(&remarks))
        @if both().next().is_none() { p { "A and B have no configuration in common." } }
        (table("Configurations in common", &header, both().map(row)))
        @for pair in &shown { (pair) }
    })
}
