//! `nimbus farm …`.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::args::{FarmArgs, FarmCommand, GcArgs, LocalArgs, MergeArgs, RunArgs, StatusArgs};
use super::{farm_bench, farm_jobs, farm_plan, output};
use crate::error::{Error, Result};
use crate::farm::cost::Compared;
use crate::farm::plan::{Plan, Work};
use crate::farm::pool::{Ended, Pool};
use crate::farm::run::{How, Outcome};
use crate::farm::status::{State, Status, status};
use crate::farm::{attempts, gc, merge, run as shard_run};
use crate::frame::DeviceChoice;

/// `stop` is set by Ctrl-C, and by the signal with which an engine takes a node back, where
/// `graceful` says that something is kept.
pub fn run(args: &FarmArgs, stop: &AtomicBool, graceful: &AtomicBool) -> Result<()> {
    graceful.store(
        matches!(args.command, FarmCommand::Run(_) | FarmCommand::Local(_)),
        Ordering::Relaxed,
    );
    match &args.command {
        FarmCommand::Plan(a) => farm_plan::plan(a),
        FarmCommand::Calibrate(a) => farm_plan::calibrated(a, stop),
        FarmCommand::Run(a) => shard(a, stop).map_err(|error| given_up(a, error)),
        FarmCommand::Local(a) => local(a, stop),
        FarmCommand::Status(a) => print_status(a),
        FarmCommand::Merge(a) => merged(a),
        FarmCommand::Gc(a) => clear(a),
        FarmCommand::Emit(a) => farm_jobs::emit(a),
        FarmCommand::Submit(a) => farm_jobs::submit(a),
    }
}

/// Of a reference the processor does all.
fn refuse_needless(plan: &Plan, device: Option<&String>, validation: bool) -> Result<()> {
    if matches!(plan.work, Work::Reference(_)) && (device.is_some() || validation) {
        return Err(Error::usage(
            "a reference needs no device: expected no --device and no --validation",
        ));
    }
    Ok(())
}

fn shard(args: &RunArgs, stop: &AtomicBool) -> Result<()> {
    let plan = Plan::read(&args.plan)?;
    refuse_needless(&plan, args.device.as_ref(), args.validation)?;
    let n_items = plan.shard(args.shard)?.n;
    let bar = output::progress(u64::from(n_items), plan.work.noun(), args.quiet);
    let choice = DeviceChoice {
        device: args.device.clone(),
        validation: args.validation,
        ..DeviceChoice::default()
    };
    let how = How { choice: &choice, stop, on_item: &|| bar.inc(1) };
    let outcome = shard_run::run(&args.plan, args.shard, &how);
    bar.finish_and_clear();
    let said = match outcome? {
        Outcome::Skipped => "was done before".to_owned(),
        Outcome::Beaten => "was done meanwhile, with the same result".to_owned(),
        Outcome::Done { seconds, n_resumed: 0 } => format!("done in {seconds:.1} s"),
        Outcome::Done { seconds, n_resumed } => {
            format!(
                "done in {seconds:.1} s; {n_resumed} of {n_items} {} were there from an \
                 attempt before",
                plan.work.noun()
            )
        }
    };
    if args.quiet { Ok(()) } else { output::text(&format!("shard {}: {said}\n", args.shard)) }
}

/// What may pass and did not, so often, stays.
fn given_up(args: &RunArgs, error: Error) -> Error {
    let (Error::Transient { what }, Some(n_tries)) = (&error, args.tries) else { return error };
    match attempts::n_fruitless(&args.plan, args.shard) {
        n if n >= n_tries as usize => Error::Check {
            what: format!("{what}; nothing was finished {n} times in a row: this task ends here"),
        },
        _ => error,
    }
}

fn local(args: &LocalArgs, stop: &AtomicBool) -> Result<()> {
    let plan = Plan::read(&args.plan)?;
    refuse_needless(&plan, args.device.as_ref(), false)?;
    // What every shard would say is said once.
    plan.scene_as_planned()?;
    let found = status(&args.plan, &plan)?;
    let open = found.open();
    let program = std::env::current_exe().map_err(|cause| Error::io(Path::new("nimbus"), cause))?;
    let mut arguments: Vec<String> =
        ["farm", "run", "--quiet", "--plan"].map(str::to_owned).to_vec();
    arguments.push(args.plan.display().to_string());
    if let Some(device) = &args.device {
        arguments.extend(["--device".to_owned(), device.clone()]);
    }
    arguments.push("--shard".to_owned());
    // Times are the device's own where one process uses it.
    let exclusive = args.jobs == 1;
    let pool = Pool {
        program: &program,
        arguments,
        n_processes: args.jobs as usize,
        n_tries: args.tries as usize,
        exclusive,
    };
    let bar = output::progress(open.len() as u64, "shards", args.quiet);
    let ended = pool.run(&open, stop, &mut |_| bar.inc(1));
    bar.finish_and_clear();
    let (n, n_open) = (plan.shards.len(), open.len());
    failed(&ended?, n, &args.plan)?;
    if args.quiet {
        return Ok(());
    }
    output::text(&format!("{n} shards are done, {n_open} of them now\n"))
}

