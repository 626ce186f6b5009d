//! Reads files as text, up to a limit that is checked before the first byte is read.

use std::io::ErrorKind;
use std::path::Path;

use super::input_file;
use super::near_file::missing;
use crate::error::{Error, Place, Result};

/// Largest scene file. Scenes are written by hand; the largest benchmark scene has a few KiB.
pub const SCENE_LIMIT: u64 = 4 << 20;
/// Largest box file: 64 MiB are about a million boxes.
pub const DATA_LIMIT: u64 = 64 << 20;
/// Largest result as JSON: a study of ten thousand configurations. Its tree takes up to a hundred
/// times its text.
pub const RECORD_LIMIT: u64 = 16 << 20;
/// Largest result as a table: half a million frames of 400 bytes. Its rows take three times as
/// much, and `compare` reads two tables.
pub const TABLE_LIMIT: u64 = 192 << 20;

const BYTE_ORDER_MARK: char = '\u{feff}';

/// Reads an input file, whose kind begins with `first`, as text without a byte-order mark.
///
/// # Errors
/// [`Error::Io`] when the file cannot be read or is larger than `limit`, and [`Error::Scene`] with
/// line and column when it is empty or no text.
pub fn read_text(path: &Path, limit: u64, first: &str) -> Result<String> {
    let bytes = input_file::read(path, limit).map_err(|e| Error::io(path, plain(&e, path)))?;
    check_text(&bytes, path, first).map(str::to_owned)
}

/// Returns the text of an input file, whose kind begins with `first`, without a byte-order mark.
///
/// # Errors
/// With line and column when it is empty or no text.
pub fn check_text<'a>(bytes: &'a [u8], path: &Path, first: &str) -> Result<&'a str> {
    let text = decode(bytes, path)?;
    if text.trim().is_empty() {
        return Err(Error::scene(
            Place::line(path, 1, 1),
            format!("the file is empty: expected {first}"),
        ));
    }
    Ok(text)
}

/// Returns line and column (characters), both from 1, of a byte offset. An offset past the end is
/// the end.
pub fn line_column(text: &str, offset: usize) -> (usize, usize) {
    let mut end = offset.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let before = &text[..end];
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    (before.bytes().filter(|b| *b == b'\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// Reads a result of nimbus as text.
///
/// # Errors
/// When the file cannot be read or is larger than `limit`.
pub fn read_result(path: &Path, limit: u64) -> Result<String> {
    input_file::read_string(path, limit).map_err(|cause| Error::io(path, cause))
}

fn decode<'a>(bytes: &'a [u8], path: &Path) -> Result<&'a str> {
    let at = |offset: usize| {
        // The bytes before the offset may be no text either. They count as the replacement
        // characters that an editor would show.
        let (line, column) = line_column(&String::from_utf8_lossy(&bytes[..offset]), usize::MAX);
        Place::line(path, line, column)
    };
    if let Some(offset) = bytes.iter().position(|b| *b == 0) {
        return Err(Error::scene(at(offset), "not a text file: it holds a zero byte"));
    }
    let text = std::str::from_utf8(bytes)
        .map_err(|e| Error::scene(at(e.valid_up_to()), "not UTF-8 text"))?;
    Ok(text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text))
}

/// Returns the message of an error without its number, which tells a user nothing.
pub(super) fn plain(e: &std::io::Error, path: &Path) -> String {
    match e.kind() {
        ErrorKind::NotFound => missing(path),
        _ => e.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_characters_from_one() {
        let text = "ab\nçd\r\ne";
        assert_eq!(line_column(text, 0), (1, 1));
        assert_eq!(line_column(text, 2), (1, 3));
        assert_eq!(line_column(text, 3), (2, 1));
        // The second byte of ç belongs to ç.
        assert_eq!(line_column(text, 4), (2, 1));
        assert_eq!(line_column(text, 5), (2, 2));
        assert_eq!(line_column(text, usize::MAX), (3, 2));
    }
}
