//! `nimbus farm` as engines use it: runs that are killed, run twice, race, meet broken results,
//! full disks, other builds and changed scenes; and what is merged is what `nimbus render` draws,
//! to the byte.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/flyby.toml");
const SIZE: &str = "48x36";

fn nimbus(args: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("nimbus"));
    command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).env_remove("SLURMD_NODENAME");
    command
}

/// Exit code, stdout, stderr.
fn said(output: &Output) -> (Option<i32>, String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn ran(args: &[&str]) -> (Option<i32>, String, String) {
    said(&nimbus(args).output().expect("the program runs"))
}

/// A plan of its own.
struct Farm {
    _dir: TempDir,
    folder: PathBuf,
}

impl Farm {
    /// Of the fly-by's frames, so many a shard.
    fn planned(frames: &str, shard_frames: &str) -> Farm {
        Farm::of(SCENE, &["--frames", frames, "--shard-frames", shard_frames, "--size", SIZE])
    }

    fn of(scene: &str, args: &[&str]) -> Farm {
        let dir = tempfile::tempdir().expect("a folder");
        let folder = dir.path().join("farm");
        let farm = Farm { _dir: dir, folder };
        let (code, _, said) = ran(&[&["farm", "plan", scene, "-o", farm.path()], args].concat());
        assert_eq!((code, said.as_str()), (Some(0), ""));
        farm
    }

    fn path(&self) -> &str {
        self.folder.to_str().expect("UTF-8")
    }

    fn run(&self, shard: usize) -> Command {
        nimbus(&["farm", "run", "--plan", self.path(), "--shard", &shard.to_string()])
    }

    fn ran(&self, shard: usize) -> (Option<i32>, String, String) {
        said(&self.run(shard).output().expect("the program runs"))
    }

    fn plan(&self) -> Value {
        serde_json::from_slice(&fs::read(self.folder.join("plan.json")).expect("a plan"))
            .expect("JSON")
    }

    fn status(&self) -> Value {
        let (code, out, said) = ran(&["farm", "status", "--plan", self.path(), "--json"]);
        assert_eq!((code, said.as_str()), (Some(0), ""));
        serde_json::from_str(&out).expect("JSON")
    }

    fn state(&self, shard: usize) -> String {
        self.status()["shards"][shard]["state"].as_str().expect("a name").to_owned()
    }

    fn missing(&self) -> String {
        let (code, out, _) = ran(&["farm", "status", "--plan", self.path(), "--missing"]);
        assert_eq!(code, Some(0));
        out.trim_end().to_owned()
    }

    fn key(&self, shard: usize) -> String {
        self.plan()["shards"][shard]["key"].as_str().expect("a key").to_owned()
    }

    /// The folder of a shard's result.
    fn place(&self, shard: usize) -> PathBuf {
        self.folder.join("shards").join(self.key(shard))
    }

    /// Folders beside it, by what follows the key.
    fn beside(&self, shard: usize, kind: &str) -> Vec<PathBuf> {
        let begin = format!("{}.{kind}.", self.key(shard));
        let entries = fs::read_dir(self.folder.join("shards")).into_iter().flatten().flatten();
        entries
            .filter(|e| e.file_name().to_string_lossy().starts_with(&begin))
            .map(|e| e.path())
            .collect()
    }

    fn merge(&self) -> (Option<i32>, String, String) {
        ran(&["farm", "merge", "--plan", self.path(), "-o", self.merged().to_str().expect("UTF-8")])
    }

    fn merged(&self) -> PathBuf {
        self.folder.with_file_name("merged")
    }
}

fn frame(i: u32) -> String {
    format!("frame-{i:08}.png")
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder").flatten();
    let mut names: Vec<String> =
        entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn content(folder: &Path) -> Vec<(String, Vec<u8>)> {
    names(folder)
        .into_iter()
        .map(|name| (name.clone(), fs::read(folder.join(name)).expect("a file")))
        .collect()
}

/// What `nimbus render` makes of a frame.
fn rendered(dir: &Path, scene: &str, i: u32, args: &[&str]) -> Vec<u8> {
    let out = dir.join(format!("drawn-{i}.png"));
    let number = i.to_string();
    let fixed = ["render", scene, "--frame", &number, "-o", out.to_str().expect("UTF-8"), "-q"];
    let (code, _, said) = ran(&[&fixed, args].concat());
    assert_eq!(code, Some(0), "{said}");
    fs::read(out).expect("a picture")
}

fn wait_for(what: &str, is_so: impl Fn() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < Duration::from_secs(60), "{what} does not come");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn kill(child: &mut Child) {
    child.kill().expect("a child");
    child.wait().expect("it ends");
}

/// Until a run has finished `n` frames of a shard, and not the shard.
fn wait_for_frames(farm: &Farm, shard: usize, n: usize) {
    wait_for("a frame", || {
        farm.beside(shard, "tmp").iter().any(|folder| {
            fs::read_to_string(folder.join("done.jsonl"))
                .is_ok_and(|text| text.lines().count() >= n)
        })
    });
}

#[test]
fn what_is_merged_is_what_render_draws() {
    let farm = Farm::planned("5..19", "4");
    assert_eq!(
        (farm.missing(), farm.plan()["shards"].as_array().map(Vec::len)),
        ("0-3".to_owned(), Some(4))
    );
    let (code, out, said) = ran(&["farm", "local", "--plan", farm.path(), "--jobs", "2"]);
    assert_eq!((code, said.as_str()), (Some(0), ""), "{out}");
    assert!(out.starts_with("4 shards are done, 4 of them now"), "{out}");
    assert_eq!(farm.missing(), "");
    let (code, out, said) = farm.merge();
    assert_eq!((code, said.as_str()), (Some(0), ""), "{out}");
    assert_eq!(names(&farm.merged()), (5..19).map(frame).collect::<Vec<_>>());
    for i in [5, 8, 9, 18] {
        let drawn = rendered(farm.folder.parent().expect("a folder"), SCENE, i, &["--size", SIZE]);
        assert!(fs::read(farm.merged().join(frame(i))).expect("a frame") == drawn, "frame {i}");
    }
    // Once more there is nothing to do, and nothing that is there is replaced.
    let (_, out, _) = ran(&["farm", "local", "--plan", farm.path()]);
    assert!(out.contains("4 shards are done, 0 of them now"), "{out}");
    let (code, _, said) = farm.merge();
    assert!(code == Some(2) && said.contains("--force"), "{said}");
}

#[test]
fn a_scene_s_phases_and_exr() {
    let dir = tempfile::tempdir().expect("a folder");
    let scene = dir.path().join("phases.toml");
    let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml"))
        .expect("a scene");
    let phases = "\n[[phase]]\nname = \"a\"\nframes = 2\n\n[[phase]]\nname = \"b\"\nframes = \
        2\nset = { lighting.mode = \"none\" }\n";
    fs::write(&scene, text + phases).expect("room");
    fs::copy(
        concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.csv"),
        dir.path().join("hello.csv"),
    )
    .expect("room");
    let scene = scene.to_str().expect("UTF-8");
    let (code, _, said) = ran(&[
        "render",
        scene,
        "-o",
        dir.path().join("try.png").to_str().expect("UTF-8"),
        "--size",
        SIZE,
    ]);
    assert_eq!(code, Some(0), "{said}");
    let farm = Farm::of(scene, &["--shard-frames", "3", "--size", SIZE]);
    assert_eq!(ran(&["farm", "local", "--plan", farm.path()]).0, Some(0));
    assert_eq!(farm.merge().0, Some(0));
    let frames: Vec<Vec<u8>> =
        (0..4).map(|i| fs::read(farm.merged().join(frame(i))).expect("a frame")).collect();
    for (i, frame) in (0..).zip(&frames) {
        assert!(*frame == rendered(dir.path(), scene, i, &["--size", SIZE]), "frame {i}");
    }
    assert!(frames[1] != frames[2], "the phases differ");
}

#[test]
fn a_run_that_is_killed_is_gone_on_with() {
    let farm = Farm::planned("0..40", "40");
    let mut child = farm.run(0).env("SLURMD_NODENAME", "n1").spawn().expect("a child");
    wait_for_frames(&farm, 0, 3);
    kill(&mut child);
    assert_eq!((farm.state(0), farm.place(0).exists()), ("begun".to_owned(), false));
    let (code, _, said) = farm.merge();
    assert!(code == Some(1) && said.contains("to do: 0"), "{said}");
    assert!(!farm.merged().exists());
    let (code, out, said) = farm.ran(0);
    assert_eq!((code, said.as_str()), (Some(0), ""));
    assert!(out.contains("of 40 frames were there from an attempt before"), "{out}");
    let manifest: Value =
        serde_json::from_slice(&fs::read(farm.place(0).join("shard.json")).expect("it"))
            .expect("JSON");
    assert!(manifest["n_resumed"].as_u64().is_some_and(|n| (3..40).contains(&n)));
    // What a whole run makes is the same.
    let whole = Farm::planned("0..40", "40");
    assert_eq!(whole.ran(0).0, Some(0));
    assert_eq!((farm.merge().0, whole.merge().0), (Some(0), Some(0)));
    assert!(content(&farm.merged()) == content(&whole.merged()));
    // What the killed one left is cleared away, and nothing else.
    assert_eq!(farm.beside(0, "tmp").len(), 1);
    let (_, out, _) = ran(&["farm", "gc", "--plan", farm.path(), "-n"]);
    assert!(out.contains("1 folders") && farm.beside(0, "tmp").len() == 1, "{out}");
    ran(&["farm", "gc", "--plan", farm.path()]);
    assert!(farm.beside(0, "tmp").is_empty() && farm.state(0) == "done");
}

/// What an engine does that thinks a node dead which is only cut off.
#[test]
fn two_runs_of_one_shard_race_and_one_result_stays() {
    let farm = Farm::planned("0..6", "6");
    let children: Vec<Child> = ["n1", "n2", "n3"]
        .map(|n| farm.run(0).env("SLURMD_NODENAME", n).spawn().expect("a child"))
        .into();
    let ended: Vec<_> =
        children.into_iter().map(|c| said(&c.wait_with_output().expect("it ends"))).collect();
    assert!(ended.iter().all(|(code, _, said)| *code == Some(0) && said.is_empty()), "{ended:?}");
    assert_eq!(ended.iter().filter(|(_, out, _)| out.contains("done in")).count(), 1, "{ended:?}");
    assert_eq!(names(&farm.folder.join("shards")), [farm.key(0)]);
    assert_eq!(names(&farm.folder.join("attempts")), ["n1.jsonl", "n2.jsonl", "n3.jsonl"]);
    assert!(farm.ran(0).1.contains("was done before"));
    assert_eq!(farm.status()["shards"][0]["n_attempts"], 3);
}

#[test]
fn a_result_that_differs_is_exit_code_70_and_both_are_kept() {
    let farm = Farm::planned("0..4", "4");
    // Begins, and meets a result of somebody whose device draws otherwise.
    let child = farm.run(0).spawn().expect("a child");
    wait_for_frames(&farm, 0, 1);
    let signal = |name: &str| {
        Command::new("kill").args([name, &child.id().to_string()]).status().expect("kill")
    };
    assert!(signal("-STOP").success());
    let other = Farm::planned("0..4", "4");
    assert_eq!(other.ran(0).0, Some(0));
    let place = other.place(0);
    let drawn = fs::read(place.join(frame(2))).expect("a frame");
    let mut forged = drawn.clone();
    *forged.last_mut().expect("bytes") ^= 1;
    fs::write(place.join(frame(2)), &forged).expect("room");
    let hash = |bytes: &[u8]| format!("{:x}", <sha2::Sha256 as sha2::Digest>::digest(bytes));
    let manifest = fs::read_to_string(place.join("shard.json"))
        .expect("it")
        .replace(&hash(&drawn), &hash(&forged));
    fs::write(place.join("shard.json"), manifest).expect("room");
    fs::rename(&place, farm.place(0)).expect("the run was stopped before its end");
    assert!(signal("-CONT").success());
    let (code, _, said) = said(&child.wait_with_output().expect("it ends"));
    assert!(
        code == Some(70) && said.contains("1 of 4 files differ, frame-00000002.png the first"),
        "{said}"
    );
    assert_eq!((farm.beside(0, "differs").len(), farm.state(0)), (1, "done".to_owned()));
    assert_eq!(farm.status()["shards"][0]["n_differing"], 1);
    assert!(fs::read(farm.beside(0, "differs")[0].join(frame(2))).expect("it") == drawn);
}

#[test]
fn what_lies_under_the_right_name_with_wrong_content_is_made_anew() {
    let farm = Farm::planned("0..3", "3");
    assert_eq!(farm.ran(0).0, Some(0));
    let good = content(&farm.place(0));
    let at = |name: &str| farm.place(0).join(name);
    let whole = fs::read(at(&frame(1))).expect("a frame");
    let swapped = fs::read(at(&frame(2))).expect("a frame");
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 4;
    let cut = whole[..whole.len() - 7].to_vec();
    for (n, (name, bytes)) in [
        (frame(1), Some(cut)),
        (frame(1), Some(vec![])),
        (frame(1), Some(flipped)),
        (frame(1), Some(swapped)),
        (frame(1), None),
        ("shard.json".to_owned(), Some(vec![])),
        ("shard.json".to_owned(), Some(b"{".to_vec())),
        ("shard.json".to_owned(), None),
    ]
    .into_iter()
    .enumerate()
    {
        match bytes {
            Some(bytes) => fs::write(at(&name), bytes).expect("room"),
            None => fs::remove_file(at(&name)).expect("it was there"),
        }
        assert_eq!(farm.state(0), "broken", "{n} {name}");
        let (code, _, said) = farm.merge();
        assert!(code == Some(1) && said.contains(&name) && !farm.merged().exists(), "{n} {said}");
        let (code, out, said) = farm.ran(0);
        assert!(code == Some(0) && out.contains("done in"), "{n} {out}{said}");
        assert_eq!((farm.state(0), farm.beside(0, "bad").len()), ("done".to_owned(), n + 1));
        let frames = |all: &[(String, Vec<u8>)]| all[..3].to_vec();
        assert!(frames(&content(&farm.place(0))) == frames(&good), "{n}");
    }
    // What cannot be printed in part.
    let hash = format!("{:x}", <sha2::Sha256 as sha2::Digest>::digest(&whole));
    let manifest = fs::read_to_string(at("shard.json")).expect("it").replace(&hash, "aéééééé");
    fs::write(at("shard.json"), manifest).expect("room");
    assert!(farm.state(0) == "broken" && farm.ran(0).0 == Some(0) && farm.state(0) == "done");
    // A file in the folder's place, and a result of another shard.
    fs::remove_dir_all(farm.place(0)).expect("it was there");
    fs::write(farm.place(0), b"no folder").expect("room");
    assert!(farm.state(0) == "broken" && farm.ran(0).0 == Some(0) && farm.state(0) == "done");
    let (_, out, _) = ran(&["farm", "gc", "--plan", farm.path(), "--all"]);
    assert!(farm.beside(0, "bad").is_empty() && farm.state(0) == "done", "{out}");
}

#[test]
fn unfinished_files_of_a_killed_run_count_only_where_they_are_whole() {
    let farm = Farm::planned("0..40", "40");
    let mut child = farm.run(0).env("SLURMD_NODENAME", "n1").spawn().expect("a child");
    wait_for_frames(&farm, 0, 3);
    kill(&mut child);
    let left = farm.beside(0, "tmp").remove(0);
    // Another device's are not gone on with.
    let device = fs::read_to_string(left.join("device.json")).expect("a device");
    let elsewhere = left
        .with_file_name(left.file_name().expect("a name").to_string_lossy().replace("n1", "n9"));
    fs::create_dir(&elsewhere).expect("room");
    fs::write(
        elsewhere.join("device.json"),
        device.replace("llvmpipe", "another").replace("driver", "Driver"),
    )
    .expect("room");
    fs::write(elsewhere.join(frame(39)), b"another's").expect("room");
    let hash = format!("{:x}", <sha2::Sha256 as sha2::Digest>::digest(b"another's"));
    let record = format!("{{\"name\":\"{}\",\"bytes\":9,\"sha256\":\"{hash}\"}}\n", frame(39));
    fs::write(elsewhere.join("done.jsonl"), record).expect("room");
    // A power cut: one file without its end, one full of zeros, and half a line of the list.
    let bytes = fs::read(left.join(frame(0))).expect("a frame");
    fs::write(left.join(frame(0)), &bytes[..bytes.len() / 2]).expect("room");
    fs::write(left.join(frame(1)), vec![0; fs::read(left.join(frame(1))).expect("a frame").len()])
        .expect("room");
    let list = fs::read_to_string(left.join("done.jsonl")).expect("a list");
    fs::write(left.join("done.jsonl"), format!("{list}{{\"name\":\"frame-0000")).expect("room");
    assert_eq!(farm.ran(0).0, Some(0));
    assert_eq!(farm.merge().0, Some(0));
    let whole = Farm::planned("0..40", "40");
    assert_eq!((whole.ran(0).0, whole.merge().0), (Some(0), Some(0)));
    assert!(content(&farm.merged()) == content(&whole.merged()));
}

#[test]
fn what_may_pass_is_75_and_what_stays_is_2() {
    let farm = Farm::planned("0..40", "40");
    // No device, as on a node whose driver is gone.
    let output = farm
        .run(0)
        .env("VK_DRIVER_FILES", "/nowhere")
        .env("VK_ICD_FILENAMES", "/nowhere")
        .output()
        .expect("it runs");
    let (code, _, text) = said(&output);
    assert!(code == Some(75) && text.contains("Vulkan"), "{text}");
    assert_eq!(farm.state(0), "transient");
    // A signal, as of an engine that takes a node back: what is finished stays.
    let child = farm.run(0).spawn().expect("a child");
    wait_for_frames(&farm, 0, 2);
    assert!(
        Command::new("kill")
            .args(["-TERM", &child.id().to_string()])
            .status()
            .expect("kill")
            .success()
    );
    assert_eq!(said(&child.wait_with_output().expect("it ends")).0, Some(75));
    let (code, out, _) = farm.ran(0);
    assert!(code == Some(0) && out.contains("from an attempt before"), "{out}");
    // What no further try changes.
    let output = farm.run(0).args(["--device", "no such device"]).output().expect("it runs");
    assert_eq!(said(&output).0, Some(0), "it is done, no device is asked");
    let (code, _, text) = farm.ran(1);
    assert!(code == Some(2) && text.contains("expected 0 to 0"), "{text}");
    let (code, _, text) = ran(&["farm", "run", "--plan", "/nowhere", "--shard", "0"]);
    assert!(code == Some(2) && text.contains("plan.json"), "{text}");
}

#[test]
fn a_stale_plan_is_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    for name in ["hello.toml", "hello.csv"] {
        fs::copy(
            Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name),
            dir.path().join(name),
        )
        .expect("room");
    }
    let scene = dir.path().join("hello.toml");
    let farm = Farm::of(scene.to_str().expect("UTF-8"), &["--frames", "2", "--size", SIZE]);
    let text = fs::read_to_string(&scene).expect("a scene");
    fs::write(&scene, text.replace("[film]", "[film]\nexposure = 0.5")).expect("room");
    let (code, _, said) = farm.ran(0);
    assert!(
        code == Some(2) && said.contains("stale") && said.contains("has changed since"),
        "{said}"
    );
    // Whoever asks later is told why.
    assert_eq!(farm.state(0), "failed");
    assert!(
        farm.status()["shards"][0]["what"]
            .as_str()
            .is_some_and(|what| what.contains("has changed since"))
    );
    let (code, _, said) = ran(&["farm", "local", "--plan", farm.path()]);
    assert!(code == Some(2) && said.contains("stale"), "{said}");
    fs::write(&scene, text).expect("room");
    // Another build: the plan says so, and its keys go with it.
    let path = farm.folder.join("plan.json");
    let plan = fs::read_to_string(&path).expect("a plan");
    let code_of = farm.plan()["code"].as_str().expect("a digest").to_owned();
    fs::write(&path, plan.replace(&code_of, "0123456789abcdef")).expect("room");
    let (code, _, said) = farm.ran(0);
    assert!(code == Some(2) && said.contains("key"), "{said}");
    fs::write(&path, plan).expect("room");
    assert_eq!(farm.ran(0).0, Some(0));
    // Also where it is done.
    fs::write(
        &scene,
        fs::read_to_string(&scene).expect("a scene").replace("[film]", "[film]\nexposure = 0.5"),
    )
    .expect("room");
    let (code, _, said) = farm.ran(0);
    assert!(code == Some(2) && said.contains("stale"), "{said}");
}

/// A file system of 1 MiB. Mounting asks for root, or a user namespace: CI and most machines have
/// one of them.
#[test]
fn a_full_disk_is_75_and_leaves_nothing_half_done() {
    let farm = Farm::planned("0..30", "30");
    let shards = farm.folder.join("shards");
    fs::create_dir(&shards).expect("room");
    let program = assert_cmd::cargo::cargo_bin("nimbus");
    let script = format!(
        "mount -t tmpfs -o size=64k none {0} && {1} farm run --plan {2} --shard 0; code=$?; ls \
         {0}; umount {0}; exit $code",
        shards.display(),
        program.display(),
        farm.path()
    );
    let output = Command::new("unshare")
        .args(["--mount", "--map-root-user", "sh", "-c", &script])
        .output()
        .expect("unshare");
    let (code, out, text) = said(&output);
    assert_eq!(code, Some(75), "{text}");
    assert!(
        text.contains("No space left") && !out.lines().any(|name| name == farm.key(0)),
        "{out}{text}"
    );
    assert_eq!((farm.state(0), farm.missing()), ("transient".to_owned(), "0".to_owned()));
    assert_eq!(farm.ran(0).0, Some(0));
}
