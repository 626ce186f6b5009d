//! Colours that change with the direction of view, model.md §14, passes.md "harmonics".
//!
//! In: coefficients of real spherical harmonics; a unit direction. Out: linear RGB. Law: the mean
//! colour and Σ c_lm Y_lm over degree 1 to 3, at least 0. The harmonics come from the recurrences
//! of Legendre's associated functions, whatever their degree.

use glam::DVec3;

use crate::model::harmonics::{Coefficients, MAX_DEGREE, N_HARMONICS};

/// Returns Y_lm of a unit direction, l ascending and m from −l to l, with the phase (−1)^m of
/// Condon and Shortley.
pub fn harmonics(d: DVec3) -> [f64; N_HARMONICS] {
    let degree = MAX_DEGREE as usize;
    let mut all = [0.0; N_HARMONICS];
    // (x + iy)^m is (sin θ)^m e^{imφ}; the functions are divided by (sin θ)^m.
    let (mut real, mut imaginary) = (1.0, 0.0);
    let mut diagonal = 1.0;
    for m in 0..=degree {
        if m > 0 {
            (real, imaginary) = (real * d.x - imaginary * d.y, real * d.y + imaginary * d.x);
            diagonal *= -(2.0 * m as f64 - 1.0);
        }
        let (mut before, mut legendre) = (0.0, diagonal);
        for l in m..=degree {
            if l > m {
                let (of_l, of_m) = (l as f64, m as f64);
                let next = ((2.0 * of_l - 1.0) * d.z * legendre - (of_l + of_m - 1.0) * before)
                    / (of_l - of_m);
                (before, legendre) = (legendre, next);
            }
            // (l − m)! / (l + m)!
            let ratio: f64 = (l - m + 1..=l + m).map(|k| 1.0 / k as f64).product();
            let twice = if m > 0 { 2.0 } else { 1.0 };
            let norm =
                (twice * (2.0 * l as f64 + 1.0) / (4.0 * std::f64::consts::PI) * ratio).sqrt();
            let middle = l * l + l;
            all[middle - m] = norm * legendre * imaginary;
            all[middle + m] = norm * legendre * real;
        }
    }
    all
}

/// Returns the colour toward an eye, where `d` is the unit direction from the eye to the particle;
/// 0 if the eye is there, which sees the mean colour.
pub fn color(of: &Coefficients, d: DVec3) -> DVec3 {
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let mut sum = vector(of[0]);
    if d != DVec3::ZERO {
        let rest = harmonics(d).into_iter().zip(of).skip(1);
        sum += rest.map(|(y, c)| y * vector(*c)).sum::<DVec3>();
    }
    sum.max(DVec3::ZERO)
}

/// Returns the greatest rounding of the device's colour, channel by channel: 168 u Σ |c_k| and 3 u
/// |c_0|.
///
/// A unit direction has relative errors of at most 16 u where a quotient may err by 2.5 ulp and a
/// root by 3. A harmonic is a constant times at most three factors of it and a sum, whose terms are
/// below 3 together: 48 u for the factors and 5 u for the operations make 159 u. Its product and
/// the 16 sums add 9 u, as |Y| is below 0.75.
pub fn rounding(of: &Coefficients) -> DVec3 {
    let size = |k: usize| DVec3::from(of[k].map(f64::from)).abs();
    let rest: DVec3 = (1..N_HARMONICS).map(size).sum();
    super::rounding::U_F32 * (168.0 * rest + 3.0 * size(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The constants and polynomials that Kerbl et al. (2023) published with their rasterizer.
    #[test]
    fn harmonics_equal_the_published_polynomials() {
        for d in [DVec3::new(0.6, -0.48, 0.64), DVec3::new(-2.0, 3.0, 6.0) / 7.0, DVec3::Y] {
            let DVec3 { x, y, z } = d;
            let published = [
                0.282_094_791_773_878_14,
                -0.488_602_511_902_919_9 * y,
                0.488_602_511_902_919_9 * z,
                -0.488_602_511_902_919_9 * x,
                1.092_548_430_592_079_2 * x * y,
                -1.092_548_430_592_079_2 * y * z,
                0.315_391_565_252_520_05 * (2.0 * z * z - x * x - y * y),
                -1.092_548_430_592_079_2 * x * z,
                0.546_274_215_296_039_6 * (x * x - y * y),
                -0.590_043_589_926_643_5 * y * (3.0 * x * x - y * y),
                2.890_611_442_640_554 * x * y * z,
                -0.457_045_799_464_465_8 * y * (4.0 * z * z - x * x - y * y),
                0.373_176_332_590_115_4 * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y),
                -0.457_045_799_464_465_8 * x * (4.0 * z * z - x * x - y * y),
                1.445_305_721_320_277 * z * (x * x - y * y),
                -0.590_043_589_926_643_5 * x * (x * x - 3.0 * y * y),
            ];
            for (k, (found, published)) in harmonics(d).into_iter().zip(published).enumerate() {
                assert!((found - published).abs() < 1e-14, "{k}: {found} {published}");
            }
        }
    }

    /// Σ_m Y_lm² is (2l + 1)/4π in every direction.
    #[test]
    fn harmonics_fulfil_the_addition_theorem() {
        for d in [DVec3::new(0.36, 0.48, -0.8), DVec3::new(6.0, -2.0, 3.0) / 7.0, -DVec3::Z] {
            let all = harmonics(d);
            for l in 0..=MAX_DEGREE as usize {
                let sum: f64 = all[l * l..(l + 1) * (l + 1)].iter().map(|y| y * y).sum();
                let expected = (2.0 * l as f64 + 1.0) / (4.0 * std::f64::consts::PI);
                assert!((sum - expected).abs() < 1e-15 * 10.0, "{l}: {sum}");
            }
        }
    }

    #[test]
    fn a_colour_is_a_sum_and_never_below_0() {
        let mut of = Coefficients::default();
        of[0] = [0.5, 0.25, 0.125];
        assert_eq!(color(&of, DVec3::X), DVec3::new(0.5, 0.25, 0.125));
        // Y_11 = −√(3/4π) x.
        of[3] = [1.0, -1.0, 0.0];
        let y = (0.75 / std::f64::consts::PI).sqrt();
        let found = color(&of, DVec3::X);
        assert!((found - DVec3::new(0.5 - y, 0.25 + y, 0.125)).length() < 1e-15, "{found}");
        of[3] = [2.0, -1.0, 0.0];
        assert_eq!(color(&of, DVec3::X).x, 0.0);
        of[6] = [1.0; 3];
        assert_eq!(color(&of, DVec3::ZERO), DVec3::new(0.5, 0.25, 0.125));
    }
}
