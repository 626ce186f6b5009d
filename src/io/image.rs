//! Images: PNG for looking at, EXR for measuring. Pixels are premultiplied linear RGBA, row 0 the top.

use std::path::Path;

use glam::DVec3;
use image::codecs::openexr::OpenExrEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::atomic::write_atomic;
use crate::error::{Error, Result};
use crate::model::film::Film;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageKind {
    /// 8-bit sRGB, tone-mapped, over the scene's background.
    Png,
    /// RGBA f32, linear, premultiplied, alpha = 1 − transmittance; no background, no tone map.
    Exr,
}

impl ImageKind {
    /// From the extension; to be asked before anything is rendered.
    pub fn of(path: &Path) -> Result<ImageKind> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(ImageKind::Png),
            Some("exr") => Ok(ImageKind::Exr),
            _ => Err(Error::usage(format!("{}: expected a file name that ends in .png or .exr", path.display()))),
        }
    }
}

/// Writes what the extension asks for.
pub fn write(path: &Path, film: &Film, width: u32, height: u32, rgba: &[f32]) -> Result<()> {
    match ImageKind::of(path)? {
        ImageKind::Png => write_png(path, film, width, height, rgba),
        ImageKind::Exr => write_exr(path, width, height, rgba),
    }
}

/// Panics where `rgba` is not width × height pixels.
pub fn write_png(path: &Path, film: &Film, width: u32, height: u32, rgba: &[f32]) -> Result<()> {
    let bytes = display_bytes(film, width, height, rgba);
    write_atomic(path, |writer| PngEncoder::new(writer).write_image(&bytes, width, height, ExtendedColorType::Rgb8))
}

/// Panics where `rgba` is not width × height pixels.
pub fn write_exr(path: &Path, width: u32, height: u32, rgba: &[f32]) -> Result<()> {
    check_size(width, height, rgba);
    let bytes: &[u8] = bytemuck::cast_slice(rgba);
    write_atomic(path, |writer| {
        OpenExrEncoder::new(writer).write_image(bytes, width, height, ExtendedColorType::Rgba32F)
    })
}

/// 8-bit sRGB pixels, dithered.
pub fn display_bytes(film: &Film, width: u32, height: u32, rgba: &[f32]) -> Vec<u8> {
    check_size(width, height, rgba);
    let mut bytes = Vec::with_capacity(rgba.len() / 4 * 3);
    for (i, pixel) in rgba.chunks_exact(4).enumerate() {
        let [r, g, b, a] = [pixel[0], pixel[1], pixel[2], pixel[3]].map(f64::from);
        let threshold = dither(i % width as usize, i / width as usize);
        let shown = film.display(DVec3::new(r, g, b), a);
        bytes.extend(shown.to_array().map(|v| (255.0 * v + threshold).floor() as u8));
    }
    bytes
}

fn check_size(width: u32, height: u32, rgba: &[f32]) {
    assert_eq!(rgba.len() as u64, 4 * u64::from(width) * u64::from(height), "four floats a pixel");
}

/// What is added before rounding down: (B + ½)/64 with Bayer's 8×8 matrix B, between 0 and 1 and ½ on average,
/// so it rounds to nearest with ±½ of a code value of ordered noise. A cloud is all soft gradients: rounded
/// alone, steps of one code value show as bands. Ordered and not random, so that equal pixels give equal files;
/// the same for all three channels, so that grey stays grey; and exact code values stay what they are.
fn dither(x: usize, y: usize) -> f64 {
    // Bits of x ^ y and y interleaved, the lowest first and the greatest weight: Bayer's recursion unrolled.
    let (a, b) = ((x ^ y) & 7, y & 7);
    let bayer = (0..3).fold(0, |sum, i| sum << 2 | (a >> i & 1) << 1 | (b >> i & 1));
    (bayer as f64 + 0.5) / 64.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::film::{FilmFormat, ToneMap};

    #[test]
    fn bayers_matrix_holds_each_threshold_once() {
        // The first row of Bayer's 8×8 matrix as printed everywhere.
        let row: Vec<usize> = (0..8).map(|x| (dither(x, 0) * 64.0 - 0.5) as usize).collect();
        assert_eq!(row, [0, 32, 8, 40, 2, 34, 10, 42]);
        let mut all: Vec<usize> = (0..64).map(|i| (dither(i % 8, i / 8) * 64.0 - 0.5) as usize).collect();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..64));
    }

    fn film(width: u32, height: u32) -> Film {
        let background = DVec3::new(0.1, 0.5, 0.9);
        Film { width, height, format: FilmFormat::Rgba16f, background, exposure: 1.0, tone_map: ToneMap::Clip }
    }

    #[test]
    fn exr_keeps_every_bit_and_png_shows_the_composition() {
        let dir = tempfile::tempdir().unwrap();
        let (exr, png) = (dir.path().join("a.exr"), dir.path().join("a.PNG"));
        let rgba: Vec<f32> = (0..5 * 3 * 4).map(|i| (i as f32 * 0.37).sin().abs() * 1e-3f32.powi(i % 5 - 2)).collect();
        write(&exr, &film(5, 3), 5, 3, &rgba).unwrap();
        let read = image::open(&exr).unwrap().into_rgba32f();
        assert_eq!((read.dimensions(), read.as_raw()), ((5, 3), &rgba));

        write(&png, &film(5, 3), 5, 3, &rgba).unwrap();
        let read = image::open(&png).unwrap().into_rgb8();
        for (pixel, shown) in rgba.chunks(4).zip(read.pixels()) {
            let rgb = DVec3::new(f64::from(pixel[0]), f64::from(pixel[1]), f64::from(pixel[2]));
            let exact = film(5, 3).display(rgb, f64::from(pixel[3])) * 255.0;
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
        // Nothing covers the background; 64 pixels are one period of the matrix.
        let empty = [0.0f32; 64 * 4];
        let shown = display_bytes(&film(8, 8), 8, 8, &empty);
        let exact = film(8, 8).display(DVec3::ZERO, 0.0) * 255.0;
        for channel in 0..3 {
            let mean = shown.iter().skip(channel).step_by(3).map(|v| f64::from(*v)).sum::<f64>() / 64.0;
            // Thresholds are 1/64 apart and the mean counts those passed: right to half a step.
            assert!((mean - exact[channel]).abs() <= 0.5 / 64.0 + 1e-9, "{mean} {}", exact[channel]);
        }
        let white: Vec<f32> = [2.0, 0.0, 1.0, 1.0].repeat(64);
        assert!(display_bytes(&film(8, 8), 8, 8, &white).chunks(3).all(|c| c == [255, 0, 255]));
        let nan: Vec<f32> = [f32::NAN, f32::INFINITY, 0.0, 1.0].repeat(64);
        assert!(display_bytes(&film(8, 8), 8, 8, &nan).chunks(3).all(|c| c == [0, 255, 0]));
    }

    #[test]
    fn other_extensions_are_a_usage_error() {
        for name in ["a.jpg", "a", ".png", "png"] {
            let error = write(Path::new(name), &film(1, 1), 1, 1, &[0.0; 4]).unwrap_err();
            assert_eq!(error, Error::usage(format!("{name}: expected a file name that ends in .png or .exr")));
        }
    }
}
