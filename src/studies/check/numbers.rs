//! Sums over the numbers of pixels.

use crate::studies::picture_error::magnitude;

/// Returns a − b, number by number.
pub fn differences(a: &[[f64; 4]], b: &[[f64; 4]]) -> Vec<[f64; 4]> {
    a.iter().zip(b).map(|(a, b)| std::array::from_fn(|k| a[k] - b[k])).collect()
}

/// Returns a + b, number by number.
pub fn sums(a: &[[f64; 4]], b: &[[f64; 4]]) -> Vec<[f64; 4]> {
    a.iter().zip(b).map(|(a, b)| std::array::from_fn(|k| a[k] + b[k])).collect()
}

/// Returns the root mean square of all numbers.
pub fn rms(values: &[[f64; 4]]) -> f64 {
    magnitude(values)
}
