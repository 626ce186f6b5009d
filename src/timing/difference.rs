//! Lists the conditions in which two runs differ: their device, build and scene.

use std::collections::{BTreeMap, BTreeSet};

use clap::ValueEnum;
use serde::Serialize;
use serde_json::Value;

use super::check::Check;
use super::records::Run;

/// A condition that two runs must share to be comparable, as `--allow` names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Condition {
    /// Device, driver, processor, and variables that change what drivers do
    Device,
    /// Version and revision of nimbus, or another program
    Build,
    /// The scene's settings and files
    Scene,
}

impl Condition {
    /// All conditions, in the order in which differences are listed.
    pub const ALL: [Condition; 3] = [Condition::Device, Condition::Build, Condition::Scene];

    /// Returns the name that `--allow` takes.
    pub fn name(self) -> &'static str {
        match self {
            Condition::Device => "device",
            Condition::Build => "build",
            Condition::Scene => "scene",
        }
    }
}

/// One fact that differs between A and B.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// The condition that the fact belongs to.
    pub kind: Condition,
    /// Name of the fact: "driver", "scene_hash", "lighting.grid".
    pub what: String,
    /// Value in A.
    pub a: String,
    /// Value in B.
    pub b: String,
}

impl Difference {
    fn new(kind: Condition, what: &str, [a, b]: [String; 2]) -> Difference {
        Difference { kind, what: what.to_owned(), a, b }
    }
}

const UNSET: &str = "not set";
/// Most keys of the scene that are listed. The first keys show the change; all keys of two scenes
/// that share nothing would fill a page.
const N_KEYS_SHOWN: usize = 5;

/// Lists all conditions that differ between two runs, in the order of [`Condition::ALL`].
pub fn differences(a: &Run, b: &Run) -> Vec<Difference> {
    let mut found = Vec::new();
    for (kind, what, of) in [
        (Condition::Device, "name", (|r| r.device.name.clone()) as fn(&Run) -> String),
        (Condition::Device, "driver", |r| r.device.driver.clone()),
        (Condition::Device, "Vulkan", |r| r.device.api.clone()),
        (Condition::Device, "uuid", |r| r.device.uuid.clone()),
        (Condition::Device, "processor", |r| r.cpu.model.clone()),
        (Condition::Device, "cores", |r| r.cpu.logical_cores.to_string()),
        (Condition::Device, "times of passes", |r| r.clocks.pass_times.name().to_owned()),
        (Condition::Device, "caches", |r| caches(r).to_owned()),
        (Condition::Build, "version", |r| r.nimbus.clone()),
        (Condition::Build, "revision", |r| r.revision.clone()),
        (Condition::Build, "program", |r| r.tool.clone().unwrap_or_else(|| "nimbus".to_owned())),
    ] {
        let values = [of(a), of(b)];
        if kind == Condition::Build && what == "version" {
            found.extend(map_differences(Condition::Device, [&a.environment, &b.environment]));
        }
        if values[0] != values[1] {
            found.push(Difference::new(kind, what, values));
        }
    }
    if a.scene_hash != b.scene_hash {
        found.extend(scene_differences(a, b));
        return found;
    }
    // The points of a sweep can name different files.
    for of_a in &a.cases {
        let of_b = b.cases.iter().find(|of_b| of_b.name() == of_a.name());
        if let Some(of_b) = of_b.filter(|of_b| of_b.scene_hash != of_a.scene_hash) {
            let hashes = [of_a, of_b].map(|case| short(&case.scene_hash));
            let what = format!("{}, hash", of_a.name());
            found.push(Difference::new(Condition::Scene, &what, hashes));
        }
    }
    found
}

/// Returns whether caches were cold before each pass.
fn caches(run: &Run) -> &'static str {
    if run.cold_bytes.is_some() { "cold before each pass" } else { "as the pass before left them" }
}

/// Lists the scene hashes and the first keys that differ; no key differs if only a file that the
/// scene names was changed.
fn scene_differences(a: &Run, b: &Run) -> Vec<Difference> {
    let hashes = [a, b].map(|run| short(&run.scene_hash));
    let mut found = vec![Difference::new(Condition::Scene, "scene_hash", hashes)];
    let leaves = [a, b].map(|run| {
        let mut leaves = BTreeMap::new();
        add_leaves(&run.scene, "", &mut leaves);
        leaves
    });
    let mut keys = map_differences(Condition::Scene, [&leaves[0], &leaves[1]]);
    let n_more = keys.len().saturating_sub(N_KEYS_SHOWN);
    keys.truncate(N_KEYS_SHOWN);
    found.extend(keys);
    if n_more > 0 {
        let more = format!("{n_more} more keys");
        found.push(Difference::new(Condition::Scene, &more, ["…", "…"].map(str::to_owned)));
    }
    found
}

