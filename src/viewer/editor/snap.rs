//! Places and sizes on a grid through the origin.

use glam::DVec3;

/// Drags go by the grid where `on`; numbers that are typed are taken as typed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snap {
    pub on: bool,
    /// Scene units between neighbours.
    pub step: f64,
}

impl Default for Snap {
    /// P's tables keep to tenths.
    fn default() -> Self {
        Snap { on: false, step: 0.1 }
    }
}

impl Snap {
    pub fn is_possible(&self) -> bool {
        self.step.is_finite() && self.step > 0.0
    }

    /// The nearest multiple of the step.
    pub fn coordinate(&self, v: f64) -> f64 {
        multiple((v / self.step).round(), self.step)
    }

    pub fn place(&self, v: DVec3) -> DVec3 {
        DVec3::from_array(v.to_array().map(|v| self.coordinate(v)))
    }

    /// The nearest multiple of the step that is at least the step.
    pub fn size(&self, v: f64) -> f64 {
        multiple((v / self.step).round().max(1.0), self.step)
    }
}

/// k times `step` as its decimal is written: 46 · 0.1 is 4.6 and not the 4.6000000000000005 of f64,
/// so that the file has what was meant.
fn multiple(k: f64, step: f64) -> f64 {
    let plain = k * step;
    let written = format!("{step:e}");
    let Some((digits, exponent)) = written.split_once('e') else { return plain };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let (Ok(digits), Ok(exponent)) =
        (format!("{whole}{fraction}").parse::<f64>(), exponent.parse::<i32>())
    else {
        return plain;
    };
    /// Whole numbers up to here are exact.
    const EXACT: f64 = 9_007_199_254_740_992.0;
    let product = k * digits;
    if product.abs() > EXACT || product == 0.0 {
        // Never −0.
        return plain + 0.0;
    }
    format!("{product}e{}", exponent - fraction.len() as i32).parse().unwrap_or(plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiples_are_the_decimals_one_would_write() {
        let snap = |step: f64, v| Snap { on: true, step }.coordinate(v);
        assert_eq!(
            [snap(0.1, 4.62), snap(0.1, -3.449), snap(0.3, 0.95), snap(0.7, 2.0)],
            [4.6, -3.4, 0.9, 2.1]
        );
        assert_eq!(
            [snap(0.25, 1.1), snap(5.0, 12.4), snap(1e-3, 0.123_456), snap(1e3, 2600.0)],
            [1.0, 10.0, 0.123, 3e3]
        );
        assert_ne!(46.0 * 0.1, 4.6);
        // Beyond whole numbers that are exact it is still the nearest that plain arithmetic has.
        assert!((snap(0.1, 1e15) / 1e15 - 1.0).abs() < 1e-15);
        assert!(snap(0.1, -0.01).is_sign_positive());
        assert!(snap(0.1, f64::NAN).is_nan());
    }

    #[test]
    fn sizes_are_never_nothing() {
        let snap = Snap { on: true, step: 0.5 };
        assert_eq!([snap.size(0.1), snap.size(-3.0), snap.size(1.3)], [0.5, 0.5, 1.5]);
        assert!(
            !Snap { on: true, step: 0.0 }.is_possible()
                && !Snap { on: true, step: f64::NAN }.is_possible()
        );
    }
}
