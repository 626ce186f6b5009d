//! The error over the pixels that clouds cover, relative to the light there.

use std::f64::consts::LN_2;

use super::picture_error::parts;
use crate::error::Result;
use crate::measure::bootstrap::Bootstrap;
use crate::measure::figure::Figure;
use crate::model::scene::Scene;
use crate::reference::picture::{
    FrameReference, Pixels, Reference, ReferenceKind, sums_by_settings,
};

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
    /// Random paths add their variance to the square of a difference. It is taken off there, so
    /// that the mean of the squares is that of more paths. Another reference's own error over all
    /// pixels is part of the value. Its square is taken off the lower end of the interval as if all
    /// of it were in these pixels.
    pub fn error(
        &self,
        pixels: &Pixels,
        picture: &[[f64; 4]],
        reference: &Reference,
    ) -> Option<Figure> {
        let Reference { rgba, own_error, variances, .. } = reference;
        // Sums over the covered pixels of each part of the picture, and their number.
        let of = |f: &dyn Fn(usize) -> f64| {
            let covered = self.0.iter().enumerate();
            parts(pixels, covered.map(|(i, is)| is.then(|| f(i) / 3.0)))
        };
        let squares = of(&|i| {
            let square = |k: usize| (picture[i][k] - rgba[i][k]).powi(2);
            (0..3).map(square).sum::<f64>() - variances.get(i).unwrap_or(&0.0)
        });
        let light = of(&|i| rgba[i][..3].iter().sum());
        let mean = |of: &[(f64, f64)], rows: &[usize]| {
            let sum = rows.iter().map(|&i| of[i]).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
            if sum.1 > 0.0 { sum.0 / sum.1 } else { 0.0 }
        };
        let relative = |rows: &[usize]| {
            let (squares, light) = (mean(&squares, rows), mean(&light, rows));
            // Not max(), which would hide what is no number.
            let squares = if squares < 0.0 { 0.0 } else { squares };
            if light > 0.0 { squares.sqrt() / light } else { 0.0 }
        };
        let all: Vec<usize> = (0..squares.len()).collect();
        let value = relative(&all);
        let n_covered = self.0.iter().filter(|is| **is).count();
        let brightness = mean(&light, &all);
        if !(value.is_finite() && brightness > 0.0) {
            return None;
        }
        let own_error = if variances.is_empty() { *own_error } else { 0.0 };
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
        let of = |rgba: [f64; 4], own_error: f64, variances: &[f64]| Reference {
            rgba: vec![rgba; 8],
            own_error,
            variances: variances.to_vec(),
            accuracy: String::new(),
            seconds: 0.0,
            pixels_s: 0.0,
        };
        let light = [0.5, 0.4, 0.6, 1.0];
        // 0.1 too bright in clouds, by 0.5; anything beside them.
        let picture: Vec<[f64; 4]> =
            of_cloud.0.iter().map(|is| if *is { [0.6, 0.5, 0.7, 0.3] } else { [9.0; 4] }).collect();
        let error = of_cloud.error(&pixels, &picture, &of(light, 0.0, &[])).unwrap();
        assert!((error.value - 0.2).abs() < 1e-15 && (error.low.unwrap() - 0.2).abs() < 1e-12);
        // Noise of 0.03 over all is 0.03 √2 in clouds, a fifth of their light twice.
        let noisy = of_cloud.error(&pixels, &picture, &of(light, 0.03, &[])).unwrap();
        let low = (0.04f64 - 2.0 * 0.06 * 0.06).sqrt();
        assert!((noisy.low.unwrap() - low).abs() < 1e-12 && noisy.high == error.high);
        // Of 0.03 in the squares of three channels 0.0192 are the paths': 0.06² by 0.5² is left.
        let by_paths = of_cloud.error(&pixels, &picture, &of(light, 0.5, &[0.0192; 8])).unwrap();
        assert!((by_paths.value - 0.12).abs() < 1e-15, "{by_paths:?}");
        assert!((by_paths.low.unwrap() - 0.12).abs() < 1e-12);
        // More than all: nothing is left.
        let by_chance = of_cloud.error(&pixels, &picture, &of(light, 0.5, &[0.1; 8])).unwrap();
        assert_eq!((by_chance.value, by_chance.high), (0.0, Some(0.0)));
        let none = CloudPixels(vec![false; 8]);
        assert_eq!(none.error(&pixels, &picture, &of(light, 0.0, &[])), None);
        assert_eq!(of_cloud.error(&pixels, &picture, &of([0.0; 4], 0.0, &[])), None);
        let bad = vec![[f64::NAN; 4]; 8];
        assert_eq!(of_cloud.error(&pixels, &bad, &of(light, 0.0, &[])), None);
    }
}
