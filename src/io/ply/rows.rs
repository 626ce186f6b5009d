//! The rows of an element of a PLY file, binary or as text.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use super::header::{Element, Format, Header, Scalar};
use crate::error::{Error, Place, Result};
use crate::io::document::suggest::shown;
use crate::model::parallel::parallel_map;

/// The outcome of reading a row.
pub type Made<T> = std::result::Result<T, Fault>;

/// A fault of a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// Number of the property.
    pub i: usize,
    /// The message: what was expected, and what was found.
    pub what: String,
}

/// A maker of values from rows.
pub trait OfRow<T> {
    /// Returns the value of the row whose properties `value` returns by their numbers.
    fn made(&self, value: impl Fn(usize) -> f64) -> Made<T>;
}

/// The rows of an element.
pub struct Rows<'a> {
    element: &'a Element,
    format: Format,
    /// From the first row on. Of a binary file, these rows alone.
    bytes: &'a [u8],
    /// Lines before the first row.
    n_lines: usize,
    path: &'a Path,
}

impl<'a> Rows<'a> {
    /// Returns the rows of element `i` of a file.
    ///
    /// # Errors
    /// When the file ends before them, or a list stands before or in them.
    pub fn new(header: &'a Header, bytes: &'a [u8], i: usize, path: &'a Path) -> Result<Rows<'a>> {
        let element = &header.elements[i];
        let of_list =
            |e: &Element| e.properties.iter().find(|p| p.scalar.is_none()).map(|p| p.line);
        if let Some(line) = of_list(element) {
            let what = format!("expected numbers in `{}`, found a list", shown(&element.name));
            return Err(Error::scene(Place::line(path, line, 1), what));
        }
        let (format, mut n_lines) = (header.format, header.n_lines);
        let mut rest = &bytes[header.n_bytes..];
        for before in &header.elements[..i] {
            if format == Format::Ascii {
                for _ in 0..before.n {
                    let Some(end) = rest.iter().position(|b| *b == b'\n') else { break };
                    rest = &rest[end + 1..];
                    n_lines += 1;
                }
                continue;
            }
            let Some(row) = before.row_bytes() else {
                let [before, own] = [&before.name, &element.name].map(|name| shown(name));
                let what = format!("expected `{own}` before `{before}`, whose rows are lists");
                return Err(Error::scene(Place::line(path, element.line, 1), what));
            };
            let n_bytes = usize::try_from(before.n).ok().and_then(|n| n.checked_mul(row));
            rest = n_bytes.and_then(|n| rest.get(n..)).unwrap_or_default();
        }
        if format != Format::Ascii {
            let row = element.row_bytes().unwrap_or_default();
            let n_bytes = usize::try_from(element.n).ok().and_then(|n| n.checked_mul(row));
            let Some(rows) = n_bytes.and_then(|n| rest.get(..n)) else {
                return Err(Error::scene(
                    Place::file(path),
                    format!(
                        "the file is cut: expected {} rows of {row} bytes in `{}`, found {} bytes",
                        element.n,
                        shown(&element.name),
                        rest.len()
                    ),
                ));
            };
            rest = rows;
        }
        Ok(Rows { element, format, bytes: rest, n_lines, path })
    }

    /// Returns the value of every row, in order. Binary rows are read on all threads.
    ///
    /// # Errors
    /// The fault of the first wrong row, with its place.
    pub fn map<T: Default + Send>(&self, of: &(impl OfRow<T> + Sync)) -> Result<Vec<T>> {
        if self.format == Format::Ascii {
            return self.map_lines(of);
        }
        let is_big = self.format == Format::Big;
        // Splats are files of `float` alone. Then no number's type and place are looked up.
        if !is_big && self.element.properties.iter().all(|p| p.scalar == Some(Scalar::F32)) {
            let of_row = |row: &[u8], i: usize| number(&row[4 * i..], Scalar::F32, false);
            return self.map_by(of, of_row);
        }
        let mut offset = 0;
        let columns: Vec<(usize, Scalar)> = self
            .element
            .properties
            .iter()
            .filter_map(|p| {
                let scalar = p.scalar?;
                offset += scalar.n_bytes();
                Some((offset - scalar.n_bytes(), scalar))
            })
            .collect();
        self.map_by(of, |row, i| {
            let (offset, scalar) = columns[i];
            number(&row[offset..], scalar, is_big)
        })
    }

    /// Returns the value of every binary row, in order. `of_row` returns the number of a property.
    fn map_by<T: Default + Send>(
        &self,
        of: &(impl OfRow<T> + Sync),
        of_row: impl Fn(&[u8], usize) -> f64 + Sync,
    ) -> Result<Vec<T>> {
        let n = self.element.n as usize;
        let row_bytes = self.element.row_bytes().unwrap_or_default();
        let first_fault: Mutex<Option<(usize, Fault)>> = Mutex::new(None);
        let made = parallel_map(n, |k| {
            let row = &self.bytes[k * row_bytes..(k + 1) * row_bytes];
            of.made(|i| of_row(row, i)).unwrap_or_else(|fault| {
                let mut first = first_fault.lock().unwrap_or_else(PoisonError::into_inner);
                if first.as_ref().is_none_or(|(row, _)| k < *row) {
                    *first = Some((k, fault));
                }
                T::default()
            })
        });
        match first_fault.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some((row, fault)) => Err(self.fault_of_row(row, &fault)),
            None => Ok(made),
        }
    }

