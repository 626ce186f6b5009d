//! Command lines that are generated from the program's own declaration of its arguments: every flag
//! of every command, with good values and hostile ones. Each run ends with a documented exit code,
//! without a panic, within a limit of memory and a limit of the processor's time.

#[path = "harness/fixtures.rs"]
mod fixtures;

use std::ffi::{OsStr, OsString};
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use clap::CommandFactory;
use fixtures::{Fixtures, check_end};
use nimbus::cli::args::Args;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// Command lines of the short test.
const N_SHORT: usize = 100;
/// Duration of the long test.
const LONG: Duration = Duration::from_secs(600);
/// Least number of command lines of the short test that succeed: a tenth. The others are refused.
const N_DONE: usize = N_SHORT / 10;
/// Limit of a run's data, KiB: 2 GiB, and the stacks and code of its threads.
const MOST_KIB: u32 = 2_400_000;
/// Limit of a run's time on the processor, s.
const MOST_S: u32 = 120;

/// Flags that keep commands short, unless a generated flag is the same. An argument without a flag
/// has an empty one.
const SHORT: [(&str, &[(&str, &str)]); 5] = [
    ("bench", &[("frames", "2"), ("warmup", "0"), ("repeat", "1")]),
    ("error", &[("rounds", "1"), ("frames", "1"), ("pixels", "16"), ("knob", "draw.cutoff=2")]),
    ("ledger", &[("rounds", "1"), ("frames", "1"), ("pixels", "16"), ("reflections", "2")]),
    ("calibrate", &[("frames", "2")]),
    ("stress", &[("", "moisture")]),
];

/// The parts of a generated command line: the command, its flags and their values. Each number from
/// 0 to 1 stands for one item of a list.
#[derive(Debug, Clone)]
struct Choices {
    command: f64,
    flags: Vec<(f64, f64)>,
    /// The positional argument, or flag, that gets a hostile value.
    hostile: Option<(f64, f64)>,
}

fn choices() -> impl Strategy<Value = Choices> {
    let share = || 0.0..1.0f64;
    let flags = prop::collection::vec((share(), share()), 0..5);
    (share(), flags, prop::option::weighted(0.8, (share(), share())))
        .prop_map(|(command, flags, hostile)| Choices { command, flags, hostile })
}

fn pick<T>(all: &[T], share: f64) -> &T {
    &all[((share * all.len() as f64) as usize).min(all.len() - 1)]
}

/// All commands that do something, with the words that lead to them.
fn leaves(command: &clap::Command, words: &[String]) -> Vec<(Vec<String>, clap::Command)> {
    let mut found = Vec::new();
    for child in command.get_subcommands().filter(|child| child.get_name() != "help") {
        let words = [words, &[child.get_name().to_owned()]].concat();
        match child.has_subcommands() {
            true => found.extend(leaves(child, &words)),
            false => found.push((words, child.clone())),
        }
    }
    found
}

/// Values that make sense for an argument of this value name.
fn good(name: &str, id: &str) -> &'static [&'static str] {
    match (name, id) {
        (_, "frames") => &["1", "2", "0..2"],
        (_, "warmup" | "repeat" | "rounds" | "step" | "shard" | "frame") => &["0", "1"],
        (_, "model") => &["dir", "missing"],
        (_, "part") => &["0..1"],
        (_, "jobs" | "tries" | "nodes") => &["1", "2"],
        (_, "reflections") => &["2", "3"],
        (_, "pixels") => &["16", "all"],
        (_, "against" | "reference") => &["thin", "slices", "volume", "model", "reflections=2"],
        (_, "knob" | "sweep") => &["draw.cutoff=2,3", "lighting.grid=8,9"],
        (_, "told") => &["--rounds", "--grid"],
        (_, "a" | "b" | "runs") => &["run", "a.png", "a.exr", "study"],
        (_, "cases") => &["moisture", "functions/erf", "sums"],
        (_, "plan") => &["farm"],
        (_, "farm") => &["farm"],
        (_, "shaders") => &["shaders"],
        (_, "output") => &["o.png", "o.exr", "o.html", "o.json", "o"],
        (_, "file") => &["w.nc", "b.dat", "s.toml"],
        ("SCENE", _) | (_, "scene" | "scenes") => &["s.toml"],
        ("WxH", _) => &["16x12", "33x7"],
        ("KEY=VALUE", _) => &["draw.cutoff=2.5", "lighting.mode=first", "cloud.0.seed=3"],
        ("METRIC=VALUE", _) => &["rmse=1e-3", "psnr=20"],
        ("INDEX|NAME", _) => &["0", "llvmpipe"],
        ("DIR", _) => &["o", "o2"],
        ("FILE", _) => &["o.json", "o.png"],
        _ => &["1", "2", "0.5"],
    }
}

