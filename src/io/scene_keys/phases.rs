//! Tables `[[phase]]`: parts of a run, one after the other, each with keys of the scene that it
//! sets. A phase's scene is the file with the phase's `set` laid over it, and the command line's
//! `--set` over both.

use serde_json::Value as Json;

use super::key::{keys, names};
use super::spec::{described, integer, required_text};
use crate::error::Result;
use crate::io::document::overrides::put;
use crate::io::document::section::Section;
use crate::io::document::suggest::{list, shown};
use crate::io::document::tree::{Document, Entry, KeyNames, Node, Origin, Table, Value};

/// Keys that no phase can set.
const NOT_IN_A_PHASE: [&str; 3] = ["title", "time", "phase"];

/// Most phases. Each is made from the whole file, so that without a bound phases would take the
/// square of the file's length.
const MAX_PHASES: usize = 256;

/// One phase as the file has it.
pub struct PhaseSpec {
    pub name: String,
    pub n_frames: u32,
    /// Paths and values that the phase sets.
    sets: Vec<(Vec<String>, Node)>,
    pub resolved: Json,
}

keys! { PHASE: pub(super) fn phase(s) -> PhaseSpec { PhaseSpec;
    /// Name of the phase in results; each name once.
    name: required_text();
    /// Number of frames of the phase.
    n_frames ["frames"]: integer(1, 1, u32::MAX).required();
    /// Keys of the scene that the phase sets, such as `set.lighting.mode = "none"`; not `title` and
    /// `time`.
    sets ["set"]: described("table of keys") => |_| sets(s);
    resolved => Json::Null;
}}

impl PhaseSpec {
    /// Returns whether the phase sets `threads.mode`, the loop that it is run in.
    pub fn sets_mode(&self) -> bool {
        self.sets.iter().any(|(path, _)| path.iter().eq(["threads", "mode"]))
    }

    /// Lays the keys that the phase sets over the document.
    pub fn apply(&self, document: &mut Document) -> Result<()> {
        for (path, node) in &self.sets {
            let segments: Vec<&str> = path.iter().map(String::as_str).collect();
            let names = document.source.names;
            put(&mut document.root, &segments, 0, node.clone(), &names).map_err(|what| {
                let what = format!("phase \"{}\": {what}", shown(&self.name));
                document.source.fault(node.origin, what)
            })?;
        }
        Ok(())
    }
}

/// Reads the scene's phases in order.
pub fn read_phases(document: &Document) -> Result<Vec<PhaseSpec>> {
    let root = Section::root(document)?;
    let mut phases: Vec<PhaseSpec> = Vec::new();
    let sections = root.sections("phase")?;
    if sections.len() > MAX_PHASES {
        let what = format!("expected at most {MAX_PHASES} phases, found {}", sections.len());
        return Err(root.fault("phase", what));
    }
    for mut s in sections {
        s.expect_keys(names(&[PHASE]))?;
        let mut phase = phase(&mut s)?;
        if phases.iter().any(|p| p.name == phase.name) {
            let what = format!("\"{}\" is another phase's name already", shown(&phase.name));
            return Err(s.fault("name", what));
        }
        let refused = |path: &[String]| NOT_IN_A_PHASE.contains(&path[0].as_str());
        if let Some((path, node)) = phase.sets.iter().find(|(path, _)| refused(path)) {
            let (key, others) = (shown(&path.join(".")), list(&NOT_IN_A_PHASE));
            let what = format!("`set.{key}`: a phase cannot set {others}");
            return Err(document.source.fault(node.origin, what));
        }
        phase.resolved = s.finish();
        phases.push(phase);
    }
    Ok(phases)
}

fn sets(s: &mut Section) -> Result<Vec<(Vec<String>, Node)>> {
    let mut sets = Vec::new();
    match s.value("set").map(|node| &node.value) {
        None => {}
        Some(Value::Table(table)) => flatten(table, &mut vec![], &mut sets),
        Some(other) => {
            let what = format!("expected a table of keys, found {}", other.describe());
            return Err(s.fault("set", what));
        }
    }
    let resolved = sets.iter().map(|(path, node)| (path.join("."), node.value.json()));
    s.record("set", Json::Object(resolved.collect()));
    Ok(sets)
}

/// Sets `time.frames` to the phases' frames, unless the scene has this number already.
///
/// # Errors
/// When the scene has another number.
pub fn set_frames(document: &mut Document, n_frames: u32) -> Result<()> {
    let node = Node { origin: Origin::Default, value: Value::Integer(n_frames.into()) };
    let (origin, what) = match document.at(&["time", "frames"]) {
        Some(Node { value: Value::Integer(n), .. }) if *n == i128::from(n_frames) => return Ok(()),
        Some(given) => {
            let what = format!(
                "`time.frames`: the phases have {n_frames} frames in all: leave it out or say so"
            );
            (given.origin, what)
        }
        None => match put(&mut document.root, &["time", "frames"], 0, node, &KeyNames::NONE) {
            Ok(()) => return Ok(()),
            Err(what) => (Origin::Default, what),
        },
    };
    Err(document.source.fault(origin, what))
}

/// Lists every value of a table of tables, with its path. An array is one value.
fn flatten(table: &Table, path: &mut Vec<String>, sets: &mut Vec<(Vec<String>, Node)>) {
    for (key, Entry { node, .. }) in table {
        // A key in quotes may be a whole path, as `--set` has it.
        let n_before = path.len();
        path.extend(key.split('.').map(str::to_owned));
        match &node.value {
            Value::Table(inner) => flatten(inner, path, sets),
            _ => sets.push((path.clone(), node.clone())),
        }
        path.truncate(n_before);
    }
}
