//! texture: the whole pool against the f64 reference, which sums waves term by term; its levels,
//! mean squares, seeds.

use crate::harness::{Gpu, assert_within_and_say, check_within};
use nimbus::gpu::Compiler;
use nimbus::passes::SHADERS;
use nimbus::passes::texture::{FIELD_TEXELS, N_FIELDS, POOL_TEXELS, Texture};
use nimbus::reference::texture::{
    Level, N_LEVELS, Pool, QUANTUM, SplatTexture, Textured, amplitude, mean_squares, side,
    sum_of_amplitudes,
};

/// Unit round-off of f32.
const U: f64 = 1.0 / 16_777_216.0;

/// Of a wave: exp2(−0.85 log2 |k|²): 3 ulp of at most 12, times 0.85 ln 2, are 43 u, their
/// product's rounding 8 u, exp2's 3 + 2·10.2 ulp 47 u; a constant's rounding and the product 3 u.
/// Its phase: 10 u each for sine and cosine are 15 u, the sum of two fields' u.
const WAVE_ERROR: f64 = (43.0 + 8.0 + 47.0 + 3.0 + 15.0 + 1.0) * U;

/// Of one of the 16 stages: the root's 15 u, the difference's u, and √2 γ₂ of a complex product
/// (Higham, §3.6).
const STAGE_ERROR: f64 = (15.0 + 1.0 + 2.9) * U;
const N_STAGES: f64 = 16.0;

/// Every output is a sum of all waves by factors of modulus 1, so each wave's error reaches it
/// once, stage by stage; two fields are in one transform, and 1 % is left for products of errors.
fn greatest_error() -> f64 {
    1.01 * (WAVE_ERROR + N_STAGES * STAGE_ERROR) * 2.0 * sum_of_amplitudes()
}

/// The root mean square over a field: a stage's errors are relative to the norm, which for two
/// fields is √2.
fn mean_error() -> f64 {
    1.01 * (WAVE_ERROR + N_STAGES * STAGE_ERROR) * std::f64::consts::SQRT_2
}

fn drawn(gpu: &mut Gpu, compiler: Option<&Compiler>, seed: u32) -> Vec<[u32; 4]> {
    let pass = Texture::new(&gpu.device, compiler.unwrap_or(&gpu.compiler)).expect("texture");
    let pool = gpu.buffer::<[u32; 4]>(POOL_TEXELS as usize);
    gpu.run(|rec| pass.record(rec, &pool, seed));
    gpu.download(&pool, POOL_TEXELS as usize)
}

/// Its eight numbers of every texel.
fn numbers(words: &[[u32; 4]]) -> Vec<f64> {
    let halves = |w: &u32| [(*w & 0xFFFF) as u16 as i16, (*w >> 16) as u16 as i16];
    words.iter().flatten().flat_map(halves).map(|q| f64::from(q) * QUANTUM).collect()
}

/// The same of the reference, not rounded.
fn truths(pool: &Pool) -> Vec<f64> {
    let texel = |level: &Level, i: usize, j: usize| -> [f64; 8] {
        let at = |n: &[f64], k: usize| {
            n[(i + k % 2) % level.side + level.side * ((j + k / 2) % level.side)]
        };
        std::array::from_fn(|k| if k < 4 { at(&level.own, k) } else { at(&level.above, k - 4) })
    };
    let of_level = |level: &Level| -> Vec<f64> {
        (0..level.side.pow(2))
            .flat_map(|at| texel(level, at % level.side, at / level.side))
            .collect()
    };
    pool.0.iter().flatten().flat_map(of_level).collect()
}

#[test]
fn the_pool_is_the_sum_of_its_waves() {
    let mut gpu = Gpu::new();
    for seed in [1, 0xDEAD_BEEF] {
        let pool = Pool::new(seed);
        let (values, truths) = (numbers(&drawn(&mut gpu, None, seed)), truths(&pool));
        assert_eq!(values.len(), 8 * POOL_TEXELS as usize);
        let bounds = vec![greatest_error() + 0.5 * QUANTUM; values.len()];
        println!("seed {seed}: bound {:e}, of the mean {:e}", bounds[0], mean_error());
        assert_within_and_say("the pool", &values, &truths, &bounds);
        assert!(mean_of_errors_is_within(&values, &truths));
        let most = truths.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        assert!(most > 3.0 && most < 7.0, "{most}: far from what 16 bits hold");
    }
}

