//! Earlier results outlast every failure of the run that replaces them.
//!
//! Each command replaces old results under `strace`, which makes one system call fail as on a full
//! disk, or kills the process at it. Every call that changes a file or a name can be the one.
//! Afterwards the old results are there or the new ones, whole, beside the user's own files.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Output};

use crate::jobs::{JOBS, Job};
use crate::tiny::Tiny;
use nimbus::io::claim::Claim;
use serde_json::Value;

/// Calls that take space on a disk.
const FILLING: [&str; 9] = [
    "write",
    "openat",
    "rename",
    "renameat2",
    "link",
    "linkat",
    "mkdir",
    "ftruncate",
    "copy_file_range",
];
/// Calls that remove files and names.
const REMOVING: [&str; 3] = ["unlink", "unlinkat", "rmdir"];
/// Faults and kills of a job by default. `every_call_of_every_command` tries all calls.
const N_POINTS: usize = 8;
const SIGKILL: i32 = 9;
/// Files of the user in the folder of results.
const NOTES: [&str; 3] = ["notes.txt", "picture-9.png", "case-7.png"];

/// Every file below a folder, or the file itself, with its content.
fn content(path: &Path) -> BTreeMap<String, Vec<u8>> {
    let name = |path: &Path| path.file_name().expect("a name").to_string_lossy().into_owned();
    match path.read_dir() {
        Ok(entries) => {
            entries.flat_map(|entry| content(&entry.expect("an entry").path())).collect()
        }
        Err(_) => fs::read(path).map(|bytes| (name(path), bytes)).into_iter().collect(),
    }
}

/// A job's folder with old results and files of the user.
struct Place {
    tiny: Tiny,
    job: &'static Job,
    old: BTreeMap<String, Vec<u8>>,
}

impl Place {
    fn new(job: &'static Job) -> Place {
        let tiny = Tiny::new();
        for args in job.before.iter().copied().chain([&[job.command, job.old].concat()[..]]) {
            tiny.good(args);
        }
        let out = tiny.path(job.out);
        if out.is_dir() {
            NOTES.iter().for_each(|name| fs::write(out.join(name), "mine").expect("a file"));
        }
        let old = content(&out);
        for args in job.between {
            tiny.good(args);
        }
        Place { tiny, job, old }
    }

    /// Puts the old results back and removes all else that a run leaves.
    fn reset(&self) {
        let out = self.tiny.path(self.job.out);
        for entry in self.tiny.path("").read_dir().expect("the folder") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            if name.trim_start_matches('.').starts_with(self.job.out) || name.ends_with(".tmp") {
                let _ =
                    if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
            }
        }
        if self.job.out.contains('.') {
            self.old.values().for_each(|bytes| fs::write(&out, bytes).expect("a file"));
            return;
        }
        fs::create_dir(&out).expect("a folder");
        for (name, bytes) in &self.old {
            fs::write(out.join(name), bytes).expect("a file");
        }
    }

    /// Runs the job with options of strace.
    fn traced(&self, options: &[&str]) -> Output {
        let plain = self.tiny.command(&self.job.args());
        let mut command = Command::new("strace");
        command.args(["-o", "trace.log", "-y", "-s", "0"]).args(options);
        command.arg("--").arg(plain.get_program()).args(plain.get_args());
        command.envs(plain.get_envs().filter_map(|(k, v)| Some((k, v?))));
        command.current_dir(self.tiny.path("")).output().expect("strace runs")
    }

    /// Returns the name, the number from 1 and the text of every call that changes a file or a
    /// name of the job's folder. Calls are counted by name, as strace counts them.
    fn calls(&self) -> Vec<(String, usize, String)> {
        let names = [&FILLING[..], &REMOVING].concat();
        // The first run fills the cache of references, which changes the number of calls.
        self.again();
        self.reset();
        let output = self.traced(&["-e", &format!("trace={}", names.join(","))]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(self.is_new(), "{:?}", self.job.args());
        let folder = self.tiny.path("").display().to_string();
        let (mut counts, mut found) = (BTreeMap::<&str, usize>::new(), Vec::new());
        let log = self.tiny.text("trace.log");
        for line in log.lines() {
            let Some((name, rest)) = line.split_once('(') else { continue };
            let n = counts.entry(name).or_default();
            *n += 1;
            let is_ours = rest.contains(&folder) || rest.contains(self.job.out);
            let changes = name != "openat" || rest.contains("O_CREAT");
            if is_ours && changes && !rest.contains("/cache/") {
                found.push((name.to_owned(), *n, line.to_owned()));
            }
        }
        assert!(found.len() > 3, "{log}");
        found
    }

    fn is_old(&self) -> bool {
        content(&self.tiny.path(self.job.out)) == self.old
    }

    /// Returns whether the new results are there and whole, and the user's files as they were.
    fn is_new(&self) -> bool {
        !self.is_old() && self.is_whole()
    }

    fn is_whole(&self) -> bool {
        let out = self.tiny.path(self.job.out);
        if !out.is_dir() {
            let bytes = fs::read(&out).unwrap_or_default();
            let text = String::from_utf8_lossy(&bytes);
            let is_page = text.trim_end().ends_with("</html>");
            return if self.job.out.ends_with(".html") {
                is_page
            } else {
                image::open(&out).is_ok()
            };
        }
        let kind = self.job.record.map_or("frames", |record| record.trim_end_matches(".json"));
        let list = format!("{kind}.sha256");
        let mut check = Command::new("sha256sum");
        let check = check.args(["--quiet", "--strict", "-c", &list]).current_dir(&out).output();
        let is_listed = check.expect("sha256sum runs").status.success();
        let is_finished = self.job.record.is_none_or(|record| {
            let text = fs::read_to_string(out.join(record)).unwrap_or_default();
            let record: Value = serde_json::from_str(&text).unwrap_or_default();
            let command = record["command"].to_string();
            record["interrupted"] == false && command.contains("--force")
        });
        let notes = NOTES.iter().all(|n| fs::read(out.join(n)).is_ok_and(|text| text == b"mine"));
        // Old pictures that the new results do not have are gone.
        let list = fs::read_to_string(out.join(list)).unwrap_or_default();
        let n_listed = list.lines().count();
        let n_files = fs::read_dir(&out).expect("the folder").count();
        is_listed && is_finished && notes && n_files == n_listed + 1 + NOTES.len()
    }

    /// Makes one call fail as on a full disk.
    fn fault(&self, (name, n, line): &(String, usize, String)) {
        self.reset();
        let inject = format!("inject={name}:error=ENOSPC:when={n}");
        let output = self.traced(&["-e", &format!("trace={name}"), "-e", &inject]);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        let at = format!("{:?} at {name} {n}: {line}\n{stderr}", self.job.args());
        let trace = self.tiny.text("trace.log");
        assert!(trace.contains("(INJECTED)"), "no call failed: {at}\n{trace}");
        assert!(matches!(output.status.code(), Some(0 | 2 | 75)), "{}: {at}", output.status);
        assert!(!stderr.contains("panicked"), "{at}");
        assert!(self.is_old() || self.is_new(), "neither old nor new results: {at}");
        assert!(output.status.success() || stderr.contains("error: "), "{at}");
        let is_last = self.job.last.iter().any(|file| line.contains(file));
        if is_last && !output.status.success() {
            assert!(!output.stdout.is_empty(), "the table does not appear: {at}");
        }
        let folder = self.tiny.path("");
        let left = fs::read_dir(&folder).expect("the folder").map(|e| e.expect("an entry"));
        let left: Vec<_> = left.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        let is_temporary = |name: &String| name.ends_with(".tmp") || name.ends_with(".claim");
        assert!(!left.iter().any(is_temporary), "{left:?}: {at}");
    }

    /// Kills the process at a call.
    fn kill(&self, (name, n, line): &(String, usize, String)) {
        self.reset();
        let inject = format!("inject={name}:signal=SIGKILL:when={n}");
        let output = self.traced(&["-e", &format!("trace={name}"), "-e", &inject]);
        let at = format!("{:?} killed at {name} {n}: {line}", self.job.args());
        // strace ends with the signal that ended the program.
        assert_eq!(output.status.signal(), Some(SIGKILL), "{}: {at}", output.status);
        assert!(self.is_old() || self.is_new(), "neither old nor new results: {at}");
    }

    /// Runs the job over all that a killed run has left.
    fn again(&self) {
        let output = self.tiny.run(&self.job.args());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && self.is_new(), "{:?}: {stderr}", self.job.args());
    }
}

