//! `nimbus compare A B`.

use std::path::Path;

use serde_json::{Value, json};

use super::args::CompareArgs;
use super::compare_pictures;
use super::output::{self, or_dash};
use crate::error::{Error, Result};
use crate::measure::bootstrap::Bootstrap;
use crate::timing::compare::{
    Comparison, HEADLINE, MeasureComparison, ModeComparison, few_frames_remark,
};
use crate::timing::difference::{Condition, Difference};
use crate::timing::records::Run;
use crate::timing::results::{BenchResults, read_results};

/// Version of the output of `--json`. A change of a key or of its meaning raises it.
const REPORT_SCHEMA: u32 = 2;

/// Runs `nimbus compare`.
///
/// # Errors
/// Fails if the results or pictures cannot be read or compared, or a metric is beyond its limit.
pub fn run(args: &CompareArgs) -> Result<()> {
    if compare_pictures::has_pictures(args)? {
        return compare_pictures::run(args);
    }
    let (a, b) = (read_results(&args.a)?, read_results(&args.b)?);
    let found = Comparison::new(&a, &b);
    let is_allowed = |d: &&Difference| args.allow.contains(&d.kind);
    let (allowed, refused): (Vec<&Difference>, Vec<&Difference>) =
        found.differences.iter().partition(is_allowed);
    if !refused.is_empty() {
        return Err(Error::usage(refusal(args, &refused)));
    }
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
        return output::text(&text(sides, &allowed, &found));
    }
    let [a, b] = sides.map(|(folder, run)| side(folder, run));
    output::object(&json!({
        "schema": REPORT_SCHEMA, "a": a, "b": b, "allowed": allowed,
        "n_resamples": Bootstrap::default().n_resamples,
        // The measure that decides. The others are not corrected for multiple comparisons.
        "headline": HEADLINE,
        "modes": found.modes, "remarks": found.remarks,
    }))
}

/// Returns what identifies a compared run.
fn side(folder: &Path, run: &Run) -> Value {
    json!({
        "folder": folder.display().to_string(), "date": run.date, "nimbus": run.nimbus,
        "revision": run.revision,
        "device": format!("{} ({})", run.device.name, run.device.driver),
        "scene_hash": run.scene_hash,
    })
}

/// Returns the message about conditions that differ, with the flag that accepts them.
fn refusal(args: &CompareArgs, refused: &[&Difference]) -> String {
    let is_named =
        |kind: &Condition| args.allow.contains(kind) || refused.iter().any(|d| d.kind == *kind);
    let flag = Condition::ALL.into_iter().filter(is_named).map(Condition::name);
    let flag = flag.collect::<Vec<_>>().join(",");
    let mut what = format!(
        "{} and {} were measured under different conditions; --allow {flag} compares them all the \
         same",
        args.a.display(),
        args.b.display()
    );
    for difference in refused {
        what += &format!("\n  {}", line(difference));
    }
    what
}

fn line(d: &Difference) -> String {
    format!("{}, {}: A {}, B {}", d.kind.name(), d.what, d.a, d.b)
}

/// Returns the tables for people.
fn text(sides: [(&Path, &Run); 2], allowed: &[&Difference], found: &Comparison) -> String {
    let mut out = String::new();
    for (name, (folder, run)) in ["A", "B"].into_iter().zip(sides) {
        let (folder, Run { date, nimbus, revision, device, .. }) = (folder.display(), run);
        let device = format!("{} ({})", device.name, device.driver);
        out += &format!("{name}  {folder}, {date}, nimbus {nimbus} {revision}, {device}\n");
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
    out += &few_frames_remark(&found.modes).map_or(String::new(), |remark| remark + "\n");
    out.push('\n');
    for mode in &found.modes {
        if let Some(headline) = mode.headline() {
            out += &format!("{} frame: {}\n", mode.name, sentence(headline));
        }
    }
    out + &foot(&found.modes)
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
            m.verdict.text().to_owned(),
        ]);
    }
    rows
}

fn sentence(m: &MeasureComparison) -> String {
    let verdict = m.verdict.text();
    match m.b_by_a {
        Some(r) => {
            let (estimate, low, high) = (r.estimate, r.low, r.high);
            format!(
                "B takes {estimate:.3} of A's time (95 % interval {low:.3} to {high:.3}): {verdict}"
            )
        }
        None => verdict.to_owned(),
    }
}

/// Returns the note on how the intervals were computed and what they do not cover.
fn foot(modes: &[ModeComparison]) -> String {
    let mut lens: Vec<String> =
        modes.iter().filter_map(|m| Some(m.headline()?.block_len.to_string())).collect();
    if lens.windows(2).all(|w| w[0] == w[1]) {
        lens.truncate(1);
    }
    let lens = lens.join(" and ");
    format!(
        "\nIntervals: block bootstrap, {} resamples, ⌈√n⌉ neighbouring frames drawn together \
         (frame: {lens}).\n\
        They cover the noise within the runs, not the changes from one start to the next. frame \
        decides; the other\n\
        rows are not corrected for many comparisons: of twenty equal ones, one will seem to \
        differ.\n",
        Bootstrap::default().n_resamples
    )
}
