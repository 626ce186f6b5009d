//! `nimbus farm` on a real Slurm: four nodes in network namespaces of this machine
//! (tools/slurm-test-cluster), which lose their power and their network in the middle of shards
//! while the controller is restarted. Needs root, and what `tools/bootstrap tests` installs.

mod handover;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/flyby.toml");
const TOOL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tools/slurm-test-cluster");
/// A node that is given up, its tasks elsewhere, and all of them done: some 20 s on a quiet
/// machine.
const PATIENCE: Duration = Duration::from_secs(150);

fn text(output: &Output) -> String {
    [&output.stdout, &output.stderr]
        .map(|bytes| String::from_utf8_lossy(bytes).into_owned())
        .concat()
}

struct Cluster {
    folder: TempDir,
}

impl Cluster {
    fn up() -> Cluster {
        let cluster = Cluster {
            folder: tempfile::Builder::new().prefix("slurm").tempdir().expect("a folder"),
        };
        cluster.told(&["up"], &["--nodes", "4", "--cpus", "1"]);
        cluster
    }

    fn command(&self, what: &[&str], rest: &[&str]) -> Command {
        let mut command = Command::new(TOOL);
        command.args(what).arg(self.folder.path()).args(rest);
        command
    }

    fn told(&self, what: &[&str], rest: &[&str]) -> String {
        let output = self.command(what, rest).output().expect("the tool");
        assert!(output.status.success(), "{what:?}: {}", text(&output));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// `nimbus` where Slurm is.
    fn nimbus(&self, args: &[&str]) -> Output {
        self.nimbus_at(&std::env::var("PATH").expect("a path"), args)
    }

    /// The same where Slurm's programs are looked for elsewhere.
    fn nimbus_at(&self, path: &str, args: &[&str]) -> Output {
        let program = assert_cmd::cargo::cargo_bin("nimbus");
        let mut command = self.command(&["run"], &[program.to_str().expect("UTF-8")]);
        command.args(args).env("PATH", path).output().expect("the tool")
    }

    /// The state of a job, as Slurm has it.
    fn state(&self, job: &str) -> String {
        self.told(&["run"], &["squeue", "-h", "--states=all", "-r", "-o", "%T", "-j", job])
            .trim()
            .to_owned()
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        let _ = self.command(&["down"], &[]).output();
    }
}

struct Farm {
    dir: TempDir,
}

impl Farm {
    fn planned(args: &[&str]) -> Farm {
        let farm = Farm { dir: tempfile::tempdir().expect("a folder") };
        let folder = farm.folder();
        let output = nimbus(
            &[&["farm", "plan", SCENE, "-o", folder.to_str().expect("UTF-8")], args].concat(),
        );
        assert!(output.status.success(), "{}", text(&output));
        farm
    }

    fn folder(&self) -> PathBuf {
        self.dir.path().join("a farm")
    }

    fn merged(&self) -> PathBuf {
        self.folder().join("merged")
    }

    /// Submitted: the arrays' and the merge's ids.
    fn submit(&self, cluster: &Cluster) -> (String, String) {
        self.submit_with(cluster, &[])
    }

    fn submit_with(&self, cluster: &Cluster, options: &[&str]) -> (String, String) {
        let folder = self.folder();
        let submit =
            ["farm", "submit", "slurm", "--json", "--plan", folder.to_str().expect("UTF-8")];
        let output = cluster.nimbus(&[&submit[..], options].concat());
        assert!(output.status.success(), "{}", text(&output));
        let ids: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let of = |id: &Value| id.as_str().expect("an id").to_owned();
        (of(&ids["arrays"][0]["job"]), of(&ids["merge"]))
    }

    fn status(&self, cluster: &Cluster) -> Value {
        let folder = self.folder();
        let output = cluster.nimbus(&[
            "farm",
            "status",
            "--json",
            "--plan",
            folder.to_str().expect("UTF-8"),
        ]);
        serde_json::from_slice(&output.stdout).expect("JSON")
    }

