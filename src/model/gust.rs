//! Gusts: frozen-spectrum kinematic turbulence that displaces a cloud's particles
//! (model.md §12; Kraichnan 1970, Fung et al. 1992). A closed form of time, so
//! that any frame can be computed alone.

use std::f64::consts::TAU;

use glam::DVec3;

use super::philox::{philox4x32_10, uniform};

/// Greatest number of waves of a cloud's gusts.
pub const MAX_WAVES: u32 = 2048;

/// Largest over smallest eddy: three octaves.
const SPECTRUM_WIDTH: f64 = 8.0;

/// Last word of the Philox counter for gusts. Particles use 0, so that the streams differ.
const STREAM: u32 = 0x6775_7374;

/// Gusts of a cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gust {
    /// Root mean square displacement, scene units; 0 is calm.
    pub amplitude: f64,
    /// Wavelength of the largest eddy, scene units.
    pub length: f64,
    /// Period of the largest eddy.
    pub period_s: f64,
    /// Number of waves of the spectrum, at least 1.
    pub n_waves: u32,
}

/// A wave of the displacement d(x, t) = Σ a sin(k·x + ω t + φ), a ⟂ k.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Wave vector, radians per scene unit.
    pub k: DVec3,
    /// Amplitude, scene units.
    pub a: DVec3,
    /// Angular frequency, rad/s.
    pub omega: f64,
    /// Phase at time 0.
    pub phase: f64,
}

impl Gust {
    /// No gusts.
    pub const CALM: Gust = Gust { amplitude: 0.0, length: 1.0, period_s: 1.0, n_waves: 16 };

    /// Returns whether there are no gusts.
    fn is_calm(&self) -> bool {
        self.amplitude == 0.0
    }

    /// Returns the waves of a cloud's gusts; none if it is calm. Wave numbers are even in log k.
    /// Displacements fall as 1/k and frequencies rise as k^{2/3}, as the velocities k^{−1/3} of a
    /// Kolmogorov spectrum require.
    pub fn modes(&self, seed: u32) -> Vec<Mode> {
        if self.is_calm() {
            return vec![];
        }
        let first = self.first_amplitude();
        (0..self.n_waves)
            .map(|m| {
                let words = philox4x32_10([seed, STREAM], [m, 0, 0, STREAM]);
                let [u0, u1, u2, u3] = words.map(uniform);
                let direction = on_sphere(u0, u1);
                let across = direction.any_orthonormal_vector();
                let turn = TAU * u2;
                let side = across * turn.cos() + direction.cross(across) * turn.sin();
                Mode {
                    k: direction * (TAU / self.length * self.scale(m)),
                    a: side * (first / self.scale(m)),
                    omega: TAU / self.period_s * self.scale(m).powf(2.0 / 3.0),
                    phase: TAU * u3,
                }
            })
            .collect()
    }

    /// Returns a bound on the displacement: Σ|a|.
    pub fn reach(&self) -> f64 {
        if self.is_calm() {
            return 0.0;
        }
        let first = self.first_amplitude();
        (0..self.n_waves).map(|m| first / self.scale(m)).sum()
    }

    /// |a| of the first wave. The mean square of the sum is half the sum of the squares.
    fn first_amplitude(&self) -> f64 {
        let sum: f64 = (0..self.n_waves).map(|m| 0.5 * self.scale(m).powi(-2)).sum();
        self.amplitude / sum.sqrt()
    }

    /// Wave number of wave m over that of the first wave.
    fn scale(&self, m: u32) -> f64 {
        SPECTRUM_WIDTH.powf(f64::from(m) / f64::from(self.n_waves.max(2) - 1))
    }
}

impl Mode {
    /// Returns ω t + φ, reduced to [0, 2π) in f64, since t may be large.
    pub fn phase_at(&self, time_s: f64) -> f64 {
        (self.omega * time_s + self.phase).rem_euclid(TAU)
    }
}

fn on_sphere(u: f64, v: f64) -> DVec3 {
    let z = 2.0 * u - 1.0;
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * (TAU * v).cos(), r * (TAU * v).sin(), z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn displacement(modes: &[Mode], time_s: f64, x: DVec3) -> DVec3 {
        modes.iter().map(|m| m.a * (m.k.dot(x) + m.phase_at(time_s)).sin()).sum()
    }

    const GUST: Gust = Gust { amplitude: 0.3, length: 4.0, period_s: 5.0, n_waves: 16 };

    #[test]
    fn displacements_have_the_amplitude_asked_for_and_stay_in_reach() {
        let modes = GUST.modes(7);
        let mut sum = 0.0;
        let n = 20_000;
        for i in 0..n {
            let x = DVec3::new(f64::from(i) * 1.37, f64::from(i) * 0.71, f64::from(i) * 2.11);
            let d = displacement(&modes, f64::from(i) * 0.91, x);
            assert!(d.length() <= GUST.reach() + 1e-12);
            sum += d.length_squared();
        }
        // Few modes dominate, so the mean square of n samples scatters by about 1/√n of itself: 5
        // sigma are 4 %.
        assert!((sum / f64::from(n) / 0.09 - 1.0).abs() < 0.04, "{}", sum / f64::from(n));
    }

    #[test]
    fn any_number_of_waves_has_the_same_power_and_the_same_widest_and_narrowest() {
        for n_waves in [1, 2, 64] {
            let gust = Gust { n_waves, ..GUST };
            let modes = gust.modes(7);
            let power: f64 = modes.iter().map(|m| 0.5 * m.a.length_squared()).sum();
            assert!(
                modes.len() == n_waves as usize && (power - 0.09).abs() < 1e-12,
                "{n_waves}: {power}"
            );
            assert!((modes[0].k.length() - TAU / 4.0).abs() < 1e-12);
            let narrowest = modes[n_waves as usize - 1].k.length() / modes[0].k.length();
            assert!(
                (narrowest - if n_waves == 1 { 1.0 } else { 8.0 }).abs() < 1e-12,
                "{narrowest}"
            );
        }
    }

    #[test]
    fn waves_are_transverse_and_calm_has_none() {
        for m in GUST.modes(3) {
            assert!(m.k.dot(m.a).abs() < 1e-14 * m.k.length() * m.a.length() * 10.0);
        }
        assert!(Gust::CALM.modes(3).is_empty());
        assert_eq!(Gust::CALM.reach(), 0.0);
    }

    #[test]
    fn a_phase_keeps_its_accuracy_at_large_times() {
        let m = Mode { k: DVec3::X, a: DVec3::Y, omega: TAU / 4.0, phase: 0.25 };
        assert!((m.phase_at(4e6) - 0.25).abs() < 1e-9);
        assert!((m.phase_at(-3.0) - (TAU / 4.0 + 0.25)).abs() < 1e-12);
    }
}
