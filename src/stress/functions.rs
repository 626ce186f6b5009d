//! Functions as the shaders use them, against f64.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::case::{Case, Comparison, Found};
use super::desk::Desk;
use crate::error::Result;
use crate::model::basis::{N_NODES, evaluate, node};
use crate::model::material::Brdf;
use crate::reference::rounding::{DIVISION_ERROR, SINE_ERROR, U_F32, erf_bound};

pub const CASES: &[Case] = &[
    Case {
        name: "functions/rounding",
        what: "sums, differences and products over 60 binades, as all other bounds take them \
            to be rounded",
        bound: "0: rounded to nearest",
        run: rounding,
    },
    Case {
        name: "functions/division",
        what: "quotients over 60 binades",
        bound: "2.5 ulp (Vulkan)",
        run: division,
    },
    Case {
        name: "functions/square-root",
        what: "sqrt from 1e-30 to 1e30",
        bound: "9.1 u: 2 ulp of inversesqrt, 2.5 of its inverse",
        run: square_root,
    },
    Case {
        name: "functions/inverse-root",
        what: "inversesqrt from 1e-30 to 1e30",
        bound: "2 ulp (Vulkan)",
        run: inverse_root,
    },
    Case {
        name: "functions/exponential",
        what: "e^-t for t from 1e-30 to 87",
        bound: "3 + 2t ulp (Vulkan)",
        run: exponential,
    },
    Case {
        name: "functions/exponential-end",
        what: "e^-t for t from 88 to 1e38, where nothing or a subnormal number is left",
        bound: "2^-126: the least normal number",
        run: exponential_end,
    },
    Case {
        name: "functions/logarithm",
        what: "ln x from 1e-30 to 1e30, and about 1",
        bound: "3 ulp; 2^-21 where 1/2 < x < 2 (Vulkan)",
        run: logarithm,
    },
    Case {
        name: "functions/sine",
        what: "sine for |x| up to 16383 pi, about its zeros and where its reduction changes",
        bound: "4 u, and 5 u of the reduced argument",
        run: sine,
    },
    Case {
        name: "functions/sine-far",
        what: "sine of arguments up to 3.4e38, whose reduction means nothing: still a sine",
        bound: "|value| <= 1 + 4 u",
        run: sine_far,
    },
    Case {
        name: "functions/unit-vectors",
        what: "(cos, sin) of a turn for all multiples of 2^-20 of it, with its ends and quarters",
        bound: "10 u",
        run: unit_vectors,
    },
    Case {
        name: "functions/erf",
        what: "erf for |x| from 1e-20 to 5, and 0 of either sign",
        bound: "3e-7 of the formula, and its rounding in f32",
        run: erf,
    },
    Case {
        name: "functions/power-of-two",
        what: "2^x for |x| up to 125, at integers and where its reduction changes",
        bound: "7.5e-8 + 3.7 u, relative",
        run: power_of_two,
    },
    Case {
        name: "functions/one-minus-exp",
        what: "1 - e^-t for t from 1e-30 to 1e38: thin and thick blobs",
        bound: "1e-6, relative",
        run: one_minus_exp,
    },
    Case {
        name: "functions/half-vector",
        what: "1 - cos of the angle to the half vector, without acos, from 1e-6 of a radian to \
            a right angle",
        bound: "|chord| 15.6 u and its square",
        run: half_vector,
    },
    Case {
        name: "functions/lobe",
        what: "cos^n of the angle from its table, for n from 0 to 10^6",
        bound: "h^2/8 max |f''| of the table, and rounding",
        run: lobe,
    },
    Case {
        name: "functions/normalize",
        what: "unit vectors of vectors as long as 1e-14 to 1e18",
        bound: "9 u a component",
        run: normalize,
    },
    Case {
        name: "functions/normalize-ends",
        what: "unit vectors of vectors whose squares underflow: finite, and no longer than 1",
        bound: "1 + 18 u",
        run: normalize_ends,
    },
];

