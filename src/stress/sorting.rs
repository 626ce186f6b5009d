//! Orders: keys of every kind, in numbers that fill tiles and do not, and depths of either sign.

use super::case::{Case, Comparison, Found};
use super::desk::Desk;
use crate::error::Result;
use crate::model::philox::philox4x32_10;
use crate::passes::sort::Sort;
use crate::reference::sort::{key16, key32, order};

pub const CASES: &[Case] = &[
    Case {
        name: "sorting/random",
        what: "random keys, 0 to 20 000 of them, about whole tiles and not",
        bound: "0: the stable order",
        run: |desk| sorted(desk, |i| philox4x32_10([7, 0], [i, 0, 0, 0])[0]),
    },
    Case {
        name: "sorting/equal",
        what: "equal keys: the order they came in",
        bound: "0: the stable order",
        run: |desk| sorted(desk, |_| 0x1234_5678),
    },
    Case {
        name: "sorting/few",
        what: "keys of two digits, one of them 0 and one the greatest",
        bound: "0: the stable order",
        run: |desk| sorted(desk, |i| if i % 3 == 0 { 0 } else { u32::MAX - (i & 1) }),
    },
    Case {
        name: "sorting/reversed",
        what: "keys from the greatest down",
        bound: "0: the stable order",
        run: |desk| sorted(desk, |i| u32::MAX - i * 7919),
    },
    Case {
        name: "sorting/keys",
        what: "keys of depths: either sign, both zeros, subnormal, infinite",
        bound: "0: the very keys, and their order the depths'",
        run: keys,
    },
];

type Entry = [u32; 2];

fn sorted(desk: &mut Desk, key: impl Fn(u32) -> u32) -> Result<Found> {
    let mut c = Comparison::default();
    for n in [0u32, 1, 33, 1023, 1024, 1025, 20_000] {
        let sort = Sort::new(desk.device(), desk.compiler(), n)?;
        let keys: Vec<u32> = (0..n).map(&key).collect();
        for n_bits in [16, 32] {
            let entries: Vec<Entry> = keys.iter().zip(0..).map(|(key, i)| [*key, i]).collect();
            let buffer = desk.upload(&entries)?;
            desk.run(|rec| sort.record(rec, &buffer, n, n_bits))?;
            let found: Vec<Entry> = desk.download(&buffer, n as usize)?;
            let low: Vec<u32> =
                keys.iter().map(|k| if n_bits < 32 { k & 0xffff } else { *k }).collect();
            let expected: Vec<Entry> =
                order(&low).into_iter().map(|i| [keys[i as usize], i]).collect();
            c.same(&found, &expected, &format!("{n} entries by {n_bits} bits"));
        }
    }
    Ok(c.into())
}

fn keys(desk: &mut Desk) -> Result<Found> {
    const RADIUS: f64 = 3.0;
    let mut depths: Vec<f32> = vec![
        0.0,
        -0.0,
        1e-42,
        -1e-42,
        f32::MIN_POSITIVE,
        f32::MAX,
        f32::MIN,
        f32::INFINITY,
        f32::NEG_INFINITY,
    ];
    depths.extend((-300..300).map(|i| i as f32 * 0.01));
    depths.sort_by(|a, b| b.total_cmp(a));
    let inputs: Vec<[f32; 4]> = depths
        .iter()
        .map(|z| [*z, RADIUS as f32, (65536.0 / (2.0 * RADIUS)) as f32, 0.0])
        .collect();
    let body = "return vec4(uintBitsToFloat(0x3f800000u | key_of(x.x, 32u, x.y, x.z) >> 9), \
        uintBitsToFloat(0x3f800000u | \
        key_of(x.x, 32u, x.y, x.z) & 0x1ffu), float(key_of(x.x, 16u, x.y, x.z)), 0.0);";
    let found = desk.probe(&["key.glsl"], body, &inputs)?;
    let mut c = Comparison::default();
    let mut last = 0;
    for (z, y) in depths.iter().zip(found) {
        // 23 and 9 bits of the key as floats' last ones: a word that is no number would not come
        // through.
        let key = y[0].to_bits() << 9 | (y[1].to_bits() & 0x1ff);
        c.add(f64::from(key), f64::from(key32(*z)), 0.0, || format!("key of depth {z:e}"));
        c.holds(key >= last, || format!("the order of depth {z:e}"));
        last = key;
        // Where the step is on the brink rounding decides.
        let (low, high) =
            (key16(f64::from(*z) + 1e-6, RADIUS), key16(f64::from(*z) - 1e-6, RADIUS));
        c.holds((f64::from(low)..=f64::from(high)).contains(&f64::from(y[2])), || {
            format!("16 bits of depth {z:e}: {}", y[2])
        });
    }
    Ok(c.into())
}
