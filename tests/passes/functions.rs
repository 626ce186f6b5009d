//! Tests of the shaders' own functions: Philox's words bit for bit, the others against f64.
//!
//! The bounds follow from Vulkan's precision rules: +, −, × correctly rounded or contracted,
//! division 2.5 ulp, exp 3 + 2|x| ulp.

use crate::harness::{Gpu, assert_within_and_say, check_within};
use nimbus::gpu::{Compiler, Kernel, Sources};
use nimbus::layout::record;
use nimbus::passes::SHADERS;
use nimbus::reference::rounding::{REDUCTION_ERROR, SINE_ERROR, U_F32, erf_bound};

record! {
    struct Push { n: u32, which: u32 }
}

const FUNCTIONS: &str = r#"#version 460
#extension GL_GOOGLE_include_directive : require
#include "each.glsl"
#include "functions.glsl"
layout(local_size_x = 64) in;
layout(push_constant) uniform Push { uint n; uint which; } push;
layout(std430, binding = 0) readonly buffer X { float x[]; };
layout(std430, binding = 1) writeonly buffer Y { float y[]; };
void main() {
    FOR_EACH(i, push.n) {
        switch (push.which) {
        case 0: y[i] = sine(x[i]); break;
        case 1: y[i] = erf_approx(x[i]); break;
        case 2: y[i] = one_minus_exp(x[i]); break;
        case 5: y[i] = power_of_two(x[i]); break;
        case 6: y[i] = power_of_two_16(x[i]); break;
        case 7: y[i] = one_minus_exp_16(x[i]); break;
        case 8: y[i] = thin_opacity(x[i]); break;
        case 9: y[i] = thin_opacity_16(x[i]); break;
        default: y[i] = unit_at(x[i])[push.which - 3];
        }
    }
}
"#;

const KAT: &str = r#"#version 460
#extension GL_GOOGLE_include_directive : require
#include "each.glsl"
#include "philox.glsl"
layout(local_size_x = 64) in;
layout(push_constant) uniform Push { uint n; uint which; } push;
layout(std430, binding = 0) readonly buffer Keys { uvec2 keys[]; };
layout(std430, binding = 1) readonly buffer Counters { uvec4 counters[]; };
layout(std430, binding = 2) writeonly buffer Words { uvec4 words[]; };
layout(std430, binding = 3) writeonly buffer Uniforms { vec4 u[]; };
void main() {
    FOR_EACH(i, push.n) {
        words[i] = philox4x32_10(keys[i], counters[i]);
        u[i] = uniforms(words[i]);
    }
}
"#;

