//! `nimbus compare A B`.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::json;

use super::args::CompareArgs;
use super::compare_sides::{allowed, line, percent, side, side_line, verdict_text};
use super::output::{self, or_dash};
use super::{compare_matrix, compare_pictures};
use crate::error::{Error, Result};
use crate::measure::bootstrap::{Bootstrap, Interval};
use crate::timing::compare::{
    Comparison, HEADLINE, MeasureComparison, ModeComparison, SizeComparison, few_frames_remark,
};
use crate::timing::difference::Difference;
use crate::timing::records::Run;
use crate::timing::results::{BenchResults, read_results};

/// Version of the output of `--json`. A change of a key or of its meaning raises it.
const REPORT_SCHEMA: u32 = 3;

/// Runs `nimbus compare`.
///
/// # Errors
/// Fails if the results or pictures cannot be read or compared, or a metric is beyond its limit.
pub fn run(args: &CompareArgs) -> Result<()> {
    if compare_pictures::has_pictures(args)? {
        return compare_pictures::run(args);
    }
    if !args.more.is_empty() {
        return compare_matrix::run(args);
    }
    let (a, b) = (read_results(&args.a)?, read_results(&args.b)?);
    let found = Comparison::new(&a, &b, args.margin);
    let allowed = allowed(args, [&args.a, &args.b], &found.differences)?;
    if found.modes.is_empty() {
        let ran = |of: &BenchResults| {
            of.modes.iter().map(|m| m.name.clone()).collect::<Vec<_>>().join(", ")
        };
        let [of_a, of_b] =
            [&a, &b].map(ran).map(|names| if names.is_empty() { "none".into() } else { names });
        return Err(Error::usage(format!(
            "A and B have no timed loop in common: A has {of_a}, B has {of_b}"
        )));
    }
    let sides = [(&*args.a, &a.run), (&*args.b, &b.run)];
    if !args.json {
        return output::text(&text(sides, &allowed, &found, args.margin));
    }
    let [a, b] = sides.map(|(folder, run)| side(folder, run));
    output::object(&json!({
        "schema": REPORT_SCHEMA, "a": a, "b": b, "allowed": allowed,
        "margin": args.margin,
        "n_resamples": Bootstrap::default().n_resamples,
        // The measure that decides. The others are not corrected for multiple comparisons.
        "headline": HEADLINE,
        "modes": found.modes, "errors": found.errors, "memory": found.memory,
        "remarks": found.remarks,
    }))
}

/// Returns the tables for people.
fn text(
    sides: [(&Path, &Run); 2],
    allowed: &[&Difference],
    found: &Comparison,
    margin: f64,
) -> String {
    let mut out = String::new();
    for (name, (folder, run)) in ["A", "B"].into_iter().zip(sides) {
        out += &side_line(name, folder, run);
    }
    for difference in allowed {
        out += &format!("allowed to differ: {}\n", line(difference));
    }
    for remark in &found.remarks {
        out += &format!("note: {remark}\n");
    }
    for mode in &found.modes {
        out += &format!("\n{}", output::table(&rows(mode)));
    }
    for (what, sizes, number) in [
        ("RMSE", &found.errors, output::scientific as fn(f64) -> String),
        ("device memory, MiB", &found.memory, mib),
    ] {
        if !sizes.is_empty() {
            out += &format!("\n{}", output::table(&size_rows(what, sizes, number)));
        }
    }
    out += &few_frames_remark(&found.modes).map_or(String::new(), |remark| remark + "\n");
    out.push('\n');
    for mode in &found.modes {
        if let Some(headline) = mode.headline() {
            out += &format!("{} frame: {}\n", mode.name, sentence(headline));
        }
    }
    let n_starts = sides.map(|(_, run)| run.n_starts());
    out + &foot(&found.modes, margin, n_starts[0].min(n_starts[1]))
}

fn mib(bytes: f64) -> String {
    format!("{:.1}", bytes / f64::from(1 << 20))
}

fn size_rows(what: &str, sizes: &[SizeComparison], number: fn(f64) -> String) -> Vec<Vec<String>> {
    let mut rows = output::header([what, "A", "B", "B / A", "95 % low", "high", "B is"]);
    for e in sizes {
        let name = if e.name.is_empty() { "scene" } else { &e.name };
        let mut row = vec![name.to_owned()];
        row.extend([e.a, e.b].map(number));
        let ends = [|r: Interval| r.estimate, |r: Interval| r.low, |r: Interval| r.high];
        row.extend(ends.map(|of| or_dash(e.b_by_a, |r| format!("{:.3}", of(r)))));
        row.push(e.verdict.text().to_owned());
        rows.push(row);
    }
    rows
}

fn rows(mode: &ModeComparison) -> Vec<Vec<String>> {
    let header = ["A p50", "B p50", "B / A", "95 % low", "high", "n A", "n B", "B is"];
    let mut rows = vec![
        std::iter::once(format!("{}, ms", mode.name)).chain(header.map(str::to_owned)).collect(),
    ];
    for m in &mode.measures {
        let number = |value: Option<f64>| or_dash(value, |v| format!("{v:.3}"));
        rows.push(vec![
            m.measure.clone(),
            number(m.a_ms),
            number(m.b_ms),
            number(m.b_by_a.map(|r| r.estimate)),
            number(m.b_by_a.map(|r| r.low)),
            number(m.b_by_a.map(|r| r.high)),
            m.n_a.to_string(),
            m.n_b.to_string(),
            verdict_text(m),
        ]);
    }
    rows
}

fn sentence(m: &MeasureComparison) -> String {
    let verdict = verdict_text(m);
    match m.b_by_a {
        Some(r) => {
            let (estimate, low, high) = (r.estimate, r.low, r.high);
            format!(
                "B takes {estimate:.3} of A's time (95 % interval {low:.3} to {high:.3}): {verdict}"
            )
        }
        None => verdict,
    }
}

/// Returns the note on how the intervals were computed and what they cover. `n_starts`: the lesser
/// number of starts of the two runs.
fn foot(modes: &[ModeComparison], margin: f64, n_starts: usize) -> String {
    let lens: BTreeSet<Option<usize>> =
        modes.iter().filter_map(|m| Some(m.headline()?.block_len)).collect();
    let neighbours: Vec<String> = lens.iter().flatten().map(usize::to_string).collect();
    let mut how = Vec::new();
    if lens.contains(&None) {
        how.push("blocks of frames compared with each other".to_owned());
    }
    if !neighbours.is_empty() {
        how.push(format!(
            "block bootstrap, {} resamples, ⌈√n⌉ neighbouring frames drawn together (frame: {})",
            Bootstrap::default().n_resamples,
            neighbours.join(" and ")
        ));
    }
    let covered = match n_starts {
        0 | 1 => "the noise within the runs, not the changes from one start to the next",
        _ => "the changes from one start to the next",
    };
    format!(
        "\nMargin: {}. Intervals: {}.\nThey cover {covered}. frame decides; the other\nrows are \
         not corrected for many comparisons: of twenty, one will be beyond its interval.\n",
        percent(margin),
        how.join("; ")
    )
}
