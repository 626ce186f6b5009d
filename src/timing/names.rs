//! Names of cases and loops in tables, messages and files.

use serde::{Deserialize, Serialize};

/// A scene key and the value that a run gives it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setting {
    /// Key of the scene, such as `draw.cutoff`.
    pub key: String,
    /// Value, as `--set` takes it.
    pub value: String,
}

/// Returns the settings as "key=value, key=value".
pub fn sweep_text(sweep: &[Setting]) -> String {
    sweep.iter().map(|s| format!("{}={}", s.key, s.value)).collect::<Vec<_>>().join(", ")
}

/// Returns "phase, key=value", without the parts that are empty.
pub fn case_name(phase: &str, sweep: &str) -> String {
    [phase, sweep].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
}

/// Returns "case: loop"; the loop alone for a case without a name.
pub fn mode_name(case: &str, threading: &str, skip: bool) -> String {
    let of = loop_name(threading, skip);
    if case.is_empty() { of } else { format!("{case}: {of}") }
}

/// Returns the name of a loop: its threading, followed by "no-skip" if every pass ran in every
/// frame.
pub fn loop_name(threading: &str, skip: bool) -> String {
    if skip { threading.to_owned() } else { format!("{threading} no-skip") }
}
