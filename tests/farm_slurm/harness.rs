//! A cluster, a farm on it, and the states of both.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

pub const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/flyby.toml");
const TOOL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tools/slurm-test-cluster");
/// The longest wait for a state. It only ends tests that would hang.
const PATIENCE: Duration = Duration::from_secs(900);
/// Bit 14 of a mask of signals: SIGTERM.
const SIGTERM_BIT: u64 = 1 << 14;

/// Everything that a program printed.
pub fn text(output: &Output) -> String {
    [&output.stdout, &output.stderr]
        .map(|bytes| String::from_utf8_lossy(bytes).into_owned())
        .concat()
}

pub fn path_text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

pub fn nimbus(args: &[&str]) -> Output {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("nimbus"));
    command.args(args).output().expect("the program runs")
}

/// Runs nimbus and expects success.
pub fn succeed(args: &[&str]) -> String {
    let output = nimbus(args);
    assert!(output.status.success(), "{}", text(&output));
    text(&output)
}

pub struct Cluster {
    pub folder: TempDir,
}

impl Cluster {
    pub fn up() -> Cluster {
        let folder = tempfile::Builder::new().prefix("slurm").tempdir().expect("a folder");
        let cluster = Cluster { folder };
        cluster.tool(&["up"], &["--nodes", "4", "--cpus", "1"]);
        cluster
    }

    fn command(&self, verb: &[&str], rest: &[&str]) -> Command {
        let mut command = Command::new(TOOL);
        command.args(verb).arg(self.folder.path()).args(rest);
        // A stopped run may hold the lock of Mesa's cache, which all others wait for. A cache of
        // many files has no such lock.
        command.env("MESA_DISK_CACHE_MULTI_FILE", "true");
        command
    }

    /// Runs the tool and returns its output.
    pub fn tool(&self, verb: &[&str], rest: &[&str]) -> String {
        let output = self.command(verb, rest).output().expect("the tool");
        assert!(output.status.success(), "{verb:?}: {}", text(&output));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// Runs a command of Slurm.
    pub fn slurm(&self, command: &[&str]) -> String {
        self.tool(&["run"], command).trim().to_owned()
    }

    /// Runs nimbus where it finds Slurm.
    pub fn nimbus(&self, args: &[&str]) -> Output {
        self.nimbus_with_path(&std::env::var("PATH").expect("a path"), args)
    }

    /// Runs nimbus where it finds Slurm by another PATH.
    pub fn nimbus_with_path(&self, path: &str, args: &[&str]) -> Output {
        let program = assert_cmd::cargo::cargo_bin("nimbus");
        let mut command = self.command(&["run"], &[path_text(&program)]);
        command.args(args).env("PATH", path).output().expect("the tool")
    }

    /// Returns the states of a job's tasks.
    pub fn state(&self, job: &str) -> String {
        self.slurm(&["squeue", "-h", "--states=all", "-r", "-o", "%T", "-j", job])
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        let _ = self.command(&["down"], &[]).output();
    }
}

/// A run that was stopped in the middle of its shard.
pub struct Stopped {
    pub node: String,
    pub index: u64,
    pid: String,
}

impl Stopped {
    /// Lets the run go on.
    pub fn resume(&self) {
        assert!(send("-CONT", &self.pid));
    }

    /// Waits until the run has been asked to end, and lets it go on. Slurm itself continues what it
    /// asks to end; a job script does not.
    pub fn resume_when_asked_to_end(&self, farm: &Farm) {
        farm.wait_for("SIGTERM", || self.is_asked_to_end());
        // It may have ended since.
        send("-CONT", &self.pid);
    }

    fn is_asked_to_end(&self) -> bool {
        let status = fs::read_to_string(format!("/proc/{}/status", self.pid)).unwrap_or_default();
        let field = |name: &str| {
            let line = status.lines().find(|line| line.starts_with(name))?;
            Some(line[name.len()..].trim().to_owned())
        };
        let pending = field("ShdPnd:").and_then(|mask| u64::from_str_radix(&mask, 16).ok());
        let is_stopped = field("State:").is_some_and(|state| state.starts_with('T'));
        !is_stopped || pending.is_some_and(|mask| mask & SIGTERM_BIT != 0)
    }
}

/// Sends a signal. Returns false where there is no such process.
pub fn send(signal: &str, pid: &str) -> bool {
    Command::new("kill").args([signal, pid]).output().expect("kill").status.success()
}

fn is_stopped(pid: &str) -> bool {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit(") ").next().is_some_and(|rest| rest.starts_with('T'))
}

pub struct Farm {
    pub dir: TempDir,
}

impl Farm {
    /// Plans the fly-by.
    pub fn planned(args: &[&str]) -> Farm {
        Farm::of(SCENE, args)
    }

    pub fn of(scene: &str, args: &[&str]) -> Farm {
        let farm = Farm { dir: tempfile::tempdir().expect("a folder") };
        succeed(&[&["farm", "plan", scene, "-o", farm.path()], args].concat());
        farm
    }

    pub fn folder(&self) -> PathBuf {
        self.dir.path().join("a farm")
    }

    /// The folder as an argument.
    pub fn path(&self) -> &'static str {
        // Tests are short: the few strings are not freed.
        Box::leak(path_text(&self.folder()).to_owned().into_boxed_str())
    }

