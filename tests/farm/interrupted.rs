//! Runs of `nimbus farm` that are killed, signalled, started twice, or meet a full disk.

use std::fs;
use std::process::Command;

use crate::farm::{Farm, content, names, outcome, sha256, signal, succeed};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/flyby.toml");

/// Plans frames of the fly-by as one shard.
fn planned(n_frames: &str) -> Farm {
    Farm::of(SCENE, &["--frames", n_frames, "--shard-frames", "100", "--size", "48x36"])
}

fn frame(i: u32) -> String {
    format!("frame-{i:08}.png")
}

/// The merged frames of runs that nothing happens to.
fn undisturbed(n_frames: &str) -> Vec<(String, Vec<u8>)> {
    let farm = planned(n_frames);
    assert_eq!((farm.run(0).0, farm.merge().0), (Some(0), Some(0)));
    content(&farm.merged())
}

#[test]
fn the_next_run_takes_over_the_frames_of_a_killed_one() {
    let farm = planned("40");
    farm.killed_midway(0, "n1", 3);
    assert_eq!((farm.state(0).as_str(), farm.place(0).exists()), ("begun", false));
    let (code, _, errors) = farm.merge();
    assert!(code == Some(1) && errors.contains("to do: 0"), "{errors}");
    assert!(!farm.merged().exists());
    let (code, out, errors) = farm.run(0);
    assert_eq!((code, errors.as_str()), (Some(0), ""));
    assert!(out.contains("of 40 frames were there from an attempt before"), "{out}");
    let n_resumed = farm.manifest(0)["n_resumed"].as_u64();
    assert!(n_resumed.is_some_and(|n| (3..40).contains(&n)), "{n_resumed:?}");
    assert_eq!(farm.merge().0, Some(0));
    assert!(content(&farm.merged()) == undisturbed("40"));
    // The folder of the killed run is removed, and nothing else.
    assert_eq!(farm.leftovers(0, "tmp").len(), 1);
    let out = succeed(&["farm", "gc", "--plan", farm.path(), "-n"]);
    assert!(out.contains("1 folders") && farm.leftovers(0, "tmp").len() == 1, "{out}");
    succeed(&["farm", "gc", "--plan", farm.path()]);
    assert!(farm.leftovers(0, "tmp").is_empty() && farm.state(0) == "done");
}

/// An engine starts a shard again when it takes a node for dead that is only cut off.
#[test]
fn several_runs_of_one_shard_leave_one_result() {
    let farm = planned("40");
    let runs = ["n1", "n2", "n3"].map(|node| farm.stopped_midway(0, node, 1));
    runs.iter().for_each(|run| signal("-CONT", run));
    let ended = runs.map(|run| outcome(&run.wait_with_output().expect("it ends")));
    assert!(ended.iter().all(|(code, _, errors)| *code == Some(0) && errors.is_empty()));
    assert_eq!(ended.iter().filter(|(_, out, _)| out.contains("done in")).count(), 1, "{ended:?}");
    assert!(farm.leftovers(0, "tmp").is_empty() && farm.place(0).exists());
    assert_eq!(names(&farm.folder.join("attempts")), ["n1.jsonl", "n2.jsonl", "n3.jsonl"]);
    assert!(farm.run(0).1.contains("was done before"));
    assert!(farm.status()["shards"][0]["n_attempts"].as_u64() >= Some(3));
}

#[test]
fn a_result_that_differs_is_exit_code_70_and_both_are_kept() {
    let farm = planned("40");
    let run = farm.stopped_midway(0, "n1", 1);
    // Meanwhile another device puts a result there, of which one frame differs.
    let other = planned("40");
    assert_eq!(other.run(0).0, Some(0));
    let path = other.place(0).join(frame(2));
    let drawn = fs::read(&path).expect("a frame");
    let mut forged = drawn.clone();
    *forged.last_mut().expect("bytes") ^= 1;
    fs::write(path, &forged).expect("room");
    let manifest = fs::read_to_string(other.place(0).join("shard.json")).expect("a manifest");
    let manifest = manifest.replace(&sha256(&drawn), &sha256(&forged));
    fs::write(other.place(0).join("shard.json"), manifest).expect("room");
    fs::rename(other.place(0), farm.place(0)).expect("a free place");
    signal("-CONT", &run);
    let (code, _, errors) = outcome(&run.wait_with_output().expect("it ends"));
    assert_eq!(code, Some(70), "{errors}");
    assert!(errors.contains("1 of 40 files differ, frame-00000002.png the first"), "{errors}");
    assert_eq!((farm.leftovers(0, "differs").len(), farm.state(0).as_str()), (1, "done"));
    assert_eq!(farm.status()["shards"][0]["n_differing"], 1);
    let kept = farm.leftovers(0, "differs")[0].join(frame(2));
    assert!(fs::read(kept).expect("a frame") == drawn);
}

