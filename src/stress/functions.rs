//! Single shader functions compared with `f64`.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::Vec3;

use super::case::{Case, Comparison};
use super::context::StressContext;
use crate::error::Result;
use crate::model::basis::{N_NODES, evaluate, node};
use crate::model::material::Brdf;
use crate::reference::rounding::{DIVISION_ERROR, SINE_ERROR, U_F32, erf_bound};

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "functions/rounding",
        what: "sums, differences and products over 60 binades; all other bounds assume that \
            they are rounded to nearest",
        bound: "0: rounded to nearest",
        check: rounding,
    },
    Case {
        name: "functions/division",
        what: "quotients over 60 binades",
        bound: "2.5 ulp (Vulkan)",
        check: division,
    },
    Case {
        name: "functions/square-root",
        what: "sqrt from 1e-30 to 1e30, and of 0",
        bound: "9.1 u: 2 ulp of inversesqrt, 2.5 of its inverse",
        check: |ctx, c| {
            let bound = (1.0 + 4.0 * U_F32) * (1.0 + DIVISION_ERROR * U_F32) - 1.0;
            let x = [positive(1e-30, 1e30, N), vec![0.0]].concat();
            compare(ctx, c, "sqrt(x.x)", &x, f64::sqrt, |_, y| bound * y)
        },
    },
    Case {
        name: "functions/inverse-root",
        what: "inversesqrt from 1e-30 to 1e30",
        bound: "2 ulp (Vulkan)",
        check: |ctx, c| {
            let x = positive(1e-30, 1e30, N);
            compare(ctx, c, "inversesqrt(x.x)", &x, |x| 1.0 / x.sqrt(), |_, y| 2.0 * ulp(y))
        },
    },
    Case {
        name: "functions/exponential",
        what: "e^-t for t from 1e-30 to 87, and 0",
        bound: "3 + 2t ulp (Vulkan)",
        check: |ctx, c| {
            let t = [positive(1e-30, 87.0, N), vec![0.0]].concat();
            compare(ctx, c, "exp(-x.x)", &t, |t| (-t).exp(), |t, y| (3.0 + 2.0 * t) * ulp(y))
        },
    },
    Case {
        name: "functions/exponential-end",
        what: "e^-t for t from 88 to infinity, where the result is subnormal or 0",
        bound: "2^-126: the smallest normal number",
        check: |ctx, c| {
            let t = [positive(88.0, 1e38, N / 10), vec![f32::MAX, f32::INFINITY]].concat();
            compare(ctx, c, "exp(-x.x)", &t, |t| (-t).exp(), |_, _| f32::MIN_POSITIVE.into())
        },
    },
    Case {
        name: "functions/logarithm",
        what: "ln x from 1e-30 to 1e30, and densely from 0.5 to 2",
        bound: "4 ulp; 2^-21 where 1/2 < x < 2: Vulkan's 3 ulp, and the product of log2 x and ln 2",
        check: |ctx, c| {
            let near_one = (0..N / 2).map(|i| 0.5 + 1.5 * i as f32 / (N / 2) as f32);
            let x: Vec<f32> = positive(1e-30, 1e30, N).into_iter().chain(near_one).collect();
            let bound = |x: f64, y: f64| {
                if (0.5..=2.0).contains(&x) { (-21f64).exp2() } else { 4.0 * ulp(y) }
            };
            compare(ctx, c, "log(x.x)", &x, f64::ln, bound)
        },
    },
    Case {
        name: "functions/sine",
        what: "sine for |x| up to 16383 pi, with its zeros and the ends of its argument reduction",
        bound: "4 u, and 5 u of the reduced argument",
        check: sine,
    },
    Case {
        name: "functions/sine-far",
        what: "sine of arguments up to 3.4e38, too large to reduce: a value within -1 and 1",
        bound: "|value| <= 1 + 4 u",
        check: |ctx, c| {
            let x = [sweep(1e5, 3.3e38, N / 2), vec![f32::MAX, f32::MIN]].concat();
            for (x, y) in evaluate_on_device(ctx, "sine(x.x)", &x)? {
                c.add(y.clamp(-1.0, 1.0), y, SINE_ERROR, format_args!("x = {x:e}"));
            }
            Ok(())
        },
    },
    Case {
        name: "functions/unit-vectors",
        what: "(cos, sin) of every multiple of 2^-20 of a turn, from -1/2 to 1/2",
        bound: "10 u",
        check: unit_vectors,
    },
    Case {
        name: "functions/erf",
        what: "erf for |x| from 1e-20 to 5, and zeros of both signs",
        bound: "3e-7 of the formula, and its rounding in f32",
        check: |ctx, c| {
            let x = [sweep(1e-20, 5.0, N), vec![0.0, -0.0]].concat();
            compare(ctx, c, "erf_approx(x.x)", &x, libm::erf, |x, _| erf_bound(x))
        },
    },
    Case {
        name: "functions/power-of-two",
        what: "2^x for |x| up to 125, with integers and the ends of its argument reduction",
        bound: "7.5e-8 + 3.7 u, relative",
        check: |ctx, c| {
            let ends = (-249..250).flat_map(|k| neighbours(0.5 * k as f32));
            let x: Vec<f32> = sweep(1e-20, 125.0, N).into_iter().chain(ends).collect();
            compare(ctx, c, "power_of_two(x.x)", &x, f64::exp2, |_, y| (7.5e-8 + 3.7 * U_F32) * y)
        },
    },
    Case {
        name: "functions/one-minus-exp",
        what: "1 - e^-t for t from 1e-30 to 1e38: the opacity of thin and thick blobs",
        bound: "3.5e-7, relative",
        check: |ctx, c| {
            let ends = vec![0.0, 0.5f32.next_down(), 0.5, 1.0, f32::MAX];
            let t = [positive(1e-30, 1e38, N), ends].concat();
            compare(ctx, c, "one_minus_exp(x.x)", &t, |t| -(-t).exp_m1(), |_, y| 3.5e-7 * y)
        },
    },
    Case {
        name: "functions/half-vector",
        what: "1 - cos of the angle between normal and half vector, from 1e-6 rad to a right angle",
        bound: "|chord| 15.6 u and its square",
        check: half_vector,
    },
    Case {
        name: "functions/lobe",
        what: "cos^n of an angle, interpolated in its table, for n from 0 to 10^6",
        bound: "h^2/8 max |f''| of the table, and rounding",
        check: lobe,
    },
    Case {
        name: "functions/normalize",
        what: "normalised vectors of lengths from 1e-14 to 1e18",
        bound: "9 u a component",
        check: normalize,
    },
    Case {
        name: "functions/normalize-ends",
        what: "normalised vectors whose squared length underflows: finite, not longer than 1",
        bound: "1 + 18 u",
        check: normalize_ends,
    },
];

