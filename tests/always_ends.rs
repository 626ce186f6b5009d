//! Every command ends with a documented exit code and one message where its surroundings fail: a
//! broken or full stream, a thread that cannot be started, an argument that is not UTF-8, an input
//! that is no file, a shader that no compiler survives.

#[path = "harness/fixtures.rs"]
mod fixtures;
#[path = "harness/generated.rs"]
mod generated;

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::pipe;
use std::os::unix::ffi::OsStrExt;
use std::process::{Command, Output, Stdio};

use fixtures::{Fixtures, check_end};
use proptest::prelude::*;

/// A stream that a command writes to.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stream {
    Sound,
    Full,
    Broken,
}

impl Stream {
    fn open(self) -> Stdio {
        match self {
            Stream::Sound => Stdio::piped(),
            Stream::Full => File::options().write(true).open("/dev/full").expect("it").into(),
            Stream::Broken => pipe().expect("a pipe").1.into(),
        }
    }
}

const STREAMS: [Stream; 3] = [Stream::Sound, Stream::Full, Stream::Broken];

#[test]
fn a_stream_that_fails_ends_nothing_but_the_output() {
    let fixtures = Fixtures::with_results();
    let lines = [
        "--help",
        "--version",
        "bench --help",
        "no-such-command",
        "devices -v",
        "devices --json",
        "inspect s.toml --particles -v",
        "inspect s.toml --basis values",
        "weather w.nc --step 0",
        "stress --list",
        "stress moisture",
        "compare a.png a.png",
        "compare run run --json",
        "render s.toml -o out.png --force -v",
        "render s.toml -o out.png --force --reference thin --json -v",
        "render missing.toml -o out.png",
        "bench s.toml --frames 1 --warmup 0 --plot -v",
        "error s.toml --knob draw.cutoff=2 --rounds 1 --frames 1 -v",
        "farm status --plan farm",
    ];
    for line in lines {
        for (stdout, stderr) in STREAMS.iter().flat_map(|a| STREAMS.map(|b| (*a, b))) {
            let mut command = fixtures.command(line.split(' '));
            let child = command.stdout(stdout.open()).stderr(stderr.open()).spawn().expect("it");
            let output = child.wait_with_output().expect("it ends");
            let what = format!("{line} with stdout {stdout:?} and stderr {stderr:?}");
            check_end(&what, &output);
            let errors = String::from_utf8_lossy(&output.stderr);
            let has_word = |word| line.split(' ').any(|w| w == word);
            let is_refused = has_word("no-such-command") || has_word("missing.toml");
            // A command that writes a file prints to stdout only with --json.
            let prints = has_word("--json") || !has_word("-o");
            let loses_output = prints && stdout == Stream::Full;
            let expected = if is_refused || loses_output { 2 } else { 0 };
            assert_eq!(output.status.code(), Some(expected), "{what}: {errors}");
            if loses_output && !is_refused && stderr == Stream::Sound {
                assert!(errors.contains("error: stdout: "), "{what}: {errors}");
            }
        }
    }
}

#[test]
fn paths_that_are_not_utf_8_are_paths_like_others() {
    let fixtures = Fixtures::new();
    let name = |text: &[u8]| OsString::from(OsStr::from_bytes(text));
    let scene = name(b"sc\xff\xc3ne.toml");
    let at = |name: &OsStr| fixtures.dir.path().join(name);
    fs::copy(at(OsStr::new("s.toml")), at(&scene)).expect("room");
    fs::copy(at(OsStr::new("w.nc")), at(&name(b"\xfe.nc"))).expect("room");
    let (picture, out, page) = (name(b"\xff.png"), name(b"out\xff"), name(b"\xfd.html"));
    let words = |text: &'static str| text.split(' ').map(OsString::from);
    let lines: [Vec<OsString>; 8] = [
        words("render --json -o").chain([picture.clone(), scene.clone()]).collect(),
        words("compare --json").chain([picture.clone(), picture]).collect(),
        words("bench --frames 1 --warmup 0 --out").chain([out.clone(), scene.clone()]).collect(),
        words("compare").chain([out.clone(), out.clone()]).collect(),
        words("report -o").chain([page, out]).collect(),
        words("inspect").chain([scene.clone()]).collect(),
        words("weather --step 0").chain([name(b"\xfe.nc")]).collect(),
        words("ledger --rounds 1 --frames 1 --json").chain([scene.clone()]).collect(),
    ];
    for line in lines {
        let output = fixtures.run(&line);
        check_end(&format!("{line:?}"), &output);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{line:?}: {errors}");
    }
    // JSON has no form for such a path, and nodes get it as text.
    let output = fixtures.run(words("farm plan -o farm").chain([scene]));
    check_end("farm plan", &output);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{errors}");
    assert!(errors.starts_with("error: ") && errors.contains("UTF-8"), "{errors}");
}

