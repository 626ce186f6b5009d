//! The error over the pixels that clouds cover, relative to the light there.

use std::f64::consts::LN_2;

use super::picture_error::parts;
use crate::error::Result;
use crate::measure::bootstrap::Bootstrap;
use crate::measure::figure::Figure;
use crate::model::scene::Scene;
use crate::reference::picture::{FrameReference, Pixels, ReferenceKind, sums_by_settings};

/// Optical depth of the clouds from which on they cover a pixel: half of it.
const COVERING: f64 = LN_2;

/// Whether clouds cover each pixel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CloudPixels(Vec<bool>);

impl CloudPixels {
    /// Returns the pixels that the clouds of `scene` cover at `time_s`, before any surface.
    ///
    /// # Errors
    /// The frame cannot be computed.
    pub fn new(scene: &Scene, time_s: f64, pixels: &Pixels) -> Result<CloudPixels> {
        let exact = ReferenceKind::Thin.without_approximations(scene);
        let frame = FrameReference::unlit(&exact, time_s)?;
        let sums = sums_by_settings(&exact, &frame, pixels);
        Ok(CloudPixels(sums.iter().map(|s| s.optical_depth.value >= COVERING).collect()))
    }

    /// Returns the root mean square difference of the covered pixels' red, green and blue, by
    /// their mean in `reference`. There is none without such pixels or light in them, or where a
    /// value is not finite.
    ///
    /// The reference's own error, `own_error` over all pixels, is part of the value. Its square is
    /// taken off the lower end of the interval as if all of it were in these pixels.
    pub fn error(
        &self,
        pixels: &Pixels,
        picture: &[[f64; 4]],
        reference: &[[f64; 4]],
        own_error: f64,
    ) -> Option<Figure> {
        // Sums over the covered pixels of each part of the picture, and their number.
        let of = |f: fn(f64, f64) -> f64| {
            let of_pixel = |((p, r), is): ((&[f64; 4], &[f64; 4]), &bool)| {
                is.then(|| (0..3).map(|k| f(p[k], r[k])).sum::<f64>() / 3.0)
            };
            parts(pixels, picture.iter().zip(reference).zip(&self.0).map(of_pixel))
        };
        let (squares, light) = (of(|p, r| (p - r) * (p - r)), of(|_, r| r));
        let mean = |of: &[(f64, f64)], rows: &[usize]| {
            let sum = rows.iter().map(|&i| of[i]).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
            if sum.1 > 0.0 { sum.0 / sum.1 } else { 0.0 }
        };
        let relative = |rows: &[usize]| {
            let (squares, light) = (mean(&squares, rows), mean(&light, rows));
            if light > 0.0 { squares.sqrt() / light } else { 0.0 }
        };
        let all: Vec<usize> = (0..squares.len()).collect();
        let value = relative(&all);
        let n_covered = self.0.iter().filter(|is| **is).count();
        let brightness = mean(&light, &all);
        if !(value.is_finite() && brightness > 0.0) {
            return None;
        }
        let noise = own_error / brightness * (self.0.len() as f64 / n_covered as f64).sqrt();
        let interval = Bootstrap::default().interval([squares.len()], |[rows]| relative(rows));
        Some(Figure {
            value,
            low: interval.map(|i| (i.low * i.low - noise * noise).max(0.0).sqrt()),
            high: interval.map(|i| i.high),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_covered_pixels_count() {
        let pixels = Pixels::all(4, 2);
        let of_cloud = CloudPixels([true, true, false, false, true, true, false, false].to_vec());
        let reference = vec![[0.5, 0.4, 0.6, 1.0]; 8];
        // 0.1 too bright in clouds, by 0.5; anything beside them.
        let picture: Vec<[f64; 4]> =
            of_cloud.0.iter().map(|is| if *is { [0.6, 0.5, 0.7, 0.3] } else { [9.0; 4] }).collect();
        let error = of_cloud.error(&pixels, &picture, &reference, 0.0).unwrap();
        assert!((error.value - 0.2).abs() < 1e-15 && (error.low.unwrap() - 0.2).abs() < 1e-12);
        // Noise of 0.03 over all is 0.03 √2 in clouds, a fifth of their light twice.
        let noisy = of_cloud.error(&pixels, &picture, &reference, 0.03).unwrap();
        let low = (0.04f64 - 2.0 * 0.06 * 0.06).sqrt();
        assert!((noisy.low.unwrap() - low).abs() < 1e-12 && noisy.high == error.high);
        let none = CloudPixels(vec![false; 8]);
        assert_eq!(none.error(&pixels, &picture, &reference, 0.0), None);
        let dark = vec![[0.0, 0.0, 0.0, 1.0]; 8];
        assert_eq!(of_cloud.error(&pixels, &picture, &dark, 0.0), None);
        let bad = vec![[f64::NAN; 4]; 8];
        assert_eq!(of_cloud.error(&pixels, &bad, &reference, 0.0), None);
    }
}