    pub fn merged(&self) -> PathBuf {
        self.folder().join("merged")
    }

    /// Submits all shards. Returns Slurm's ids of the array and of the merge.
    pub fn submit(&self, cluster: &Cluster, options: &[&str]) -> (String, String) {
        let submit = ["farm", "submit", "slurm", "--json", "--plan", self.path()];
        ids(&cluster.nimbus(&[&submit[..], options].concat()))
    }

    pub fn status(&self, cluster: &Cluster) -> Value {
        let output = cluster.nimbus(&["farm", "status", "--json", "--plan", self.path()]);
        serde_json::from_slice(&output.stdout).expect("JSON")
    }

    /// Stops runs that have finished two frames at least and have not finished their shard, until
    /// there are `n` of them.
    pub fn stop_midway(&self, n: usize) -> Vec<Stopped> {
        let mut pids: Vec<String> = Vec::new();
        let mut stopped = Vec::new();
        while stopped.len() < n {
            let mut next = None;
            self.wait_for("a run in the middle of its shard", || {
                next = self.unfinished().into_iter().find(|(_, pid)| !pids.contains(pid));
                next.is_some()
            });
            let Some((folder, pid)) = next else { continue };
            pids.push(pid.clone());
            if send("-STOP", &pid) {
                self.wait_for("the stop", || is_stopped(&pid) || !folder.exists());
                // Otherwise the run has just finished the shard.
                if folder.exists() {
                    stopped.push(self.stopped(pid));
                }
            }
        }
        stopped
    }

    fn stopped(&self, pid: String) -> Stopped {
        let attempts = self.attempts();
        let attempt =
            attempts.iter().find(|a| a["pid"].as_u64() == pid.parse().ok()).expect("a record");
        let node = attempt["node"].as_str().expect("a name").to_owned();
        Stopped { node, index: attempt["index"].as_u64().expect("a number"), pid }
    }

    /// The folders of runs that have finished two frames at least, and their processes.
    fn unfinished(&self) -> Vec<(PathBuf, String)> {
        let entries = fs::read_dir(self.folder().join("shards")).into_iter().flatten().flatten();
        let has_frames = |path: &PathBuf| {
            fs::read_to_string(path.join("done.jsonl")).is_ok_and(|t| t.lines().count() > 1)
        };
        let pid = |path: PathBuf| {
            let name = path_text(&path);
            let pid = name.split_once(".tmp.")?.1.rsplit('.').next()?.to_owned();
            Some((path, pid))
        };
        entries.map(|entry| entry.path()).filter(has_frames).filter_map(pid).collect()
    }

    /// All recorded events.
    pub fn attempts(&self) -> Vec<Value> {
        let files = fs::read_dir(self.folder().join("attempts")).into_iter().flatten().flatten();
        let texts = files.map(|file| fs::read_to_string(file.path()).expect("a file"));
        let lines = texts.flat_map(|text| {
            // A line may just be written.
            let records = text.lines().filter_map(|line| serde_json::from_str(line).ok());
            records.collect::<Vec<Value>>()
        });
        lines.collect()
    }

    /// The field `key` of all events of a kind.
    pub fn events(&self, event: &str, key: &str) -> Vec<u64> {
        let attempts = self.attempts();
        let of_kind = attempts.iter().map(|a| &a["event"]).filter(|e| e["event"] == event);
        of_kind.map(|e| e[key].as_u64().expect("a number")).collect()
    }

    pub fn logs(&self) -> String {
        let files = fs::read_dir(self.folder().join("logs")).into_iter().flatten().flatten();
        let text = |file: fs::DirEntry| fs::read_to_string(file.path()).unwrap_or_default();
        files.map(|f| format!("{:?}: {}", f.file_name(), text(f))).collect()
    }

    /// Waits until something is so.
    pub fn wait_for(&self, what: &str, mut is_so: impl FnMut() -> bool) {
        let begin = Instant::now();
        while !is_so() {
            let is_patient = begin.elapsed() < PATIENCE;
            assert!(is_patient, "{what} does not come: {:?} {}", self.attempts(), self.logs());
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Waits until a job has ended well.
    pub fn wait_for_job(&self, cluster: &Cluster, job: &str) {
        self.wait_for("the end of a job", || cluster.state(job) == "COMPLETED");
    }
}

/// Reads the ids of the first array and of the merge that `farm submit --json` prints.
pub fn ids(output: &Output) -> (String, String) {
    assert!(output.status.success(), "{}", text(output));
    let ids: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let id = |id: &Value| id.as_str().expect("an id").to_owned();
    (id(&ids["arrays"][0]["job"]), id(&ids["merge"]))
}

/// The files of a folder, by name.
pub fn content(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder).expect("a folder").flatten();
    let name = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
    let mut all: Vec<(String, Vec<u8>)> =
        entries.map(|e| (name(&e), fs::read(e.path()).expect("a file"))).collect();
    all.sort();
    all
}

/// The frames as a single process on this machine draws them.
pub fn alone(frames: &str, size: &str) -> Vec<(String, Vec<u8>)> {
    let farm = Farm::planned(&["--frames", frames, "--shard-frames", "1000", "--size", size]);
    succeed(&["farm", "local", "--plan", farm.path()]);
    succeed(&["farm", "merge", "--plan", farm.path(), "-o", path_text(&farm.merged())]);
    content(&farm.merged())
}
