//! Nodes and a controller that die, and failures of shards.

use std::fs;
use std::path::Path;
use std::time::SystemTime;

use super::harness::{Cluster, Farm, SCENE, alone, content, path_text, succeed, text};

/// Node n2 loses its power. Node n3 loses its network: its task goes on while a copy of it runs
/// elsewhere. The controller dies and is started again.
#[test]
fn on_slurm_a_farm_survives_dead_nodes_cut_off_nodes_and_a_dead_controller() {
    let cluster = Cluster::up();
    let size = "400x300";
    let farm = Farm::planned(&["--frames", "96", "--shard-frames", "24", "--size", size]);
    let (array, merge) = farm.submit(&cluster, &[]);
    let stopped = farm.stop_midway(4);
    let all_run = SystemTime::now();
    let engine = farm.status(&cluster)["shards"][0]["engine"].as_str().map(str::to_owned);
    assert!(
        engine.as_ref().is_some_and(|e| e.starts_with("RUNNING on n") && e.contains(&array)),
        "{engine:?}"
    );
    // Shards that are queued are not queued again.
    let output = cluster.nimbus(&["farm", "submit", "slurm", "--plan", farm.path()]);
    assert!(
        output.status.code() == Some(2) && text(&output).contains("are with Slurm already"),
        "{}",
        text(&output)
    );
    cluster.tool(&["node-kill"], &["n2"]);
    cluster.tool(&["node-cut"], &["n3"]);
    // The controller forgets what it has not saved. It saves its state at the latest when it gives
    // up a node.
    let saved = cluster.folder.path().join("state/job_state");
    farm.wait_for("the controller's state", || {
        let changed = fs::metadata(&saved).and_then(|about| about.modified());
        changed.is_ok_and(|at| at > all_run)
    });
    assert_eq!(cluster.state(&merge), "PENDING");
    cluster.tool(&["controller-restart"], &[]);
    stopped.iter().filter(|run| run.node != "n2").for_each(|run| run.resume());
    farm.wait_for_job(&cluster, &merge);
    assert!(content(&farm.merged()) == alone("96", size), "the frames differ from one machine's");

    let n_of = |node: &str, events: &[&str]| {
        let attempts = farm.attempts();
        let of_node = attempts.iter().filter(|a| a["node"] == node);
        of_node.filter(|a| events.contains(&a["event"]["event"].as_str().expect("a name"))).count()
    };
    // The shard of the dead node was begun there and never ended.
    assert_eq!((n_of("n2", &["begun"]), n_of("n2", &["done", "beaten", "failed"])), (1, 0));
    // The node that is cut off finishes its shard, without Slurm's knowledge.
    farm.wait_for("the end on n3", || n_of("n3", &["done", "beaten"]) == 1);
    let n_begun: usize = ["n1", "n2", "n3", "n4"].iter().map(|node| n_of(node, &["begun"])).sum();
    assert!(n_begun >= 5, "{:?}", farm.attempts());
    assert!(farm.events("done", "n_resumed").iter().any(|n| *n > 0), "{:?}", farm.attempts());
    let status = farm.status(&cluster);
    let mut shards = status["shards"].as_array().expect("shards").iter();
    assert!(shards.all(|shard| shard["n_differing"] == 0), "{status}");
}

#[test]
fn on_slurm_transient_failures_are_queued_again() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "4", "--shard-frames", "2", "--size", "48x36"]);
    succeed(&["farm", "emit", "slurm", "--plan", farm.path()]);
    // The first time no node has a device.
    let script = farm.folder().join("slurm/shard.sh");
    let drivers = "[ \"${SLURM_RESTART_COUNT:-0}\" -gt 0 ] || export VK_DRIVER_FILES=/nowhere \
        VK_ICD_FILENAMES=/nowhere\n";
    let shard = fs::read_to_string(&script).expect("a script");
    fs::write(&script, shard.replace("set -u\n", &format!("set -u\n{drivers}"))).expect("room");
    let array = cluster.slurm(&["sbatch", "--parsable", "--array=0-1", path_text(&script)]);
    farm.wait_for("both shards", || cluster.state(&array) == "COMPLETED\nCOMPLETED");
    assert_eq!(farm.events("failed", "exit_code"), [75, 75]);
}

#[test]
fn on_slurm_a_stale_plan_ends_the_merge() {
    let cluster = Cluster::up();
    let dir = tempfile::tempdir().expect("a folder");
    let scene = dir.path().join("changing.toml");
    let cubes = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cubes-");
    let text_of = fs::read_to_string(SCENE).expect("a scene").replace("cubes-", cubes);
    fs::write(&scene, &text_of).expect("room");
    let farm = Farm::of(path_text(&scene), &["--frames", "2", "--size", "48x36"]);
    let (array, merge) = farm.submit(&cluster, &["--sbatch=--hold"]);
    fs::write(&scene, text_of.replace("fov_y_deg = 55.0", "fov_y_deg = 50.0")).expect("room");
    cluster.slurm(&["scontrol", "release", &array]);
    farm.wait_for("the end", || {
        cluster.state(&array) == "FAILED" && cluster.state(&merge) == "FAILED"
    });
    assert!(!Path::new(&farm.merged()).exists());
    let status = succeed(&["farm", "status", "--plan", farm.path()]);
    assert!(status.contains("0 of 1 shards are done"), "{status}");
}

#[test]
fn on_slurm_a_shard_that_finishes_nothing_is_tried_as_often_as_asked() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "2", "--size", "48x36"]);
    succeed(&["farm", "emit", "slurm", "--tries", "2", "--plan", farm.path()]);
    // No node ever has a device. Before the first failure a node has died twice.
    let script = farm.folder().join("slurm/shard.sh");
    let drivers = "export VK_DRIVER_FILES=/nowhere VK_ICD_FILENAMES=/nowhere\n\
        [ \"${SLURM_RESTART_COUNT:-0}\" -gt 1 ] || { scontrol requeue \"${SLURM_JOB_ID}\"; \
        sleep 600; }\n";
    let shard = fs::read_to_string(&script).expect("a script");
    fs::write(&script, shard.replace("set -u\n", &format!("set -u\n{drivers}"))).expect("room");
    let array = cluster.slurm(&["sbatch", "--parsable", "--array=0", path_text(&script)]);
    farm.wait_for("the end", || cluster.state(&array) == "FAILED");
    assert_eq!(farm.events("failed", "exit_code"), [75, 75]);
    assert_eq!(farm.events("failed", "n_new"), [0, 0]);
    assert!(farm.events("done", "n_resumed").is_empty());
    assert!(farm.logs().contains("nothing was finished 2 times in a row"), "{}", farm.logs());
}
