//! `nimbus farm …`: its commands, and those that work on a plan.

use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use super::args::{FarmArgs, FarmCommand, GcArgs, LocalArgs, MergeArgs, RunArgs, StatusArgs};
use super::interrupt::{self, PATIENCE_OF_POOL, PATIENCE_WITH_CHILDREN, graceful_stop};
use super::progress::{progress, spinner};
use super::{farm_jobs, farm_plan, output};
use crate::error::{Error, Result};
use crate::farm::{
    self, Ended, GcOptions, MergeOptions, Merged, Outcome, Plan, Pool, RunOptions, ShardStatus,
    State, Status, UnfinishedRun, process,
};
use crate::frame::DeviceChoice;

/// Runs a command of `nimbus farm`.
///
/// # Errors
/// When the command fails.
pub fn run(args: &FarmArgs) -> Result<()> {
    match &args.command {
        FarmCommand::Plan(a) => farm_plan::plan(a),
        FarmCommand::Calibrate(a) => farm_plan::calibrated(a),
        FarmCommand::Run(a) => shard(a).map_err(|error| match a.tries {
            Some(n_tries) => farm::give_up_after(n_tries, &a.plan, a.shard, error),
            None => error,
        }),
        FarmCommand::Local(a) => local(a),
        FarmCommand::Status(a) => print_status(a),
        FarmCommand::Merge(a) => merge(a),
        FarmCommand::Gc(a) => gc(a),
        FarmCommand::Emit(a) => farm_jobs::emit(a),
        FarmCommand::Submit(a) => farm_jobs::submit(a),
    }
}

/// Refuses options of a device for work that the processor does.
fn refuse_device(plan: &Plan, device: Option<&String>, validation: bool) -> Result<()> {
    if !plan.work.needs_device() && (device.is_some() || validation) {
        return Err(Error::usage(
            "a reference needs no device: expected no --device and no --validation",
        ));
    }
    Ok(())
}

fn shard(args: &RunArgs) -> Result<()> {
    // Ctrl-C, or the signal with which Slurm takes a node back.
    let stop = graceful_stop();
    // An item takes longer than a node is left to us. The items before it are kept.
    let unfinished = Arc::new(OnceLock::<UnfinishedRun>::new());
    let begun = Arc::clone(&unfinished);
    let _keeping = interrupt::keep(PATIENCE_WITH_CHILDREN, move || {
        let what = "interrupted; the items that were finished are kept".to_owned();
        let error = Error::Transient { what };
        if let Some(run) = begun.get() {
            run.record(&error);
        }
        error
    });
    let plan = Plan::read(&args.plan)?;
    refuse_device(&plan, args.device.as_ref(), args.validation)?;
    let run = UnfinishedRun::begin(&args.plan, &plan, args.shard)?;
    let run = unfinished.get_or_init(|| run);
    let (n, noun) = (plan.shard(args.shard)?.n, plan.work.noun());
    let bar = progress(u64::from(n), noun, args.quiet);
    let (device, validation) = (args.device.clone(), args.validation);
    let choice = DeviceChoice { device, validation, ..DeviceChoice::default() };
    let on_item = |is_new| {
        if is_new {
            run.count_item();
        }
        bar.advance();
    };
    let options = RunOptions { choice: &choice, stop, on_item: &on_item };
    let outcome = farm::run(&args.plan, args.shard, &options);
    drop(bar);
    let text = match outcome? {
        Outcome::Skipped => "was done before".to_owned(),
        Outcome::Beaten => "was done meanwhile, with the same result".to_owned(),
        Outcome::Done { seconds, n_resumed: 0 } => format!("done in {seconds:.1} s"),
        Outcome::Done { seconds, n_resumed } => format!(
            "done in {seconds:.1} s; {n_resumed} of {n} {noun} were there from an attempt before"
        ),
    };
    if args.quiet { Ok(()) } else { output::text(&format!("shard {}: {text}\n", args.shard)) }
}

fn local(args: &LocalArgs) -> Result<()> {
    let stop = graceful_stop();
    let _keeping = interrupt::keep(PATIENCE_OF_POOL, || Error::Interrupted);
    let plan = Plan::read(&args.plan)?;
    refuse_device(&plan, args.device.as_ref(), false)?;
    // A stale plan is refused here, and not once by every shard.
    plan.scene_as_planned()?;
    let open = Status::new(&args.plan, &plan)?.open();
    let folder = args.plan.display().to_string();
    let mut arguments = ["farm", "run", "--quiet", "--plan", &folder].map(str::to_owned).to_vec();
    arguments.extend(args.device.iter().map(|device| format!("--device={device}")));
    arguments.push("--shard".to_owned());
    let pool = Pool {
        program: &process::program()?,
        arguments,
        n_processes: args.jobs as usize,
        n_tries: args.tries,
    };
    let bar = progress(open.len() as u64, "shards", args.quiet);
    let ended = pool.run(&open, stop, &|| bar.advance());
    drop(bar);
    let (n, n_open) = (plan.shards.len(), open.len());
    check_ended(&ended?, n, &args.plan)?;
    if args.quiet {
        return Ok(());
    }
    output::text(&format!("{n} shards are done, {n_open} of them now\n"))
}