/// Number of arguments of most functions.
const N: usize = 200_000;

/// Returns the spacing of `f32` at `x`; that of the smallest normal number if `x` is subnormal.
fn ulp(x: f64) -> f64 {
    let exponent = x.abs().max(f64::from(f32::MIN_POSITIVE)).log2().floor();
    (exponent - 23.0).exp2()
}

/// Returns `n` numbers of alternating sign with magnitudes from `low` to `high`, evenly spread
/// over the exponents.
fn sweep(low: f64, high: f64, n: usize) -> Vec<f32> {
    let share = |i: usize| (i as f64 + 0.5) / n as f64;
    let sign = |i: usize| if i.is_multiple_of(2) { 1.0 } else { -1.0 };
    (0..n).map(|i| (sign(i) * low * (high / low).powf(share(i))) as f32).collect()
}

fn positive(low: f64, high: f64, n: usize) -> Vec<f32> {
    sweep(low, high, n).into_iter().map(f32::abs).collect()
}

fn neighbours(x: f32) -> [f32; 3] {
    [x.next_down(), x, x.next_up()]
}

/// Evaluates a GLSL expression of the float `x.x` for every input. Returns the inputs with their
/// values.
fn evaluate_on_device(
    ctx: &mut StressContext,
    glsl: &str,
    inputs: &[f32],
) -> Result<impl Iterator<Item = (f32, f64)> + use<>> {
    let inputs = inputs.iter().map(|x| [*x, 0.0, 0.0, 0.0]).collect();
    let found = ctx.probe("functions.glsl", &[], &format!("return vec4({glsl});"), inputs)?;
    Ok(found.map(|(x, y)| (x[0], f64::from(y[0]))))
}

/// Compares a GLSL expression of the float `x.x` with `truth(x)`; `bound(x, truth(x))`.
fn compare(
    ctx: &mut StressContext,
    c: &mut Comparison,
    glsl: &str,
    inputs: &[f32],
    truth: impl Fn(f64) -> f64,
    bound: impl Fn(f64, f64) -> f64,
) -> Result<()> {
    for (x, value) in evaluate_on_device(ctx, glsl, inputs)? {
        let x = f64::from(x);
        let truth = truth(x);
        c.add(value, truth, bound(x, truth), format_args!("x = {x:e}"));
    }
    Ok(())
}