/// Values that make sense for no argument, or are at an end of what makes sense.
fn hostile() -> Vec<OsString> {
    let mut all: Vec<OsString> = [
        "",
        " ",
        "-",
        "--",
        "-1",
        "0",
        "1000000000",
        "4294967295",
        "4294967296",
        "18446744073709551615",
        "99999999999999999999999",
        "1e300",
        "-1e300",
        "nan",
        "inf",
        "-inf",
        "1e-300",
        "0..1000000000",
        "5..3",
        "4294967290..4294967295",
        "16384x16384",
        "16384x1",
        "99999x99999",
        "0x0",
        "1x",
        "missing",
        "dir",
        "pipe",
        "/dev/zero",
        "/dev/full",
        "/proc/self/mem",
        "empty",
        "binary",
        "a.png",
        "p.csv",
        "missing/x.png",
        "dir/",
        "..",
        "/",
        "\u{1b}[31mred",
        "a\nb",
        "\u{7f}\u{8}",
        "ünïcödé",
        "=",
        "a=",
        "=1",
        "a=b=c",
        "film=1",
        "film.width=16384",
        "film.width=99999999999",
        "draw.particles=4294967295",
        "time.frames=4294967295",
        "lighting.grid=512",
        "cloud.9999999999.seed=1",
        "camera.position=[1e308,0,0]",
        "cloud.*.seed=1,2,3",
        "draw.cutoff=nan",
        "lighting.bases=1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16",
        "title='x",
        "[[[[[[[[",
        "}",
        "reflections=64",
        "reflections=99999999",
        "rmse=nan",
        "%s%n",
        "$(id)",
        "*",
    ]
    .iter()
    .map(OsString::from)
    .collect();
    all.push(OsStr::from_bytes(b"\xff\xfe\x80").to_owned());
    all.push(OsStr::from_bytes(b"draw.cutoff=\xff").to_owned());
    all.push("x".repeat(5000).into());
    all.push("9".repeat(400).into());
    all.push(
        format!("draw.cutoff={}", (1..3000).map(|i| format!("{i},")).collect::<String>()).into(),
    );
    all
}

/// Returns the command line that the choices stand for.
fn line(choices: &Choices) -> Vec<OsString> {
    let commands = leaves(&Args::command(), &[]);
    let (words, command) = pick(&commands, choices.command);
    let hostile_values = hostile();
    // Each argument with the share that stands for its value.
    let mut arguments: Vec<(&clap::Arg, f64)> = command
        .get_positionals()
        .filter(|argument| argument.is_required_set())
        .chain(command.get_arguments().filter(|a| a.is_required_set() && !a.is_positional()))
        .map(|argument| (argument, 0.3))
        .collect();
    let options: Vec<&clap::Arg> =
        command.get_arguments().filter(|a| !matches!(a.get_id().as_str(), "help")).collect();
    arguments.extend(choices.flags.iter().map(|(which, value)| (*pick(&options, *which), *value)));
    let i_hostile = choices.hostile.map(|(which, value)| {
        let takes_values = |i: &usize| arguments[*i].0.get_action().takes_values();
        let with_value: Vec<usize> = (0..arguments.len()).filter(takes_values).collect();
        let i = (!with_value.is_empty()).then(|| *pick(&with_value, which));
        (i, pick(&hostile_values, value).clone())
    });
    let mut all: Vec<OsString> = words.iter().map(OsString::from).collect();
    for (i, (argument, share)) in arguments.iter().enumerate() {
        let flag = argument.get_long().map(|long| format!("--{long}"));
        if !argument.get_action().takes_values() {
            all.extend(flag.map(OsString::from));
            continue;
        }
        let name = argument.get_value_names().and_then(|names| names.first());
        let name = name.map_or("", |name| name.as_str());
        let possible = argument.get_possible_values();
        let value: OsString = match &i_hostile {
            Some((at, value)) if *at == Some(i) => value.clone(),
            _ if !possible.is_empty() => pick(&possible, *share).get_name().into(),
            _ => (*pick(good(name, argument.get_id().as_str()), *share)).into(),
        };
        match flag {
            Some(flag) => {
                // "--flag=value", so that a value may begin with a dash.
                let mut word = OsString::from(format!("{flag}="));
                word.push(value);
                all.push(word);
            }
            None => all.push(value),
        }
    }
    let is_given =
        |flag: &str| arguments.iter().any(|(a, _)| a.get_long().unwrap_or_default() == flag);
    let short = SHORT.iter().filter(|(name, _)| words.last().is_some_and(|word| word == name));
    let missing = short.flat_map(|(_, flags)| *flags).filter(|(flag, _)| !is_given(flag));
    let word = |(flag, value): &(&str, &str)| match *flag {
        "" => (*value).into(),
        _ => format!("--{flag}={value}").into(),
    };
    all.extend(missing.map(word));
    all
}

