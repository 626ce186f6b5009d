//! Saturation, relative humidity and the lifted condensation level: C (1)–(3),
//! model.md §4.

use super::named::named;

/// Saturation vapour pressure at [`T0_K`], Pa.
pub const E0_PA: f64 = 611.2;
/// Temperature of the melting point, K.
pub const T0_K: f64 = 273.15;
/// Gas constant of water vapour, J/(kg K).
pub const R_VAPOUR: f64 = 461.5;
/// Constant latent heat of evaporation, J/kg.
pub const LATENT_HEAT: f64 = 2.5e6;
/// Latent heat at [`T0_K`] of the law that falls with temperature, J/kg.
pub const LATENT_HEAT_T0: f64 = 2.501e6;
/// Fall of that latent heat with temperature, J/(kg K).
pub const LATENT_HEAT_FALL: f64 = 2361.0;
/// Latent heat of sublimation, J/kg; it hardly depends on temperature.
const SUBLIMATION_HEAT: f64 = 2.834e6;

named! {
    /// Law of the saturation vapour pressure E(T) over water.
    pub enum Saturation {
        /// Clausius–Clapeyron with constant L, as in C.
        Constant = "constant",
        /// Clausius–Clapeyron with L(T) = 2.501e6 − 2361 (T − 273.15).
        Linear = "linear",
        /// Bolton's fit (1980, eq. 10).
        Bolton = "bolton",
    }
}

/// Law of the saturation vapour pressure, over water or ice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Vapour {
    /// Law over water.
    pub saturation: Saturation,
    /// Whether the law of ice holds below 0 °C.
    pub ice: bool,
}

impl Vapour {
    /// Returns ln(E/E₀); −∞ at 0 K and below, where nothing evaporates.
    pub fn log_saturation(self, t_k: f64) -> f64 {
        if t_k <= 0.0 {
            return f64::NEG_INFINITY;
        }
        match self.saturation {
            _ if t_k.is_nan() => f64::NAN,
            Saturation::Constant | Saturation::Linear if self.ice && t_k < T0_K => {
                clapeyron(SUBLIMATION_HEAT, t_k)
            }
            Saturation::Constant => clapeyron(LATENT_HEAT, t_k),
            Saturation::Linear => {
                // L is clamped where it reaches 0, at some 1332 K, far beyond water's critical
                // point. E is constant from there on.
                let t = t_k.min(T0_K + LATENT_HEAT_T0 / LATENT_HEAT_FALL);
                let at_0 = LATENT_HEAT_T0 + LATENT_HEAT_FALL * T0_K;
                clapeyron(at_0, t) - LATENT_HEAT_FALL / R_VAPOUR * log_ratio(t, T0_K)
            }
            // Sonntag (1990): Magnus' form over ice.
            Saturation::Bolton if self.ice && t_k < T0_K => magnus(22.46, 0.53, t_k),
            Saturation::Bolton => magnus(17.67, 29.65, t_k),
        }
    }

    /// Returns the saturation vapour pressure E at `t_k` kelvin, Pa. 0 at 0 K, finite at every
    /// temperature.
    pub fn saturation(self, t_k: f64) -> f64 {
        E0_PA * self.log_saturation(t_k).exp()
    }

    /// Returns f = e/E for the vapour pressure e: above 1 in supersaturated air, 0 in dry air, and
    /// infinite in moist air where E is 0.
    pub fn relative_humidity(self, vapour_pa: f64, t_k: f64) -> f64 {
        if vapour_pa == 0.0 {
            return 0.0;
        }
        // The logarithm avoids an E that underflows where the quotient does not.
        ((vapour_pa / E0_PA).ln() - self.log_saturation(t_k)).exp()
    }
}

