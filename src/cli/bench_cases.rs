//! The cases that `nimbus bench` times: the scene at every point of its sweep.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use super::args::{BenchArgs, SceneArgs, Span, ThreadingArg};
use super::scene::{load, load_at, warnings};
use crate::error::{Error, Result};
use crate::farm::{Workload, bench_workload};
use crate::io::console::say;
use crate::model::scene::Threading;
use crate::studies::check::checked_pixels;
use crate::timing::blocks::BenchPlan;
use crate::timing::cases::{Case, LoopChoice, cases};
use crate::timing::limits::{SceneMemory, check_bench, check_cases};
use crate::timing::names::sweep_text;
use crate::timing::parts::numbers;
use crate::timing::precision::Precision;
use crate::timing::schedule::Rounds;
use crate::timing::sweep::{Axis, SIZE_KEY, points};

/// The cases of a scene, and its own record.
pub struct BenchCases {
    /// All cases, or those of `--part`.
    pub cases: Vec<Case>,
    /// SHA-256 of the scene without a sweep.
    pub scene_hash: String,
    /// The scene with every default filled in.
    pub resolved: serde_json::Value,
}

/// Loads the scene at `path` at every point of the sweep.
///
/// # Errors
/// Fails if the sweep or a scene is faulty, `--part` names cases that are not there, or the
/// records of all frames would not fit in memory.
pub fn bench_cases(args: &BenchArgs, path: &Path, options: &SceneArgs) -> Result<BenchCases> {
    let modes: &[Threading] = match args.threading {
        ThreadingArg::Serial => &[Threading::Serial],
        ThreadingArg::Parallel => &[Threading::Parallel],
        ThreadingArg::Both => &[Threading::Serial, Threading::Parallel],
    };
    let axes = axes(args)?;
    check_cases("--sweep", axes.iter().map(|axis| axis.values.len()))?;
    let mut memory = SceneMemory::of_machine();
    let loops = LoopChoice { modes, skip: !options.no_skip, saved: !args.no_saved };
    let loaded = load(path, options)?;
    let (scene_hash, resolved) = (loaded.hash().to_owned(), loaded.resolved.clone());
    let mut printed = BTreeSet::from_iter(warnings(&loaded));
    let mut all = Vec::new();
    if axes.is_empty() {
        all = cases(loaded, &[], args.frames, loops);
    } else {
        for point in points(&axes) {
            let at = load_at(path, options, "--sweep", &point)?;
            for warning in warnings(&at).into_iter().filter(|_| !options.quiet) {
                if printed.insert(warning.clone()) {
                    say!("warning: {}: {warning}", sweep_text(&point));
                }
            }
            memory.add(&at.scene)?;
            all.extend(cases(at, &point, args.frames, loops));
        }
    }
    let cases: Vec<Case> =
        of_part(args, all)?.into_iter().map(Case::with_figure).collect::<Result<_>>()?;
    check_bench(&cases, &plan(args))?;
    Ok(BenchCases { cases, scene_hash, resolved })
}

/// Returns the blocks that the arguments ask for.
pub fn plan(args: &BenchArgs) -> BenchPlan {
    BenchPlan {
        n_warm_up: args.n_warm_up(),
        rounds: precision(args).map_or(Rounds::Fixed(args.repeat), Rounds::Until),
        hash_frames: args.hash_frames,
        pictures: args.out.is_some(),
        checked: (!args.no_check).then_some(|w, h| checked_pixels(w, h).at),
        cold_bytes: args.cold.map(|mib| u64::from(mib) << 20),
        counts_invocations: args.invocations,
    }
}

/// Returns the precision that the arguments ask for.
pub fn precision(args: &BenchArgs) -> Option<Precision> {
    let limit = Duration::from_secs_f64(args.time_limit);
    args.precision.map(|wanted| Precision { wanted, seed: args.order_seed, limit })
}

/// Returns the cases of `--part` after the first of all; all cases without `--part`.
fn of_part(args: &BenchArgs, cases: Vec<Case>) -> Result<Vec<Case>> {
    let Some(Span { first, end }) = args.part else { return Ok(cases) };
    let (n, range) = (cases.len(), first as usize..end as usize);
    if range.end > n {
        let what = format!("--part {first}..{end}: expected a part of cases 0..{n}");
        return Err(Error::usage(what));
    }
    Ok(numbers(&range).into_iter().map(|i| cases[i].clone()).collect())
}

/// Returns the names of the cases in the order that `--part` counts in, and the work in them.
///
/// # Errors
/// Fails if there is not one scene, or it or its sweep is faulty.
pub fn case_names(args: &BenchArgs) -> Result<(Vec<String>, Workload)> {
    let [scene] = &args.scenes[..] else {
        return Err(Error::usage(format!("expected one scene, found {}", args.scenes.len())));
    };
    if args.precision.is_some() {
        let what = "--precision: the cases of a farm have a number of blocks; use --repeat";
        return Err(Error::usage(what));
    }
    let quiet = SceneArgs { quiet: true, verbose: false, ..args.options.clone() };
    let cases = bench_cases(args, scene, &quiet)?.cases;
    let workload = bench_workload(&cases, args.n_warm_up(), args.repeat)?;
    Ok((cases.iter().map(Case::name).collect(), workload))
}

/// Parses the sweep and rejects keys that set the same thing twice.
fn axes(args: &BenchArgs) -> Result<Vec<Axis>> {
    let axes = Axis::parse_all("--sweep", &args.sweep)?;
    let has = |key: &str| axes.iter().any(|a| a.key == key);
    let refuse = |key: &str, what: &str| Err(Error::usage(format!("--sweep {key}: {what}")));
    if has(SIZE_KEY) && (has("film.width") || has("film.height")) {
        let what = "sets film.width and film.height, which another --sweep sets, too";
        return refuse(SIZE_KEY, what);
    }
    if has("time.frames") && args.frames.is_some() {
        return refuse("time.frames", "--frames says how many frames are timed");
    }
    Ok(axes)
}
