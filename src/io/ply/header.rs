//! The header of a PLY file (Turk 1994): its format, its elements, and the properties of each.

use std::path::Path;

use crate::error::{Error, Place, Result};
use crate::io::document::suggest::shown;

/// Largest header. One of 3D Gaussian splatting has 1.5 KiB.
const MOST_BYTES: usize = 64 << 10;

/// How the rows are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Numbers as words, a row a line.
    Ascii,
    /// Numbers as bytes, the lowest first.
    Little,
    /// Numbers as bytes, the highest first.
    Big,
}

/// The type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    /// `char`
    I8,
    /// `uchar`
    U8,
    /// `short`
    I16,
    /// `ushort`
    U16,
    /// `int`
    I32,
    /// `uint`
    U32,
    /// `float`
    F32,
    /// `double`
    F64,
}

impl Scalar {
    /// Both names of every type.
    const NAMES: [([&'static str; 2], Scalar); 8] = [
        (["char", "int8"], Scalar::I8),
        (["uchar", "uint8"], Scalar::U8),
        (["short", "int16"], Scalar::I16),
        (["ushort", "uint16"], Scalar::U16),
        (["int", "int32"], Scalar::I32),
        (["uint", "uint32"], Scalar::U32),
        (["float", "float32"], Scalar::F32),
        (["double", "float64"], Scalar::F64),
    ];

    fn named(name: &str) -> Option<Scalar> {
        Self::NAMES.iter().find(|(names, _)| names.contains(&name)).map(|(_, scalar)| *scalar)
    }

    /// Returns the bytes of a number.
    pub fn n_bytes(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// Returns the greatest number of an unsigned integer, by which colours are divided.
    pub fn full(self) -> Option<f64> {
        match self {
            Scalar::U8 => Some(f64::from(u8::MAX)),
            Scalar::U16 => Some(f64::from(u16::MAX)),
            _ => None,
        }
    }
}

/// A property of an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Property {
    /// Its name.
    pub name: String,
    /// Its type; `None` for a list.
    pub scalar: Option<Scalar>,
    /// The header's line that declares it, from 1.
    pub line: usize,
}

/// An element: rows that have the same properties.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Element {
    /// Its name.
    pub name: String,
    /// Number of rows.
    pub n: u64,
    /// The properties of each row, in order.
    pub properties: Vec<Property>,
    /// The header's line that declares it, from 1.
    pub line: usize,
}

impl Element {
    /// Returns the bytes of a row in a binary file; `None` with a list.
    pub fn row_bytes(&self) -> Option<usize> {
        self.properties.iter().map(|p| p.scalar.map(Scalar::n_bytes)).sum()
    }
}

/// A header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// How the rows are written.
    pub format: Format,
    /// The elements, in the order of their rows.
    pub elements: Vec<Element>,
    /// Bytes before the first row.
    pub n_bytes: usize,
    /// Lines before the first row.
    pub n_lines: usize,
}