/// Returns pairs whose sums, products and quotients are normal numbers. Half of the pairs nearly
/// cancel.
fn pairs() -> Vec<[f32; 4]> {
    let numbers = sweep(1e-9, 1e9, 60_013);
    let far = numbers.iter().zip(numbers.iter().rev()).map(|(a, b)| [*a, *b, 0.0, 0.0]);
    let near = numbers
        .iter()
        .enumerate()
        .map(|(i, a)| [*a, -a * (1.0 + 1e-4 * (i % 977) as f32), 0.0, 0.0]);
    far.chain(near).collect()
}

fn rounding(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let body =
        "precise float s = x.x + x.y, d = x.x - x.y, p = x.x * x.y; return vec4(s, d, p, 0.0);";
    for ([a, b, ..], y) in ctx.probe("functions.glsl", &[], body, pairs())? {
        let (a, b) = (f64::from(a), f64::from(b));
        for (y, (sign, exact)) in y.into_iter().zip([("+", a + b), ("-", a - b), ("*", a * b)]) {
            // Rounding to f64 first is harmless: f64 has more than 2·24 + 2 digits.
            c.exact(y, exact as f32, format_args!("{a:e} {sign} {b:e}"));
        }
    }
    Ok(())
}

fn division(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for ([a, b, ..], y) in ctx.probe("functions.glsl", &[], "return vec4(x.x / x.y);", pairs())? {
        let truth = f64::from(a) / f64::from(b);
        c.add(y[0], truth, 2.5 * ulp(truth), format_args!("{a:e} / {b:e}"));
    }
    Ok(())
}

fn sine(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let ends = (-10_000..10_000).flat_map(|k| neighbours((f64::from(k) * 0.5 * PI) as f32));
    let x: Vec<f32> = sweep(1e-20, 16_383.0 * PI, N).into_iter().chain(ends).collect();
    let bound = |x: f64, _: f64| {
        // The argument and the remainder after the first part of pi are exact; three more
        // subtractions round a number of at most pi/2.
        let e = if x.abs() > FRAC_PI_2 { 5.0 * U_F32 } else { 0.0 };
        SINE_ERROR + x.cos().abs() * e + 0.5 * e * e
    };
    compare(ctx, c, "sine(x.x)", &x, f64::sin, bound)
}

fn unit_vectors(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let turns = (-(1 << 19)..=1 << 19)
        .map(|i| [(f64::from(i) / f64::from(1 << 20)) as f32, 0.0, 0.0, 0.0])
        .collect();
    let body = "return vec4(unit_at(x.x), 0.0, 0.0);";
    for ([turn, ..], y) in ctx.probe("functions.glsl", &[], body, turns)? {
        let (sin, cos) = (TAU * f64::from(turn)).sin_cos();
        c.add(y[0], cos, 10.0 * U_F32, format_args!("cos of {turn} turns"));
        c.add(y[1], sin, 10.0 * U_F32, format_args!("sin of {turn} turns"));
    }
    Ok(())
}

/// Returns |n - h|²/2 of the half vector h of two directions (ax, az, bx, bz), with the bound of
/// the device's value. The normal n is the z axis.
pub(super) fn half_vector_gap(directions: [f32; 4]) -> (f64, f64) {
    let [ax, az, bx, bz] = directions.map(f64::from);
    let (hx, hz) = (ax + bx, az + bz);
    let length = hx.hypot(hz);
    // Exactly opposite directions have no half vector; the shader then takes the normal as chord.
    let chord = if length > 0.0 { (hx / length).hypot(1.0 - hz / length) } else { 1.0 };
    let truth = 0.5 * chord * chord;
    // Per component of the chord 3u/2 + 4u + 2u + u, at most 9u; of its length 9 √3 u.
    let off = 15.6 * U_F32;
    (truth, chord * off + 0.5 * off * off + 4.0 * U_F32 * truth)
}

fn half_vector(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    // Two directions in the xz plane on either side of one at an angle to the normal. Every fourth
    // pair is nearly opposite, so that the length of its sum goes down to 1e-6.
    let inputs = (0..100_000)
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
    // lobe_at keeps the table bound.
    let body = "float gap = half_vector_gap(vec3(0.0, 0.0, 1.0), vec3(x.x, 0.0, x.y), \
        vec3(x.z, 0.0, x.w)); return vec4(gap, lobe_at(0u, 0.0), 0.0, 0.0);";
    for (x, y) in ctx.probe("lobe.glsl", &[0.0; 2], body, inputs)? {
        let (truth, bound) = half_vector_gap(x);
        c.add(y[0], truth, bound, format_args!("half of the squared chord, {truth:e}"));
    }
    Ok(())
}

