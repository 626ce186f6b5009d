//! Checks the stages that make a picture, beside the picture: one scene may hide an error that
//! another one shows.

use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use sha2::{Digest, Sha256};

use crate::error::Result;
use crate::frame::DeviceChoice;
use crate::gpu::{DeviceInfo, cache_folder, hex};
use crate::io::atomic::write_atomic;
use crate::stress::{Case, StressContext, cases};
use crate::timing::check::Stages;
use crate::timing::machine;

/// Beginnings of the names of the stress suite's cases that are run. Together they take two seconds
/// on two cores; the others are scenes.
const STAGES: [&str; 4] = ["functions/", "brdf/", "generation/", "transport/sum"];

/// Runs the cases on the device that a bench has used, unless they have passed there with the same
/// shaders before. None if `stop` is set before they are done.
///
/// # Errors
/// Fails if the device cannot be opened again or is lost.
pub fn run(choice: &DeviceChoice, info: &DeviceInfo, stop: &AtomicBool) -> Result<Option<Stages>> {
    let begin = Instant::now();
    let is_stage = |case: &Case| STAGES.iter().any(|stage| case.name.starts_with(stage));
    let chosen: Vec<Case> = cases().into_iter().filter(is_stage).collect();
    let done = |failed: Vec<String>, from_cache| Stages {
        n_cases: chosen.len(),
        failed,
        seconds: begin.elapsed().as_secs_f64(),
        from_cache,
    };
    // Passed on this device, with these shaders and this program.
    let mark = cache_folder("stages").map(|folder| folder.join(key(choice, info)));
    if mark.as_ref().is_some_and(|mark| mark.exists()) {
        return Ok(Some(done(vec![], true)));
    }
    let mut context = StressContext::open(choice)?;
    let mut failed = Vec::new();
    for case in &chosen {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let outcome = case.run(&mut context);
        if outcome.verdict.is_bad() {
            failed.push(outcome.name);
        }
    }
    context.close()?;
    if let (true, Some(mark)) = (failed.is_empty(), mark) {
        // A mark that cannot be written only costs time.
        let _ = mark.parent().map(fs::create_dir_all);
        let _ = write_atomic(&mark, |_| std::io::Result::Ok(()));
    }
    Ok(Some(done(failed, false)))
}

/// Returns the hash of all that decides whether the cases pass.
fn key(choice: &DeviceChoice, info: &DeviceInfo) -> String {
    let mut hasher = Sha256::new();
    let device = machine::device_record(info);
    let sources = choice.sources().map(|sources| sources.digest()).unwrap_or_default();
    let code = (env!("NIMBUS_REFERENCE_CODE"), machine::revision(), env!("CARGO_PKG_VERSION"));
    let environment = machine::environment();
    hasher
        .update(format!("{device:?}\n{sources}\n{code:?}\n{environment:?}\n{:?}", choice.options));
    hex(&hasher.finalize())
}
