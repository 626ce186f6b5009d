//! nimbus on drivers that fail: no device, devices that it cannot use, and every Vulkan call that
//! can fail, failing.
//!
//! `fake_driver/icd.c` is a Vulkan driver that passes all calls on to lavapipe, but for the faults
//! that environment variables ask for. It also counts the objects that are never destroyed.

#[path = "harness/driver_files.rs"]
mod driver_files;
#[path = "harness/fixtures.rs"]
mod fixtures;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use driver_files::{DriverFiles, MANIFEST_VARIABLES};
use fixtures::Fixtures;
use rayon::prelude::*;
use serde_json::Value;
use tempfile::TempDir;

/// A run takes a fraction of a second. One that takes longer than this hangs.
const MOST_S: u64 = 120;
/// Distinct calls that the runs below make and that can fail, without `ASKED_BY_TIME`. Fewer are a
/// sign that the driver no longer counts a call that nimbus makes.
const N_CALLS: usize = 30;
/// The call whose number differs from run to run.
const ASKED_BY_TIME: &str = "vkGetSemaphoreCounterValue";
/// Exit codes of a device that fails, and of a limit.
const DEVICE: i32 = 3;
const LIMIT: i32 = 2;

/// The fake driver, and a folder with a small scene.
struct FakeDriver {
    scene: Fixtures,
    driver: DriverFiles,
}

/// A run of nimbus that has ended.
struct Ended {
    status: ExitStatus,
    stdout: String,
    stderr: String,
    /// Lines that the fake driver has logged.
    log: String,
    /// Folder in which the run writes.
    out: TempDir,
}

/// A command that writes its results into the folder `{}`.
#[derive(Clone, Copy)]
struct Job {
    line: &'static str,
}

const RENDER: Job = Job { line: "render s.toml -q -o {}/a.png" };
/// Without the check, which leaves out what has passed before.
const BENCH: Job = Job { line: "bench s.toml -q --frames 3 --warmup 0 --no-check --out {}/run" };

/// One fault in one run.
struct Fault {
    job: Job,
    call: String,
    /// Number of the call that fails, from 1.
    n: u64,
    result: &'static str,
}

/// The place of a call among all calls of its kind.
#[derive(Clone, Copy)]
enum Place {
    First,
    Second,
    Middle,
    Last,
}

impl FakeDriver {
    fn new() -> FakeDriver {
        FakeDriver { scene: Fixtures::new(), driver: DriverFiles::new() }
    }

    /// Runs a command line on the first driver, with variables of the fake driver or the loader.
    fn run(&self, line: &str, variables: &[(&str, &str)]) -> Ended {
        self.run_in(tempfile::tempdir_in(self.scene.dir.path()).expect("a folder"), line, variables)
    }

    /// Runs a command line that writes into the folder `out`.
    fn run_in(&self, out: TempDir, line: &str, variables: &[(&str, &str)]) -> Ended {
        let notes = tempfile::tempdir_in(self.driver.folder()).expect("a folder");
        let [stdout, stderr, log] = ["stdout", "stderr", "log"].map(|n| notes.path().join(n));
        let line = line.replace("{}", &out.path().display().to_string());
        let mut command = self.scene.command(line.split(' '));
        command.envs(self.driver.variables()).env("NIMBUS_FAKE_LOG", &log);
        command.envs(variables.iter().copied());
        // Files, and not pipes, which a program that hangs would leave open.
        command.stdin(Stdio::null());
        command.stdout(fs::File::create(&stdout).expect("room"));
        command.stderr(fs::File::create(&stderr).expect("room"));
        let status = end(&mut command, &format!("{line} {variables:?}"));
        let [stdout, stderr, log] = [stdout, stderr, log]
            .map(|path| String::from_utf8_lossy(&fs::read(path).unwrap_or_default()).into_owned());
        Ended { status, stdout, stderr, log, out }
    }

