//! Humidity from 0 K to infinite temperature, for dry and for supersaturated air.

use super::case::{Case, Comparison};
use super::context::StressContext;
use crate::error::Result;
use crate::model::moisture::{
    E0_PA, LATENT_HEAT, LATENT_HEAT_FALL, LATENT_HEAT_T0, Parcel, R_VAPOUR, Saturation, T0_K,
    Vapour,
};

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "moisture/saturation",
        what: "E from 180 to 400 K for constant and linear L, against the integral of \
            dE/E = L/(R_v T^2) dT",
        bound: "1e-11, relative: Simpson's rule of 20 000 steps, and its sum",
        check: by_integral,
    },
    Case {
        name: "moisture/cold",
        what: "T towards 0 K, 0 and below, by every law: E = 0, infinite humidity of moist air, \
            no NaN",
        bound: "0",
        check: cold,
    },
    Case {
        name: "moisture/hot",
        what: "T from boiling to infinity: E stays below its limit, E_0 e^(L/(R_v T_0)), its \
            value at 1332 K, or E_0 e^17.67",
        bound: "1e-14 of it",
        check: hot,
    },
    Case {
        name: "moisture/dry",
        what: "e = 0 at every temperature: f = 0",
        bound: "0",
        check: |_, c| {
            for law in laws() {
                for t in [0.0, 5e-324, 100.0, T0_K, 373.15, f64::INFINITY] {
                    let f = law.relative_humidity(0.0, t);
                    c.exact(f, 0.0, format_args!("f at {t:e} K, {law:?}"));
                }
            }
            Ok(())
        },
    },
    Case {
        name: "moisture/supersaturated",
        what: "e above E, by one rounding to a factor of a thousand: f = e/E, above 1",
        bound: "2^-46, relative: logarithms of up to 60, their difference and its exponential",
        check: supersaturated,
    },
    Case {
        name: "moisture/underflow",
        what: "temperatures at which E underflows in f64 and e/E does not overflow",
        bound: "2^-42, relative: an exponent of 700",
        check: underflow,
    },
    Case {
        name: "moisture/differential",
        what: "C (3): df/f = de/e - dE/E, by differences of a millionth",
        bound: "1e-8 of the step: 2^-52 by 1e-6, and the third order of f",
        check: differential,
    },
    Case {
        name: "moisture/lifted",
        what: "parcels from 200 to 320 K with humidities from 1e-300 to 1, lifted until they \
            condense: f = 1, by every law",
        bound: "2^-38: T is exact to 2^-52, and ln f changes by some 20 times the exponents of up \
            to 700 with it",
        check: lifted,
    },
];

/// Returns every law, over water alone and over ice below 0 °C.
fn laws() -> impl Iterator<Item = Vapour> {
    let both =
        |(_, saturation): (&str, Saturation)| [false, true].map(|ice| Vapour { saturation, ice });
    Saturation::NAMES.into_iter().flat_map(both)
}

