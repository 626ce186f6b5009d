//! The error of a picture against a reference, with an interval.

use serde::{Deserialize, Serialize};

use crate::measure::bootstrap::Bootstrap;
use crate::measure::figure::Figure;
use crate::measure::picture::errors;
use crate::reference::picture::Pixels;

/// Parts of a picture along its longer side. The error of a blob is the same all over its disc, so
/// that single pixels are not independent; parts as large as blobs nearly are.
const N_PARTS: u32 = 12;
/// The reference's own error must be this many times smaller than the error that it measures.
pub const RESOLVED: f64 = 10.0;

/// The difference between a picture and the reference, over premultiplied linear red, green, blue
/// and alpha.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PictureError {
    /// Root mean square. Its interval is over the parts of the picture, widened by the reference's
    /// own error.
    pub rmse: Figure,
    /// Greatest absolute difference.
    pub max: f64,
    /// Mean of squares relative to the reference's ([`crate::measure::picture::Errors::rel_mse`]).
    pub relmse: f64,
    /// Whether the reference's own error is at most a tenth of `rmse`.
    pub is_resolved: bool,
    /// Root mean square over the pixels of cloud, by their mean; only against random paths
    /// ([`super::cloud_error`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cloud: Option<Figure>,
}

/// Returns the error of a picture against `reference`; none if a value of either is not finite.
///
/// *Shape*: `picture` and `reference` have a pixel for each of `pixels`. `own_error` is the root
/// mean square of the reference's own error.
pub fn picture_error(
    pixels: &Pixels,
    picture: &[[f64; 4]],
    reference: &[[f64; 4]],
    own_error: f64,
) -> Option<PictureError> {
    let squares: Vec<f64> = picture.iter().zip(reference).map(|(p, r)| square(p, r)).collect();
    let pairs = reference.iter().flatten().copied().zip(picture.iter().flatten().copied());
    let whole = errors(pairs).filter(|_| squares.iter().all(|s| s.is_finite()))?;
    let parts = parts(pixels, squares.iter().copied().map(Some));
    let root = |rows: &[usize]| {
        let (sum, n) =
            rows.iter().map(|&r| parts[r]).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        if n > 0.0 { (sum / n).sqrt() } else { 0.0 }
    };
    let interval = Bootstrap::default().interval([parts.len()], |[rows]| root(rows));
    let rmse = Figure {
        value: whole.rmse,
        low: interval.map(|i| (i.low.max(0.0) - own_error).max(0.0)),
        high: interval.map(|i| i.high + own_error),
    };
    let is_resolved = own_error * RESOLVED <= whole.rmse;
    Some(PictureError { rmse, max: whole.max_abs, relmse: whole.rel_mse, is_resolved, cloud: None })
}

/// The difference of one pixel by its drawing, and two independent estimates of the difference by
/// its light, if there are any.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Samples {
    drawing: [f64; 4],
    light: Option<[[f64; 4]; 2]>,
}

impl Samples {
    /// Returns the samples of a pixel.
    pub fn new(drawing: [f64; 4], light: Option<[[f64; 4]; 2]>) -> Samples {
        Samples { drawing, light }
    }

    /// Returns the difference, by the mean of both estimates.
    pub fn difference(&self) -> [f64; 4] {
        let [a, b] = self.light.unwrap_or_default();
        std::array::from_fn(|k| self.drawing[k] + 0.5 * (a[k] + b[k]))
    }

    /// Returns the greatest magnitude of the difference.
    pub fn greatest(&self) -> f64 {
        self.difference().into_iter().map(f64::abs).fold(0.0, f64::max)
    }

    /// Returns the square of the drawing's difference, and what the light adds to it.
    fn squares(&self) -> (f64, Option<f64>) {
        let mean = |of: &dyn Fn(usize) -> f64| (0..4).map(of).sum::<f64>() / 4.0;
        let drawing = mean(&|k| self.drawing[k] * self.drawing[k]);
        let light = self
            .light
            .map(|[a, b]| mean(&|k| (self.drawing[k] + a[k]) * (self.drawing[k] + b[k])) - drawing);
        (drawing, light)
    }
}

/// Returns the root mean square difference with its interval over the parts of the picture, widened
/// by the reference's own error; none if a value is not finite.
pub fn rmse_of(pixels: &Pixels, samples: &[Samples], own_error: f64) -> Option<Figure> {
    let squares: Vec<(f64, Option<f64>)> = samples.iter().map(Samples::squares).collect();
    let is_finite = |(drawing, light): &(f64, Option<f64>)| {
        drawing.is_finite() && light.is_none_or(f64::is_finite)
    };
    if !squares.iter().all(is_finite) {
        return None;
    }
    let drawing = parts(pixels, squares.iter().map(|s| Some(s.0)));
    let light = parts(pixels, squares.iter().map(|s| s.1));
    let mean = |rows: &[usize], of: &[(f64, f64)]| {
        let sum = rows.iter().map(|&r| of[r]).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        if sum.1 > 0.0 { sum.0 / sum.1 } else { 0.0 }
    };
    let root = |rows: &[usize]| (mean(rows, &drawing) + mean(rows, &light)).max(0.0).sqrt();
    let interval = Bootstrap::default().interval([drawing.len()], |[rows]| root(rows));
    let rows: Vec<usize> = (0..drawing.len()).collect();
    Some(Figure {
        value: root(&rows),
        low: interval.map(|i| (i.low.max(0.0) - own_error).max(0.0)),
        high: interval.map(|i| i.high + own_error),
    })
}

