//! A view saved as a scene: the file that it was opened from, with what was set since laid over its
//! text. What was not set stays as it was written, comments and order included; names of files are
//! made right for the folder that it is saved to.

use std::io::Write;
use std::path::{Path, PathBuf};

use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

use super::atomic::write_atomic;
use super::scene_lights::{DEFAULT_LIGHTS, DEFAULT_MATERIAL};
use super::text_file::{SCENE_LIMIT, read_text};
use super::toml_override::is_word;
use super::toml_tree::Document;
use crate::error::{Error, Result};

/// Writes to `to`, which must not exist, the scene at `from` with `overrides` (`key.path=VALUE`, as
/// `--set` has them) and, with `seed` N, cloud i's seed N + i. Loaded without any it is the scene
/// that `from` is with them.
pub fn save(from: &Path, to: &Path, overrides: &[String], seed: Option<u32>) -> Result<()> {
    let text = text_of(from, to, overrides, seed)?;
    if to.symlink_metadata().is_ok() {
        return Err(Error::io(to, "exists already"));
    }
    write_atomic(to, |file| file.write_all(text.as_bytes()))
}

/// What [`save`] writes. `to` need not be there; its folder has to.
pub fn text_of(from: &Path, to: &Path, overrides: &[String], seed: Option<u32>) -> Result<String> {
    let text = read_text(from, SCENE_LIMIT, "a scene's tables, such as [camera] and [[cloud]]")?;
    // What is wrong is said as whoever typed it would be told.
    let mut document = Document::parse(text.clone(), from)?;
    document.default_to("light", DEFAULT_LIGHTS);
    document.default_to("material", DEFAULT_MATERIAL);
    document.apply(overrides)?;
    let fault = |what: String| Error::io(from, format!("cannot be saved otherwise: {what}"));
    let mut edited: DocumentMut =
        text.parse().map_err(|e: toml_edit::TomlError| fault(e.message().to_owned()))?;
    let seeds = seed.map_or(vec![], |seed| seeds(&edited, seed));
    for text in overrides.iter().chain(&seeds) {
        let (path, value) =
            text.split_once('=').ok_or_else(|| fault(format!("{text} sets nothing")))?;
        let segments: Vec<&str> = path.split('.').map(str::trim).collect();
        set(&mut edited, &segments, &value_of(value.trim()).map_err(fault)?).map_err(fault)?;
    }
    let (old, new) = (folder_of(from)?, folder_of(to)?);
    if old != new {
        move_files(&mut edited, &old, &new)?;
    }
    let saved = edited.to_string();
    // Lines end as they did.
    let is_crlf = text.contains('\n') && text.matches('\n').count() == text.matches("\r\n").count();
    Ok(if is_crlf { saved.replace("\r\n", "\n").replace('\n', "\r\n") } else { saved })
}

