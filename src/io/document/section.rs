//! One table of a scene: its values by key, complaints about them with their place, and a record of
//! what each key came to, defaults included (the *resolved scene*).

use std::fmt;

use serde_json::{Map, Value as Json};

use super::suggest::{did_you_mean, list, shown};
use super::tree::{Document, Node, Origin, Source, Table, Value, kind_of};
use crate::error::{Error, Place, Result};

/// A table of a scene, or the absence of one, in which every key has its default.
pub struct Section<'a> {
    source: &'a Source,
    /// As `--set` would name it; empty for the root.
    path: String,
    origin: Option<Origin>,
    table: Option<&'a Table>,
    known: Vec<&'static str>,
    resolved: Map<String, Json>,
}

impl<'a> Section<'a> {
    /// Returns the document's outermost table.
    pub fn root(document: &'a Document) -> Result<Section<'a>> {
        Section::new(&document.source, String::new(), Some(&document.root))
    }

    fn new(source: &'a Source, path: String, node: Option<&'a Node>) -> Result<Section<'a>> {
        let table = match node.map(|node| (&node.value, node.origin)) {
            None => None,
            Some((Value::Table(table), _)) => Some(table),
            Some((other, origin)) => {
                let (found, right) = (other.describe(), single_table(&path, other));
                let what = format!("`{path}`: expected a table, found {found}{right}");
                return Err(source.fault(origin, what));
            }
        };
        let origin = node.map(|node| node.origin);
        Ok(Section { source, path, origin, table, known: Vec::new(), resolved: Map::new() })
    }

    /// Refuses every key that is not in `known`. The message is about the first one in the file.
    pub fn expect_keys(&mut self, known: Vec<&'static str>) -> Result<()> {
        let entries = self.table.into_iter().flatten();
        let unknown = entries.filter(|(key, _)| !known.contains(&key.as_str()));
        let first = unknown.min_by_key(|(_, entry)| match entry.key_origin {
            Origin::File(offset) => (0, offset),
            Origin::Override(i) => (1, i),
            Origin::Default => (2, 0),
        });
        if let Some((key, entry)) = first {
            let what = format!(
                "unknown key `{}`{} known here: {}{}",
                self.name(&shown(key)),
                self.suggestion(key, &known),
                list(&known),
                self.way_to_change_kind(key, entry.key_origin)
            );
            return Err(self.source.fault(entry.key_origin, what));
        }
        self.known = known;
        Ok(())
    }

    /// Returns the nearest known name to an unknown key, or else where such a key is. A key of
    /// tables of another kind is named as such.
    fn suggestion(&self, key: &str, known: &[&str]) -> String {
        let of_kind = match self.kind_without(key) {
            Some((kind_key, kind, set)) => {
                let table = self.path.split('.').next().unwrap_or_default();
                let by = set.map_or(String::new(), |set| format!(" (set by --set {set})"));
                format!(": a {table} with {kind_key} = {kind}{by} has no such key")
            }
            None => did_you_mean(key, known),
        };
        if of_kind.ends_with('?') {
            return of_kind;
        }
        let hint = (self.source.names.hint)(&self.name(key));
        hint.map_or(format!("{of_kind};"), |hint| format!("{of_kind}; {hint};"))
    }

    /// Returns the key that sets the kind of this table, its value, and the argument of `--set`
    /// that has set it, where tables of another kind have the unknown key.
    fn kind_without(&self, key: &str) -> Option<(&'static str, String, Option<String>)> {
        let (kind_key, node) = kind_of(self.table?)?;
        if !self.source.names.has_for_a_kind(&self.path, key) {
            return None;
        }
        let set = match node.origin {
            Origin::Override(i) => Some(shown(&self.source.overrides[i])),
            _ => None,
        };
        Some((kind_key, shown(&node.value.json().to_string()), set))
    }

