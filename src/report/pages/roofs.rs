//! The least work of passes, and the share of the device's roof that they reach.

use maud::{Markup, html};

use super::table::{ms, percent, table, text, value};
use crate::report::charts::number;
use crate::timing::records::{Case, Mode, Pass, Run};
use crate::timing::still::marked_name;

/// Returns a warning if caches were made cold before each pass.
pub fn cold(run: &Run) -> Markup {
    let Some(bytes) = run.cold_bytes else { return html! {} };
    html! {
        p class="warning" {
            strong { "Cold caches" } ": the device wrote " (number((bytes >> 20) as f64))
            " MiB before each pass. Times of passes are those of data from memory. Times of frames "
            "contain these writes and are no figure."
        }
    }
}

/// Returns the table of passes with their least work; nothing if no floor is known.
pub fn section(run: &Run) -> Markup {
    let millions = |of: Option<f64>| value(of.map(|v| 1e-6 * v));
    let row = |case: &Case, mode: &Mode, pass: &Pass| {
        vec![
            text(&pass.name),
            text(&marked_name(case, mode)),
            ms(pass.p50_ms),
            millions(pass.bytes),
            millions(pass.operations),
            percent(pass.roof_share),
        ]
    };
    let rows: Vec<_> = run
        .modes()
        .flat_map(|(case, mode)| {
            let known = mode.passes.iter().filter(|p| p.bytes.is_some() && p.p50_ms.is_some());
            known.map(move |pass| row(case, mode, pass))
        })
        .collect();
    if rows.is_empty() {
        return html! {};
    }
    let header = ["pass", "case and loop", "p50, ms", "least MB", "least Mop", "of the roof"];
    let caption = "The least work of the last frame, and the share of the roof that p50 reaches";
    html! {
        h3 { "How near the floor" }
        p {
            @match &run.ceilings {
                Some(of) => {
                    "The roof is what the device did at most when it was measured (" (of.date)
                    "): " (number(1e-9 * of.operations_per_s)) " G operations on 32-bit floats a "
                    "second, and"
                    @for band in &of.bandwidths {
                        " " (number(1e-9 * band.bytes_per_s)) " GB/s of "
                        (number(band.set_bytes as f64 / f64::from(1 << 20))) " MiB"
                    }
                    "."
                }
                None => {
                    "The device's roofs were not known: " code { "nimbus devices --roof" }
                    " measures them."
                }
            }
        }
        (table(caption, &header, rows))
    }
}
