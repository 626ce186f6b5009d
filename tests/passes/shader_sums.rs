//! Sums as shaders form them (shaders/include/sum.glsl): plain, compensated and pairwise, in f32
//! and f64, each within its own bound. Compilers must not optimise the compensation away.

use crate::bounded::Random;
use crate::harness::{Gpu, assert_within_and_say, check_within};
use crate::sums::{KAHAN, PAIRWISE, PLAIN, every_way, ways_of};
use nimbus::gpu::Optimize;
use nimbus::gpu::{Compiler, Kernel, Sources};
use nimbus::layout::sums::SumMacros;
use nimbus::model::sums::{Precision, Summation, Sums};
use nimbus::passes::{self, SHADERS};
use nimbus::reference::rounding::sum_error;

/// A row of numbers for each invocation: their sum as one number, and as the second of three.
const TEXT: &str = r"#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
layout(local_size_x = 1) in;
layout(std430, binding = 0) readonly buffer Terms { float terms[]; };
layout(std430, binding = 1) readonly buffer Ends { uint ends[]; };
layout(std430, binding = 2) writeonly buffer Totals { vec2 totals[]; };
#include 'sum.glsl'
void main() {
    uint row = gl_WorkGroupID.x;
    SUM1 sum = EMPTY1;
    SUM3 three = EMPTY3;
    for (uint i = row == 0u ? 0u : ends[row - 1u]; i < ends[row]; ++i) {
        ADD(sum, terms[i]);
        ADD(three, vec3(0.5, 1.0, -1.0) * terms[i]);
    }
    totals[row] = vec2(float(TOTAL(sum)), vec3(TOTAL(three)).y);
}
";

/// Rows of every kind of numbers, and of every length that matters to a counter of blocks of 8.
fn rows() -> Vec<Vec<f32>> {
    let mut r = Random(7);
    let mut rows: Vec<Vec<f32>> =
        (0..40).map(|n| (0..n).map(|_| r.within(0.0, 1.0)).collect()).collect();
    for n in [63, 64, 65, 1000, 4096, 16_376, 16_384, 16_392, 40_000] {
        rows.push((0..n).map(|_| r.within(-1.0, 1.0)).collect());
        rows.push(vec![0.1; n]);
        rows.push(one_and_dust(n));
        // From 2⁻²⁰ to 2²⁰ with both signs, and back: sums far smaller than their terms.
        let wide: Vec<f32> =
            (0..n / 2).map(|_| r.within(-1.0, 1.0) * r.within(-20.0, 20.0).exp2()).collect();
        rows.push(
            wide.iter().copied().chain(wide.iter().rev().map(|x| -x)).chain([0.25]).collect(),
        );
    }
    rows
}

/// One, and numbers that are each rounded away beside it.
fn one_and_dust(n: usize) -> Vec<f32> {
    std::iter::once(1.0).chain((1..n).map(|_| 0.4 / 16_777_216.0)).collect()
}

/// The same by fours, in a loop of known length.
fn by_fours() -> Compiler {
    let (from, to) = ("++i) {", "i += 4u) { UNROLL for (uint k = 0u; k < 4u; ++k) {");
    let text = TEXT
        .replace(from, to)
        .replace("terms[i]);\n    }", "terms[i]);\n    } }")
        .replace("terms[i]", "terms[i + k]");
    compiler_of(&text, None)
}

fn compiler(wrong: Option<(&str, &str)>) -> Compiler {
    compiler_of(TEXT, wrong)
}

fn compiler_of(text: &str, wrong: Option<(&str, &str)>) -> Compiler {
    let text = text.replace('\'', "\"");
    let mut sources = Sources::embedded(&[&[("sums.comp", text.as_str())], SHADERS].concat());
    if let Some((from, to)) = wrong {
        assert!(sources.replace("include/sum.glsl", from, to), "{from}");
    }
    Compiler::new(sources, None).unwrap()
}

/// Sum of each row, both times.
fn run(gpu: &mut Gpu, compiler: &Compiler, sums: Sums, rows: &[Vec<f32>]) -> [Vec<f64>; 2] {
    let kernel =
        Kernel::with_macros(&gpu.device, compiler, "sums", &[], &[], SumMacros::from(sums).list())
            .expect("the kernel");
    let ends: Vec<u32> = rows
        .iter()
        .scan(0, |end, row| {
            Some(std::mem::replace(end, *end + row.len() as u32) + row.len() as u32)
        })
        .collect();
    let (terms, ends, totals) =
        (gpu.upload(&rows.concat()), gpu.upload(&ends), gpu.buffer::<[f32; 2]>(rows.len()));
    gpu.run(|rec| rec.dispatch_groups(&kernel, &[&terms, &ends, &totals], &(), rows.len() as u32));
    let totals: Vec<[f32; 2]> = gpu.download(&totals, rows.len());
    [0, 1].map(|k| totals.iter().map(|t| f64::from(t[k])).collect())
}