    /// Returns how `--set` changes the kind of a table whose other keys are of the old kind.
    fn way_to_change_kind(&self, key: &str, origin: Origin) -> String {
        match self.kind_without(key) {
            Some((kind_key, kind, Some(_))) if !matches!(origin, Origin::Override(_)) => {
                let path = &self.path;
                format!("; set all keys together: --set '{path}={{{kind_key}={kind}, …}}'")
            }
            _ => String::new(),
        }
    }

    /// Returns the resolved table.
    ///
    /// # Panics
    /// When a key was read that `expect_keys` does not know: no scene could ever set it.
    pub fn finish(self) -> Json {
        let is_known = |key: &String| self.known.contains(&key.as_str());
        assert!(self.resolved.keys().all(is_known), "every key that is read is declared");
        Json::Object(self.resolved)
    }

    /// Writes down what a key came to.
    pub fn record(&mut self, key: &str, value: Json) {
        self.resolved.insert(key.to_owned(), value);
    }

    /// Returns whether the scene sets the key.
    pub fn has(&self, key: &str) -> bool {
        self.value(key).is_some()
    }

    /// Returns the value that the scene sets for the key.
    pub fn value(&self, key: &str) -> Option<&'a Node> {
        self.table?.get(key).map(|entry| &entry.node)
    }

    /// Returns the place of the key's value, or else of the table, or else the file.
    pub fn place(&self, key: &str) -> Place {
        let origin = self.value(key).map(|node| node.origin).or(self.origin);
        self.source.place(origin.unwrap_or(Origin::Default))
    }

    /// Returns a complaint about a key's value, at its place.
    pub fn fault(&self, key: &str, what: impl fmt::Display) -> Error {
        Error::scene(self.place(key), format!("`{}`: {what}", self.name(key)))
    }

    /// Returns a complaint about item `i` of a key's array, at the item's place.
    pub fn fault_of_item(&self, key: &str, i: usize, what: impl fmt::Display) -> Error {
        let item = match self.value(key).map(|node| &node.value) {
            Some(Value::Array(items)) => items.get(i),
            _ => None,
        };
        let at = item.map_or_else(|| self.place(key), |node| self.source.place(node.origin));
        Error::scene(at, format!("`{}.{i}`: {what}", self.name(key)))
    }

    /// Returns the complaint that a key is missing.
    pub fn missing(&self, key: &str, expected: impl fmt::Display) -> Error {
        let what = format!("missing key `{}`: expected {expected}", self.name(key));
        Error::scene(self.place(key), what)
    }

    /// Returns how a value of the key is written where the key stands: in the file, or as an
    /// argument of `--set`.
    pub fn assignment(&self, key: &str, value: &str) -> String {
        match self.value(key).map(|node| node.origin) {
            Some(Origin::Override(_)) => format!("{}={value}", self.name(key)),
            _ => format!("{key} = {value}"),
        }
    }

    fn name(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// Returns the table that the key holds.
    pub fn section(&self, key: &str) -> Result<Section<'a>> {
        Section::new(self.source, self.name(key), self.value(key))
    }

    /// Returns the tables of the array that the key holds; none when the key is absent.
    pub fn sections(&self, key: &str) -> Result<Vec<Section<'a>>> {
        let found = match self.value(key).map(|node| &node.value) {
            None => return Ok(Vec::new()),
            Some(Value::Array(items)) => {
                let name = |i: usize| format!("{}.{i}", self.name(key));
                let section = |(i, item)| Section::new(self.source, name(i), Some(item));
                return items.iter().enumerate().map(section).collect();
            }
            Some(Value::Table(_)) => format!(": write [[{key}]], not [{key}]"),
            Some(other) => format!(", found {}", other.describe()),
        };
        Err(self.fault(key, format!("expected an array of tables{found}")))
    }
}

/// Returns the right form of a table that is written as an array of tables.
fn single_table(path: &str, found: &Value) -> String {
    let is_table = |item: &Node| matches!(item.value, Value::Table(_));
    match found {
        Value::Array(items) if items.iter().any(is_table) => {
            format!(": write one [{path}], not [[{path}]]")
        }
        _ => String::new(),
    }
}
