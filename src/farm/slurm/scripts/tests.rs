use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::*;

/// An executable script in `folder`.
fn tool(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, format!("#!/bin/bash\n{text}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path
}

/// A bash that finds the tools in `folder` first.
fn bash(folder: &Path, script: &Path) -> Command {
    let path = std::env::var("PATH").unwrap_or_default();
    let mut command = Command::new("bash");
    command.arg(script).env("PATH", format!("{}:{path}", folder.display()));
    command
}

fn job<'a>(program: &'a Path, plan: &'a Path, merged: &'a Path) -> Job<'a> {
    Job { program, plan, merged, n_tries: 3, sbatch: &[], sbatch_merge: &[], is_exclusive: false }
}

/// Slurm may signal the shell alone: it passes the signal on, and exits with the program's code.
#[test]
fn a_shard_s_program_gets_the_signal_of_its_shell() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let fifo = folder.join("up");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    let text = format!(
        "trap 'kill $!; echo signalled > \"$0.log\"; exit 75' TERM\n\
         sleep 900 &\necho > {}\nwait",
        quoted(&fifo)
    );
    let program = tool(folder, "program", &text);
    tool(folder, "squeue", "echo COMPLETING None");
    let script = tool(folder, "shard.sh", &job(&program, folder, folder).slurm()[0].text);
    let mut command = bash(folder, &script);
    command.envs([("SLURM_ARRAY_TASK_ID", "3"), ("SLURM_ARRAY_JOB_ID", "17")]);
    let mut child = command.spawn().unwrap();
    // The program opens the pipe once its trap is set.
    fs::read(&fifo).unwrap();
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(75));
    assert_eq!(fs::read_to_string(folder.join("program.log")).unwrap(), "signalled\n");
}

/// A folder with a program that logs its arguments and fails with 75 the first time.
struct Tools {
    dir: tempfile::TempDir,
    program: PathBuf,
}

impl Tools {
    fn new() -> Tools {
        let dir = tempfile::tempdir().unwrap();
        let log = quoted(&dir.path().join("log"));
        let text = format!("echo \"$@\" >> {log}\n[ \"$(wc -l < {log})\" -gt 1 ] || exit 75");
        let program = tool(dir.path(), "it's a program", &text);
        tool(dir.path(), "scontrol", &format!("echo scontrol \"$@\" >> {log}"));
        let asked = "[ \"$3 $4 $5\" = '%T %r -j 17_3' ] || [ \"$5\" = 18 ] || exit 1";
        tool(dir.path(), "squeue", &format!("{asked}; echo \"$STATE\""));
        Tools { dir, program }
    }

    fn clear(&self) {
        let _ = fs::remove_file(self.dir.path().join("log"));
    }

    /// Runs a script without its pauses. Returns its exit code and the whole log.
    fn run(&self, text: &str, variables: &[(&str, &str)]) -> (Option<i32>, String) {
        let folder = self.dir.path();
        let script = folder.join("script.sh");
        fs::write(&script, text.replace("sleep", ": sleep")).unwrap();
        let mut command = bash(folder, &script);
        let status = command.envs(variables.iter().copied()).stdout(Stdio::null()).status();
        let log = fs::read_to_string(folder.join("log")).unwrap_or_default();
        (status.unwrap().code(), log)
    }
}

#[test]
fn options_of_sbatch_are_in_the_scripts() {
    let folder = Path::new("a plan");
    let sbatch = ["--gres=gpu:1", "--partition=a", "-A me", "--time=9"].map(str::to_owned);
    let sbatch_merge = ["--time=5".to_owned()];
    let base = job(folder, folder, folder);
    let job = Job { sbatch: &sbatch, sbatch_merge: &sbatch_merge, is_exclusive: true, ..base };
    let [shard, merge] = job.slurm().try_into().unwrap();
    for line in ["#SBATCH --exclusive\n#SBATCH --gres=gpu:1\n", "export NIMBUS_EXCLUSIVE=1\n"] {
        assert!(shard.text.contains(line), "{}", shard.text);
    }
    assert!(shard.text.contains("a plan/logs/%A_%a.log\"\n"), "{}", shard.text);
    let expected =
        "merge-%j.log\"\n#SBATCH --partition=a\n#SBATCH -A me\n#SBATCH --time=5\nset -u\n";
    assert!(merge.text.contains(expected), "{}", merge.text);
}

#[test]
fn transient_failures_are_queued_again_unless_the_job_was_cancelled() {
    let tools = Tools::new();
    let (plan, merged) = (tools.dir.path().join("a plan"), tools.dir.path().join("m"));
    let [shard, merging] = job(&tools.program, &plan, &merged).slurm().try_into().unwrap();
    let run = format!("farm run --plan {} --shard 3 --tries 3\n", plan.display());
    let merge = format!("farm merge --plan {} -o {} --force\n", plan.display(), merged.display());

    let task =
        |state| [("SLURM_ARRAY_TASK_ID", "3"), ("SLURM_ARRAY_JOB_ID", "17"), ("STATE", state)];
    for state in ["RUNNING None", "COMPLETING TimeLimit"] {
        let expected = (Some(75), format!("{run}scontrol requeue 17_3\n"));
        assert_eq!(tools.run(&shard.text, &task(state)), expected, "{state}");
        tools.clear();
    }
    for state in ["COMPLETING None", ""] {
        assert_eq!(tools.run(&shard.text, &task(state)), (Some(75), run.clone()), "{state}");
        assert_eq!(tools.run(&shard.text, &task(state)), (Some(0), run.repeat(2)));
        tools.clear();
    }

    let task = |restarts| {
        [("SLURM_JOB_ID", "18"), ("STATE", "RUNNING None"), ("SLURM_RESTART_COUNT", restarts)]
    };
    let expected = (Some(75), format!("{merge}scontrol requeue 18\n"));
    assert_eq!(tools.run(&merging.text, &task("1")), expected);
    tools.clear();
    assert_eq!(tools.run(&merging.text, &task("2")), (Some(75), merge.clone()));
    assert_eq!(tools.run(&merging.text, &task("1")), (Some(0), merge.repeat(2)));
}

#[test]
fn the_local_script_does_all_shards_and_merges_them() {
    let tools = Tools::new();
    let (plan, merged) = (tools.dir.path().join("a plan"), tools.dir.path().join("m"));
    let [script] = job(&tools.program, &plan, &merged).local().try_into().unwrap();
    let local = format!("farm local --plan {} --tries 3\n", plan.display());
    let merge = format!("farm merge --plan {} -o {} --force\n", plan.display(), merged.display());
    assert_eq!(tools.run(&script.text, &[]), (Some(75), local.clone()));
    assert_eq!(tools.run(&script.text, &[]), (Some(0), local.repeat(2) + &merge));
}
