//! NetCDF of every kind through the crate `netcdf-reader`: classic, 64-bit offset, 64-bit data
//! (CDF-5) and NetCDF-4 (HDF5).

use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;

use netcdf_reader::{
    BytesStorage, DynStorage, FileStorage, NcAttrValue, NcAttribute, NcDimension, NcFile, NcFormat,
    NcOpenOptions, NcSliceInfo, NcSliceInfoElem, NcVariable,
};

use super::container::{Attribute, Checked, Dimension, Value, Variable};
use crate::error::{Error, Place, Result};
use crate::io::input_file;
use crate::io::near_file::missing;

/// Most numbers that one part of a variable may have: those of a step of the largest grid.
const MOST_NUMBERS: u64 = 1 << 25;
/// Most characters of a variable of text: a year of steps has less than 1 MiB.
const MOST_CHARACTERS: u64 = 8 << 20;
/// Largest chunk and largest part, bytes: f64 of [`MOST_NUMBERS`]. A damaged file that asks for
/// more is refused before memory is allocated.
const MOST_BYTES: usize = (MOST_NUMBERS as usize) * 8;
const MOST_HEADER_BYTES: usize = 16 << 20;
/// Size of the cache of unpacked chunks, for variables whose chunks hold several steps.
const CHUNK_CACHE_BYTES: usize = 64 << 20;

/// An open NetCDF file. Opening reads the declarations of its variables, not their numbers.
pub struct NetCdf {
    file: NcFile,
    /// Format in words, such as "NetCDF-4 (HDF5)".
    pub kind: &'static str,
    /// Variables of the file.
    pub variables: Vec<Variable>,
    /// Attributes of the whole file.
    pub attributes: Vec<Attribute>,
}

/// Opens a file and reads its header.
///
/// # Errors
/// When the file cannot be read or is no NetCDF file.
pub fn open(path: &Path) -> Result<NetCdf> {
    // Only the parts that are asked for are read, so that the size has no limit.
    let file = input_file::open(path, u64::MAX).map_err(|e| match e.kind() {
        ErrorKind::NotFound => Error::io(path, missing(path)),
        _ => Error::io(path, e),
    })?;
    // Read by ranges and not mapped: a mapped file that is cut off while it is read ends the
    // process.
    let storage = FileStorage::from_file(file).map_err(|e| Error::io(path, e))?;
    from_storage(Arc::new(storage)).map_err(|what| Error::scene(Place::file(path), what))
}

/// Opens a file that is in memory.
///
/// # Errors
/// As [`open`], without a place.
pub fn from_bytes(bytes: Vec<u8>) -> Checked<NetCdf> {
    from_storage(Arc::new(BytesStorage::new(bytes)))
}

fn from_storage(storage: DynStorage) -> Checked<NetCdf> {
    check_begin(&storage)?;
    let damaged = |e: netcdf_reader::Error| format!("the file is damaged or cut off: {e}");
    let options = NcOpenOptions {
        chunk_cache_bytes: CHUNK_CACHE_BYTES,
        max_chunk_bytes: MOST_BYTES,
        max_read_bytes: MOST_BYTES,
        max_object_header_bytes: MOST_HEADER_BYTES,
        ..NcOpenOptions::default()
    };
    let file = NcFile::from_storage_with_options(storage, options).map_err(damaged)?;
    let kind = match file.format() {
        NcFormat::Classic => "NetCDF classic",
        NcFormat::Offset64 => "NetCDF 64-bit offset",
        NcFormat::Cdf5 => "NetCDF 64-bit data (CDF-5)",
        NcFormat::Nc4 => "NetCDF-4 (HDF5)",
        NcFormat::Nc4Classic => "NetCDF-4 (HDF5), classic model",
    };
    let variables = file.variables().map_err(damaged)?.iter().map(variable).collect();
    let attributes = file.global_attributes().map_err(damaged)?.iter().map(attribute).collect();
    Ok(NetCdf { file, kind, variables, attributes })
}

const HDF5_SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Length of the longest superblock of any version.
const SUPERBLOCK_LENGTH: usize = 96;

/// Refuses a file that is not NetCDF, and an HDF5 file that is shorter than its superblock says.
fn check_begin(storage: &DynStorage) -> Checked<()> {
    let length = storage.len();
    if length == 0 {
        return Err("the file is empty: expected a NetCDF file".to_owned());
    }
    let n = length.min(SUPERBLOCK_LENGTH as u64) as usize;
    let begin = storage.read_range(0, n).map_err(|e| format!("cannot be read: {e}"))?;
    let begin: &[u8] = &begin;
    let is_classic = matches!(begin, [b'C', b'D', b'F', 1 | 2 | 5, ..]);
    if !is_classic && !begin.starts_with(HDF5_SIGNATURE) {
        let shown: String =
            begin.iter().take(4).map(|b| std::ascii::escape_default(*b).to_string()).collect();
        return Err(format!(
            "not a NetCDF file: it begins with \"{shown}\", expected \"CDF\" and 1, 2 or 5, \
             or \"\\x89HDF\""
        ));
    }
    match superblock_end(begin) {
        Some(end) if end > length => Err(format!(
            "the file is cut off: it has {length} bytes, and by its own superblock it ends at {end}"
        )),
        _ => Ok(()),
    }
}

