//! Pictures embedded in the page, and differences of two pictures.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use crate::error::{Error, Result};
use crate::io::image::{self, png_bytes};
use crate::io::input_file::{self, PICTURE_LIMIT};
use crate::measure::picture::flip::{PIXELS_PER_DEGREE, flip};
use crate::measure::picture::{Errors, errors};
use crate::report::charts::number;

/// The bytes of a PNG file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Png {
    bytes: Vec<u8>,
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
}

impl Png {
    /// Reads a file of `folder`; None if there is no such file. Names of other folders are refused,
    /// because they could put any file of the machine into the page.
    ///
    /// # Errors
    /// Fails if the name is that of another folder, or the file is no PNG or cannot be read.
    pub fn read(folder: &Path, name: &str) -> Result<Option<Png>> {
        let path = folder.join(name);
        if Path::new(name).file_name() != Some(name.as_ref()) {
            return Err(Error::io(
                folder,
                format!("names the picture \"{name}\"; expected a file in that folder"),
            ));
        }
        match input_file::read(&path, PICTURE_LIMIT) {
            Ok(bytes) => Png::of(bytes).map(Some).ok_or_else(|| Error::io(&path, "is no PNG file")),
            Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(cause) => Err(Error::io(&path, cause)),
        }
    }

    /// Returns None unless the bytes begin with PNG's signature and header chunk.
    fn of(bytes: Vec<u8>) -> Option<Png> {
        let number = |at: usize| Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
        let is_png = bytes.starts_with(b"\x89PNG\r\n\x1a\n") && bytes.get(12..16)? == b"IHDR";
        let (width, height) = (number(16)?, number(20)?);
        is_png.then_some(Png { bytes, width, height })
    }

    /// Returns the picture with a caption.
    pub fn figure(&self, alt: &str, caption: &str) -> Markup {
        let uri = format!("data:image/png;base64,{}", STANDARD.encode(&self.bytes));
        html! {
            figure class="picture" {
                img src=(uri) width=(self.width) height=(self.height) alt=(alt);
                figcaption { (caption) }
            }
        }
    }
}

/// Returns two pictures, given by folder and name, and the map of their difference. With scripts,
/// a slider shows one above the other. None if a picture is missing.
///
/// # Errors
/// Fails if a picture cannot be read.
pub fn comparison(
    label: &str,
    [(folder_a, a), (folder_b, b)]: [(&Path, &str); 2],
) -> Result<Option<Markup>> {
    let (Some(png_a), Some(png_b)) = (Png::read(folder_a, a)?, Png::read(folder_b, b)?) else {
        return Ok(None);
    };
    let difference = difference(&folder_a.join(a), &folder_b.join(b))?;
    let of = |name: &str| format!("{label}, {name}");
    Ok(Some(html! {
        div class="pair" data-label=(label) data-sizes=[difference.is_some().then_some("same")] {
            (png_a.figure(&of("A"), &of("A")))
            (png_b.figure(&of("B"), &of("B")))
            @match &difference {
                Some(difference) => {
                    (difference.map.figure(&of("FLIP error of every pixel, dark for none"),
                        &difference.caption()))
                }
                None => { p {
                    "A has " (png_a.width) "×" (png_a.height) " pixels, B " (png_b.width) "×"
                    (png_b.height) ": not compared."
                } }
            }
        }
    }))
}

/// The difference of two pictures.
struct Difference {
    /// Errors of the display values (0 to 1) of red, green and blue.
    errors: Errors,
    /// Mean FLIP error.
    flip: f64,
    /// FLIP error of every pixel.
    map: Png,
}

impl Difference {
    fn caption(&self) -> String {
        let Errors { rmse, max_abs, .. } = self.errors;
        let [flip, rmse, most] = [self.flip, rmse, max_abs].map(number);
        format!(
            "difference: FLIP error, dark for none, mean {flip}; display values: RMSE {rmse}, \
             greatest {most}"
        )
    }
}

/// Compares two PNG files; None if their sizes differ.
fn difference(a: &Path, b: &Path) -> Result<Option<Difference>> {
    let (a, b) = (image::read(a)?, image::read(b)?);
    if (a.width, a.height) != (b.width, b.height) {
        return Ok(None);
    }
    let pairs = a.rgba.iter().zip(&b.rgba).flat_map(|(p, q)| (0..3).map(|i| (p[i], q[i])));
    let Some(errors) = errors(pairs) else { return Ok(None) };
    let bytes = |rgba: &[[f64; 4]]| -> Vec<u8> {
        rgba.iter().flat_map(|p| [p[0], p[1], p[2]]).map(|v| (255.0 * v).round() as u8).collect()
    };
    let flip = flip(a.width, a.height, &bytes(&a.rgba), &bytes(&b.rgba), PIXELS_PER_DEGREE);
    let map = png_bytes(a.width, a.height, &flip.shown())?;
    let map = Png { bytes: map, width: a.width, height: a.height };
    Ok(Some(Difference { errors, flip: flip.mean(), map }))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn reads_only_png_files_of_the_folder() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("run");
        fs::create_dir(&folder).unwrap();
        fs::write(dir.path().join("secret.png"), png_bytes(1, 1, &[1, 2, 3]).unwrap()).unwrap();
        fs::write(folder.join("a.png"), png_bytes(3, 2, &[7; 18]).unwrap()).unwrap();
        fs::write(folder.join("text.png"), "no picture").unwrap();
        let read = |name: &str| Png::read(&folder, name);
        assert_eq!(read("a.png").unwrap().map(|p| (p.width, p.height)), Some((3, 2)));
        assert_eq!(read("gone.png").unwrap(), None);
        for name in ["../secret.png", "/etc/hostname", "", "..", "text.png"] {
            assert_eq!(read(name).unwrap_err().exit_code(), 2, "{name}");
        }
    }

    #[test]
    fn difference_of_equal_pictures_is_zero() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, width: u32, value: u8| {
            let path = dir.path().join(name);
            fs::write(&path, png_bytes(width, 20, &vec![value; width as usize * 60]).unwrap())
                .unwrap();
            path
        };
        let (a, b, wide) =
            (write("a.png", 30, 100), write("b.png", 30, 151), write("c.png", 31, 100));
        let same = difference(&a, &a).unwrap().unwrap();
        assert_eq!((same.errors.rmse, same.flip), (0.0, 0.0));
        let other = difference(&a, &b).unwrap().unwrap();
        assert!(
            (other.errors.rmse - 0.2).abs() < 1e-12 && other.flip > 0.01,
            "{} {}",
            other.errors.rmse,
            other.flip
        );
        assert_eq!((other.map.width, other.map.height), (30, 20));
        assert!(difference(&a, &wide).unwrap().is_none());
    }
}