/// Runs a command line under the limits. Returns whether it succeeded.
fn run(fixtures: &Fixtures, line: &[OsString]) -> bool {
    let script = format!("ulimit -c 0 -t {MOST_S}; ulimit -d {MOST_KIB}; exec \"$0\" \"$@\"");
    let program = fixtures.command(line);
    let mut limited = Command::new("/bin/sh");
    limited.args(["-c", &script]).arg(program.get_program()).args(line);
    limited.current_dir(fixtures.dir.path().join("now")).stdin(Stdio::null());
    // No other program is found, so that none is started.
    limited.envs(program.get_envs().filter_map(|(name, value)| Some((name, value?))));
    limited.env("PATH", "/nowhere").env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    let output = limited.output().expect("it runs");
    check_end(&format!("{line:?}"), &output);
    output.status.success()
}

/// Makes the folder of inputs again: commands replace them.
fn renew(fixtures: &Fixtures) {
    let (from, to) = (fixtures.dir.path().join("kept"), fixtures.dir.path().join("now"));
    let _ = fs::remove_dir_all(&to);
    let copied = Command::new("cp").arg("-a").arg(from).arg(to).status().expect("cp");
    assert!(copied.success());
}

/// Runs command lines until `is_done`, which gets their number. A part of them must succeed: others
/// are refused before they do anything.
fn check(seed: u8, is_done: impl Fn(usize) -> bool) {
    let fixtures = Fixtures::with_results();
    let kept = fixtures.dir.path().join("kept");
    fs::create_dir(&kept).expect("room");
    for entry in fs::read_dir(fixtures.dir.path()).expect("it is there").flatten() {
        if entry.path() != kept {
            fs::rename(entry.path(), kept.join(entry.file_name())).expect("room");
        }
    }
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]);
    let mut runner = TestRunner::new_with_rng(Config::default(), rng);
    let (mut n, mut n_succeeded) = (0, 0);
    while !is_done(n) {
        if n % 20 == 0 {
            renew(&fixtures);
        }
        let choices = choices().new_tree(&mut runner).expect("choices").current();
        n_succeeded += usize::from(run(&fixtures, &line(&choices)));
        n += 1;
    }
    println!("{n} command lines, {n_succeeded} succeeded");
    assert!(n_succeeded >= N_DONE, "{n_succeeded} of {n} command lines succeeded");
}

#[test]
fn generated_command_lines_end_in_order() {
    check(1, |n| n == N_SHORT);
}

/// `cargo test --release --test command_lines -- --ignored`
#[test]
#[ignore = "takes ten minutes"]
fn ten_minutes_of_generated_command_lines_end_in_order() {
    let seed = std::process::id() as u8;
    println!("seed {seed}");
    let begin = Instant::now();
    check(seed, |_| begin.elapsed() > LONG);
}

/// clap checks this in debug builds alone, and takes the first of two in others.
#[test]
fn no_flag_stands_for_two_arguments() {
    fn check(command: &clap::Command) -> usize {
        let mut seen = std::collections::BTreeSet::new();
        let mut n = 0;
        for argument in command.get_arguments() {
            let long = argument.get_long().map(|long| format!("--{long}"));
            let short = argument.get_short().map(|short| format!("-{short}"));
            for flag in long.into_iter().chain(short) {
                assert!(seen.insert(flag.clone()), "{}: two of {flag}", command.get_name());
                n += 1;
            }
        }
        n + command.get_subcommands().map(check).sum::<usize>()
    }
    assert!(check(&Args::command()) > 100);
}
