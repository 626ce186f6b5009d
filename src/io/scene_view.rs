//! A view saved as a scene: the file that it was opened from, with the settings made since laid
//! over its text. All other text stays as it was, comments and order included. Names of files are
//! made relative to the folder that the scene is saved to.

use std::io::Write;
use std::path::{Path, PathBuf};

use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

use super::atomic::{folder_of, write_atomic};
use super::document::overrides::{is_word, parts};
use super::document::tree::Document;
use super::scene_keys::{DEFAULT_LIGHTS, DEFAULT_MATERIAL, KEY_NAMES, add_defaults};
use super::text_file::{SCENE_LIMIT, read_text};
use crate::error::{Error, Result};

/// Writes to `to`, which must not exist, the scene at `from` with `overrides` (`key.path=VALUE`, as
/// `--set` has them) and, with `seed` N, cloud i's seed N + i. The saved scene is the one that
/// `from` is with these overrides and seeds.
///
/// # Errors
/// When `from` cannot be read, an override does not fit, or `to` exists or cannot be written.
pub fn save(from: &Path, to: &Path, overrides: &[String], seed: Option<u32>) -> Result<()> {
    let text = text_of(from, to, overrides, seed)?;
    if to.symlink_metadata().is_ok() {
        return Err(Error::io(to, "exists already"));
    }
    write_atomic(to, |file| file.write_all(text.as_bytes()))
}

/// Returns the text that [`save`] writes. The folder of `to` must exist, `to` need not.
///
/// # Errors
/// As [`save`], but for writing.
pub fn text_of(from: &Path, to: &Path, overrides: &[String], seed: Option<u32>) -> Result<String> {
    let text = read_text(from, SCENE_LIMIT, "a scene's tables, such as [camera] and [[cloud]]")?;
    // A fault gives the message that `--set` gives.
    let mut document = Document::parse(text.clone(), from)?;
    add_defaults(&mut document);
    document.source.names = KEY_NAMES;
    document.apply(overrides)?;
    let fault = |what: String| Error::io(from, format!("cannot be saved otherwise: {what}"));
    let mut edited: DocumentMut =
        text.parse().map_err(|e: toml_edit::TomlError| fault(e.message().to_owned()))?;
    let seeds = seed.map_or(vec![], |seed| seeds(&mut edited, seed));
    for text in overrides.iter().chain(&seeds) {
        let (segments, value) = parts(text).ok_or_else(|| fault(format!("{text} sets nothing")))?;
        set(&mut edited, &segments, &value_of(value).map_err(fault)?).map_err(fault)?;
    }
    let (old, new) = (canonical_folder(from)?, canonical_folder(to)?);
    if old != new {
        move_files(&mut edited, &old, &new)?;
    }
    let saved = edited.to_string();
    // Lines keep their ends.
    let is_crlf = text.contains('\n') && text.matches('\n').count() == text.matches("\r\n").count();
    Ok(if is_crlf { saved.replace("\r\n", "\n").replace('\n', "\r\n") } else { saved })
}

fn seeds(document: &mut DocumentMut, seed: u32) -> Vec<String> {
    let n = items(document, "cloud").len() as u32;
    // Seeds wrap around, as they do when a scene is read.
    (0..n).map(|i| format!("cloud.{i}.seed={}", seed.wrapping_add(i))).collect()
}

fn value_of(text: &str) -> std::result::Result<Value, String> {
    match text.parse::<Value>() {
        Ok(mut value) => {
            value.decor_mut().clear();
            Ok(value)
        }
        Err(_) if is_word(text) => Ok(Value::from(text)),
        Err(e) => Err(e.to_string()),
    }
}

type Done = std::result::Result<(), String>;

/// Lays a value over the scene and over its phases, whose values would otherwise win.
fn set(document: &mut DocumentMut, segments: &[&str], value: &Value) -> Done {
    for (name, default) in [("light", DEFAULT_LIGHTS), ("material", DEFAULT_MATERIAL)] {
        // The path leads into the lights or the material of a scene that has none.
        if segments.len() > 1 && segments[0] == name && !document.contains_key(name) {
            let default: DocumentMut =
                default.parse().map_err(|e: toml_edit::TomlError| e.to_string())?;
            document.extend(default.iter().map(|(key, item)| (key.to_owned(), item.clone())));
        }
    }
    put(Part::Table(document.as_table_mut()), segments, value)?;
    for phase in phases(document) {
        let Some(of_phase) = phase.get_mut("set") else { continue };
        if over_phase(of_phase, &[], segments, value)?
            && let Some(table) = of_phase.as_table_like_mut()
        {
            table.insert(&segments.join("."), Item::Value(value.clone()));
        }
    }
    Ok(())
}