/// Returns the lobe of exponent `ns` at the nodes of the device's table.
pub(super) fn lobe_table(ns: f64) -> Vec<f64> {
    (0..N_NODES).map(|i| Brdf::lobe(ns, node(i))).collect()
}

/// Returns the greatest difference of neighbours.
pub(super) fn largest_step(values: &[f64]) -> f64 {
    values.windows(2).map(|v| (v[1] - v[0]).abs()).fold(0.0, f64::max)
}

/// Returns the greatest second difference.
pub(super) fn largest_bend(values: &[f64]) -> f64 {
    values.windows(3).map(|v| (v[2] - 2.0 * v[1] + v[0]).abs()).fold(0.0, f64::max)
}

fn lobe(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    // w = t^4; the nodes are evenly spaced in t.
    let inputs: Vec<[f32; 4]> = (0..20_000)
        .map(|i| [((f64::from(i) + 0.37) / 20_000.0).powi(4) as f32, 0.0, 0.0, 0.0])
        .collect();
    for ns in [0.0, 1.0, 12.0, 300.0, 1e4, 1e6] {
        let table = lobe_table(ns);
        let rounded: Vec<f32> = table.iter().map(|v| *v as f32).collect();
        let body = "return vec4(lobe_at(0u, x.x));";
        for ([w, ..], y) in ctx.probe("lobe.glsl", &rounded, body, inputs.clone())? {
            let w = f64::from(w);
            let t = w.sqrt().sqrt() * (N_NODES - 1) as f64;
            // Two roots of 9.1 u each, the first halved by the second, and two products: 16 u of
            // t, which is measured in nodes.
            let off = 16.0 * U_F32 * t.max(1.0);
            let i = (t as usize).clamp(1, N_NODES - 2);
            // The steepest of the three intervals around t; rounding of entries and interpolation.
            let around = &table[i - 1..(i + 3).min(N_NODES)];
            let largest = table[i - 1].abs().max(table[i].abs());
            // A device may take subnormal numbers for 0: an entry, and a product of the mix.
            let flushed = 2.0 * f64::from(f32::MIN_POSITIVE);
            let rounding = off * largest_step(around) + 4.0 * U_F32 * largest + flushed;
            let truth = evaluate(&table, w);
            c.add(y[0], truth, rounding, format_args!("table of n = {ns:e} at w = {w:e}"));
            // The second difference is h² |f''| but for the next order, at most half of it here.
            let bound = rounding + 1.5 * largest_bend(around) / 8.0;
            c.add(y[0], Brdf::lobe(ns, w), bound, format_args!("cos^n of n = {ns:e} at w = {w:e}"));
        }
    }
    Ok(())
}

/// Returns vectors of many directions with lengths from `low` to `high`.
fn vectors(low: f64, high: f64) -> Vec<[f32; 4]> {
    let vector = |i: u32| {
        let length = low * (high / low).powf(f64::from(i) / 50_000.0);
        let (a, z) = (2.399963 * f64::from(i), 2.0 * (f64::from(i % 1009) + 0.5) / 1009.0 - 1.0);
        let r = (1.0 - z * z).sqrt();
        [r * a.cos(), r * a.sin(), z, 0.0].map(|v| (v * length) as f32)
    };
    (0..50_000).map(vector).collect()
}

const UNIT: &str = "return vec4(unit(x.xyz), 0.0);";

fn normalize(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for (x, y) in ctx.probe("functions.glsl", &[], UNIT, vectors(1e-14, 1e18))? {
        let v = Vec3::from_slice(&x).as_dvec3();
        // The square rounds three products and two sums, halved by the root; the root 4 u, the
        // last product u.
        let bound = |truth: f64| 9.0 * U_F32 * truth.abs() + 1e-37;
        c.each(y, (v / v.length()).to_array(), bound, format_args!("{v}"));
    }
    Ok(())
}

fn normalize_ends(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let inputs = [vectors(1e-38, 1e-15), vec![[0.0; 4]]].concat();
    for (x, y) in ctx.probe("functions.glsl", &[], UNIT, inputs)? {
        let length = y[..3].iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt();
        c.add((length - 1.0).max(0.0), 0.0, 18.0 * U_F32, format_args!("{x:?}"));
        c.holds(length.is_finite(), format_args!("finite vector of {x:?}"));
    }
    Ok(())
}
