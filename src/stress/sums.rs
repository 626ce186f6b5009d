//! Sums of a million terms by every summation of the shaders.

use super::case::{Case, Comparison};
use super::context::StressContext;
use crate::error::Result;
use crate::layout::sums::SumMacros;
use crate::model::sums::{Precision, Summation, Sums};
use crate::reference::rounding::sum_error;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "transport/sum-plain",
        what: "a million terms of both signs over 40 binades, added in sequence",
        bound: "gamma_(n-1) of the sum of magnitudes",
        check: |ctx, c| sums(ctx, c, Summation::Plain, Precision::F32),
    },
    Case {
        name: "transport/sum-kahan",
        what: "a million terms of both signs over 40 binades, with compensation",
        bound: "2 u + O(n u^2) of the sum of magnitudes",
        check: |ctx, c| sums(ctx, c, Summation::Kahan, Precision::F32),
    },
    Case {
        name: "transport/sum-pairwise",
        what: "a million terms of both signs over 40 binades, added pairwise",
        bound: "gamma of 8 + log2(n/4) + n/2^14 of the sum of magnitudes",
        check: |ctx, c| sums(ctx, c, Summation::Pairwise, Precision::F32),
    },
    Case {
        name: "transport/sum-double",
        what: "a million terms of both signs over 40 binades in f64, if the device has it",
        bound: "u of the sum, and gamma of f64",
        check: |ctx, c| sums(ctx, c, Summation::Plain, Precision::F64),
    },
];

/// A single invocation that adds `N_TERMS` terms, 16 per iteration. With guard bands a buffer is
/// longer than its terms.
const SUM: &str = r#"#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
layout(local_size_x = 1) in;
layout(std430, binding = 0) readonly buffer Terms { float terms[]; };
layout(std430, binding = 1) writeonly buffer Totals { float total; };
#include "sum.glsl"
// Unrolled by hand: an optimiser that unrolls may lose `precise`, and with it the compensation.
#define FOUR(i) ADD(sum, terms[i]); ADD(sum, terms[i + 1u]); ADD(sum, terms[i + 2u]); \
    ADD(sum, terms[i + 3u])
void main() {
    SUM1 sum = EMPTY1;
    for (uint i = 0u; i < N_TERMS; i += 16u) {
        FOUR(i);
        FOUR(i + 4u);
        FOUR(i + 8u);
        FOUR(i + 12u);
    }
    total = float(TOTAL(sum));
}
"#;

const N_TERMS: u32 = 1_000_000;

/// Returns two lists of terms: of both signs over 40 binades; and 1 followed by terms so small
/// that each, added alone, is rounded away.
fn terms() -> [Vec<f32>; 2] {
    let share = |i: u32, k: f64| (f64::from(i) * k).fract();
    let wide = |i: u32| {
        let magnitude = (40.0 * share(i, 0.754_877_666_246_693) - 30.0).exp2();
        ((2.0 * share(i, 0.618_033_988_749_895) - 1.0) * magnitude) as f32
    };
    let dust = |i: u32| if i == 0 { 1.0 } else { 0.4 / 16_777_216.0 };
    [(0..N_TERMS).map(wide).collect(), (0..N_TERMS).map(dust).collect()]
}

fn sums(
    ctx: &mut StressContext,
    c: &mut Comparison,
    summation: Summation,
    precision: Precision,
) -> Result<()> {
    if precision == Precision::F64 && !ctx.device().limits().has_float64 {
        c.skip("the device has no f64 in shaders");
        return Ok(());
    }
    let sums = Sums { summation, precision };
    let source = SUM.replace("N_TERMS", &format!("{N_TERMS}u"));
    let kernel = ctx.kernel("sum", &source, &[], SumMacros::from(sums).list())?;
    for (what, terms) in ["wide", "dust"].into_iter().zip(terms()) {
        let (x, y) = (ctx.upload(&terms)?, ctx.buffer::<f32>(1)?);
        ctx.run(|rec| rec.dispatch_groups(&kernel, &[&x, &y], &(), 1))?;
        let found = ctx.download::<f32>(&y, 1)?[0];
        // The exact sum: f64 and the sum of its rounding errors.
        let (mut sum, mut lost, mut magnitude) = (0.0f64, 0.0, 0.0);
        for x in terms.iter().map(|x| f64::from(*x)) {
            let next = sum + x;
            let added = next - sum;
            lost += (sum - (next - added)) + (x - added);
            (sum, magnitude) = (next, magnitude + x.abs());
        }
        let bound = sum_error(sums, u64::from(N_TERMS)) * magnitude;
        c.add(found, sum + lost, bound, format_args!("sum of {what} terms"));
    }
    Ok(())
}
