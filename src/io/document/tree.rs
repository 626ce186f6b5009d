//! A TOML document as a tree in which every key and every value knows where it came from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value as Json, json};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::depth::too_deep;
use super::other_files;
use super::suggest::cut;
use crate::error::{Error, Place, Result};
use crate::io::text_file::{self, line_column};

/// A scene file, as it is or with `--set` arguments laid over it.
#[derive(Clone)]
pub struct Document {
    /// Texts that origins point into.
    pub source: Source,
    /// Outermost table.
    pub root: Node,
}

/// Message about a key that [`too_deep`] finds.
pub const TOO_DEEP: &str = "no key of nimbus has this many dots";
/// Most characters of an override that an error names: those of long paths, and not a whole list.
const LONGEST_OVERRIDE: usize = 500;
/// Message about an integer of more than 127 bits, which no key takes.
pub const TOO_LARGE: &str = "the integer is too large";

/// Texts that origins point into.
#[derive(Clone)]
pub struct Source {
    /// Name of the file in messages.
    pub path: PathBuf,
    /// Content of the file.
    pub text: String,
    /// `--set` arguments as typed.
    pub overrides: Vec<String>,
    /// Names of the keys that the reader of the document knows.
    pub names: KeyNames,
}

/// Keys that set the kind of a table, which its other keys follow from.
const KIND_KEYS: [&str; 2] = ["kind", "from"];

/// Names of keys, for messages about a key that is unknown at its place.
#[derive(Clone, Copy)]
pub struct KeyNames {
    /// Returns a sentence about the keys that may be meant by the unknown key of this path.
    pub hint: fn(&str) -> Option<String>,
    /// Returns whether a table of a kind, or of any kind, has a key. The table's name is its path
    /// without numbers of items, such as `light`.
    pub has: fn(&str, Option<&str>, &str) -> bool,
}

impl KeyNames {
    /// No names.
    pub const NONE: KeyNames = KeyNames { hint: |_| None, has: |_, _, _| false };

    /// Returns whether the table at `path` can have the key, as far as its kind allows.
    pub fn can_have(&self, path: &str, table: &Table, key: &str) -> bool {
        let kind = kind_of(table).and_then(|(_, node)| match &node.value {
            Value::String(kind) => Some(kind.as_str()),
            _ => None,
        });
        (self.has)(&without_numbers(path), kind, key)
    }

    /// Returns whether a table at `path` of some kind has the key.
    pub fn has_for_a_kind(&self, path: &str, key: &str) -> bool {
        (self.has)(&without_numbers(path), None, key)
    }
}

/// Returns the key that sets the kind of a table, with its value.
pub fn kind_of(table: &Table) -> Option<(&'static str, &Node)> {
    KIND_KEYS.iter().find_map(|key| table.get(*key).map(|entry| (*key, &entry.node)))
}

/// Returns a path without its numbers of items: `light.0` becomes `light`.
pub fn without_numbers(path: &str) -> String {
    let is_name = |segment: &&str| segment.parse::<usize>().is_err();
    path.split('.').filter(is_name).collect::<Vec<_>>().join(".")
}

/// Origin of a key or a value. Lines and columns are found only for a message, because a tree has
/// an origin for every value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// Byte offset in the file.
    File(usize),
    /// Number of the `--set` argument.
    Override(usize),
    /// A default that the scene does not set.
    Default,
}

/// A value and its origin.
#[derive(Debug, Clone)]
pub struct Node {
    pub origin: Origin,
    pub value: Value,
}

/// A TOML value.
#[derive(Debug, Clone)]
pub enum Value {
    String(String),
    Integer(i128),
    Float(f64),
    Boolean(bool),
    /// A date or a time, which no key takes.
    Datetime,
    Array(Vec<Node>),
    Table(Table),
}

/// A TOML table.
pub type Table = BTreeMap<String, Entry>;

/// A value of a table and the origin of its key.
#[derive(Debug, Clone)]
pub struct Entry {
    pub key_origin: Origin,
    pub node: Node,
}

impl Document {
    /// Reads a scene file.
    ///
    /// # Errors
    /// When the file cannot be read or is no TOML.
    pub fn read(path: &Path) -> Result<Document> {
        let first = "a scene's tables, such as [camera] and [[cloud]]";
        let mut is_numbers = false;
        let read = text_file::read_text(path, text_file::SCENE_LIMIT, first).and_then(|text| {
            is_numbers = other_files::begins_with_number(&text);
            Document::parse(text, path)
        });
        read.map_err(|error| match other_files::remark(path, is_numbers) {
            Some(remark) if path.is_file() => error.with_note(&remark),
            _ => error,
        })
    }

    /// Parses the text of a scene file; `path` is its name in messages.
    ///
    /// # Errors
    /// When the text is no TOML, with the place.
    pub fn parse(text: String, path: &Path) -> Result<Document> {
        let (path, overrides) = (path.to_owned(), Vec::new());
        let source = Source { path, text, overrides, names: KeyNames::NONE };
        if let Some(offset) = too_deep(&source.text) {
            return Err(source.fault(Origin::File(offset), TOO_DEEP));
        }
        let table = DeTable::parse(&source.text).map_err(|e| {
            source.fault(Origin::File(e.span().map_or(0, |span| span.start)), e.message())
        })?;
        let table = convert_table(table.get_ref(), &Origin::File);
        let value = Value::Table(table.map_err(|origin| source.fault(origin, TOO_LARGE))?);
        Ok(Document { source, root: Node { origin: Origin::File(0), value } })
    }

