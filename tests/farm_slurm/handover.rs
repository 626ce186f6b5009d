//! Tasks that Slurm takes back or cancels in the middle of a shard.

use super::harness::{Cluster, Farm, alone, content};

const SIZE: &str = "400x300";

#[test]
fn on_slurm_shards_whose_node_is_taken_back_go_on_later() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "48", "--shard-frames", "24", "--size", SIZE]);
    let (array, merge) = farm.submit(&cluster, &[]);
    let stopped = farm.stop_midway(2);
    let [told, preempted] = [0, 1]
        .map(|index| stopped.iter().find(|run| run.index == index).expect("a run of each shard"));
    // The shell of the first job is signalled, as by --signal=B:TERM.
    cluster.slurm(&["scancel", "--signal=TERM", "--batch", &format!("{array}_0")]);
    told.resume_when_asked_to_end(&farm);
    // The node of the second job goes to a job of higher priority.
    let urgent = ["sbatch", "--partition=urgent", "--exclusive", "--output=/dev/null", "-w"];
    cluster.slurm(&[&urgent[..], &[&preempted.node, "--wrap", "true"]].concat());
    preempted.resume_when_asked_to_end(&farm);
    farm.wait_for_job(&cluster, &merge);
    assert!(content(&farm.merged()) == alone("48", SIZE), "the frames differ from one machine's");
    assert_eq!(farm.events("failed", "exit_code"), [75, 75]);
    assert!(farm.events("failed", "n_new").iter().all(|n| *n > 0), "{:?}", farm.attempts());
    let n_resumed = farm.events("done", "n_resumed");
    assert!(n_resumed.len() == 2 && n_resumed.iter().all(|n| *n > 0), "{n_resumed:?}");
}

/// A cancelled job gets the same signal as one that is taken back.
#[test]
fn on_slurm_a_cancelled_shard_keeps_its_frames_and_stays_cancelled() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "48", "--shard-frames", "48", "--size", SIZE]);
    let (array, merge) = farm.submit(&cluster, &[]);
    let stopped = farm.stop_midway(1);
    cluster.slurm(&["scancel", &array]);
    stopped[0].resume_when_asked_to_end(&farm);
    // The merge fails after the array's script has ended, which would have queued it again.
    farm.wait_for("the end", || cluster.state(&merge) == "FAILED");
    assert_eq!(cluster.state(&array), "CANCELLED");
    assert_eq!(farm.events("failed", "exit_code"), [75]);
    assert!(farm.events("failed", "n_new").iter().all(|n| *n > 0), "{:?}", farm.attempts());
    assert_eq!(farm.status(&cluster)["shards"][0]["state"], "transient");
}

/// Slurm's least limit is a minute, and it checks limits every half minute.
#[test]
fn on_slurm_a_shard_whose_time_is_up_goes_on_later() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "24", "--shard-frames", "24", "--size", SIZE]);
    let (array, merge) = farm.submit(&cluster, &["--sbatch=--time=1"]);
    // The run stays stopped until its time is up.
    farm.stop_midway(1)[0].resume_when_asked_to_end(&farm);
    farm.wait_for_job(&cluster, &merge);
    assert!(farm.logs().contains("DUE TO TIME LIMIT"), "{}", farm.logs());
    assert_eq!(cluster.state(&array), "COMPLETED");
    let (n_new, n_resumed) = (farm.events("failed", "n_new"), farm.events("done", "n_resumed"));
    assert!(
        matches!((&n_new[..], &n_resumed[..]), ([n, ..], [m]) if *n > 0 && m >= n),
        "{n_new:?} {n_resumed:?}"
    );
    assert!(content(&farm.merged()) == alone("24", SIZE), "the frames differ from one machine's");
}
