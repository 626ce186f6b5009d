//! Metrics of the difference between two pictures of one size: errors of their numbers, structural
//! similarity ([`ssim`]) and visible flicker ([`flip`]). The caller knows whether values are linear
//! or for display.

pub mod flip;
pub mod map;
pub mod ssim;

/// ε of relMSE (Rousselle et al. 2011): for values below √ε, a tenth, errors count absolutely and
/// not relative to the value.
pub const RELATIVE_EPSILON: f64 = 0.01;
/// Peak of PSNR, the white of a display.
pub const PEAK: f64 = 1.0;

/// Errors over all numbers of two pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Root mean square.
    pub rmse: f64,
    /// Greatest absolute difference.
    pub max_abs: f64,
    /// Mean of (b − a)²/(a² + ε), with the reference a and ε = [`RELATIVE_EPSILON`].
    pub rel_mse: f64,
    /// −10 log₁₀(mean square/[`PEAK`]²), in dB; infinite for equal pictures.
    pub psnr_db: f64,
}

/// Returns the errors of pairs (a, b) of finite numbers, with the reference a; none for no pair.
pub fn errors(pairs: impl Iterator<Item = (f64, f64)>) -> Option<Errors> {
    let (mut n, mut squares, mut relative, mut max_abs) = (0u64, 0.0, 0.0, 0f64);
    for (a, b) in pairs {
        let square = (b - a) * (b - a);
        n += 1;
        squares += square;
        relative += square / (a * a + RELATIVE_EPSILON);
        max_abs = max_abs.max((b - a).abs());
    }
    if n == 0 {
        return None;
    }
    let mean = squares / n as f64;
    let psnr_db = -10.0 * (mean / (PEAK * PEAK)).log10();
    Some(Errors { rmse: mean.sqrt(), max_abs, rel_mse: relative / n as f64, psnr_db })
}

/// Returns the number of pixels with a channel that is not finite.
pub fn n_not_finite(rgba: &[[f64; 4]]) -> usize {
    rgba.iter().filter(|p| !is_finite(p)).count()
}

/// Returns whether all channels of a pixel are finite.
pub fn is_finite(pixel: &[f64; 4]) -> bool {
    pixel.iter().all(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_offset_by_hand() {
        // 0.1 everywhere: the mean square 0.01 is 20 dB below 1. Of a = 0.3 the relative square is
        // 0.01/(0.09 + 0.01).
        let e = errors((0..100).map(|_| (0.3, 0.4))).unwrap();
        assert!((e.rmse - 0.1).abs() < 1e-15 && (e.max_abs - 0.1).abs() < 1e-15);
        assert!((e.psnr_db - 20.0).abs() < 1e-12 && (e.rel_mse - 0.1).abs() < 1e-14);
        // By a and not by b: 0.01/(0.16 + 0.01).
        let back = errors((0..100).map(|_| (0.4, 0.3))).unwrap();
        assert!((back.rel_mse - 0.01 / 0.17).abs() < 1e-14 && back.rmse == e.rmse);
    }

    #[test]
    fn one_pixel_off_is_its_share() {
        // One of 16 off by 2: RMSE 2/4, greatest 2, PSNR −10 log₁₀ ¼ = 6.0206 dB; relative 4/(0 +
        // 0.01)/16 = 25.
        let e = errors((0..16).map(|i| (0.0, if i == 3 { -2.0 } else { 0.0 }))).unwrap();
        assert_eq!((e.rmse, e.max_abs), (0.5, 2.0));
        assert!(
            (e.psnr_db - 6.020_599_913_279_624).abs() < 1e-12 && (e.rel_mse - 25.0).abs() < 1e-12
        );
    }

    #[test]
    fn the_cases_tell_wrong_metrics_apart() {
        // The two cases above, and what slips of the formulas would make of them.
        let cases: [Vec<(f64, f64)>; 2] = [
            vec![(0.3, 0.4); 100],
            (0..16).map(|i| (0.0, if i == 3 { -2.0 } else { 0.0 })).collect(),
        ];
        let mean = |of: &[(f64, f64)], f: &dyn Fn(f64, f64) -> f64| {
            of.iter().map(|(a, b)| f(*a, *b)).sum::<f64>() / of.len() as f64
        };
        type Wrong = fn(&Errors, &dyn Fn(&dyn Fn(f64, f64) -> f64) -> f64) -> (f64, f64);
        let wrong: [(&str, Wrong); 6] = [
            ("mean difference", |e, m| (e.rmse, m(&|a, b| (b - a).abs()))),
            ("no root", |e, m| (e.rmse, m(&|a, b| (b - a).powi(2)))),
            ("greatest with its sign", |e, m| (e.max_abs, 16.0 * m(&|a, b| b - a))),
            ("relative to b", |e, m| {
                (e.rel_mse, m(&|a, b| (b - a).powi(2) / (b * b + RELATIVE_EPSILON)))
            }),
            ("no ε", |e, m| (e.rel_mse, m(&|a, b| (b - a).powi(2) / (a * a + 1e-12)))),
            ("decibels of the root", |e, m| {
                (e.psnr_db, -10.0 * m(&|a, b| (b - a).powi(2)).sqrt().log10())
            }),
        ];
        for (what, of) in wrong {
            let is_told = cases.iter().any(|case| {
                let e = errors(case.iter().copied()).unwrap();
                let (right, wrong) = of(&e, &|f| mean(case, f));
                (right - wrong).abs() > 1e-3 * right.abs()
            });
            assert!(is_told, "{what}");
        }
    }

    #[test]
    fn equal_pictures_and_none() {
        let e = errors([(0.5, 0.5), (-7.0, -7.0)].into_iter()).unwrap();
        assert_eq!(e, Errors { rmse: 0.0, max_abs: 0.0, rel_mse: 0.0, psnr_db: f64::INFINITY });
        assert_eq!(errors(std::iter::empty()), None);
    }

    #[test]
    fn pixels_that_are_no_numbers_are_counted_once() {
        let bad = [
            [0.0, f64::NAN, f64::INFINITY, 1.0],
            [1e300, -1e300, 0.0, 1.0],
            [0.0, 0.0, 0.0, f64::NEG_INFINITY],
        ];
        assert_eq!(n_not_finite(&bad), 2);
    }
}