    /// Nodes that have begun shards and not finished them.
    fn at_work(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder().join("shards")).into_iter().flatten().flatten();
        let node = |name: String| {
            name.split(".tmp.").nth(1).and_then(|who| who.split('.').next().map(str::to_owned))
        };
        entries
            .filter(|entry| {
                fs::read_to_string(entry.path().join("done.jsonl"))
                    .is_ok_and(|t| t.lines().count() > 1)
            })
            .filter_map(|entry| node(entry.file_name().to_string_lossy().into_owned()))
            .collect()
    }

    /// All attempts' lines.
    fn attempts(&self) -> Vec<Value> {
        let files = fs::read_dir(self.folder().join("attempts")).expect("attempts").flatten();
        let lines = files.flat_map(|file| {
            let text = fs::read_to_string(file.path()).expect("a file");
            text.lines()
                .map(|line| serde_json::from_str(line).expect("a line"))
                .collect::<Vec<Value>>()
        });
        lines.collect()
    }

    fn logs(&self) -> String {
        let files = fs::read_dir(self.folder().join("logs")).into_iter().flatten().flatten();
        files
            .map(|f| {
                format!("{:?}: {}", f.file_name(), fs::read_to_string(f.path()).unwrap_or_default())
            })
            .collect()
    }
}

fn nimbus(args: &[&str]) -> Output {
    Command::new(assert_cmd::cargo::cargo_bin("nimbus"))
        .args(args)
        .output()
        .expect("the program runs")
}

fn wait_for(farm: &Farm, what: &str, is_so: impl Fn() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(
            begin.elapsed() < PATIENCE,
            "{what} does not come: {:?} {}",
            farm.attempts(),
            farm.logs()
        );
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn content(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut all: Vec<(String, Vec<u8>)> = fs::read_dir(folder)
        .expect("a folder")
        .flatten()
        .map(|e| {
            (e.file_name().to_string_lossy().into_owned(), fs::read(e.path()).expect("a file"))
        })
        .collect();
    all.sort();
    all
}

/// The frames as one process on this machine draws them, a frame after the other.
fn alone(frames: &str, size: &str) -> Vec<(String, Vec<u8>)> {
    let farm = Farm::planned(&["--frames", frames, "--shard-frames", "1000", "--size", size]);
    let (folder, merged) = (farm.folder(), farm.merged());
    let folder = folder.to_str().expect("UTF-8");
    for args in [
        &["farm", "local", "--plan", folder][..],
        &["farm", "merge", "--plan", folder, "-o", merged.to_str().expect("UTF-8")],
    ] {
        let output = nimbus(args);
        assert!(output.status.success(), "{}", text(&output));
    }
    content(&merged)
}

#[test]
fn on_slurm_240_frames_are_what_one_machine_draws() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "240", "--shard-frames", "10", "--size", "64x48"]);
    let (_, merge) = farm.submit(&cluster);
    wait_for(&farm, "the merge", || cluster.state(&merge) == "COMPLETED");
    let merged = content(&farm.merged());
    assert_eq!(merged.len(), 240);
    assert!(merged == alone("240", "64x48"), "what is merged is not what one machine draws");
    let nodes: std::collections::BTreeSet<String> =
        farm.attempts().iter().map(|a| a["node"].as_str().expect("a name").to_owned()).collect();
    assert_eq!(nodes.len(), 4, "{nodes:?}");
    assert_eq!(farm.status(&cluster)["n_done"], 24);

    // Nothing is left to do, and Slurm is not asked.
    let folder = farm.folder();
    let output =
        cluster.nimbus(&["farm", "submit", "slurm", "--plan", folder.to_str().expect("UTF-8")]);
    assert!(text(&output).contains("nothing was submitted"), "{}", text(&output));
}

