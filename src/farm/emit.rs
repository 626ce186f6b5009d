//! Job files for engines that start runs: Slurm, HyperQueue, Open Job Description, and one machine. All of them do the same: a task a
//! shard, tried again where that may help, and a merge after all of them, which checks everything itself: an engine that lost a
//! task, or says that a failed one went well, is found out there.

use std::path::Path;

use serde_json::{Value, json};

use super::child::EXCLUSIVE;
use super::status::ranges;

/// What the files name.
#[derive(Debug, Clone)]
pub struct Job<'a> {
    /// The program, as every node sees it.
    pub program: &'a Path,
    pub plan: &'a Path,
    /// Where the merged result goes.
    pub merged: &'a Path,
    /// Shards to do.
    pub indices: &'a [usize],
    /// So often a shard is tried that fails in a way that may pass (exit code 75).
    pub n_tries: u32,
    /// `#SBATCH` lines, as given.
    pub options: &'a [String],
    /// Times are taken: a node is one shard's alone.
    pub exclusive: bool,
}

/// A file: name, content, whether it is run.
pub type JobFile = (&'static str, String, bool);

impl Job<'_> {
    /// A shard, by the array's task and an offset (arrays are shorter than plans may be), and the merge.
    ///
    /// A task that fails is not queued again by Slurm itself, and one that is may run while the node that was thought dead finishes it:
    /// both are as good.
    pub fn slurm(&self) -> Vec<JobFile> {
        let options: String = self.options.iter().map(|option| format!("#SBATCH {option}\n")).collect();
        let (alone, say_so) = match self.exclusive {
            true => ("#SBATCH --exclusive\n", format!("export {EXCLUSIVE}=1\n")),
            false => ("", String::new()),
        };
        let logs = self.plan.join("logs");
        let again = self.n_tries - 1;
        let shard = format!(
            "#!/bin/bash\n\
             # One shard of {plan} a task. Submit: sbatch --array=INDICES shard.sh [OFFSET]; shard = OFFSET + index.\n\
             #SBATCH --job-name=nimbus-farm\n\
             #SBATCH --requeue\n\
             #SBATCH --open-mode=append\n\
             #SBATCH --output={log}\n\
             {alone}\
             {options}\
             set -u\n\
             # Slurm takes the node back: nimbus is told as well, keeps what it has and ends with 75.\n\
             trap : TERM\n\
             {say_so}\
             shard=$((${{1:-0}} + SLURM_ARRAY_TASK_ID))\n\
             {run}\n\
             code=$?\n\
             # 75: another try may go well. Slurm queues nothing again that has failed.\n\
             if [ \"$code\" -eq 75 ] && [ \"${{SLURM_RESTART_COUNT:-0}}\" -lt {again} ]; then\n    \
                 scontrol requeue \"${{SLURM_ARRAY_JOB_ID}}_${{SLURM_ARRAY_TASK_ID}}\" && sleep 60\n\
             fi\n\
             exit \"$code\"\n",
            plan = self.plan.display(),
            log = log_name(&logs, "%A_%a.log"),
            run = self.run("\"$shard\""),
        );
        let merge = format!(
            "#!/bin/bash\n\
             # Submit: sbatch --dependency=afterok:ARRAY --kill-on-invalid-dep=yes merge.sh\n\
             #SBATCH --job-name=nimbus-merge\n\
             #SBATCH --requeue\n\
             #SBATCH --open-mode=append\n\
             #SBATCH --output={log}\n\
             {options}\
             exec {merge}\n",
            log = log_name(&logs, "merge-%j.log"),
            merge = self.merge(),
        );
        vec![("shard.sh", shard, true), ("merge.sh", merge, true)]
    }

    /// HyperQueue: `hq job wait` is content with tasks that failed; the merge is not.
    pub fn hyperqueue(&self) -> Vec<JobFile> {
        let shard = format!("#!/bin/bash\nset -u\n{}", self.tried("\"$HQ_TASK_ID\""));
        let submit = format!(
            "#!/bin/bash\n\
             # All shards by HyperQueue, then the merge, which fails where one is missing.\n\
             set -eu\n\
             cd \"$(dirname \"$0\")\"\n\
             hq submit --wait --name nimbus-farm --array {array} --crash-limit {tries} -- bash \"$PWD/shard.sh\"\n\
             {merge}\n",
            array = ranges(self.indices),
            tries = self.n_tries,
            merge = self.merge(),
        );
        vec![("shard.sh", shard, true), ("submit.sh", submit, true)]
    }

    /// A job template of Open Job Description (2023-09), which JSON is a form of.
    pub fn openjd(&self) -> Vec<JobFile> {
        let script = |text: String| {
            json!({
                "actions": {"onRun": {"command": "bash", "args": ["{{Task.File.Run}}"]}},
                "embeddedFiles": [{"name": "Run", "type": "TEXT", "data": text}],
            })
        };
        let template: Value = json!({
            "specificationVersion": "jobtemplate-2023-09",
            "name": "nimbus-farm",
            "steps": [
                {
                    "name": "Shards",
                    "parameterSpace": {
                        "taskParameterDefinitions": [{"name": "Shard", "type": "INT", "range": ranges(self.indices)}],
                    },
                    "script": script(format!("set -u\n{}", self.tried("{{Task.Param.Shard}}"))),
                },
                {
                    "name": "Merge",
                    "dependencies": [{"dependsOn": "Shards"}],
                    "script": script(format!("exec {}\n", self.merge())),
                },
            ],
        });
        vec![("template.json", format!("{template:#}\n"), false)]
    }

    /// This machine.
    pub fn local(&self) -> Vec<JobFile> {
        let (program, plan) = (quoted(self.program), quoted(self.plan));
        let text = format!(
            "#!/bin/bash\n# All shards here, then the merge.\nset -eu\n\
             {program} farm local --plan {plan} --tries {} \"$@\"\n{}\n",
            self.n_tries,
            self.merge()
        );
        vec![("local.sh", text, true)]
    }

    fn run(&self, shard: &str) -> String {
        format!("{} farm run --plan {} --shard {shard}", quoted(self.program), quoted(self.plan))
    }

    fn merge(&self) -> String {
        let [program, plan, merged] = [self.program, self.plan, self.merged].map(quoted);
        format!("{program} farm merge --plan {plan} -o {merged} --force")
    }

    /// The run, again as long as it fails in a way that may pass; for engines that try nothing again.
    fn tried(&self, shard: &str) -> String {
        format!(
            "for try in $(seq {}); do\n    {}\n    code=$?\n    [ \"$code\" -eq 75 ] || break\n    sleep $((10 * try))\ndone\nexit \"$code\"\n",
            self.n_tries,
            self.run(shard)
        )
    }
}