fn by_integral(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const N: u32 = 20_000;
    let falling = |t: f64| LATENT_HEAT_T0 - LATENT_HEAT_FALL * (t - T0_K);
    let laws: [(Saturation, &dyn Fn(f64) -> f64); 2] =
        [(Saturation::Constant, &|_| LATENT_HEAT), (Saturation::Linear, &falling)];
    for (saturation, latent) in laws {
        for t in [180.0, 233.15, 273.15, 283.15, 300.0, 373.15, 400.0] {
            let h = (t - T0_K) / f64::from(N);
            let at = |i: u32| T0_K + h * f64::from(i);
            let slope = |i: u32| latent(at(i)) / (R_VAPOUR * at(i).powi(2));
            let weight = |i: u32| if i == 0 || i == N { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
            let integral = (0..=N).map(|i| weight(i) * slope(i)).sum::<f64>() * h / 3.0;
            let truth = E0_PA * integral.exp();
            let value = Vapour { saturation, ice: false }.saturation(t);
            c.add(value, truth, 1e-11 * truth, format_args!("E at {t} K, {}", saturation.name()));
        }
    }
    Ok(())
}

fn cold(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for law in laws() {
        for t in [5e-324, 1e-300, 1e-3, 1.0, 0.0, -0.0, -1.0, -273.15, f64::NEG_INFINITY] {
            c.exact(law.saturation(t), 0.0, format_args!("E at {t:e} K, {law:?}"));
            let f = law.relative_humidity(1e-3, t);
            c.exact(f, f64::INFINITY, format_args!("f at {t:e} K, {law:?}"));
        }
        let e: Vec<f64> = (1..=2000).map(|i| law.saturation(0.2 * f64::from(i))).collect();
        c.holds(e.is_sorted(), format_args!("E rises with T, {law:?}"));
    }
    Ok(())
}

fn hot(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for law in laws() {
        let limit = match law.saturation {
            Saturation::Constant => E0_PA * (LATENT_HEAT / R_VAPOUR / T0_K).exp(),
            Saturation::Linear => law.saturation(T0_K + LATENT_HEAT_T0 / LATENT_HEAT_FALL),
            Saturation::Bolton => E0_PA * 17.67f64.exp(),
        };
        for t in [373.15, 647.0, 1e4, 1e9, 1e300, f64::MAX, f64::INFINITY] {
            let beyond = (law.saturation(t) - limit).max(0.0);
            let at = format_args!("E at {t:e} K above its limit, {law:?}");
            c.add(beyond, 0.0, 1e-14 * limit, at);
            let is_finite = law.relative_humidity(1e5, t).is_finite();
            c.holds(is_finite, format_args!("finite f at {t:e} K, {law:?}"));
        }
    }
    Ok(())
}

fn supersaturated(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for law in laws() {
        for t in [220.0, T0_K, 290.0, 373.15] {
            for over in [1.0f64.next_up(), 1.0 + 1e-9, 1.01, 2.0, 1000.0] {
                let f = law.relative_humidity(over * law.saturation(t), t);
                let at = format_args!("f at {t} K, e = {over} E, {law:?}");
                c.add(f, over, 2f64.powi(-46) * over, at);
            }
        }
    }
    Ok(())
}

fn underflow(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let law = Vapour { saturation: Saturation::Constant, ice: false };
    // E/E_0 = e^-740 is 0 in f64; e = 1e-20 Pa is about e^-52 of E_0.
    for exponent in [700.0, 740.0, 745.0, 755.0] {
        let t = 1.0 / (1.0 / T0_K + exponent * R_VAPOUR / LATENT_HEAT);
        let vapour = 1e-20;
        let truth = (exponent + (vapour / E0_PA).ln()).exp();
        // T is rounded, and the exponent with it.
        let bound = 2f64.powi(-42) * truth;
        c.add(law.relative_humidity(vapour, t), truth, bound, format_args!("f at {t} K"));
    }
    Ok(())
}

fn differential(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const STEP: f64 = 1e-6;
    let e = 900.0;
    for law in laws() {
        for t in [230.0, 280.0, 310.0] {
            let (de, dt) = (STEP * e, STEP * t);
            let change = |f: &dyn Fn(f64) -> f64| (f(0.5) - f(-0.5)) / f(0.0);
            let value = change(&|s| law.relative_humidity(e + s * de, t + s * dt));
            let truth = de / e - change(&|s| law.saturation(t + s * dt));
            c.add(value / STEP, truth / STEP, 1e-8, format_args!("df/f at {t} K, {law:?}"));
        }
    }
    Ok(())
}

fn lifted(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for law in laws() {
        for t_k in [200.0, 255.0, 288.15, 320.0] {
            for humidity in [1e-300, 1e-12, 0.01, 0.5, 1.0f64.next_down(), 1.0] {
                let parcel = Parcel { t_k, pressure_pa: 9e4, humidity };
                let level = parcel.condensation(law);
                // By the logarithm of e, because e may underflow.
                let log_e = humidity.ln()
                    + law.log_saturation(t_k)
                    + (level.pressure_pa / parcel.pressure_pa).ln();
                let f = (log_e - law.log_saturation(level.t_k)).exp();
                let at = format_args!("level of a parcel of {t_k} K and {humidity:e}, {law:?}");
                c.add(f, 1.0, 2f64.powi(-38), format_args!("f at the {at}"));
                c.holds(level.height_m >= 0.0, format_args!("the {at} is not below it"));
            }
        }
    }
    Ok(())
}