#[test]
fn on_slurm_a_study_of_60_configurations_is_the_one_of_one_machine() {
    let cluster = Cluster::up();
    let dir = tempfile::tempdir().expect("a folder");
    let hello = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml");
    let knobs =
        ["draw.cutoff=2,2.5,3.5,4,5", "lighting.grid=16,24,40,48", "draw.sort_bits=16,32,\"auto\""];
    let mut study =
        vec!["--grid", "--against", "thin", "--pixels", "64", "--rounds", "1", "--frames", "1"];
    knobs.iter().for_each(|knob| study.extend(["--knob", *knob]));
    let folder = dir.path().join("a farm");
    let plan = [
        "farm",
        "plan",
        hello,
        "-o",
        folder.to_str().expect("UTF-8"),
        "--size",
        "48x36",
        "--error",
        "--",
    ];
    let output = nimbus(&[&plan[..], &study].concat());
    assert!(
        output.status.success() && text(&output).starts_with("60 configurations in 8 shards"),
        "{}",
        text(&output)
    );
    let farm = Farm { dir };
    let (_, merge) = farm.submit(&cluster);
    wait_for(&farm, "the merge", || cluster.state(&merge) == "COMPLETED");
    let alone = farm.dir.path().join("alone");
    let error = ["error", hello, "--size", "48x36", "-q", "--out", alone.to_str().expect("UTF-8")];
    let output = nimbus(&[&error[..], &study].concat());
    assert!(output.status.success(), "{}", text(&output));
    let read = |folder: &Path| -> Value {
        serde_json::from_slice(&fs::read(folder.join("study.json")).expect("a study"))
            .expect("JSON")
    };
    let of = |study: &Value| -> Vec<[Value; 4]> {
        // The scene as it stands, which is the first, has turns in every part.
        let all = study["configurations"].as_array().expect("configurations").iter().skip(1);
        let mut all: Vec<_> =
            all.map(|c| ["name", "hash", "error", "n_turns"].map(|key| c[key].clone())).collect();
        all.sort_by_key(|c| c[0].to_string());
        all
    };
    let (ours, theirs) = (read(&farm.merged()), read(&alone));
    assert!(of(&ours).len() > 40 && of(&ours) == of(&theirs), "{:?}\n{:?}", of(&ours), of(&theirs));
    let keys =
        |value: &Value| value.as_object().expect("an object").keys().cloned().collect::<Vec<_>>();
    assert_eq!(
        (keys(&ours), keys(&ours["configurations"][7])),
        (keys(&theirs), keys(&theirs["configurations"][7]))
    );
}

/// A node without power, one without network, whose task goes on while its copy runs elsewhere, and
/// a controller that dies.
#[test]
fn on_slurm_nodes_are_killed_and_cut_off_and_the_controller_is_restarted() {
    let cluster = Cluster::up();
    let size = "400x300";
    let farm = Farm::planned(&["--frames", "96", "--shard-frames", "24", "--size", size]);
    let (array, merge) = farm.submit(&cluster);
    let submitted = Instant::now();
    let all = ["n1", "n2", "n3", "n4"];
    wait_for(&farm, "work on every node", || {
        all.iter().all(|node| farm.at_work().iter().any(|at| at == node))
    });
    let engine = farm.status(&cluster)["shards"][0]["engine"].as_str().map(str::to_owned);
    assert!(
        engine.as_ref().is_some_and(|e| e.starts_with("RUNNING on n") && e.contains(&array)),
        "{engine:?}"
    );
    // What is queued is not queued again.
    let folder = farm.folder();
    let output =
        cluster.nimbus(&["farm", "submit", "slurm", "--plan", folder.to_str().expect("UTF-8")]);
    assert!(
        output.status.code() == Some(2) && text(&output).contains("are with Slurm already"),
        "{}",
        text(&output)
    );
    cluster.told(&["node-kill"], &["n2"]);
    cluster.told(&["node-cut"], &["n3"]);
    // The controller writes down what it has every few seconds: one that dies before has never
    // heard of the job.
    std::thread::sleep(Duration::from_secs(7).saturating_sub(submitted.elapsed()));
    assert_eq!(cluster.state(&merge), "PENDING");
    cluster.told(&["controller-restart"], &[]);
    wait_for(&farm, "the merge", || cluster.state(&merge) == "COMPLETED");
    assert!(
        content(&farm.merged()) == alone("96", size),
        "what is merged is not what one machine draws"
    );

    let attempts = farm.attempts();
    let of = |node: &str, event: &str| {
        attempts.iter().filter(|a| a["node"] == node && a["event"]["event"] == event).count()
    };
    // The killed node's shard was begun there and never ended; the cut one's was finished there,
    // though nobody heard of it.
    assert_eq!(
        (of("n2", "begun"), of("n2", "done") + of("n2", "beaten") + of("n2", "failed")),
        (1, 0),
        "{attempts:?}"
    );
    assert_eq!(of("n3", "done") + of("n3", "beaten"), 1, "{attempts:?}");
    let n_begun = attempts.iter().filter(|a| a["event"]["event"] == "begun").count();
    // n3's copy comes when n3 has long finished here: it is begun where n3 takes longer.
    assert!(
        n_begun >= 5 && attempts.iter().any(|a| a["event"]["n_resumed"].as_u64() > Some(0)),
        "{attempts:?}"
    );
    assert!(
        farm.status(&cluster)["shards"]
            .as_array()
            .expect("shards")
            .iter()
            .all(|s| s["n_differing"] == 0)
    );
}