/// Tries `n_points` calls of a job, evenly spread over all of them.
fn outlasts(job: &'static Job, n_points: usize) {
    let place = Place::new(job);
    let calls = place.calls();
    let chosen = |of: &[&str], offset: f64| {
        let fit: Vec<_> = calls.iter().filter(|(name, ..)| of.contains(&name.as_str())).collect();
        let n = n_points.min(fit.len());
        let at = |k: usize| ((k as f64 + offset) / n as f64 * fit.len() as f64) as usize;
        (0..n).map(|k| fit[at(k)].clone()).collect::<Vec<_>>()
    };
    for call in chosen(&FILLING, 0.3) {
        place.fault(&call);
    }
    let all = [&FILLING[..], &REMOVING].concat();
    for call in chosen(&all, 0.8) {
        place.kill(&call);
        place.again();
    }
    println!("{:?}: {} calls", job.args(), calls.len());
}

#[test]
fn a_bench_keeps_the_earlier_one() {
    outlasts(&JOBS[0], N_POINTS);
}

#[test]
fn a_study_keeps_the_earlier_one() {
    outlasts(&JOBS[1], N_POINTS);
}

#[test]
fn a_ledger_keeps_the_earlier_one() {
    outlasts(&JOBS[2], N_POINTS);
}

#[test]
fn pictures_and_pages_keep_the_earlier_ones() {
    outlasts(&JOBS[3], N_POINTS);
    outlasts(&JOBS[4], N_POINTS);
}

#[test]
fn a_merge_keeps_the_earlier_one() {
    outlasts(&JOBS[5], N_POINTS);
}

/// Some ten minutes on two cores.
#[test]
#[ignore = "long: cargo test --release --test commands results_kept -- --ignored"]
fn every_call_of_every_command() {
    JOBS.iter().for_each(|job| outlasts(job, usize::MAX));
}

/// A place belongs to one run at a time. Each command names the run that has it.
#[test]
fn the_second_run_into_a_place_says_who_has_it() {
    for job in &JOBS {
        let place = Place::new(job);
        let claim = Claim::take(&place.tiny.path(job.out)).expect("a free place");
        assert!(claim.is_some());
        let mut runs = vec![job.args()];
        if !job.resume.is_empty() {
            runs.push([job.command, job.resume].concat());
        }
        for args in &runs {
            let output = place.tiny.run(args);
            let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(75), "{args:?}: {stderr}");
            let owner = format!("process {}", std::process::id());
            assert!(stderr.contains(&owner) && stderr.lines().count() == 1, "{args:?}: {stderr}");
            assert!(place.is_old(), "{args:?}");
        }
        drop(claim);
        place.again();
    }
}
