//! What lies between nimbus and Slurm: tasks that are taken back or cancelled in the middle of a
//! shard, answers that are lost, and a controller that does not answer.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::{Cluster, Farm, alone, content, nimbus, text, wait_for};

const SIZE: &str = "400x300";

/// Failed attempts, how many files each had finished, and of those that ended well how many they
/// took over.
fn failed_and_resumed(farm: &Farm) -> (Vec<u64>, Vec<u64>) {
    let attempts = farm.attempts();
    let of = |event: &str, key: &str| {
        let all = attempts.iter().map(|a| &a["event"]).filter(|e| e["event"] == event);
        all.map(|e| e[key].as_u64().expect("a number")).collect()
    };
    assert!(
        attempts.iter().all(|a| a["event"]["event"] != "failed" || a["event"]["exit_code"] == 75),
        "{attempts:?}"
    );
    (of("failed", "n_new"), of("done", "n_resumed"))
}

/// Processes that have finished frames of shards and not the shards.
fn pids(farm: &Farm) -> Vec<String> {
    let entries = fs::read_dir(farm.folder().join("shards")).into_iter().flatten().flatten();
    let unfinished = entries.filter(|e| {
        fs::read_to_string(e.path().join("done.jsonl")).is_ok_and(|t| t.lines().count() > 1)
    });
    let name = |name: String| {
        name.split(".tmp.").nth(1).and_then(|who| who.rsplit('.').next().map(str::to_owned))
    };
    unfinished.filter_map(|e| name(e.file_name().to_string_lossy().into_owned())).collect()
}

fn signal(name: &str, pid: &str) {
    assert!(Command::new("kill").args([name, pid]).status().expect("kill").success());
}

#[test]
fn on_slurm_what_is_taken_back_goes_on_later_and_what_is_cancelled_does_not() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "48", "--shard-frames", "24", "--size", SIZE]);
    let (array, merge) = farm.submit(&cluster);
    wait_for(&farm, "work on both shards", || farm.at_work().len() == 2);
    // The job's shell alone is told, as by --signal=B:TERM@…; and somebody more important gets the
    // other one's node.
    let node = cluster
        .told(&["run"], &["squeue", "-h", "-o", "%N", "-j", &format!("{array}_1")])
        .trim()
        .to_owned();
    cluster.told(&["run"], &["scancel", "--signal=TERM", "--batch", &format!("{array}_0")]);
    let urgent = [
        "sbatch",
        "--partition=urgent",
        "--exclusive",
        "--output=/dev/null",
        "-w",
        &node,
        "--wrap",
        "sleep 1",
    ];
    cluster.told(&["run"], &urgent);
    wait_for(&farm, "the merge", || cluster.state(&merge) == "COMPLETED");
    assert!(
        content(&farm.merged()) == alone("48", SIZE),
        "what is merged is not what one machine draws"
    );
    let (n_new, n_resumed) = failed_and_resumed(&farm);
    assert!(n_new.len() == 2 && n_new.iter().all(|n| *n > 0), "{n_new:?}");
    assert!(
        n_resumed.len() == 2 && n_resumed.iter().zip(1..).all(|(n, _)| *n > 0),
        "{n_resumed:?}"
    );

    // It gets the same signal, ends the same way, and stays cancelled.
    let farm = Farm::planned(&["--frames", "48", "--shard-frames", "48", "--size", SIZE]);
    let (array, merge) = farm.submit(&cluster);
    wait_for(&farm, "work", || farm.at_work().len() == 1);
    cluster.told(&["run"], &["scancel", &array]);
    wait_for(&farm, "the end", || {
        cluster.state(&array) == "CANCELLED" && cluster.state(&merge) == "FAILED"
    });
    assert!(matches!(&failed_and_resumed(&farm).0[..], [n] if *n > 0), "{:?}", farm.attempts());
    // A job that is queued again is seen at once, though it waits.
    std::thread::sleep(Duration::from_secs(3));
    assert_eq!(
        (cluster.state(&array), farm.status(&cluster)["shards"][0]["state"].as_str()),
        ("CANCELLED".into(), Some("transient"))
    );
}

/// Slurm's least limit is a minute, and it looks every half one.
#[test]
fn on_slurm_a_shard_whose_time_is_up_goes_on() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "12", "--shard-frames", "12", "--size", SIZE]);
    let (array, merge) = farm.submit_with(&cluster, &["--sbatch=--time=1"]);
    wait_for(&farm, "work", || !pids(&farm).is_empty());
    // It stands still for as long as others need the processors. Slurm lets it go on as it tells it
    // to end.
    signal("-STOP", &pids(&farm)[0]);
    wait_for(&farm, "the first end", || {
        farm.attempts().iter().any(|a| a["event"]["event"] == "failed")
    });
    wait_for(&farm, "the merge", || cluster.state(&merge) == "COMPLETED");
    assert!(farm.logs().contains("DUE TO TIME LIMIT"), "{}", farm.logs());
    assert_eq!(cluster.state(&array), "COMPLETED");
    let (n_new, n_resumed) = failed_and_resumed(&farm);
    assert!(
        matches!((&n_new[..], &n_resumed[..]), ([n, ..], [m]) if *n > 0 && m >= n),
        "{n_new:?} {n_resumed:?}"
    );
    assert!(
        content(&farm.merged()) == alone("12", SIZE),
        "what is merged is not what one machine draws"
    );
}