/// The spacing of f32 about `x`; that of the least normal numbers below them.
pub(super) fn ulp(x: f64) -> f64 {
    let exponent = x.abs().max(f64::from(f32::MIN_POSITIVE)).log2().floor();
    (exponent - 23.0).exp2()
}

/// `n` numbers of either sign whose magnitudes are spread evenly over the exponents from `low` to
/// `high`.
fn sweep(low: f64, high: f64, n: usize) -> Vec<f32> {
    let share = |i: usize| (i as f64 + 0.5) / n as f64;
    let sign = |i: usize| if i.is_multiple_of(2) { 1.0 } else { -1.0 };
    (0..n).map(|i| (sign(i) * low * (high / low).powf(share(i))) as f32).collect()
}

fn positive(low: f64, high: f64, n: usize) -> Vec<f32> {
    sweep(low, high, n).into_iter().map(f32::abs).collect()
}

/// `body` of x.x at `inputs` against `truth`, each within its own bound.
fn compare(
    desk: &mut Desk,
    includes: &[&str],
    body: &str,
    inputs: &[f32],
    truth: impl Fn(f64) -> f64,
    bound: impl Fn(f64, f64) -> f64,
) -> Result<Found> {
    let values = desk.function(includes, body, inputs)?;
    let mut c = Comparison::default();
    for (x, value) in inputs.iter().zip(values) {
        let x = f64::from(*x);
        let truth = truth(x);
        c.add(value, truth, bound(x, truth), || format!("x = {x:e}"));
    }
    Ok(c.into())
}

/// Pairs of numbers whose sums, products and quotients are normal numbers, many of nearly the same
/// size.
fn pairs() -> Vec<[f32; 4]> {
    let (a, b) = (sweep(1e-9, 1e9, 60_013), sweep(1e-9, 1e9, 60_013));
    let far = a.iter().zip(b.iter().rev()).map(|(a, b)| [*a, *b, 0.0, 0.0]);
    // The same exponent, other digits: what cancels.
    let near =
        a.iter().enumerate().map(|(i, a)| [*a, -a * (1.0 + 1e-4 * (i % 977) as f32), 0.0, 0.0]);
    far.chain(near).collect()
}

fn rounding(desk: &mut Desk) -> Result<Found> {
    let pairs = pairs();
    let body =
        "precise float s = x.x + x.y, d = x.x - x.y, p = x.x * x.y; return vec4(s, d, p, 0.0);";
    let found = desk.probe(&[], body, &pairs)?;
    let mut c = Comparison::default();
    for ([a, b, ..], y) in pairs.iter().zip(found) {
        let (a, b) = (f64::from(*a), f64::from(*b));
        for (k, (sign, exact)) in [("+", a + b), ("-", a - b), ("*", a * b)].into_iter().enumerate()
        {
            // f64 rounds first, which changes nothing: it has more than twice the digits and two.
            let truth = f64::from(exact as f32);
            c.add(f64::from(y[k]), truth, 0.0, || format!("{a:e} {sign} {b:e}"));
        }
    }
    Ok(c.into())
}

fn division(desk: &mut Desk) -> Result<Found> {
    let pairs = pairs();
    let found = desk.probe(&[], "return vec4(x.x / x.y);", &pairs)?;
    let mut c = Comparison::default();
    for ([a, b, ..], y) in pairs.iter().zip(found) {
        let truth = f64::from(*a) / f64::from(*b);
        c.add(f64::from(y[0]), truth, 2.5 * ulp(truth), || format!("{a:e} / {b:e}"));
    }
    Ok(c.into())
}

fn square_root(desk: &mut Desk) -> Result<Found> {
    let mut x = positive(1e-30, 1e30, 200_000);
    x.push(0.0);
    compare(desk, &[], "return vec4(sqrt(x.x));", &x, f64::sqrt, |_, t| {
        ((1.0 + 4.0 * U_F32) * (1.0 + DIVISION_ERROR * U_F32) - 1.0) * t
    })
}