/// An error where shards are not done, with the exit code that says most: 70 before those that
/// stay, those before 75.
fn failed(ended: &[Ended], n: usize, plan: &Path) -> Result<()> {
    let failed: Vec<&Ended> = ended.iter().filter(|e| e.exit_code != Some(0)).collect();
    if failed.is_empty() {
        return Ok(());
    }
    let code =
        |e: &Ended| e.exit_code.map_or("killed".to_owned(), |code| format!("exit code {code}"));
    let list: Vec<String> = failed.iter().map(|e| format!("{} ({})", e.index, code(e))).collect();
    let (n_failed, list, plan) = (failed.len(), list.join(", "), plan.display());
    let what =
        format!("{n_failed} of {n} shards went wrong: {list}; nimbus farm status --plan {plan}");
    let may_pass = |e: &&Ended| matches!(e.exit_code, None | Some(75));
    Err(match () {
        () if failed.iter().any(|e| e.exit_code == Some(70)) => Error::Conflict { what },
        () if failed.iter().all(may_pass) => Error::Transient { what },
        () => Error::Check { what },
    })
}

fn print_status(args: &StatusArgs) -> Result<()> {
    let plan = Plan::read(&args.plan)?;
    let mut found = status(&args.plan, &plan)?;
    if args.missing {
        return output::text(&format!("{}\n", found.missing()));
    }
    found.ask_engine(&args.plan);
    if args.json {
        return output::object(&found);
    }
    output::text(&table(&plan, &found))
}

/// A row a shard that is not done or was hard to do, and a line for all.
fn table(plan: &Plan, found: &Status) -> String {
    let (n, n_done) = (found.shards.len(), found.n_done);
    let seconds: f64 = found.shards.iter().filter_map(|s| s.seconds).fold(0.0, |sum, s| sum + s);
    let mut text = format!("{n_done} of {n} shards are done, in {seconds:.1} s of runs\n");
    let is_told = |s: &&crate::farm::status::ShardStatus| {
        s.state != State::Done || s.n_attempts > 1 || s.n_unfinished > 0 || s.n_differing > 0
    };
    if let Some(Compared { n, median, p90, largest, .. }) = found.predicted {
        let [median, p90, largest] = [median, p90, largest].map(|share| 100.0 * share);
        text += &format!(
            "predicted against taken, {n} shards: off by {median:.0} % (median), {p90:.0} % (p90), \
             {largest:.0} % at \
             most\n"
        );
    }
    if let (1.., Some(class)) = (found.n_other_class, &plan.predicted_for) {
        let (n, device, cpu) = (found.n_other_class, &class.device, &class.cpu);
        text += &format!("of {n} shards nothing was predicted: the model is of {device}, {cpu}\n");
    }
    for s in found.shards.iter().filter(is_told) {
        let range = plan.shards[s.index].items();
        let attempts =
            format!("{} attempt{}", s.n_attempts, if s.n_attempts == 1 { "" } else { "s" });
        let mut notes = vec![attempts];
        notes.extend((s.n_unfinished > 0).then(|| format!("{} unfinished", s.n_unfinished)));
        notes.extend((s.n_differing > 0).then(|| format!("{} that differ", s.n_differing)));
        notes.extend(s.engine.clone());
        notes.extend(s.what.clone());
        let name = s.state.name();
        let (noun, notes) = (plan.work.noun(), notes.join("; "));
        text +=
            &format!("{:>6}  {name:9}  {noun} {}..{}  {notes}\n", s.index, range.start, range.end);
    }
    if let Some(why) = &found.engine_silent {
        text += &format!("what Slurm does with them is not known: {why}\n");
    }
    if n_done < n {
        text += &format!("to do: {}\n", found.missing());
    }
    text
}

fn merged(args: &MergeArgs) -> Result<()> {
    let plan = Plan::read(&args.plan)?;
    let spinner = output::spinner("merging", false);
    let n = merge::merge(&args.plan, &plan, &args.output, args.force, args.mixed)?;
    drop(spinner);
    let more = if let Work::Bench { .. } = plan.work {
        farm_bench::spread(&args.output)?
    } else {
        String::new()
    };
    output::text(&format!("{n} {} in {}\n{more}", plan.work.noun(), args.output.display()))
}

fn clear(args: &GcArgs) -> Result<()> {
    let plan = Plan::read(&args.plan)?;
    let idle = Duration::from_secs_f64(args.idle.min(1e9) * 3600.0);
    let removed = gc::gc(&args.plan, &plan, idle, args.all, args.dry_run)?;
    let bytes: u64 = removed.iter().map(|r| r.bytes).sum();
    let mut text: String = removed.iter().map(|r| format!("{}\n", r.path.display())).collect();
    let verb = if args.dry_run { "would be removed" } else { "removed" };
    text += &format!(
        "{} folders, {:.1} MiB, {verb}\n",
        removed.len(),
        bytes as f64 / (1u64 << 20) as f64
    );
    output::text(&text)
}
