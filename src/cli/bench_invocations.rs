//! The table of what passes invoke, of `nimbus bench --invocations`.

use super::output::{header, table};
use crate::timing::records::Case;

/// Returns the table of a case; empty if nothing was counted.
pub fn text(case: &Case) -> String {
    let Some(passes) = &case.invocations else { return String::new() };
    let mut rows = header(["invoked", "compute", "vertex", "fragment", "triangles", "clipped"]);
    for pass in passes {
        let of = pass.of;
        let counts = [of.compute, of.vertex, of.fragment, of.primitives, of.clipped_primitives];
        let counts = counts.iter().map(u64::to_string);
        rows.push(std::iter::once(pass.name.clone()).chain(counts).collect());
    }
    table(&rows) + "\n"
}