/// Sums without error: an f64 with its accumulated rounding error.
fn exact(row: &[f32]) -> f64 {
    let (mut sum, mut lost) = (0.0f64, 0.0);
    for x in row.iter().map(|x| f64::from(*x)) {
        let next = sum + x;
        let added = next - sum;
        lost += (sum - (next - added)) + (x - added);
        sum = next;
    }
    sum + lost
}

fn bounds(sums: Sums, rows: &[Vec<f32>]) -> Vec<f64> {
    let magnitude = |row: &[f32]| row.iter().map(|x| f64::from(x.abs())).sum::<f64>();
    rows.iter().map(|row| sum_error(sums, row.len() as u64) * magnitude(row)).collect()
}

#[test]
fn every_sum_is_within_its_bound() {
    let (mut gpu, rows) = (Gpu::new(), rows());
    let truths: Vec<f64> = rows.iter().map(|row| exact(row)).collect();
    let ways = ways_of(&gpu.device);
    assert_eq!(ways.len(), if gpu.device.limits().has_float64 { 6 } else { 3 });
    for way in ways {
        let bounds = bounds(way, &rows);
        let found = run(&mut gpu, &compiler(None), way, &rows);
        assert_within_and_say(&format!("{way:?}"), &found[0], &truths, &bounds);
        assert_eq!(found[0], found[1], "{way:?}: of numbers and of vectors");
    }
}

/// Copies of an unrolled body by an optimiser lose `precise`.
#[test]
fn sums_in_loops_of_a_known_length_are_within_their_bounds() {
    let (mut gpu, rows) = (Gpu::new(), vec![one_and_dust(8192), vec![0.1; 4096]]);
    let truths: Vec<f64> = rows.iter().map(|row| exact(row)).collect();
    for way in ways_of(&gpu.device) {
        let found = run(&mut gpu, &by_fours(), way, &rows);
        assert_within_and_say(
            &format!("{way:?} by fours"),
            &found[0],
            &truths,
            &bounds(way, &rows),
        );
    }
}

#[test]
fn plain_sums_are_not_within_the_bounds_of_the_others() {
    let (mut gpu, rows) = (Gpu::new(), vec![one_and_dust(4096), vec![0.1; 4096]]);
    let truths: Vec<f64> = rows.iter().map(|row| exact(row)).collect();
    let found = run(&mut gpu, &compiler(None), PLAIN, &rows);
    for other in [KAHAN, PAIRWISE, Sums { precision: Precision::F64, ..PLAIN }] {
        for k in [0, 1] {
            let one = |of: &[f64]| vec![of[k]];
            let bounds = bounds(other, &rows);
            assert!(
                check_within("plain", &one(&found[0]), &one(&truths), &one(&bounds)).is_err(),
                "{other:?}, row {k}"
            );
        }
    }
    // All of the small numbers are lost.
    assert_eq!(found[0][0], 1.0);
}

#[test]
fn wrong_sums_are_noticed() {
    let (mut gpu, rows) = (Gpu::new(), rows());
    let truths: Vec<f64> = rows.iter().map(|row| exact(row)).collect();
    for (way, from, to) in [
        (KAHAN, "x + sum.lost", "x"),
        (KAHAN, "(sum.value - (value - added)) + (term - added)", "(sum.value - (value - added))"),
        (PAIRWISE, "(n_blocks >> k & 1u) == 1u ? sum.parts[k]", "k < n_blocks ? sum.parts[k]"),
        (PAIRWISE, "sum.parts[N_PARTS - 1u] += carries", "sum.parts[N_PARTS - 1u] = carries"),
        (PAIRWISE, "return total + sum.parts[N_PARTS - 1u]", "return total"),
        (PAIRWISE, "sum.parts[k] = ends", "sum.parts[k] = ends && k < 9u"),
    ] {
        let found = run(&mut gpu, &compiler(Some((from, to))), way, &rows);
        assert!(
            check_within("wrong", &found[0], &truths, &bounds(way, &rows)).is_err(),
            "{from} as {to}"
        );
    }
}

const OP_DECORATE: u32 = 71;
const NO_CONTRACTION: u32 = 42;

/// Operations of a shader's SPIR-V that may not be fused or removed.
fn n_kept_as_written(file: &str, sums: Sums) -> usize {
    let compiler = Compiler::new(passes::sources(), None).unwrap();
    let words = compiler.compile(file, Optimize::Yes, SumMacros::from(sums).list()).unwrap();
    let (mut at, mut n) = (5, 0);
    while at < words.len() {
        n += usize::from(words[at] & 0xffff == OP_DECORATE && words[at + 2] == NO_CONTRACTION);
        at += (words[at] >> 16) as usize;
    }
    n
}

#[test]
fn compensation_may_not_be_optimised_away() {
    for file in ["transmit.comp", "contract.comp", "second_gather.comp"] {
        for way in every_way() {
            let n = n_kept_as_written(file, way);
            match way.summation {
                // Seven additions wherever a number is added.
                Summation::Kahan => assert!(n > 0 && n.is_multiple_of(7), "{file}, {way:?}: {n}"),
                _ => assert_eq!(n, 0, "{file}, {way:?}"),
            }
        }
    }
}
