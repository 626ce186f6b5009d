//! Farms in temporary folders, and runs that are stopped in the middle of their shards.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use sha2::{Digest, Sha256};
use tempfile::TempDir;

/// Exit code, stdout and stderr of a run.
pub type Ran = (Option<i32>, String, String);

pub fn nimbus(args: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("nimbus"));
    // Newer versions of Mesa lock the one file of their cache of shaders while they write to it. A
    // run that is stopped then would hold up all others. A cache of many files has no such lock.
    command.env("NIMBUS_PROGRESS_S", "0").env("MESA_DISK_CACHE_MULTI_FILE", "true");
    command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.env_remove("SLURMD_NODENAME").env_remove("NIMBUS_EXCLUSIVE");
    command
}

pub fn outcome(output: &Output) -> Ran {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// Runs nimbus.
pub fn ran(args: &[&str]) -> Ran {
    outcome(&nimbus(args).output().expect("the program runs"))
}

/// Runs nimbus, expects success without a word on stderr but of what was written, and returns
/// stdout.
pub fn succeed(args: &[&str]) -> String {
    let (code, out, errors) = ran(args);
    let errors: Vec<&str> = errors.lines().filter(|line| !line.starts_with("wrote ")).collect();
    assert_eq!((code, &errors[..]), (Some(0), &[][..]), "{args:?}: {out}");
    out
}

/// Runs nimbus, expects an exit code, and returns stderr.
pub fn fail(expected: i32, args: &[&str]) -> String {
    let (code, out, errors) = ran(args);
    assert_eq!(code, Some(expected), "{args:?}: {out}{errors}");
    errors
}

pub fn path_text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

pub fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("a file")).expect("JSON")
}

pub fn sha256(bytes: &[u8]) -> String {
    format!("{:x}", Sha256::digest(bytes))
}

/// The names in a folder, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder").flatten();
    let mut names: Vec<String> =
        entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The files of a folder, by name.
pub fn content(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let file = |name: String| (name.clone(), fs::read(folder.join(name)).expect("a file"));
    names(folder).into_iter().map(file).collect()
}

/// Waits until something is so. The limit only ends tests that would hang.
pub fn wait_for(what: &str, is_so: impl Fn() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < Duration::from_secs(600), "{what} does not come");
        std::thread::sleep(Duration::from_millis(1));
    }
}

pub fn signal(name: &str, child: &Child) {
    let status = Command::new("kill").args([name, &child.id().to_string()]).status();
    assert!(status.expect("kill").success());
}

fn is_stopped(child: &Child) -> bool {
    let stat = fs::read_to_string(format!("/proc/{}/stat", child.id())).expect("a process");
    stat.rsplit(") ").next().is_some_and(|rest| rest.starts_with(['T', 'Z']))
}

/// A plan and its results.
pub struct Farm {
    _dir: TempDir,
    pub folder: PathBuf,
}

impl Farm {
    /// Plans a scene.
    pub fn of(scene: &str, args: &[&str]) -> Farm {
        let dir = tempfile::tempdir().expect("a folder");
        let folder = dir.path().join("farm");
        let farm = Farm { _dir: dir, folder };
        succeed(&[&["farm", "plan", scene, "-o", farm.path()], args].concat());
        farm
    }

    pub fn path(&self) -> &str {
        path_text(&self.folder)
    }

    /// A path beside the farm's folder.
    pub fn beside(&self, name: &str) -> PathBuf {
        self.folder.with_file_name(name)
    }

    /// A command that does a shard.
    pub fn command(&self, shard: usize) -> Command {
        nimbus(&["farm", "run", "--plan", self.path(), "--shard", &shard.to_string()])
    }

    /// Does a shard.
    pub fn run(&self, shard: usize) -> Ran {
        outcome(&self.command(shard).output().expect("the program runs"))
    }

    /// Does all shards with a single process.
    pub fn local(&self) -> String {
        succeed(&["farm", "local", "--plan", self.path()])
    }

    pub fn merged(&self) -> PathBuf {
        self.beside("merged")
    }

    pub fn merge(&self) -> Ran {
        ran(&["farm", "merge", "--plan", self.path(), "-o", path_text(&self.merged())])
    }

