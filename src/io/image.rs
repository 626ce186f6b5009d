//! Images: PNG for looking at, EXR for measuring. Images are written from premultiplied linear RGBA
//! pixels, row 0 at the top, and read with the numbers of the file.

use std::io::{Cursor, Seek, Write};
use std::path::Path;

use glam::DVec3;
use image::codecs::openexr::OpenExrEncoder;
use image::codecs::png::PngEncoder;
use image::{ColorType, DynamicImage, ExtendedColorType, ImageEncoder, ImageFormat};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::atomic::write_atomic;
use super::input_file::{self, PICTURE_LIMIT};
use crate::error::{Error, Result};
use crate::model::backdrop::Backdrop;
use crate::model::film::dither;
use crate::model::parallel::parallel_map;

/// Most pixels of a picture that is read: 4096 x 2304. Comparing two of them takes 1.9 GB, as
/// measured, and no command may take more than 2 GiB.
const MOST_READ_PIXELS: u64 = 9 << 20;

/// Format of an image file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ImageKind {
    /// 8-bit sRGB, tone-mapped, over the scene's background.
    Png,
    /// RGBA f32, linear, premultiplied, alpha = 1 − transmittance; no background, no tone map.
    Exr,
}

impl ImageKind {
    /// Returns the format that the extension of `path` names. Callers ask before they render.
    ///
    /// # Errors
    /// When the extension is neither .png nor .exr.
    pub fn of(path: &Path) -> Result<ImageKind> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(ImageKind::Png),
            Some("exr") => Ok(ImageKind::Exr),
            _ => Err(Error::usage(format!(
                "{}: expected a file name that ends in .png or .exr",
                path.display()
            ))),
        }
    }

    /// Returns the file name of a frame's picture. Names sort as the frames do.
    pub fn frame_name(self, i_frame: u32) -> String {
        format!("frame-{i_frame:08}.{}", self.extension())
    }

    /// Returns the extension of file names.
    pub fn extension(self) -> &'static str {
        match self {
            ImageKind::Png => "png",
            ImageKind::Exr => "exr",
        }
    }
}

/// A picture as its file has it, row 0 at the top: the numbers of an EXR, or the code values of a
/// PNG (8 or 16 bits) divided by the greatest one.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Format of the file.
    pub kind: ImageKind,
    /// Pixels of a row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Pixels, row by row.
    pub rgba: Vec<[f64; 4]>,
    /// Whether the file has alpha; otherwise A is 1 everywhere.
    pub has_alpha: bool,
}

/// Reads an image of the format that the extension names.
///
/// # Errors
/// When the file cannot be read or has another format.
pub fn read(path: &Path) -> Result<Image> {
    let kind = ImageKind::of(path)?;
    let format = match kind {
        ImageKind::Png => ImageFormat::Png,
        ImageKind::Exr => ImageFormat::OpenExr,
    };
    let bytes = input_file::read(path, PICTURE_LIMIT).map_err(|e| Error::io(path, e))?;
    let unread =
        |e: image::ImageError| Error::io(path, format!("cannot be read as a picture: {e}"));
    let reader = || image::ImageReader::with_format(Cursor::new(&bytes), format);
    // A few bytes can declare a picture that fills the memory.
    let (width, height) = reader().into_dimensions().map_err(unread)?;
    if u64::from(width) * u64::from(height) > MOST_READ_PIXELS {
        let what =
            format!("{width} x {height} pixels, the limit is {MOST_READ_PIXELS} pixels in all");
        return Err(Error::io(path, what));
    }
    let decoded = reader().decode().map_err(unread)?;
    let (width, height, has_alpha) =
        (decoded.width(), decoded.height(), decoded.color().has_alpha());
    let rgba = match decoded.color() {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {
            four(decoded.into_rgba8().as_raw(), |v| f64::from(*v) / f64::from(u8::MAX))
        }
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            four(decoded.into_rgba16().as_raw(), |v| f64::from(*v) / f64::from(u16::MAX))
        }
        _ => four(DynamicImage::into_rgba32f(decoded).as_raw(), |v| f64::from(*v)),
    };
    Ok(Image { kind, width, height, rgba, has_alpha })
}

