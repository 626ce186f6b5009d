//! `nimbus farm plan --bench`: a sweep's cases, and how far nodes differed once it is merged.

use std::collections::BTreeSet;
use std::path::Path;

use clap::Parser;

use super::args::{Args, BenchArgs, Command, PlanArgs};
use super::bench;
use super::farm_cut::Amounts;
use crate::error::{Error, Result};
use crate::farm::plan::Work;
use crate::timing::json;
use crate::timing::parts::base_spread;
use crate::timing::records::Run;

/// The cases that `nimbus bench` would time, told the same; `set` is the plan's.
pub(super) fn work(args: &PlanArgs, set: &[String]) -> Result<(Work, Amounts)> {
    let BenchArgs { scenes, trace, plot, force, json, part, options, .. } = parsed(args, &[])?;
    let is_out = args.told.iter().any(|word| word == "--out" || word.starts_with("--out="));
    let is_results =
        is_out || trace.is_some() || plot || force || json || part.is_some() || scenes.len() > 1;
    let is_scene = !options.set.is_empty() || options.seed.is_some() || options.size.is_some();
    let is_device = options.device.is_some()
        || options.shaders.is_some()
        || options.validation
        || options.poison;
    if is_results || is_scene || is_device || options.quiet || options.verbose {
        return Err(Error::usage(
            "after \"--\": expected no other scene, --out, --trace, --plot, --force, --json, \
             --part, --validation, \
             --poison, --quiet or --verbose; --set, --seed, --size, --device and --shaders \
             stand before it",
        ));
    }
    let of_scene = set
        .iter()
        .map(|set| format!("--set={set}"))
        .chain(args.seed.iter().map(|n| format!("--seed={n}")));
    let (cases, amounts) = bench::case_names(&parsed(args, &of_scene.collect::<Vec<_>>())?)?;
    Ok((Work::Bench { arguments: args.told.clone(), cases }, amounts))
}

/// What stands after "--", with `more` before it.
fn parsed(args: &PlanArgs, more: &[String]) -> Result<BenchArgs> {
    let begin = ["nimbus".into(), "bench".into(), args.scene.display().to_string()];
    let is_out = args.told.iter().any(|word| word == "--out" || word.starts_with("--out="));
    // Every part has a folder, and some of what may be said needs one.
    let out = (!is_out).then(|| "--out=part".to_owned());
    match Args::try_parse_from(begin.iter().chain(more).chain(&out).chain(&args.told)) {
        Ok(Args { command: Command::Bench(of), .. }) => Ok(of),
        Ok(_) => Err(Error::usage("expected arguments of nimbus bench after \"--\"")),
        Err(cause) => Err(Error::usage(format!(
            "after \"--\": {}",
            cause.to_string().trim_start_matches("error: ")
        ))),
    }
}

/// By how much the nodes differ in the first case, of a merged bench; a line.
pub(super) fn spread(merged: &Path) -> Result<String> {
    let parts = json::read::<Run>(merged)?.parts;
    let nodes: BTreeSet<&str> = parts.iter().map(|part| part.node.as_str()).collect();
    let spread = base_spread(&parts);
    if spread.is_empty() {
        return Ok(String::new());
    }
    let each: Vec<String> = spread.iter().map(|(name, by)| format!("{name} {by:.3}")).collect();
    let (n, n_nodes, s) = (parts.len(), nodes.len(), if nodes.len() == 1 { "" } else { "s" });
    Ok(format!(
        "the first case, timed in each of {n} shards on {n_nodes} node{s}: greatest median frame \
         time by the least: \
         {}\n",
        each.join(", ")
    ))
}
