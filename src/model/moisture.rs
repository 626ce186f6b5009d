//! Saturation and relative humidity: Clausius–Clapeyron with a constant latent heat, C (1)–(3), docs/model.md §4.

/// Saturation vapour pressure at [`T0_K`], Pa.
pub const E0_PA: f64 = 611.2;
pub const T0_K: f64 = 273.15;
/// Latent heat of evaporation, J/kg, taken to be constant.
pub const LATENT_HEAT: f64 = 2.5e6;
/// Gas constant of water vapour, J/(kg K).
pub const R_VAPOUR: f64 = 461.5;

/// ln(E/E₀) = L/R_v (1/T₀ − 1/T); −∞ at 0 K and below, where nothing evaporates.
fn log_saturation(t_k: f64) -> f64 {
    // 1/T₀ − 1/T as one quotient: the two cancel about T₀.
    if t_k <= 0.0 {
        f64::NEG_INFINITY
    } else if t_k.is_infinite() {
        LATENT_HEAT / R_VAPOUR / T0_K
    } else {
        LATENT_HEAT / R_VAPOUR / T0_K * ((t_k - T0_K) / t_k)
    }
}

/// Saturation vapour pressure E over water at `t_k` kelvin, Pa: 0 at 0 K, finite for every temperature.
pub fn saturation(t_k: f64) -> f64 {
    E0_PA * log_saturation(t_k).exp()
}

/// f = e/E, `vapour_pa` the vapour's pressure e: above 1 where the air holds more than it can, 0 of dry air at every temperature, and
/// infinite of moist air at 0 K.
pub fn relative_humidity(vapour_pa: f64, t_k: f64) -> f64 {
    if vapour_pa == 0.0 {
        return 0.0;
    }
    // By the logarithm: E may be 0 where the quotient is not beyond what f64 holds.
    ((vapour_pa / E0_PA).ln() - log_saturation(t_k)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saturation_by_hand() {
        assert_eq!(saturation(T0_K), E0_PA);
        // L/R_v = 5417.118 K; at 20 °C 1/273.15 − 1/293.15 = 2.497662e-4, e^1.353013 = 3.86906: 2364.8 Pa.
        assert!((saturation(293.15) - 2364.8).abs() < 0.2, "{}", saturation(293.15));
        // Cooling at constant e raises f (the paper says the opposite).
        assert!(relative_humidity(1000.0, 280.0) > relative_humidity(1000.0, 290.0));
        assert!((relative_humidity(saturation(285.0), 285.0) - 1.0).abs() < 1e-14);
    }
}