/// As sbatch takes it: a word, in which `%` begins what it fills in.
fn log_name(logs: &Path, name: &str) -> String {
    format!("\"{}/{name}\"", logs.display().to_string().replace('%', "%%"))
}

/// As a shell takes it for one word.
pub fn quoted(path: &Path) -> String {
    format!("'{}'", path.display().to_string().replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use std::process::{Command, Stdio};

    use super::*;

    /// A program that writes its arguments into `log` and fails with 75 the first time.
    fn program(folder: &Path) -> std::path::PathBuf {
        use std::os::unix::fs::PermissionsExt;
        let program = folder.join("it's a program");
        let log = quoted(&folder.join("log"));
        let text = format!("#!/bin/bash\necho \"$@\" >> {log}\n[ \"$(wc -l < {log})\" -gt 1 ] || exit 75\n");
        std::fs::write(&program, text).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
        program
    }

    fn bash(folder: &Path, text: &str, variables: &[(&str, &str)]) -> (Option<i32>, String) {
        let script = folder.join("script.sh");
        std::fs::write(&script, text.replace("sleep", ": sleep")).unwrap();
        let mut command = Command::new("bash");
        command.arg(&script).envs(variables.iter().copied()).stdout(Stdio::null());
        command.env("PATH", format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default()));
        let code = command.status().unwrap().code();
        (code, std::fs::read_to_string(folder.join("log")).unwrap_or_default())
    }

    #[test]
    fn files_do_what_their_engine_is_to_do() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        let (program, plan, merged) = (program(folder), folder.join("a plan"), folder.join("m"));
        let options = ["--gres=gpu:1".to_owned()];
        let indices = [0, 2, 3, 4, 9];
        let job = Job {
            program: &program,
            plan: &plan,
            merged: &merged,
            indices: &indices,
            n_tries: 3,
            options: &options,
            exclusive: false,
        };
        let run = |i: u32| format!("farm run --plan {} --shard {i}\n", plan.display());
        let merge = format!("farm merge --plan {} -o {} --force\n", plan.display(), merged.display());
        let clear = || std::fs::remove_file(folder.join("log")).unwrap_or(());

        let [(_, shard, _), (_, merging, _)] = job.slurm().try_into().unwrap();
        assert!(shard.contains("#SBATCH --gres=gpu:1\n") && shard.contains("a plan/logs/%A_%a.log\"\n"));
        // scontrol is asked once for what may pass, and not where it was tried often enough.
        std::fs::write(
            folder.join("scontrol"),
            format!("#!/bin/bash\necho scontrol \"$@\" >> {}\n", quoted(&folder.join("log"))),
        )
        .unwrap();
        Command::new("chmod").arg("+x").arg(folder.join("scontrol")).status().unwrap();
        let of = [("SLURM_ARRAY_TASK_ID", "3"), ("SLURM_ARRAY_JOB_ID", "17")];
        let first = (Some(75), format!("{}scontrol requeue 17_3\n", run(3)));
        assert_eq!(bash(folder, &shard, &of), first);
        clear();
        assert_eq!(bash(folder, &shard, &[of[0], of[1], ("SLURM_RESTART_COUNT", "2")]), (Some(75), run(3)));
        assert_eq!(bash(folder, &shard, &of), (Some(0), run(3).repeat(2)));
        clear();
        assert_eq!(bash(folder, &merging, &[]), (Some(75), merge.clone()));
        clear();

        let [(_, shard, _), (_, submit, _)] = job.hyperqueue().try_into().unwrap();
        assert!(submit.contains("--array 0,2-4,9 "), "{submit}");
        assert_eq!(bash(folder, &shard, &[("HQ_TASK_ID", "4")]), (Some(0), run(4).repeat(2)));
        clear();

        let [(_, template, _)] = job.openjd().try_into().unwrap();
        let template: Value = serde_json::from_str(&template).unwrap();
        let steps = &template["steps"];
        assert_eq!(steps[0]["parameterSpace"]["taskParameterDefinitions"][0]["range"], "0,2-4,9");
        let text = |i: usize| steps[i]["script"]["embeddedFiles"][0]["data"].as_str().unwrap().to_owned();
        let filled = text(0).replace("{{Task.Param.Shard}}", "9");
        assert_eq!(bash(folder, &filled, &[]), (Some(0), run(9).repeat(2)));
        assert_eq!(bash(folder, &text(1), &[]), (Some(0), run(9).repeat(2) + &merge));
        clear();

        let [(_, text, _)] = job.local().try_into().unwrap();
        let local = format!("farm local --plan {} --tries 3\n", plan.display());
        assert_eq!(bash(folder, &text, &[]), (Some(75), local.clone()));
        assert_eq!(bash(folder, &text, &[]), (Some(0), local.repeat(2) + &merge));
    }
}
