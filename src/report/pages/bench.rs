//! A bench: tables and charts of its times, and the last frame of every case.

use std::path::Path;

use maud::{Markup, html};

use super::figure::figure;
use super::pictures::Png;
use super::table::{Cell, count, median, ms, percent, table, text, value};
use super::{provenance, roofs};
use crate::error::Result;
use crate::report::charts::passes::PassColors;
use crate::report::charts::{frames, number, passes, sweep, with_interval};
use crate::timing::attachments::picture_file;
use crate::timing::records::{Case, Measured, Mode, PartRecord, Pass, Run};
use crate::timing::results::BenchResults;
use crate::timing::state::{RunState, Spread, run_line};
use crate::timing::still::{NO_RATIO, StillRemark, marked_name, skipped_text};

/// Returns the name of a case.
pub fn case_name(case: &Case) -> String {
    let name = case.name();
    if name.is_empty() { "the scene".to_owned() } else { name }
}

/// Returns the section of a bench, with the colours that passes have on the page.
///
/// # Errors
/// Fails if a chart cannot be drawn or a picture cannot be read.
pub fn section(results: &BenchResults, folder: &Path, colors: &PassColors) -> Result<Markup> {
    let run = &results.run;
    let mut charts = Vec::new();
    for frames in frames::charts_of(results) {
        let caption = "Time from the end of one frame to the end of the next; lower is better.";
        charts.push(figure(&frames, caption)?);
    }
    let sweep = sweep::charts_of_run(run);
    let sweep = sweep.iter().map(|chart| figure(chart, SWEEP)).collect::<Result<Vec<_>>>()?;
    let passes = passes::chart(run, colors)
        .map(|passes| figure(&passes, "GPU time of every pass; shorter is better."))
        .transpose()?;
    let mut pictures = Vec::new();
    for (i, case) in run.cases.iter().enumerate() {
        let caption = format!("The last frame of {}", case_name(case));
        let png = Png::read(folder, &picture_file(i))?;
        pictures.extend(png.map(|png| png.figure(&caption, &caption)));
    }
    Ok(html! {
        (provenance::section(run)?)
        @if !run.chosen.is_empty() {
            h3 { "Values chosen for \"auto\"" }
            ul { @for chosen in &run.chosen { li { (chosen) } } }
        }
        @if !run.parts.is_empty() { h3 { "Parts" } (parts(run)) }
        @if !pictures.is_empty() {
            h3 { "Pictures" }
            div class="gallery" { @for picture in &pictures { (picture) } }
        }
        (roofs::cold(run))
        (still(run))
        @if !sweep.is_empty() {
            h3 { "Times against the swept keys" }
            div class="panels" { @for chart in &sweep { (chart) } }
            @if let Some(text) = skipped_text(run) { p class="why" { (sentence(&text)) } }
        }
        h3 { "Frames" }
        (loops(run))
        (charts_of_frames(&charts))
        (cases(run))
        h3 { "Passes" }
        @match &passes {
            Some(passes) => { (passes) }
            None => {
                p { "No pass was timed: the device has no timestamps, or they were turned off." }
            }
        }
        (pass_table(run))
        (state(run))
        (roofs::section(run))
    })
}

/// Caption of a chart of a sweep.
const SWEEP: &str =
    "Medians with 95 % intervals; lower is better. Point at a marker for its value.";

/// Returns the charts of frames; those of many points of a sweep are folded.
fn charts_of_frames(charts: &[Markup]) -> Markup {
    /// Most charts that are not folded. More belong to a sweep, which has a chart of its own.
    const MOST_UNFOLDED: usize = 2;
    html! {
        @if charts.len() <= MOST_UNFOLDED {
            @for chart in charts { (chart) }
        } @else {
            details {
                summary {
                    "Time of each frame: " (charts.len()) " charts, one for each point of the sweep"
                }
                @for chart in charts { (chart) }
            }
        }
    }
}

/// Returns a remark of a table as a sentence of a page.
fn sentence(remark: &str) -> String {
    let mut rest = remark.chars();
    let first = rest.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", rest.as_str())
}