/// The `philox4x32 10` lines of Random123's kat_vectors: key, counter, words.
const KNOWN: [([u32; 2], [u32; 4], [u32; 4]); 3] = [
    ([0; 2], [0; 4], [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]),
    ([u32::MAX; 2], [u32::MAX; 4], [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]),
    (
        [0xa409_3822, 0x299f_31d0],
        [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
        [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1],
    ),
];

const SINE: u32 = 0;
const ERF: u32 = 1;
const ONE_MINUS_EXP: u32 = 2;
const UNIT_AT: u32 = 3;
const POWER_OF_TWO: u32 = 5;
const POWER_OF_TWO_16: u32 = 6;
const ONE_MINUS_EXP_16: u32 = 7;
const THIN_OPACITY: u32 = 8;
const THIN_OPACITY_16: u32 = 9;

fn evaluate(gpu: &mut Gpu, kernel: &Kernel, which: u32, x: &[f32]) -> Vec<f64> {
    let (input, output) = (gpu.upload(x), gpu.buffer::<f32>(x.len()));
    let push = Push { n: x.len() as u32, which };
    gpu.run(|rec| rec.dispatch(kernel, &[&input, &output], &push, push.n));
    gpu.download::<f32>(&output, x.len()).into_iter().map(f64::from).collect()
}

/// Returns the kernel with a text of functions.glsl replaced.
fn wrong_functions(gpu: &Gpu, from: &str, to: &str) -> Kernel {
    let mut sources = Sources::embedded(&[&[("functions.comp", FUNCTIONS)], SHADERS].concat());
    assert!(sources.replace("include/functions.glsl", from, to));
    let compiler = Compiler::new(sources, None).unwrap();
    Kernel::new(&gpu.device, &compiler, "functions", Push::FIELDS).unwrap()
}

/// Returns `n` numbers of either sign whose magnitudes are spread evenly over the exponents from
/// `low` to `high`, then as many spread evenly over ±`high`.
fn sweep(low: f64, high: f64, n: usize) -> Vec<f32> {
    let share = |i: usize| (i as f64 + 0.5) / n as f64;
    let sign = |i: usize| if i.is_multiple_of(2) { 1.0 } else { -1.0 };
    let log = (0..n).map(|i| (sign(i) * low * (high / low).powf(share(i))) as f32);
    log.chain((0..n).map(|i| (high * (2.0 * share(i) - 1.0)) as f32)).collect()
}

#[test]
fn philox_gives_the_published_words() {
    let mut gpu = Gpu::new();
    let keys = gpu.upload(&KNOWN.map(|(key, _, _)| key));
    let counters = gpu.upload(&KNOWN.map(|(_, counter, _)| counter));
    let (words, uniforms) = (gpu.buffer::<[u32; 4]>(3), gpu.buffer::<[f32; 4]>(3));
    let answers = |gpu: &mut Gpu, kernel: &Kernel| {
        let push = Push { n: 3, which: 0 };
        gpu.run(|rec| rec.dispatch(kernel, &[&keys, &counters, &words, &uniforms], &push, 3));
        (gpu.download::<[u32; 4]>(&words, 3), gpu.download::<[f32; 4]>(&uniforms, 3))
    };
    let kernel = gpu.test_kernel("kat", KAT, Push::FIELDS);
    let (found, u) = answers(&mut gpu, &kernel);
    assert_eq!(found, KNOWN.map(|(_, _, words)| words));
    let expected =
        KNOWN.map(|(_, _, words)| words.map(|w| nimbus::model::philox::uniform(w) as f32));
    assert_eq!(u, expected);

    // A wrong digit of a multiplier and a missing round must both show.
    for (from, to) in [("0xCD9E8D57u", "0xCD9E8D55u"), ("i < 10", "i < 9")] {
        let mut sources = Sources::embedded(&[&[("kat.comp", KAT)], SHADERS].concat());
        assert!(sources.replace("include/philox.glsl", from, to));
        let compiler = Compiler::new(sources, None).unwrap();
        let wrong = Kernel::new(&gpu.device, &compiler, "kat", Push::FIELDS).unwrap();
        assert_ne!(answers(&mut gpu, &wrong).0, found);
    }
}

/// Returns the bound on sine's error at `x`: the argument moved by e, and SINE_ERROR.
fn sine_bound(x: f64) -> f64 {
    let e = REDUCTION_ERROR * U_F32 * x.abs();
    SINE_ERROR + x.cos().abs() * e + 0.5 * e * e
}

#[test]
fn sine_is_within_its_documented_error() {
    let mut gpu = Gpu::new();
    let kernel = gpu.test_kernel("functions", FUNCTIONS, Push::FIELDS);
    // The reduction holds for |k| < 2^14.
    let mut x = sweep(1e-20, 16_383.0 * std::f64::consts::PI, 400_000);
    x.extend(sweep(1e-3, 12.0, 400_000));
    // Zeros, extremes, and arguments at which the reduction changes to the next multiple of π.
    for k in -20_000..20_000 {
        let at = (f64::from(k) * 0.5 * std::f64::consts::PI) as f32;
        x.extend([at.next_down(), at, at.next_up()]);
    }
    let values = evaluate(&mut gpu, &kernel, SINE, &x);
    let truths: Vec<f64> = x.iter().map(|x| f64::from(*x).sin()).collect();
    let bounds: Vec<f64> = x.iter().map(|x| sine_bound(f64::from(*x))).collect();
    assert_within_and_say("sine", &values, &truths, &bounds);
    let small: Vec<usize> = (0..x.len()).filter(|i| x[*i].abs() < 1.5).collect();
    let worst = small.iter().map(|i| (values[*i] - truths[*i]).abs()).fold(0.0, f64::max);
    println!("sine: greatest error without reduction {worst:e}, allowed {SINE_ERROR:e}");

    // Beyond the reduction's range the result is at most 1, with the polynomial's rounding.
    let huge = evaluate(&mut gpu, &kernel, SINE, &[1e6, -3e8, 6.75e9, -6.8e9, 1e20, -1e37, 3.4e38]);
    assert!(huge.iter().all(|v| v.abs() <= 1.0 + SINE_ERROR), "{huge:?}");

    // A coefficient, and a part of π, in their fourth digits; the sign of every other two half
    // waves.
    for (from, to) in [
        ("0.00833307858", "0.00833007858"),
        ("0.0009670257568359375", "0.0009660257568359375"),
        ("2.0 * floor(k * 0.5)", "4.0 * floor(k * 0.25)"),
    ] {
        let wrong = wrong_functions(&gpu, from, to);
        let values = evaluate(&mut gpu, &wrong, SINE, &x);
        assert!(check_within("a wrong sine", &values, &truths, &bounds).is_err(), "{to}");
    }
}

#[test]
fn unit_at_is_within_its_documented_error() {
    let mut gpu = Gpu::new();
    let kernel = gpu.test_kernel("functions", FUNCTIONS, Push::FIELDS);
    // Multiples of 2⁻²⁴ from −½ to ½, both ends and the quarters among them.
    let mut x: Vec<f32> =
        (-(1 << 19)..=1 << 19).map(|i| (f64::from(i) / f64::from(1 << 20)) as f32).collect();
    x.extend((0..1 << 18).map(|i| (f64::from(i * 61 % (1 << 23)) / f64::from(1 << 24)) as f32));
    let bounds = vec![10.0 * U_F32; x.len()];
    for (axis, of) in [(0, f64::cos as fn(f64) -> f64), (1, f64::sin)] {
        let truths: Vec<f64> =
            x.iter().map(|x| of(std::f64::consts::TAU * f64::from(*x))).collect();
        let values = evaluate(&mut gpu, &kernel, UNIT_AT + axis, &x);
        assert_within_and_say("a unit vector", &values, &truths, &bounds);
        let wrong = wrong_functions(&gpu, "min(a, 0.5 - a)", "min(a, 0.49999 - a)");
        let values = evaluate(&mut gpu, &wrong, UNIT_AT + axis, &x);
        assert_eq!(check_within("a wrong sine", &values, &truths, &bounds).is_err(), axis == 1);
    }
}

#[test]
fn erf_is_within_the_formulas_error_and_its_rounding() {
    let mut gpu = Gpu::new();
    let kernel = gpu.test_kernel("functions", FUNCTIONS, Push::FIELDS);
    let mut x = sweep(1e-20, 5.0, 500_000);
    x.extend([0.0, -0.0]);
    let values = evaluate(&mut gpu, &kernel, ERF, &x);
    let truths: Vec<f64> = x.iter().map(|x| libm::erf(f64::from(*x))).collect();
    let bounds: Vec<f64> = x.iter().map(|x| erf_bound(f64::from(*x))).collect();
    assert_within_and_say("erf", &values, &truths, &bounds);
    let worst = (0..x.len()).map(|i| (values[i] - truths[i]).abs()).fold(0.0, f64::max);
    println!(
        "erf: greatest error {worst:e}, greatest bound {:e}",
        bounds.iter().copied().fold(0.0, f64::max)
    );
    let n = x.len();
    assert_eq!(values[n - 2..], [0.0, 0.0]);

    let wrong = wrong_functions(&gpu, "0.0092705272", "0.0092805272");
    let values = evaluate(&mut gpu, &wrong, ERF, &x);
    assert!(check_within("a wrong erf", &values, &truths, &bounds).is_err());
}

#[test]
fn powers_of_two_are_within_their_documented_error() {
    let mut gpu = Gpu::new();
    let kernel = gpu.test_kernel("functions", FUNCTIONS, Push::FIELDS);
    let mut x = sweep(1e-20, 125.0, 400_000);
    // Integers, and arguments at which the reduction changes to the next one.
    x.extend((-249..250).flat_map(|k| {
        let at = 0.5 * k as f32;
        [at.next_down(), at, at.next_up()]
    }));
    let values = evaluate(&mut gpu, &kernel, POWER_OF_TWO, &x);
    let truths: Vec<f64> = x.iter().map(|x| f64::from(*x).exp2()).collect();
    // The polynomial errs by 7.5e-8. Rounding adds e_k <= u |p_k| + u |c_k| + |f| (u |p_k+1| +
    // e_k+1) down to k = 0. It is greatest at |f| = 1/2: 3.7 u.
    let bounds: Vec<f64> = truths.iter().map(|t| (7.5e-8 + 3.7 * U_F32) * t).collect();
    assert_within_and_say("a power of two", &values, &truths, &bounds);
    let wrong = wrong_functions(&gpu, "0.0555071327386", "0.0555171327386");
    let values = evaluate(&mut gpu, &wrong, POWER_OF_TWO, &x);
    assert!(check_within("a wrong power", &values, &truths, &bounds).is_err());

    // The one for 16 bits: its polynomial errs by 2.6e-6. Rounding is the same.
    let bounds: Vec<f64> = truths.iter().map(|t| (2.6e-6 + 3.7 * U_F32) * t).collect();
    let values = evaluate(&mut gpu, &kernel, POWER_OF_TWO_16, &x);
    assert_within_and_say("a power of two for 16 bits", &values, &truths, &bounds);
    let wrong = wrong_functions(&gpu, "0.0559178603194", "0.0559378603194");
    let values = evaluate(&mut gpu, &wrong, POWER_OF_TWO_16, &x);
    assert!(check_within("a wrong power for 16 bits", &values, &truths, &bounds).is_err());
}

/// The opacities of thin blobs. Their fits err by 1.6e-8 and by 2.5e-6. The bracket is near 1 and
/// at most 1: its last sum rounds by u, what it adds up by less than u/4 together, and the product
/// by u.
#[test]
fn thin_opacities_keep_their_relative_accuracy() {
    let mut gpu = Gpu::new();
    let kernel = gpu.test_kernel("functions", FUNCTIONS, Push::FIELDS);
    let mut x: Vec<f32> = sweep(1e-30, 0.125, 200_000).into_iter().map(f32::abs).collect();
    x.extend([0.0, 0.125]);
    let truths: Vec<f64> = x.iter().map(|x| -libm::expm1(-f64::from(*x))).collect();
    for (what, which, fit, from, to) in [
        ("thin", THIN_OPACITY, 1.6e-8, "0.499996093888", "0.499986093888"),
        ("thin for 16 bits", THIN_OPACITY_16, 2.5e-6, "0.159046454904", "0.159446454904"),
    ] {
        let bounds: Vec<f64> = truths.iter().map(|t| (fit + 2.25 * U_F32) * t).collect();
        let values = evaluate(&mut gpu, &kernel, which, &x);
        assert_within_and_say(what, &values, &truths, &bounds);
        let wrong = wrong_functions(&gpu, from, to);
        let values = evaluate(&mut gpu, &wrong, which, &x);
        assert!(check_within(what, &values, &truths, &bounds).is_err(), "{to}");
    }
}

/// The relative error that functions.glsl promises. The exponent x is rounded twice. Where n is 0,
/// f is x: 2 u. Elsewhere 2 u |x| of e^−t are 2 u t/(e^t − 1) of the result, less than 2 u. The
/// polynomial, of which the last sum has the most, errs by 1.5 u, f p by one more, and the last
/// difference by one: 5.5 u = 3.3e-7. Its fit adds 1.1e-8.
const ONE_MINUS_EXP_ERROR: f64 = 3.5e-7;

#[test]
fn one_minus_exp_keeps_its_relative_accuracy() {
    let mut gpu = Gpu::new();
    let kernel = gpu.test_kernel("functions", FUNCTIONS, Push::FIELDS);
    // Normal numbers up to 80; beyond, e^−t is below 2^−115 and the result is 1.
    let mut x: Vec<f32> = sweep(1.2e-38, 80.0, 500_000).into_iter().map(f32::abs).collect();
    x.extend([0.0, 0.5f32.next_down(), 0.5, 0.5f32.next_up(), 80.0]);
    let values = evaluate(&mut gpu, &kernel, ONE_MINUS_EXP, &x);
    let truths: Vec<f64> = x.iter().map(|x| -libm::expm1(-f64::from(*x))).collect();
    let bounds: Vec<f64> = truths.iter().map(|t| ONE_MINUS_EXP_ERROR * t).collect();
    assert_within_and_say("1 - e^-t", &values, &truths, &bounds);
    assert_eq!(values[x.len() - 5], 0.0);

    // The one for 16 bits: its fit errs by 1.5e-5.
    let bounds_16: Vec<f64> = truths.iter().map(|t| (1.5e-5 + ONE_MINUS_EXP_ERROR) * t).collect();
    let values = evaluate(&mut gpu, &kernel, ONE_MINUS_EXP_16, &x);
    assert_within_and_say("1 - e^-t for 16 bits", &values, &truths, &bounds_16);
    let wrong = wrong_functions(&gpu, "0.0558372882603", "0.0559372882603");
    let values = evaluate(&mut gpu, &wrong, ONE_MINUS_EXP_16, &x);
    assert!(check_within("wrong for 16 bits", &values, &truths, &bounds_16).is_err());

    // The cancellation near 0 must show, and a wrong digit.
    for (from, to) in [
        ("(1.0 - scale) - scale * d", "1.0 - (scale + scale * d)"),
        ("0.0555035743364", "0.0555065743364"),
        (
            "float n = roundEven(x);\n    float f = x - n;\n    float p = (0.000154",
            "float n = floor(x);\n    float f = x - n;\n    float p = (0.000154",
        ),
    ] {
        let wrong = wrong_functions(&gpu, from, to);
        let values = evaluate(&mut gpu, &wrong, ONE_MINUS_EXP, &x);
        assert!(check_within("a wrong 1 - e^-t", &values, &truths, &bounds).is_err(), "{to}");
    }
}