    /// Returns how often a job makes each call that can fail.
    fn counts(&self, job: Job) -> BTreeMap<String, u64> {
        let path = self.driver.folder().join("counts");
        let _ = fs::remove_file(&path);
        let ended = self.run(job.line, &[("NIMBUS_FAKE_COUNTS", path.to_str().expect("UTF-8"))]);
        assert!(ended.status.success() && ended.log.is_empty(), "{}{}", ended.stderr, ended.log);
        let text = fs::read_to_string(path).expect("the counts");
        let row = |line: &str| {
            let (call, n) = line.split_once(' ').expect("two words");
            (call.to_owned(), n.parse().expect("a number"))
        };
        text.lines().map(row).collect()
    }

    /// Runs a job with a fault and returns what is wrong with its end.
    fn complaints(&self, fault: &Fault) -> Vec<String> {
        let Fault { job, call, n, result } = fault;
        let asked = format!("{call}:{n}:{result}");
        let injected = format!("fault: {call} {n}\n");
        let run = || self.run(job.line, &[("NIMBUS_FAKE_FAIL", &asked)]);
        // The first run with the fault, or the last one.
        let mut ended = run();
        for _ in 1..n_tries(call) {
            if !ended.log.contains(&injected) {
                ended = run();
            }
        }
        let (code, log, stderr) = (ended.status.code(), &ended.log, ended.stderr.trim_end());
        let mut found = vec![];
        if !log.contains(&injected) {
            found.push(format!("the call was made fewer than {n} times"));
        }
        if log.contains("leak:") {
            found.push("objects outlive the device".to_owned());
        }
        // Nothing can be freed that a hung device may still use.
        if *result != "HANG" && log.contains("alive at exit") {
            found.push("the device is never destroyed".to_owned());
        }
        if log.contains("never returns") || log.matches("waited").count() > 2 {
            found.push("a device that hangs is waited for again".to_owned());
        }
        match (code, *result) {
            // The results are complete when the program waits for the last time.
            (Some(0), _) if is_last_wait(call) => found.extend(ended.faults_of_results(false)),
            (Some(DEVICE), _) | (Some(LIMIT), "OUT_OF_DEVICE_MEMORY" | "OUT_OF_HOST_MEMORY") => {
                found.extend(faults_of_message(stderr));
                found.extend(ended.faults_of_results(true));
            }
            _ => found.push(format!("unexpected end: {}", ended.status)),
        }
        let seen = || format!("{}: {asked}: stderr: {stderr}; log: {log}", job.line);
        found.into_iter().map(|what| format!("{what}: {}", seen())).collect()
    }
}

/// Returns the number of runs in which a call must be made often enough to fail. A loop asks for a
/// semaphore's value as often as it finds frames in flight, which is a matter of time.
fn n_tries(call: &str) -> usize {
    if call == ASKED_BY_TIME { 10 } else { 1 }
}

/// Whether a call waits for the device at the very end, when no result is left to be written.
fn is_last_wait(call: &str) -> bool {
    ["vkDeviceWaitIdle", "vkWaitSemaphores"].contains(&call)
}

/// Waits for a command to end; kills it if it hangs.
fn end(command: &mut Command, what: &str) -> ExitStatus {
    let mut child = command.spawn().expect("it runs");
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("a child") {
            return status;
        }
        if start.elapsed() > Duration::from_secs(MOST_S) {
            child.kill().and_then(|()| child.wait()).expect("a child");
            panic!("{what}: still running after {MOST_S} s");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Returns what is wrong with the message of a run that failed.
fn faults_of_message(stderr: &str) -> Vec<String> {
    let is_one = stderr.lines().count() == 1 && stderr.starts_with("error: ");
    let names_source = stderr.contains(".rs") || stderr.contains("panicked");
    let is_leak = stderr.contains("leak");
    let faults = [
        (!is_one, "not one message"),
        (names_source, "the message is for programmers"),
        (is_leak, "memory is leaked"),
    ];
    faults.iter().filter(|(is_so, _)| *is_so).map(|(_, what)| (*what).to_owned()).collect()
}

impl Ended {
    /// Returns the names in the folder that the run has written to.
    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.out.path()).expect("the folder");
        let name = |path: PathBuf| path.file_name().map(|n| n.to_string_lossy().into_owned());
        let mut all: Vec<String> =
            entries.filter_map(|entry| name(entry.expect("an entry").path())).collect();
        all.sort();
        all
    }

    /// Returns what is wrong with the files that are left: whole results or nothing.
    fn faults_of_results(&self, is_cut: bool) -> Vec<String> {
        let names = self.names();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        match (&names[..], is_cut) {
            ([], true) => vec![],
            (["a.png"], false) => match image::open(self.out.path().join("a.png")) {
                Ok(picture) if (picture.width(), picture.height()) == (32, 24) => vec![],
                _ => vec!["a.png is no picture".to_owned()],
            },
            (["run"], _) => match kept_frames(&self.out.path().join("run"), is_cut) {
                Ok(_) => vec![],
                Err(what) => vec![what],
            },
            _ => vec![format!("unexpected files: {names:?}")],
        }
    }
}