/// By field the root mean square of what n_0 errs, over all of its texels; the rounding to quanta
/// is in it with 1/√12.
fn mean_of_errors_is_within(values: &[f64], truths: &[f64]) -> bool {
    let n = 8 * FIELD_TEXELS as usize;
    let own =
        |v: &[f64]| -> Vec<f64> { v[..8 * side(0).pow(2)].iter().step_by(8).copied().collect() };
    values.chunks(n).zip(truths.chunks(n)).all(|(v, t)| {
        let (v, t) = (own(v), own(t));
        let sum: f64 = v.iter().zip(&t).map(|(v, t)| (v - t).powi(2)).sum();
        // Of 65 536 roundings the mean square is within 2 % of a twelfth, by five of its
        // deviations.
        (sum / v.len() as f64).sqrt() <= mean_error() + 1.02 * QUANTUM / 12f64.sqrt()
    })
}

#[test]
fn wrong_pools_are_noticed() {
    let mut gpu = Gpu::new();
    let truths = truths(&Pool::new(7));
    let bounds = vec![greatest_error() + 0.5 * QUANTUM; truths.len()];
    for (file, from, to) in [
        ("texture_transform.comp", "HALF_SLOPE = 0.85", "HALF_SLOPE = 0.852"),
        ("texture_transform.comp", "0.6982250102949674", "0.6990250102949674"),
        ("texture_transform.comp", "square < 4", "square < 5"),
        ("texture_transform.comp", "square > most * most", "square >= most * most"),
        ("texture_transform.comp", "drawn ? 1.0 : -1.0", "1.0"),
        ("texture_transform.comp", "vec2(-odd.y, odd.x)", "vec2(odd.y, odd.x)"),
        (
            "texture_transform.comp",
            "uvec4(of, pair, TEXTURE_STREAM)",
            "uvec4(of, 0u, TEXTURE_STREAM)",
        ),
        ("texture_transform.comp", "times(roots[jm], p - q)", "times(roots[jm], q - p)"),
        ("texture_transform.comp", "a.x * b.y + a.y * b.x", "a.x * b.y - a.y * b.x"),
        (
            "texture_pack.comp",
            "at + uvec2(0, 1)), field_at(part, level, at + uvec2(1, 1))",
            "at), field_at(part, level, at)",
        ),
        ("texture_pack.comp", "(at.x & 1u) + 1u", "(at.x & 1u)"),
        ("texture_pack.comp", "(i_field & 1u)", "0u"),
    ] {
        let compiler = Gpu::wrong_compiler(file, from, to);
        let values = numbers(&drawn(&mut gpu, Some(&compiler), 7));
        let noticed = check_within("a wrong pool", &values, &truths, &bounds).is_err();
        assert!(noticed || !mean_of_errors_is_within(&values, &truths), "{from} as {to}");
    }
}

#[test]
fn a_seed_gives_the_same_bytes_and_another_gives_others() {
    let mut gpu = Gpu::new();
    let [a, b, c] = [3, 3, 4].map(|seed| drawn(&mut gpu, None, seed));
    assert!(a == b);
    let same = a.iter().zip(&c).filter(|(a, c)| a[0] == c[0]).count();
    // The four corners are of 16 bits, most of them in some 2¹⁴ values.
    assert!(same < a.len() / 100, "{same}");
    // No two fields are alike: their mean product over level 0 is that of independent waves, below
    // √(8 Σ|F|⁴).
    let fields: Vec<Vec<f64>> = a.chunks(FIELD_TEXELS as usize).map(numbers).collect();
    for i in 0..N_FIELDS as usize {
        for j in 0..i {
            let product: f64 =
                (0..side(0).pow(2)).map(|k| fields[i][8 * k] * fields[j][8 * k]).sum::<f64>()
                    / side(0).pow(2) as f64;
            assert!(product.abs() < 0.6, "{i} {j}: {product}");
        }
    }
}

