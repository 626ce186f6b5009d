//! Job files for engines that start runs: Slurm, HyperQueue, Open Job Description, and one machine.
//! All of them do the same: a task a shard, tried again where that may help, and a merge after all
//! of them, which checks everything itself: an engine that lost a task, or says that a failed one
//! went well, is found out there.

use std::path::Path;

use serde_json::{Value, json};

use super::child::EXCLUSIVE;
use super::slurm::{MERGE, SHARDS};
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
    /// So often a shard, or the merge, is tried that fails in a way that may pass (exit code 75).
    pub n_tries: u32,
    /// `#SBATCH` lines of the shards, as given; the merge has those of them that say where and for
    /// whom it runs.
    pub options: &'a [String],
    /// And these.
    pub merge_options: &'a [String],
    /// Times are taken: a node is one shard's alone.
    pub exclusive: bool,
}

/// A file: name, content, whether it is run.
pub type JobFile = (&'static str, String, bool);

impl Job<'_> {
    /// A shard, by the array's task and an offset (arrays are shorter than plans may be), and the
    /// merge.
    ///
    /// A task that fails is not queued again by Slurm itself, and one that is may run while the
    /// node that was thought dead finishes it: both are as good.
    pub fn slurm(&self) -> Vec<JobFile> {
        vec![("shard.sh", self.slurm_shard(), true), ("merge.sh", self.slurm_merge(), true)]
    }

    fn slurm_shard(&self) -> String {
        let (alone, say_so) = match self.exclusive {
            true => ("#SBATCH --exclusive\n", format!("export {EXCLUSIVE}=1\n")),
            false => ("", String::new()),
        };
        let comment = format!(
            "# One shard of {} a task. Submit: sbatch --array=INDICES shard.sh [OFFSET]; shard = \
             OFFSET + index.\n",
            self.plan.display()
        );
        format!(
            "#!/bin/bash\n\
             {comment}\
             {head}\
             {alone}\
             {options}\
             set -u\n\
             {say_so}\
             shard=$((${{1:-0}} + SLURM_ARRAY_TASK_ID))\n\
             # Slurm takes the node back: nimbus finishes its frame, keeps what it has and ends \
             with 75. Some of\n\
             # Slurm's ways tell this shell alone, others nimbus as well, which takes both for \
             one.\n\
             told=0 child=\n\
             trap 'told=1; [ -z \"$child\" ] || kill -TERM \"$child\" 2> /dev/null' TERM\n\
             {run} --tries {tries} &\n\
             child=$!\n\
             wait \"$child\"\n\
             code=$?\n\
             # The signal has ended the wait, and not nimbus.\n\
             while [ \"$told\" -eq 1 ]; do\n    told=0\n    wait \"$child\"\n    code=$?\ndone\n\
             # 75: another try may go well, and it has not failed too often.\n\
             {again}\
             exit \"$code\"\n",
            head = head(SHARDS, &log_name(&self.plan.join("logs"), "%A_%a.log")),
            options = lines(self.options),
            run = self.run("\"$shard\""),
            tries = self.n_tries,
            again = again("[ \"$code\" -eq 75 ]", "${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}"),
        )
    }

    fn slurm_merge(&self) -> String {
        let kept: Vec<String> =
            self.options.iter().filter(|option| is_for_all(option)).cloned().collect();
        let may_pass = format!(
            "[ \"$code\" -eq 75 ] && [ \"${{SLURM_RESTART_COUNT:-0}}\" -lt {} ]",
            self.n_tries - 1
        );
        format!(
            "#!/bin/bash\n\
             # Submit: sbatch --dependency=afterany:ARRAY merge.sh\n\
             {head}\
             {options}\
             set -u\n\
             {merge}\n\
             code=$?\n\
             {again}\
             exit \"$code\"\n",
            head = head(MERGE, &log_name(&self.plan.join("logs"), "merge-%j.log")),
            options = lines(&kept) + &lines(self.merge_options),
            merge = self.merge(),
            again = again(&may_pass, "${SLURM_JOB_ID}"),
        )
    }

    /// HyperQueue: `hq job wait` is content with tasks that failed; the merge is not.
    pub fn hyperqueue(&self) -> Vec<JobFile> {
        let shard = format!("#!/bin/bash\nset -u\n{}", self.tried("\"$HQ_TASK_ID\""));
        let submit = format!(
            "#!/bin/bash\n\
             # All shards by HyperQueue, then the merge, which fails where one is missing.\n\
             set -eu\n\
             cd \"$(dirname \"$0\")\"\n\
             hq submit --wait --name nimbus-farm --array {array} --crash-limit {tries} -- \
             bash \"$PWD/shard.sh\"\n\
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

    /// The run, again as long as it fails in a way that may pass; for engines that try nothing
    /// again.
    fn tried(&self, shard: &str) -> String {
        format!(
            "for try in $(seq {}); do\n    {}\n    code=$?\n    [ \"$code\" -eq 75 ] || break\n    \
             sleep $((10 * try))\ndone\nexit \"$code\"\n",
            self.n_tries,
            self.run(shard)
        )
    }
}

fn head(name: &str, log: &str) -> String {
    format!(
        "#SBATCH --job-name={name}\n#SBATCH --requeue\n#SBATCH --open-mode=append\n#SBATCH \
         --output={log}\n"
    )
}

fn lines(options: &[String]) -> String {
    options.iter().map(|option| format!("#SBATCH {option}\n")).collect()
}

/// Options of shards that hold for the merge as well: where it may run, and who pays. What shards
/// need there it does not.
fn is_for_all(option: &str) -> bool {
    const LONG: [&str; 4] = ["--account", "--partition", "--qos", "--reservation"];
    let option = option.trim_start();
    let name = option.split(['=', ' ']).next().unwrap_or_default();
    LONG.contains(&name) || ["-A", "-p", "-q"].iter().any(|short| option.starts_with(short))
}

/// Has Slurm queue a job again, which it does with nothing that has failed. A job that is cancelled
/// gets the same signal as one whose time is up, and could be queued again like it: its reason
/// tells. One that Slurm itself has queued again has none, too.
fn again(may_pass: &str, job: &str) -> String {
    format!(
        "# Slurm queues nothing again that has failed. What was cancelled stays so, and what it \
         has queued itself.\n\
         if {may_pass}; then\n    \
             for _ in 1 2 3 4 5 6; do\n        \
                 case $(squeue -h -o '%T %r' -j \"{job}\" || echo silent) in\n            \
                     RUNNING* | 'COMPLETING TimeLimit')\n                \
                         scontrol requeue \"{job}\" && sleep 60 && break\n                \
                         ;;\n            \
                     silent) ;;\n            \
                     *) break ;;\n        \
                 esac\n        \
                 sleep 10\n    \
             done\n\
         fi\n"
    )
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

    fn tool(folder: &Path, name: &str, text: &str) -> std::path::PathBuf {
        use std::os::unix::fs::PermissionsExt;
        let path = folder.join(name);
        std::fs::write(&path, format!("#!/bin/bash\n{text}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        path
    }

    /// A program that writes its arguments into `log` and fails with 75 the first time.
    fn program(folder: &Path) -> std::path::PathBuf {
        let log = quoted(&folder.join("log"));
        tool(
            folder,
            "it's a program",
            &format!("echo \"$@\" >> {log}\n[ \"$(wc -l < {log})\" -gt 1 ] || exit 75"),
        )
    }

    fn bash(folder: &Path, text: &str, variables: &[(&str, &str)]) -> (Option<i32>, String) {
        let script = folder.join("script.sh");
        std::fs::write(&script, text.replace("sleep", ": sleep")).unwrap();
        let mut command = Command::new("bash");
        command.arg(&script).envs(variables.iter().copied()).stdout(Stdio::null());
        command.env(
            "PATH",
            format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default()),
        );
        let code = command.status().unwrap().code();
        (code, std::fs::read_to_string(folder.join("log")).unwrap_or_default())
    }

    /// Slurm tells the shell alone, or all that it runs: the program hears of it, and its code is
    /// the script's.
    #[test]
    fn a_shard_s_program_is_told_when_the_node_is_taken_back() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        let text = "trap 'sleep 0.3; echo told >> \"$0.log\"; exit 75' \
            TERM\ntouch \"$0.up\"\nsleep 20 & wait; wait";
        let program = tool(folder, "program", text);
        tool(folder, "squeue", "echo COMPLETING None");
        let job = Job {
            program: &program,
            plan: folder,
            merged: folder,
            indices: &[3],
            n_tries: 3,
            options: &[],
            merge_options: &[],
            exclusive: true,
        };
        let script = tool(folder, "shard.sh", &job.slurm()[0].1);
        let mut command = Command::new(&script);
        command.envs([("SLURM_ARRAY_TASK_ID", "3"), ("SLURM_ARRAY_JOB_ID", "17")]);
        command.env(
            "PATH",
            format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default()),
        );
        let mut child = command.spawn().unwrap();
        let begin = std::time::Instant::now();
        while !folder.join("program.up").exists() {
            assert!(begin.elapsed().as_secs() < 20);
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        assert!(
            Command::new("kill")
                .args(["-TERM", &child.id().to_string()])
                .status()
                .unwrap()
                .success()
        );
        assert_eq!(child.wait().unwrap().code(), Some(75));
        assert_eq!(std::fs::read_to_string(folder.join("program.log")).unwrap(), "told\n");
    }

    #[test]
    fn files_do_what_their_engine_is_to_do() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        let (program, plan, merged) = (program(folder), folder.join("a plan"), folder.join("m"));
        let options = ["--gres=gpu:1", "--partition=a", "-A me", "--time=9"].map(str::to_owned);
        let merge_options = ["--time=5".to_owned()];
        let indices = [0, 2, 3, 4, 9];
        let job = Job {
            program: &program,
            plan: &plan,
            merged: &merged,
            indices: &indices,
            n_tries: 3,
            options: &options,
            merge_options: &merge_options,
            exclusive: false,
        };
        let run = |i: u32| format!("farm run --plan {} --shard {i}\n", plan.display());
        let merge =
            format!("farm merge --plan {} -o {} --force\n", plan.display(), merged.display());
        let clear = || std::fs::remove_file(folder.join("log")).unwrap_or(());

        let [(_, shard, _), (_, merging, _)] = job.slurm().try_into().unwrap();
        assert!(
            shard.contains("#SBATCH --gres=gpu:1\n") && shard.contains("a plan/logs/%A_%a.log\"\n")
        );
        assert!(merging.contains(
            "merge-%j.log\"\n#SBATCH --partition=a\n#SBATCH -A me\n#SBATCH --time=5\nset -u\n"
        ));
        // What may pass is queued again, unless Slurm says that it was cancelled.
        tool(
            folder,
            "scontrol",
            &format!("echo scontrol \"$@\" >> {}", quoted(&folder.join("log"))),
        );
        tool(
            folder,
            "squeue",
            "[ \"$3 $4 $5\" = '%T %r -j 17_3' ] || [ \"$5\" = 18 ] || exit 1; echo \"$SAYS\"",
        );
        let run_3 = format!("{} --tries 3\n", run(3).trim_end());
        let says =
            |says| [("SLURM_ARRAY_TASK_ID", "3"), ("SLURM_ARRAY_JOB_ID", "17"), ("SAYS", says)];
        for state in ["RUNNING None", "COMPLETING TimeLimit"] {
            let first = (Some(75), format!("{run_3}scontrol requeue 17_3\n"));
            assert_eq!(bash(folder, &shard, &says(state)), first, "{state}");
            clear();
        }
        for state in ["COMPLETING None", ""] {
            assert_eq!(bash(folder, &shard, &says(state)), (Some(75), run_3.clone()), "{state}");
            assert_eq!(bash(folder, &shard, &says(state)), (Some(0), run_3.repeat(2)));
            clear();
        }
        let of = [("SLURM_JOB_ID", "18"), ("SAYS", "RUNNING None"), ("SLURM_RESTART_COUNT", "1")];
        assert_eq!(
            bash(folder, &merging, &of),
            (Some(75), format!("{merge}scontrol requeue 18\n"))
        );
        clear();
        assert_eq!(
            bash(folder, &merging, &[of[0], of[1], ("SLURM_RESTART_COUNT", "2")]),
            (Some(75), merge.clone())
        );
        assert_eq!(bash(folder, &merging, &of), (Some(0), merge.repeat(2)));
        clear();

        let [(_, shard, _), (_, submit, _)] = job.hyperqueue().try_into().unwrap();
        assert!(submit.contains("--array 0,2-4,9 "), "{submit}");
        assert_eq!(bash(folder, &shard, &[("HQ_TASK_ID", "4")]), (Some(0), run(4).repeat(2)));
        clear();

        let [(_, template, _)] = job.openjd().try_into().unwrap();
        let template: Value = serde_json::from_str(&template).unwrap();
        let steps = &template["steps"];
        assert_eq!(steps[0]["parameterSpace"]["taskParameterDefinitions"][0]["range"], "0,2-4,9");
        let text =
            |i: usize| steps[i]["script"]["embeddedFiles"][0]["data"].as_str().unwrap().to_owned();
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