fn seeds(document: &DocumentMut, seed: u32) -> Vec<String> {
    let n = match document.get("cloud") {
        Some(Item::ArrayOfTables(clouds)) => clouds.len(),
        Some(Item::Value(Value::Array(clouds))) => clouds.len(),
        _ => 0,
    };
    // With wrap-around, as they are numbered where they are read.
    (0..n as u32).map(|i| format!("cloud.{i}.seed={}", seed.wrapping_add(i))).collect()
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

/// Lays a value over the scene and its phases, which otherwise would lay theirs over it.
fn set(document: &mut DocumentMut, segments: &[&str], value: &Value) -> Done {
    for (name, default) in [("light", DEFAULT_LIGHTS), ("material", DEFAULT_MATERIAL)] {
        // What is set is of those that a scene without any has.
        if segments.len() > 1 && segments[0] == name && !document.contains_key(name) {
            let default: DocumentMut =
                default.parse().map_err(|e: toml_edit::TomlError| e.to_string())?;
            document.extend(default.iter().map(|(key, item)| (key.to_owned(), item.clone())));
        }
    }
    put_in_table(document.as_table_mut(), segments, value)?;
    for phase in items(document.get_mut("phase")) {
        let Some(of_phase) = phase.get_mut("set") else { continue };
        if over_phase(of_phase, &[], segments, value)?
            && let Some(table) = of_phase.as_table_like_mut()
        {
            table.insert(&segments.join("."), Item::Value(value.clone()));
        }
    }
    Ok(())
}

/// The tables of an array of tables, however it is written.
fn items(array: Option<&mut Item>) -> Vec<&mut dyn TableLike> {
    match array {
        Some(Item::ArrayOfTables(tables)) => {
            tables.iter_mut().map(|t| t as &mut dyn TableLike).collect()
        }
        Some(Item::Value(Value::Array(values))) => values
            .iter_mut()
            .filter_map(|v| v.as_inline_table_mut().map(|t| t as &mut dyn TableLike))
            .collect(),
        _ => vec![],
    }
}

/// `toml_override::put`, of text.
fn put(item: &mut Item, segments: &[&str], value: &Value) -> Done {
    match item {
        Item::ArrayOfTables(tables) if !segments.is_empty() => {
            for i in picked(segments[0], tables.len())? {
                match (tables.get_mut(i), segments.len()) {
                    (Some(table), 2..) => put_in_table(table, &segments[1..], value)?,
                    _ => return Err(format!("{} is a table", segments[0])),
                }
            }
            Ok(())
        }
        Item::Value(old) => put_in_value(old, segments, value),
        _ if segments.is_empty() => {
            *item = Item::Value(value.clone());
            Ok(())
        }
        _ => match item.as_table_like_mut() {
            Some(table) => put_in_table(table, segments, value),
            None => Err(format!("nothing holds {}", segments[0])),
        },
    }
}

fn put_in_value(old: &mut Value, segments: &[&str], value: &Value) -> Done {
    match (old, segments) {
        (old, []) => {
            // The space before it, and the comment behind.
            let decor = old.decor().clone();
            *old = value.clone();
            *old.decor_mut() = decor;
            Ok(())
        }
        (Value::InlineTable(table), _) => put_in_table(table, segments, value),
        (Value::Array(values), [first, rest @ ..]) => {
            for i in picked(first, values.len())? {
                values.get_mut(i).map_or(Ok(()), |old| put_in_value(old, rest, value))?;
            }
            Ok(())
        }
        (_, [first, ..]) => Err(format!("a value holds no {first}")),
    }
}

fn put_in_table(table: &mut dyn TableLike, segments: &[&str], value: &Value) -> Done {
    let Some((first, rest)) = segments.split_first() else {
        return Err("a table is no value".to_owned());
    };
    if let Some(item) = table.get_mut(first) {
        return put(item, rest, value);
    }
    if rest.is_empty() {
        table.insert(first, Item::Value(value.clone()));
        return Ok(());
    }
    let mut new = Table::new();
    new.decor_mut().set_prefix("\n");
    put_in_table(&mut new, rest, value)?;
    table.insert(first, Item::Table(new));
    Ok(())
}

/// Which of `n` items a segment means.
fn picked(segment: &str, n: usize) -> std::result::Result<Vec<usize>, String> {
    match segment.parse::<usize>() {
        _ if segment == "*" => Ok((0..n).collect()),
        Ok(i) if i < n => Ok(vec![i]),
        _ => Err(format!("there are {n} items, and no {segment}")),
    }
}

/// Changes what a phase sets (`item`, at `at` below its `set`) where it is what `segments` mean;
/// true where the phase sets that for several items together, and `segments` mean one of them.
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
            // The whole that it is of is set anew.
            table.remove(&key);
        } else if at.iter().zip(segments).any(|(own, asked)| own == "*" && *asked != "*") {
            is_of_several = true;
        } else {
            put(item, &segments[at.len()..], value)?;
        }
    }
    Ok(is_of_several)
}

