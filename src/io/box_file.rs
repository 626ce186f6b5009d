//! Box files, P Table 1: the number of particles, the number of boxes, then a line a box of
//! `particles, x extent, y extent, z extent, x, y, z, radius`.

use std::path::Path;

use glam::DVec3;

use super::text_file::{DATA_LIMIT, line_column, read_text};
use crate::error::{Error, Place, Result};
use crate::model::boxes::CloudBox;

const FIELDS: [&str; 8] = ["particles", "x extent", "y extent", "z extent", "x", "y", "z", "radius"];

pub fn read(path: &Path) -> Result<Vec<CloudBox>> {
    parse(&read_text(path, DATA_LIMIT)?, path)
}

/// Boxes from text; `path` is for messages. Commas, spaces and tabs separate, blank lines are passed over.
pub fn parse(text: &str, path: &Path) -> Result<Vec<CloudBox>> {
    let lines = text.lines().enumerate().map(|(i, line)| Line { number: i + 1, text: line, path });
    let mut lines = lines.filter(|line| !line.text.trim().is_empty());
    let (n_particles, at_particles) = header(lines.next(), "the number of particles", text, path)?;
    let (n_boxes, at_boxes) = header(lines.next(), "the number of boxes", text, path)?;
    let boxes = lines.map(|line| line.cloud_box()).collect::<Result<Vec<_>>>()?;
    if boxes.len() as u64 != n_boxes {
        return Err(Error::scene(at_boxes, format!("the file says {n_boxes} boxes and has {}", boxes.len())));
    }
    let sum: u64 = boxes.iter().map(|b| u64::from(b.n_particles)).sum();
    if sum != n_particles {
        let what = format!("the file says {n_particles} particles and its boxes have {sum}");
        return Err(Error::scene(at_particles, what));
    }
    Ok(boxes)
}

/// Text that [`parse`] reads back as equal values.
pub fn format(boxes: &[CloudBox]) -> String {
    let sum: u64 = boxes.iter().map(|b| u64::from(b.n_particles)).sum();
    let mut text = format!("{sum}\n{}\n", boxes.len());
    for b in boxes {
        let numbers = [b.extent.to_array().as_slice(), &b.center.to_array(), &[b.radius_max]].concat();
        let numbers: Vec<String> = numbers.into_iter().map(shortest).collect();
        text += &format!("{}, {}\n", b.n_particles, numbers.join(", "));
    }
    text
}

/// The fewest digits that read back as the same number; with an exponent where plain digits would run long.
fn shortest(v: f64) -> String {
    let plain = v == 0.0 || (1e-4..1e9).contains(&v.abs());
    if plain { format!("{v}") } else { format!("{v:e}") }
}

struct Line<'a> {
    number: usize,
    text: &'a str,
    path: &'a Path,
}

/// One field and its byte offset in the line.
type Field<'a> = (usize, &'a str);

fn header(line: Option<Line>, meaning: &str, text: &str, path: &Path) -> Result<(u64, Place)> {
    let Some(line) = line else {
        let (number, column) = line_column(text, text.trim_end().len());
        return Err(Error::scene(Place::line(path, number, column), format!("the file ends: expected {meaning}")));
    };
    let fields = line.fields()?;
    if let Some(extra) = fields.get(1) {
        return Err(line.fault(extra.0, format!("expected {meaning} alone on its line, found more: `{}`", extra.1)));
    }
    let (offset, word) = fields[0];
    let n = word.parse().map_err(|_| line.fault(offset, format!("expected {meaning}, found `{word}`")))?;
    Ok((n, line.place(offset)))
}

impl<'a> Line<'a> {
    fn place(&self, offset: usize) -> Place {
        Place::line(self.path, self.number, line_column(self.text, offset).1)
    }

    fn fault(&self, offset: usize, what: String) -> Error {
        Error::scene(self.place(offset), what)
    }

    /// The words of a line that is not blank: at least one. An empty place between commas is an error, since
    /// passing over it would shift every number after it.
    fn fields(&self) -> Result<Vec<Field<'a>>> {
        let mut fields = Vec::new();
        let mut start = 0;
        for piece in self.text.split(',') {
            let before = fields.len();
            let mut rest = start;
            for word in piece.split_whitespace() {
                // Words come in order, so each is found at or after the end of the one before.
                let offset = rest + self.text[rest..].find(word).unwrap_or(0);
                fields.push((offset, word));
                rest = offset + word.len();
            }
            if fields.len() == before {
                return Err(self.fault(start, "expected a number, found nothing beside the comma".to_owned()));
            }
            start += piece.len() + 1;
        }
        Ok(fields)
    }

    fn cloud_box(&self) -> Result<CloudBox> {
        let fields = self.fields()?;
        if fields.len() != FIELDS.len() {
            // At the first one too many, or where the first missing one would stand.
            let offset = fields.get(FIELDS.len()).map_or(self.text.trim_end().len(), |field| field.0);
            let what = format!("expected 8 fields ({}), found {}", FIELDS.join(", "), fields.len());
            return Err(self.fault(offset, what));
        }
        let number = |i: usize| self.number(FIELDS[i], fields[i]);
        let size = |i: usize| match number(i)? {
            v if v >= 0.0 => Ok(v),
            v => Err(self.fault(fields[i].0, format!("{}: expected at least 0, found {v}", FIELDS[i]))),
        };
        let (offset, word) = fields[0];
        let n_particles = word.parse().map_err(|_| {
            self.fault(offset, format!("particles: expected an integer from 0 to {}, found `{word}`", u32::MAX))
        })?;
        Ok(CloudBox {
            n_particles,
            extent: DVec3::new(size(1)?, size(2)?, size(3)?),
            center: DVec3::new(number(4)?, number(5)?, number(6)?),
            radius_max: size(7)?,
        })
    }

    fn number(&self, name: &str, (offset, word): Field) -> Result<f64> {
        match word.parse::<f64>() {
            Ok(v) if v.is_finite() => Ok(v),
            Ok(_) => Err(self.fault(offset, format!("{name}: expected a finite number, found `{word}`"))),
            Err(_) => Err(self.fault(offset, format!("{name}: expected a number, found `{word}`"))),
        }
    }
}