/// Returns where an HDF5 file says that it ends ("HDF5 File Format Specification" 3.0, II.A): the
/// third address of its superblock.
fn superblock_end(begin: &[u8]) -> Option<u64> {
    let begin_of_addresses = |version: u8| match version {
        0 => Some((13, 24)),
        1 => Some((13, 28)),
        2 | 3 => Some((9, 12)),
        _ => None,
    };
    if !begin.starts_with(HDF5_SIGNATURE) {
        return None;
    }
    let (at_size, at_addresses) = begin_of_addresses(*begin.get(8)?)?;
    let size = usize::from(*begin.get(at_size)?);
    let bytes = begin.get(at_addresses + 2 * size..at_addresses + 3 * size)?;
    // The address is little-endian and has 2, 4 or 8 bytes.
    (size <= 8).then(|| bytes.iter().rev().fold(0, |n, b| n << 8 | u64::from(*b)))
}

fn dimension(d: &NcDimension) -> Dimension {
    Dimension { name: d.name.clone(), length: d.size }
}

fn variable(v: &NcVariable) -> Variable {
    Variable {
        name: v.name().to_owned(),
        kind: format!("{:?}", v.dtype())
            .to_lowercase()
            .chars()
            .take_while(char::is_ascii_alphanumeric)
            .collect(),
        dimensions: v.dimensions().iter().map(dimension).collect(),
        attributes: v.attributes().iter().map(attribute).collect(),
    }
}

fn attribute(a: &NcAttribute) -> Attribute {
    let value = match &a.value {
        NcAttrValue::Chars(text) => Value::Text(text.clone()),
        NcAttrValue::Strings(texts) => Value::Text(texts.join(", ")),
        numbers => Value::Numbers(numbers.as_f64_vec().unwrap_or_default()),
    };
    Attribute { name: a.name.clone(), value }
}

impl NetCdf {
    /// Finds a variable.
    pub fn variable(&self, name: &str) -> Option<&Variable> {
        self.variables.iter().find(|v| v.name == name)
    }

    /// Reads the part of a variable that begins at `start` and has `count` places along each of its
    /// dimensions, slowest first. Numbers are returned as stored; fill values are numbers too.
    ///
    /// # Errors
    /// When the file is damaged or the part lies outside the variable.
    pub fn read(&self, name: &str, start: &[u64], count: &[u64]) -> Checked<Vec<f64>> {
        let lengths = self.lengths(name)?;
        let is_within = lengths.len() == start.len()
            && lengths.len() == count.len()
            && lengths
                .iter()
                .zip(start.iter().zip(count))
                .all(|(n, (s, c))| s.checked_add(*c).is_some_and(|e| e <= *n));
        if !is_within {
            return Err(format!(
                "it has {lengths:?} values, asked for {count:?} from {start:?} on"
            ));
        }
        let n = product(count.iter().copied(), MOST_NUMBERS)?;
        let selections = start
            .iter()
            .zip(count)
            .map(|(s, c)| NcSliceInfoElem::Slice { start: *s, end: s + c, step: 1 })
            .collect();
        let read = self.file.read_variable_slice_as_f64(name, &NcSliceInfo { selections });
        let read = read.map_err(|e| format!("cannot be read: {e}"))?;
        // Moved where possible: a step of the largest grid takes 128 MiB a variable.
        let numbers = match read.is_standard_layout() {
            true => read.into_raw_vec_and_offset().0,
            false => read.iter().copied().collect(),
        };
        if numbers.len() as u64 != n {
            return Err(format!("damaged: {} values where {n} are declared", numbers.len()));
        }
        Ok(numbers)
    }

    /// Reads the rows of a variable of characters, whose last dimension runs along a row.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_rows(&self, name: &str) -> Checked<Vec<String>> {
        product(self.lengths(name)?.into_iter(), MOST_CHARACTERS)?;
        self.file.read_variable_as_strings(name).map_err(|e| format!("cannot be read: {e}"))
    }

    fn lengths(&self, name: &str) -> Checked<Vec<u64>> {
        self.variable(name).map(Variable::lengths).ok_or_else(|| "is not in the file".to_owned())
    }
}

/// Returns the number of values, or an error when there are more than `most`. Callers check it
/// before they allocate.
fn product(lengths: impl Iterator<Item = u64>, most: u64) -> Checked<u64> {
    let n = lengths.into_iter().try_fold(1u64, u64::checked_mul).filter(|n| *n <= most);
    n.ok_or_else(|| format!("too large: more than {most} values at once"))
}
