//! Ctrl-C's signal, sent to the program once it listens, and what the program does from then on.
//! Work is measured in seconds of the processor, which do not depend on what else the machine does.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::fs;
use std::process::{Child, Command, Output};
use std::time::Duration;

/// Ticks a second of the times in /proc, on every architecture that Linux has kept.
const TICKS_PER_S: f64 = 100.0;
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

/// Sends SIGINT to `child` once it listens and `is_begun`. Returns its output, and the seconds of
/// the processor that it used from the signal to its end.
pub fn interrupt(child: Child, is_begun: impl Fn() -> bool) -> (Output, f64) {
    let pid = child.id();
    let has_ended = || state(pid).0 == 'Z';
    while !(has_ended() || catches_interrupt(pid) && is_begun()) {
        pause();
    }
    let (_, before) = state(pid);
    let killed = Command::new("kill").args(["-INT", &pid.to_string()]).status();
    assert!(killed.expect("kill").success());
    while !has_ended() {
        pause();
    }
    let (_, after) = state(pid);
    (child.wait_with_output().expect("an output"), after - before)
}

/// Sends SIGINT to `child` once its threads have used `after_s` seconds of the processor, unless it
/// has ended before. Returns its output, and the seconds of the processor that it used from the
/// signal to its end; none if it had ended before.
pub fn interrupt_after(child: Child, after_s: f64) -> (Output, Option<f64>) {
    let pid = child.id();
    while state(pid).0 != 'Z' && (state(pid).1 < after_s || !catches_interrupt(pid)) {
        pause();
    }
    let (is_running, before) = (state(pid).0 != 'Z', state(pid).1);
    if is_running {
        let killed = Command::new("kill").args(["-INT", &pid.to_string()]).status();
        assert!(killed.expect("kill").success());
    }
    while state(pid).0 != 'Z' {
        pause();
    }
    let used = state(pid).1 - before;
    (child.wait_with_output().expect("an output"), is_running.then_some(used))
}
