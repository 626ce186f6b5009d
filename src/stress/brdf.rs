//! Materials and their lobe bases: opposite directions, grazing light, exponents from 0 to 10^6,
//! black and overly bright materials, bases of equal lobes.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::case::{Case, Comparison};
use super::context::StressContext;
use super::functions::{half_vector_gap, largest_bend, largest_step, lobe_table};
use super::scenes::{rectangle, surface_scene};
use crate::error::Result;
use crate::model::basis::{Basis, N_NODES, Sampling, evaluate, node};
use crate::model::material::Brdf;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::brdf::reflectance;
use crate::reference::rounding::U_F32;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "brdf/opposite",
        what: "light and eye in exactly opposite directions, without a half vector: half of the \
            normal's square",
        bound: "0",
        check: |ctx, c| {
            let directions = (0..20_000).map(|i| {
                let [x, z] = direction(f64::from(i) * 3.1e-4);
                [x, z, -x, -z]
            });
            gaps(ctx, directions, |x, y| c.exact(y[0], 0.5, format_args!("gap of {x:?}")))
        },
    },
    Case {
        name: "brdf/grazing",
        what: "half vectors of directions within 1e-3 to 1e-7 of the horizon on either side",
        bound: "|chord| 15.6 u and its square",
        check: |ctx, c| {
            let directions = (0..40_000).map(|i| {
                let off = 1e-7 * 1e4f64.powf(f64::from(i / 4) / 10_000.0);
                let a = if i % 2 == 0 { FRAC_PI_2 - off } else { FRAC_PI_2 + off };
                let b = if i / 2 % 2 == 0 { 0.3 } else { FRAC_PI_2 - 2.0 * off };
                let ([ax, az], [bx, bz]) = (direction(a), direction(b));
                [ax, az, bx, bz]
            });
            gaps(ctx, directions, |x, y| {
                let (truth, bound) = half_vector_gap(x);
                c.add(y[0], truth, bound, format_args!("gap of {x:?}"));
            })
        },
    },
    Case {
        name: "brdf/reciprocity",
        what: "the half vector's gap with light and eye exchanged",
        bound: "0",
        check: |ctx, c| {
            let directions = (0..40_000).map(|i| {
                let [ax, az] = direction(f64::from(i) * 7.7e-5);
                let [bx, bz] = direction(f64::from(i % 997) * -1.5e-3);
                [ax, az, bx, bz]
            });
            gaps(ctx, directions, |x, y| c.exact(y[0], y[1], format_args!("gap of {x:?}")))
        },
    },
    Case {
        name: "brdf/black",
        what: "a material that reflects nothing: L1 = L2 = 0",
        bound: "0",
        check: black,
    },
    Case {
        name: "brdf/too-bright",
        what: "K_d + 4 K_s = 5: the formula's value, without a clamp",
        bound: "as for every material",
        check: |ctx, c| first(ctx, c, [1.0, 1.0, 20.0]),
    },
    Case {
        name: "brdf/exponent-0",
        what: "L1 of a lobe of n = 0, 200 directions of light and eye",
        bound: "the basis's own error, h^2/8 max |f''| of the table, rounding",
        check: |ctx, c| first(ctx, c, [0.3, 0.2, 0.0]),
    },
    Case {
        name: "brdf/exponent-40",
        what: "L1 of a lobe of n = 40",
        bound: "the basis's own error, h^2/8 max |f''| of the table, rounding",
        check: |ctx, c| first(ctx, c, [0.3, 0.2, 40.0]),
    },
    Case {
        name: "brdf/exponent-1e4",
        what: "L1 of a lobe of n = 10^4",
        bound: "the basis's own error, h^2/8 max |f''| of the table, rounding",
        check: |ctx, c| first(ctx, c, [0.3, 0.2, 1e4]),
    },
    Case {
        name: "brdf/exponent-1e6",
        what: "the lobe of n = 10^6 at the table's nodes, against repeated squaring",
        bound: "n u of the argument of exp, relative",
        check: huge_exponent,
    },
    Case {
        name: "brdf/one-exponent",
        what: "32 bases of a single exponent: one vector, and the exact lobe",
        bound: "1e-12, relative",
        check: |_, c| {
            for ns in [0.0, 1.0, 50.0, 1e4] {
                let basis = Basis::new([ns, ns], 32, Sampling::Log);
                c.exact(basis.n_bases(), 2.0, format_args!("bases of n = {ns}"));
                c.add(basis.error(ns), 0.0, 1e-12, format_args!("error of n = {ns}"));
            }
            Ok(())
        },
    },
    Case {
        name: "brdf/more-than-samples",
        what: "more bases than sampled lobes: as many as are independent, finite and orthonormal",
        bound: "1e-12",
        check: more_than_samples,
    },
    Case {
        name: "brdf/negative",
        what: "L1 of three bases for exponents from 1 to 1000, whose lobe of n = 300 is partly \
            negative: it stays negative",
        bound: "h^2/8 max |f''| of the table, rounding",
        check: negative,
    },
    Case {
        name: "brdf/albedo",
        what: "the lobe's albedo by quadrature for n from 0 to 100: its closed form for vertical \
            light, at most 4 otherwise",
        bound: "1e-3 of 360 000 midpoints",
        check: albedo,
    },
];

