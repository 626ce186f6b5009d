//! `nimbus compare A B C…`: every run against every other.

use std::path::Path;

use serde_json::json;

use super::args::CompareArgs;
use super::compare_sides::{allowed, line, percent, side, side_line, verdict_text};
use super::output::{self, or_dash};
use crate::error::{Error, Result};
use crate::timing::compare::{HEADLINE, LoopMatrix, matrix};
use crate::timing::difference::differences;
use crate::timing::results::{BenchResults, read_results};
use crate::timing::verdict::Verdict;

/// Version of the output of `--json`. A change of a key or of its meaning raises it.
const REPORT_SCHEMA: u32 = 1;
/// Most runs: a table of their ratios still fits on a page.
const MOST_RUNS: usize = 26;

/// Compares three runs or more.
///
/// # Errors
/// Fails if the results cannot be read, or differ in a condition that is not allowed.
pub fn run(args: &CompareArgs) -> Result<()> {
    let folders: Vec<&Path> =
        [&args.a, &args.b].into_iter().chain(&args.more).map(|p| p.as_path()).collect();
    if folders.len() > MOST_RUNS {
        let n = folders.len();
        return Err(Error::usage(format!(
            "expected at most {MOST_RUNS} results folders, found {n}"
        )));
    }
    let runs: Vec<BenchResults> =
        folders.iter().map(|folder| read_results(folder)).collect::<Result<_>>()?;
    let mut allowed_lines = Vec::new();
    for (folder, of) in folders.iter().zip(&runs).skip(1) {
        let found = differences(&runs[0].run, &of.run);
        for difference in allowed(args, [folders[0], folder], &found)? {
            allowed_lines.push(format!("{}: {}", folder.display(), line(difference)));
        }
    }
    let loops = matrix(&runs, args.margin);
    if loops.is_empty() {
        return Err(Error::usage("the runs have no timed loop in common"));
    }
    let sides: Vec<(&Path, &BenchResults)> = folders.into_iter().zip(&runs).collect();
    if args.json {
        let sides: Vec<_> = sides.iter().map(|(folder, of)| side(folder, &of.run)).collect();
        return output::object(&json!({
            "schema": REPORT_SCHEMA, "runs": sides, "margin": args.margin, "headline": HEADLINE,
            "matrix": loops,
        }));
    }
    let mut out = String::new();
    for (i, (folder, of)) in sides.iter().enumerate() {
        out += &side_line(&letter(i), folder, &of.run);
    }
    for line in allowed_lines {
        out += &format!("allowed to differ: {line}\n");
    }
    for of_loop in &loops {
        out += &format!("\n{}", output::table(&rows(of_loop)));
    }
    out += &format!(
        "\nMedian frame time of the row by that of the column, with its 95 % interval; = the same \
         within {}, < faster,\n> slower, ? undecided. The intervals are not corrected for many \
         comparisons: of twenty, one will be\nbeyond its interval.\n",
        percent(args.margin)
    );
    output::text(&out)
}

/// Returns the name of a run: A, B, …, Z.
fn letter(i: usize) -> String {
    char::from(b'A' + (i % MOST_RUNS) as u8).to_string()
}

fn rows(of: &LoopMatrix) -> Vec<Vec<String>> {
    let n = of.cells.len();
    let mut header = vec![format!("{}, row / column", of.name), "p50 ms".to_owned()];
    header.extend((0..n).map(letter));
    let mut rows = vec![header];
    for (i, cells) in of.cells.iter().enumerate() {
        let own = cells.iter().flatten().next().and_then(|m| m.b_ms);
        let mut row = vec![letter(i), or_dash(own, |ms| format!("{ms:.3}"))];
        row.extend(cells.iter().map(|cell| {
            or_dash(cell.as_ref(), |m| match m.b_by_a {
                None => verdict_text(m),
                Some(r) => {
                    let sign = match m.verdict {
                        Verdict::Same => "=",
                        Verdict::Faster => "<",
                        Verdict::Slower => ">",
                        _ => "?",
                    };
                    format!("{:.3} ({:.3} to {:.3}) {sign}", r.estimate, r.low, r.high)
                }
            })
        }));
        rows.push(row);
    }
    rows
}
