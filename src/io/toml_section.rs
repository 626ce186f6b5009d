//! Taking values out of one table of a scene: every value is checked when it is read, and what it
//! came to, defaults included, is written down for the resolved scene.

use std::fmt;

use glam::DVec3;
use serde_json::{Map, Value as Json, json};

use super::magnitude::shortest;
use super::suggest::{did_you_mean, list, shown};
use super::toml_tree::{Document, Node, Origin, Source, Table, Value};
use crate::error::{Error, Place, Result};

/// What a number must be besides finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bounds {
    Any,
    /// Both ends allowed.
    Within(f64, f64),
    /// The first end allowed, the second not.
    From(f64, f64),
    /// Neither end allowed.
    Between(f64, f64),
}

impl Bounds {
    fn contains(self, v: f64) -> bool {
        v.is_finite()
            && match self {
                Bounds::Any => true,
                Bounds::Within(low, high) => (low..=high).contains(&v),
                Bounds::From(low, high) => (low..high).contains(&v),
                Bounds::Between(low, high) => v > low && v < high,
            }
    }
}

impl fmt::Display for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Bounds::Any => write!(f, "a finite number"),
            Bounds::Within(low, high) => {
                write!(f, "a number from {} to {}", shortest(*low), shortest(*high))
            }
            Bounds::From(low, high) => {
                write!(f, "a number from {} to below {}", shortest(*low), shortest(*high))
            }
            Bounds::Between(low, high) => {
                write!(f, "a number above {} and below {}", shortest(*low), shortest(*high))
            }
        }
    }
}

/// One table, or the absence of one, which then has every default.
pub struct Section<'a> {
    source: &'a Source,
    /// As `--set` would name it; empty for the root.
    path: String,
    origin: Option<Origin>,
    table: Option<&'a Table>,
    known: &'static [&'static str],
    resolved: Map<String, Json>,
}

impl<'a> Section<'a> {
    pub fn root(document: &'a Document) -> Result<Section<'a>> {
        Section::new(&document.source, String::new(), Some(&document.root))
    }

    fn new(source: &'a Source, path: String, node: Option<&'a Node>) -> Result<Section<'a>> {
        let table = match node.map(|n| &n.value) {
            None => None,
            Some(Value::Table(table)) => Some(table),
            Some(other) => {
                let at = source.place(node.map_or(Origin::Default, |n| n.origin));
                return Err(Error::scene(
                    at,
                    format!("`{path}`: expected a table, found {}", other.describe()),
                ));
            }
        };
        Ok(Section {
            source,
            path,
            origin: node.map(|n| n.origin),
            table,
            known: &[],
            resolved: Map::new(),
        })
    }