/// Returns the unit vector (x, z) at an angle from the z axis.
fn direction(angle: f64) -> [f32; 2] {
    [angle.sin() as f32, angle.cos() as f32]
}

/// Evaluates the half vector's gap of model.md §6 for pairs of directions (ax, az,
/// bx, bz) about the normal z, and with the directions exchanged.
fn gaps(
    ctx: &mut StressContext,
    directions: impl Iterator<Item = [f32; 4]>,
    mut check: impl FnMut([f32; 4], [f32; 4]),
) -> Result<()> {
    let body = "vec3 a = vec3(x.x, 0.0, x.y), b = vec3(x.z, 0.0, x.w), n = vec3(0.0, 0.0, 1.0); \
        return vec4(half_vector_gap(n, a, b), half_vector_gap(n, b, a), lobe_at(0u, 0.0), 0.0);";
    let found = ctx.probe("lobe.glsl", &[0.0; 2], body, directions.collect())?;
    found.for_each(|(x, y)| check(x, y));
    Ok(())
}

/// Returns a floor of 14 × 14 facets under a near lamp, so that every facet has its own half
/// vector.
fn floor([kd, ks, ns]: [f64; 3]) -> Result<Scene> {
    let material =
        format!("kd = [{kd:?}, {kd:?}, {kd:?}]\nks = [{ks:?}, {ks:?}, {ks:?}]\nns = {ns:?}\n");
    let lamp = "[[light]]\nkind = 'point'\nposition = [0.2, 1.5, -2.0]\nintensity = [4, 4, 4]\n\
        radius = 0.01\n";
    let floor = rectangle([0.0; 3], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0], 14);
    surface_scene("gather = 'exact'\nbases = 16", lamp, &material, [floor])
}

