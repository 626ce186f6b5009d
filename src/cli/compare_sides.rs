//! What all comparisons of results share: the runs' names, the conditions that may differ, and
//! verdicts in words.

use std::path::Path;

use serde_json::{Value, json};

use super::args::CompareArgs;
use crate::error::{Error, Result};
use crate::timing::compare::MeasureComparison;
use crate::timing::difference::{Condition, Difference};
use crate::timing::records::Run;
use crate::timing::verdict::Verdict;

/// Returns the differences of two runs if all of them are allowed.
///
/// # Errors
/// Fails if one is not.
pub fn allowed<'a>(
    args: &CompareArgs,
    folders: [&Path; 2],
    differences: &'a [Difference],
) -> Result<Vec<&'a Difference>> {
    let is_allowed = |d: &&Difference| args.allow.contains(&d.kind);
    let (allowed, refused): (Vec<&Difference>, Vec<&Difference>) =
        differences.iter().partition(is_allowed);
    if !refused.is_empty() {
        return Err(Error::usage(refusal(args, folders, &refused)));
    }
    Ok(allowed)
}

/// Returns what identifies a compared run.
pub fn side(folder: &Path, run: &Run) -> Value {
    json!({
        "folder": folder.display().to_string(), "date": run.date, "nimbus": run.nimbus,
        "revision": run.revision, "program": run.program(),
        "device": format!("{} ({})", run.device.name, run.device.driver),
        "scene_hash": run.scene_hash,
    })
}

/// Returns the message about conditions that differ, with the flag that accepts them.
fn refusal(args: &CompareArgs, [a, b]: [&Path; 2], refused: &[&Difference]) -> String {
    let is_named =
        |kind: &Condition| args.allow.contains(kind) || refused.iter().any(|d| d.kind == *kind);
    let flag = Condition::ALL.into_iter().filter(is_named).map(Condition::name);
    let flag = flag.collect::<Vec<_>>().join(",");
    let mut what = format!(
        "{} and {} were measured under different conditions; --allow {flag} compares them all the \
         same",
        a.display(),
        b.display()
    );
    for difference in refused {
        what += &format!("\n  {}", line(difference));
    }
    what
}

/// Returns a difference in words.
pub fn line(d: &Difference) -> String {
    format!("{}, {}: A {}, B {}", d.kind.name(), d.what, d.a, d.b)
}

/// Returns the line that names a compared run.
pub fn side_line(name: &str, folder: &Path, run: &Run) -> String {
    let (folder, Run { date, device, .. }) = (folder.display(), run);
    let device = format!("{} ({})", device.name, device.driver);
    format!("{name}  {folder}, {date}, {}, {device}\n", run.program())
}

/// Returns the verdict in words, with the frames that would decide it.
pub fn verdict_text(m: &MeasureComparison) -> String {
    match (m.verdict, m.more_frames) {
        (Verdict::Undecided, Some(n)) => format!("undecided; about {n} more frames would decide"),
        (Verdict::Undecided, None) => "undecided: on the margin".to_owned(),
        (verdict, _) => verdict.text().to_owned(),
    }
}

/// Returns a share as "1 %".
pub fn percent(share: f64) -> String {
    // Nine digits show every margin that was typed, and hide its rounding.
    let digits = format!("{:.9}", 100.0 * share);
    format!("{} %", digits.trim_end_matches('0').trim_end_matches('.'))
}
