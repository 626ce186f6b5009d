//! Humidity from 0 K to temperatures without end, of dry air and of air that holds more than it
//! can.

use super::case::{Case, Comparison, Found};
use super::desk::Desk;
use crate::error::Result;
use crate::model::moisture::{
    E0_PA, LATENT_HEAT, LATENT_HEAT_FALL, LATENT_HEAT_T0, R_VAPOUR, T0_K,
};
use crate::model::moisture::{Parcel, Saturation, Vapour};

pub const CASES: &[Case] = &[
    Case {
        name: "moisture/saturation",
        what: "E from 180 to 400 K by constant and linear L, boiling among them, against the \
            integral of dE/E = L/(R_v T^2) dT",
        bound: "1e-11, relative: Simpson's rule of 20 000 steps, and its sum",
        run: by_integral,
    },
    Case {
        name: "moisture/cold",
        what: "T to 0 K, 0 and below it, by every law: nothing evaporates, moist air is saturated \
            beyond all bounds, nothing is NaN",
        bound: "0",
        run: cold,
    },
    Case {
        name: "moisture/hot",
        what: "T from boiling to infinity: E stays below E_0 e^(L/(R_v T_0)), that of 1332 K where \
            L falls to 0, E_0 e^17.67",
        bound: "1e-14 of it",
        run: hot,
    },
    Case { name: "moisture/dry", what: "e = 0 at every temperature: f = 0", bound: "0", run: dry },
    Case {
        name: "moisture/supersaturated",
        what: "e above E, from a rounding of it to a thousand times: f = e/E, above 1",
        bound: "2^-46, relative: logarithms of up to 60, their difference and its exponential",
        run: supersaturated,
    },
    Case {
        name: "moisture/underflow",
        what: "temperatures at which E is below f64's least number and e/E is not beyond \
            its greatest",
        bound: "2^-42, relative: an exponent of 700",
        run: underflow,
    },
    Case {
        name: "moisture/differential",
        what: "C (3): df/f = de/e - dE/E, by differences of a millionth",
        bound: "1e-8 of the step: 2^-52 by 1e-6 and what differences of f leave out",
        run: differential,
    },
    Case {
        name: "moisture/lifted",
        what: "parcels from 200 to 320 K, of humidities from 1e-300 to 1, lifted to where they \
            condense: f = 1 there, by every law",
        bound: "2^-38: T is exact to 2^-52, and ln f changes by some 20 times the exponents of up \
            to 700 with it",
        run: lifted,
    },
];

/// Every law, over water alone and over ice below 0 °C.
fn laws() -> impl Iterator<Item = Vapour> {
    let both =
        |(_, saturation): (&str, Saturation)| [false, true].map(|ice| Vapour { saturation, ice });
    Saturation::NAMES.into_iter().flat_map(both)
}

