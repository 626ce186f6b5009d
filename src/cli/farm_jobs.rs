//! `nimbus farm emit` and `nimbus farm submit`.

use std::path::{Path, PathBuf};

use super::args::{EmitArgs, EngineArg, JobArgs, SubmitArg, SubmitArgs};
use super::output;
use crate::error::{Error, Result};
use crate::farm::slurm::{self, Job, Script};
use crate::farm::{Plan, Status, process, ranges};
use crate::io::atomic;

/// Runs `nimbus farm emit`.
///
/// # Errors
/// When the plan cannot be read or a script cannot be written.
pub fn emit(args: &EmitArgs) -> Result<()> {
    let name = match args.engine {
        EngineArg::Slurm => "slurm",
        EngineArg::Local => "local",
    };
    let files = args.files.clone().unwrap_or_else(|| args.job.plan.join(name));
    let Some((scripts, status)) = write(&args.job, &files, args.engine)? else {
        return output::text("all shards are done, nothing was written: nimbus farm merge\n");
    };
    let hint = match args.engine {
        EngineArg::Slurm => format!(
            "J=$(sbatch --parsable --array={} shard.sh); sbatch --dependency=afterany:$J merge.sh",
            status.missing()
        ),
        EngineArg::Local => "bash local.sh".to_owned(),
    };
    let names: Vec<&str> = scripts.iter().map(|script| script.name).collect();
    output::text(&format!("{} in {}: {hint}\n", names.join(", "), files.display()))
}

/// Runs `nimbus farm submit`.
///
/// # Errors
/// When the plan is stale, shards of it are queued already, or Slurm refuses them.
pub fn submit(args: &SubmitArgs) -> Result<()> {
    let SubmitArg::Slurm = args.engine;
    let folder = absolute(&args.job.plan)?;
    let files = folder.join("slurm");
    // A stale plan is refused here, and not once by every shard.
    Plan::read(&folder)?.scene_as_planned()?;
    let mut options = args.job.sbatch.iter().chain(&args.job.sbatch_merge);
    if let Some(option) = options.find(|option| names_job(option)) {
        return Err(Error::usage(format!(
            "--sbatch={option}: `submit` sets names and comments, by which it finds its jobs"
        )));
    }
    let queued = slurm::states(&folder).map_err(|failure| {
        let what = failure.what;
        Error::Transient {
            what: format!("Slurm does not tell what is queued, nothing was submitted: {what}"),
        }
    })?;
    if let Some(state) = queued.values().next() {
        let shards = ranges(&queued.keys().copied().collect::<Vec<usize>>());
        return Err(Error::usage(format!(
            "shards {shards} are with Slurm already ({state}, …): wait for them, or scancel them"
        )));
    }
    let Some((_, status)) = write(&args.job, &files, EngineArg::Slurm)? else {
        return output::text("all shards are done, nothing was submitted\n");
    };
    let submission = slurm::submit(&folder, &files, &status.open())?;
    if args.json {
        return output::object(&submission);
    }
    let line = |array: &slurm::Array| {
        format!("job {}: shards {}\n", array.job.as_deref().unwrap_or_default(), array.shards)
    };
    output::text(&format!(
        "{}job {}: the merge, after them\nfollow them: nimbus farm status --plan {}\n",
        submission.arrays.iter().map(line).collect::<String>(),
        submission.merge.as_deref().unwrap_or_default(),
        args.job.plan.display()
    ))
}

fn names_job(option: &str) -> bool {
    ["--comment", "--job-name", "-J"].iter().any(|name| option.trim_start().starts_with(name))
}

/// Writes the scripts for the shards that are not done. Returns none where all are done.
fn write(args: &JobArgs, files: &Path, engine: EngineArg) -> Result<Option<(Vec<Script>, Status)>> {
    let folder = absolute(&args.plan)?;
    let plan = Plan::read(&folder)?;
    let status = Status::new(&folder, &plan)?;
    if status.open().is_empty() {
        return Ok(None);
    }
    let merged = args.output.as_deref().map_or_else(|| Ok(folder.join("merged")), absolute)?;
    let job = Job {
        program: &process::program()?,
        plan: &folder,
        merged: &merged,
        n_tries: args.tries,
        sbatch: &args.sbatch,
        sbatch_merge: &args.sbatch_merge,
        is_exclusive: !plan.work.is_exact(),
    };
    let scripts = match engine {
        EngineArg::Slurm => job.slurm(),
        EngineArg::Local => job.local(),
    };
    atomic::make_folder(files)?;
    // Slurm does not make the folder of its logs: without it jobs fail silently.
    atomic::make_folder(&folder.join("logs"))?;
    for Script { name, text } in &scripts {
        let path = files.join(name);
        atomic::write_synced(&path, text.as_bytes())?;
        atomic::make_executable(&path)?;
    }
    Ok(Some((scripts, status)))
}

fn absolute(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path).map_err(|cause| Error::io(path, cause))
}