/// Fails where a shard is not done. Of several exit codes 70 comes before those of permanent
/// failures, and those before 75.
fn check_ended(ended: &[Ended], n: usize, plan: &Path) -> Result<()> {
    let failed: Vec<&Ended> = ended.iter().filter(|e| e.exit_code != Some(0)).collect();
    if failed.is_empty() {
        return Ok(());
    }
    let code =
        |e: &Ended| e.exit_code.map_or("killed".to_owned(), |code| format!("exit code {code}"));
    let list: Vec<String> = failed.iter().map(|e| format!("{} ({})", e.index, code(e))).collect();
    let (n_failed, list, plan) = (failed.len(), list.join(", "), plan.display());
    let what = format!("{n_failed} of {n} shards failed: {list}; nimbus farm status --plan {plan}");
    let is_transient = |e: &&Ended| matches!(e.exit_code, None | Some(75));
    Err(if failed.iter().any(|e| e.exit_code == Some(70)) {
        Error::Conflict { what }
    } else if failed.iter().all(is_transient) {
        Error::Transient { what }
    } else {
        Error::Check { what }
    })
}

fn print_status(args: &StatusArgs) -> Result<()> {
    let plan = Plan::read(&args.plan)?;
    let mut status = Status::new(&args.plan, &plan)?;
    if args.missing {
        return output::text(&format!("{}\n", status.missing()));
    }
    status.ask_slurm(&args.plan);
    if args.json { output::object(&status) } else { output::text(&table(&plan, &status)) }
}

/// Returns a row for each shard that is not done or needed several attempts, and lines on all.
fn table(plan: &Plan, status: &Status) -> String {
    let (n, n_done) = (status.shards.len(), status.n_done);
    let seconds: f64 = status.shards.iter().filter_map(|s| s.seconds).fold(0.0, |sum, s| sum + s);
    let mut text = format!("{n_done} of {n} shards are done, in {seconds:.1} s of runs\n");
    if let Some(errors) = status.predicted {
        text += &format!("predicted against taken, {} shards: {errors}\n", errors.n);
    }
    if let (n @ 1.., Some(class)) = (status.n_other_class, &plan.predicted_for) {
        let (device, cpu) = (&class.device, &class.cpu);
        text += &format!("of {n} shards nothing was predicted: the model is of {device}, {cpu}\n");
    }
    let is_remarkable = |s: &&ShardStatus| {
        s.state != State::Done || s.n_attempts > 1 || s.n_unfinished > 0 || s.n_differing > 0
    };
    for s in status.shards.iter().filter(is_remarkable) {
        let plural = if s.n_attempts == 1 { "" } else { "s" };
        let mut notes = vec![format!("{} attempt{plural}", s.n_attempts)];
        notes.extend((s.n_unfinished > 0).then(|| format!("{} unfinished", s.n_unfinished)));
        notes.extend((s.n_differing > 0).then(|| format!("{} that differ", s.n_differing)));
        notes.extend(s.engine.clone());
        notes.extend(s.what.clone());
        let (index, name, notes) = (s.index, s.state, notes.join("; "));
        let (noun, items) = (plan.work.noun(), plan.shards[index].items());
        text += &format!("{index:>6}  {name:9}  {noun} {items:?}  {notes}\n");
    }
    if let Some(why) = &status.engine_silent {
        text += &format!("Slurm does not tell what it does with them: {why}\n");
    }
    if n_done < n {
        text += &format!("to do: {}\n", status.missing());
    }
    text
}

fn merge(args: &MergeArgs) -> Result<()> {
    let plan = Plan::read(&args.plan)?;
    let merging = spinner("merging", false);
    let options = MergeOptions { out: &args.output, force: args.force, mixed: args.mixed };
    let Merged { n, summary, written } = farm::merge(&args.plan, &plan, &options)?;
    drop(merging);
    let (noun, out) = (plan.work.noun(), args.output.display());
    let outcome = if written.is_ok() { "in" } else { "merged, but not put into" };
    output::text(&format!("{n} {noun} {outcome} {out}\n{summary}"))?;
    written
}

fn gc(args: &GcArgs) -> Result<()> {
    let plan = Plan::read(&args.plan)?;
    let idle = Duration::from_secs_f64(args.idle.min(1e9) * 3600.0);
    let options = GcOptions { idle, all: args.all, dry_run: args.dry_run };
    let removed = farm::gc(&args.plan, &plan, &options)?;
    let list: String = removed.iter().map(|r| format!("{}\n", r.path.display())).collect();
    let (n, verb) = (removed.len(), if args.dry_run { "would be removed" } else { "removed" });
    let mebibytes = removed.iter().map(|r| r.bytes).sum::<u64>() as f64 / f64::from(1 << 20);
    output::text(&format!("{list}{n} folders, {mebibytes:.1} MiB, {verb}\n"))
}
