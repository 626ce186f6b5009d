//! Extinction of droplets and crystals in m⁻¹ from their mixing ratios: geometric optics of
//! spheres, docs/model.md §15.

use crate::model::moisture::T0_K;

/// What a cloud is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Phase {
    pub density_kg_m3: f64,
    /// Effective radius, m.
    pub radius_m: f64,
}

pub const LIQUID: Phase = Phase { density_kg_m3: 1000.0, radius_m: 10e-6 };
pub const ICE: Phase = Phase { density_kg_m3: 917.0, radius_m: 30e-6 };
pub const SNOW: Phase = Phase { density_kg_m3: 917.0, radius_m: 100e-6 };

impl Phase {
    /// β = 3/2 q ρ_d/(ρ_x r_x): of spheres much larger than the wavelength, whose cross section for
    /// extinction is twice their own.
    pub fn extinction(self, ratio: f64, dry_density: f64) -> f64 {
        1.5 * ratio * dry_density / (self.density_kg_m3 * self.radius_m)
    }
}

/// What cloud water is at a temperature, where a scheme has one ratio for both (WSM3): ice below
/// 273.15 K.
pub fn single_moment_phase(t_k: f64) -> Phase {
    if t_k < T0_K { ICE } else { LIQUID }
}

/// Values that are no mixing ratios, and what became of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct InvalidCounts {
    /// Below 0, which advection leaves behind: taken for 0.
    pub n_negative: u64,
    /// NaN, infinite or a fill value: taken for 0.
    pub n_missing: u64,
}

impl InvalidCounts {
    pub fn is_none(self) -> bool {
        self == InvalidCounts::default()
    }
}

/// Adds what one kind of condensate brings to every cell's extinction. `ratios` are kg/kg, `scale`
/// times what they say; `is_missing` says what stands for no value.
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
        // Ice: 1.5 · 1e-3/(917 · 3e-5) = 0.054526; snow a third of a tenth of that: 0.0163577.
        assert!((ICE.extinction(1e-3, 1.0) - 0.0545256).abs() < 1e-6);
        assert!((SNOW.extinction(1e-3, 1.0) - 0.0163577).abs() < 1e-6);
        assert_eq!((single_moment_phase(273.15), single_moment_phase(273.1)), (LIQUID, ICE));
    }

    #[test]
    fn what_is_no_ratio_is_counted_and_brings_nothing() {
        let mut beta = vec![1.0; 6];
        let ratios = [1e-3, -1e-9, f64::NAN, f64::INFINITY, 9.969e36, 0.0];
        let odd = add(&mut beta, &ratios, |_| 1.0, |_| LIQUID, |q| q > 1e30);
        assert_eq!(odd, InvalidCounts { n_negative: 1, n_missing: 3 });
        assert!((beta[0] - 1.15).abs() < 1e-15);
        assert_eq!(beta[1..], [1.0; 5]);
        assert!(!odd.is_none() && InvalidCounts::default().is_none());
    }
}
