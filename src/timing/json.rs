//! Result records as versioned JSON files.

use std::io::Write;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::error::{Error, Result};
use crate::io::atomic::write_atomic;
use crate::io::text_file::{RECORD_LIMIT, read_result};

/// A record that is the main file of a results folder.
///
/// A change of a key or of its meaning raises `SCHEMA`.
pub trait ResultFile: Serialize + DeserializeOwned {
    /// File name, such as `run.json`.
    const FILE: &'static str;
    /// Version that this build writes and reads, under the key `schema`.
    const SCHEMA: u32;
}

/// Reads the record at `path`, which is the file or the folder that holds it.
///
/// # Errors
/// Fails if the file cannot be read, is not such a record, or has another schema version.
pub fn read<T: ResultFile>(path: &Path) -> Result<T> {
    let path = if path.is_dir() { path.join(T::FILE) } else { path.to_owned() };
    parse(&read_result(&path, RECORD_LIMIT)?, &path)
}

/// Parses a record from its text; errors name `path`.
///
/// # Errors
/// Fails if the text is not such a record or has another schema version.
pub fn parse<T: ResultFile>(text: &str, path: &Path) -> Result<T> {
    let file = T::FILE;
    let value: Value = serde_json::from_str(text)
        .map_err(|cause| Error::io(path, format!("not JSON, or not all of it: {cause}")))?;
    // The version is checked first: with another version any other message would mislead.
    match value.get("schema").and_then(Value::as_u64) {
        Some(version) if version == u64::from(T::SCHEMA) => {}
        Some(version) => {
            let what = format!("{file} of schema {version}; this nimbus reads {}", T::SCHEMA);
            return Err(Error::io(path, what));
        }
        None => {
            let what = format!("not a {file} of nimbus: it names no schema version");
            return Err(Error::io(path, what));
        }
    }
    serde_json::from_value(value)
        .map_err(|cause| Error::io(path, format!("not a {file} of nimbus: {cause}")))
}

/// Returns a record as the text of a file; errors name `path`.
///
/// # Errors
/// Fails if the record has no form in JSON.
pub fn text(path: &Path, record: &impl Serialize) -> Result<String> {
    let text = serde_json::to_string_pretty(record).map_err(|cause| Error::io(path, cause))?;
    Ok(text + "\n")
}

/// Writes a record to `path`, under a temporary name until it is complete.
///
/// # Errors
/// Fails if the file cannot be written.
pub fn write(path: &Path, record: &impl Serialize) -> Result<()> {
    let text = text(path, record)?;
    write_atomic(path, |file| file.write_all(text.as_bytes()))
}