#[test]
fn only_whole_frames_of_the_same_class_of_device_are_taken_over() {
    let farm = planned("40");
    farm.killed_midway(0, "n1", 3);
    let left = farm.leftovers(0, "tmp").remove(0);
    // A finished frame of another device.
    let device = fs::read_to_string(left.join("device.json")).expect("a device");
    let name = left.file_name().expect("a name").to_string_lossy().replace("n1", "n9");
    let elsewhere = left.with_file_name(name);
    fs::create_dir(&elsewhere).expect("room");
    fs::write(elsewhere.join("device.json"), device.to_uppercase()).expect("room");
    fs::write(elsewhere.join(frame(39)), b"another's").expect("room");
    let hash = sha256(b"another's");
    let record = format!("{{\"name\":\"{}\",\"bytes\":9,\"sha256\":\"{hash}\"}}\n", frame(39));
    fs::write(elsewhere.join("done.jsonl"), record).expect("room");
    // A power cut: half a file, a file of zeros, and half a line of the list.
    let read = |i: u32| fs::read(left.join(frame(i))).expect("a frame");
    fs::write(left.join(frame(0)), &read(0)[..read(0).len() / 2]).expect("room");
    fs::write(left.join(frame(1)), vec![0; read(1).len()]).expect("room");
    let list = fs::read_to_string(left.join("done.jsonl")).expect("a list");
    fs::write(left.join("done.jsonl"), format!("{list}{{\"name\":\"frame-0000")).expect("room");
    assert_eq!((farm.run(0).0, farm.merge().0), (Some(0), Some(0)));
    assert!(content(&farm.merged()) == undisturbed("40"));
}

#[test]
fn transient_failures_have_exit_code_75() {
    let farm = planned("80");
    // No device, as on a node whose driver is gone.
    let mut command = farm.command(0);
    command.env("VK_DRIVER_FILES", "/nowhere").env("VK_ICD_FILENAMES", "/nowhere");
    let (code, _, errors) = outcome(&command.output().expect("it runs"));
    assert!(code == Some(75) && errors.contains("Vulkan"), "{errors}");
    assert_eq!(farm.state(0), "transient");
    // The signal of an engine that takes a node back. Finished frames stay.
    let run = farm.stopped_midway(0, "n1", 2);
    signal("-TERM", &run);
    signal("-CONT", &run);
    assert_eq!(outcome(&run.wait_with_output().expect("it ends")).0, Some(75));
    let (code, out, _) = farm.run(0);
    assert!(code == Some(0) && out.contains("from an attempt before"), "{out}");
}

/// Mounts a small file system, which needs root or a user namespace.
#[test]
fn a_full_disk_is_exit_code_75_and_leaves_no_half_result() {
    let farm = planned("30");
    let shards = farm.folder.join("shards");
    fs::create_dir(&shards).expect("room");
    let script = format!(
        "mount -t tmpfs -o size=64k none {0} && {1} farm run --plan {2} --shard 0; code=$?; ls \
         {0}; umount {0}; exit $code",
        shards.display(),
        assert_cmd::cargo::cargo_bin("nimbus").display(),
        farm.path()
    );
    let mut command = Command::new("unshare");
    command.args(["--mount", "--map-root-user", "sh", "-c", &script]);
    let (code, out, errors) = outcome(&command.output().expect("unshare"));
    assert!(code == Some(75) && errors.contains("no space left"), "{out}{errors}");
    let place = farm.place(0);
    let key = place.file_name().expect("a key").to_string_lossy();
    assert!(!out.lines().any(|name| name == key), "{out}");
    assert_eq!((farm.state(0).as_str(), farm.missing().as_str()), ("transient", "0"));
    assert_eq!(farm.run(0).0, Some(0));
}