    pub fn plan(&self) -> Value {
        json(&self.folder.join("plan.json"))
    }

    pub fn status(&self) -> Value {
        let out = succeed(&["farm", "status", "--plan", self.path(), "--json"]);
        serde_json::from_str(&out).expect("JSON")
    }

    pub fn state(&self, shard: usize) -> String {
        self.status()["shards"][shard]["state"].as_str().expect("a name").to_owned()
    }

    pub fn missing(&self) -> String {
        let out = succeed(&["farm", "status", "--plan", self.path(), "--missing"]);
        out.trim_end().to_owned()
    }

    fn key(&self, shard: usize) -> String {
        self.plan()["shards"][shard]["key"].as_str().expect("a key").to_owned()
    }

    /// The folder of a shard's result.
    pub fn place(&self, shard: usize) -> PathBuf {
        self.folder.join("shards").join(self.key(shard))
    }

    pub fn manifest(&self, shard: usize) -> Value {
        json(&self.place(shard).join("shard.json"))
    }

    /// Changes the manifest of a shard.
    pub fn change_manifest(&self, shard: usize, change: impl Fn(&mut Value)) {
        let mut manifest = self.manifest(shard);
        change(&mut manifest);
        fs::write(self.place(shard).join("shard.json"), manifest.to_string()).expect("room");
    }

    /// Changes a file of a shard and its manifest, as if the run had made it so, on a node of its
    /// own.
    pub fn change_file(&self, shard: usize, file: &str, from: &str, to: &str) {
        let path = self.place(shard).join(file);
        let before = fs::read_to_string(&path).expect("a file");
        assert!(before.contains(from), "{from}");
        let after = before.replace(from, to);
        fs::write(path, &after).expect("room");
        self.change_manifest(shard, |manifest| {
            manifest["exclusive"] = true.into();
            for record in manifest["files"].as_array_mut().expect("files") {
                if record["name"] == file {
                    record["sha256"] = sha256(after.as_bytes()).into();
                    record["bytes"] = after.len().into();
                }
            }
        });
    }

    /// Folders beside a shard's result, by the word that follows the key.
    pub fn leftovers(&self, shard: usize, kind: &str) -> Vec<PathBuf> {
        let begin = format!("{}.{kind}.", self.key(shard));
        let entries = fs::read_dir(self.folder.join("shards")).into_iter().flatten().flatten();
        let paths = entries.map(|entry| entry.path());
        paths
            .filter(|p| p.file_name().is_some_and(|n| path_text(n.as_ref()).starts_with(&begin)))
            .collect()
    }

    /// Whether a run of this process has finished `n` files of a shard that is not done.
    fn is_midway(&self, shard: usize, child: &Child, n: usize) -> bool {
        let of_child = format!(".{}", child.id());
        self.leftovers(shard, "tmp").iter().any(|folder| {
            path_text(folder).ends_with(&of_child)
                && fs::read_to_string(folder.join("done.jsonl"))
                    .is_ok_and(|text| text.lines().count() >= n)
        })
    }

    /// Starts a run as `node` and stops it when it has finished `n` files at least, and not the
    /// shard. Where the stop comes too late, the result is removed and a new run started.
    pub fn stopped_midway(&self, shard: usize, node: &str, n: usize) -> Child {
        loop {
            let mut child = self.command(shard).env("SLURMD_NODENAME", node).spawn().expect("it");
            wait_for("a file", || self.is_midway(shard, &child, n) || self.place(shard).exists());
            signal("-STOP", &child);
            wait_for("the stop", || is_stopped(&child));
            if self.is_midway(shard, &child, n) {
                return child;
            }
            signal("-CONT", &child);
            child.wait().expect("it ends");
            fs::remove_dir_all(self.place(shard)).expect("a result");
        }
    }

    /// Starts a run and kills it when it has finished `n` files at least, and not the shard.
    pub fn killed_midway(&self, shard: usize, node: &str, n: usize) {
        let mut child = self.stopped_midway(shard, node, n);
        child.kill().expect("a child");
        child.wait().expect("it ends");
    }
}
