//! Inputs that once made a parser crash, hang or use too much memory, and inputs made by hand to do
//! so. Each must be parsed, or refused with one message.
//!
//! tests/data/found/<target>/ holds the inputs, <target>.txt the expected messages;
//! docs/how-to/fuzz.md describes the search for them.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use crate::readers;
use nimbus::error::Error;
use nimbus::io::mapped_file::MappedFile;
use nimbus::io::text_file::{DATA_LIMIT, read_text};
use nimbus::io::weather::wrf;
use nimbus::io::{box_file, particle_file, ply, scene_file};
use nimbus::report::pages::source;
use nimbus::studies::error::files::read_earlier;

type Reader = fn(&[u8]) -> Result<(), String>;

/// Time after which a parser counts as hanging. Inputs of usual size take milliseconds.
const LONGEST: Duration = Duration::from_secs(120);
/// Time limit for files of the largest accepted size.
const LONGEST_OF_LARGE: Duration = Duration::from_secs(600);
/// Memory limit of the process, KiB.
const MOST_MEMORY: u64 = 2 << 20;

fn folder(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/found").join(target)
}

/// Returns names and bytes of a target's inputs, in order.
fn inputs(target: &str) -> Vec<(String, Vec<u8>)> {
    let entries =
        fs::read_dir(folder(target)).expect("the inputs").map(|entry| entry.expect("an input"));
    let mut inputs: Vec<(String, Vec<u8>)> = entries
        .map(|e| (e.file_name().into_string().expect("UTF-8"), fs::read(e.path()).expect("bytes")))
        .collect();
    inputs.sort();
    inputs
}

/// Runs `work` in a thread of usual stack size, and panics if it hangs.
fn in_time<T: Send + 'static>(
    what: &str,
    limit: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> T {
    let (done, wait) = mpsc::channel();
    let worker = thread::spawn(move || drop(done.send(work())));
    match wait.recv_timeout(limit) {
        Ok(outcome) => outcome,
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("{what}: takes longer than {limit:?}"),
        Err(mpsc::RecvTimeoutError::Disconnected) => match worker.join() {
            Err(cause) => std::panic::resume_unwind(cause),
            Ok(()) => unreachable!("it ended without an outcome"),
        },
    }
}

/// Parses every input and compares the messages with the list.
fn assert_as_listed(target: &str, read: Reader) {
    let mut report = String::new();
    for (name, bytes) in inputs(target) {
        let outcome = in_time(&format!("{target}/{name}"), LONGEST, move || read(&bytes));
        let line = match outcome {
            Ok(()) => "read".to_owned(),
            Err(message) => message.replace(readers::NOWHERE, "").replace('\n', " | "),
        };
        report += &format!("{name}: {line}\n");
    }
    let listed = fs::read_to_string(folder(target).with_extension("txt")).unwrap_or_default();
    assert!(report == listed, "{target}.txt lists other messages; the messages are:\n{report}");
    assert_memory(target);
}

/// Checks the peak memory of the process.
fn assert_memory(what: &str) {
    let Ok(status) = fs::read_to_string("/proc/self/status") else { return };
    let of =
        |line: &str| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse::<u64>().ok();
    let most = status.lines().find_map(of).expect("a peak");
    assert!(most < MOST_MEMORY, "{what}: {most} KiB");
}

#[test]
fn scenes() {
    assert_as_listed("scene_file", readers::scene_file);
}

#[test]
fn box_files() {
    assert_as_listed("box_file", readers::boxes);
}

#[test]
fn particle_lists() {
    assert_as_listed("particle_list", readers::particle_list);
}

#[test]
fn ply_files() {
    assert_as_listed("ply", readers::ply);
}

#[test]
fn results() {
    assert_as_listed("results", readers::results);
}

#[test]
fn weather_files() {
    assert_as_listed("weather", readers::weather);
}