fn by_integral(_: &mut Desk) -> Result<Found> {
    const N: u32 = 20_000;
    let mut c = Comparison::default();
    let falling = |t: f64| LATENT_HEAT_T0 - LATENT_HEAT_FALL * (t - T0_K);
    let of: [(Saturation, &dyn Fn(f64) -> f64); 2] =
        [(Saturation::Constant, &|_| LATENT_HEAT), (Saturation::Linear, &falling)];
    for (saturation, latent) in of {
        for t in [180.0, 233.15, 273.15, 283.15, 300.0, 373.15, 400.0] {
            let h = (t - T0_K) / f64::from(N);
            let at = |i: u32| T0_K + h * f64::from(i);
            let slope = |i: u32| latent(at(i)) / (R_VAPOUR * at(i).powi(2));
            let weight = |i: u32| if i == 0 || i == N { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
            let truth =
                E0_PA * ((0..=N).map(|i| weight(i) * slope(i)).sum::<f64>() * h / 3.0).exp();
            let found = Vapour { saturation, ice: false }.saturation(t);
            c.add(found, truth, 1e-11 * truth, || format!("E at {t} K, {saturation}"));
        }
    }
    Ok(c.into())
}

fn cold(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for law in laws() {
        for t in [5e-324, 1e-300, 1e-3, 1.0, 0.0, -0.0, -1.0, -273.15, f64::NEG_INFINITY] {
            c.add(law.saturation(t), 0.0, 0.0, || format!("E at {t:e} K, {law:?}"));
            c.add(law.relative_humidity(1e-3, t), f64::INFINITY, 0.0, || {
                format!("f at {t:e} K, {law:?}")
            });
        }
        // Ever less the colder it is.
        let temperatures: Vec<f64> = (1..=2000).map(|i| 0.2 * f64::from(i)).collect();
        let rises = temperatures.windows(2).all(|w| law.saturation(w[0]) <= law.saturation(w[1]));
        c.holds(rises, || format!("that E rises with T, {law:?}"));
    }
    Ok(c.into())
}

fn hot(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for law in laws() {
        let end = match law.saturation {
            Saturation::Constant => E0_PA * (LATENT_HEAT / R_VAPOUR / T0_K).exp(),
            Saturation::Linear => law.saturation(T0_K + LATENT_HEAT_T0 / LATENT_HEAT_FALL),
            Saturation::Bolton => E0_PA * 17.67f64.exp(),
        };
        for t in [373.15, 647.0, 1e4, 1e9, 1e300, f64::MAX, f64::INFINITY] {
            c.add((law.saturation(t) - end).max(0.0), 0.0, 1e-14 * end, || {
                format!("E at {t:e} K beyond its end, {law:?}")
            });
            c.holds(law.relative_humidity(1e5, t).is_finite(), || {
                format!("f at {t:e} K, finite, {law:?}")
            });
        }
    }
    Ok(c.into())
}

fn dry(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for law in laws() {
        for t in [0.0, 5e-324, 100.0, T0_K, 373.15, f64::INFINITY] {
            c.add(law.relative_humidity(0.0, t), 0.0, 0.0, || format!("f at {t:e} K, {law:?}"));
        }
    }
    Ok(c.into())
}

fn supersaturated(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for law in laws() {
        for t in [220.0, T0_K, 290.0, 373.15] {
            for over in [1.0f64.next_up(), 1.0 + 1e-9, 1.01, 2.0, 1000.0] {
                let found = law.relative_humidity(over * law.saturation(t), t);
                let what = || format!("f at {t} K, {over} times what it can hold, {law:?}");
                c.add(found, over, 2f64.powi(-46) * over, what);
            }
        }
    }
    Ok(c.into())
}

fn underflow(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    let law = Vapour { saturation: Saturation::Constant, ice: false };
    // E/E_0 = e^-740 is 0 in f64; e = 1e-20 Pa is some e^-52 of E_0.
    for exponent in [700.0, 740.0, 745.0, 755.0] {
        let t = 1.0 / (1.0 / T0_K + exponent * R_VAPOUR / LATENT_HEAT);
        let vapour = 1e-20;
        let truth = (exponent + (vapour / E0_PA).ln()).exp();
        // T itself is rounded, and its share of the exponent with it.
        c.add(law.relative_humidity(vapour, t), truth, 2f64.powi(-42) * truth, || {
            format!("f at {t} K")
        });
    }
    Ok(c.into())
}

fn differential(_: &mut Desk) -> Result<Found> {
    const STEP: f64 = 1e-6;
    let mut c = Comparison::default();
    for law in laws() {
        for t in [230.0, 280.0, 310.0] {
            let e = 900.0;
            let (de, dt) = (STEP * e, STEP * t);
            let change = |f: &dyn Fn(f64) -> f64| (f(0.5) - f(-0.5)) / f(0.0);
            let found = change(&|s| law.relative_humidity(e + s * de, t + s * dt));
            let truth = de / e - change(&|s| law.saturation(t + s * dt));
            c.add(found / STEP, truth / STEP, 1e-8, || format!("df/f at {t} K, {law:?}"));
        }
    }
    Ok(c.into())
}

fn lifted(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for law in laws() {
        for t_k in [200.0, 255.0, 288.15, 320.0] {
            for humidity in [1e-300, 1e-12, 0.01, 0.5, 1.0f64.next_down(), 1.0] {
                let parcel = Parcel { t_k, pressure_pa: 9e4, humidity };
                let level = parcel.condensation(law);
                // Of e by its logarithm, as e itself may be below what f64 holds.
                let log_e = humidity.ln()
                    + law.log_saturation(t_k)
                    + (level.pressure_pa / parcel.pressure_pa).ln();
                let f = (log_e - law.log_saturation(level.t_k)).exp();
                c.add(f, 1.0, 2f64.powi(-38), || {
                    format!("f at the level of {t_k} K and {humidity:e}, {law:?}")
                });
                c.holds(level.height_m >= 0.0, || {
                    format!("that the level of {t_k} K and {humidity:e} is not below")
                });
            }
        }
    }
    Ok(c.into())
}