fn four<T>(values: &[T], number: impl Fn(&T) -> f64) -> Vec<[f64; 4]> {
    values.chunks_exact(4).map(|p| [0, 1, 2, 3].map(|i| number(&p[i]))).collect()
}

/// Writes 8-bit sRGB pixels, three bytes each, to a PNG file.
///
/// # Errors
/// When the file cannot be written.
///
/// # Panics
/// When `rgb` is not width × height pixels.
pub fn write_bytes(path: &Path, width: u32, height: u32, rgb: &[u8]) -> Result<()> {
    let bytes = png_bytes(width, height, rgb)?;
    write_atomic(path, |writer| writer.write_all(&bytes))
}

/// Returns 8-bit sRGB pixels, three bytes each, as the bytes of a PNG file.
///
/// # Errors
/// When the encoder fails.
///
/// # Panics
/// When `rgb` is not width × height pixels.
pub fn png_bytes(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(rgb, width, height, ExtendedColorType::Rgb8)
        .map_err(not_encoded)?;
    Ok(bytes)
}

fn not_encoded(cause: image::ImageError) -> Error {
    Error::Fault { what: format!("a picture could not be encoded: {cause}") }
}

/// Returns the bytes of the file that [`write`] makes.
///
/// # Errors
/// When the encoder fails.
///
/// # Panics
/// When `rgba` is not width × height pixels.
pub fn encoded(
    kind: ImageKind,
    shown: &Backdrop,
    width: u32,
    height: u32,
    rgba: &[f32],
) -> Result<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    encode(&mut bytes, kind, shown, [width, height], rgba).map_err(not_encoded)?;
    Ok(bytes.into_inner())
}

/// Encodes pixels into `writer`.
fn encode(
    writer: impl Write + Seek,
    kind: ImageKind,
    shown: &Backdrop,
    [width, height]: [u32; 2],
    rgba: &[f32],
) -> image::ImageResult<()> {
    match kind {
        ImageKind::Png => {
            let rgb = display_bytes(shown, width, height, rgba);
            PngEncoder::new(writer).write_image(&rgb, width, height, ExtendedColorType::Rgb8)
        }
        ImageKind::Exr => {
            check_size(width, height, rgba);
            let bytes = bytemuck::cast_slice(rgba);
            OpenExrEncoder::new(writer).write_image(
                bytes,
                width,
                height,
                ExtendedColorType::Rgba32F,
            )
        }
    }
}

/// Writes pixels to a file of the format that the extension names.
///
/// # Errors
/// When the extension names no format or the file cannot be written.
///
/// # Panics
/// When `rgba` is not width × height pixels.
pub fn write(path: &Path, shown: &Backdrop, width: u32, height: u32, rgba: &[f32]) -> Result<()> {
    let kind = ImageKind::of(path)?;
    // The file grows in small pieces. A single write of the whole picture could not be interrupted.
    write_atomic(path, |writer| encode(writer, kind, shown, [width, height], rgba))
}

/// Returns dithered 8-bit sRGB pixels, three bytes each.
///
/// # Panics
/// When `rgba` is not width × height pixels.
pub fn display_bytes(backdrop: &Backdrop, width: u32, height: u32, rgba: &[f32]) -> Vec<u8> {
    check_size(width, height, rgba);
    let n = width as usize;
    let rows = parallel_map(height as usize, |y| {
        let row = rgba[4 * n * y..4 * n * (y + 1)].chunks_exact(4).enumerate();
        let of = row.flat_map(|(x, pixel)| {
            let [r, g, b, a] = [pixel[0], pixel[1], pixel[2], pixel[3]].map(f64::from);
            let shown = backdrop.display(x, y, DVec3::new(r, g, b), a);
            shown.to_array().map(|v| (255.0 * v + dither(x, y)).floor() as u8)
        });
        of.collect::<Vec<u8>>()
    });
    rows.concat()
}

