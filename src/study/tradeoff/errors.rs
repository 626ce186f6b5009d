//! How far a picture is from a reference, with an interval: over the parts of the picture, and by the reference's own error.

use super::records::PictureError;
use crate::measure::bootstrap::Bootstrap;
use crate::measure::picture::errors;
use crate::study::pixels::Pixels;
use crate::study::provenance::Figure;

/// Parts of a picture along its longer side. What a blob is off by it is off by all over its disc: single pixels are no
/// independent draws, parts as large as blobs nearly are.
const N_PARTS: u32 = 12;
/// The reference's own error must be this many times smaller than what it judges.
pub const RESOLVED: f64 = 10.0;

/// Of every part of a picture the sum of its pixels' squared errors, and their number.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Parts(pub Vec<(f64, f64)>);

/// Of a device's picture, pixel by pixel of `pixels`, by `reference`, which is itself off by `own_error`, root mean square.
/// None where some value of either is no finite number.
pub fn picture_error(
    pixels: &Pixels,
    picture: &[[f64; 4]],
    reference: &[[f64; 4]],
    own_error: f64,
) -> Option<(PictureError, Parts)> {
    let squares: Vec<f64> = picture.iter().zip(reference).map(|(p, r)| square(p, r)).collect();
    let pairs = reference.iter().flatten().copied().zip(picture.iter().flatten().copied());
    let whole = errors(pairs).filter(|_| squares.iter().all(|s| s.is_finite()))?;
    let Parts(parts) = parts(pixels, &squares);
    let root = |rows: &[usize]| {
        let (sum, n) = rows.iter().map(|&r| parts[r]).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        if n > 0.0 { (sum / n).sqrt() } else { 0.0 }
    };
    let interval = Bootstrap::default().interval([parts.len()], |[rows]| root(rows));
    let rmse = Figure {
        value: whole.rmse,
        low: interval.map(|i| (i.low.max(0.0) - own_error).max(0.0)),
        high: interval.map(|i| i.high + own_error),
    };
    let is_resolved = own_error * RESOLVED <= whole.rmse;
    Some((PictureError { rmse, max: whole.max_abs, relmse: whole.rel_mse, is_resolved }, Parts(parts)))
}

/// Whether the picture of parts `a` is nearer to the reference than that of `b`, and surely so: two pictures err in the same
/// places, so it is the differences, part by part, whose mean is asked for (Student's t at 97.5 %, the parts being many), and
/// the two must lie further apart than the reference's own error could move them.
pub fn is_surely_nearer(Parts(a): &Parts, Parts(b): &Parts, own_error: f64) -> bool {
    const T: f64 = 2.0;
    let n: f64 = a.iter().map(|(_, n)| n).sum();
    let k = a.len() as f64;
    if n == 0.0 || a.len() != b.len() || a.len() < 2 {
        return false;
    }
    // Of each part its share of the difference of mean squares; their sum is that.
    let shares: Vec<f64> = a.iter().zip(b).map(|((a, _), (b, _))| (b - a) / n).collect();
    let sum: f64 = shares.iter().sum();
    let spread = shares.iter().map(|s| (s - sum / k).powi(2)).sum::<f64>() * k / (k - 1.0);
    let rmse = |parts: &[(f64, f64)]| (parts.iter().map(|(s, _)| s).sum::<f64>() / n).sqrt();
    sum > T * spread.sqrt() && rmse(b) - rmse(a) > 2.0 * own_error
}

/// Mean of the squared differences of a pixel's four numbers.
fn square(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / 4.0
}

