//! A TOML document as a tree in which every key and every value knows where it came from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::suggest::shown;
use super::text_file::{self, line_column};
use super::toml_depth::too_deep;
use crate::error::{Error, Place, Result};

#[derive(Clone)]
pub struct Document {
    pub source: Source,
    pub root: Node,
}

/// Said of a key that [`too_deep`] finds.
pub const TOO_DEEP: &str = "no key of nimbus has this many dots";

/// What origins point into.
#[derive(Clone)]
pub struct Source {
    pub path: PathBuf,
    pub text: String,
    /// The `--set` arguments, as typed.
    pub overrides: Vec<String>,
}

/// Small, since a tree has one a value: a line and a column are worked out only for a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// Byte offset in the file.
    File(usize),
    /// Number of the `--set` argument.
    Override(usize),
    /// What a scene has that does not say otherwise.
    Default,
}

#[derive(Debug, Clone)]
pub struct Node {
    pub origin: Origin,
    pub value: Value,
}

#[derive(Debug, Clone)]
pub enum Value {
    String(String),
    Integer(i128),
    Float(f64),
    Boolean(bool),
    Datetime,
    Array(Vec<Node>),
    Table(Table),
}

pub type Table = BTreeMap<String, Entry>;

#[derive(Debug, Clone)]
pub struct Entry {
    pub key_origin: Origin,
    pub node: Node,
}

impl Document {
    pub fn read(path: &Path) -> Result<Document> {
        Document::parse(
            text_file::read_text(
                path,
                text_file::SCENE_LIMIT,
                "a scene's tables, such as [camera] and [[cloud]]",
            )?,
            path,
        )
    }

    pub fn parse(text: String, path: &Path) -> Result<Document> {
        let source = Source { path: path.to_owned(), text, overrides: Vec::new() };
        if let Some(offset) = too_deep(&source.text) {
            return Err(Error::scene(source.place(Origin::File(offset)), TOO_DEEP));
        }
        let root = match DeTable::parse(&source.text) {
            Ok(table) => convert_table(table.get_ref(), &Origin::File),
            Err(e) => {
                let at = source.place(Origin::File(e.span().map_or(0, |span| span.start)));
                return Err(Error::scene(at, e.message()));
            }
        };
        let root = root.map(|table| Node { origin: Origin::File(0), value: Value::Table(table) });
        match root {
            Ok(root) => Ok(Document { source, root }),
            Err(OutOfRange(origin)) => Err(Error::scene(source.place(origin), OutOfRange::WHAT)),
        }
    }

    /// What lies at `path`, whose segments are keys.
    pub fn at(&self, path: &[&str]) -> Option<&Node> {
        path.iter().try_fold(&self.root, |node, key| match &node.value {
            Value::Table(table) => table.get(*key).map(|entry| &entry.node),
            _ => None,
        })
    }

    /// Gives the document `key` from `toml` (text of ours, which defines nothing else) if it has
    /// none.
    pub fn default_to(&mut self, key: &str, toml: &str) {
        let Value::Table(root) = &mut self.root.value else { return };
        if root.contains_key(key) {
            return;
        }
        let table = DeTable::parse(toml).expect("the defaults are constants that a test parses");
        let table = convert_table(table.get_ref(), &|_| Origin::Default);
        root.extend(table.unwrap_or_default().into_iter().filter(|(name, _)| name == key));
    }
}

impl Source {
    pub fn place(&self, origin: Origin) -> Place {
        match origin {
            Origin::File(offset) => {
                let (line, column) = line_column(&self.text, offset);
                Place::line(&self.path, line, column)
            }
            Origin::Override(i) => {
                Place { source: format!("--set {}", shown(&self.overrides[i])), line: 0, column: 0 }
            }
            Origin::Default => Place::file(&self.path),
        }
    }
}

impl Value {
    /// The value in a message: its type, and itself where it is short.
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

    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Value::Integer(i) => Some(*i as f64),
            Value::Float(f) => Some(*f),
            _ => None,
        }
    }
}

/// An integer of more than 127 bits: no key takes one.
#[derive(Debug)]
pub struct OutOfRange(pub Origin);

impl OutOfRange {
    pub const WHAT: &'static str = "the integer is too large";
}

pub fn convert(
    spanned: &Spanned<DeValue<'_>>,
    origin_of: &dyn Fn(usize) -> Origin,
) -> std::result::Result<Node, OutOfRange> {
    let origin = origin_of(spanned.span().start);
    let value = match spanned.get_ref() {
        DeValue::String(s) => Value::String(s.to_string()),
        DeValue::Integer(i) => Value::Integer(
            i128::from_str_radix(i.as_str(), i.radix()).map_err(|_| OutOfRange(origin))?,
        ),
        // Text that toml took for a float and Rust does not would be a NaN, which every reader
        // refuses.
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
) -> std::result::Result<Table, OutOfRange> {
    let entry = |(key, value): (&Spanned<_>, &Spanned<DeValue<'_>>)| {
        let key: &Spanned<std::borrow::Cow<'_, str>> = key;
        let entry =
            Entry { key_origin: origin_of(key.span().start), node: convert(value, origin_of)? };
        Ok((key.get_ref().to_string(), entry))
    };
    table.iter().map(entry).collect()
}