fn check_size(width: u32, height: u32, rgba: &[f32]) {
    assert_eq!(rgba.len() as u64, 4 * u64::from(width) * u64::from(height), "four floats a pixel");
}

/// Returns the SHA-256 (hex) of the pixels as little-endian f32, on any machine.
pub fn image_hash(rgba: &[f32]) -> String {
    let mut hasher = Sha256::new();
    for part in rgba.chunks(4096) {
        hasher.update(part.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>());
    }
    format!("{:x}", hasher.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::film::{Film, FilmFormat, ToneMap};

    #[test]
    fn bayers_matrix_has_each_threshold_once() {
        // The first row of Bayer's 8×8 matrix as printed everywhere.
        let row: Vec<usize> = (0..8).map(|x| (dither(x, 0) * 64.0 - 0.5) as usize).collect();
        assert_eq!(row, [0, 32, 8, 40, 2, 34, 10, 42]);
        let mut all: Vec<usize> =
            (0..64).map(|i| (dither(i % 8, i / 8) * 64.0 - 0.5) as usize).collect();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..64));
    }

    fn film(width: u32, height: u32) -> Backdrop {
        let background = DVec3::new(0.1, 0.5, 0.9);
        Film {
            width,
            height,
            format: FilmFormat::Rgba16f,
            background,
            exposure: 1.0,
            tone_map: ToneMap::Clip,
        }
        .into()
    }

    #[test]
    fn exr_keeps_every_bit_and_png_shows_the_composition() {
        let dir = tempfile::tempdir().unwrap();
        let (exr, png) = (dir.path().join("a.exr"), dir.path().join("a.PNG"));
        let rgba: Vec<f32> = (0..5 * 3 * 4)
            .map(|i| (i as f32 * 0.37).sin().abs() * 1e-3f32.powi(i % 5 - 2))
            .collect();
        write(&exr, &film(5, 3), 5, 3, &rgba).unwrap();
        let read = image::open(&exr).unwrap().into_rgba32f();
        assert_eq!((read.dimensions(), read.as_raw()), ((5, 3), &rgba));

        write(&png, &film(5, 3), 5, 3, &rgba).unwrap();
        let read = image::open(&png).unwrap().into_rgb8();
        for (pixel, shown) in rgba.chunks(4).zip(read.pixels()) {
            let rgb = DVec3::new(f64::from(pixel[0]), f64::from(pixel[1]), f64::from(pixel[2]));
            let exact = film(5, 3).film.display(rgb, f64::from(pixel[3])) * 255.0;
            for channel in 0..3 {
                // Rounding ½ and dither ½: less than one code value.
                assert!((f64::from(shown[channel]) - exact[channel]).abs() < 1.0);
            }
        }
        let bytes = std::fs::read(&png).unwrap();
        write(&png, &film(5, 3), 5, 3, &rgba).unwrap();
        assert_eq!(std::fs::read(&png).unwrap(), bytes);
    }

    #[test]
    fn dither_keeps_the_mean_and_leaves_whole_code_values_alone() {
        // Nothing covers the background, and 64 pixels are one period of the matrix.
        let empty = [0.0f32; 64 * 4];
        let shown = display_bytes(&film(8, 8), 8, 8, &empty);
        let exact = film(8, 8).film.display(DVec3::ZERO, 0.0) * 255.0;
        for channel in 0..3 {
            let mean =
                shown.iter().skip(channel).step_by(3).map(|v| f64::from(*v)).sum::<f64>() / 64.0;
            // Thresholds are 1/64 apart and the mean counts those passed: right to half a step.
            assert!(
                (mean - exact[channel]).abs() <= 0.5 / 64.0 + 1e-9,
                "{mean} {}",
                exact[channel]
            );
        }
        let is = |pixel: [f32; 4], code: [u8; 3]| {
            display_bytes(&film(8, 8), 8, 8, &pixel.repeat(64)).chunks(3).all(|c| c == code)
        };
        assert!(is([2.0, 0.0, 1.0, 1.0], [255, 0, 255]));
        assert!(is([f32::NAN, f32::INFINITY, 0.0, 1.0], [0, 255, 0]));
    }

    #[test]
    fn read_returns_the_numbers_of_the_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        let rgba: Vec<f32> = vec![-1.5, 0.25, 1e6, 1.0, f32::NAN, f32::INFINITY, 1e-30, 0.5];
        write(&path("a.exr"), &film(2, 1), 2, 1, &rgba).unwrap();
        let exr = read(&path("a.exr")).unwrap();
        assert_eq!((exr.kind, exr.width, exr.height, exr.has_alpha), (ImageKind::Exr, 2, 1, true));
        assert!(
            exr.rgba[0] == [-1.5, 0.25, 1e6, 1.0]
                && exr.rgba[1][0].is_nan()
                && exr.rgba[1][3] == 0.5
        );

        write_bytes(&path("a.png"), 2, 1, &[0, 51, 255, 102, 1, 2]).unwrap();
        let png = read(&path("a.png")).unwrap();
        assert_eq!((png.kind, png.has_alpha), (ImageKind::Png, false));
        assert_eq!(png.rgba, [[0.0, 0.2, 1.0, 1.0], [0.4, 1.0 / 255.0, 2.0 / 255.0, 1.0]]);
        // 16 bits keep what 8 would lose: 258/65535 lies between 1/255 and 2/255.
        let deep: image::ImageBuffer<image::Rgba<u16>, _> =
            image::ImageBuffer::from_raw(1, 1, vec![258u16, 65535, 0, 13107]).unwrap();
        deep.save(path("deep.png")).unwrap();
        assert_eq!(read(&path("deep.png")).unwrap().rgba, [[258.0 / 65535.0, 1.0, 0.0, 0.2]]);
    }

    #[test]
    fn a_file_that_is_no_picture_is_an_error_with_its_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        write(&path("whole.png"), &film(8, 8), 8, 8, &[0.5; 256]).unwrap();
        write(&path("whole.exr"), &film(8, 8), 8, 8, &[0.5; 256]).unwrap();
        for kind in ["png", "exr"] {
            let bytes = std::fs::read(path(&format!("whole.{kind}"))).unwrap();
            for (name, bytes) in
                [("cut", &bytes[..bytes.len() / 2]), ("text", b"not a picture"), ("empty", b"")]
            {
                let file = path(&format!("{name}.{kind}"));
                std::fs::write(&file, bytes).unwrap();
                let error = read(&file).unwrap_err().to_string();
                assert!(
                    error
                        .starts_with(&format!("{}: cannot be read as a picture: ", file.display())),
                    "{error}"
                );
            }
        }
        assert!(read(&path("gone.exr")).unwrap_err().to_string().contains("gone.exr: "));
        assert_eq!(read(dir.path()).unwrap_err().exit_code(), 2);
    }

    #[test]
    fn other_extensions_are_usage_errors() {
        for name in ["a.jpg", "a", ".png", "png"] {
            let error = write(Path::new(name), &film(1, 1), 1, 1, &[0.0; 4]).unwrap_err();
            assert_eq!(
                error,
                Error::usage(format!("{name}: expected a file name that ends in .png or .exr"))
            );
        }
    }

    #[test]
    fn the_hash_is_over_the_values_in_little_endian_order() {
        let rgba: Vec<f32> = (0..5000).map(|i| i as f32 * 0.37).collect();
        let bytes: Vec<u8> = rgba.iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(image_hash(&rgba), format!("{:x}", Sha256::digest(&bytes)));
    }
}
