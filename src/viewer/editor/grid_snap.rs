//! Snapping of coordinates and sizes to a grid through the origin.

use glam::DVec3;

/// A grid that drags snap to. Typed numbers do not snap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridSnap {
    /// Whether drags snap.
    pub is_on: bool,
    /// Distance of neighbouring grid lines, scene units.
    pub step: f64,
}

impl Default for GridSnap {
    /// Returns the grid of tenths, which P's tables keep to, switched off.
    fn default() -> Self {
        GridSnap { is_on: false, step: 0.1 }
    }
}

impl GridSnap {
    /// Returns whether the step is a positive number.
    pub fn is_valid(&self) -> bool {
        self.step.is_finite() && self.step > 0.0
    }

    /// Returns the multiple of the step nearest to `v`.
    pub fn coordinate(&self, v: f64) -> f64 {
        multiple((v / self.step).round(), self.step)
    }

    /// Returns the grid point nearest to `v`.
    pub fn place(&self, v: DVec3) -> DVec3 {
        DVec3::from_array(v.to_array().map(|v| self.coordinate(v)))
    }

    /// Returns the positive multiple of the step nearest to `v`.
    pub fn size(&self, v: f64) -> f64 {
        multiple((v / self.step).round().max(1.0), self.step)
    }
}

/// Returns k times `step`, rounded to the decimals of `step`: 46 · 0.1 is 4.6, where f64 gives
/// 4.6000000000000005. The file then has the number that the user means.
fn multiple(k: f64, step: f64) -> f64 {
    let (product, written) = (k * step, step.to_string());
    let n_decimals = written.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    // Adding 0 turns −0 into 0.
    format!("{product:.n_decimals$}").parse().unwrap_or(product) + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiples_are_exact_decimals() {
        let snap = |step: f64, v| GridSnap { is_on: true, step }.coordinate(v);
        assert_eq!(
            [snap(0.1, 4.62), snap(0.1, -3.449), snap(0.3, 0.95), snap(0.7, 2.0)],
            [4.6, -3.4, 0.9, 2.1]
        );
        assert_eq!(
            [snap(0.25, 1.1), snap(5.0, 12.4), snap(1e-3, 0.123_456), snap(1e3, 2600.0)],
            [1.0, 10.0, 0.123, 3e3]
        );
        assert_ne!(46.0 * 0.1, 4.6);
        // Beyond exact integers the result is that of f64.
        assert!((snap(0.1, 1e15) / 1e15 - 1.0).abs() < 1e-15);
        assert!(snap(0.1, -0.01).is_sign_positive());
        assert!(snap(0.1, f64::NAN).is_nan());
    }

    #[test]
    fn sizes_are_at_least_one_step() {
        let snap = GridSnap { is_on: true, step: 0.5 };
        assert_eq!([snap.size(0.1), snap.size(-3.0), snap.size(1.3)], [0.5, 0.5, 1.5]);
        assert!(
            !GridSnap { is_on: true, step: 0.0 }.is_valid()
                && !GridSnap { is_on: true, step: f64::NAN }.is_valid()
        );
    }
}
