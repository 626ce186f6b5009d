//! Whether two runs measured the same thing: the same scene on the same device with the same build.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use crate::timing::records::Run;

/// What has to be the same, as `--allow` names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Sameness {
    /// The machine: device, driver, processor, and the variables that change what drivers do.
    Device,
    /// Version and revision of nimbus.
    Build,
    /// Every setting of the scene, and its files.
    Scene,
}

impl Sameness {
    pub fn name(self) -> &'static str {
        match self {
            Sameness::Device => "device",
            Sameness::Build => "build",
            Sameness::Scene => "scene",
        }
    }
}

/// One thing that differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    pub kind: Sameness,
    /// "driver", "scene_hash", "lighting.grid".
    pub what: String,
    pub a: String,
    pub b: String,
}

/// All that must be the same and is not: device, build, scene, in this order.
pub fn differences(a: &Run, b: &Run) -> Vec<Difference> {
    let mut found = Vec::new();
    let mut compare = |kind, what: &str, a: String, b: String| {
        if a != b {
            found.push(Difference { kind, what: what.to_owned(), a, b });
        }
    };
    for (what, of) in [
        ("name", (|r| r.device.name.clone()) as fn(&Run) -> String),
        ("driver", |r| r.device.driver.clone()),
        ("Vulkan", |r| r.device.api.clone()),
        ("uuid", |r| r.device.uuid.clone()),
        ("processor", |r| r.cpu.model.clone()),
        ("cores", |r| r.cpu.logical_cores.to_string()),
    ] {
        compare(Sameness::Device, what, of(a), of(b));
    }
    let mut variables: Vec<&String> = a.environment.keys().chain(b.environment.keys()).collect();
    variables.sort();
    variables.dedup();
    for variable in variables {
        let of = |run: &Run| run.environment.get(variable).map_or(UNSET.to_owned(), Clone::clone);
        compare(Sameness::Device, variable, of(a), of(b));
    }
    compare(Sameness::Build, "version", a.nimbus.clone(), b.nimbus.clone());
    compare(Sameness::Build, "revision", a.revision.clone(), b.revision.clone());
    if a.scene_hash != b.scene_hash {
        found.extend(scene_differences(a, b));
        return found;
    }
    // Points of a sweep may name files of their own.
    for of_a in &a.cases {
        let of_b = b.cases.iter().find(|of_b| of_b.name() == of_a.name());
        if let Some(of_b) = of_b.filter(|of_b| of_b.scene_hash != of_a.scene_hash) {
            let (a, b) = (short(&of_a.scene_hash).to_owned(), short(&of_b.scene_hash).to_owned());
            found.push(Difference {
                kind: Sameness::Scene,
                what: format!("{}, hash", of_a.name()),
                a,
                b,
            });
        }
    }
    found
}

const UNSET: &str = "not set";
/// Of a long list the first say what happened; two scenes that share nothing would fill a page.
const N_KEYS_SHOWN: usize = 5;

/// The hashes, and the first keys that differ; none do where only a file that the scene names was
/// changed.
fn scene_differences(a: &Run, b: &Run) -> Vec<Difference> {
    let new = |what: &str, a: &str, b: &str| Difference {
        kind: Sameness::Scene,
        what: what.to_owned(),
        a: a.to_owned(),
        b: b.to_owned(),
    };
    let mut found = vec![new("scene_hash", short(&a.scene_hash), short(&b.scene_hash))];
    let (mut of_a, mut of_b) = (BTreeMap::new(), BTreeMap::new());
    leaves(&a.scene, "", &mut of_a);
    leaves(&b.scene, "", &mut of_b);
    let mut keys: Vec<&String> = of_a.keys().chain(of_b.keys()).collect();
    keys.sort();
    keys.dedup();
    keys.retain(|key| of_a.get(*key) != of_b.get(*key));
    for key in keys.iter().take(N_KEYS_SHOWN) {
        let of = |leaves: &BTreeMap<String, String>| {
            leaves.get(*key).map_or(UNSET.to_owned(), Clone::clone)
        };
        found.push(new(key, &of(&of_a), &of(&of_b)));
    }
    if keys.len() > N_KEYS_SHOWN {
        let more = format!("{} more keys", keys.len() - N_KEYS_SHOWN);
        found.push(new(&more, "…", "…"));
    }
    found
}

/// Enough of a hash to tell two apart by eye.
fn short(hash: &str) -> &str {
    hash.get(..12).unwrap_or(hash)
}

/// "lighting.grid" → "64" for every value that holds no other; a list of numbers is one value, as
/// `--set` takes it.
fn leaves(value: &Value, at: &str, found: &mut BTreeMap<String, String>) {
    let below = |key: &str| if at.is_empty() { key.to_owned() } else { format!("{at}.{key}") };
    match value {
        Value::Object(object) => {
            object.iter().for_each(|(key, value)| leaves(value, &below(key), found))
        }
        Value::Array(items) if items.iter().any(|item| item.is_object() || item.is_array()) => {
            items
                .iter()
                .enumerate()
                .for_each(|(i, item)| leaves(item, &below(&i.to_string()), found));
        }
        _ => {
            found.insert(at.to_owned(), value.to_string());
        }
    }
}

/// What a reader should know of runs that may be compared.
pub fn remarks(a: &Run, b: &Run) -> Vec<String> {
    let mut remarks = Vec::new();
    if a.revision == b.revision && (a.revision == "unknown" || a.revision.ends_with("-dirty")) {
        let revision = &a.revision;
        remarks.push(format!(
            "both builds call themselves {revision}: that does not say that they are the same"
        ));
    }
    for (name, run) in [("A", a), ("B", b)] {
        if run.interrupted {
            remarks.push(format!(
                "{name} was interrupted: its last block is not whole, and its blocks \
                    may not balance"
            ));
        }
    }
    let (of_a, of_b) = (wishes(&a.command), wishes(&b.command));
    if of_a != of_b {
        remarks.push(format!(
            "A and B were asked for differently: A \"{}\", B \"{}\"",
            of_a.join(" "),
            of_b.join(" ")
        ));
    }
    remarks
}

/// The command without the program and without what changes no time: where results go and how much
/// is said.
fn wishes(command: &[String]) -> Vec<&str> {
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
