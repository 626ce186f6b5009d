//! Sums over the numbers of pixels.

pub use crate::studies::picture_error::magnitude as rms;

/// Returns a − b, number by number.
pub fn differences(a: &[[f64; 4]], b: &[[f64; 4]]) -> Vec<[f64; 4]> {
    a.iter().zip(b).map(|(a, b)| std::array::from_fn(|k| a[k] - b[k])).collect()
}

/// Returns a + b, number by number.
pub fn sums(a: &[[f64; 4]], b: &[[f64; 4]]) -> Vec<[f64; 4]> {
    a.iter().zip(b).map(|(a, b)| std::array::from_fn(|k| a[k] + b[k])).collect()
}