/// Returns the number of frames in results, whose files must be whole and which must say whether
/// they were cut short.
fn kept_frames(folder: &Path, is_cut: bool) -> Result<usize, String> {
    let mut check = Command::new("sha256sum");
    check.args(["--quiet", "--strict", "-c", "run.sha256"]).current_dir(folder);
    let check = check.output().expect("sha256sum runs");
    if !check.status.success() {
        return Err(format!("damaged results: {}", String::from_utf8_lossy(&check.stderr)));
    }
    let read = |name| fs::read_to_string(folder.join(name)).map_err(|e| format!("{name}: {e}"));
    let run: Value = serde_json::from_str(&read("run.json")?).map_err(|e| e.to_string())?;
    if run["interrupted"] != is_cut {
        return Err(format!("interrupted is {}", run["interrupted"]));
    }
    match read("frames.csv")?.lines().skip(1).count() {
        0 => Err("no frame is kept".to_owned()),
        n => Ok(n),
    }
}

/// Returns the faults of a job: each call with each pair of a place and a result.
fn faults(driver: &FakeDriver, job: Job, picks: &[(Place, &'static str)]) -> Vec<Fault> {
    let fault = |call: &str, n, result| Fault { job, call: call.to_owned(), n, result };
    let mut all = vec![];
    let counts = driver.counts(job);
    all.extend(
        [1, 2, counts["vkWaitSemaphores"] / 2].map(|n| fault("vkWaitSemaphores", n, "HANG")),
    );
    for (call, n_calls) in counts {
        for (place, result) in picks {
            let n = match place {
                Place::First => 1,
                Place::Second => 2,
                Place::Middle => n_calls.div_ceil(2),
                Place::Last if call == ASKED_BY_TIME => 1,
                Place::Last => n_calls,
            };
            if n <= n_calls {
                all.push(fault(&call, n, *result));
            }
        }
    }
    let openings = ["vkCreateInstance", "vkEnumeratePhysicalDevices", "vkCreateDevice"];
    all.extend(openings.map(|call| fault(call, 1, "INITIALIZATION_FAILED")));
    // Places coincide where a call is made a few times.
    all.sort_by(|a, b| (&a.call, a.n, a.result).cmp(&(&b.call, b.n, b.result)));
    all.dedup_by(|a, b| (&a.call, a.n, a.result) == (&b.call, b.n, b.result));
    all
}

#[test]
fn every_failing_call_ends_the_program_with_one_message() {
    let driver = FakeDriver::new();
    // Together the two jobs have every call fail early, in the middle and late.
    let render = [
        (Place::First, "DEVICE_LOST"),
        (Place::Middle, "DEVICE_LOST"),
        (Place::First, "OUT_OF_DEVICE_MEMORY"),
        (Place::Second, "OUT_OF_HOST_MEMORY"),
    ];
    let bench = [
        (Place::Second, "DEVICE_LOST"),
        (Place::Middle, "DEVICE_LOST"),
        (Place::Last, "DEVICE_LOST"),
        (Place::Middle, "OUT_OF_DEVICE_MEMORY"),
        (Place::First, "OUT_OF_HOST_MEMORY"),
    ];
    let mut all = faults(&driver, RENDER, &render);
    all.extend(faults(&driver, BENCH, &bench));
    let mut calls: Vec<&str> = all.iter().map(|fault| &fault.call[..]).collect();
    calls.retain(|call| *call != ASKED_BY_TIME);
    calls.sort_unstable();
    calls.dedup();
    assert!(calls.len() >= N_CALLS, "{} calls: {calls:?}", calls.len());
    let found: Vec<String> =
        all.par_iter().flat_map_iter(|fault| driver.complaints(fault)).collect();
    let n = all.len();
    assert!(found.is_empty(), "{} faults in {n} runs:\n{}", found.len(), found.join("\n"));
}

#[test]
fn frames_before_a_loss_are_kept() {
    let driver = FakeDriver::new();
    let n_submits = driver.counts(BENCH)["vkQueueSubmit2"];
    let late = format!("vkQueueSubmit2:{}:DEVICE_LOST", n_submits - 2);
    let lost = [("NIMBUS_FAKE_FAIL", &late[..])];
    let first = driver.run(BENCH.line, &lost);
    assert_eq!(first.status.code(), Some(DEVICE), "{}", first.stderr);
    // Two rounds of three loops of three frames, of which the last may be missing.
    let n_kept = kept_frames(&first.out.path().join("run"), true).unwrap_or_else(|e| panic!("{e}"));
    assert!((15..=18).contains(&n_kept), "{n_kept} frames");

    // Earlier results stay where they are.
    let whole = driver.run(BENCH.line, &[]);
    assert!(whole.status.success(), "{}", whole.stderr);
    let second = driver.run_in(whole.out, &format!("{} --force", BENCH.line), &lost);
    assert_eq!(second.status.code(), Some(DEVICE), "{}", second.stderr);
    assert_eq!(second.names(), ["run", "run.partial"]);
    let kept = |name, is_cut| {
        kept_frames(&second.out.path().join(name), is_cut).unwrap_or_else(|e| panic!("{e}"))
    };
    assert_eq!((kept("run", false), kept("run.partial", true)), (18, n_kept));
}

#[test]
fn what_the_driver_says_of_a_loss_is_in_the_message() {
    let driver = FakeDriver::new();
    let tells = ("NIMBUS_FAKE_TELLS", "1");
    for call in ["vkQueueSubmit2", "vkWaitSemaphores"] {
        let log = format!("fault: {call} 2\n");
        let lost = ("NIMBUS_FAKE_FAIL", &format!("{call}:2:DEVICE_LOST")[..]);
        let says = "; the driver says: a page fault; a write to an address that is none from \
                    0x12345000 to 0x12345fff; ";
        for (variables, is_told) in [(&[lost, tells][..], true), (&[lost], false)] {
            let ended = driver.run(RENDER.line, variables);
            let error = ended.stderr.trim_end();
            assert_eq!(ended.status.code(), Some(DEVICE), "{error}");
            assert_eq!((faults_of_message(error), &ended.log[..]), (vec![], &log[..]));
            assert_eq!(error.contains(says), is_told, "{error}");
            assert_eq!(error.contains("(code 0x7, data 0x9)"), is_told, "{error}");
            assert!(!error.contains(char::is_control), "{error:?}");
        }
    }
    let ended = driver.run(RENDER.line, &[tells]);
    assert!(ended.status.success() && ended.log.is_empty(), "{}{}", ended.stderr, ended.log);
}

#[test]
fn commands_of_a_pass_have_its_name_as_a_label() {
    let driver = FakeDriver::new();
    let path = driver.driver.folder().join("labels");
    for limit in ["", " --max-submit-ms 0.01"] {
        let _ = fs::remove_file(&path);
        let line = format!("{}{limit}", RENDER.line);
        let ended = driver.run(&line, &[("NIMBUS_FAKE_LABELS", path.to_str().expect("UTF-8"))]);
        assert!(ended.status.success(), "{}", ended.stderr);
        let labels = fs::read_to_string(&path).expect("labels");
        let (mut open, mut names) = (0, vec![]);
        for line in labels.lines() {
            match line.strip_prefix("begin ") {
                Some(name) => (open, names) = (open + 1, [names, vec![name]].concat()),
                None => open -= 1,
            }
            // Passes lie side by side.
            assert!((0..=1).contains(&open), "{labels}");
        }
        assert_eq!(open, 0, "{labels}");
        assert!(names.contains(&"sort"), "{labels}");
    }
}

#[test]
fn the_list_of_devices_is_clear_on_every_machine() {
    let driver = FakeDriver::new();
    let devices = |variables: &[(&str, &str)], code: i32| {
        let ended = driver.run("devices", variables);
        let what = format!("{variables:?}: {}{}", ended.stdout, ended.stderr);
        assert_eq!(ended.status.code(), Some(code), "{what}");
        if code == 0 {
            assert_eq!(ended.stderr, "", "{what}");
        } else {
            assert_eq!(faults_of_message(ended.stderr.trim_end()), [""; 0], "{what}");
        }
        (ended.stdout, ended.stderr)
    };
    let one = devices(&[], 0).0;
    assert!(one.starts_with("0: llvmpipe") && one.matches("<- used").count() == 1, "{one}");

    let names = driver.driver.manifests(&["first", "second"]);
    let two = devices(&MANIFEST_VARIABLES.map(|name| (name, &names[..])), 0).0;
    assert!(two.contains(": second (discrete)  <- used") && two.contains(": llvmpipe"), "{two}");

    let missing = driver.driver.manifests(&["missing"]);
    let (_, error) = devices(&MANIFEST_VARIABLES.map(|name| (name, &missing[..])), DEVICE);
    assert!(error.contains("there is no Vulkan driver; "), "{error}");

    let (list, error) = devices(&[("NIMBUS_FAKE_DEVICES", "0")], DEVICE);
    assert!(!list.contains("<- used"), "{list}");
    assert!(error.contains("no usable Vulkan 1.3 device (found: none); "), "{error}");

    for (variable, value, why) in [
        ("NIMBUS_FAKE_API", "1.2", "Vulkan 1.3 is needed"),
        ("NIMBUS_FAKE_NO_GRAPHICS", "1", "no queue for both graphics and compute"),
    ] {
        let (list, error) = devices(&[(variable, value)], DEVICE);
        assert!(list.contains(&format!("   not usable: {why}\n")), "{list}");
        assert!(!list.contains("<- used"), "{list}");
        assert!(error.contains("no usable Vulkan 1.3 device (found: 0: llvmpipe"), "{error}");
    }

    // A list opens no device, so that one that is lost is listed, and reported when it is used.
    let lost = [("NIMBUS_FAKE_FAIL", "vkCreateDevice:1:DEVICE_LOST")];
    devices(&lost, 0);
    let ended = driver.run(RENDER.line, &lost);
    assert_eq!(ended.status.code(), Some(DEVICE), "{}", ended.stderr);
    assert!(ended.stderr.starts_with("error: Vulkan: vkCreateDevice: "), "{}", ended.stderr);
    assert_eq!(ended.names(), [""; 0]);
}

#[test]
fn a_bench_on_a_driver_that_leaves_work_out_is_refused() {
    let driver = FakeDriver::new();
    let bench = "bench s.toml -q --frames 3 --warmup 0 --threading serial --no-saved --repeat 1";
    // A driver that executes nothing, one that stops, one that drops a frame in the middle.
    for drop in ["1:1", "9:1", "8:1000000"] {
        let ended = driver.run(bench, &[("NIMBUS_FAKE_DROP", drop)]);
        let error = ended.stderr.trim_end();
        assert_eq!(ended.status.code(), Some(1), "{drop}: {error}");
        assert!(error.contains("the device's picture is wrong: the driver said that"), "{error}");
        assert!(error.contains("did not execute"), "{error}");
    }
    let unchecked =
        driver.run(&format!("{bench} --no-check --json"), &[("NIMBUS_FAKE_DROP", "1:1")]);
    assert!(unchecked.status.success(), "{}", unchecked.stderr);
    let run: Value = serde_json::from_str(&unchecked.stdout).expect("JSON");
    assert_eq!(run["cases"][0]["check"]["verdict"], "not_checked");
    assert_eq!(run["cases"][0]["check"]["reason"], "--no-check");
}
