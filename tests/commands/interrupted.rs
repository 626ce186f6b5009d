//! Ctrl-C in the middle of a bench: exit code 130, and results of the frames that were finished,
//! which are results like any others. In either loop and in both.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::program::nimbus;
use nimbus::timing::results::{BenchResults, read_results};
use serde_json::Value;

/// Frames of a block. On two cores of a software device they take a second or more.
const N_FRAMES: u32 = 600;
const N_WARM_UP: u32 = 4;
/// Timed frames that `compare` surely has an opinion of.
const N_COMPARED: usize = 100;

fn bench(threading: &str, out: &str) -> Child {
    let (n_frames, n_warm_up) = (N_FRAMES.to_string(), N_WARM_UP.to_string());
    // Short frames: nothing lit, no textures generated again.
    let plain = ["--set", "lighting.mode=none", "--set", "cloud.0.texture=none"];
    let scene = [&["bench", "scenes/hello.toml", "--size", "64x48"], &plain[..]].concat();
    let length = [
        "--threading",
        threading,
        "--repeat",
        "1",
        "--frames",
        &n_frames,
        "--warmup",
        &n_warm_up,
        "--no-skip",
        "--out",
        out,
    ];
    nimbus(&[&scene[..], &length].concat()).spawn().expect("a child")
}

