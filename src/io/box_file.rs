//! Box files, P Table 1: the number of particles, the number of boxes, then a line a box of
//! `particles, x extent, y extent, z extent, x, y, z, radius`.

use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

use glam::DVec3;

use super::atomic::write_atomic;
use super::bounds::{LEAST_EXTENT, shortest, wrong_coordinate, wrong_size};
use super::document::suggest::shown;
use super::text_file::{DATA_LIMIT, line_column, read_text};
use crate::error::{Error, Place, Result};
use crate::model::boxes::CloudBox;

const FIELDS: [&str; 8] =
    ["particles", "x extent", "y extent", "z extent", "x", "y", "z", "radius"];

/// Beginning of a box file, for messages.
pub const FIRST: &str = "the number of particles";

/// Reads a box file.
///
/// # Errors
/// When the file cannot be read or holds a fault.
pub fn read(path: &Path) -> Result<Vec<CloudBox>> {
    parse(&read_text(path, DATA_LIMIT, FIRST)?, path)
}

/// Reads boxes from text; `path` is its name in messages. Fields are separated by commas, spaces or
/// tabs, and blank lines are skipped.
///
/// # Errors
/// When the text holds a fault, with line and column.
pub fn parse(text: &str, path: &Path) -> Result<Vec<CloudBox>> {
    let lines = text.lines().enumerate().map(|(i, line)| Line { number: i + 1, text: line, path });
    let mut lines = lines.filter(|line| !line.text.trim().is_empty());
    let (n_particles, at_particles) = header(lines.next(), FIRST, text, path)?;
    let (n_boxes, at_boxes) = header(lines.next(), "the number of boxes", text, path)?;
    let boxes = lines.map(|line| line.cloud_box()).collect::<Result<Vec<_>>>()?;
    if boxes.len() as u64 != n_boxes {
        return Err(Error::scene(
            at_boxes,
            format!("the file says {n_boxes} boxes and has {}", boxes.len()),
        ));
    }
    let sum: u64 = boxes.iter().map(|b| u64::from(b.n_particles)).sum();
    if sum != n_particles {
        let what = format!("the file says {n_particles} particles and its boxes have {sum}");
        return Err(Error::scene(at_particles, what));
    }
    Ok(boxes)
}

/// Returns text that [`parse`] reads back as equal values.
pub fn format(boxes: &[CloudBox]) -> String {
    let sum: u64 = boxes.iter().map(|b| u64::from(b.n_particles)).sum();
    let mut text = format!("{sum}\n{}\n", boxes.len());
    for b in boxes {
        let numbers: Vec<String> = numbers(b).into_iter().map(shortest).collect();
        text += &format!("{}, {}\n", b.n_particles, numbers.join(", "));
    }
    text
}

/// Returns text like [`format`], in which every box that `old` has too keeps its line. Where the
/// boxes are those of `old`, it is `old`.
fn format_like(old: &str, boxes: &[CloudBox]) -> String {
    let Ok(old_boxes) = parse(old, Path::new("")) else { return format(boxes) };
    if old_boxes.iter().map(bits).eq(boxes.iter().map(bits)) {
        return old.to_owned();
    }
    let lines = old.lines().filter(|line| !line.trim().is_empty()).skip(2);
    let kept: HashMap<_, &str> = old_boxes.iter().map(bits).zip(lines).collect();
    let end = if old.lines().count() == old.matches("\r\n").count() { "\r\n" } else { "\n" };
    let line = |(i, new): (usize, &str)| match i.checked_sub(2).and_then(|i| boxes.get(i)) {
        Some(b) => format!("{}{end}", kept.get(&bits(b)).map_or(new, |line| line.trim_end())),
        None => format!("{new}{end}"),
    };
    format(boxes).lines().enumerate().map(line).collect()
}

/// Returns the fields of a box, which distinguish 0 from −0.
fn bits(b: &CloudBox) -> (u32, [u64; 7]) {
    let numbers = numbers(b);
    (b.n_particles, std::array::from_fn(|i| numbers[i].to_bits()))
}

/// Replaces the file at `path`, or the file that a link at `path` leads to. Lines of boxes that the
/// file has already keep their text.
///
/// # Errors
/// When the file cannot be written, or [`Error::Limit`] when it would be too large to be read.
pub fn write(path: &Path, boxes: &[CloudBox]) -> Result<()> {
    write_like(path, path, boxes)
}

/// Does what [`write`] does, but keeps the lines of the file at `old`.
///
/// # Errors
/// Fails as [`write`] does.
pub fn write_like(path: &Path, old: &Path, boxes: &[CloudBox]) -> Result<()> {
    let old = old.is_file().then(|| read_text(old, DATA_LIMIT, FIRST).ok()).flatten();
    let text = old.map_or_else(|| format(boxes), |old| format_like(&old, boxes));
    if text.len() as u64 > DATA_LIMIT {
        let n_bytes = text.len();
        return Err(Error::limit(format!(
            "a box file has at most {DATA_LIMIT} bytes, and this one {n_bytes}"
        )));
    }
    // A rename would replace the link itself.
    let place = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    write_atomic(&place, |file| file.write_all(text.as_bytes()))
}

/// Returns a message about the first field of a box that [`parse`] would refuse.
pub fn wrong(b: &CloudBox) -> Option<String> {
    numbers(b).into_iter().zip(1..).find_map(|(v, i)| {
        let expected = wrong_number(i, v)?;
        Some(format!("{}: expected {expected}, found {}", FIELDS[i], shortest(v)))
    })
}

