//! Particle lists: CSV with the columns `x,y,z,sigma,kappa` and, if given, `sigma_y`, `sigma_z`,
//! `qw,qx,qy,qz` and `r,g,b`, in any order. A column `radius` may stand for sigma = radius / 3.
//! With `sigma_y` alone, sigma is the one along x and z; with `sigma_z`, the one along x. The
//! quaternion q turns these axes.

use std::path::Path;

use csv::{ReaderBuilder, StringRecord};
use glam::{DQuat, DVec3};

use super::bounds::{LEAST, rounded, wrong_coordinate, wrong_size};
use super::document::suggest::{did_you_mean, list, shown};
use super::text_file::line_column;
use crate::error::{Error, Place, Result};
use crate::model::cloud::{MIN_ASPECT, Particle, SIGMA_PER_RADIUS, Shape, unit_quaternion};

const COLUMNS: [&str; 15] = [
    "x", "y", "z", "sigma", "radius", "sigma_y", "kappa", "r", "g", "b", "sigma_z", "qw", "qx",
    "qy", "qz",
];
const POSITION: std::ops::Range<usize> = 0..3;
const SIGMA: usize = 3;
const RADIUS: usize = 4;
const SIGMA_Y: usize = 5;
const KAPPA: usize = 6;
const COLOR: std::ops::Range<usize> = 7..10;
const SIGMA_Z: usize = 10;
const TURN: std::ops::Range<usize> = 11..15;

/// Beginning of a particle list, for messages.
pub const FIRST: &str = "a header x,y,z,sigma (or radius),kappa[,r,g,b]";
/// Hint about rows whose fields are separated by other characters.
const COMMAS: &str = "; commas separate the columns";

/// Reads particles from text, and the line of each; `path` is the text's name in messages.
///
/// # Errors
/// When the text holds a fault, with line and column.
pub fn parse(text: &str, path: &Path) -> Result<(Vec<Particle>, Vec<usize>)> {
    let file = File { text, path };
    let mut reader =
        ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text.as_bytes());
    let mut rows = reader.records();
    let mut next = || rows.find(|row| row.as_ref().map_or(true, |row| !is_blank(row))).transpose();
    let lost = |e: csv::Error| Error::scene(Place::file(path), format!("not readable as CSV: {e}"));

    let Some(header) = next().map_err(lost)? else {
        return Err(Error::scene(
            Place::line(path, 1, 1),
            format!("the file is empty: expected {FIRST}"),
        ));
    };
    file.check_quotes(&header)?;
    let columns = Columns::find(&file, &header)?;
    let (mut particles, mut lines) = (Vec::new(), Vec::new());
    // Lines are counted on from row to row; counting from the start would take the square of the
    // file's length.
    let (mut line, mut counted) = (1, 0);
    while let Some(row) = next().map_err(lost)? {
        file.check_quotes(&row)?;
        if row.len() != header.len() {
            let i = row.len().min(header.len());
            let (n, found) = (header.len(), row.len());
            let hint = if row.iter().any(is_of_several) { COMMAS } else { "" };
            let what = format!("expected {n} fields as in the header, found {found}{hint}");
            return Err(Error::scene(file.place(&row, i), what));
        }
        particles.push(columns.particle(&file, &row)?);
        let start = file.start(&row);
        line += text[counted..start].bytes().filter(|b| *b == b'\n').count();
        counted = start;
        lines.push(line);
    }
    Ok((particles, lines))
}

fn is_blank(row: &StringRecord) -> bool {
    row.len() == 1 && row[0].trim().is_empty()
}

/// Returns whether a field looks like several that are separated by other characters than commas.
fn is_of_several(field: &str) -> bool {
    field.trim().contains(|c: char| c == ';' || c.is_whitespace())
}

