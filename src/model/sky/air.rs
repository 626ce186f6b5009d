//! Optical depth of clear air between two heights, in closed form.
//!
//! Molecules and aerosol thin out as e^{−h/H}. The earth is flat: at the horizon the air has no
//! end.

use glam::DVec3;

use super::sunlight::{aerosol, molecules};

/// Heights over which molecules and aerosol thin out to 1/e, m.
pub const SCALE_HEIGHTS_M: [f64; 2] = [8000.0, 1200.0];

/// Wavelengths that stand for the channels, µm.
const WAVELENGTHS: DVec3 = DVec3::new(0.615, 0.535, 0.465);

/// Least sine of an elevation: below it the air to space is opaque.
pub const LEAST_UP: f64 = 1e-6;

/// Clear air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClearAir {
    /// Vertical optical depths of molecules and aerosol, by channel.
    pub vertical: [DVec3; 2],
}

impl ClearAir {
    /// Returns the air of a turbidity.
    pub fn new(turbidity: f64) -> ClearAir {
        let (molecules, aerosol) = (molecules, |l| aerosol(turbidity, l));
        ClearAir { vertical: [WAVELENGTHS.map(molecules), WAVELENGTHS.map(aerosol)] }
    }

    /// Returns the optical depth of a straight way of `length_m` from one height to another, m.
    /// Below the sea level the air is as dense as there.
    pub fn between(&self, from_m: f64, to_m: f64, length_m: f64) -> DVec3 {
        let (low, high) = (from_m.min(to_m).max(0.0), from_m.max(to_m).max(0.0));
        let of = |(vertical, height): (&DVec3, f64)| {
            let x = (high - low) / height;
            let mean = if x > 1e-9 { -(-x).exp_m1() / x } else { 1.0 };
            *vertical * (length_m / height * (-low / height).exp() * mean)
        };
        self.vertical.iter().zip(SCALE_HEIGHTS_M).map(of).sum()
    }

    /// Returns the optical depth from a height to space, in a direction whose sine of elevation is
    /// `up`.
    pub fn toward_space(&self, from_m: f64, up: f64) -> DVec3 {
        let low = from_m.max(0.0);
        let of = |(vertical, height): (&DVec3, f64)| *vertical * (-low / height).exp();
        let all: DVec3 = self.vertical.iter().zip(SCALE_HEIGHTS_M).map(of).sum();
        all / up.max(LEAST_UP)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_the_sum_of_its_steps() {
        let air = ClearAir::new(3.0);
        for (from, to, length) in [(0.0, 9000.0, 20e3), (5000.0, 200.0, 4800.0), (1e3, 1e3, 7e3)] {
            let n = 20_000;
            let step = |k: usize| {
                let h = from + (to - from) * (k as f64 + 0.5) / n as f64;
                let of = |(v, s): (&DVec3, f64)| *v / s * (-h / s).exp();
                air.vertical.iter().zip(SCALE_HEIGHTS_M).map(of).sum::<DVec3>()
            };
            let sum = (0..n).map(step).sum::<DVec3>() * (length / n as f64);
            let found = air.between(from, to, length);
            assert!((found / sum - 1.0).abs().max_element() < 1e-6, "{found} {sum}");
            assert_eq!(found, air.between(to, from, length));
        }
        // Far up, the way ends.
        let far = air.between(1000.0, 1e6, (1e6 - 1000.0) / 0.5);
        assert!((far / air.toward_space(1000.0, 0.5) - 1.0).abs().max_element() < 1e-6);
    }

    #[test]
    fn the_depth_of_the_molecules_is_that_of_tables() {
        // Bucholtz 1995: 0.098 at 0.55 µm from sea level; Fröhlich and Shaw's law has 0.1003.
        assert!((molecules(0.55) - 0.100).abs() < 0.003);
        assert_eq!(ClearAir::new(0.9).vertical[1], DVec3::ZERO);
    }
}