/// The mean square of every field is 1, that of every level what is left of its waves, whatever the
/// seed.
#[test]
fn mean_squares_are_those_of_the_waves() {
    let pool = Pool::new(11);
    for field in &pool.0 {
        for (l, level) in field.iter().enumerate() {
            let mean = |f: &dyn Fn(usize) -> f64| {
                (0..level.own.len()).map(f).sum::<f64>() / level.own.len() as f64
            };
            assert!(mean(&|k| level.own[k]).abs() < 1e-12, "no wave of |k| = 0");
            if l == 0 {
                assert!((mean(&|k| level.own[k].powi(2)) - 1.0).abs() < 1e-11);
            }
            // Over all places and not the nodes alone: over a cell ⟨ab⟩ is that of a bilinear
            // function, by Simpson's rule.
            let between = |n: &[f64], m: &[f64]| {
                let cell = |i: usize, j: usize| {
                    let at = |n: &[f64], x: usize, y: usize| {
                        let of = |x: usize, y: usize| {
                            n[(i + x) % level.side + level.side * ((j + y) % level.side)]
                        };
                        0.25 * (of(x / 2, y / 2)
                            + of(x.div_ceil(2), y / 2)
                            + of(x / 2, y.div_ceil(2))
                            + of(x.div_ceil(2), y.div_ceil(2)))
                    };
                    let weight = [1.0, 4.0, 1.0];
                    let terms = (0..9).map(|k| {
                        weight[k % 3] * weight[k / 3] * at(n, k % 3, k / 3) * at(m, k % 3, k / 3)
                    });
                    terms.sum::<f64>() / 36.0
                };
                mean(&|k| cell(k % level.side, k / level.side))
            };
            let found = [
                between(&level.own, &level.own),
                between(&level.own, &level.above),
                between(&level.above, &level.above),
            ];
            for (found, closed) in found.iter().zip(mean_squares(l)) {
                // Waves whose images meet on the coarser grid add terms of either sign that the
                // closed form, a mean over phases, has not; there are few.
                assert!((found - closed).abs() < 0.03, "level {l}: {found} {closed}");
            }
        }
    }
    for l in 1..N_LEVELS {
        assert!((mean_squares(l - 1)[2] - mean_squares(l)[0]).abs() < 1e-14, "levels meet");
    }
}

/// The shaders' numbers are the reference's.
#[test]
fn constants_are_those_of_the_law() {
    let text = |name: &str| SHADERS.iter().find(|(n, _)| *n == name).expect("a shader").1;
    // Without white space, which formatters move.
    let law: String = text("include/texture.glsl").split_whitespace().collect();
    let rows = law.split("vec3[](").nth(1).expect("a table").split("));").next().expect("an end");
    let found: Vec<f64> = rows
        .replace("vec3(", "")
        .replace(')', "")
        .split(',')
        .map(|n| n.trim().parse().expect("a number"))
        .collect();
    let expected: Vec<f64> = (0..N_LEVELS).flat_map(mean_squares).collect();
    assert!(
        found.len() == expected.len()
            && found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-14)
    );
    let line = text("texture_transform.comp")
        .lines()
        .find_map(|l| l.strip_prefix("const float AMPLITUDE = "));
    let found: f64 =
        line.and_then(|l| l.strip_suffix(';')).expect("a constant").parse().expect("a number");
    assert!((found - amplitude()).abs() < 1e-15);
}

/// Over fields, places and turns the factor's mean is 1: what a texture takes from one place it
/// gives to another.
#[test]
fn the_factors_mean_is_one() {
    let pools: Vec<Pool> = (0..12).map(Pool::new).collect();
    for (dense, strength) in
        [(1.0, 1.0), (1.5, 1.0), (3.0, 0.5), (6.0, 1.0), (12.0, 1.0), (24.0, 1.0), (50.0, 1.0)]
    {
        let mut means = vec![];
        for pool in &pools {
            for i_field in 0..N_FIELDS {
                let of = Textured { i_field, strength, seed: 5, i_box: 2 };
                let n_places = 4000;
                let factor = |i: u32| {
                    let sheet = SplatTexture::new(&of, i, 6.0, dense / 256.0);
                    sheet.factor(pool, glam::DVec2::ZERO)
                };
                means.push((0..n_places).map(factor).sum::<f64>() / f64::from(n_places));
            }
        }
        let n = means.len() as f64;
        let mean = means.iter().sum::<f64>() / n;
        let deviation = (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        println!(
            "{dense} texels a pixel, s = {strength}: mean {mean:.4} ± {:.4}, a field's \
             {deviation:.4}",
            deviation / n.sqrt()
        );
        // Four standard errors; and what waves of fixed height are from a Gaussian: below, by their
        // fourth cumulant −⅜ Σ|2F|⁴/24, and bilinear interpolation's spread of ⟨n²⟩ between nodes,
        // above.
        assert!((mean - 1.0).abs() < 4.0 * deviation / n.sqrt() + 0.01, "{mean}");
    }
}
