//! Adds the least work of each pass, and the share of the roof that it reaches, to the records of a
//! bench.

use std::collections::BTreeMap;

use super::records::Case;
use super::roofs::Ceilings;
use crate::frame::plan::Pass;
use crate::frame::{Amounts, floor};

/// Fills in bytes, operations and shares of all passes. `amounts` are by case; a case that did not
/// run to its end has none. Without ceilings there are no shares. With cold caches the times of
/// frames contain what is written between passes: no loop is a case's figure, and none is compared
/// with another.
pub fn add(
    cases: &mut [Case],
    amounts: &BTreeMap<usize, Amounts>,
    ceilings: Option<&Ceilings>,
    is_cold: bool,
) {
    for (i, case) in cases.iter_mut().enumerate() {
        if is_cold {
            (case.figure, case.ratio, case.overlap) = (None, None, None);
        }
        let Some(amounts) = amounts.get(&i) else { continue };
        for pass in case.modes.iter_mut().flat_map(|mode| &mut mode.passes) {
            let known = Pass::ALL.into_iter().find(|known| known.name() == pass.name);
            let Some(work) = known.and_then(|known| floor(known, amounts)) else { continue };
            (pass.bytes, pass.operations) = (Some(work.bytes), Some(work.operations));
            let time = ceilings.zip(pass.p50_ms);
            pass.roof_share = time.and_then(|(roof, ms)| roof.share(&work, ms, is_cold));
        }
    }
}
