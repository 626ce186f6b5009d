//! Running a case to its outcome.

use std::time::Instant;

use super::case::{Case, Comparison, Found, Outcome, Verdict};
use super::desk::Desk;

/// Runs `case`; whatever goes wrong is its outcome.
pub fn run_case(case: &Case, desk: &mut Desk) -> Outcome {
    let begin = Instant::now();
    let found = (case.run)(desk);
    let (verdict, compared, remark) = match found {
        Ok(Found::Compared(compared)) => {
            let is_good = compared.n > 0 && compared.n_beyond == 0;
            let remark = compared.remark.clone();
            (if is_good { Verdict::Passed } else { Verdict::Failed }, compared, remark)
        }
        Ok(Found::NotHere(why)) => (Verdict::NotHere, Comparison::default(), Some(why)),
        Err(error) => (Verdict::Broken, Comparison::default(), Some(error.to_string())),
    };
    Outcome {
        name: case.name.into(),
        what: case.what.into(),
        bound: case.bound.into(),
        verdict,
        n: compared.n,
        n_beyond: compared.n_beyond,
        worst: compared.worst,
        remark,
        seconds: begin.elapsed().as_secs_f64(),
    }
}
