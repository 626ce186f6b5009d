//! Particle lists: CSV with the columns `x,y,z,sigma,kappa` and, if given, `sigma_y`, `sigma_z`,
//! `qw,qx,qy,qz` and `r,g,b`, in any order. A column `radius` may stand for sigma = radius / 3.
//! With `sigma_y` alone, sigma is the one along x and z; with `sigma_z`, the one along x. The
//! quaternion q turns these axes.

use std::ops::Range;
use std::path::Path;

use csv::{Reader, ReaderBuilder, StringRecord};
use glam::{DQuat, DVec3};

use super::bounds::{LEAST, rounded, wrong_coordinate, wrong_size};
use super::document::suggest::{did_you_mean, list, shown};
use super::memory;
use super::text_file::line_column;
use crate::error::{Error, Place, Result};
use crate::model::cloud::{MIN_ASPECT, Particle, SIGMA_PER_RADIUS, Shape, unit_quaternion};
use crate::model::parallel::parallel_map;

const COLUMNS: [&str; 15] = [
    "x", "y", "z", "sigma", "radius", "sigma_y", "kappa", "r", "g", "b", "sigma_z", "qw", "qx",
    "qy", "qz",
];
const POSITION: Range<usize> = 0..3;
const SIGMA: usize = 3;
const RADIUS: usize = 4;
const SIGMA_Y: usize = 5;
const KAPPA: usize = 6;
const COLOR: Range<usize> = 7..10;
const SIGMA_Z: usize = 10;
const TURN: Range<usize> = 11..15;

/// Beginning of a particle list, for messages.
pub const FIRST: &str = "a header x,y,z,sigma (or radius),kappa[,r,g,b]";
/// Hint about rows whose fields are separated by other characters.
const COMMAS: &str = "; commas separate the columns";

/// Bytes of a part of a list. Parts are read on all threads.
const PART_BYTES: usize = 4 << 20;

/// Particles, and the line of each.
pub type Lines = (Vec<Particle>, Vec<usize>);

/// Reads particles from text, and the line of each; `path` is the text's name in messages.
///
/// # Errors
/// When the text holds a fault, with line and column, and when the particles do not fit in memory.
pub fn parse(text: &str, path: &Path) -> Result<Lines> {
    parse_by(PART_BYTES, text, path)
}

/// Reads particles from parts of `part_bytes`.
fn parse_by(part_bytes: usize, text: &str, path: &Path) -> Result<Lines> {
    let file = File { text, begin: 0, path };
    let mut rows = Rows::new(text);
    let Some(header) = rows.next(path)?.cloned() else {
        return Err(Error::scene(
            Place::line(path, 1, 1),
            format!("the file is empty: expected {FIRST}"),
        ));
    };
    file.check_quotes(&header)?;
    let columns = Columns::find(&file, &header)?;
    let begin = (rows.reader.position().byte() as usize).min(text.len());
    let parts = parts_of(text, begin, part_bytes);
    let n_lines: Vec<usize> = parallel_map(parts.len(), |k| count_lines(&text[parts[k].clone()]));
    // A row has a line, and of each field a character and a separator.
    let most = (text.len() / (2 * header.len())).min(n_lines.iter().sum::<usize>() + 1);
    // Parts are joined when all are read.
    let n_bytes = 2 * most * (size_of::<Particle>() + size_of::<usize>());
    memory::check(n_bytes as u64, || format!("{}: {most} rows", path.display()))?;
    let of_part = |k: usize| columns.part(text, parts[k].clone(), path, header.len());
    let read = parallel_map(parts.len(), of_part);
    let (mut particles, mut lines) = (Vec::new(), Vec::new());
    let mut before = 1 + count_lines(&text[..begin]);
    for (part, n_lines) in read.into_iter().zip(n_lines) {
        let (own, at) = part?;
        particles.extend(own);
        lines.extend(at.into_iter().map(|line| before + line));
        before += n_lines;
    }
    Ok((particles, lines))
}

/// Returns the parts of `text` from `begin` on, which end where lines end.
fn parts_of(text: &str, begin: usize, part_bytes: usize) -> Vec<Range<usize>> {
    let (bytes, mut parts, mut start) = (text.as_bytes(), vec![], begin);
    while start < bytes.len() {
        let least = (start + part_bytes).min(bytes.len());
        let rest = bytes[least..].iter().position(|b| *b == b'\n').map(|i| least + i + 1);
        let end = rest.unwrap_or(bytes.len());
        parts.push(start..end);
        start = end;
    }
    parts
}

fn count_lines(text: &str) -> usize {
    text.bytes().filter(|b| *b == b'\n').count()
}

/// Rows of a part of a text, without the blank ones.
struct Rows<'a> {
    reader: Reader<&'a [u8]>,
    row: StringRecord,
}