/// The results folder is made when the first frame is about to begin.
fn await_folder(out: &str) {
    let begin = Instant::now();
    while !Path::new(out).exists() {
        assert!(begin.elapsed() < Duration::from_secs(120), "it never begins");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// The result of a run that got SIGINT `after` its start.
fn interrupted(threading: &str, out: &str, after: Duration) -> Output {
    let child = bench(threading, out);
    await_folder(out);
    std::thread::sleep(after);
    // Gone already where the machine was faster than before.
    let _ =
        Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status();
    child.wait_with_output().expect("it ends")
}

/// Results of a run of all frames, and half of the time it took from its first frame.
fn half_time(threading: &str, out: &str) -> Duration {
    let child = bench(threading, out);
    await_folder(out);
    let begin = Instant::now();
    assert!(child.wait_with_output().expect("it ends").status.success());
    let whole = begin.elapsed();
    assert!(!read_results(Path::new(out)).expect("results").run.interrupted);
    whole / 2
}

/// The content of `frames.csv`: for each mode its name, timed frames and warm-up.
fn counted(out: &str) -> Vec<(String, usize, usize)> {
    let mut reader = csv::Reader::from_path(Path::new(out).join("frames.csv")).expect("frames.csv");
    let header = reader.headers().expect("a header").clone();
    let column = |name: &str| header.iter().position(|field| field == name).expect("the column");
    let (threading, warm_up, frame) = (column("threading"), column("warm_up"), column("frame"));
    let mut modes: Vec<(String, usize, usize)> = Vec::new();
    for line in reader.records() {
        let line = line.expect("a whole line");
        assert_eq!(line.len(), header.len());
        if modes.last().is_none_or(|(name, ..)| *name != line[threading]) {
            modes.push((line[threading].to_owned(), 0, 0));
        }
        let (_, n, n_warm_up) = modes.last_mut().expect("a mode");
        // Frames to warm up with run backwards to the first one.
        let is_warm_up = &line[warm_up] == "true";
        let want = if is_warm_up { N_WARM_UP as usize - *n_warm_up } else { *n };
        assert_eq!(line[frame].parse(), Ok(want as u32), "frames follow one another");
        *(if &line[warm_up] == "true" { n_warm_up } else { n }) += 1;
    }
    modes
}

fn check(threading: &str) {
    let dir = tempfile::tempdir().expect("a folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    // Also compiles the shaders, so that the time below is not theirs.
    let mut after = half_time(threading, &path("whole"));
    // How long to wait follows from how fast the machine is at the moment, which the last attempt
    // tells.
    for attempt in 0..40 {
        let out = path(&format!("part{attempt}"));
        let Output { status, stdout, stderr } = interrupted(threading, &out, after);
        let (stdout, stderr) = (String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
        let n = n_timed(&out);
        // Whole, too, if the signal came between the last frame and the end.
        if status.success() || n == n_all(threading) {
            after /= 2;
            continue;
        }
        if n < N_COMPARED {
            after = after * 3 / 2;
            continue;
        }
        assert_eq!(status.code(), Some(130), "{stderr}");
        assert!(stdout.contains("INTERRUPTED: what was finished"), "{stdout}");
        assert!(stderr.contains("keeps what is done"), "{stderr}");
        check_results(threading, &out, &path("whole"));
        return;
    }
    panic!("{threading}: no run was interrupted in the midst of its timed frames");
}

/// Returns the number of timed frames of a whole run.
fn n_all(threading: &str) -> usize {
    if threading == "both" { 2 * N_FRAMES as usize } else { N_FRAMES as usize }
}

/// Returns the number of timed frames in the results.
fn n_timed(out: &str) -> usize {
    counted(out).iter().map(|(_, n, _)| n).sum()
}

/// Marked, valid, counted right, and read by `compare`.
fn check_results(threading: &str, out: &str, whole: &str) {
    let BenchResults { run, modes } = read_results(Path::new(out)).expect("results");
    assert!(run.interrupted);
    let text = fs::read_to_string(Path::new(out).join("run.json")).expect("run.json");
    let schema: Value =
        serde_json::from_str(include_str!("../../docs/reference/schemas/run.schema.json"))
            .expect("the schema");
    let json: Value = serde_json::from_str(&text).expect("JSON");
    assert!(jsonschema::is_valid(&schema, &json), "{:?}", jsonschema::validate(&schema, &json));
    // A loop of which only frames to warm up were run has no timed ones.
    let counted: Vec<_> = counted(out).into_iter().filter(|(_, n, _)| *n > 0).collect();
    let begun: Vec<(String, usize, usize)> = run.cases[0]
        .modes
        .iter()
        .map(|m| (m.threading.clone(), m.frames, m.warm_up))
        .filter(|m| m.1 > 0)
        .collect();
    assert_eq!(counted, begun, "{threading}");
    assert_eq!(counted.len(), modes.len());
    let n: usize = counted.iter().map(|(_, n, _)| n).sum();
    let n_all = n_all(threading);
    println!("{threading}: {n} of {n_all} frames");
    assert!(n > 0 && n < n_all, "{n} of {n_all}");
    // Whole against part, and part against itself.
    for (args, note) in
        [([whole, out], "note: B was interrupted"), ([out, out], "note: A was interrupted")]
    {
        let output = nimbus(&[&["compare"], &args[..]].concat()).output().expect("it runs");
        let (stdout, stderr) =
            (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert_eq!((output.status.code(), stderr.as_ref()), (Some(0), ""));
        assert!(stdout.contains(note) && stdout.contains("frame: B takes"), "{stdout}");
    }
}

/// A bench of three processes, whose temporary files go to `temporary`.
fn starts(out: &str, temporary: &Path) -> Child {
    let words = ["bench", "scenes/hello.toml", "--size", "64x48", "--starts", "3", "--repeat", "1"];
    let more = ["--frames", "60", "--no-saved", "--no-check", "--out", out];
    nimbus(&[&words[..], &more].concat()).env("TMPDIR", temporary).spawn().expect("a child")
}

#[test]
fn an_interrupted_bench_of_several_starts_keeps_those_that_ended() {
    let dir = tempfile::tempdir().expect("a folder");
    let temporary = dir.path().join("temporary");
    fs::create_dir(&temporary).expect("room");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    for n_ended in [0, 1] {
        let out = path(&format!("after{n_ended}"));
        let child = starts(&out, &temporary);
        await_start(n_ended, &temporary);
        let pid = child.id().to_string();
        let _ = Command::new("kill").args(["-INT", &pid]).stderr(Stdio::null()).status();
        let output = child.wait_with_output().expect("an end");
        // The processes of the starts have ended, too, and left nothing behind.
        let left: Vec<_> = fs::read_dir(&temporary).expect("a folder").collect();
        assert!(left.is_empty(), "{left:?}");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(130), "{stderr}");
        if n_ended == 0 && !Path::new(&out).exists() {
            assert!(stderr.contains("nothing is kept"), "{stderr}");
            continue;
        }
        let run = read_results(Path::new(&out)).expect("results").run;
        assert!(run.interrupted && (1..3).contains(&run.n_starts()), "{}", run.n_starts());
        assert!(run.modes().any(|(_, mode)| mode.frames > 0));
        assert!(String::from_utf8_lossy(&output.stdout).contains("INTERRUPTED"), "{stderr}");
    }
}

/// Waits until start `i` begins, which has a log of its own in the bench's temporary folder.
fn await_start(i: u32, temporary: &Path) {
    let name = format!("{i}.log");
    let begins = |entry: fs::DirEntry| entry.path().join(&name).exists();
    let begin = Instant::now();
    while !fs::read_dir(temporary).expect("a folder").flatten().any(begins) {
        assert!(begin.elapsed() < Duration::from_secs(300), "start {i} never begins");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// One after the other: each is timed.
#[test]
fn an_interrupted_bench_leaves_results_of_what_it_finished() {
    ["serial", "parallel", "both"].iter().for_each(|threading| check(threading));
}
