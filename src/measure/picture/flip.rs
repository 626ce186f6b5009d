//! FLIP (Andersson et al. 2020): the difference that an eye sees when a display alternates between
//! two pictures, computed by NVIDIA's code.

use nv_flip::{FlipImageFloat, FlipImageRgb8, magma_lut};

/// FLIP's default: a display 0.7 m wide with 3840 pixels, seen from 0.7 m, rounded.
pub const PIXELS_PER_DEGREE: f64 = 67.0;

/// The FLIP error of every pixel, 0 to 1.
pub struct Flip {
    map: FlipImageFloat,
}

/// Computes the errors of `b` against the reference `a`, both 8-bit sRGB.
///
/// # Panics
/// Panics if a picture has not three bytes a pixel.
pub fn flip(width: u32, height: u32, a: &[u8], b: &[u8], pixels_per_degree: f64) -> Flip {
    let n = 3 * u64::from(width) * u64::from(height);
    assert!(a.len() as u64 == n && b.len() as u64 == n, "three bytes a pixel");
    let image = |bytes: &[u8]| FlipImageRgb8::with_data(width, height, bytes);
    Flip { map: nv_flip::flip(image(a), image(b), pixels_per_degree as f32) }
}

impl Flip {
    /// Returns the mean, which the authors recommend as the single figure.
    pub fn mean(&self) -> f64 {
        let errors = self.map.to_vec();
        errors.iter().map(|e| f64::from(*e)).sum::<f64>() / errors.len() as f64
    }

    /// Returns the errors in the colours of magma, dark for no error: three bytes of sRGB a pixel.
    pub fn shown(&self) -> Vec<u8> {
        self.map.apply_color_lut(&magma_lut()).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(a: [u8; 3], b: [u8; 3]) -> f64 {
        let picture = |c: [u8; 3]| c.repeat(32 * 24);
        flip(32, 24, &picture(a), &picture(b), PIXELS_PER_DEGREE).mean()
    }

    /// CIELAB of a primary of sRGB (IEC 61966-2-1, D65), its chroma times L/100 for Hunt's effect.
    fn lab([r, g, b]: [f64; 3]) -> [f64; 3] {
        let f = |t: f64| {
            if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 }
        };
        let x = f((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505);
        let y = f(0.2126 * r + 0.7152 * g + 0.0722 * b);
        let z = f((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.0890);
        let l = 116.0 * y - 16.0;
        [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
    }

    /// HyAB distance to the power 0.7.
    fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
        ((a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])).powf(0.7)
    }

    #[test]
    fn equal_pictures_do_not_flip() {
        let noise: Vec<u8> =
            (0..32 * 24 * 3u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        assert_eq!(flip(32, 24, &noise, &noise, PIXELS_PER_DEGREE).mean(), 0.0);
        assert_eq!(PIXELS_PER_DEGREE as f32, nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    }

    #[test]
    fn black_against_white_is_the_papers_formula() {
        // Without edges the error is the colours' alone: x = HyAB^0.7 by its greatest, that of
        // green and blue; above 0.4 of it 0.95 + 0.05 (x − 0.4)/0.6 (Andersson et al. 2020, 5.1).
        let most = hyab(lab([0.0, 1.0, 0.0]), lab([0.0, 0.0, 1.0]));
        let x = 100f64.powf(0.7) / most;
        assert!((mean([0; 3], [255; 3]) - (0.95 + 0.05 * (x - 0.4) / 0.6)).abs() < 1e-3, "{x}");
        // The greatest there is.
        assert!((mean([0, 255, 0], [0, 0, 255]) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn what_differs_little_flips_little() {
        let [near, far] = [mean([128; 3], [130; 3]), mean([128; 3], [160; 3])];
        assert!(0.0 < near && near < 0.1 && near < far && far < 0.9, "{near} {far}");
    }

    #[test]
    fn the_map_is_dark_where_nothing_differs() {
        let a = vec![128u8; 40 * 40 * 3];
        let mut b = a.clone();
        b[..3].copy_from_slice(&[255, 255, 255]);
        let shown = flip(40, 40, &a, &b, PIXELS_PER_DEGREE).shown();
        let sum = |p: &[u8]| p.iter().map(|v| u32::from(*v)).sum::<u32>();
        assert!(sum(&shown[..3]) > 150 && sum(&shown[shown.len() - 3..]) < 10);
    }
}