impl<'a> Rows<'a> {
    fn new(text: &'a str) -> Rows<'a> {
        let mut builder = ReaderBuilder::new();
        let reader = builder.has_headers(false).flexible(true).from_reader(text.as_bytes());
        Rows { reader, row: StringRecord::new() }
    }

    fn next(&mut self, path: &Path) -> Result<Option<&StringRecord>> {
        loop {
            match self.reader.read_record(&mut self.row) {
                Ok(false) => return Ok(None),
                Ok(true) if is_blank(&self.row) => {}
                Ok(true) => return Ok(Some(&self.row)),
                Err(e) => {
                    let what = format!("not readable as CSV: {e}");
                    return Err(Error::scene(Place::file(path), what));
                }
            }
        }
    }
}

fn is_blank(row: &StringRecord) -> bool {
    row.len() == 1 && row[0].trim().is_empty()
}

/// Returns whether a field looks like several that are separated by other characters than commas.
fn is_of_several(field: &str) -> bool {
    field.trim().contains(|c: char| c == ';' || c.is_whitespace())
}

/// A text of which a part is read.
struct File<'a> {
    text: &'a str,
    /// Where the part begins.
    begin: usize,
    path: &'a Path,
}

impl File<'_> {
    /// Refuses a quote that is not closed, which would take in all lines up to the next quote.
    fn check_quotes(&self, row: &StringRecord) -> Result<()> {
        match row.iter().position(|field| field.contains('\n')) {
            Some(i) => Err(Error::scene(self.place(row, i), "the quote is not closed on its line")),
            None => Ok(()),
        }
    }

    /// Returns the byte offset at which a row starts.
    fn start(&self, row: &StringRecord) -> usize {
        let in_part = row.position().map_or(0, |p| p.byte() as usize);
        let start = (self.begin + in_part).min(self.text.len());
        // The reader's position may be before line ends that it skips.
        start + self.text[start..].bytes().take_while(|b| matches!(b, b'\r' | b'\n')).count()
    }

    /// Returns the place of field `i` of a row, or of the row's end where it has no such field.
    fn place(&self, row: &StringRecord, i: usize) -> Place {
        let start = self.start(row);
        let mut is_quoted = false;
        let mut n_fields = 0;
        let mut offset = start;
        for (k, byte) in self.text[start..].bytes().enumerate() {
            if n_fields == i {
                break;
            }
            match byte {
                b'"' => is_quoted = !is_quoted,
                b',' if !is_quoted => n_fields += 1,
                b'\r' | b'\n' if !is_quoted => break,
                _ => {}
            }
            offset = start + k + 1;
        }
        let blanks = self.text[offset..].bytes().take_while(|b| matches!(b, b' ' | b'\t')).count();
        let (line, column) = line_column(self.text, offset + blanks);
        Place::line(self.path, line, column)
    }
}

/// Numbers of the fields of a row, in the order of [`COLUMNS`].
struct Columns([Option<usize>; COLUMNS.len()]);

