//! Names of this machine and of the Slurm task that this process belongs to.

use std::env;

use crate::io::process_info::host_name;

/// Separates a task's name from the number of its restart.
const RESTART: &str = " restart ";

/// Returns this machine's name, as Slurm or else the kernel has it. All its characters may stand
/// in a file name.
pub fn node_name() -> String {
    let name = variable("SLURMD_NODENAME").or_else(host_name);
    let fit = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '-' };
    let name: String = name.unwrap_or_default().trim().chars().map(fit).collect();
    if name.is_empty() { "node".to_owned() } else { name }
}

/// Returns Slurm's name for the task that this process belongs to, such as "17_3 restart 1".
/// Without Slurm there is none.
pub fn job_name() -> Option<String> {
    let id = match (variable("SLURM_ARRAY_JOB_ID"), variable("SLURM_ARRAY_TASK_ID")) {
        (Some(job), Some(task)) => format!("{job}_{task}"),
        _ => variable("SLURM_JOB_ID")?,
    };
    Some(variable("SLURM_RESTART_COUNT").map_or(id.clone(), |n| format!("{id}{RESTART}{n}")))
}

/// Returns a job's name without its restart.
pub fn task_of(job: &str) -> &str {
    job.split_once(RESTART).map_or(job, |(task, _)| task)
}

/// Returns how often Slurm has started this task again.
pub fn n_restarts() -> usize {
    variable("SLURM_RESTART_COUNT").and_then(|n| n.parse().ok()).unwrap_or(0)
}

fn variable(name: &str) -> Option<String> {
    env::var(name).ok()
}