/// A part of a document, without regard to how it is written.
enum Part<'a> {
    Table(&'a mut (dyn TableLike + 'a)),
    Array(Vec<Part<'a>>),
    /// Any value; `open` tells tables and arrays apart.
    Value(&'a mut Value),
}

impl<'a> Part<'a> {
    fn of(item: &'a mut Item) -> Option<Part<'a>> {
        match item {
            Item::None => None,
            Item::Value(value) => Some(Part::Value(value)),
            Item::Table(table) => Some(Part::Table(table)),
            Item::ArrayOfTables(tables) => {
                Some(Part::Array(tables.iter_mut().map(|table| Part::Table(table)).collect()))
            }
        }
    }

    fn open(self) -> Part<'a> {
        match self {
            Part::Value(Value::InlineTable(table)) => Part::Table(table),
            Part::Value(Value::Array(values)) => {
                Part::Array(values.iter_mut().map(Part::Value).collect())
            }
            other => other,
        }
    }

    fn into_table(self) -> Option<&'a mut (dyn TableLike + 'a)> {
        match self.open() {
            Part::Table(table) => Some(table),
            _ => None,
        }
    }
}

fn phases(document: &mut DocumentMut) -> Vec<&mut (dyn TableLike + '_)> {
    items(document, "phase").into_iter().filter_map(Part::into_table).collect()
}

/// Returns the items of an array of the document; none where it has no such array.
fn items<'a>(document: &'a mut DocumentMut, key: &str) -> Vec<Part<'a>> {
    match document.get_mut(key).and_then(Part::of).map(Part::open) {
        Some(Part::Array(items)) => items,
        _ => Vec::new(),
    }
}

/// Puts a value at `segments` below a part.
fn put(part: Part<'_>, segments: &[&str], value: &Value) -> Done {
    let Some((first, rest)) = segments.split_first() else {
        let Part::Value(old) = part else { return Err("a table is no value".to_owned()) };
        // The space before the value and the comment behind it stay.
        let decor = old.decor().clone();
        *old = value.clone();
        *old.decor_mut() = decor;
        return Ok(());
    };
    match part.open() {
        Part::Value(_) => Err(format!("a value holds no {first}")),
        Part::Array(mut parts) => {
            let n = parts.len();
            let i = first.parse().ok().filter(|i| *i < n);
            if i.is_none() && *first != "*" {
                return Err(format!("there are {n} items, and no {first}"));
            }
            let picked = parts.drain(i.map_or(0..n, |i| i..i + 1));
            picked.into_iter().try_for_each(|part| put(part, rest, value))
        }
        Part::Table(table) => {
            if let Some(item) = table.get_mut(first) {
                return put_item(item, rest, value);
            }
            let mut new = Item::Value(value.clone());
            if !rest.is_empty() {
                let mut table = Table::new();
                table.decor_mut().set_prefix("\n");
                put(Part::Table(&mut table), rest, value)?;
                new = Item::Table(table);
            }
            table.insert(first, new);
            Ok(())
        }
    }
}

/// Puts a value at `segments` below an item, or in its place.
fn put_item(item: &mut Item, segments: &[&str], value: &Value) -> Done {
    match Part::of(item) {
        Some(part) if !segments.is_empty() || matches!(part, Part::Value(_)) => {
            put(part, segments, value)
        }
        _ => {
            *item = Item::Value(value.clone());
            Ok(())
        }
    }
}