impl Columns {
    fn find(file: &File, header: &StringRecord) -> Result<Columns> {
        let fault = |i: usize, what: &str| Err(Error::scene(file.place(header, i), what));
        let names: Vec<&str> = header.iter().map(str::trim).collect();
        if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            // A box file has one number on its first line.
            let hint = match names.len() {
                1 => "; a box file needs from = \"boxes\"",
                _ => "",
            };
            return fault(0, &format!("expected {FIRST}, found numbers{hint}"));
        }
        for (i, name) in names.iter().enumerate() {
            if !COLUMNS.contains(name) {
                let meant = match name.starts_with('#') {
                    true => "; a particle list has no comments".to_owned(),
                    false if is_of_several(name) => COMMAS.to_owned(),
                    false => did_you_mean(name, &COLUMNS),
                };
                let known = list(&COLUMNS);
                let name = shown(name);
                return fault(i, &format!("unknown column `{name}`{meant} (known: {known})"));
            }
            if names[..i].contains(name) {
                return fault(i, &format!("column `{name}` stands twice"));
            }
        }
        let columns = COLUMNS.map(|column| names.iter().position(|name| *name == column));
        let missing = |of: Range<usize>| -> Vec<&str> {
            of.filter(|i| columns[*i].is_none()).map(|i| COLUMNS[i]).collect()
        };
        match (columns[SIGMA], columns[RADIUS]) {
            (Some(i), Some(j)) => {
                return fault(i.max(j), "expected `sigma` or `radius`, found both");
            }
            (None, None) => return fault(0, "missing column `sigma` (or `radius` = 3 sigma)"),
            _ => {}
        }
        for (together, names) in [(COLOR, "`r`, `g`, `b`"), (TURN, "`qw`, `qx`, `qy`, `qz`")] {
            let lacking = missing(together.clone());
            if !lacking.is_empty() && lacking.len() < together.len() {
                let i = columns[together].iter().flatten().min().copied().unwrap_or(0);
                let missing = list(&lacking);
                return fault(i, &format!("expected all of {names} or none; missing {missing}"));
            }
        }
        match [missing(POSITION), missing(KAPPA..KAPPA + 1)].concat().first() {
            Some(name) => fault(0, &format!("missing column `{name}`")),
            None => Ok(Columns(columns)),
        }
    }

    /// Reads the rows of a part of `text`, and counts the lines before each. Rows have `n_fields`.
    fn part(&self, text: &str, part: Range<usize>, path: &Path, n_fields: usize) -> Result<Lines> {
        let file = File { text, begin: part.start, path };
        let (mut particles, mut lines) = (Vec::new(), Vec::new());
        // Lines are counted on from row to row; counting from the start would take the square of
        // the part's length.
        let (mut line, mut counted) = (0, part.start);
        let mut rows = Rows::new(&text[part]);
        while let Some(row) = rows.next(path)? {
            file.check_quotes(row)?;
            if row.len() != n_fields {
                let i = row.len().min(n_fields);
                let found = row.len();
                let hint = if row.iter().any(is_of_several) { COMMAS } else { "" };
                let what =
                    format!("expected {n_fields} fields as in the header, found {found}{hint}");
                return Err(Error::scene(file.place(row, i), what));
            }
            particles.push(self.particle(&file, row)?);
            let start = file.start(row);
            line += count_lines(&text[counted..start]);
            counted = start;
            lines.push(line);
        }
        Ok((particles, lines))
    }

    fn particle(&self, file: &File, row: &StringRecord) -> Result<Particle> {
        // Returns the number in a column, if the list has the column.
        let number = |column: usize, wrong: &dyn Fn(f64) -> Option<String>| {
            let Some(i) = self.0[column] else { return Ok(None) };
            let word = row[i].trim();
            let fault = |what: String| {
                let what = format!("{what}, found `{}`", shown(word));
                Err(Error::scene(file.place(row, i), what))
            };
            match word.parse::<f64>() {
                Ok(v) if v.is_finite() => match wrong(v) {
                    None => Ok(Some(v)),
                    Some(expected) => fault(format!("{}: expected {expected}", COLUMNS[column])),
                },
                _ => fault("expected a finite number".to_owned()),
            }
        };
        let size = |column: usize| number(column, &|v| wrong_size(v, 0.0));
        let coordinate = |column: usize| Ok(number(column, &wrong_coordinate)?.unwrap_or(0.0));
        let wide = |column: usize| number(column, &|v| wrong_size(v, LEAST));
        let sigma = match wide(SIGMA)? {
            Some(sigma) => sigma,
            None => wide(RADIUS)?.unwrap_or(0.0) * SIGMA_PER_RADIUS,
        };
        let (sigma, shape) = match sigma {
            // A blob without a size has no shape.
            0.0 => (sigma, Shape::BALL),
            _ => {
                let other = |column: usize, than: [f64; 2]| {
                    let wrong = |v| than.into_iter().find_map(|than| wrong_height(v, than));
                    number(column, &|v| wrong(v).or_else(|| wrong_size(v, LEAST)))
                };
                let high = other(SIGMA_Y, [sigma; 2])?.unwrap_or(sigma);
                let deep = other(SIGMA_Z, [sigma, high])?;
                let [w, x, y, z] = [0, 1, 2, 3].map(|k| number(TURN.start + k, &|_| None));
                match (deep, w?) {
                    (None, None) => (sigma, Shape::upright(high / sigma)),
                    (deep, w) => {
                        let part = |v: Result<Option<f64>>| Ok(v?.unwrap_or(0.0));
                        let of = DQuat::from_xyzw(part(x)?, part(y)?, part(z)?, w.unwrap_or(1.0));
                        let zero = || {
                            let place = file.place(row, self.0[TURN.start].unwrap_or(0));
                            Error::scene(place, "expected a rotation other than zero, found zeros")
                        };
                        let turn = unit_quaternion(of).ok_or_else(zero)?;
                        Shape::of(DVec3::new(sigma, high, deep.unwrap_or(sigma)), turn)
                    }
                }
            }
        };
        let [x, y, z] = [0, 1, 2].map(|axis| coordinate(POSITION.start + axis));
        let [r, g, b] = [0, 1, 2].map(|channel| size(COLOR.start + channel));
        Ok(Particle {
            position: DVec3::new(x?, y?, z?),
            sigma,
            shape,
            kappa: size(KAPPA)?.unwrap_or(0.0),
            color: DVec3::new(r?.unwrap_or(1.0), g?.unwrap_or(1.0), b?.unwrap_or(1.0)),
        })
    }
}

/// Returns the expected range when `v` is no σ along y beside `sigma` along x and z.
pub(super) fn wrong_height(v: f64, sigma: f64) -> Option<String> {
    let expected = || {
        let [low, high] = [MIN_ASPECT, 1.0 / MIN_ASPECT].map(|of| rounded(of * sigma));
        format!("a number from {low} to {high}, a thousandth to a thousand times the other")
    };
    let within = MIN_ASPECT * (1.0 - 1e-12)..=(1.0 + 1e-12) / MIN_ASPECT;
    (!within.contains(&(v / sigma))).then(expected)
}

#[cfg(test)]
mod tests;