/// Returns the fields of a box after the number of particles.
fn numbers(b: &CloudBox) -> Vec<f64> {
    [&b.extent.to_array()[..], &b.center.to_array(), &[b.radius_max]].concat()
}

/// Returns the expected range when `v` is outside the one of field `i`.
fn wrong_number(i: usize, v: f64) -> Option<String> {
    match i {
        1..4 => wrong_size(v, LEAST_EXTENT),
        4..7 => wrong_coordinate(v),
        // The lower limit of a radius depends on `radius_scale`.
        _ => wrong_size(v, 0.0),
    }
}

/// A line of a box file, for messages.
struct Line<'a> {
    number: usize,
    text: &'a str,
    path: &'a Path,
}

/// Byte offset of a field in its line, and its text.
type Field<'a> = (usize, &'a str);

const NO_COMMENTS: &str = "; a box file has no comments";

/// Returns whether a word begins a comment in other formats.
fn is_comment(word: &str) -> bool {
    ["#", "//", ";", "%", "!"].iter().any(|mark| word.starts_with(mark))
}

fn header(line: Option<Line>, meaning: &str, text: &str, path: &Path) -> Result<(u64, Place)> {
    let Some(line) = line else {
        let (number, column) = line_column(text, text.trim_end().len());
        return Err(Error::scene(
            Place::line(path, number, column),
            format!("the file ends: expected {meaning}"),
        ));
    };
    let (fields, _) = line.fields()?;
    let (offset, word) = fields[0];
    let n = word.parse().map_err(|_| {
        let hint = match (meaning == FIRST && word == "x", is_comment(word)) {
            (true, _) => "; a list of particles needs from = \"particles\"",
            (_, true) => NO_COMMENTS,
            _ => "",
        };
        line.fault(offset, format!("expected {meaning}, found `{}`{hint}", shown(word)))
    })?;
    if let Some(extra) = fields.get(1) {
        return Err(line.fault(
            extra.0,
            format!("expected {meaning} alone on its line, found more: `{}`", shown(extra.1)),
        ));
    }
    Ok((n, line.place(offset)))
}

impl<'a> Line<'a> {
    fn place(&self, offset: usize) -> Place {
        Place::line(self.path, self.number, line_column(self.text, offset).1)
    }

    fn fault(&self, offset: usize, what: String) -> Error {
        Error::scene(self.place(offset), what)
    }

    /// Returns the words of a line that is not blank, and their number. At most one word too many
    /// is kept, because those of a line of 64 MiB would take a GiB. An empty place between commas
    /// is an error: skipping it would shift every number after it.
    fn fields(&self) -> Result<(Vec<Field<'a>>, usize)> {
        let mut fields = Vec::new();
        let mut n_fields = 0;
        let mut start = 0;
        for piece in self.text.split(',') {
            let before = n_fields;
            let mut rest = start;
            for word in piece.split_whitespace() {
                // Words come in order, so each is at or after the end of the one before.
                let offset = rest + self.text[rest..].find(word).unwrap_or(0);
                if n_fields <= FIELDS.len() {
                    fields.push((offset, word));
                }
                n_fields += 1;
                rest = offset + word.len();
            }
            if n_fields == before {
                return Err(self
                    .fault(start, "expected a number, found nothing beside the comma".to_owned()));
            }
            start += piece.len() + 1;
        }
        Ok((fields, n_fields))
    }

    fn cloud_box(&self) -> Result<CloudBox> {
        let (fields, n_fields) = self.fields()?;
        if let Some((offset, word)) = fields.iter().find(|(_, word)| is_comment(word)) {
            let what = format!("expected a box, found `{}`{NO_COMMENTS}", shown(word));
            return Err(self.fault(*offset, what));
        }
        if n_fields != FIELDS.len() {
            // At the first word too many, or where the first missing one would be.
            let offset =
                fields.get(FIELDS.len()).map_or(self.text.trim_end().len(), |field| field.0);
            let what = format!("expected 8 fields ({}), found {n_fields}", FIELDS.join(", "));
            return Err(self.fault(offset, what));
        }
        let (mut n_particles, mut v) = (0, [0.0; FIELDS.len()]);
        for (i, (offset, word)) in fields.into_iter().enumerate() {
            let expected = match (i, word.parse::<f64>()) {
                (0, _) => match word.parse() {
                    Ok(n) => {
                        n_particles = n;
                        None
                    }
                    Err(_) => Some(format!("an integer from 0 to {}", u32::MAX)),
                },
                (_, Err(_)) => Some("a number".to_owned()),
                (_, Ok(number)) if !number.is_finite() => Some("a finite number".to_owned()),
                (_, Ok(number)) => {
                    v[i] = number;
                    wrong_number(i, number)
                }
            };
            if let Some(expected) = expected {
                let found = shown(word);
                let what = format!("{}: expected {expected}, found `{found}`", FIELDS[i]);
                return Err(self.fault(offset, what));
            }
        }
        Ok(CloudBox {
            n_particles,
            extent: DVec3::from_slice(&v[1..]),
            center: DVec3::from_slice(&v[4..]),
            radius_max: v[7],
        })
    }
}

#[cfg(test)]
mod tests;
