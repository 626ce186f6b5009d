//! `--set key.path=VALUE`: one value laid over a scene's tree. A segment of the path is a key, a
//! number where the tree has an array, or `*` for all items of an array. A value is TOML or a bare
//! word, because shells make quotes awkward.

use toml::de::DeValue;

use super::depth::{MAX_DOTS, too_deep};
use super::suggest::{did_you_mean, shown};
use super::tree::{Document, Entry, Node, Origin, TOO_DEEP, TOO_LARGE, Table, Value, convert};
use crate::error::Result;

impl Document {
    /// Lays `--set` arguments over the tree in their order; later ones win.
    ///
    /// # Errors
    /// When an argument has no `=`, no value, or a path that the tree does not have.
    pub fn apply(&mut self, overrides: &[String]) -> Result<()> {
        for text in overrides {
            let origin = Origin::Override(self.source.overrides.len());
            self.source.overrides.push(text.clone());
            self.apply_one(text, origin).map_err(|what| self.source.fault(origin, what))?;
        }
        Ok(())
    }

    fn apply_one(&mut self, text: &str, origin: Origin) -> std::result::Result<(), String> {
        let (segments, value) =
            parts(text).ok_or("expected key.path=VALUE, for example lighting.grid=32")?;
        if segments.len() > MAX_DOTS + 1 || too_deep(value).is_some() {
            return Err(TOO_DEEP.to_owned());
        }
        if segments.iter().any(|s| s.is_empty()) {
            return Err("expected key.path=VALUE, found an empty key".to_owned());
        }
        put(&mut self.root, &segments, 0, parse_value(value, origin)?)
    }
}

/// Returns the path of an argument `key.path=VALUE`, key by key, and its value.
pub fn parts(text: &str) -> Option<(Vec<&str>, &str)> {
    let (path, value) = text.split_once('=')?;
    Some((path.split('.').map(str::trim).collect(), value.trim()))
}

fn parse_value(text: &str, origin: Origin) -> std::result::Result<Node, String> {
    if text.is_empty() {
        return Err("expected a value after `=`".to_owned());
    }
    match DeValue::parse(text) {
        Ok(value) => convert(&value, &|_| origin).map_err(|_| TOO_LARGE.to_owned()),
        Err(_) if is_word(text) => Ok(Node { origin, value: Value::String(text.to_owned()) }),
        Err(e) => Err(format!(
            "the value is no TOML: {}; expected a value such as 3, [1, 2, 3], true or \"text\"",
            e.message()
        )),
    }
}

/// Returns whether a text is a name, a file name or another text without TOML's own punctuation.
/// Text with it was meant as TOML and is reported as such.
pub fn is_word(text: &str) -> bool {
    !text.chars().any(|c| c.is_control() || "[]{}\"'=#".contains(c))
}

/// Puts `value` at `segments[i..]` below `node`. An error says which segment the tree does not
/// have.
pub fn put(
    node: &mut Node,
    segments: &[&str],
    i: usize,
    value: Node,
) -> std::result::Result<(), String> {
    let Some(segment) = segments.get(i) else {
        *node = value;
        return Ok(());
    };
    let here = || shown(&segments[..i].join("."));
    match &mut node.value {
        Value::Table(table) => put_in_table(table, segments, i, value),
        Value::Array(list) if *segment == "*" && !list.is_empty() => {
            list.iter_mut().try_for_each(|item| put(item, segments, i + 1, value.clone()))
        }
        Value::Array(list) => {
            let n = list.len();
            let item = segment.parse().ok().and_then(|k: usize| list.get_mut(k));
            let item = item.ok_or_else(|| match n {
                0 => format!("`{}` is empty", here()),
                _ => format!(
                    "`{}`: expected a number from 0 to {}, or *, found `{}`{}",
                    here(),
                    n - 1,
                    shown(segment),
                    numbered(&segments[..i], segment, &segments[i + 1..])
                ),
            })?;
            put(item, segments, i + 1, value)
        }
        other => Err(format!("`{}` is no table: {}", here(), other.describe())),
    }
}

/// Returns the path with the number that is missing before `segment`, or that a coordinate has.
fn numbered(before: &[&str], segment: &str, after: &[&str]) -> String {
    if segment.chars().all(|c| c.is_ascii_digit()) {
        return String::new();
    }
    let (i_axis, rest) = match ["x", "y", "z"].iter().position(|axis| axis == &segment) {
        Some(i) => (i, after.to_vec()),
        None => (0, [&[segment], after].concat()),
    };
    let number = i_axis.to_string();
    let path = [before, &[number.as_str()], &rest].concat().join(".");
    format!("; write `{}`", shown(&path))
}

fn put_in_table(
    table: &mut Table,
    segments: &[&str],
    i: usize,
    value: Node,
) -> std::result::Result<(), String> {
    let origin = value.origin;
    if !table.contains_key(segments[i])
        && segments.get(i + 1).is_some_and(|next| *next == "*" || next.parse::<usize>().is_ok())
    {
        let known: Vec<&str> = table.keys().map(String::as_str).collect();
        let near = did_you_mean(segments[i], &known);
        return Err(format!("the scene has no `{}`{near}", shown(&segments[..=i].join("."))));
    }
    let empty =
        || Entry { key_origin: origin, node: Node { origin, value: Value::Table(Table::new()) } };
    put(&mut table.entry(segments[i].to_owned()).or_insert_with(empty).node, segments, i + 1, value)
}