    /// Refuses every key that is not in `known`; those in `later` with the news that they are yet
    /// to come. The first in file order is reported.
    pub fn expect_keys(&mut self, known: &'static [&'static str], later: &[&str]) -> Result<()> {
        self.known = known;
        let unknown =
            self.table.into_iter().flatten().filter(|(key, _)| !known.contains(&key.as_str()));
        let first = unknown.min_by_key(|(_, entry)| match entry.key_origin {
            Origin::File(offset) => (0, offset),
            Origin::Override(i) => (1, i),
            Origin::Default => (2, 0),
        });
        let Some((key, entry)) = first else { return Ok(()) };
        let name = self.name(&shown(key));
        let what = if later.contains(&key.as_str()) {
            format!("`{name}` belongs to a later version of nimbus; this one knows {}", list(known))
        } else {
            format!("unknown key `{name}`{} known here: {}", suggestion(key, known), list(known))
        };
        Err(Error::scene(self.source.place(entry.key_origin), what))
    }

    /// The resolved table.
    pub fn finish(self) -> Json {
        // A key that is read but not declared could never be given: a fault of ours that any scene
        // would show.
        assert!(
            self.resolved.keys().all(|key| self.known.contains(&key.as_str())),
            "every key read is declared"
        );
        Json::Object(self.resolved)
    }

    /// Writes down what a key came to that is put together outside (a table, a list of them).
    pub fn record(&mut self, key: &str, value: Json) {
        self.resolved.insert(key.to_owned(), value);
    }

    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// Where the key's value stands, or else the section, or else the file.
    pub fn place(&self, key: &str) -> Place {
        let origin = self.get(key).map(|node| node.origin).or(self.origin);
        origin.map_or_else(|| Place::file(&self.source.path), |origin| self.source.place(origin))
    }

    /// A complaint about a key's value, where it stands.
    pub fn fault(&self, key: &str, what: impl fmt::Display) -> Error {
        Error::scene(self.place(key), format!("`{}`: {what}", self.name(key)))
    }

    /// The key's whole path.
    pub fn name(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    pub fn section(&self, key: &str) -> Result<Section<'a>> {
        Section::new(self.source, self.name(key), self.get(key))
    }

    /// An array of tables; none where the key is absent.
    pub fn sections(&self, key: &str) -> Result<Vec<Section<'a>>> {
        let items = match self.get(key).map(|node| &node.value) {
            None => return Ok(Vec::new()),
            Some(Value::Array(items)) => items,
            Some(Value::Table(_)) => {
                return Err(self.fault(
                    key,
                    format!("expected an array of tables: write [[{key}]], not [{key}]"),
                ));
            }
            Some(other) => {
                return Err(self.fault(
                    key,
                    format!("expected an array of tables, found {}", other.describe()),
                ));
            }
        };
        let name = |i: usize| format!("{}.{i}", self.name(key));
        items
            .iter()
            .enumerate()
            .map(|(i, item)| Section::new(self.source, name(i), Some(item)))
            .collect()
    }

    pub fn f64(&mut self, key: &str, default: f64, bounds: Bounds) -> Result<f64> {
        let v = match self.get(key) {
            Some(node) => self.number(node, &self.name(key), bounds)?,
            None => default,
        };
        self.record(key, json!(v));
        Ok(v)
    }

    pub fn required_f64(&mut self, key: &str, bounds: Bounds) -> Result<f64> {
        self.require(key, &bounds)?;
        self.f64(key, 0.0, bounds)
    }

    pub fn u32(&mut self, key: &str, default: u32, low: u32, high: u32) -> Result<u32> {
        let wrong = |found: String| {
            self.fault(key, format!("expected an integer from {low} to {high}, found {found}"))
        };
        let v = match self.get(key).map(|node| &node.value) {
            None => default,
            Some(Value::Integer(i)) => u32::try_from(*i)
                .ok()
                .filter(|v| (low..=high).contains(v))
                .ok_or_else(|| wrong(i.to_string()))?,
            Some(other) => return Err(wrong(other.describe())),
        };
        self.record(key, json!(v));
        Ok(v)
    }

    pub fn bool(&mut self, key: &str, default: bool) -> Result<bool> {
        let v = match self.get(key).map(|node| &node.value) {
            None => default,
            Some(Value::Boolean(b)) => *b,
            Some(other) => {
                return Err(
                    self.fault(key, format!("expected true or false, found {}", other.describe()))
                );
            }
        };
        self.record(key, json!(v));
        Ok(v)
    }

    pub fn vec3(&mut self, key: &str, default: DVec3, bounds: Bounds) -> Result<DVec3> {
        Ok(DVec3::from_array(self.numbers(key, default.to_array(), bounds)?))
    }

    /// As many numbers as the default has, each within `bounds`.
    pub fn numbers<const N: usize>(
        &mut self,
        key: &str,
        default: [f64; N],
        bounds: Bounds,
    ) -> Result<[f64; N]> {
        let mut v = default;
        if let Some(node) = self.get(key) {
            let items = self.items::<N>(key, node, "numbers")?;
            for (i, item) in items.iter().enumerate() {
                v[i] = self.number(item, &format!("{}.{i}", self.name(key)), bounds)?;
            }
        }
        self.record(key, json!(v.as_slice()));
        Ok(v)
    }

    /// Two integers from `low` to `high`.
    pub fn u32_pair(
        &mut self,
        key: &str,
        default: [u32; 2],
        low: u32,
        high: u32,
    ) -> Result<[u32; 2]> {
        let mut v = default;
        if let Some(node) = self.get(key) {
            for (i, item) in self.items::<2>(key, node, "integers")?.iter().enumerate() {
                let found = match &item.value {
                    Value::Integer(found) => {
                        u32::try_from(*found).ok().filter(|n| (low..=high).contains(n))
                    }
                    _ => None,
                };
                let wrong = || {
                    let (name, found) = (self.name(key), item.value.describe());
                    let what = format!(
                        "`{name}.{i}`: expected an integer from {low} to {high}, found {found}"
                    );
                    Error::scene(self.source.place(item.origin), what)
                };
                v[i] = found.ok_or_else(wrong)?;
            }
        }
        self.record(key, json!(v));
        Ok(v)
    }

    fn items<const N: usize>(&self, key: &str, node: &'a Node, of: &str) -> Result<&'a [Node]> {
        const WORDS: [&str; 4] = ["no", "one", "two", "three"];
        match &node.value {
            Value::Array(items) if items.len() == N => Ok(items),
            other => {
                Err(self
                    .fault(key, format!("expected {} {of}, found {}", WORDS[N], other.describe())))
            }
        }
    }

    pub fn required_vec3(&mut self, key: &str, bounds: Bounds) -> Result<DVec3> {
        self.require(key, &"three numbers")?;
        self.vec3(key, DVec3::ZERO, bounds)
    }

    pub fn string(&mut self, key: &str, default: &str) -> Result<String> {
        let v = match self.get(key).map(|node| &node.value) {
            None => default.to_owned(),
            Some(Value::String(s)) => s.clone(),
            Some(other) => {
                return Err(
                    self.fault(key, format!("expected a string, found {}", other.describe()))
                );
            }
        };
        self.record(key, json!(v));
        Ok(v)
    }

    pub fn required_string(&mut self, key: &str) -> Result<String> {
        self.require(key, &"a string")?;
        let v = self.string(key, "")?;
        if v.is_empty() {
            Err(self.fault(key, "expected a string that is not empty"))
        } else {
            Ok(v)
        }
    }

    /// One of the names in `known`; one of `later` is told that it is yet to come.
    pub fn choice<T: Copy>(
        &mut self,
        key: &str,
        default: &str,
        known: &[(&str, T)],
        later: &[&str],
    ) -> Result<T> {
        let name = self.string(key, default)?;
        if let Some((_, value)) = known.iter().find(|(known, _)| *known == name) {
            return Ok(*value);
        }
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        Err(self.fault(
            key,
            if later.contains(&name.as_str()) {
                format!(
                    "`{name}` belongs to a later version of nimbus; this one knows {}",
                    list(&names)
                )
            } else {
                format!(
                    "unknown value `{}`{} known here: {}",
                    shown(&name),
                    suggestion(&name, &names),
                    list(&names)
                )
            },
        ))
    }

    pub fn required_choice<T: Copy>(
        &mut self,
        key: &str,
        known: &[(&str, T)],
        later: &[&str],
    ) -> Result<T> {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        self.require(key, &format!("one of {}", list(&names)))?;
        self.choice(key, "", known, later)
    }

    /// A key of which this version knows a single value, `only`; `why` says what it does.
    pub fn only(&mut self, key: &str, only: Json, why: &str) -> Result<()> {
        if let Some(node) = self.get(key) {
            let same = match &node.value {
                Value::String(s) => only.as_str() == Some(s),
                other => other.as_f64().is_some() && other.as_f64() == only.as_f64(),
            };
            if !same {
                let found = node.value.describe();
                return Err(self
                    .fault(key, format!("this version knows only {only} ({why}), found {found}")));
            }
        }
        self.record(key, only);
        Ok(())
    }

    /// An error where the key is not there.
    pub fn require(&self, key: &str, expected: &dyn fmt::Display) -> Result<()> {
        if self.has(key) {
            return Ok(());
        }
        Err(Error::scene(
            self.place(key),
            format!("missing key `{}`: expected {expected}", self.name(key)),
        ))
    }

    /// What was given for a key, whatever it is.
    pub fn value(&self, key: &str) -> Option<&'a Node> {
        self.get(key)
    }

    fn get(&self, key: &str) -> Option<&'a Node> {
        self.table?.get(key).map(|entry| &entry.node)
    }

    fn number(&self, node: &Node, name: &str, bounds: Bounds) -> Result<f64> {
        let fault = |what: String| {
            Error::scene(self.source.place(node.origin), format!("`{name}`: {what}"))
        };
        let Some(v) = node.value.as_f64() else {
            return Err(fault(format!("expected a number, found {}", node.value.describe())));
        };
        if bounds.contains(v) {
            Ok(v)
        } else {
            Err(fault(format!("expected {bounds}, found {v:?}")))
        }
    }
}

fn suggestion(typed: &str, known: &[&str]) -> String {
    let text = did_you_mean(typed, known);
    if text.is_empty() { ";".to_owned() } else { text }
}