/// Command lines in which IN is an input.
const READERS: [&str; 24] = [
    "render IN -o out.png",
    "render s.toml -o out.png --shaders IN",
    "render s.toml -o out.png --set cloud.0.file=IN",
    "render b.toml -o out.png",
    "bench IN",
    "error IN",
    "ledger IN",
    "inspect IN",
    "compare IN IN",
    "compare IN.png a.png",
    "compare a.png IN.png",
    "compare IN.exr IN.exr",
    "report IN -o out.html",
    "report of/run.json -o out.html",
    "report of/study.json -o out.html",
    "report of/ledger.json -o out.html",
    "compare of of",
    "error s.toml --resume --out of",
    "weather IN",
    "farm plan IN -o farm",
    "farm plan s.toml -o farm --model IN",
    "farm status --plan of",
    "farm run --plan of --shard 0",
    "farm merge --plan of -o out",
];

#[test]
fn inputs_that_are_no_files_are_refused_at_once() {
    let fixtures = Fixtures::new();
    let at = |name: &str| fixtures.dir.path().join(name);
    fs::write(at("a.png"), "").expect("room");
    let scene = "[[cloud]]\nfrom = \"boxes\"\nfile = \"box\"\nradius_scale = 0.5\n";
    fs::write(at("b.toml"), scene).expect("room");
    let inputs = ["pipe", "dir", "/dev/zero", "/dev/tty", "/proc/kmsg", "/proc/self/mem"];
    for input in inputs {
        let link = |name: &str| {
            let target = if input.starts_with('/') { input.into() } else { at(input) };
            let _ = fs::remove_file(at(name));
            std::os::unix::fs::symlink(target, at(name)).expect("room");
        };
        ["in.png", "in.exr", "box", "in"].iter().for_each(|name| link(name));
        fs::create_dir_all(at("of")).expect("room");
        let names = ["run.json", "study.json", "ledger.json", "plan.json", "frames.csv"];
        names.iter().for_each(|name| link(&format!("of/{name}")));
        for line in READERS {
            let args = line.split(' ').map(|word| word.replace("IN", "in"));
            let output = fixtures.run(args);
            let what = format!("{line} with {input}");
            check_end(&what, &output);
            let errors = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{what}: {errors}");
            assert!(errors.starts_with("error: ") && errors.lines().count() <= 3, "{errors}");
        }
    }
}

