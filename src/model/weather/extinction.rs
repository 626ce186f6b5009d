//! Extinction of droplets and crystals in m⁻¹ from their mixing ratios, by geometric optics of
//! spheres, docs/explanation/model.md §15.

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

/// Counts of values that are not mixing ratios.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct InvalidCounts {
    /// Values below 0, which advection leaves behind; they count as 0.
    pub n_negative: u64,
    /// Values that are NaN, infinite or a fill value; they count as 0.
    pub n_missing: u64,
}

impl InvalidCounts {
    /// Returns whether all values were valid.
    pub fn is_none(self) -> bool {
        self == InvalidCounts::default()
    }
}

/// Adds the extinction of one kind of condensate to every cell. `ratios` are kg/kg; `is_missing`
/// tells the values that stand for no data.
pub fn add(
    extinction: &mut [f64],
    ratios: &[f64],
    dry_density: impl Fn(usize) -> f64,
    phase_of: impl Fn(usize) -> Phase,
    is_missing: impl Fn(f64) -> bool,
) -> InvalidCounts {
    let mut odd = InvalidCounts::default();
    for (i, (beta, &ratio)) in extinction.iter_mut().zip(ratios).enumerate() {
        if !ratio.is_finite() || is_missing(ratio) {
            odd.n_missing += 1;
        } else if ratio < 0.0 {
            odd.n_negative += 1;
        } else {
            *beta += phase_of(i).extinction(ratio, dry_density(i));
        }
    }
    odd
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
        let mut beta = vec![1.0; 6];
        let ratios = [1e-3, -1e-9, f64::NAN, f64::INFINITY, 9.969e36, 0.0];
        let odd = add(&mut beta, &ratios, |_| 1.0, |_| LIQUID, |q| q > 1e30);
        assert_eq!(odd, InvalidCounts { n_negative: 1, n_missing: 3 });
        assert!((beta[0] - 1.15).abs() < 1e-15);
        assert_eq!(beta[1..], [1.0; 5]);
        assert!(!odd.is_none() && InvalidCounts::default().is_none());
    }
}
