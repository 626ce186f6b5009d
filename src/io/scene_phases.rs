//! `[[phase]]`: parts of a run, one after the other, each with keys of the scene that it sets. A
//! phase's scene is the file with the phase's `set` laid over it, and the command line's `--set`
//! over both.

use serde_json::{Value as Json, json};

use super::suggest::{list, shown};
use super::toml_override::put;
use super::toml_section::Section;
use super::toml_tree::{Document, Entry, Node, Origin, Table, Value};
use crate::error::{Error, Result};

/// What is the same in every phase.
const NOT_IN_A_PHASE: [&str; 3] = ["title", "time", "phase"];

/// Each is a scene of its own, made from the whole file: without end, they would take the file's
/// length squared.
const MAX_PHASES: usize = 256;

/// One phase as the file has it.
pub struct PhaseSpec {
    pub name: String,
    pub n_frames: u32,
    /// Paths and values that it sets, in the file's order of keys.
    sets: Vec<(Vec<String>, Node)>,
    pub resolved: Json,
}

impl PhaseSpec {
    /// Whether the phase names the loop it is run in.
    pub fn sets_mode(&self) -> bool {
        self.sets.iter().any(|(path, _)| path.iter().eq(["threads", "mode"]))
    }

    /// Lays what the phase sets over the document.
    pub fn apply(&self, document: &mut Document) -> Result<()> {
        for (path, node) in &self.sets {
            let segments: Vec<&str> = path.iter().map(String::as_str).collect();
            let at = document.source.place(node.origin);
            put(&mut document.root, &segments, 0, node.clone()).map_err(|what| {
                Error::scene(at, format!("phase \"{}\": {what}", shown(&self.name)))
            })?;
        }
        Ok(())
    }
}

/// The scene's phases in order; none where it has none.
pub fn read_phases(document: &Document) -> Result<Vec<PhaseSpec>> {
    let root = Section::root(document)?;
    let mut phases: Vec<PhaseSpec> = Vec::new();
    let sections = root.sections("phase")?;
    if sections.len() > MAX_PHASES {
        return Err(root.fault(
            "phase",
            format!("expected at most {MAX_PHASES} phases, found {}", sections.len()),
        ));
    }
    for mut s in sections {
        s.expect_keys(&["name", "frames", "set"], &[])?;
        let name = s.required_string("name")?;
        if phases.iter().any(|p| p.name == name) {
            return Err(
                s.fault("name", format!("\"{}\" is another phase's name already", shown(&name)))
            );
        }
        s.require("frames", &"a number of frames")?;
        let n_frames = s.u32("frames", 1, 1, u32::MAX)?;
        let mut sets = Vec::new();
        match s.value("set").map(|node| &node.value) {
            None => {}
            Some(Value::Table(table)) => flatten(table, &mut vec![], &mut sets),
            Some(other) => {
                return Err(s.fault(
                    "set",
                    format!("expected a table of keys, found {}", other.describe()),
                ));
            }
        }
        if let Some((path, node)) =
            sets.iter().find(|(path, _)| NOT_IN_A_PHASE.contains(&path[0].as_str()))
        {
            let what = format!(
                "`set.{}`: a phase cannot set {}",
                shown(&path.join(".")),
                list(&NOT_IN_A_PHASE)
            );
            return Err(Error::scene(document.source.place(node.origin), what));
        }
        let resolved = sets.iter().map(|(path, node)| (path.join("."), plain(&node.value)));
        s.record("set", Json::Object(resolved.collect()));
        phases.push(PhaseSpec { name, n_frames, sets, resolved: s.finish() });
    }
    Ok(phases)
}

/// Gives the scene the phases' frames; one that says another number is refused.
pub fn set_frames(document: &mut Document, n_frames: u32) -> Result<()> {
    if let Some(given) = document.at(&["time", "frames"]) {
        if matches!(given.value, Value::Integer(n) if n == i128::from(n_frames)) {
            return Ok(());
        }
        let what = format!(
            "`time.frames`: the phases have {n_frames} frames in all: leave it out or say so"
        );
        return Err(Error::scene(document.source.place(given.origin), what));
    }
    let node = Node { origin: Origin::Default, value: Value::Integer(i128::from(n_frames)) };
    put(&mut document.root, &["time", "frames"], 0, node)
        .map_err(|what| Error::scene(document.source.place(Origin::Default), what))
}

/// Every value of a table of tables, with its path. An array is one value.
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

fn plain(value: &Value) -> Json {
    match value {
        Value::String(s) => json!(s),
        Value::Integer(i) => i64::try_from(*i).map_or_else(|_| json!(i.to_string()), |i| json!(i)),
        Value::Float(f) => json!(f),
        Value::Boolean(b) => json!(b),
        Value::Datetime => json!("date-time"),
        Value::Array(items) => items.iter().map(|n| plain(&n.value)).collect(),
        Value::Table(table) => Json::Object(
            table.iter().map(|(key, entry)| (key.clone(), plain(&entry.node.value))).collect(),
        ),
    }
}
