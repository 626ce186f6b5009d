//! Ctrl-C's signal, sent to the program once it listens, and the work of the program from then on.
//! Work is measured in seconds of the processor, which do not depend on what else the machine does.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::fs;
use std::process::{Command, Output};
use std::time::Duration;

/// Ticks a second of the times in /proc, on every architecture that Linux has kept.
const TICKS_PER_S: f64 = 100.0;
/// Threads of the device and of references: a limit of the processor's time holds on every machine.
const N_THREADS: u32 = 2;
/// Seconds of the processor, on each thread, that a command may use after the signal. A command
/// gets 0.4 s to end its present step; writing the finished results takes the rest.
const MOST_S: f64 = 1.0;
/// SIGINT in a mask of signals.
const INTERRUPT: u64 = 1 << 1;

/// Returns whether the process has a handler of SIGINT.
fn catches_interrupt(pid: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .is_some_and(|mask| mask & INTERRUPT != 0)
}

/// Returns the state of a process, such as `Z` for one that has ended, and the seconds of the
/// processor that its threads have used.
fn state(pid: u32) -> (char, f64) {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).expect("a child of ours");
    // The name of the program, in parentheses, may have spaces.
    let fields: Vec<&str> =
        stat.rsplit_once(") ").expect("a name").1.split_ascii_whitespace().collect();
    let ticks = |i: usize| fields[i].parse::<f64>().expect("ticks");
    (fields[0].chars().next().expect("a state"), (ticks(11) + ticks(12)) / TICKS_PER_S)
}

fn pause() {
    std::thread::sleep(Duration::from_millis(1));
}

/// Starts a command on [`N_THREADS`] threads, and sends it SIGINT once it listens and `is_due`,
/// which gets the seconds of the processor that the command has used. Returns its output, and
/// whether it was running when the signal was sent. Fails if the command then uses the processor
/// for more than [`MOST_S`] on each thread.
pub fn interrupt(command: &mut Command, is_due: impl Fn(f64) -> bool) -> (Output, bool) {
    for variable in ["LP_NUM_THREADS", "RAYON_NUM_THREADS"] {
        command.env(variable, N_THREADS.to_string());
    }
    let child = command.spawn().expect("a child");
    let pid = child.id();
    let has_ended = || state(pid).0 == 'Z';
    while !(has_ended() || catches_interrupt(pid) && is_due(state(pid).1)) {
        pause();
    }
    let (is_running, before) = (!has_ended(), state(pid).1);
    if is_running {
        let killed = Command::new("kill").args(["-INT", &pid.to_string()]).status();
        assert!(killed.expect("kill").success());
    }
    while !has_ended() {
        pause();
    }
    let used_s = state(pid).1 - before;
    let most_s = MOST_S * f64::from(N_THREADS);
    assert!(used_s <= most_s, "{command:?}: {used_s} s of the processor after the signal");
    (child.wait_with_output().expect("an output"), is_running)
}