/// A shader that ends a compiler, or makes it run for minutes.
#[derive(Debug, Clone)]
enum Fault {
    ZeroByte(usize),
    NotText(usize),
    Lines(usize),
    Nested(usize),
    IncludesItself,
    IncludeCircle,
    Long(usize),
    Link(&'static str),
}

fn faults() -> impl Strategy<Value = Fault> {
    prop_oneof![
        (0usize..1500).prop_map(Fault::ZeroByte),
        (0usize..1500).prop_map(Fault::NotText),
        prop_oneof![Just(10_001usize), Just(1_000_000)].prop_map(Fault::Lines),
        prop_oneof![Just(201usize), Just(100_000)].prop_map(Fault::Nested),
        Just(Fault::IncludesItself),
        Just(Fault::IncludeCircle),
        prop_oneof![Just(262_145usize), Just(80 << 20)].prop_map(Fault::Long),
        prop::sample::select(vec!["pipe", "dir", "/dev/zero", "/proc/kmsg"]).prop_map(Fault::Link),
    ]
}

#[test]
fn a_shader_that_no_compiler_survives_is_refused() {
    let fixtures = Fixtures::new();
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/shaders/");
    let text = fs::read(format!("{root}first.comp")).expect("a shader");
    let n_run = std::cell::Cell::new(0);
    generated::check(24, faults(), |fault| {
        n_run.set(n_run.get() + 1);
        let dir = fixtures.dir.path().join(format!("shaders{}", n_run.get()));
        fs::create_dir_all(dir.join("include")).expect("room");
        let put = |at: usize, byte: u8| {
            let mut text = text.clone();
            text.insert(at.min(text.len()), byte);
            text
        };
        let with = |more: String| [&text[..], more.as_bytes()].concat();
        let include = |to: &str| format!("\n#include \"{to}\"\n");
        let own = match &fault {
            Fault::ZeroByte(at) => put(*at, 0),
            Fault::NotText(at) => put(*at, 0xff),
            Fault::Lines(n) => with("\n".repeat(*n)),
            Fault::Nested(n) => with(format!("\n#if {}\n", "(".repeat(*n))),
            Fault::Long(n) => with(" ".repeat(*n)),
            Fault::IncludesItself | Fault::IncludeCircle => with(include("walk.glsl")),
            Fault::Link(_) => text.clone(),
        };
        fs::write(dir.join("first.comp"), own).expect("room");
        let circle: &[(&str, &str)] = match fault {
            Fault::IncludesItself => &[("walk.glsl", "walk.glsl")],
            Fault::IncludeCircle => &[("walk.glsl", "cells.glsl"), ("cells.glsl", "walk.glsl")],
            _ => &[],
        };
        for (name, to) in circle {
            fs::write(dir.join("include").join(name), include(to)).expect("room");
        }
        if let Fault::Link(to) = fault {
            let target = if to.starts_with('/') { to.into() } else { fixtures.dir.path().join(to) };
            fs::remove_file(dir.join("first.comp")).expect("it was there");
            std::os::unix::fs::symlink(target, dir.join("first.comp")).expect("room");
        }
        let dir = dir.to_str().expect("UTF-8");
        let output = fixtures.run(["render", "s.toml", "-o", "out.png", "--shaders", dir]);
        check_end(&format!("{fault:?}"), &output);
        let errors = String::from_utf8_lossy(&output.stderr);
        prop_assert_eq!(output.status.code(), Some(2), "{}", errors);
        prop_assert!(errors.contains("first.comp") || errors.contains("walk.glsl"), "{}", errors);
        Ok(())
    });
}

/// Runs a command of which the threads and processes that `when` counts cannot be started: the
/// n-th one of each thread, or all from the n-th one on. Fails unless at least one was not started.
fn with_failed_threads(fixtures: &Fixtures, line: &str, when: &str) -> Output {
    let program = fixtures.command(line.split(' '));
    let log = fixtures.dir.path().join("trace.log");
    let mut traced = Command::new("strace");
    let inject = format!("inject=clone,clone3:error=EAGAIN:when={when}");
    traced.args(["-f", "-qq", "-o"]).arg(&log).args(["-e", "trace=clone,clone3", "-e", &inject]);
    traced.arg(program.get_program()).args(program.get_args());
    traced.envs(program.get_envs().filter_map(|(name, value)| Some((name, value?))));
    traced.env("RAYON_NUM_THREADS", "2").current_dir(fixtures.dir.path()).stdin(Stdio::null());
    let output = traced.output().expect("strace");
    let what = format!("{line}, thread {when}");
    check_end(&what, &output);
    let log = fs::read_to_string(log).expect("a log of strace");
    assert!(log.contains("(INJECTED)"), "{what}: every thread was started: {log}");
    output
}

/// Commands without a device, with the number of threads that each starts if references have two.
/// Threads of the driver count, too: Mesa's llvmpipe hangs or ends the process where it gets none.
const THREADED: [(&str, usize); 6] = [
    ("render s.toml -o out.png --force --reference model --json", 3),
    ("inspect s.toml --facets --reference", 3),
    ("compare a.png a.png --json", 1),
    ("weather w.nc --step 0", 1),
    ("farm status --plan farm", 1),
    ("report run -o out.html --force", 1),
];

#[test]
fn a_thread_that_cannot_be_started_costs_time_alone() {
    let fixtures = Fixtures::with_results();
    for (line, n_threads) in THREADED {
        let whole = fixtures.run(line.split(' '));
        let out = line.split(' ').find(|word| word.starts_with("out."));
        let written = || out.map(|name| fs::read(fixtures.dir.path().join(name)).expect("a file"));
        let expected = written();
        let singles = (1..=n_threads).map(|n| n.to_string());
        for when in singles.chain((1..=n_threads).map(|n| format!("{n}+"))) {
            let output = with_failed_threads(&fixtures, line, &when);
            let errors = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(0), "{line}, thread {when}: {errors}");
            assert!(output.stdout == whole.stdout, "{line}, thread {when}: other output");
            assert!(written() == expected, "{line}, thread {when}: another file");
        }
    }
}

/// A pool of a farm starts processes. Work that one of them did not do is done by the next pool.
#[test]
fn a_process_of_a_farm_that_cannot_be_started_loses_no_work() {
    let fixtures = Fixtures::new();
    for (i, when) in ["1", "2", "3", "1+", "2+", "3+"].into_iter().enumerate() {
        let plan = format!("farm plan s.toml -o plan{i} --reference model --samples 4");
        assert!(fixtures.run(plan.split(' ')).status.success(), "{plan}");
        let local = format!("farm local --plan plan{i} --jobs 3");
        let output = with_failed_threads(&fixtures, &local, when);
        let errors = String::from_utf8_lossy(&output.stderr);
        if output.status.code() != Some(0) {
            let is_told = errors.starts_with("error: ") && errors.lines().count() == 1;
            assert!(is_told, "process {when}: {errors}");
        }
        for line in [local, format!("farm merge --plan plan{i} -o merged{i}")] {
            let output = fixtures.run(line.split(' '));
            let errors = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(0), "{line} after process {when}: {errors}");
        }
    }
}
