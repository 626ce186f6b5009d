//! Extinction of droplets and crystals in m⁻¹ from their mixing ratios, by geometric optics of
//! spheres, model.md §15.

use crate::model::moisture::T0_K;

/// Material and size of a cloud's particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Phase {
    /// Density of the material.
    pub density_kg_m3: f64,
    /// Effective radius, m.
    pub radius_m: f64,
}

/// Cloud droplets.
pub const LIQUID: Phase = Phase { density_kg_m3: 1000.0, radius_m: 10e-6 };
/// Ice crystals.
pub const ICE: Phase = Phase { density_kg_m3: 917.0, radius_m: 30e-6 };
/// Snow.
pub const SNOW: Phase = Phase { density_kg_m3: 917.0, radius_m: 100e-6 };

impl Phase {
    /// Returns β = 3/2 q ρ_d/(ρ_x r_x), m⁻¹. Spheres much larger than the wavelength have twice
    /// their own cross section.
    pub fn extinction(self, ratio: f64, dry_density: f64) -> f64 {
        1.5 * ratio * dry_density / (self.density_kg_m3 * self.radius_m)
    }
}

/// Returns the phase of cloud water where a scheme has one ratio for both (WSM3): ice below 273.15
/// K.
pub fn single_moment_phase(t_k: f64) -> Phase {
    if t_k < T0_K { ICE } else { LIQUID }
}

/// Greatest mixing ratio, kg/kg: there is no more water than air.
const GREATEST_RATIO: f64 = 1.0;

/// Counts of values that are not mixing ratios.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct InvalidCounts {
    /// Values below 0, which advection leaves behind; they count as 0.
    pub n_negative: u64,
    /// Values that are NaN, infinite or a fill value; they count as 0.
    pub n_missing: u64,
}

impl InvalidCounts {
    /// Replaces each value that is no mixing ratio, kg/kg, by 0 and counts it.
    pub fn clear(&mut self, ratios: &mut [f64]) {
        for ratio in ratios {
            match *ratio {
                q if q.is_nan() || q > GREATEST_RATIO => self.n_missing += 1,
                q if q < 0.0 => self.n_negative += 1,
                _ => continue,
            }
            *ratio = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extinction_by_hand() {
        // 1 g/kg of 10 µm droplets in 1 kg/m³ of air: 1.5 · 1e-3/(1000 · 1e-5) = 0.15 m⁻¹.
        assert!((LIQUID.extinction(1e-3, 1.0) - 0.15).abs() < 1e-15);
        // Ice: 1.5 · 1e-3/(917 · 3e-5) = 0.054526; snow is 0.3 of that: 0.0163577.
        assert!((ICE.extinction(1e-3, 1.0) - 0.0545256).abs() < 1e-6);
        assert!((SNOW.extinction(1e-3, 1.0) - 0.0163577).abs() < 1e-6);
        assert_eq!((single_moment_phase(273.15), single_moment_phase(273.1)), (LIQUID, ICE));
    }

    #[test]
    fn invalid_ratios_are_counted_and_add_nothing() {
        let mut ratios = [1e-3, -1e-9, f64::NAN, f64::INFINITY, 9.969e36, 0.0];
        let mut odd = InvalidCounts::default();
        odd.clear(&mut ratios);
        assert_eq!(odd, InvalidCounts { n_negative: 1, n_missing: 3 });
        assert_eq!(ratios, [1e-3, 0.0, 0.0, 0.0, 0.0, 0.0]);
        odd.clear(&mut ratios);
        assert_eq!(odd, InvalidCounts { n_negative: 1, n_missing: 3 });
    }
}
