//! `--set key.path=VALUE`: one value laid over a scene's tree. A segment of the path is a key, a
//! number where the tree has an array, or `*` for all items of an array. A value is TOML or a bare
//! word, because shells make quotes awkward.

use toml::de::DeValue;

use super::depth::{MAX_DOTS, too_deep};
use super::suggest::{did_you_mean, shown};
use super::tree::{
    Document, Entry, KeyNames, Node, Origin, TOO_DEEP, TOO_LARGE, Table, Value, convert,
};
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
        put(&mut self.root, &segments, 0, parse_value(value, origin)?, &self.source.names)
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
/// have; `names` serve its hints.
pub fn put(
    node: &mut Node,
    segments: &[&str],
    i: usize,
    value: Node,
    names: &KeyNames,
) -> std::result::Result<(), String> {
    let Some(segment) = segments.get(i) else {
        *node = value;
        return Ok(());
    };
    let is_default = node.origin == Origin::Default;
    let here = || shown(&segments[..i].join("."));
    match &mut node.value {
        Value::Table(table) => put_in_table(table, segments, i, value, names),
        Value::Array(list) if *segment == "*" && !list.is_empty() => {
            list.iter_mut().try_for_each(|item| put(item, segments, i + 1, value.clone(), names))
        }
        Value::Array(list) => {
            let n = list.len();
            let meant = match segment.starts_with(|c: char| c.is_alphabetic()) {
                true => meant(list, segments, i, names),
                false => String::new(),
            };
            let item = segment.parse().ok().and_then(|k: usize| list.get_mut(k));
            let item = item.ok_or_else(|| {
                let (here, found) = (here(), shown(segment));
                match n {
                    0 => format!("`{here}` is empty"),
                    _ if segment.parse::<usize>().is_ok() => format!(
                        "`{here}.{found}` does not exist: `{here}` has {n} item{}, numbered from \
                         0{}",
                        if n == 1 { "" } else { "s" },
                        if is_default { defaults_of(&here) } else { String::new() }
                    ),
                    _ => format!(
                        "`{here}`: expected a number from 0 to {}, or *, found `{found}`{meant}",
                        n - 1
                    ),
                }
            })?;
            put(item, segments, i + 1, value, names)
        }
        other => Err(format!("`{}` is no table: {}", here(), other.describe())),
    }
}

/// Says where the items of an array come from that the scene does not have.
fn defaults_of(array: &str) -> String {
    format!(", which are the defaults of a scene without [[{array}]]")
}

/// Returns the path that was probably meant by `segments`, whose segment `i` is no number of an
/// item of `list`. Where no item has such a key, returns where the key is; nothing for an unknown
/// key.
fn meant(list: &[Node], segments: &[&str], i: usize, names: &KeyNames) -> String {
    let before = &segments[..i];
    let path = |middle: &[String]| {
        let before = before.iter().map(|segment| (*segment).to_owned());
        before.chain(middle.iter().cloned()).collect::<Vec<_>>().join(".")
    };
    let write = |middle: &[String]| format!("; write `{}`", shown(&path(middle)));
    if list.iter().any(|item| matches!(item.value, Value::Table(_))) {
        // The number is missing, or a name stands in its place.
        for rest in [&segments[i..], &segments[i + 1..]] {
            let Some(key) = rest.first() else { continue };
            let has_key = |item: &Node| match &item.value {
                Value::Table(table) => names.can_have(&path(&[]), table, key),
                _ => false,
            };
            if let Some(i_item) = list.iter().position(has_key) {
                let rest = rest.iter().map(|segment| match axis(segment) {
                    Some(i_axis) if segment != key => i_axis.to_string(),
                    _ => (*segment).to_owned(),
                });
                return write(&[i_item.to_string()].into_iter().chain(rest).collect::<Vec<_>>());
            }
        }
        let last = segments.iter().rfind(|segment| axis(segment).is_none()).unwrap_or(&"");
        let hint = (names.hint)(&path(&[(*last).to_owned()]));
        return hint.map_or(String::new(), |hint| format!("; {hint}"));
    }
    match axis(segments[i]).filter(|i_axis| *i_axis < list.len()) {
        Some(i_axis) => write(&[i_axis.to_string()]),
        None => String::new(),
    }
}

/// Returns the number of a coordinate that is named by its axis.
fn axis(segment: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|axis| *axis == segment)
}

fn put_in_table(
    table: &mut Table,
    segments: &[&str],
    i: usize,
    value: Node,
    names: &KeyNames,
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
    let entry = table.entry(segments[i].to_owned()).or_insert_with(empty);
    put(&mut entry.node, segments, i + 1, value, names)
}