#[test]
fn on_slurm_what_finishes_nothing_is_tried_as_often_as_told() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "2", "--size", "48x36"]);
    let folder = farm.folder();
    let output = nimbus(&[
        "farm",
        "emit",
        "slurm",
        "--tries",
        "2",
        "--plan",
        folder.to_str().expect("UTF-8"),
    ]);
    assert!(output.status.success(), "{}", text(&output));
    // No node has a device, ever; and before that one died twice.
    let script = folder.join("slurm/shard.sh");
    let drivers = "export VK_DRIVER_FILES=/nowhere VK_ICD_FILENAMES=/nowhere\n\
        [ \"${SLURM_RESTART_COUNT:-0}\" -gt 1 ] || { scontrol requeue \"${SLURM_JOB_ID}\"; \
        sleep 60; }\n";
    let shard =
        fs::read_to_string(&script).expect("it").replace("set -u\n", &format!("set -u\n{drivers}"));
    fs::write(&script, shard).expect("room");
    let script = script.to_str().expect("UTF-8");
    let array =
        cluster.told(&["run"], &["sbatch", "--parsable", "--array=0", script]).trim().to_owned();
    wait_for(&farm, "the end", || cluster.state(&array) == "FAILED");
    assert_eq!(failed_and_resumed(&farm), (vec![0, 0], vec![]));
    assert!(farm.logs().contains("nothing was finished 2 times in a row"), "{}", farm.logs());
}

/// Before Slurm's own sbatch; how it ends otherwise.
fn instead(folder: &Path, text: &str) -> String {
    let sbatch = Command::new("sh").args(["-c", "command -v sbatch"]).output().expect("sh");
    let sbatch = String::from_utf8_lossy(&sbatch.stdout).trim().to_owned();
    let path = folder.join("sbatch");
    fs::write(&path, format!("#!/bin/bash\n{}\n", text.replace("SBATCH", &sbatch))).expect("room");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("it is ours");
    format!("{}:{}", folder.display(), std::env::var("PATH").expect("a path"))
}

#[test]
fn on_slurm_answers_that_are_lost_leave_nobody_alone() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "4", "--shard-frames", "2", "--size", "48x36"]);
    let folder = farm.folder();
    let submit = [
        "farm",
        "submit",
        "slurm",
        "--sbatch=--begin=now+60",
        "--plan",
        folder.to_str().expect("UTF-8"),
    ];
    let lost = "echo 'sbatch: error: Batch job submission failed: Socket timed out on send/recv \
        operation' >&2; exit 1";
    let queue = || cluster.told(&["run"], &["squeue", "-h", "-o", "%j %T"]);
    // The array is queued, and the merge is refused: nothing stays.
    let path = instead(
        farm.dir.path(),
        &format!("case \"$*\" in *merge.sh) {lost} ;; *) exec SBATCH \"$@\" ;; esac"),
    );
    let output = cluster.nimbus_at(&path, &submit);
    assert!(
        output.status.code() == Some(2) && text(&output).contains("Socket timed out"),
        "{}",
        text(&output)
    );
    wait_for(&farm, "an empty queue", || queue().is_empty());
    // Both are queued, and both answers lost.
    let path = instead(farm.dir.path(), &format!("SBATCH \"$@\" > /dev/null; {lost}"));
    let output = cluster.nimbus_at(&path, &[&submit[..], &["--json"]].concat());
    assert!(output.status.success(), "{}", text(&output));
    let ids: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let merge = ids["merge"].as_str().expect("an id").to_owned();
    let array = ids["arrays"][0]["job"].as_str().expect("an id").to_owned();
    assert_eq!(
        queue().lines().filter(|line| line.starts_with("nimbus-")).count(),
        2,
        "{}",
        queue()
    );
    assert_eq!(cluster.state(&array), "PENDING\nPENDING");
    let told = farm.status(&cluster);
    assert!(
        told["shards"][1]["engine"]
            .as_str()
            .is_some_and(|e| e.starts_with("PENDING") && e.contains(&array)),
        "{told}"
    );

    // A controller that stands still.
    let pid = fs::read_to_string(cluster.folder.path().join("run/ctl.pid"))
        .expect("it runs")
        .trim()
        .to_owned();
    signal("-STOP", &pid);
    let begin = Instant::now();
    let told = farm.status(&cluster);
    let output = cluster.nimbus(&submit);
    let waited = begin.elapsed();
    signal("-CONT", &pid);
    assert!(
        told["engine_silent"].as_str().is_some_and(|why| why.contains("squeue"))
            && told["n_done"] == 0,
        "{told}"
    );
    assert!(
        output.status.code() == Some(75) && text(&output).contains("nothing was submitted"),
        "{}",
        text(&output)
    );
    assert!(waited < Duration::from_secs(30), "{waited:?}");

    cluster.told(&["run"], &["scontrol", "update", &format!("JobId={array}"), "StartTime=now"]);
    wait_for(&farm, "the merge", || cluster.state(&merge) == "COMPLETED");
    assert_eq!(
        (farm.status(&cluster)["n_done"].as_u64(), content(&farm.merged()).len()),
        (Some(2), 4)
    );
}