/// Parses every input as every kind of file, with inputs that are not UTF-8.
#[test]
fn every_file_is_read_or_refused_with_one_message() {
    let dir = tempfile::tempdir().expect("a folder");
    let no_text: Vec<Vec<u8>> =
        vec![vec![0xff, 0xfe, 0], vec![0; 4096], b"\xed\xa0\x80".to_vec(), vec![0xc3]];
    let found = ["scene_file", "box_file", "particle_list", "ply", "results", "weather"]
        .map(inputs)
        .into_iter()
        .flatten();
    for (i, bytes) in found.map(|(_, bytes)| bytes).chain(no_text).enumerate() {
        let folder = dir.path().join(i.to_string());
        fs::create_dir(&folder).expect("a folder");
        let names = [
            "scene.toml",
            "b.dat",
            "p.csv",
            "p.ply",
            "run.json",
            "frames.csv",
            "study.json",
            "times.csv",
            "ledger.json",
            "w.nc",
        ];
        for name in names {
            fs::write(folder.join(name), &bytes).expect("written");
        }
        let errors = in_time(&format!("input {i}"), LONGEST, move || read_all(&folder));
        for error in errors {
            assert_eq!(error.exit_code(), 2, "{error}");
            assert!(!error.to_string().is_empty());
        }
    }
}

fn read_all(folder: &Path) -> Vec<Error> {
    let path = |name: &str| folder.join(name);
    let results =
        ["run.json", "study.json", "ledger.json"].map(|name| source::read(&path(name)).err());
    let others = [
        scene_file::load(&path("scene.toml"), &[], None).err(),
        box_file::read(&path("b.dat")).err(),
        read_text(&path("p.csv"), DATA_LIMIT, particle_file::FIRST)
            .and_then(|text| particle_file::parse(&text, Path::new("p.csv")))
            .err(),
        MappedFile::open(&path("p.ply"))
            .map_err(|e| Error::io(&path("p.ply"), e))
            .and_then(|file| ply::parse(file.bytes(), Path::new("p.ply")))
            .err(),
        read_earlier(folder).err(),
        wrf::open(&path("w.nc")).err(),
    ];
    results.into_iter().chain(others).flatten().collect()
}

/// Inputs near the limits of their kinds, too large to be stored.
#[test]
fn large_inputs_are_refused() {
    const SCENE: usize = 4 << 20;
    const DATA: usize = 8 << 20;
    // Each is tried as three kinds.
    const JSON: usize = 1 << 20;
    let repeated = |begin: &str, what: &str, size: usize| {
        [begin.as_bytes(), &what.as_bytes().repeat(size / what.len())].concat()
    };
    let many_keys: String = (0..SCENE / 16).map(|i| format!("k{i} = {i}\n")).collect();
    let cases: [(&str, Reader, Vec<u8>); 12] = [
        ("brackets", readers::scene_file, repeated("title = ", "[", SCENE)),
        ("dots", readers::scene_file, repeated("", "a.", SCENE)),
        ("a string", readers::scene_file, repeated("title = \"", "x", SCENE)),
        ("tables", readers::scene_file, repeated("", "[[light]]\n", SCENE)),
        ("keys", readers::scene_file, many_keys.into_bytes()),
        ("a word", readers::boxes, repeated("3\n1\n3, ", "1", DATA)),
        ("words", readers::boxes, repeated("3\n1\n", "3 ", DATA)),
        ("empty lines", readers::boxes, repeated("3\n", "\n", DATA)),
        ("quotes", readers::particle_list, repeated("x,y,z,sigma,kappa\n", "\"\",", DATA)),
        ("columns", readers::particle_list, repeated("", "x,", DATA)),
        ("lists", readers::results, repeated("[0", ",[0]", JSON)),
        ("numbers", readers::results, repeated("{\"schema\":1,\"scene\":[0", ",0", JSON)),
    ];
    for (name, read, bytes) in cases {
        let outcome = in_time(name, LONGEST_OF_LARGE, move || read(&bytes));
        let message = outcome.expect_err(name);
        assert!(message.len() < 8192, "{name}: {} bytes of message", message.len());
    }
    assert_memory("large inputs");
}
