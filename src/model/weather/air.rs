//! Temperature, humidity and density of air, in the formulas and with the constants of wrf-python
//! (NCAR), docs/model.md §15.

use crate::model::moisture::{Saturation, Vapour};

/// m/s², of geopotential to height.
pub const GRAVITY: f64 = 9.81;
/// Gas constant of dry air, J/(kg K).
pub const R_DRY: f64 = 287.0;
/// Specific heat of dry air at constant pressure, J/(kg K): 7/2 of [`R_DRY`], so that R/c_p is 2/7.
pub const HEAT_CAPACITY: f64 = 3.5 * R_DRY;
/// What WRF's T is less than the potential temperature, K.
pub const THETA_BASE_K: f64 = 300.0;
/// Where potential temperature is temperature, Pa.
pub const P0_PA: f64 = 1e5;
/// Molecular weights, water over dry air.
pub const EPSILON: f64 = 0.622;
/// No air of the earth is outside, K: what is there is no temperature. Bolton's formula has a pole
/// at 29.65 K.
pub const TEMPERATURES_K: (f64, f64) = (100.0, 400.0);
/// The same of pressure, Pa; WRF's tops lie above 100 Pa.
pub const PRESSURES_PA: (f64, f64) = (0.1, 120_000.0);

/// T = θ (p/p₀)^(2/7), `perturbation_k` being WRF's T = θ − 300 K.
pub fn temperature(perturbation_k: f64, p_pa: f64) -> f64 {
    (perturbation_k + THETA_BASE_K) * (p_pa / P0_PA).powf(2.0 / 7.0)
}

/// What wrf-python takes at every temperature: Bolton over water, whose formula and constants are
/// the same.
const WATER: Vapour = Vapour { saturation: Saturation::Bolton, ice: false };

/// Saturation vapour pressure over water, Pa: Bolton 1980 (10).
pub fn saturation_pa(t_k: f64) -> f64 {
    WATER.saturation(t_k)
}

/// Mixing ratio of saturated air, kg/kg, ε E/(p − (1 − ε) E): wrf-python's, whose 1 − ε makes q/q_s
/// what a specific humidity's would be. Infinite where water boils.
pub fn saturation_ratio(p_pa: f64, t_k: f64) -> f64 {
    let e = saturation_pa(t_k);
    let dry = p_pa - (1.0 - EPSILON) * e;
    if dry > 0.0 { EPSILON * e / dry } else { f64::INFINITY }
}

/// q_v over [`saturation_ratio`]: above 1 where the air is supersaturated (wrf-python cuts there).
pub fn relative_humidity(q_vapour: f64, p_pa: f64, t_k: f64) -> f64 {
    q_vapour / saturation_ratio(p_pa, t_k)
}

/// Density of the dry part of the air, kg/m³, which mixing ratios count by: p/(R_d T (1 + q_v/ε)).
pub fn dry_density(p_pa: f64, t_k: f64, q_vapour: f64) -> f64 {
    p_pa / (R_DRY * t_k * (1.0 + q_vapour / EPSILON))
}

/// Height in metres of a geopotential in m²/s².
pub fn height(geopotential: f64) -> f64 {
    geopotential / GRAVITY
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn air_by_hand() {
        // Where p = p₀ potential temperature is temperature; at half of it 2^(−2/7) = 0.820335.
        assert_eq!(temperature(0.0, P0_PA), 300.0);
        assert!((temperature(0.0, 5e4) - 246.1005).abs() < 1e-3);
        // Bolton 1980, table 1, which his (10) keeps within 0.3 %: 6.112 hPa at 0 °C, 23.37 at 20
        // °C, 42.43 at 30 °C, 0.1891 at −40 °C.
        for (celsius, hpa) in [(0.0, 6.112), (20.0, 23.37), (30.0, 42.43), (-40.0, 0.1891)] {
            let e = saturation_pa(273.15 + celsius) / 100.0;
            assert!((e / hpa - 1.0).abs() < 3e-3, "{celsius} °C: {e}");
        }
        // Dry air at 0 °C and 1000 hPa: 1e5/(287 · 273.15) = 1.275607 kg/m³; 1 % of vapour takes
        // 1/(1 + 0.01/0.622) of it.
        assert!((dry_density(1e5, 273.15, 0.0) - 1.275607).abs() < 1e-5);
        assert!((dry_density(1e5, 273.15, 0.01) - 1.275607 / 1.0160772).abs() < 1e-5);
        // 0.622 · 23.37/(1000 − 0.378 · 23.37) = 0.014666.
        assert!((saturation_ratio(1e5, 293.15) - 0.014666).abs() < 2e-5);
        assert_eq!(relative_humidity(saturation_ratio(9e4, 280.0), 9e4, 280.0), 1.0);
        assert_eq!(relative_humidity(0.01, 100.0, 300.0), 0.0);
        assert!((height(9810.0) - 1000.0).abs() < 1e-9);
    }
}