/// Returns L/R_v (1/T₀ − 1/T) as one quotient, without cancellation about T₀.
fn clapeyron(latent_heat: f64, t_k: f64) -> f64 {
    let share = if t_k.is_infinite() { 1.0 } else { (t_k - T0_K) / t_k };
    latent_heat / R_VAPOUR / T0_K * share
}

/// Returns a (T − T₀)/(T − c); −∞ at the pole c and below.
fn magnus(a: f64, pole_k: f64, t_k: f64) -> f64 {
    if t_k <= pole_k {
        f64::NEG_INFINITY
    } else if t_k.is_infinite() {
        a
    } else {
        a * ((t_k - T0_K) / (t_k - pole_k))
    }
}

/// Returns ln(a/b), accurate where the quotient is near 1.
fn log_ratio(a: f64, b: f64) -> f64 {
    let d = (a - b) / b;
    // For the least numbers the quotient would be 0.
    if d.abs() < 0.5 { libm::log1p(d) } else { a.ln() - b.ln() }
}

/// Constants of air, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gases {
    /// Gas constant of dry air, J/(kg K).
    pub r_dry: f64,
    /// Gas constant of water vapour, J/(kg K).
    pub r_vapour: f64,
    /// Heat capacity c_p of dry air, J/(kg K).
    pub cp_dry: f64,
    /// Heat capacity c_p of water vapour, J/(kg K).
    pub cp_vapour: f64,
    /// Gravity, m/s².
    pub gravity: f64,
}

/// Constants of air, with c_p as in Bolton (1980) and Emanuel (1994).
const GASES: Gases = Gases {
    r_dry: 287.04,
    r_vapour: R_VAPOUR,
    cp_dry: 1005.7,
    cp_vapour: 1870.0,
    gravity: 9.806_65,
};

/// Air at the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parcel {
    /// Temperature, K.
    pub t_k: f64,
    /// Pressure, Pa.
    pub pressure_pa: f64,
    /// Relative humidity f, above 0 and at most 1.
    pub humidity: f64,
}

/// Level at which an adiabatically lifted parcel becomes saturated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Height above the start, m.
    pub height_m: f64,
    /// Temperature at the level, K.
    pub t_k: f64,
    /// Pressure at the level, Pa.
    pub pressure_pa: f64,
}

impl Parcel {
    /// Returns the vapour pressure e, Pa.
    pub fn vapour_pa(&self, law: Vapour) -> f64 {
        self.humidity * law.saturation(self.t_k)
    }

    /// Returns the dew point, K: the temperature of saturation at constant pressure.
    pub fn dew_point_k(&self, law: Vapour) -> f64 {
        saturated_at(
            |t| self.humidity.ln() + law.log_saturation(self.t_k) - law.log_saturation(t),
            self.t_k,
        )
    }

    /// Returns the lifted condensation level.
    pub fn condensation(&self, law: Vapour) -> Level {
        self.condensation_by(&|t| law.log_saturation(t), self.vapour_pa(law), &GASES)
    }

    /// Returns the lifted condensation level for any E(T), given as ln(E/E₀), and other constants.
    fn condensation_by(
        &self,
        log_saturation: &dyn Fn(f64) -> f64,
        vapour_pa: f64,
        gases: &Gases,
    ) -> Level {
        // Specific humidity. It is constant during the lift, and so is e/p.
        let share = gases.r_dry / gases.r_vapour;
        let q = share * vapour_pa / (self.pressure_pa - (1.0 - share) * vapour_pa);
        let cp = (1.0 - q) * gases.cp_dry + q * gases.cp_vapour;
        let r = (1.0 - q) * gases.r_dry + q * gases.r_vapour;
        // p ∝ T^{c_p/R}.
        let excess = |t: f64| {
            self.humidity.ln() + cp / r * log_ratio(t, self.t_k) + log_saturation(self.t_k)
                - log_saturation(t)
        };
        let t_k = saturated_at(excess, self.t_k);
        let pressure_pa = self.pressure_pa * (cp / r * log_ratio(t_k, self.t_k)).exp();
        Level { height_m: cp / gases.gravity * (self.t_k - t_k), t_k, pressure_pa }
    }
}

