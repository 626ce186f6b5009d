//! Checks the pictures that a bench timed, after it has timed them.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::args::BenchArgs;
use super::bench_record::Recorder;
use super::bench_stages;
use super::progress::progress;
use super::scene::device_choice;
use crate::error::Error;
use crate::io::console::say;
use crate::studies::check::{CheckPlan, check};
use crate::studies::reference_cache;
use crate::timing::blocks::{self, Outcome};
use crate::timing::cases::Case;
use crate::timing::check::Check;

/// Share of a bench's time for the second reflection in f64.
const SHARE: f64 = 0.05;
/// Least time for that of a picture.
const LEAST: Duration = Duration::from_millis(500);

/// Checks all pictures in `outcome`, which took `timed` to time, until `stop` is set.
pub fn run(recorder: &Recorder, timed: Duration, stop: &AtomicBool, outcome: &Mutex<Outcome>) {
    let Recorder { args, cases, .. } = recorder;
    if args.no_check {
        let none = || Check::none("--no-check");
        blocks::lock(outcome).checks = (0..cases.len()).map(|i| (i, none())).collect();
        return;
    }
    let drawn = blocks::lock(outcome).drawn.clone();
    let folder = reference_cache::default_folder();
    let budget = timed.mul_f64(SHARE / drawn.len().max(1) as f64).max(LEAST);
    let plan = CheckPlan { budget, folder: folder.as_deref() };
    let bar = progress(drawn.len() as u64 + 1, "check", args.options.quiet);
    for picture in drawn {
        let found = match stop.load(Ordering::Relaxed) {
            true => Check::none("Ctrl-C came before the check"),
            false => check(&picture, &plan).unwrap_or_else(|e| Check::none(&e.to_string())),
        };
        bar.advance();
        let found = Check {
            reason: found.reason.clone().map(|r| named(&found, &picture.loop_name, r)),
            ..found
        };
        let checks = &mut blocks::lock(outcome).checks;
        // Of several pictures of a case a wrong one counts.
        let is_worse = |before: &Check| found.is_wrong() && !before.is_wrong();
        if checks.get(&picture.i_case).is_none_or(is_worse) {
            checks.insert(picture.i_case, found);
        }
    }
    if !stop.load(Ordering::Relaxed) {
        let stages = bench_stages::run(&device_choice(&args.options), &recorder.info, stop);
        blocks::lock(outcome).stages = stages.unwrap_or_else(|error| {
            say!("warning: the device's stages could not be checked: {error}");
            None
        });
    }
}

/// Returns a reason with the loop whose picture is wrong.
fn named(check: &Check, loop_name: &str, reason: String) -> String {
    if check.is_wrong() { format!("loop {loop_name}: {reason}") } else { reason }
}

/// Returns the error of a bench whose device left out `missed` of `n` submissions; none if it left
/// out none, or without a check.
pub fn not_executed(args: &BenchArgs, (n, missed): (u64, u64)) -> Option<Error> {
    (missed > 0 && !args.no_check).then(|| Error::Check {
        what: format!(
            "the device's picture is wrong: the driver said that {n} submissions were done, and \
             did not execute {missed} of them; their times are of no use"
        ),
    })
}

/// Returns the error of a bench whose picture or stages are wrong; none if they are right.
pub fn wrong(outcome: &Outcome, cases: &[Case]) -> Option<Error> {
    let Some((i, check)) = outcome.checks.iter().find(|(_, check)| check.is_wrong()) else {
        let stages = outcome.stages.as_ref().filter(|stages| !stages.failed.is_empty())?;
        let what = format!(
            "the device's picture is wrong, in this scene by less than its bounds: these stages \
             are wrong: {}; `nimbus stress` tells by how much",
            stages.failed.join(", ")
        );
        return Some(Error::Check { what });
    };
    let n = outcome.checks.values().filter(|check| check.is_wrong()).count();
    let name = cases.get(*i).map(Case::name).unwrap_or_default();
    let place = if name.is_empty() { String::new() } else { format!("{name}: ") };
    let more = if n > 1 { format!(" ({n} cases are wrong)") } else { String::new() };
    let reason = check.reason.clone().unwrap_or_default();
    let what = format!(
        "the device's picture is wrong: {place}{reason}{more}; its times are of no use. `nimbus \
         stress` looks for the stage that is wrong"
    );
    Some(Error::Check { what })
}
