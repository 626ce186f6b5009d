//! Records as JSON: append-only files of lines that several processes share, and whole files.

use std::io;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::{Error, Result};
use crate::io::{atomic, input_file};
use crate::timing::json;

/// Largest journal: half a million lines of 128 bytes.
const LARGEST_JOURNAL: u64 = 64 << 20;

/// Appends `record` as a line and syncs the file. The line is written by a single call, so that
/// lines of two processes never mix.
///
/// # Errors
/// When the file cannot be written; transient where another try may succeed.
pub fn append<T: Serialize>(path: &Path, record: &T) -> Result<()> {
    let line = serde_json::to_string(record).map_err(|cause| Error::io(path, cause))?;
    atomic::append_synced(path, &line)
}

/// Writes `record` to a file of its own and syncs it.
///
/// # Errors
/// When the file cannot be written; transient where another try may succeed.
pub fn write<T: Serialize>(path: &Path, record: &T) -> Result<()> {
    atomic::write_synced(path, json::text(path, record)?.as_bytes())
}

/// Returns the records of a journal in their order. Lines that were cut off when their writer was
/// killed, or have another form, are left out.
///
/// # Errors
/// When the file cannot be read.
pub fn read<T: DeserializeOwned>(path: &Path) -> io::Result<Vec<T>> {
    let bytes = input_file::read(path, LARGEST_JOURNAL)?;
    let text = String::from_utf8_lossy(&bytes);
    Ok(text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect())
}