struct File<'a> {
    text: &'a str,
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
        let start = row.position().map_or(0, |p| p.byte() as usize).min(self.text.len());
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
        let missing = |of: std::ops::Range<usize>| -> Vec<&str> {
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
mod tests {
    use super::*;

    fn good(text: &str) -> Vec<Particle> {
        parse(text, Path::new("p.csv")).unwrap().0
    }

    #[test]
    fn columns_come_in_any_order_and_colour_is_optional() {
        let list = good("kappa, b,g,r, radius,z,y,x\n2,0.3,0.2,0.1,6,-3,2,1\n");
        let position = DVec3::new(1.0, 2.0, -3.0);
        let expected = Particle {
            shape: Shape::BALL,
            position,
            sigma: 2.0,
            kappa: 2.0,
            color: DVec3::new(0.1, 0.2, 0.3),
        };
        assert_eq!(list, [expected]);
        let flat = good("x,y,z,sigma,sigma_y,kappa\n1,2,-3,2,0.5,2\n0,0,0,0,7,1\n");
        assert_eq!([flat[0].shape, flat[1].shape], [Shape::upright(0.25), Shape::BALL]);
        // A turn by a third about the diagonal: x, y and z become y, z and x.
        let turned = good("x,y,z,sigma,sigma_y,sigma_z,qw,qx,qy,qz,kappa\n0,0,0,3,2,1,2,2,2,2,1\n");
        let extents = turned[0].sigma * turned[0].shape.extents();
        assert!(extents.abs_diff_eq(DVec3::new(1.0, 3.0, 2.0), 3e-5), "{extents}");
        let plain = good("\n\"x\",y,z,sigma,kappa\r\n\r\n1,2,-3, 2.0 ,\"2\"\r\n \r\n");
        assert_eq!(plain, [Particle { color: DVec3::ONE, ..expected }]);
        assert_eq!(good("x,y,z,sigma,kappa"), []);
        let text = "\nx,y,z,sigma,kappa\r\n\r\n1,2,3,4,5\n \n1,2,3,4,5\n1,2,3,4,5";
        assert_eq!(parse(text, Path::new("p.csv")).unwrap().1, [4, 6, 7]);
    }

    #[test]
    fn faults_have_their_place_and_say_what_was_expected() {
        let known = "(known: `x`, `y`, `z`, `sigma`, `radius`, `sigma_y`, `kappa`, `r`, `g`, `b`, \
                     `sigma_z`, `qw`, `qx`, `qy`, `qz`)";
        let row = |row: &str| format!("x,y,z,sigma,kappa\n0,0,0,1,1\r\n\r\n{row}\n");
        for (text, expected) in [
            (
                "x,y,z,sigma,kapa".to_owned(),
                format!(
                    "1:13: unknown column `kapa`; did you mean \
                `kappa`? {known}"
                ),
            ),
            (
                "x,y,z,sigma,kappa,".to_owned(),
                format!(
                    "1:19: unknown column ``; did you mean \
                `x`? {known}"
                ),
            ),
            ("x, x,y,z,sigma,kappa".to_owned(), "1:4: column `x` stands twice".to_owned()),
            ("x,y,sigma,kappa".to_owned(), "1:1: missing column `z`".to_owned()),
            (
                "x,y,z,kappa".to_owned(),
                "1:1: missing column `sigma` (or \
                `radius` = 3 sigma)"
                    .to_owned(),
            ),
            (
                "x,y,z,sigma,kappa,radius".to_owned(),
                "1:19: expected `sigma` or \
                `radius`, found both"
                    .to_owned(),
            ),
            (
                "x,y,z,sigma,kappa,r,b".to_owned(),
                "1:19: expected all of `r`, `g`, `b` or \
                none; missing `g`"
                    .to_owned(),
            ),
            (
                "\n1,2,3,4,5\n".to_owned(),
                "2:1: expected a header x,y,z,sigma (or radius),kappa[,r,g,b], found numbers"
                    .to_owned(),
            ),
            (
                "3\n1\n3, 1, 1, 1, 0, 0, 0, 1\n".to_owned(),
                "1:1: expected a header x,y,z,sigma (or radius),kappa[,r,g,b], found numbers; a \
                 box file needs from = \"boxes\""
                    .to_owned(),
            ),
            (
                "x;y;z;sigma;kappa\n0;0;0;1;1".to_owned(),
                format!(
                    "1:1: unknown column `x;y;z;sigma;kappa`; commas separate the columns {known}"
                ),
            ),
            (
                row("0\t0\t0\t1\t1"),
                "4:10: expected 5 fields as in the header, found 1; commas separate the columns"
                    .to_owned(),
            ),
            (row("0,0,0,1"), "4:8: expected 5 fields as in the header, found 4".to_owned()),
            (row("0,0,0,1,1,7"), "4:11: expected 5 fields as in the header, found 6".to_owned()),
            (
                "x,y,z,sigma,sigma_y,kappa\n0,0,0,2,0.001,1".to_owned(),
                "2:9: sigma_y: expected a number from 2.000e-3 to 2.000e3, a thousandth to a \
                 thousand times the other, found `0.001`"
                    .to_owned(),
            ),
            (row("0,0,zero,1,1"), "4:5: expected a finite number, found `zero`".to_owned()),
            (row("0,0,,1,1"), "4:5: expected a finite number, found ``".to_owned()),
            (row("0,\"0\", inf,1,1"), "4:8: expected a finite number, found `inf`".to_owned()),
            (
                row("0,0,0,-1,1"),
                "4:7: sigma: expected 0 or a number from 1e-15 to \
                1e15, found `-1`"
                    .to_owned(),
            ),
            (
                row("0,0,0,1,-2"),
                "4:9: kappa: expected a number from 0 to \
                1e15, found `-2`"
                    .to_owned(),
            ),
            (
                row("0,0,0,1e-300,1"),
                "4:7: sigma: expected 0 or a number from 1e-15 to 1e15, \
                found `1e-300`"
                    .to_owned(),
            ),
            (
                row("0,0,0,1,1e300"),
                "4:9: kappa: expected a number from 0 to 1e15, \
                found `1e300`"
                    .to_owned(),
            ),
            (
                row("0,1e30,0,1,1"),
                "4:3: y: expected a number from -1e15 to 1e15, \
                found `1e30`"
                    .to_owned(),
            ),
            (row("0,0,\"0,1,1"), "4:5: the quote is not closed on its line".to_owned()),
        ] {
            let error = parse(&text, Path::new("p.csv")).expect_err(&text).to_string();
            assert_eq!(error, format!("p.csv:{expected}"), "for\n{text}");
        }
    }
}
