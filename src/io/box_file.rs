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
    let old = path.is_file().then(|| read_text(path, DATA_LIMIT, FIRST).ok()).flatten();
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

fn header(line: Option<Line>, meaning: &str, text: &str, path: &Path) -> Result<(u64, Place)> {
    let Some(line) = line else {
        let (number, column) = line_column(text, text.trim_end().len());
        return Err(Error::scene(
            Place::line(path, number, column),
            format!("the file ends: expected {meaning}"),
        ));
    };
    let (fields, _) = line.fields()?;
    if let Some(extra) = fields.get(1) {
        return Err(line.fault(
            extra.0,
            format!("expected {meaning} alone on its line, found more: `{}`", shown(extra.1)),
        ));
    }
    let (offset, word) = fields[0];
    let n = word
        .parse()
        .map_err(|_| line.fault(offset, format!("expected {meaning}, found `{}`", shown(word))))?;
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
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        parse(text, Path::new("b.dat")).expect_err(text).to_string()
    }

    #[test]
    fn commas_blanks_line_ends_and_exponents_are_read() {
        let boxes = parse(
            "7\r\n2\r\n\r\n3,1,2,3,-4,5.5,6.12438e-007, 2\r\n4 1\t2  3 , 4 5 6,2\n\n \n",
            Path::new("b"),
        )
        .unwrap();
        let first = CloudBox {
            n_particles: 3,
            extent: DVec3::new(1.0, 2.0, 3.0),
            center: DVec3::new(-4.0, 5.5, 6.12438e-7),
            radius_max: 2.0,
        };
        let center = DVec3::new(4.0, 5.0, 6.0);
        assert_eq!(boxes, [first, CloudBox { n_particles: 4, center, ..first }]);
        assert_eq!(parse("0\n0", Path::new("b")).unwrap(), []);
    }

    #[test]
    fn faults_have_their_place_and_say_what_was_expected() {
        let one = |line: &str| message(&format!("3\n1\n{line}\n"));
        for (found, expected) in [
            (one("3, 1, 1, 1, 0, 0, 0"), "3:20: EIGHT, found 7"),
            (one("3, 1, 1, 1, 0, 0, 0, 1, 5"), "3:25: EIGHT, found 9"),
            (
                one("3, 1, -1, 1, 0, 0, 0, 1"),
                "3:7: y extent: expected 0 or a number from 1e-30 to 1e15, found `-1`",
            ),
            (
                one("3, 1, 1, 1, 0, 0, 0, -0.5"),
                "3:22: radius: expected a number from 0 to 1e15, found `-0.5`",
            ),
            (
                one("-3, 1, 1, 1, 0, 0, 0, 1"),
                "3:1: particles: expected an integer from 0 to 4294967295, found `-3`",
            ),
            (
                one("3.5, 1, 1, 1, 0, 0, 0, 1"),
                "3:1: particles: expected an integer from 0 to 4294967295, found `3.5`",
            ),
            (
                one("4294967296, 1, 1, 1, 0, 0, 0, 1"),
                "3:1: particles: expected an integer from 0 to 4294967295, found `4294967296`",
            ),
            (one("3, 1, 1, 1, nan, 0, 0, 1"), "3:13: x: expected a finite number, found `nan`"),
            (one("3, 1, 1, 1, 0, 0, 1e999, 1"), "3:19: z: expected a finite number, found `1e999`"),
            (
                one("3, 1, 1, 1e300, 0, 0, 0, 1"),
                "3:10: z extent: expected 0 or a number from 1e-30 to 1e15, found `1e300`",
            ),
            (
                one("3, 1e-31, 1, 1, 0, 0, 0, 1"),
                "3:4: x extent: expected 0 or a number from 1e-30 to 1e15, found `1e-31`",
            ),
            (
                one("3, 1, 1, 1, 0, -1e30, 0, 1"),
                "3:16: y: expected a number from -1e15 to 1e15, found `-1e30`",
            ),
            (
                one("3, 1, 1, 1, 0, 0, 0, 1e16"),
                "3:22: radius: expected a number from 0 to 1e15, found `1e16`",
            ),
            (one("3, 1, 1, 1, 0, o, 0, 1"), "3:16: y: expected a number, found `o`"),
            (one("3, 1,, 1, 0, 0, 0, 1"), "3:6: expected a number, found nothing beside the comma"),
            (
                one("3, 1, 1, 1, 0, 0, 0, 1,"),
                "3:24: expected a number, found nothing beside the comma",
            ),
            (
                one("ä, 1, 1, 1, 0, 0, 0, ö"),
                "3:1: particles: expected an integer from 0 to 4294967295, found `ä`",
            ),
            (message(&format!("3\n1\n{}", "1 ".repeat(99))), "3:17: EIGHT, found 99"),
            (
                message("4\n1\n3, 1, 1, 1, 0, 0, 0, 1"),
                "1:1: the file says 4 particles and its boxes have 3",
            ),
            (message("3\n\n 2\n3, 1, 1, 1, 0, 0, 0, 1"), "3:2: the file says 2 boxes and has 1"),
            (message("3\n0\n3, 1, 1, 1, 0, 0, 0, 1"), "2:1: the file says 0 boxes and has 1"),
            (message("3\n"), "1:2: the file ends: expected the number of boxes"),
            (
                message("3, 1\n1"),
                "1:4: expected the number of particles alone on its line, found more: `1`",
            ),
            (message("3\nx"), "2:1: expected the number of boxes, found `x`"),
            (message("-1\n0"), "1:1: expected the number of particles, found `-1`"),
        ] {
            let eight = format!("expected 8 fields ({})", FIELDS.join(", "));
            assert_eq!(found, format!("b.dat:{}", expected.replace("EIGHT", &eight)));
        }
    }

    #[test]
    fn wrong_is_what_the_reader_refuses() {
        let good =
            CloudBox { n_particles: 1, extent: DVec3::ONE, center: DVec3::ZERO, radius_max: 1.0 };
        let numbers = "0 -0 1e-31 1e-30 1e-300 3 -3 1e15 -1e15 1.1e15 1e300 nan inf";
        let numbers = numbers.split(' ').map(|v| v.parse::<f64>().unwrap());
        let mut n_wrong = 0;
        for v in numbers {
            for i in 0..7 {
                let mut b = good;
                match i {
                    0..3 => b.extent[i] = v,
                    3..6 => b.center[i - 3] = v,
                    _ => b.radius_max = v,
                }
                let refused = parse(&format(&[b]), Path::new("b")).err().map(|e| e.to_string());
                assert_eq!(wrong(&b).is_some(), refused.is_some(), "{b:?}");
                let named = wrong(&b)
                    .is_none_or(|what| what.starts_with(&format!("{}: expected ", FIELDS[i + 1])));
                assert!(named, "{b:?}");
                n_wrong += usize::from(refused.is_some());
            }
        }
        // 1e-31 and 1e-300 three times, −3 and −1e15 four times, and four numbers everywhere.
        assert_eq!(n_wrong, 3 + 3 + 4 + 4 + 4 * 7);
    }

    #[test]
    #[cfg(unix)]
    fn a_link_still_leads_to_the_file_after_a_save() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("a.dat"), folder.path().join("link.dat"));
        std::fs::write(&file, "0\n0\n").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        let b = CloudBox { n_particles: 4, extent: DVec3::ONE, center: DVec3::X, radius_max: 2.0 };
        write(&link, &[b]).unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(
            (read(&file).unwrap(), std::fs::read_dir(folder.path()).unwrap().count()),
            (vec![b], 2)
        );
    }

    #[test]
    fn lines_that_were_not_edited_keep_their_text() {
        let old = "9\r\n3\r\n\r\n3,1.0,2,3,-4,5.50,6.12438e-007, 2\r\n\
            4 1\t2  3 , 4 5 6,2 \r\n2, 1, 1, 1, 0, -0.0, 0, 1";
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("b.dat");
        std::fs::write(&path, old).unwrap();
        let mut boxes = read(&path).unwrap();
        let written = |boxes: &[CloudBox]| {
            write(&path, boxes).unwrap();
            std::fs::read_to_string(&path).unwrap()
        };
        assert_eq!(written(&boxes), old);
        boxes[1].n_particles = 5;
        boxes.push(boxes[0]);
        boxes[2].center.y = 0.0;
        let expected = "13\n4\n3,1.0,2,3,-4,5.50,6.12438e-007, 2\n5, 1, 2, 3, 4, 5, 6, 2\n\
            2, 1, 1, 1, 0, 0, 0, 1\n3,1.0,2,3,-4,5.50,6.12438e-007, 2\n";
        assert_eq!(written(&boxes), expected);
        std::fs::write(&path, expected.replace('\n', "\r\n")).unwrap();
        boxes.pop();
        let ends = |text: String| (text.matches("\r\n").count(), text.matches('\n').count());
        assert_eq!(ends(written(&boxes)), (5, 5));
        std::fs::write(&path, "no boxes").unwrap();
        assert_eq!(written(&boxes), format(&boxes));
    }

    #[test]
    fn what_is_written_reads_back_as_equal_bits() {
        // Knuth's MMIX generator, its high bits.
        let mut state = 1u64;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            state >> 16
        };
        for n in 0..200 {
            let boxes: Vec<CloudBox> = (0..n % 7)
                .map(|_| {
                    // Every exponent that is allowed, and both signs: coordinates and radii from
                    // the subnormals on, edges from their least.
                    let mut number = |least: f64| loop {
                        let v = f64::from_bits(next() << 32 ^ next());
                        if wrong_size(v.abs(), least).is_none() {
                            return v;
                        }
                    };
                    let mut vector =
                        |least| DVec3::new(number(least), number(least), number(least));
                    let (extent, center) = (vector(LEAST_EXTENT).abs(), vector(0.0));
                    let radius_max = vector(0.0).x.abs();
                    CloudBox { n_particles: next() as u32, extent, center, radius_max }
                })
                .collect();
            let text = format(&boxes);
            let again = parse(&text, Path::new("b")).unwrap();
            let bits = |b: &CloudBox| {
                (
                    b.n_particles,
                    [b.extent, b.center].map(|v| v.to_array().map(f64::to_bits)),
                    b.radius_max.to_bits(),
                )
            };
            assert!(boxes.iter().map(bits).eq(again.iter().map(bits)), "{text}");
            assert_eq!(format(&again), text);
        }
    }
}