fn black(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let mut scene = floor([0.0, 0.0, 1.0])?;
    scene.surfaces.push(rectangle([0.0, 1.0, -2.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 5));
    for (i, lit) in ctx.render(&scene, 0)?.lit.iter().enumerate() {
        for v in lit.first.iter().chain(&lit.second).chain(&lit.indirect) {
            c.exact(*v, 0.0, format_args!("light of facet {i}"));
        }
        c.finite(&lit.direct[..1], format_args!("irradiance of facet {i}"));
    }
    Ok(())
}

/// Compares L1 of a floor with the formula.
fn first(ctx: &mut StressContext, c: &mut Comparison, material: [f64; 3]) -> Result<()> {
    let mut scene = floor(material)?;
    scene.lighting.mode = LightingMode::First;
    first_with(ctx, c, &scene, material, &lobe_table(material[2]))
}

/// Compares L1 of a scene's floor with that of the lobe whose values at the nodes are `lobe`.
fn first_with(
    ctx: &mut StressContext,
    c: &mut Comparison,
    scene: &Scene,
    [kd, ks, ns]: [f64; 3],
    lobe: &[f64],
) -> Result<()> {
    let frame = ctx.render(scene, 0)?;
    let table = device_lobe(scene, ns);
    let is_exact = lobe == lobe_table(ns);
    let (surface, light) = (&scene.surfaces[0], &scene.lights[0]);
    let eye = scene.camera.keys[0].position;
    for (i, lit) in (0u32..).zip(&frame.lit) {
        let (p, n) = (surface.facet_center(i), surface.normal());
        let (arrival, toward) = (light.arrival(p), (eye - p).normalize());
        let irradiance = light.energy().x * light.share(n, &arrival, 1.0);
        let h = (arrival.toward + toward).normalize();
        let w = 0.5 * (n - h).length_squared();
        let of_lobe = if is_exact { Brdf::lobe(ns, w) } else { evaluate(lobe, w) };
        let truth = irradiance * (kd * FRAC_1_PI + ks * of_lobe);
        // At the half vector's place in the table: the entries' error, the lobe's second
        // difference, and the rounding of the place.
        let t = w.sqrt().sqrt() * (N_NODES - 1) as f64;
        let here = (t as usize).saturating_sub(1)..((t as usize) + 3).min(N_NODES);
        let entry = here.clone().map(|k| (table[k] - lobe[k]).abs()).fold(0.0, f64::max);
        let bend = largest_bend(&lobe[here.clone()]);
        // The gap is off by 15.6 u |chord|, and by as much again by the directions' own 9 u. In
        // total 31 u |chord|, which moves t by 16 u/|chord| of itself. Its roots add 16 u.
        let chord = (n - h).length();
        let off = (16.0 + 16.0 / chord.max(1e-3)) * U_F32 * t.max(1.0);
        let rounding = 8.0 * U_F32 * table.iter().map(|v| v.abs()).fold(0.0, f64::max);
        let of_lobe = entry + 1.5 * bend / 8.0 + off * largest_step(&table[here]) + rounding;
        let bound = irradiance * ks * of_lobe + 32.0 * U_F32 * truth.abs();
        c.add(lit.first[0], truth, bound, format_args!("L1 of facet {i}"));
    }
    Ok(())
}

/// Returns the lobe of exponent `ns` as the scene's basis approximates it.
fn device_lobe(scene: &Scene, ns: f64) -> Vec<f64> {
    let lighting = &scene.lighting;
    Basis::new(lighting.exponents, lighting.bases, lighting.sampling).lobe(ns)
}

fn huge_exponent(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const N: u32 = 1_000_000;
    for i in 0..N_NODES {
        let w = node(i);
        // cos^n by repeated squaring.
        let (mut power, mut base, mut n) = (1.0, 1.0 - w, N);
        while n > 0 {
            power *= if n & 1 == 1 { base } else { 1.0 };
            base *= base;
            n >>= 1;
        }
        let n = f64::from(N);
        let truth = (n + 2.0) / TAU * power;
        // 1 - w is rounded once and raised to n; every product rounds and is squared in turn.
        let bound = 4.0 * n * 2f64.powi(-53) * truth + f64::MIN_POSITIVE;
        c.add(Brdf::lobe(n, w), truth, bound, format_args!("lobe at node {i}"));
    }
    Ok(())
}

fn more_than_samples(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for range in [[1.0, 1.0 + 1e-9], [49.0, 51.0], [0.0, 1000.0]] {
        let basis = Basis::new(range, 4096, Sampling::Log);
        let n = basis.n_bases();
        c.holds((2..4096).contains(&n), format_args!("2 to 4095 bases of {range:?}: {n}"));
        for (i, v) in basis.vectors().iter().enumerate() {
            for (j, w) in basis.vectors().iter().enumerate() {
                let at = format_args!("product of vectors {i} and {j} of {range:?}");
                c.add(basis.product(v, w), u8::from(i == j), 1e-12, at);
            }
        }
        let n_odd = basis.vectors().iter().flatten().filter(|v| !v.is_finite()).count();
        c.exact(n_odd as f64, 0.0, format_args!("non-finite values of vectors of {range:?}"));
        for ns in basis.spread(9) {
            // With every independent vector only the sampling's error is left.
            let error = basis.error(ns);
            c.holds(error < 1e-3, format_args!("error of n = {ns} below 1e-3: {error:e}"));
        }
    }
    Ok(())
}

fn negative(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let material = [0.0, 0.2, 300.0];
    let mut scene = floor(material)?;
    scene.lighting.mode = LightingMode::First;
    (scene.lighting.exponents, scene.lighting.bases) = ([1.0, 1000.0], 3);
    let table = device_lobe(&scene, material[2]);
    first_with(ctx, c, &scene, material, &table)?;
    let n_negative = table.iter().filter(|v| **v < 0.0).count();
    c.holds(n_negative > 0, "the lobe is negative somewhere");
    c.remark(format!("{n_negative} of {N_NODES} nodes below 0"));
    Ok(())
}

fn albedo(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const N: u32 = 600;
    for ns in [0.0, 1.0, 10.0, 100.0] {
        let brdf = Brdf { kd: DVec3::ZERO, ks: DVec3::ONE, ns };
        for theta in [0.0, 0.5, 1.0, 1.4f64] {
            let from = DVec3::new(theta.sin(), 0.0, theta.cos());
            // Midpoints over cos² and the azimuth: dω cos = d(cos²)/2 dφ.
            let midpoint = |i: u32| (f64::from(i) + 0.5) / f64::from(N);
            let sum: f64 = (0..N * N)
                .map(|k| {
                    let (s, phi) = (midpoint(k / N), midpoint(k % N) * TAU);
                    let (cos, sin) = (s.sqrt(), (1.0 - s).sqrt());
                    let to = DVec3::new(sin * phi.cos(), sin * phi.sin(), cos);
                    reflectance(&brdf, DVec3::Z, from, to).x
                })
                .sum();
            let albedo = sum * PI / f64::from(N * N);
            let beyond = (albedo - 4.0).max(0.0);
            c.add(beyond, 0.0, 4e-3, format_args!("albedo of n = {ns} at {theta} above 4"));
            if theta == 0.0 {
                // With x = cos γ, cos = 2 x² - 1 and dω = 8 π x dx from 1/√2 to 1.
                let part = |k: f64| (1.0 - 2f64.powf(-0.5 * k)) / k;
                let truth = 4.0 * (ns + 2.0) * (2.0 * part(ns + 4.0) - part(ns + 2.0));
                let at = format_args!("albedo of n = {ns} for vertical light");
                c.add(albedo, truth, 1e-3 * truth, at);
            }
        }
    }
    Ok(())
}