    /// Returns the node at `path`, whose segments are keys.
    pub fn at(&self, path: &[&str]) -> Option<&Node> {
        path.iter().try_fold(&self.root, |node, key| match &node.value {
            Value::Table(table) => table.get(*key).map(|entry| &entry.node),
            _ => None,
        })
    }

    /// Adds `key` as the text `toml` defines it, unless the document has the key.
    ///
    /// # Panics
    /// When `toml`, a constant, is no TOML.
    pub fn default_to(&mut self, key: &str, toml: &str) {
        let Value::Table(root) = &mut self.root.value else { return };
        if !root.contains_key(key) {
            let table =
                DeTable::parse(toml).expect("the defaults are constants that a test parses");
            let table = convert_table(table.get_ref(), &|_| Origin::Default);
            root.extend(table.unwrap_or_default().into_iter().filter(|(name, _)| name == key));
        }
    }
}

impl Source {
    /// Returns a complaint about what stands at `origin`.
    pub fn fault(&self, origin: Origin, what: impl Into<String>) -> Error {
        Error::scene(self.place(origin), what)
    }

    /// Returns where an origin is, for a message.
    pub fn place(&self, origin: Origin) -> Place {
        match origin {
            Origin::File(offset) => {
                let (line, column) = line_column(&self.text, offset);
                Place::line(&self.path, line, column)
            }
            Origin::Override(i) => Place {
                source: format!("--set {}", cut(&self.overrides[i], LONGEST_OVERRIDE)),
                line: 0,
                column: 0,
            },
            Origin::Default => Place::file(&self.path),
        }
    }
}

impl Value {
    /// Describes the value for a message: its type, and itself where it is short.
    pub fn describe(&self) -> String {
        match self {
            Value::String(s) if s.chars().count() <= 40 => format!("string {s:?}"),
            Value::String(_) => "string".to_owned(),
            Value::Integer(i) => format!("integer {i}"),
            Value::Float(f) => format!("float {f:?}"),
            Value::Boolean(b) => format!("boolean {b}"),
            Value::Datetime => "date-time".to_owned(),
            Value::Array(list) => format!("array of {}", list.len()),
            Value::Table(_) => "table".to_owned(),
        }
    }

    /// Returns the value as JSON. Integers beyond 64 bits and dates become strings.
    pub fn json(&self) -> Json {
        match self {
            Value::String(s) => json!(s),
            Value::Integer(i) => {
                i64::try_from(*i).map_or_else(|_| json!(i.to_string()), Json::from)
            }
            Value::Float(f) => json!(f),
            Value::Boolean(b) => json!(b),
            Value::Datetime => json!("date-time"),
            Value::Array(items) => items.iter().map(|item| item.value.json()).collect(),
            Value::Table(table) => {
                table.iter().map(|(key, entry)| (key.clone(), entry.node.value.json())).collect()
            }
        }
    }

    /// Returns whether both are the same string or number, or this one is a float of the number
    /// `other`.
    pub fn is_same(&self, other: &Value) -> bool {
        match (self, other) {
            (Value::String(a), Value::String(b)) => a == b,
            (Value::Integer(a), Value::Integer(b)) => a == b,
            (Value::Float(a), b) => b.as_f64() == Some(*a),
            _ => false,
        }
    }

    /// Returns whether the value is a number or an array.
    pub fn is_number_or_list(&self) -> bool {
        matches!(self, Value::Integer(_) | Value::Float(_) | Value::Array(_))
    }

    /// Returns the value as a number, if it is one.
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Value::Integer(i) => Some(*i as f64),
            Value::Float(f) => Some(*f),
            _ => None,
        }
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Value {
        Value::String(text.to_owned())
    }
}

impl From<u32> for Value {
    fn from(n: u32) -> Value {
        Value::Integer(n.into())
    }
}

impl From<f64> for Value {
    fn from(v: f64) -> Value {
        Value::Float(v)
    }
}

impl From<bool> for Value {
    fn from(flag: bool) -> Value {
        Value::Boolean(flag)
    }
}

impl<T: Into<Value>, const N: usize> From<[T; N]> for Value {
    fn from(items: [T; N]) -> Value {
        let node = |item: T| Node { origin: Origin::Default, value: item.into() };
        Value::Array(items.into_iter().map(node).collect())
    }
}

/// Converts a parsed value. The error is the origin of an integer that is [`TOO_LARGE`].
pub fn convert(
    spanned: &Spanned<DeValue<'_>>,
    origin_of: &dyn Fn(usize) -> Origin,
) -> std::result::Result<Node, Origin> {
    let origin = origin_of(spanned.span().start);
    let value = match spanned.get_ref() {
        DeValue::String(s) => Value::String(s.to_string()),
        DeValue::Integer(i) => {
            Value::Integer(i128::from_str_radix(i.as_str(), i.radix()).map_err(|_| origin)?)
        }
        // A float that Rust does not read would become NaN, which every key refuses.
        DeValue::Float(f) => Value::Float(f.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(b) => Value::Boolean(*b),
        DeValue::Datetime(_) => Value::Datetime,
        DeValue::Array(list) => Value::Array(
            list.iter()
                .map(|item| convert(item, origin_of))
                .collect::<std::result::Result<_, _>>()?,
        ),
        DeValue::Table(table) => Value::Table(convert_table(table, origin_of)?),
    };
    Ok(Node { origin, value })
}

fn convert_table(
    table: &DeTable<'_>,
    origin_of: &dyn Fn(usize) -> Origin,
) -> std::result::Result<Table, Origin> {
    let mut converted = Table::new();
    for (key, value) in table {
        let (key_origin, node) = (origin_of(key.span().start), convert(value, origin_of)?);
        converted.insert(key.get_ref().to_string(), Entry { key_origin, node });
    }
    Ok(converted)
}