impl Header {
    /// Reads the header at the start of `bytes`; `path` is the file's name in messages.
    ///
    /// # Errors
    /// When there is no header, with the line that is wrong and what was expected there.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Header> {
        let mut header = Header { format: Format::Ascii, elements: vec![], n_bytes: 0, n_lines: 0 };
        let mut format = None;
        let head = &bytes[..bytes.len().min(MOST_BYTES)];
        loop {
            let line = header.n_lines + 1;
            let fault = |what: String| Err(Error::scene(Place::line(path, line, 1), what));
            let rest = &head[header.n_bytes..];
            let Some(end) = rest.iter().position(|b| *b == b'\n') else {
                return fault(match bytes.len() > MOST_BYTES {
                    true => format!("expected `end_header` within {} KiB", MOST_BYTES >> 10),
                    false if line == 1 => "expected `ply`, the first line of a PLY file".to_owned(),
                    false => "expected `end_header`, found the end of the file".to_owned(),
                });
            };
            header.n_bytes += end + 1;
            header.n_lines = line;
            let Ok(text) = std::str::from_utf8(&rest[..end]) else {
                return fault("expected a line of a PLY header, found no text".to_owned());
            };
            let words: Vec<&str> = text.split_whitespace().collect();
            if line == 1 {
                if words != ["ply"] {
                    return fault("expected `ply`, the first line of a PLY file".to_owned());
                }
                continue;
            }
            match words[..] {
                ["end_header"] => break,
                [] | ["comment" | "obj_info", ..] => {}
                ["format", name, "1.0"] if format.is_none() => match named_format(name) {
                    Some(of) => format = Some(of),
                    None => {
                        return fault(format!(
                            "expected `ascii`, `binary_little_endian` or `binary_big_endian`, \
                             found `{}`",
                            shown(name)
                        ));
                    }
                },
                ["format", ..] if format.is_some() => {
                    return fault("the line `format` stands twice".to_owned());
                }
                ["element", name, n] => {
                    let Ok(n) = n.parse() else {
                        return fault(format!("expected a number of rows, found `{}`", shown(n)));
                    };
                    let (name, properties) = (name.to_owned(), vec![]);
                    header.elements.push(Element { name, n, properties, line });
                }
                ["property", "list", of, items, name]
                    if Scalar::named(of).is_some() && Scalar::named(items).is_some() =>
                {
                    header.add(Property { name: name.to_owned(), scalar: None, line }, path)?;
                }
                ["property", kind, name] => {
                    let Some(scalar) = Scalar::named(kind) else {
                        let known = Scalar::NAMES.map(|(names, _)| format!("`{}`", names[0]));
                        return fault(format!(
                            "expected a type ({}), found `{}`",
                            known.join(", "),
                            shown(kind)
                        ));
                    };
                    header.add(
                        Property { name: name.to_owned(), scalar: Some(scalar), line },
                        path,
                    )?;
                }
                _ => {
                    return fault(format!(
                        "expected `format … 1.0`, `element NAME N`, `property TYPE NAME`, \
                         `comment` or `end_header`, found `{}`",
                        shown(text.trim())
                    ));
                }
            }
        }
        match format {
            Some(format) => Ok(Header { format, ..header }),
            None => Err(Error::scene(
                Place::line(path, header.n_lines, 1),
                "expected a line `format … 1.0` before the end of the header",
            )),
        }
    }

    fn add(&mut self, property: Property, path: &Path) -> Result<()> {
        let place = Place::line(path, property.line, 1);
        let Some(element) = self.elements.last_mut() else {
            return Err(Error::scene(place, "expected an `element` before its properties"));
        };
        if element.properties.iter().any(|p| p.name == property.name) {
            let what = format!("property `{}` stands twice", shown(&property.name));
            return Err(Error::scene(place, what));
        }
        element.properties.push(property);
        Ok(())
    }
}

fn named_format(name: &str) -> Option<Format> {
    match name {
        "ascii" => Some(Format::Ascii),
        "binary_little_endian" => Some(Format::Little),
        "binary_big_endian" => Some(Format::Big),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Header> {
        Header::parse(text.as_bytes(), Path::new("a.ply"))
    }

    #[test]
    fn a_header_has_elements_and_ends_before_the_rows() {
        let text = "ply\r\nformat binary_big_endian 1.0\r\ncomment x\r\nelement vertex 2\r\n\
                    property float x\r\nproperty uchar red\r\nelement face 1\r\n\
                    property list uchar int vertex_index\r\nend_header\r\n\x01\x02";
        let header = parse(text).expect("a header");
        assert_eq!((header.format, header.n_lines), (Format::Big, 9));
        assert_eq!(&text.as_bytes()[header.n_bytes..], [1, 2]);
        let [vertex, face] = &header.elements[..] else { panic!("{header:?}") };
        assert_eq!((vertex.name.as_str(), vertex.n, vertex.row_bytes()), ("vertex", 2, Some(5)));
        assert_eq!((face.n, face.row_bytes()), (1, None));
    }

    #[test]
    fn faults_have_their_line() {
        let start = "ply\nformat ascii 1.0\n";
        for (text, expected) in [
            ("", "1:1: expected `ply`, the first line of a PLY file"),
            ("x,y,z\n", "1:1: expected `ply`, the first line of a PLY file"),
            ("ply\n", "2:1: expected `end_header`, found the end of the file"),
            ("ply\nend_header\n", "2:1: expected a line `format … 1.0` before the end of"),
            (
                "ply\nformat ebcdic 1.0\n",
                "2:1: expected `ascii`, `binary_little_endian` or `binary_big_endian`, found \
                 `ebcdic`",
            ),
            (&format!("{start}element vertex -1\n"), "3:1: expected a number of rows, found `-1`"),
            (&format!("{start}property float x\n"), "3:1: expected an `element` before its"),
            (&format!("{start}element v 1\nproperty half x\n"), "4:1: expected a type (`char`, "),
            (
                &format!("{start}element v 1\nproperty int x\nproperty int x\n"),
                "5:1: property `x` stands twice",
            ),
            (&format!("{start}vertex 1\n"), "3:1: expected `format … 1.0`, `element NAME N`, "),
        ] {
            let error = parse(text).expect_err(text).to_string();
            assert!(error.starts_with(&format!("a.ply:{expected}")), "{error}");
        }
        let long = format!("{start}{}", "comment\n".repeat(9000));
        let error = parse(&long).expect_err("too long").to_string();
        assert!(error.ends_with("expected `end_header` within 64 KiB"), "{error}");
    }
}
