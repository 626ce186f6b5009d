//! The lines and the table of `nimbus bench` on roofs and cold caches.

use super::bench_remarks::ms;
use super::output::{or_dash, table};
use crate::timing::records::{Case, Pass, Run};

/// Returns the table of a case's passes: their least work, and the share of the roof that they
/// reach. The times are those of the loop without skipping, or else of the first loop. The table is
/// empty if no pass has a floor.
pub fn case_text(case: &Case) -> String {
    let whole = case.modes.iter().find(|mode| !mode.skip).or(case.modes.first());
    let passes = whole.map_or(&[][..], |mode| &mode.passes);
    let known: Vec<&Pass> =
        passes.iter().filter(|p| p.bytes.is_some() && p.p50_ms.is_some()).collect();
    let Some(mode) = whole.filter(|_| !known.is_empty()) else { return String::new() };
    let first = format!("pass of {}", mode.name());
    let header = [first.as_str(), "p50 ms", "least MB", "least Mop", "of roof"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for pass in known {
        let millions = |value: Option<f64>| or_dash(value, |v| format!("{:.3}", 1e-6 * v));
        rows.push(vec![
            pass.name.clone(),
            or_dash(pass.p50_ms, ms),
            millions(pass.bytes),
            millions(pass.operations),
            or_dash(pass.roof_share, |share| format!("{:.2}%", 100.0 * share)),
        ]);
    }
    table(&rows) + "\n"
}

/// Returns how to get shares, if a run has none.
pub fn missing_line(run: &Run) -> String {
    match run.ceilings {
        Some(_) => String::new(),
        None => "no share of the roof: `nimbus devices --roof` measures and keeps this device's \
                 roofs\n"
            .to_owned(),
    }
}

/// Returns what cold caches mean for the times, if they were made cold.
pub fn cold_line(run: &Run) -> String {
    run.cold_bytes.map_or(String::new(), |bytes| {
        format!(
            "COLD CACHES: the device wrote {} MiB before each pass. Times of passes are those with \
             cold caches; times of frames contain the writes and are no figure\n\n",
            bytes >> 20
        )
    })
}