/// Of every part of the picture the sum of the squares in it, and their number.
fn parts(pixels: &Pixels, squares: &[f64]) -> Parts {
    let side = pixels.width.max(pixels.height).div_ceil(N_PARTS).max(1);
    let columns = pixels.width.div_ceil(side) as usize;
    let mut parts = vec![(0.0, 0.0); columns * pixels.height.div_ceil(side) as usize];
    for ([i, j], s) in pixels.at.iter().zip(squares) {
        let part = &mut parts[(j / side) as usize * columns + (i / side) as usize];
        *part = (part.0 + s, part.1 + 1.0);
    }
    Parts(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_is_its_size_everywhere() {
        let pixels = Pixels::all(24, 12);
        let (a, b) = (vec![[0.5; 4]; 288], vec![[0.4; 4]; 288]);
        let e = picture_error(&pixels, &a, &b, 0.0).unwrap().0;
        let (low, high) = (e.rmse.low.unwrap(), e.rmse.high.unwrap());
        assert!((e.rmse.value - 0.1).abs() < 1e-15 && (low - 0.1).abs() < 1e-12 && (high - 0.1).abs() < 1e-12);
        assert!(e.is_resolved && (e.max - 0.1).abs() < 1e-15);
        // The reference's own error widens it, and decides what it can judge.
        let e = picture_error(&pixels, &a, &b, 0.02).unwrap().0;
        assert!((e.rmse.low.unwrap() - 0.08).abs() < 1e-12 && (e.rmse.high.unwrap() - 0.12).abs() < 1e-12);
        assert!(!e.is_resolved && picture_error(&pixels, &a, &b, 0.009).unwrap().0.is_resolved);
    }

    #[test]
    fn what_lies_in_few_parts_is_less_certain() {
        let pixels = Pixels::all(48, 48);
        let zero = vec![[0.0; 4]; 48 * 48];
        let with = |n: usize| {
            let mut picture = zero.clone();
            // n parts of 4 × 4 pixels, spread over the picture, each as wrong as makes the same RMSE.
            for k in 0..n {
                let (i, j) = (4 * (k * 5 % 12), 4 * (k / 12 * 3 % 12));
                for y in j..j + 4 {
                    for x in i..i + 4 {
                        picture[y * 48 + x] = [(144.0 / n as f64).sqrt() * 0.1; 4];
                    }
                }
            }
            picture_error(&pixels, &picture, &zero, 0.0).unwrap().0
        };
        let (few, many) = (with(3), with(36));
        let width = |e: &PictureError| e.rmse.high.unwrap() - e.rmse.low.unwrap();
        assert!((few.rmse.value - 0.1).abs() < 1e-12 && (many.rmse.value - 0.1).abs() < 1e-12);
        assert!(width(&few) > 3.0 * width(&many), "{} {}", width(&few), width(&many));
    }

    #[test]
    fn pictures_that_err_alike_are_told_apart_by_their_differences() {
        // Errors between 0 and 0.2 over the picture, and the same with one hundredth more: no intervals of the two could tell.
        let pixels = Pixels::all(48, 48);
        let zero = vec![[0.0; 4]; 48 * 48];
        let of = |factor: f64, jump: f64| {
            let value = |k: usize| {
                factor * 0.2 * ((k / 48 / 4 * 7 + k % 48 / 4 * 5) % 12) as f64 / 12.0 + if k == 7 { jump } else { 0.0 }
            };
            let picture: Vec<[f64; 4]> = (0..48 * 48).map(|k| [value(k); 4]).collect();
            picture_error(&pixels, &picture, &zero, 0.0).unwrap()
        };
        let ((e, a), (f, b)) = (of(1.0, 0.0), of(1.01, 0.0));
        assert!(e.rmse.high > f.rmse.low && is_surely_nearer(&a, &b, 0.0) && !is_surely_nearer(&b, &a, 0.0));
        // Not by more than the reference may be off; nor where all of the difference is in one part; nor equal ones.
        assert!(!is_surely_nearer(&a, &b, 0.6 * (f.rmse.value - e.rmse.value)));
        assert!(!is_surely_nearer(&a, &of(1.0, 1.0).1, 0.0) && !is_surely_nearer(&a, &a, 0.0));
        assert!(!is_surely_nearer(&Parts::default(), &Parts::default(), 0.0));
    }

    #[test]
    fn what_is_no_number_has_no_error() {
        let pixels = Pixels::all(2, 1);
        let (zero, bad) = ([[0.0; 4]; 2], [[0.0; 4], [f64::NAN, 0.0, 0.0, 0.0]]);
        assert_eq!((picture_error(&pixels, &bad, &zero, 0.0), picture_error(&pixels, &zero, &bad, 0.0)), (None, None));
    }
}
