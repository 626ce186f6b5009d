//! The radix sort and its keys: keys of every kind, numbers of entries around whole tiles, depths
//! of both signs.

use super::case::{Case, Comparison};
use super::context::StressContext;
use crate::error::Result;
use crate::model::philox::philox4x32_10;
use crate::passes::sort::{Count, Sort};
use crate::reference::sort::{key16, key32, order};

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "sorting/random",
        what: "0 to 20 000 random keys, in numbers that fill tiles and that do not",
        bound: "0: the stable order",
        check: |ctx, c| sorted(ctx, c, |i| philox4x32_10([7, 0], [i, 0, 0, 0])[0]),
    },
    Case {
        name: "sorting/equal",
        what: "equal keys: the input order",
        bound: "0: the stable order",
        check: |ctx, c| sorted(ctx, c, |_| 0x1234_5678),
    },
    Case {
        name: "sorting/few",
        what: "keys of 0 and of the two largest values",
        bound: "0: the stable order",
        check: |ctx, c| sorted(ctx, c, |i| if i % 3 == 0 { 0 } else { u32::MAX - (i & 1) }),
    },
    Case {
        name: "sorting/reversed",
        what: "keys in descending order",
        bound: "0: the stable order",
        check: |ctx, c| sorted(ctx, c, |i| u32::MAX - i * 7919),
    },
    Case {
        name: "sorting/keys",
        what: "the keys of depths: both signs, both zeros, subnormal, infinite",
        bound: "0: the reference's keys, in the order of the depths",
        check: keys,
    },
];

type Entry = [u32; 2];

fn sorted(ctx: &mut StressContext, c: &mut Comparison, key: impl Fn(u32) -> u32) -> Result<()> {
    for n in [0u32, 1, 33, 1023, 1024, 1025, 20_000] {
        let sort = Sort::new(ctx.device(), ctx.compiler(), n)?;
        let entries: Vec<Entry> = (0..n).map(|i| [key(i), i]).collect();
        for (n_bits, mask) in [(16, 0xffff), (32, u32::MAX)] {
            let buffer = ctx.upload(&entries)?;
            ctx.run(|rec| sort.record(rec, &buffer, n_bits, Count::Known(n)).map(|_| ()))?;
            let found: Vec<Entry> = ctx.download(&buffer, n as usize)?;
            let keys: Vec<u32> = entries.iter().map(|[key, _]| key & mask).collect();
            let expected: Vec<Entry> =
                order(&keys).into_iter().map(|i| entries[i as usize]).collect();
            c.same(&found, &expected, format_args!("{n} entries by {n_bits} bits"));
        }
    }
    Ok(())
}

fn keys(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const RADIUS: f64 = 3.0;
    let special = [0.0, -0.0, 1e-42, -1e-42, f32::MIN_POSITIVE, f32::MAX, f32::MIN];
    let mut depths: Vec<f32> = special
        .into_iter()
        .chain([f32::INFINITY, f32::NEG_INFINITY])
        .chain((-300..300).map(|i| i as f32 * 0.01))
        .collect();
    depths.sort_by(|a, b| b.total_cmp(a));
    let inputs = depths
        .into_iter()
        .map(|z| [z, RADIUS as f32, (65536.0 / (2.0 * RADIUS)) as f32, 0.0])
        .collect();
    // The upper 23 and the lower 9 bits of the key as mantissas of numbers from 1 to 2. The key's
    // own bits may form a NaN, whose bits may change.
    let body = "uint key = key_of(x.x, 32u, x.y, x.z); \
        return vec4(uintBitsToFloat(0x3f800000u | key >> 9), \
        uintBitsToFloat(0x3f800000u | key & 0x1ffu), float(key_of(x.x, 16u, x.y, x.z)), 0.0);";
    let mut last = 0;
    for ([z, ..], y) in ctx.probe("key.glsl", &[], body, inputs)? {
        let key = y[0].to_bits() << 9 | (y[1].to_bits() & 0x1ff);
        c.exact(key, key32(z), format_args!("key of depth {z:e}"));
        c.holds(key >= last, format_args!("key of depth {z:e} in order"));
        last = key;
        // At the boundary of two 16-bit keys rounding decides.
        let [low, high] = [1e-6, -1e-6].map(|d| f64::from(key16(f64::from(z) + d, RADIUS)));
        let is_key = (low..=high).contains(&f64::from(y[2]));
        c.holds(is_key, format_args!("16-bit key of depth {z:e}: {}", y[2]));
    }
    Ok(())
}