fn inverse_root(desk: &mut Desk) -> Result<Found> {
    let x = positive(1e-30, 1e30, 200_000);
    compare(
        desk,
        &[],
        "return vec4(inversesqrt(x.x));",
        &x,
        |x| 1.0 / x.sqrt(),
        |_, t| 2.0 * ulp(t),
    )
}

fn exponential(desk: &mut Desk) -> Result<Found> {
    let mut x = positive(1e-30, 87.0, 200_000);
    x.push(0.0);
    compare(
        desk,
        &[],
        "return vec4(exp(-x.x));",
        &x,
        |x| (-x).exp(),
        |x, t| (3.0 + 2.0 * x) * ulp(t),
    )
}

fn exponential_end(desk: &mut Desk) -> Result<Found> {
    let mut x = positive(88.0, 1e38, 20_000);
    x.extend([f32::MAX, f32::INFINITY]);
    compare(
        desk,
        &[],
        "return vec4(exp(-x.x));",
        &x,
        |x| (-x).exp(),
        |_, _| f64::from(f32::MIN_POSITIVE),
    )
}

fn logarithm(desk: &mut Desk) -> Result<Found> {
    let mut x = positive(1e-30, 1e30, 200_000);
    x.extend((0..100_000).map(|i| 0.5 + 1.5 * i as f32 / 100_000.0));
    let bound =
        |x: f64, t: f64| if (0.5..=2.0).contains(&x) { (-21f64).exp2() } else { 3.0 * ulp(t) };
    compare(desk, &[], "return vec4(log(x.x));", &x, f64::ln, bound)
}

const FUNCTIONS: [&str; 1] = ["functions.glsl"];

fn sine(desk: &mut Desk) -> Result<Found> {
    let mut x = sweep(1e-20, 16_383.0 * PI, 200_000);
    for k in -10_000..10_000 {
        let at = (f64::from(k) * 0.5 * PI) as f32;
        x.extend([at.next_down(), at, at.next_up()]);
    }
    let bound = |x: f64, _: f64| {
        // The arguments are exact, and so is what the first part of pi leaves; three more
        // subtractions round what is at most pi/2.
        let e = if x.abs() > FRAC_PI_2 { 5.0 * U_F32 } else { 0.0 };
        SINE_ERROR + x.cos().abs() * e + 0.5 * e * e
    };
    compare(desk, &FUNCTIONS, "return vec4(sine(x.x));", &x, f64::sin, bound)
}

fn sine_far(desk: &mut Desk) -> Result<Found> {
    let mut x = sweep(1e5, 3.3e38, 100_000);
    x.extend([f32::MAX, f32::MIN]);
    let mut c = Comparison::default();
    for (x, value) in x.iter().zip(desk.function(&FUNCTIONS, "return vec4(sine(x.x));", &x)?) {
        c.add(value.clamp(-1.0, 1.0), value, SINE_ERROR, || format!("x = {x:e}"));
    }
    Ok(c.into())
}

fn unit_vectors(desk: &mut Desk) -> Result<Found> {
    let x: Vec<[f32; 4]> = (-(1 << 19)..=1 << 19)
        .map(|i| [(f64::from(i) / f64::from(1 << 20)) as f32, 0.0, 0.0, 0.0])
        .collect();
    let found = desk.probe(&FUNCTIONS, "return vec4(unit_at(x.x), 0.0, 0.0);", &x)?;
    let mut c = Comparison::default();
    for ([x, ..], y) in x.iter().zip(found) {
        let (sin, cos) = (TAU * f64::from(*x)).sin_cos();
        c.add(f64::from(y[0]), cos, 10.0 * U_F32, || format!("cos of {x} turns"));
        c.add(f64::from(y[1]), sin, 10.0 * U_F32, || format!("sin of {x} turns"));
    }
    Ok(c.into())
}

