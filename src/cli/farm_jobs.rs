//! `nimbus farm emit` and `submit`.

use std::fs;
use std::path::{Path, PathBuf};

use super::args::{EmitArgs, EngineArg, JobArgs, SubmitArg, SubmitArgs};
use super::output;
use crate::error::{Error, Result};
use crate::farm::emit::{Job, JobFile};
use crate::farm::plan::Plan;
use crate::farm::slurm;
use crate::farm::status::{ranges, status};
use crate::farm::synced;

pub fn emit(args: &EmitArgs) -> Result<()> {
    let (name, hint) = match args.engine {
        EngineArg::Slurm => (
            "slurm",
            "J=$(sbatch --parsable --array=INDICES shard.sh); \
             sbatch --dependency=afterany:$J merge.sh",
        ),
        EngineArg::Hyperqueue => ("hyperqueue", "bash submit.sh"),
        EngineArg::Openjd => ("openjd", "openjd run template.json, or any engine that takes such"),
        EngineArg::Local => ("local", "bash local.sh"),
    };
    let files = args.files.clone().unwrap_or_else(|| args.job.plan.join(name));
    let (written, indices) = write(&args.job, &files, args.engine)?;
    if indices.is_empty() {
        return output::text("all shards are done, nothing was written: nimbus farm merge\n");
    }
    let hint = hint.replace("INDICES", &ranges(&indices));
    output::text(&format!("{} in {}: {hint}\n", written.join(", "), files.display()))
}

pub fn submit(args: &SubmitArgs) -> Result<()> {
    let SubmitArg::Slurm = args.engine;
    let plan = absolute(&args.job.plan)?;
    let files = plan.join("slurm");
    // What every shard would say is said once.
    let planned = Plan::read(&plan)?;
    planned.scene_as_planned()?;
    if let Some(option) =
        args.job.sbatch.iter().chain(&args.job.sbatch_merge).find(|option| names_job(option))
    {
        return Err(Error::usage(format!(
            "--sbatch={option}: by names and comments `submit` tells its jobs apart"
        )));
    }
    let engine = slurm::states(&slurm::submitted(&plan)).map_err(|why| Error::Transient {
        what: format!("what is queued already is not known, nothing was submitted: {}", why.what),
    })?;
    let (queued, what): (Vec<usize>, Vec<String>) = engine.into_iter().unzip();
    if let Some(what) = what.first() {
        let shards = ranges(&queued);
        return Err(Error::usage(format!(
            "shards {shards} are with Slurm already ({what}, …): wait for them, or scancel them"
        )));
    }
    let (_, indices) = write(&args.job, &files, EngineArg::Slurm)?;
    if indices.is_empty() {
        return output::text("all shards are done, nothing was submitted\n");
    }
    let submitted = slurm::submit(&plan, &files, &indices)?;
    if args.json {
        return output::object(&submitted);
    }
    let mut text = String::new();
    for array in &submitted.arrays {
        text +=
            &format!("job {}: shards {}\n", array.job.as_deref().unwrap_or_default(), array.shards);
    }
    let folder = args.job.plan.display();
    let merge = submitted.merge.as_deref().unwrap_or_default();
    text += &format!(
        "job {merge}: the merge, after them\nfollow them: nimbus farm status --plan {folder}\n"
    );
    output::text(&text)
}

fn names_job(option: &str) -> bool {
    ["--comment", "--job-name", "-J"].iter().any(|name| option.trim_start().starts_with(name))
}

/// Writes the engine's files for what is not done: their names, and what that is.
fn write(
    args: &JobArgs,
    files: &Path,
    engine: EngineArg,
) -> Result<(Vec<&'static str>, Vec<usize>)> {
    let folder = absolute(&args.plan)?;
    let plan = Plan::read(&folder)?;
    let indices = status(&folder, &plan)?.open();
    let program = std::env::current_exe().map_err(|cause| Error::io(Path::new("nimbus"), cause))?;
    let merged = args.output.as_deref().map_or_else(|| Ok(folder.join("merged")), absolute)?;
    let job = Job {
        program: &program,
        plan: &folder,
        merged: &merged,
        indices: &indices,
        n_tries: args.tries,
        options: &args.sbatch,
        merge_options: &args.sbatch_merge,
        exclusive: !plan.is_exact(),
    };
    if indices.is_empty() {
        return Ok((Vec::new(), indices));
    }
    let made: Vec<JobFile> = match engine {
        EngineArg::Slurm => job.slurm(),
        EngineArg::Hyperqueue => job.hyperqueue(),
        EngineArg::Openjd => job.openjd(),
        EngineArg::Local => job.local(),
    };
    synced::make_folder(files)?;
    // Slurm makes none for its logs, and a job without one fails without a word.
    synced::make_folder(&folder.join("logs"))?;
    for (name, text, is_run) in &made {
        let path = files.join(name);
        synced::write(&path, text.as_bytes())?;
        if *is_run {
            make_runnable(&path)?;
        }
    }
    Ok((made.iter().map(|(name, ..)| *name).collect(), indices))
}

fn make_runnable(path: &Path) -> Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(path, fs::Permissions::from_mode(0o755))
        .map_err(|cause| Error::io(path, cause))
}

fn absolute(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path).map_err(|cause| Error::io(path, cause))
}