/// Returns a warning about cases in which nothing moves.
fn still(run: &Run) -> Markup {
    let Some(remark) = StillRemark::of(run) else { return html! {} };
    let StillRemark { scope, reason, figure, advice } = remark;
    html! {
        p class="warning" {
            strong { "Nothing moves" } (scope) ": " (reason) " " (figure) " " (advice)
        }
    }
}

fn loops(run: &Run) -> Markup {
    let row = |(case, mode): (&Case, &Mode)| {
        let of = |m: Option<Measured>| m.map(|m| m.of);
        vec![
            text(&marked_name(case, mode)),
            count(mode.frames),
            median(mode.frame_ms),
            ms(of(mode.frame_ms).map(|s| s.p95)),
            ms(of(mode.frame_ms).map(|s| s.p99)),
            ms(of(mode.frame_ms).map(|s| s.max)),
            median(mode.game_ms),
            median(mode.render_ms),
            median(mode.gpu_ms),
            median(mode.latency_ms),
            value(mode.frame_lows.map(|l| l.slowest_mean_fps)),
        ]
    };
    let header = [
        "case and loop",
        "frames",
        "frame p50, ms",
        "p95",
        "p99",
        "max",
        "game p50, ms",
        "render p50, ms",
        "GPU p50, ms",
        "latency p50, ms",
        "1 % low, frames/s",
    ];
    let caption =
        "Every loop: medians with their 95 % intervals; \"1 % low\" is the mean of the slowest 1 %";
    let modes = run.cases.iter().flat_map(|case| case.figure_first().map(move |mode| (case, mode)));
    table(caption, &header, modes.map(row))
}

/// Returns the nodes of a distributed sweep, with the times of the first case on each.
fn parts(run: &Run) -> Markup {
    let row = |part: &PartRecord| -> Vec<Cell> {
        let times = part.base.iter().map(|base| ms(base.p50_ms));
        [text(&format!("{}..{}", part.first, part.end)), text(&part.node), text(&part.date)]
            .into_iter()
            .chain(times)
            .collect()
    };
    let loops: Vec<String> = run
        .parts
        .iter()
        .take(1)
        .flat_map(|part| part.base.iter().map(|base| format!("{}, ms", base.name())))
        .collect();
    let header: Vec<&str> =
        ["cases", "node", "begun"].into_iter().chain(loops.iter().map(String::as_str)).collect();
    let caption =
        "The nodes that timed the cases, with the median frame time of the first case on each";
    table(caption, &header, run.parts.iter().map(row))
}

/// Text of a cell for a case in which nothing moves.
const NOT_GIVEN: &str = "not given";

/// Returns the error of a case's picture, or why there is none.
fn error(case: &Case) -> Cell {
    let Some(check) = &case.check else { return text("—") };
    let reason = check.reason.as_deref().unwrap_or_default();
    let rmse = check.rmse.map(|r| with_interval(r.value, r.low, r.high));
    text(&match (check.is_wrong(), rmse) {
        (true, _) => format!("WRONG: {reason}"),
        (false, Some(rmse)) if reason.is_empty() => rmse,
        (false, Some(rmse)) => format!("{rmse}; {reason}"),
        (false, None) => format!("not checked: {reason}"),
    })
}

/// Returns the cases, with the error of their pictures and the gain from overlap and from skipping.
fn cases(run: &Run) -> Markup {
    let row = |case: &Case| {
        let ratio = case.ratio.map(|r| with_interval(r.parallel_by_serial, r.low, r.high));
        let (mut ratio, mut bound) =
            (text(ratio.as_deref().unwrap_or("—")), ms(case.overlap.as_ref().map(|o| o.bound_ms)));
        if case.is_still() {
            (ratio, bound) = (text(NOT_GIVEN), text(NOT_GIVEN));
        }
        let skipping = case.skipping;
        vec![
            text(&case_name(case)),
            count(case.particles as usize),
            text(&format!("{}×{}", case.width, case.height)),
            error(case),
            ratio,
            bound,
            ms(skipping.map(|s| s.gpu_ms)),
            ms(skipping.map(|s| s.gpu_no_skip_ms)),
            text(match skipping.and_then(|s| s.same_bytes) {
                Some(true) => "yes",
                Some(false) => "no",
                None => "—",
            }),
        ]
    };
    let header = [
        "case",
        "particles",
        "pixels",
        "RMSE against f64",
        "parallel / serial",
        "best of overlap, ms",
        "GPU mean, ms",
        "without skipping, ms",
        "same picture, to the byte",
    ];
    let caption =
        "The cases, with the error of their pictures and the gain from overlap and from skipping";
    html! {
        (table(caption, &header, run.cases.iter().map(row)))
        @if run.cases.iter().any(Case::is_still) { p class="why" { (NOT_GIVEN) ": " (NO_RATIO) } }
    }
}