fn erf(desk: &mut Desk) -> Result<Found> {
    let mut x = sweep(1e-20, 5.0, 200_000);
    x.extend([0.0, -0.0]);
    compare(desk, &FUNCTIONS, "return vec4(erf_approx(x.x));", &x, libm::erf, |x, _| erf_bound(x))
}

fn power_of_two(desk: &mut Desk) -> Result<Found> {
    let mut x = sweep(1e-20, 125.0, 200_000);
    x.extend((-249..250).flat_map(|k| {
        let at = 0.5 * k as f32;
        [at.next_down(), at, at.next_up()]
    }));
    compare(desk, &FUNCTIONS, "return vec4(power_of_two(x.x));", &x, f64::exp2, |_, t| {
        (7.5e-8 + 3.7 * U_F32) * t
    })
}

fn one_minus_exp(desk: &mut Desk) -> Result<Found> {
    let mut x = positive(1e-30, 1e38, 200_000);
    x.extend([0.0, 0.5f32.next_down(), 0.5, 1.0, f32::MAX]);
    compare(
        desk,
        &FUNCTIONS,
        "return vec4(one_minus_exp(x.x));",
        &x,
        |x| -(-x).exp_m1(),
        |_, t| 1e-6 * t,
    )
}

/// What lobe.glsl has with no table of its own.
const NO_TABLE: [(&str, &[f32]); 1] = [("table", &[0.0; 2])];

fn half_vector(desk: &mut Desk) -> Result<Found> {
    // The normal (0, 0, 1), and two ways in the xz plane on either side of one at an angle to it:
    // near to each other, and, at each fourth place, next to opposite, so that their sum is down to
    // 1e-6 long. Rounded.
    let inputs: Vec<[f32; 4]> = (0..100_000)
        .map(|i| {
            let share = f64::from(i) / 100_000.0;
            let angle = 1e-6 * (PI / 2.0 * 1e6f64).powf(share);
            let apart = if i % 4 == 0 {
                FRAC_PI_2 - 1e-6 * 1e5f64.powf(share)
            } else {
                0.3 * f64::from(i % 7)
            };
            let (a, b) = (angle + apart, angle - apart);
            [a.sin() as f32, a.cos() as f32, b.sin() as f32, b.cos() as f32]
        })
        .collect();
    // The table stays bound where it is looked at.
    let body = "float gap = half_vector_gap(vec3(0.0, 0.0, 1.0), vec3(x.x, 0.0, x.y), vec3(x.z, \
        0.0, x.w)); \
        return vec4(gap, lobe_at(0u, 0.0), 0.0, 0.0);";
    let found = desk.probe_beside(&NO_TABLE, &["lobe.glsl"], body, &inputs)?;
    let mut c = Comparison::default();
    for (x, y) in inputs.iter().zip(found) {
        let [ax, az, bx, bz] = x.map(f64::from);
        let (hx, hz) = (ax + bx, az + bz);
        let length = hx.hypot(hz);
        // Where they are opposite to the bit there is no half vector, and the chord is the normal.
        let chord = if length > 0.0 { (hx / length).hypot(1.0 - hz / length) } else { 1.0 };
        let truth = 0.5 * chord * chord;
        let off = 15.6 * U_F32;
        c.add(f64::from(y[0]), truth, chord * off + 0.5 * off * off + 4.0 * U_F32 * truth, || {
            format!("angle of chord {chord:e}")
        });
    }
    Ok(c.into())
}

