//! The work of `nimbus farm plan --error` and `--bench`, from the arguments after "--".

use clap::Parser;

use super::args::{Args, BenchArgs, Command, ErrorArgs, PlanArgs, SceneArgs};
use super::{bench_cases, error_configurations};
use crate::error::{Error, Result};
use crate::farm::{AnyWork, Study, Sweep, Workload};

/// Returns the configurations that `nimbus error` measures. `set` has the plan's settings.
pub(super) fn study(args: &PlanArgs, set: &[String]) -> Result<(AnyWork, Workload)> {
    let parsed = |more: &[String]| match parse("error", args, more)? {
        Command::Error(parsed) => Ok(parsed),
        _ => Err(Error::usage("expected arguments of nimbus error after \"--\"")),
    };
    let own = parsed(&[])?;
    let ErrorArgs { resume, force, plot, json, csv, part, .. } = own;
    let is_refused = resume || force || plot || json || csv || part.is_some();
    let has_budget = !own.budget_ms.is_empty() || !own.budget_error.is_empty();
    let refused = "--out, --resume, --force, --plot, --json, --csv, --part, --budget-…";
    refuse(args, is_refused || has_budget, &own.options, refused)?;
    let (configurations, workload) =
        error_configurations::configurations(&parsed(&of_scene(args, set))?)?;
    let arguments = args.told.clone();
    Ok((AnyWork::Error(Study { arguments, configurations }), workload))
}

/// Returns the cases that `nimbus bench` times. `set` has the plan's settings.
pub(super) fn sweep(args: &PlanArgs, set: &[String]) -> Result<(AnyWork, Workload)> {
    let parsed = |more: &[String]| match parse("bench", args, more)? {
        Command::Bench(parsed) => Ok(parsed),
        _ => Err(Error::usage("expected arguments of nimbus bench after \"--\"")),
    };
    let BenchArgs { scenes, trace, plot, force, json, part, options, .. } = parsed(&[])?;
    let is_refused = scenes.len() > 1 || trace.is_some() || plot || force || json || part.is_some();
    let refused = "other scene, --out, --trace, --plot, --force, --json, --part";
    refuse(args, is_refused, &options, refused)?;
    let (cases, workload) = bench_cases::case_names(&parsed(&of_scene(args, set))?)?;
    Ok((AnyWork::Bench(Sweep { arguments: args.told.clone(), cases }), workload))
}

/// Parses the arguments after "--", with `more` before them, as those of `nimbus NAME SCENE`.
fn parse(name: &str, args: &PlanArgs, more: &[String]) -> Result<Command> {
    let begin = ["nimbus".into(), name.to_owned(), args.scene.display().to_string()];
    // Some arguments need a folder of results, which every shard has.
    let out = (!has_out(args)).then(|| "--out=part".to_owned());
    match Args::try_parse_from(begin.iter().chain(more).chain(&out).chain(&args.told)) {
        Ok(parsed) => Ok(parsed.command),
        Err(cause) => {
            let text = cause.to_string();
            let what = text.trim_start_matches("error: ");
            Err(Error::usage(format!("after \"--\": {what}")))
        }
    }
}

fn has_out(args: &PlanArgs) -> bool {
    args.told.iter().any(|word| word == "--out" || word.starts_with("--out="))
}

/// Refuses arguments after "--" that the plan or the shards determine.
fn refuse(args: &PlanArgs, is_refused: bool, options: &SceneArgs, names: &str) -> Result<()> {
    let has_scene = !options.set.is_empty() || options.seed.is_some() || options.size.is_some();
    let has_device = options.device.is_some() || options.shaders.is_some();
    let has_checks = options.validation || options.guard || options.limits.is_some();
    let has_checks = has_checks || options.quiet || options.verbose;
    if has_out(args) || is_refused || has_scene || has_device || has_checks {
        return Err(Error::usage(format!(
            "after \"--\": expected no {names}, --validation, --guard, --limits, --quiet or \
             --verbose; --set, --seed, --size, --device and --shaders stand before it"
        )));
    }
    Ok(())
}

/// Returns the plan's settings of the scene as arguments.
fn of_scene(args: &PlanArgs, set: &[String]) -> Vec<String> {
    let set = set.iter().map(|set| format!("--set={set}"));
    set.chain(args.seed.iter().map(|seed| format!("--seed={seed}"))).collect()
}