#[test]
fn on_slurm_what_may_pass_is_queued_again_and_what_stays_ends_the_merge() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "4", "--shard-frames", "2", "--size", "48x36"]);
    let folder = farm.folder();
    let plan = folder.to_str().expect("UTF-8");
    let output = nimbus(&["farm", "emit", "slurm", "--plan", plan]);
    assert!(output.status.success(), "{}", text(&output));
    // The first time no node has a device.
    let script = folder.join("slurm/shard.sh");
    let drivers = "[ \"${SLURM_RESTART_COUNT:-0}\" -gt 0 ] || export VK_DRIVER_FILES=/nowhere \
        VK_ICD_FILENAMES=/nowhere\n";
    let shard =
        fs::read_to_string(&script).expect("it").replace("set -u\n", &format!("set -u\n{drivers}"));
    fs::write(&script, shard).expect("room");
    let script = script.to_str().expect("UTF-8");
    let array =
        cluster.told(&["run"], &["sbatch", "--parsable", "--array=0-1", script]).trim().to_owned();
    wait_for(&farm, "both shards", || cluster.state(&array) == "COMPLETED\nCOMPLETED");
    let attempts = farm.attempts();
    let failed: Vec<&Value> = attempts.iter().filter(|a| a["event"]["event"] == "failed").collect();
    assert!(
        failed.len() == 2 && failed.iter().all(|a| a["event"]["exit_code"] == 75),
        "{attempts:?}"
    );

    // A plan whose scene has changed: no try helps, and the merge does not wait for ever.
    let scene = farm.dir.path().join("changing.toml");
    let text_of = fs::read_to_string(SCENE)
        .expect("a scene")
        .replace("cubes-", concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cubes-"));
    fs::write(&scene, &text_of).expect("room");
    let other = farm.dir.path().join("other");
    let other = other.to_str().expect("UTF-8");
    let output = nimbus(&[
        "farm",
        "plan",
        scene.to_str().expect("UTF-8"),
        "--frames",
        "2",
        "--size",
        "48x36",
        "-o",
        other,
    ]);
    assert!(output.status.success(), "{}", text(&output));
    let submitted = cluster.nimbus(&[
        "farm",
        "submit",
        "slurm",
        "--json",
        "--plan",
        other,
        "--sbatch=--begin=now+3",
    ]);
    assert!(submitted.status.success(), "{}", text(&submitted));
    fs::write(&scene, text_of.replace("fov_y_deg = 55.0", "fov_y_deg = 50.0")).expect("room");
    let ids: Value = serde_json::from_slice(&submitted.stdout).expect("JSON");
    let [array, merge] =
        [&ids["arrays"][0]["job"], &ids["merge"]].map(|id| id.as_str().expect("an id").to_owned());
    wait_for(&farm, "the end", || {
        cluster.state(&array) == "FAILED" && cluster.state(&merge) == "FAILED"
    });
    assert!(!Path::new(other).join("merged").exists());
    let output = nimbus(&["farm", "status", "--plan", other]);
    assert!(text(&output).contains("0 of 1 shards are done"), "{}", text(&output));
}
