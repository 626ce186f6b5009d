//! Temperature, humidity and density of air, with the formulas and constants of wrf-python (NCAR),
//! model.md §15.

use crate::model::moisture::{Saturation, Vapour};

/// Gravity that converts geopotential to height, m/s².
pub const GRAVITY: f64 = 9.81;
/// Gas constant of dry air, J/(kg K).
pub const R_DRY: f64 = 287.0;
/// Specific heat of dry air at constant pressure, J/(kg K): 7/2 of [`R_DRY`], so that R/c_p is 2/7.
pub const HEAT_CAPACITY: f64 = 3.5 * R_DRY;
/// Potential temperature minus WRF's T, K.
const THETA_BASE_K: f64 = 300.0;
/// Pressure at which potential temperature equals temperature, Pa.
const P0_PA: f64 = 1e5;
/// Molecular weight of water over that of dry air.
pub const EPSILON: f64 = 0.622;
/// Range of air temperatures on Earth, K. Values outside are not temperatures; Bolton's formula has
/// a pole at 29.65 K.
pub const TEMPERATURES_K: (f64, f64) = (100.0, 400.0);
/// Range of air pressures, Pa; WRF's tops lie above 100 Pa.
pub const PRESSURES_PA: (f64, f64) = (0.1, 120_000.0);

/// Returns the temperature θ (p/p₀)^(2/7), K, from WRF's T = θ − 300 K.
pub fn temperature(perturbation_k: f64, p_pa: f64) -> f64 {
    (perturbation_k + THETA_BASE_K) * (p_pa / P0_PA).powf(2.0 / 7.0)
}

/// Bolton over water, which wrf-python uses at every temperature with the same constants.
const WATER: Vapour = Vapour { saturation: Saturation::Bolton, ice: false };

/// Returns the saturation vapour pressure over water, Pa. *Source*: Bolton 1980 (10).
pub fn saturation_pa(t_k: f64) -> f64 {
    WATER.saturation(t_k)
}

/// Returns the mixing ratio of saturated air, kg/kg: ε E/(p − (1 − ε) E). Infinite where water
/// boils. It is wrf-python's formula; its 1 − ε makes q/q_s the quotient of specific humidities.
pub fn saturation_ratio(p_pa: f64, t_k: f64) -> f64 {
    ratio(p_pa, saturation_pa(t_k))
}

/// Returns the mixing ratio of air at a vapour pressure E.
fn ratio(p_pa: f64, e: f64) -> f64 {
    let dry = p_pa - (1.0 - EPSILON) * e;
    if dry > 0.0 { EPSILON * e / dry } else { f64::INFINITY }
}

/// Returns q_v over [`saturation_ratio`], or over that of ice below 273.15 K: above 1 in
/// supersaturated air.
pub fn humidity_over_ice(q_vapour: f64, p_pa: f64, t_k: f64) -> f64 {
    q_vapour / ratio(p_pa, Vapour { ice: true, ..WATER }.saturation(t_k))
}

/// Returns the density of the air's dry part, kg/m³, which mixing ratios refer to: p/(R_d T (1 +
/// q_v/ε)).
pub fn dry_density(p_pa: f64, t_k: f64, q_vapour: f64) -> f64 {
    p_pa / (R_DRY * t_k * (1.0 + q_vapour / EPSILON))
}

/// Returns the height in metres of a geopotential in m²/s².
pub fn height(geopotential: f64) -> f64 {
    geopotential / GRAVITY
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn air_by_hand() {
        // At p = p₀ potential temperature is temperature; at half of it the factor is 2^(−2/7) =
        // 0.820335.
        assert_eq!(temperature(0.0, P0_PA), 300.0);
        assert!((temperature(0.0, 5e4) - 246.1005).abs() < 1e-3);
        // Bolton 1980, table 1, which his (10) matches within 0.3 %: 6.112 hPa at 0 °C, 23.37 at 20
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
        assert_eq!(humidity_over_ice(saturation_ratio(9e4, 280.0), 9e4, 280.0), 1.0);
        assert_eq!(humidity_over_ice(0.01, 100.0, 300.0), 0.0);
        // At −20 °C ice has 1.032 hPa and water 1.254.
        let cold = humidity_over_ice(saturation_ratio(5e4, 253.15), 5e4, 253.15);
        assert!((cold - 1.254 / 1.032).abs() < 5e-3, "{cold}");
        assert!((height(9810.0) - 1000.0).abs() < 1e-9);
    }
}
