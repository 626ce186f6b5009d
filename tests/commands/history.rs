//! `nimbus history` as a user runs it, on results folders and a git checkout made here.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command as Process;

use crate::results;
use assert_cmd::Command;
use nimbus::timing::frame_rows::{FrameRow, FrameTable};
use serde_json::Value;

const N_FRAMES: u32 = 40;

/// A folder with a git checkout of `n` revisions, and their hashes, the oldest first.
fn checkout(n: usize) -> (tempfile::TempDir, Vec<String>) {
    let dir = tempfile::tempdir().expect("a folder");
    let git = |words: &[&str]| {
        let mut git = Process::new("git");
        git.arg("-C").arg(dir.path()).args(["-c", "user.name=t", "-c", "user.email=t@t"]);
        let output = git.args(words).output().expect("git runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("UTF-8").trim().to_owned()
    };
    git(&["init", "-q"]);
    let revisions = (0..n).map(|i| {
        git(&["commit", "-q", "--allow-empty", "-m", &format!("change {i}")]);
        git(&["rev-parse", "HEAD"])
    });
    let revisions = revisions.collect();
    (dir, revisions)
}

/// Writes a run of a revision, whose frames take about `ms`, and returns its folder.
fn write(dir: &Path, i: usize, revision: &str, ms: f64) -> PathBuf {
    // Noise of 0.3 % from run to run, and of 1 % from frame to frame.
    let ms = ms * (1.0 + 0.003 * ((i * 7 % 5) as f64 / 2.0 - 1.0));
    let row = |k: u32| FrameRow {
        frame_ms: ms * (1.0 + 0.01 * (f64::from(k * 7 % 11) / 5.0 - 1.0)),
        ..results::row("serial", k)
    };
    let mut run = results::run(vec![results::mode("serial", N_FRAMES as usize, 0)]);
    revision.chars().take(12).collect::<String>().clone_into(&mut run.revision);
    // Dates run against the revisions.
    run.date = format!("2026-01-{:02}T00:00:00Z", 28 - i);
    let folder = dir.join(format!("run-{i}"));
    fs::create_dir(&folder).expect("a folder");
    let rows = (0..N_FRAMES).map(row).collect();
    results::write(&folder, &run, &FrameTable { pass_names: Vec::new(), rows }).expect("results");
    folder
}

fn history(repo: &Path, folders: &[PathBuf], more: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("nimbus").expect("the program is built");
    command.arg("history").args(folders).args(["--repo"]).arg(repo).args(more);
    let output = command.output().expect("the program runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("an exit code"), text(output.stdout), text(output.stderr))
}

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn a_step_is_found_and_bisected_to_its_revision() {
    // Revision 13 of 0 to 15 makes frames 5 % slower. Runs of 0 to 9 and of three later ones.
    let (repo, revisions) = checkout(18);
    let dir = tempfile::tempdir().expect("a folder");
    let ms = |i: usize| if i < 13 { 20.0 } else { 21.0 };
    let mut folders: Vec<PathBuf> =
        (0..10).chain([15, 16, 17]).map(|i| write(dir.path(), i, &revisions[i], ms(i))).collect();
    // The order of the arguments does not matter.
    folders.reverse();
    for _ in 0..5 {
        let (code, out, stderr) = history(repo.path(), &folders, &["--json", "--bisect"]);
        assert_eq!((code, stderr.as_str()), (0, ""));
        let json = parsed(&out);
        assert_eq!(json["order"], "revision");
        let series = &json["series"][0];
        let change = &series["changes"][0];
        let by = change["by"]["estimate"].as_f64().expect("a number");
        assert!((by - 1.05).abs() < 0.005 && series["changes"][1].is_null(), "{series}");
        if json["next"]["found"] == true {
            assert_eq!(json["next"]["revision"], revisions[13], "{}", json["next"]);
            assert_eq!(json["next"]["subject"], "change 13");
            let (_, text, _) = history(repo.path(), &folders, &["--bisect"]);
            assert!(text.contains("brought the last change of serial (change 13)"), "{text}");
            return;
        }
        let next = json["next"]["measure"].as_str().expect("a revision");
        let i = revisions.iter().position(|r| r == next).expect("one of the checkout");
        assert!((10..15).contains(&i), "{i}");
        folders.push(write(dir.path(), i, next, ms(i)));
    }
    panic!("five more runs were not enough");
}

#[test]
fn a_series_without_a_step_has_no_change_and_a_page() {
    let (repo, revisions) = checkout(12);
    let dir = tempfile::tempdir().expect("a folder");
    let folders: Vec<PathBuf> =
        (0..12).map(|i| write(dir.path(), i, &revisions[i], 20.0)).collect();
    let page = dir.path().join("history.html");
    let more = ["--bisect", "-o", page.to_str().expect("UTF-8")];
    let (code, text, stderr) = history(repo.path(), &folders, &more);
    assert_eq!(code, 0, "{stderr}");
    assert!(text.contains("no change beyond the noise"), "{text}");
    assert!(text.contains("bisect: no frame time has changed"), "{text}");
    assert!(stderr.contains("12 runs on one page"), "{stderr}");
    let html = fs::read_to_string(&page).expect("a page");
    assert!(html.contains("<svg") && html.contains("Frame time: serial"), "no chart");
    // The page is not replaced unasked.
    let (code, _, stderr) = history(repo.path(), &folders, &more);
    assert!(code == 2 && stderr.contains("--force"), "{stderr}");
}

#[test]
fn runs_without_known_revisions_are_ordered_by_date() {
    let (repo, _) = checkout(1);
    let dir = tempfile::tempdir().expect("a folder");
    let folders: Vec<PathBuf> =
        (0..7).map(|i| write(dir.path(), i, "0123456789ab", 20.0)).collect();
    let (code, text, stderr) = history(repo.path(), &folders, &[]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(text.contains("7 runs in the order of dates"), "{text}");
    let json = parsed(&history(repo.path(), &folders, &["--json"]).1);
    assert_eq!(json["order"], "date");
    // Later folders have earlier dates.
    let first = json["runs"][0]["folder"].as_str().expect("a folder");
    assert!(first.ends_with("run-6"), "{first}");
    let (code, _, stderr) = history(repo.path(), &folders[..1], &["-o", "page.txt"]);
    assert!(code == 2 && stderr.contains("ends in .html"), "{stderr}");
}

#[test]
fn what_can_mislead_is_refused_or_told() {
    let (repo, _) = checkout(1);
    let dir = tempfile::tempdir().expect("a folder");
    let mut folders: Vec<PathBuf> =
        (0..5).map(|i| write(dir.path(), i, "0123456789ab", 20.0)).collect();
    // A folder that is no checkout.
    let (code, _, stderr) = history(dir.path(), &folders, &[]);
    assert!(code == 2 && stderr.contains("not a git repository"), "{stderr}");
    // Too few runs for a change.
    let (code, text, _) = history(repo.path(), &folders, &[]);
    assert!(code == 0 && text.contains("5 of the 6 runs that a change needs"), "{text}");
    assert!(!text.contains("no change"), "{text}");
    // A run that was cut short, and one whose device is wrong.
    let edit = |i: usize, change: &dyn Fn(&mut Value)| {
        let file = folders[i].join("run.json");
        let mut run = parsed(&fs::read_to_string(&file).expect("a run"));
        change(&mut run);
        fs::write(&file, run.to_string()).expect("a run");
    };
    edit(4, &|run| run["interrupted"] = true.into());
    let failed = serde_json::json!({
        "n_cases": 49, "failed": ["functions/erf"], "seconds": 1.0, "from_cache": false,
    });
    edit(3, &|run| run["stages"] = failed.clone());
    let (_, text, _) = history(repo.path(), &folders, &[]);
    assert!(text.contains("run 0: interrupted: "), "{text}");
    assert!(text.contains("run 1: the device is wrong in functions/erf"), "{text}");
    let json = parsed(&history(repo.path(), &folders, &["--json"]).1);
    assert_eq!(json["remarks"].as_array().map(Vec::len), Some(2), "{json}");
    // One folder under two names.
    folders.push(dir.path().join("./run-2/../run-2"));
    let (code, _, stderr) = history(repo.path(), &folders, &[]);
    assert!(code == 2 && stderr.contains("are one folder"), "{stderr}");
}

#[test]
fn runs_of_another_device_are_refused() {
    let (repo, revisions) = checkout(2);
    let dir = tempfile::tempdir().expect("a folder");
    let folders = [0, 1].map(|i| write(dir.path(), i, &revisions[i], 20.0));
    let file = folders[1].join("run.json");
    let mut run = parsed(&fs::read_to_string(&file).expect("a run"));
    run["device"]["name"] = "GeForce".into();
    fs::write(&file, run.to_string()).expect("a run");
    let (code, _, stderr) = history(repo.path(), &folders, &[]);
    assert!(code == 2 && stderr.contains("device, name: A llvmpipe"), "{stderr}");
    let (code, _, _) = history(repo.path(), &folders, &["--allow", "device"]);
    assert_eq!(code, 0);
}
