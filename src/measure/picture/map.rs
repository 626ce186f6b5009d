//! Maps of a picture's error in colours.

use nv_flip::{FlipImageFloat, magma_lut};

/// RMS of a pixel that is shown at the dark and the bright end; each third in between is a decade.
pub const MAP_RANGE: [f64; 2] = [1e-4, 1e-1];

/// Returns a map in the colours of magma by the logarithm of `errors` over [`MAP_RANGE`]: three
/// bytes of sRGB a pixel.
pub fn error_map(width: u32, height: u32, errors: &[f64]) -> Vec<u8> {
    let [low, high] = MAP_RANGE.map(f64::ln);
    // NaN is shown as the greatest error.
    let place = |e: &f64| {
        if e.is_nan() {
            1.0
        } else {
            ((e.max(f64::MIN_POSITIVE).ln() - low) / (high - low)).clamp(0.0, 1.0)
        }
    };
    let values: Vec<f32> = errors.iter().map(|e| place(e) as f32).collect();
    FlipImageFloat::with_data(width, height, &values).apply_color_lut(&magma_lut()).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greater_errors_are_brighter() {
        let map = error_map(6, 1, &[0.0, 1e-4, 1e-3, 1e-2, 1.0, f64::NAN]);
        let sums: Vec<u32> = map.chunks(3).map(|c| c.iter().map(|v| u32::from(*v)).sum()).collect();
        assert!(
            sums[0] == sums[1] && sums[1] < sums[2] && sums[2] < sums[3] && sums[3] < sums[4],
            "{sums:?}"
        );
        assert_eq!((sums[4], map.len()), (sums[5], 18));
    }
}