/// Changes the values that a phase sets where `segments` lead to them. `item` is at `at` below the
/// phase's `set`. Returns true if the phase sets the value for several items of an array together
/// and `segments` lead to one of them.
fn over_phase(
    item: &mut Item,
    at: &[String],
    segments: &[&str],
    value: &Value,
) -> std::result::Result<bool, String> {
    let Some(table) = item.as_table_like_mut() else { return Ok(false) };
    let keys: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).collect();
    let mut is_of_several = false;
    for key in keys {
        let Some(item) = table.get_mut(&key) else { continue };
        // A key in quotes may be a whole path.
        let at: Vec<String> = at.iter().cloned().chain(key.split('.').map(str::to_owned)).collect();
        if item.is_table_like() {
            is_of_several |= over_phase(item, &at, segments, value)?;
            continue;
        }
        let same = |(own, asked): (&String, &&str)| {
            let is_number = |s: &str| s.parse::<usize>().is_ok();
            own == asked || (*asked == "*" && is_number(own)) || (own == "*" && is_number(asked))
        };
        if !at.iter().zip(segments).all(same) {
            continue;
        }
        if at.len() > segments.len() {
            // The value that holds this one is replaced.
            table.remove(&key);
        } else if at.iter().zip(segments).any(|(own, asked)| own == "*" && *asked != "*") {
            is_of_several = true;
        } else {
            put_item(item, &segments[at.len()..], value)?;
        }
    }
    Ok(is_of_several)
}

/// Returns the canonical name of the folder that names in a scene at `path` are relative to.
fn canonical_folder(path: &Path) -> Result<PathBuf> {
    let folder = folder_of(path);
    folder
        .canonicalize()
        .map_err(|e| Error::io(path, format!("its folder {}: {e}", folder.display())))
}

/// Makes names of files relative to `new` in place of `old`, in the scene and in its phases.
fn move_files(document: &mut DocumentMut, old: &Path, new: &Path) -> Result<()> {
    let mut moved = |value: &mut Value| -> Result<()> {
        let Some(name) = value.as_str().filter(|name| Path::new(name).is_relative()) else {
            return Ok(());
        };
        let name = relative(&old.join(name), new)?;
        put(Part::Value(value), &[], &Value::from(name)).map_err(|what| Error::io(new, what))
    };
    each_file(Part::Table(document.as_table_mut()), &[], &mut moved)?;
    for phase in phases(document) {
        if let Some(of_phase) = phase.get_mut("set").and_then(Part::of) {
            each_file(of_phase, &[], &mut moved)?;
        }
    }
    Ok(())
}

/// Calls `on` with every `cloud.*.file` below a part, which is at `at`.
fn each_file(
    part: Part<'_>,
    at: &[String],
    on: &mut dyn FnMut(&mut Value) -> Result<()>,
) -> Result<()> {
    match part.open() {
        Part::Table(table) => table.iter_mut().try_for_each(|(key, item)| {
            // A key in quotes may be a whole path.
            let at: Vec<String> =
                at.iter().cloned().chain(key.get().split('.').map(str::to_owned)).collect();
            Part::of(item).map_or(Ok(()), |part| each_file(part, &at, on))
        }),
        Part::Array(parts) => parts
            .into_iter()
            .enumerate()
            .try_for_each(|(i, part)| each_file(part, &[at, &[i.to_string()]].concat(), on)),
        Part::Value(value) if at.len() == 3 && at[0] == "cloud" && at[2] == "file" => on(value),
        Part::Value(_) => Ok(()),
    }
}

/// Returns the name of `file` relative to the folder `from`, a canonical name. Parts are separated
/// by slashes, which every system reads.
fn relative(file: &Path, from: &Path) -> Result<String> {
    let fault = |what: String| Error::io(file, what);
    let name = file.file_name().ok_or_else(|| fault("expected a file name".to_owned()))?;
    let folder = canonical_folder(file)?;
    let parts =
        |path: &Path| path.components().map(|c| c.as_os_str().to_owned()).collect::<Vec<_>>();
    let (folder_parts, from_parts) = (parts(&folder), parts(from));
    let n_shared = folder_parts.iter().zip(&from_parts).take_while(|(a, b)| a == b).count();
    let text = |part: &std::ffi::OsStr| part.to_str().map(str::to_owned);
    let unnamed = || fault("its path is no text that a scene could have".to_owned());
    // Only an absolute name leads to another drive.
    if n_shared == 0 {
        return text(folder.join(name).as_os_str()).ok_or_else(unnamed);
    }
    let up = from_parts[n_shared..].iter().map(|_| Some("..".to_owned()));
    let down = folder_parts[n_shared..].iter().map(|part| text(part)).chain([text(name)]);
    up.chain(down).collect::<Option<Vec<String>>>().map(|parts| parts.join("/")).ok_or_else(unnamed)
}