/// Returns the values of a device's picture (RGBA, rows from the top) at `pixels`.
pub fn sampled(pixels: &Pixels, rgba: &[f32]) -> Vec<[f64; 4]> {
    let whole: Vec<[f64; 4]> =
        rgba.chunks_exact(4).map(|p| [0, 1, 2, 3].map(|k| f64::from(p[k]))).collect();
    pixels.pick(&whole)
}

/// Returns the root mean square of all values of a picture.
pub fn magnitude(rgba: &[[f64; 4]]) -> f64 {
    let squares: f64 = rgba.iter().flatten().map(|v| v * v).sum();
    (squares / (4 * rgba.len()).max(1) as f64).sqrt()
}

/// Returns the mean square difference of two pixels.
fn square(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / 4.0
}

/// Returns, for every part of the picture, the sum of the values that it has and their number.
pub(super) fn parts(
    pixels: &Pixels,
    squares: impl Iterator<Item = Option<f64>>,
) -> Vec<(f64, f64)> {
    let side = pixels.width.max(pixels.height).div_ceil(N_PARTS).max(1);
    let columns = pixels.width.div_ceil(side) as usize;
    let mut parts = vec![(0.0, 0.0); columns * pixels.height.div_ceil(side) as usize];
    for ([i, j], square) in pixels.at.iter().zip(squares) {
        let part = &mut parts[(j / side) as usize * columns + (i / side) as usize];
        if let Some(square) = square {
            *part = (part.0 + square, part.1 + 1.0);
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_offset_is_the_error_with_no_spread() {
        let pixels = Pixels::all(24, 12);
        let (a, b) = (vec![[0.5; 4]; 288], vec![[0.4; 4]; 288]);
        let e = picture_error(&pixels, &a, &b, 0.0).unwrap();
        let (low, high) = (e.rmse.low.unwrap(), e.rmse.high.unwrap());
        assert!(
            (e.rmse.value - 0.1).abs() < 1e-15
                && (low - 0.1).abs() < 1e-12
                && (high - 0.1).abs() < 1e-12
        );
        assert!(e.is_resolved && (e.max - 0.1).abs() < 1e-15);
        // The reference's own error widens the interval and decides what is resolved.
        let e = picture_error(&pixels, &a, &b, 0.02).unwrap();
        assert!(
            (e.rmse.low.unwrap() - 0.08).abs() < 1e-12
                && (e.rmse.high.unwrap() - 0.12).abs() < 1e-12
        );
        assert!(!e.is_resolved && picture_error(&pixels, &a, &b, 0.009).unwrap().is_resolved);
    }

    #[test]
    fn an_error_in_few_parts_has_a_wider_interval() {
        let pixels = Pixels::all(48, 48);
        let zero = vec![[0.0; 4]; 48 * 48];
        let with = |n: usize| {
            let mut picture = zero.clone();
            // n parts of 4 × 4 pixels, spread over the picture, with the error that gives the same
            // RMSE for every n.
            for k in 0..n {
                let (i, j) = (4 * (k * 5 % 12), 4 * (k / 12 * 3 % 12));
                for y in j..j + 4 {
                    for x in i..i + 4 {
                        picture[y * 48 + x] = [(144.0 / n as f64).sqrt() * 0.1; 4];
                    }
                }
            }
            picture_error(&pixels, &picture, &zero, 0.0).unwrap()
        };
        let (few, many) = (with(3), with(36));
        let width = |e: &PictureError| e.rmse.high.unwrap() - e.rmse.low.unwrap();
        assert!((few.rmse.value - 0.1).abs() < 1e-12 && (many.rmse.value - 0.1).abs() < 1e-12);
        assert!(width(&few) > 3.0 * width(&many), "{} {}", width(&few), width(&many));
    }

    #[test]
    fn a_picture_that_is_not_finite_has_no_error() {
        let pixels = Pixels::all(2, 1);
        let (zero, bad) = ([[0.0; 4]; 2], [[0.0; 4], [f64::NAN, 0.0, 0.0, 0.0]]);
        assert_eq!(
            (picture_error(&pixels, &bad, &zero, 0.0), picture_error(&pixels, &zero, &bad, 0.0)),
            (None, None)
        );
    }
}