    fn fault_of_row(&self, row: usize, fault: &Fault) -> Error {
        let (element, name) = (&self.element.name, &self.element.properties[fault.i].name);
        let what = format!("{} {row} (from 0): `{}`: {}", shown(element), shown(name), fault.what);
        Error::scene(Place::file(self.path), what)
    }

    fn map_lines<T>(&self, of: &impl OfRow<T>) -> Result<Vec<T>> {
        let (name, n) = (shown(&self.element.name), self.element.n);
        let n_properties = self.element.properties.len();
        let mut made = Vec::new();
        let mut values = Vec::with_capacity(n_properties);
        let mut lines = self.bytes.split(|b| *b == b'\n').zip(self.n_lines + 1..);
        while (made.len() as u64) < n {
            let Some((bytes, line)) = lines.next() else {
                let found = made.len();
                let what = format!("the file is cut: expected {n} rows in `{name}`, found {found}");
                return Err(Error::scene(Place::file(self.path), what));
            };
            let fault = |column: usize, what: String| {
                Err(Error::scene(Place::line(self.path, line, column), what))
            };
            let Ok(text) = std::str::from_utf8(bytes) else {
                return fault(1, "expected numbers, found no text".to_owned());
            };
            if text.trim().is_empty() {
                continue;
            }
            let column = |word: &str| text[..offset_in(text, word)].chars().count() + 1;
            values.clear();
            for word in text.split_whitespace().take(n_properties) {
                match word.parse::<f64>() {
                    Ok(value) => values.push(value),
                    Err(_) => {
                        let what = format!("expected a number, found `{}`", shown(word));
                        return fault(column(word), what);
                    }
                }
            }
            let found = text.split_whitespace().count();
            if found != n_properties {
                let what =
                    format!("expected {n_properties} numbers as in the header, found {found}");
                return fault(text.trim_end().chars().count() + 1, what);
            }
            match of.made(|i| values[i]) {
                Ok(one) => made.push(one),
                Err(wrong) => {
                    let word = text.split_whitespace().nth(wrong.i).unwrap_or_default();
                    let name = shown(&self.element.properties[wrong.i].name);
                    return fault(column(word), format!("`{name}`: {}", wrong.what));
                }
            }
        }
        Ok(made)
    }
}

/// Returns where `part`, which is a part of `text`, begins in it.
fn offset_in(text: &str, part: &str) -> usize {
    (part.as_ptr() as usize).saturating_sub(text.as_ptr() as usize).min(text.len())
}

/// Returns the number at the start of `bytes`.
#[inline]
fn number(bytes: &[u8], scalar: Scalar, is_big: bool) -> f64 {
    #[inline]
    fn first<const N: usize>(bytes: &[u8], is_big: bool) -> [u8; N] {
        debug_assert!(bytes.len() >= N, "a row is cut to its length");
        let mut found = bytes.first_chunk().copied().unwrap_or([0; N]);
        if is_big {
            found.reverse();
        }
        found
    }
    match scalar {
        Scalar::I8 => f64::from(i8::from_le_bytes(first(bytes, is_big))),
        Scalar::U8 => f64::from(bytes[0]),
        Scalar::I16 => f64::from(i16::from_le_bytes(first(bytes, is_big))),
        Scalar::U16 => f64::from(u16::from_le_bytes(first(bytes, is_big))),
        Scalar::I32 => f64::from(i32::from_le_bytes(first(bytes, is_big))),
        Scalar::U32 => f64::from(u32::from_le_bytes(first(bytes, is_big))),
        Scalar::F32 => f64::from(f32::from_le_bytes(first(bytes, is_big))),
        Scalar::F64 => f64::from_le_bytes(first(bytes, is_big)),
    }
}