/// The folder that names in a scene at `path` are relative to, by its true name.
fn folder_of(path: &Path) -> Result<PathBuf> {
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    folder
        .canonicalize()
        .map_err(|e| Error::io(path, format!("its folder {}: {e}", folder.display())))
}

/// Names of files relative to `old` become relative to `new`, in the scene and in what its phases
/// set.
fn move_files(document: &mut DocumentMut, old: &Path, new: &Path) -> Result<()> {
    let mut moved = |value: &mut Value| -> Result<()> {
        let Some(name) = value.as_str().filter(|name| Path::new(name).is_relative()) else {
            return Ok(());
        };
        let name = relative(&old.join(name), new)?;
        put_in_value(value, &[], &Value::from(name)).map_err(|what| Error::io(new, what))
    };
    each_file(document.as_item_mut(), &mut vec![], &mut moved)?;
    for phase in items(document.get_mut("phase")) {
        if let Some(of_phase) = phase.get_mut("set") {
            each_file(of_phase, &mut vec![], &mut moved)?;
        }
    }
    Ok(())
}

type OnFile<'a> = &'a mut dyn FnMut(&mut Value) -> Result<()>;

/// `cloud.*.file` below `item`, which lies at `at`.
fn each_file(item: &mut Item, at: &mut Vec<String>, on: OnFile<'_>) -> Result<()> {
    match item {
        Item::Value(value) => each_file_of_value(value, at, on),
        Item::ArrayOfTables(tables) => tables.iter_mut().enumerate().try_for_each(|(i, table)| {
            at.push(i.to_string());
            let done = each_file_of_table(table, at, on);
            at.pop();
            done
        }),
        Item::Table(table) => each_file_of_table(table, at, on),
        Item::None => Ok(()),
    }
}

fn each_file_of_table(
    table: &mut dyn TableLike,
    at: &mut Vec<String>,
    on: OnFile<'_>,
) -> Result<()> {
    table.iter_mut().try_for_each(|(key, item)| {
        let n_before = at.len();
        at.extend(key.get().split('.').map(str::to_owned));
        let done = each_file(item, at, on);
        at.truncate(n_before);
        done
    })
}

fn each_file_of_value(value: &mut Value, at: &mut Vec<String>, on: OnFile<'_>) -> Result<()> {
    match value {
        Value::InlineTable(table) => each_file_of_table(table, at, on),
        Value::Array(values) => values.iter_mut().enumerate().try_for_each(|(i, value)| {
            at.push(i.to_string());
            let done = each_file_of_value(value, at, on);
            at.pop();
            done
        }),
        _ if at.len() == 3 && at[0] == "cloud" && at[2] == "file" => on(value),
        _ => Ok(()),
    }
}

/// The name of `file` as seen from the folder `from`, a true name; with slashes, which every system
/// knows.
fn relative(file: &Path, from: &Path) -> Result<String> {
    let fault = |what: String| Error::io(file, what);
    let name = file.file_name().ok_or_else(|| fault("expected a file name".to_owned()))?;
    let folder = folder_of(file)?;
    let parts =
        |path: &Path| path.components().map(|c| c.as_os_str().to_owned()).collect::<Vec<_>>();
    let (folder_parts, from_parts) = (parts(&folder), parts(from));
    let n_shared = folder_parts.iter().zip(&from_parts).take_while(|(a, b)| a == b).count();
    let text = |part: &std::ffi::OsStr| part.to_str().map(str::to_owned);
    let unnamed = || fault("its path is no text that a scene could have".to_owned());
    // On another drive nothing leads there but its whole name.
    if n_shared == 0 {
        return text(folder.join(name).as_os_str()).ok_or_else(unnamed);
    }
    let up = from_parts[n_shared..].iter().map(|_| Some("..".to_owned()));
    let down = folder_parts[n_shared..].iter().map(|part| text(part)).chain([text(name)]);
    up.chain(down).collect::<Option<Vec<String>>>().map(|parts| parts.join("/")).ok_or_else(unnamed)
}
