//! `--set key.path=VALUE`: one value laid over a scene's tree. A path's segments are keys, or
//! numbers where the tree has an array, or `*` for all of its items; a value is TOML, or a bare
//! word, which shells make awkward to quote.

use toml::de::DeValue;

use super::suggest::shown;
use super::toml_depth::{MAX_DOTS, too_deep};
use super::toml_tree::{
    Document, Entry, Node, Origin, OutOfRange, TOO_DEEP, Table, Value, convert,
};
use crate::error::{Error, Result};

impl Document {
    /// Lays `--set` arguments over the tree in their order; later ones win.
    pub fn apply(&mut self, overrides: &[String]) -> Result<()> {
        for text in overrides {
            let origin = Origin::Override(self.source.overrides.len());
            self.source.overrides.push(text.clone());
            let fault = |what: String| Error::scene(self.source.place(origin), what);
            let (path, value) = text.split_once('=').ok_or_else(|| {
                fault("expected key.path=VALUE, for example lighting.grid=32".to_owned())
            })?;
            let segments: Vec<&str> = path.split('.').map(str::trim).collect();
            if segments.len() > MAX_DOTS + 1 || too_deep(value).is_some() {
                return Err(fault(TOO_DEEP.to_owned()));
            }
            if segments.iter().any(|s| s.is_empty()) {
                return Err(fault("expected key.path=VALUE, found an empty key".to_owned()));
            }
            let value = parse_value(value.trim(), origin).map_err(fault)?;
            put(&mut self.root, &segments, 0, value)
                .map_err(|what| Error::scene(self.source.place(origin), what))?;
        }
        Ok(())
    }
}

fn parse_value(text: &str, origin: Origin) -> std::result::Result<Node, String> {
    if text.is_empty() {
        return Err("expected a value after `=`".to_owned());
    }
    match DeValue::parse(text) {
        Ok(value) => convert(&value, &|_| origin).map_err(|_| OutOfRange::WHAT.to_owned()),
        Err(_) if is_word(text) => Ok(Node { origin, value: Value::String(text.to_owned()) }),
        Err(e) => Err(format!("the value is no TOML: {}", e.message())),
    }
}

/// Names and file names. Anything with TOML's own punctuation was meant as TOML and is reported as
/// such.
pub(super) fn is_word(text: &str) -> bool {
    text.chars()
        .all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ':' | '/' | '\\' | ' '))
}

/// Puts `value` at `segments[i..]` below `node`.
pub(super) fn put(
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
                    "`{}`: expected a number from 0 to {}, or *, found `{}`",
                    here(),
                    n - 1,
                    shown(segment)
                ),
            })?;
            put(item, segments, i + 1, value)
        }
        other => Err(format!("`{}` is no table: {}", here(), other.describe())),
    }
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
        return Err(format!("the scene has no `{}`", shown(&segments[..=i].join("."))));
    }
    let empty =
        || Entry { key_origin: origin, node: Node { origin, value: Value::Table(Table::new()) } };
    put(&mut table.entry(segments[i].to_owned()).or_insert_with(empty).node, segments, i + 1, value)
}