fn lobe(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for ns in [0.0, 1.0, 12.0, 300.0, 1e4, 1e6] {
        let lobe = |w: f64| Brdf::lobe(ns, w);
        let table: Vec<f64> = (0..N_NODES).map(|i| lobe(node(i))).collect();
        let rounded: Vec<f32> = table.iter().map(|v| *v as f32).collect();
        // w = t^4, the nodes evenly over t.
        let inputs: Vec<[f32; 4]> = (0..20_000)
            .map(|i| [((f64::from(i) + 0.37) / 20_000.0).powi(4) as f32, 0.0, 0.0, 0.0])
            .collect();
        let found = desk.probe_beside(
            &[("table", &rounded)],
            &["lobe.glsl"],
            "return vec4(lobe_at(0u, x.x));",
            &inputs,
        )?;
        for ([w, ..], y) in inputs.iter().zip(found) {
            let w = f64::from(*w);
            let t = w.sqrt().sqrt() * (N_NODES - 1) as f64;
            // Two roots, each 9.1 u of itself and the first one halved in the second, and two
            // products: 16 u of t, which is in nodes.
            let off = 16.0 * U_F32 * t.max(1.0);
            let i = (t as usize).clamp(1, N_NODES - 2);
            // Steepest of the three pieces about; rounding of entries, and of the mixture.
            let (before, here) =
                (i.saturating_sub(1), &table[i.saturating_sub(1)..(i + 3).min(N_NODES)]);
            let steep = here.windows(2).map(|p| (p[1] - p[0]).abs()).fold(0.0, f64::max);
            let most = table[before].abs().max(table[i].abs());
            let rounding = off * steep + 4.0 * U_F32 * most + f64::from(f32::MIN_POSITIVE);
            c.add(f64::from(y[0]), evaluate(&table, w), rounding, || {
                format!("table of n = {ns:e} at w = {w:e}")
            });
            // Between nodes the function bends: its second difference is h^2 |f''| but for the next
            // order, here a half of it at most.
            let bend =
                here.windows(3).map(|p| (p[2] - 2.0 * p[1] + p[0]).abs()).fold(0.0, f64::max);
            c.add(f64::from(y[0]), lobe(w), rounding + 1.5 * bend / 8.0, || {
                format!("cos^n of n = {ns:e} at w = {w:e}")
            });
        }
    }
    Ok(c.into())
}

/// Vectors of many directions and the lengths from `low` to `high`.
fn vectors(low: f64, high: f64) -> Vec<[f32; 4]> {
    let length = |i: u32| low * (high / low).powf(f64::from(i) / 50_000.0);
    let of = |i: u32| {
        let (a, z) = (2.399963 * f64::from(i), 2.0 * (f64::from(i % 1009) + 0.5) / 1009.0 - 1.0);
        let r = (1.0 - z * z).sqrt();
        [r * a.cos(), r * a.sin(), z].map(|v| (v * length(i)) as f32)
    };
    (0..50_000).map(of).map(|[x, y, z]| [x, y, z, 0.0]).collect()
}

const UNIT: &str = "return vec4(unit(x.xyz), 0.0);";

fn normalize(desk: &mut Desk) -> Result<Found> {
    let inputs = vectors(1e-14, 1e18);
    let found = desk.probe(&FUNCTIONS, UNIT, &inputs)?;
    let mut c = Comparison::default();
    for (x, y) in inputs.iter().zip(found) {
        let v = glam::DVec3::new(f64::from(x[0]), f64::from(x[1]), f64::from(x[2]));
        let truth = v / v.length();
        for k in 0..3 {
            // The square has three roundings of its own terms and two sums, halved by the root; the
            // root 4 u, the product 1.
            c.add(f64::from(y[k]), truth[k], 9.0 * U_F32 * truth[k].abs() + 1e-37, || {
                format!("of {v}")
            });
        }
    }
    Ok(c.into())
}

fn normalize_ends(desk: &mut Desk) -> Result<Found> {
    let mut inputs = vectors(1e-38, 1e-15);
    inputs.push([0.0; 4]);
    let found = desk.probe(&FUNCTIONS, UNIT, &inputs)?;
    let mut c = Comparison::default();
    for (x, y) in inputs.iter().zip(found) {
        let length = y[..3].iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt();
        c.add((length - 1.0).max(0.0), 0.0, 18.0 * U_F32, || format!("of {x:?}"));
        c.holds(length.is_finite(), || format!("a finite vector of {x:?}"));
    }
    Ok(c.into())
}
