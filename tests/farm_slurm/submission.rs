//! Submissions whose answers are lost, and a controller that does not answer.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

use super::harness::{Cluster, Farm, content, ids, send, text};

/// Puts a script in place of sbatch and returns a PATH by which it is found. `SBATCH` in it stands
/// for Slurm's own.
fn with_sbatch(folder: &Path, script: &str) -> String {
    let sbatch = Command::new("sh").args(["-c", "command -v sbatch"]).output().expect("sh");
    let sbatch = String::from_utf8_lossy(&sbatch.stdout).trim().to_owned();
    let path = folder.join("sbatch");
    let script = script.replace("SBATCH", &sbatch);
    fs::write(&path, format!("#!/bin/bash\n{script}\n")).expect("room");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("own file");
    format!("{}:{}", folder.display(), std::env::var("PATH").expect("a path"))
}

/// Fails as sbatch does when the controller's answer does not arrive.
const LOST: &str = "echo 'sbatch: error: Batch job submission failed: Socket timed out on \
    send/recv operation' >&2; exit 1";

#[test]
fn on_slurm_jobs_whose_answers_are_lost_are_found_or_cancelled() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "4", "--shard-frames", "2", "--size", "48x36"]);
    let submit = ["farm", "submit", "slurm", "--json", "--sbatch=--hold", "--plan", farm.path()];
    let queue = || cluster.slurm(&["squeue", "-h", "-o", "%j %T"]);
    // The array is queued and the merge is refused: nothing stays.
    let script = format!("case \"$*\" in *merge.sh) {LOST} ;; *) exec SBATCH \"$@\" ;; esac");
    let path = with_sbatch(farm.dir.path(), &script);
    let output = cluster.nimbus_with_path(&path, &submit);
    assert!(
        output.status.code() == Some(2) && text(&output).contains("Socket timed out"),
        "{}",
        text(&output)
    );
    farm.wait_for("an empty queue", || queue().is_empty());
    // Both are queued, and both answers are lost.
    let path = with_sbatch(farm.dir.path(), &format!("SBATCH \"$@\" > /dev/null; {LOST}"));
    let (array, merge) = ids(&cluster.nimbus_with_path(&path, &submit));
    let queued = queue();
    assert_eq!(queued.lines().filter(|line| line.starts_with("nimbus-")).count(), 2, "{queued}");
    assert_eq!(cluster.state(&array), "PENDING\nPENDING");
    let status = farm.status(&cluster);
    let engine = status["shards"][1]["engine"].as_str();
    assert!(engine.is_some_and(|e| e.starts_with("PENDING") && e.contains(&array)), "{status}");
    cluster.slurm(&["scontrol", "release", &array]);
    farm.wait_for_job(&cluster, &merge);
    assert_eq!(farm.status(&cluster)["n_done"], 2);
    assert_eq!(content(&farm.merged()).len(), 4 + 1, "the frames and their list");
}

#[test]
fn on_slurm_a_controller_that_does_not_answer_is_reported() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "4", "--shard-frames", "2", "--size", "48x36"]);
    farm.submit(&cluster, &["--sbatch=--hold"]);
    let pid = fs::read_to_string(cluster.folder.path().join("run/ctl.pid")).expect("a number");
    assert!(send("-STOP", pid.trim()));
    let status = farm.status(&cluster);
    let output = cluster.nimbus(&["farm", "submit", "slurm", "--plan", farm.path()]);
    assert!(send("-CONT", pid.trim()));
    let silent = status["engine_silent"].as_str();
    assert!(silent.is_some_and(|why| why.contains("squeue")), "{status}");
    assert_eq!(status["n_done"], 0);
    assert!(
        output.status.code() == Some(75) && text(&output).contains("nothing was submitted"),
        "{}",
        text(&output)
    );
}