/// Returns the greatest T up to `t_k` with `log_humidity`(T) ≥ 0, which rises as T falls. The
/// interval is halved until two neighbouring numbers are left.
fn saturated_at(log_humidity: impl Fn(f64) -> f64, t_k: f64) -> f64 {
    if log_humidity(t_k) >= 0.0 {
        return t_k;
    }
    // At 0 K everything is saturated.
    let (mut low, mut high) = (0.0, t_k);
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return low;
        }
        // NaN, where both logarithms are infinite, counts as far below.
        if log_humidity(middle) < 0.0 { high = middle } else { low = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONSTANT: Vapour = Vapour { saturation: Saturation::Constant, ice: false };
    const LINEAR: Vapour = Vapour { saturation: Saturation::Linear, ice: false };
    const BOLTON: Vapour = Vapour { saturation: Saturation::Bolton, ice: false };

    /// Returns the temperature at the condensation level, K, accurate to 0.1 K from −35 to 35 °C.
    /// *Source*: Bolton (1980), eq. 22.
    fn bolton_level_k(t_k: f64, humidity: f64) -> f64 {
        1.0 / (1.0 / (t_k - 55.0) - humidity.ln() / 2840.0) + 55.0
    }

    #[test]
    fn saturation_by_hand() {
        for saturation in [Saturation::Constant, Saturation::Linear, Saturation::Bolton] {
            for ice in [false, true] {
                assert_eq!(Vapour { saturation, ice }.saturation(T0_K), E0_PA);
            }
        }
        // L/R_v = 5417.118 K; at 20 °C 1/273.15 − 1/293.15 = 2.497662e-4, e^1.353013 = 3.86906:
        // 2364.8 Pa.
        assert!(
            (CONSTANT.saturation(293.15) - 2364.8).abs() < 0.2,
            "{}",
            CONSTANT.saturation(293.15)
        );
        // (L₀ + 2361 T₀)/R_v = 6816.746 K times the same, less 5.115926 ln(293.15/273.15) =
        // 0.361511: e^1.341081 = 3.82318.
        assert!((LINEAR.saturation(293.15) - 2336.7).abs() < 0.2, "{}", LINEAR.saturation(293.15));
        // 17.67 · 20/263.5 = 1.341176, e^… = 3.82354.
        assert!((BOLTON.saturation(293.15) - 2336.9).abs() < 0.2, "{}", BOLTON.saturation(293.15));
        // Cooling at constant e raises f; the paper says the opposite.
        assert!(
            CONSTANT.relative_humidity(1000.0, 280.0) > CONSTANT.relative_humidity(1000.0, 290.0)
        );
        assert!((LINEAR.relative_humidity(LINEAR.saturation(285.0), 285.0) - 1.0).abs() < 1e-14);
    }

    /// Murphy & Koop (2005), eq. 10 and 7: within 0.05 % of what is measured, over water and over
    /// ice.
    fn murphy_koop(t: f64, ice: bool) -> f64 {
        let ln = t.ln();
        if ice {
            return (9.550426 - 5723.265 / t + 3.53068 * ln - 0.00728332 * t).exp();
        }
        let low = 54.842763 - 6763.22 / t - 4.210 * ln + 0.000367 * t;
        (low + (0.0415 * (t - 218.8)).tanh() * (53.878 - 1331.22 / t - 9.44523 * ln + 0.014025 * t))
            .exp()
    }

    #[test]
    fn laws_are_near_measured_values() {
        for k in -40..=40 {
            let t = T0_K + f64::from(k);
            let off = |law: Vapour, ice| (law.saturation(t) / murphy_koop(t, ice) - 1.0).abs();
            // E₀ itself is 0.02 % off.
            assert!(
                off(BOLTON, false) < 0.005
                    && off(LINEAR, false) < 0.006
                    && off(CONSTANT, false) < 0.085,
                "{k}"
            );
            if k < 0 {
                let ice = |saturation| Vapour { saturation, ice: true };
                assert!(
                    off(ice(Saturation::Bolton), true) < 0.005
                        && off(ice(Saturation::Linear), true) < 0.01,
                    "{k}"
                );
                // Over ice the air holds less: 1 % less a kelvin.
                assert!(ice(Saturation::Bolton).saturation(t) < BOLTON.saturation(t));
            }
        }
    }

    #[test]
    fn condensation_levels_match_romps() {
        // Romps (2017), "Exact Expression for the Lifting Condensation Level", his constants and
        // the heights that his code is published with.
        let gases = Gases {
            r_dry: 287.04,
            r_vapour: 461.0,
            cp_dry: 719.0 + 287.04,
            cp_vapour: 1418.0 + 461.0,
            gravity: 9.81,
        };
        let log = |t: f64| {
            (1879.0 - 4119.0) / 461.0 * (t / 273.16).ln()
                + (2.3740e6 - (1418.0 - 4119.0) * 273.16) / 461.0 * (1.0 / 273.16 - 1.0 / t)
        };
        for (t_k, height_m) in [(300.0, 1433.844139279), (200.0, 542.8017712435)] {
            let parcel = Parcel { t_k, pressure_pa: 1e5, humidity: 0.5 };
            let level = parcel.condensation_by(&log, 0.5 * 611.65 * log(t_k).exp(), &gases);
            assert!((level.height_m / height_m - 1.0).abs() < 1e-10, "{level:?}");
        }
    }

    #[test]
    fn condensation_levels_match_bolton() {
        for t in [-35, -20, -5, 10, 25, 35] {
            for humidity in [0.2, 0.5, 0.8, 0.99] {
                let parcel = Parcel { t_k: T0_K + f64::from(t), pressure_pa: 1e5, humidity };
                let level = parcel.condensation(BOLTON);
                // Bolton's own 0.1 K, plus his assumption of dry air: R/c_p of moist air is 1 %
                // less at 35 °C.
                let off = level.t_k - bolton_level_k(parcel.t_k, humidity);
                assert!(off.abs() < 0.2, "{t} °C, {humidity}: {off}");
                // The parcel is saturated there, and its potential temperature is unchanged.
                let f = BOLTON.relative_humidity(
                    parcel.vapour_pa(BOLTON) * level.pressure_pa / parcel.pressure_pa,
                    level.t_k,
                );
                assert!((f - 1.0).abs() < 1e-12, "{f}");
            }
        }
        let wet = Parcel { t_k: 290.0, pressure_pa: 9e4, humidity: 1.0 };
        assert_eq!(wet.condensation(LINEAR), Level { height_m: 0.0, t_k: 290.0, pressure_pa: 9e4 });
        // Dew points give back the humidity; at 20 °C and one half the dew point is 9.3 °C.
        let half = Parcel { t_k: T0_K + 20.0, pressure_pa: 1e5, humidity: 0.5 };
        let dew = half.dew_point_k(BOLTON);
        assert!((dew - T0_K - 9.27).abs() < 0.02, "{dew}");
        assert!((BOLTON.saturation(dew) / BOLTON.saturation(half.t_k) - 0.5).abs() < 1e-13);
    }

    #[test]
    fn nearly_dry_air_condenses_at_a_finite_height() {
        for law in [CONSTANT, LINEAR, BOLTON] {
            for humidity in [1e-3, 1e-12, 1e-300] {
                let level = Parcel { t_k: 300.0, pressure_pa: 1e5, humidity }.condensation(law);
                assert!(
                    level.t_k > 0.0 && level.height_m > 5000.0 && level.height_m < 31_000.0,
                    "{level:?}"
                );
            }
        }
    }
}