/// Lists the keys whose values differ, or that only one map has.
fn map_differences(kind: Condition, maps: [&BTreeMap<String, String>; 2]) -> Vec<Difference> {
    let keys: BTreeSet<&String> = maps.iter().flat_map(|map| map.keys()).collect();
    let values = |key: &String| maps.map(|map| map.get(key).map_or(UNSET.to_owned(), Clone::clone));
    let differ = keys.into_iter().filter(|key| maps[0].get(*key) != maps[1].get(*key));
    differ.map(|key| Difference::new(kind, key, values(key))).collect()
}

/// Returns the beginning of a hash, enough to tell two apart by eye.
pub fn short(hash: &str) -> String {
    hash.chars().take(12).collect()
}

/// Adds "lighting.grid" → "64" for every value that contains no other. A list of numbers is one
/// value, as `--set` takes it.
fn add_leaves(value: &Value, at: &str, leaves: &mut BTreeMap<String, String>) {
    let below = |key: &str| if at.is_empty() { key.to_owned() } else { format!("{at}.{key}") };
    match value {
        Value::Object(object) => {
            object.iter().for_each(|(key, value)| add_leaves(value, &below(key), leaves));
        }
        Value::Array(items) if items.iter().any(|item| item.is_object() || item.is_array()) => {
            for (i, item) in items.iter().enumerate() {
                add_leaves(item, &below(&i.to_string()), leaves);
            }
        }
        _ => {
            leaves.insert(at.to_owned(), value.to_string());
        }
    }
}

/// Lists remarks on two runs that may be compared: unknown sources, interruptions and other
/// commands.
pub(super) fn remarks(a: &Run, b: &Run) -> Vec<String> {
    let mut remarks = Vec::new();
    let is_one_program = a.revision == b.revision && a.tool == b.tool;
    if is_one_program && (a.revision == "unknown" || a.revision.ends_with("-dirty")) {
        let revision = &a.revision;
        remarks.push(format!(
            "both builds have the revision {revision}: their sources may differ all the same"
        ));
    }
    for (name, run) in [("A", a), ("B", b)] {
        if run.interrupted {
            remarks.push(format!(
                "{name} was interrupted: its last block is incomplete, and a drift may not cancel"
            ));
        }
    }
    for (name, run) in [("A", a), ("B", b)] {
        remarks.extend(wrong_text(run).map(|text| format!("{name}: {text}")));
    }
    let [of_a, of_b] = [a, b].map(|run| relevant_words(&run.command).join(" "));
    if of_a != of_b {
        remarks.push(format!("the commands of A and B differ: A \"{of_a}\", B \"{of_b}\""));
    }
    remarks
}

/// Returns a sentence on a run whose pictures or stages are wrong; `None` if none is known to be.
pub fn wrong_text(run: &Run) -> Option<String> {
    let is_wrong = run.cases.iter().any(|case| case.check.as_ref().is_some_and(Check::is_wrong));
    let failed = run.stages.as_ref().map_or(&[][..], |stages| &stages.failed);
    if is_wrong {
        Some("the device's picture is wrong, so its times are not those of the scene".to_owned())
    } else if failed.is_empty() {
        None
    } else {
        let failed = failed.join(", ");
        Some(format!("the device is wrong in {failed}, so its times may not be those of the scene"))
    }
}

/// Returns the command without the program and the arguments that change no time: the place of the
/// results and the amount of text.
fn relevant_words(command: &[String]) -> Vec<&str> {
    let mut words = command.iter().skip(1).map(String::as_str);
    let mut kept = Vec::new();
    while let Some(word) = words.next() {
        match word {
            "--out" => drop(words.next()),
            "--force" | "--json" | "-q" | "--quiet" | "-v" | "--verbose" => {}
            _ if word.starts_with("--out=") => {}
            _ => kept.push(word),
        }
    }
    kept
}

/// The facts of one part of a bench or study, by name, in a fixed order.
pub type Facts = Vec<(&'static str, String)>;

/// Lists the facts in which parts differ from the first one, as "scene: A of shard 0, B of shard
/// 4". Each part is given by its name and facts.
pub fn fact_differences(parts: &[(&str, Facts)]) -> BTreeSet<String> {
    let Some(((first, facts), others)) = parts.split_first() else {
        return BTreeSet::from(["there is no part".to_owned()]);
    };
    let of_part = |(name, theirs): &(&str, Facts)| {
        let differ = facts.iter().zip(theirs).filter(|(a, b)| a != b);
        let text =
            differ.map(|((what, a), (_, b))| format!("{what}: {a} of {first}, {b} of {name}"));
        text.collect::<Vec<String>>()
    };
    others.iter().flat_map(of_part).collect()
}
