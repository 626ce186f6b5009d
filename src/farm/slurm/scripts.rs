//! Job scripts for Slurm and for a single machine.
//!
//! They run each shard, again where that may help, and then the merge, which checks that every
//! result is there.

use std::path::Path;

use crate::farm::process::EXCLUSIVE;

const SHARD: &str = include_str!("shard.sh");
const MERGE: &str = include_str!("merge.sh");
const REQUEUE: &str = include_str!("requeue.sh");

/// The values that job scripts contain.
#[derive(Debug, Clone)]
pub struct Job<'a> {
    /// The program, under a path that every node sees.
    pub program: &'a Path,
    /// The plan's folder.
    pub plan: &'a Path,
    /// The folder of the merged result.
    pub merged: &'a Path,
    /// The number of tries of a shard, or of the merge, that fails transiently (exit code 75).
    pub n_tries: u32,
    /// Options for sbatch of the shards. The merge gets --account, --partition, --qos and
    /// --reservation.
    pub sbatch: &'a [String],
    /// Further options for sbatch of the merge.
    pub sbatch_merge: &'a [String],
    /// Whether each shard has its node to itself, because times are measured.
    pub is_exclusive: bool,
}

/// An executable file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Script {
    /// Its name.
    pub name: &'static str,
    /// Its content.
    pub text: String,
}

impl Job<'_> {
    /// Returns the scripts for a shard, numbered by the array's task and an offset, and for the
    /// merge.
    pub fn slurm(&self) -> Vec<Script> {
        let (alone, export) = match self.is_exclusive {
            true => (Some("--exclusive".to_owned()), format!("export {EXCLUSIVE}=1")),
            false => (None, String::new()),
        };
        let of_shard: Vec<&String> = alone.iter().chain(self.sbatch).collect();
        let of_merge: Vec<&String> = self
            .sbatch
            .iter()
            .filter(|option| is_for_merge(option))
            .chain(self.sbatch_merge)
            .collect();
        let shard = SHARD
            .replace("@export@", &export)
            .replace("@requeue@", REQUEUE.trim_end())
            .replace("@run@", &self.run())
            .replace("@log@", &self.log("%A_%a.log"))
            .replace("@options@", &lines(&of_shard));
        let merge = MERGE
            .replace("@restarts@", &(self.n_tries - 1).to_string())
            .replace("@requeue@", REQUEUE.trim_end())
            .replace("@merge@", &self.merge())
            .replace("@log@", &self.log("merge-%j.log"))
            .replace("@options@", &lines(&of_merge));
        vec![Script { name: "shard.sh", text: shard }, Script { name: "merge.sh", text: merge }]
    }

    /// Returns a script that does all shards on one machine, and the merge.
    pub fn local(&self) -> Vec<Script> {
        let [program, plan] = [self.program, self.plan].map(quoted);
        let (tries, merge) = (self.n_tries, self.merge());
        let text = format!(
            "#!/bin/bash\n# Does all shards on this machine, then merges them.\nset -eu\n\
             {program} farm local --plan {plan} --tries {tries} \"$@\"\n{merge}\n"
        );
        vec![Script { name: "local.sh", text }]
    }

    fn run(&self) -> String {
        let ([program, plan], tries) = ([self.program, self.plan].map(quoted), self.n_tries);
        format!("{program} farm run --plan {plan} --shard \"$shard\" --tries {tries}")
    }

    fn merge(&self) -> String {
        let [program, plan, merged] = [self.program, self.plan, self.merged].map(quoted);
        format!("{program} farm merge --plan {plan} -o {merged} --force")
    }

    /// Returns the path of a log as sbatch takes it: as a word in which `%` begins a field.
    fn log(&self, name: &str) -> String {
        let folder = self.plan.join("logs").display().to_string().replace('%', "%%");
        format!("\"{folder}/{name}\"")
    }
}

fn lines(options: &[&String]) -> String {
    options.iter().map(|option| format!("#SBATCH {option}")).collect::<Vec<_>>().join("\n")
}

/// Whether an option of the shards holds for the merge, too: it tells where jobs run and who pays.
fn is_for_merge(option: &str) -> bool {
    const LONG: [&str; 4] = ["--account", "--partition", "--qos", "--reservation"];
    let option = option.trim_start();
    let name = option.split(['=', ' ']).next().unwrap_or_default();
    LONG.contains(&name) || ["-A", "-p", "-q"].iter().any(|short| option.starts_with(short))
}

/// Returns a path as a single word of a shell.
fn quoted(path: &Path) -> String {
    format!("'{}'", path.display().to_string().replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests;