/// Returns the state of the machine during the run, and of the cases if there are several.
fn state(run: &Run) -> Markup {
    let sentences = |state: &RunState, of: &str| {
        let readings = run_line(state);
        let readings = readings.trim_start_matches("state: ").trim_end();
        html! {
            p class="why" { (of) (sentence(readings)) }
            @if !state.remarks.is_empty() {
                ul class="warning" { @for remark in &state.remarks { li { (sentence(remark)) } } }
            }
        }
    };
    let parts = run.parts.iter().filter_map(|part| Some((part, part.state.as_ref()?)));
    let parts: Vec<(&PartRecord, &RunState)> = parts.collect();
    if run.state.is_none() && parts.is_empty() {
        return html! {};
    }
    html! {
        h3 { "State of the machine" }
        @if let Some(state) = &run.state { (sentences(state, "")) }
        @for (part, state) in parts {
            (sentences(state, &format!("Cases {}..{} on {}: ", part.first, part.end, part.node)))
        }
        (state_table(run))
    }
}

fn state_table(run: &Run) -> Markup {
    let median = |spread: Option<Spread>| value(spread.map(|s| s.median));
    let mib = |bytes: Option<u64>| value(bytes.map(|bytes| bytes as f64 / f64::from(1 << 20)));
    let row = |case: &Case| {
        let state = case.state.as_ref()?;
        let throttle = state.throttle.as_ref().map(|all| {
            all.iter().map(|c| format!("{} ({})", c.reason, c.n)).collect::<Vec<_>>().join("; ")
        });
        Some(vec![
            text(&case_name(case)),
            median(state.gpu_mhz),
            median(state.gpu_memory_mhz),
            median(state.gpu_c),
            median(state.gpu_w),
            median(state.cpu_mhz),
            mib(state.peak_own_bytes),
            mib(state.peak_process_bytes),
            percent(state.others_share),
            count(state.n_slow_clock + state.n_slowdown),
            count(state.n_discarded),
            text(throttle.as_deref().unwrap_or("—")),
        ])
    };
    let header = [
        "case",
        "GPU, MHz",
        "GPU memory, MHz",
        "GPU, °C",
        "GPU, W",
        "processor, MHz",
        "most device memory of nimbus, MiB",
        "of the process, MiB",
        "other processes",
        "throttled frames",
        "left out",
        "throttled by (readings)",
    ];
    let caption = "The state of the machine while the timed frames of each case ran: medians";
    table(caption, &header, run.cases.iter().filter_map(row))
}

fn pass_table(run: &Run) -> Markup {
    let row = |case: &Case, mode: &Mode, pass: &Pass| {
        let reasons = pass.reasons.iter().map(|r| format!("{} ({})", r.reason, number(r.n as f64)));
        vec![
            text(&pass.name),
            text(&marked_name(case, mode)),
            ms(pass.p50_ms),
            ms(passes::ms_of_frame(pass)),
            percent(pass.share),
            count(pass.n_run),
            count(pass.n_skipped),
            ms(pass.saved_ms),
            text(&reasons.collect::<Vec<_>>().join("; ")),
        ]
    };
    let rows = run.modes().flat_map(|(case, mode)| {
        let shown = mode.passes.iter().filter(|p| p.n_run > 0 || p.lacks_work());
        shown.map(move |pass| row(case, mode, pass))
    });
    let header = [
        "pass",
        "case and loop",
        "p50, ms",
        "of a frame, ms",
        "share",
        "ran",
        "skipped",
        "saved, ms",
        "why skipped (frames)",
    ];
    table("Passes that ran, or whose work was skipped", &header, rows)
}
