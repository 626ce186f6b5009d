//! Materials and their basis: opposite ways, grazing light, exponents from 0 to a million, no
//! reflection and too much, bases of lobes that do not differ.

use glam::DVec3;

use super::case::{Case, Comparison, Found};
use super::desk::Desk;
use super::scenes::{plate, room};
use crate::error::Result;
use crate::model::basis::{Basis, N_NODES, Sampling, evaluate, node};
use crate::model::material::Brdf;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::area::reflectance;
use crate::reference::rounding::U_F32;

pub const CASES: &[Case] = &[
    Case {
        name: "brdf/opposite",
        what: "light from where it is looked to, so that there is no half vector: half of the \
            normal's square",
        bound: "0",
        run: opposite,
    },
    Case {
        name: "brdf/grazing",
        what: "half vectors of ways within 1e-3 to 1e-7 of the horizon on either side",
        bound: "|chord| 15.6 u and its square",
        run: grazing,
    },
    Case {
        name: "brdf/reciprocity",
        what: "the half vector's gap with light and eye in each other's places",
        bound: "0",
        run: reciprocity,
    },
    Case {
        name: "brdf/black",
        what: "a material that reflects nothing: L1 and L2 of 0",
        bound: "0",
        run: black,
    },
    Case {
        name: "brdf/too-bright",
        what: "K_d + 4 K_s of 5: what the formula says, and nothing is cut",
        bound: "what is allowed of any material",
        run: |desk| first(desk, [1.0, 1.0, 20.0]),
    },
    Case {
        name: "brdf/exponent-0",
        what: "L1 of a lobe of n = 0, 200 ways of light and eye",
        bound: "the basis's own error, h^2/8 max |f''| of the table, rounding",
        run: |desk| first(desk, [0.3, 0.2, 0.0]),
    },
    Case {
        name: "brdf/exponent-40",
        what: "L1 of a lobe of n = 40",
        bound: "the basis's own error, h^2/8 max |f''| of the table, rounding",
        run: |desk| first(desk, [0.3, 0.2, 40.0]),
    },
    Case {
        name: "brdf/exponent-1e4",
        what: "L1 of a lobe of n = 10^4",
        bound: "the basis's own error, h^2/8 max |f''| of the table, rounding",
        run: |desk| first(desk, [0.3, 0.2, 1e4]),
    },
    Case {
        name: "brdf/exponent-1e6",
        what: "the lobe of n = 10^6 at its nodes, and 0 beyond: no power of a number near 1",
        bound: "n u of the argument of exp, relative",
        run: huge_exponent,
    },
    Case {
        name: "brdf/one-exponent",
        what: "32 bases of a single exponent: one vector, and the lobe as it is",
        bound: "1e-12, relative",
        run: one_exponent,
    },
    Case {
        name: "brdf/more-than-samples",
        what: "more bases than sampled lobes: as many as differ, orthonormal, nothing odd",
        bound: "1e-12",
        run: more_than_samples,
    },
    Case {
        name: "brdf/negative",
        what: "L1 of three bases for exponents from 1 to 1000, whose lobe of n = 300 is negative \
            in places: negative it comes out",
        bound: "h^2/8 max |f''| of the table, rounding",
        run: negative,
    },
    Case {
        name: "brdf/albedo",
        what: "the lobe's albedo by quadrature over the hemisphere, n from 0 to 100: its closed \
            form from above, at most 4 elsewhere",
        bound: "1e-3 of 360 000 midpoints",
        run: albedo,
    },
];

/// The gap of docs/model.md §6 of unit ways a and b, in the plane of the normal z: both as angles
/// from it.
const GAP: &str = "vec3 a = vec3(x.x, 0.0, x.y), b = vec3(x.z, 0.0, x.w), n = vec3(0.0, 0.0, 1.0); \
    return vec4(half_vector_gap(n, a, b), half_vector_gap(n, b, a), lobe_at(0u, 0.0), 0.0);";

fn gaps(desk: &mut Desk, inputs: &[[f32; 4]]) -> Result<Vec<[f32; 4]>> {
    desk.probe_beside(&[("table", &[0.0; 2])], &["lobe.glsl"], GAP, inputs)
}

fn way(angle: f64) -> [f32; 2] {
    [angle.sin() as f32, angle.cos() as f32]
}

fn opposite(desk: &mut Desk) -> Result<Found> {
    let inputs: Vec<[f32; 4]> = (0..20_000)
        .map(|i| {
            let [x, z] = way(f64::from(i) * 3.1e-4);
            [x, z, -x, -z]
        })
        .collect();
    let mut c = Comparison::default();
    for (x, y) in inputs.iter().zip(gaps(desk, &inputs)?) {
        // The half vector is 0 to the bit, and the chord to it the normal.
        c.add(f64::from(y[0]), 0.5, 0.0, || format!("gap of {x:?}"));
    }
    Ok(c.into())
}

fn grazing(desk: &mut Desk) -> Result<Found> {
    use std::f64::consts::FRAC_PI_2;
    let inputs: Vec<[f32; 4]> = (0..40_000)
        .map(|i| {
            let off = 1e-7 * 1e4f64.powf(f64::from(i / 4) / 10_000.0);
            let (a, b) = (
                [FRAC_PI_2 - off, FRAC_PI_2 + off][i as usize % 2],
                [0.3, FRAC_PI_2 - 2.0 * off][i as usize / 2 % 2],
            );
            let ([ax, az], [bx, bz]) = (way(a), way(b));
            [ax, az, bx, bz]
        })
        .collect();
    let mut c = Comparison::default();
    for (x, y) in inputs.iter().zip(gaps(desk, &inputs)?) {
        let [ax, az, bx, bz] = x.map(f64::from);
        let (hx, hz) = (ax + bx, az + bz);
        let length = hx.hypot(hz);
        let chord = (hx / length).hypot(1.0 - hz / length);
        let (truth, off) = (0.5 * chord * chord, 15.6 * U_F32);
        c.add(f64::from(y[0]), truth, chord * off + 0.5 * off * off + 4.0 * U_F32 * truth, || {
            format!("gap of {x:?}")
        });
    }
    Ok(c.into())
}

fn reciprocity(desk: &mut Desk) -> Result<Found> {
    let inputs: Vec<[f32; 4]> = (0..40_000)
        .map(|i| {
            let ([ax, az], [bx, bz]) =
                (way(f64::from(i) * 7.7e-5), way(f64::from(i % 997) * -1.5e-3));
            [ax, az, bx, bz]
        })
        .collect();
    let mut c = Comparison::default();
    for (x, y) in inputs.iter().zip(gaps(desk, &inputs)?) {
        c.add(f64::from(y[0]), f64::from(y[1]), 0.0, || format!("gap of {x:?}"));
    }
    Ok(c.into())
}

/// A floor of many facets under a lamp near by, so that every facet has another half vector.
fn floor(desk: &Desk, [kd, ks, ns]: [f64; 3]) -> Result<Scene> {
    let material =
        format!("kd = [{kd:?}, {kd:?}, {kd:?}]\nks = [{ks:?}, {ks:?}, {ks:?}]\nns = {ns:?}\n");
    let lamp = "[[light]]\nkind = 'point'\nposition = [0.2, 1.5, -2.0]\nintensity = [4, 4, \
        4]\nradius = 0.01\n";
    let floor = plate([0.0; 3], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0], 14);
    room(desk, "gather = 'exact'\nbases = 16", lamp, &material, vec![floor])
}

fn black(desk: &mut Desk) -> Result<Found> {
    let mut scene = floor(desk, [0.0, 0.0, 1.0])?;
    scene.surfaces.push(plate([0.0, 1.0, -2.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 5));
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    for (i, lit) in played.lit.iter().enumerate() {
        for v in lit.first.iter().chain(&lit.second).chain(&lit.indirect) {
            c.add(f64::from(*v), 0.0, 0.0, || format!("light of facet {i}"));
        }
        c.holds(lit.direct[0].is_finite(), || format!("what facet {i} receives"));
    }
    Ok(c.into())
}

/// L1 of a floor against the formula.
fn first(desk: &mut Desk, of: [f64; 3]) -> Result<Found> {
    let mut scene = floor(desk, of)?;
    scene.lighting.mode = LightingMode::First;
    let lobe: Vec<f64> = (0..N_NODES).map(|i| Brdf::lobe(of[2], node(i))).collect();
    Ok(first_of(desk, &scene, of, &lobe)?.into())
}

/// L1 of `scene`'s floor against that of a lobe as it is at the nodes, each facet at its own bound.
fn first_of(
    desk: &mut Desk,
    scene: &Scene,
    [kd, ks, ns]: [f64; 3],
    lobe: &[f64],
) -> Result<Comparison> {
    let played = desk.play(scene, 0)?;
    let table = Basis::new(scene.lighting.exponents, scene.lighting.bases, scene.lighting.sampling)
        .lobe(ns);
    let exact = (0..N_NODES).all(|i| lobe[i] == Brdf::lobe(ns, node(i)));
    let (surface, light, eye) =
        (&scene.surfaces[0], &scene.lights[0], scene.camera.keys[0].position);
    let mut c = Comparison::default();
    for (i, lit) in (0u32..).zip(&played.lit) {
        let (p, n) = (surface.facet_center(i), surface.normal());
        let (arrival, toward) = (light.arrival(p), (eye - p).normalize());
        let irradiance = light.energy().x * light.share(n, &arrival, 1.0);
        let h = (arrival.toward + toward).normalize();
        let w = 0.5 * (n - h).length_squared();
        let of_lobe = if exact { Brdf::lobe(ns, w) } else { evaluate(lobe, w) };
        let truth = irradiance * (kd * std::f64::consts::FRAC_1_PI + ks * of_lobe);
        // Where of the table the half vector is: its entries' error, how the lobe bends there, and
        // the rounding of the place.
        let t = w.sqrt().sqrt() * (N_NODES - 1) as f64;
        let here = (t as usize).saturating_sub(1)..((t as usize) + 3).min(N_NODES);
        let entry = here.clone().map(|k| (table[k] - lobe[k]).abs()).fold(0.0, f64::max);
        let bend = lobe[here.clone()]
            .windows(3)
            .map(|w| (w[2] - 2.0 * w[1] + w[0]).abs())
            .fold(0.0, f64::max);
        let steep = table[here].windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
        // The gap is off by 15.6 u |chord|, and by as much as the ways' own 9 u turn it: 31 u
        // |chord| moves t by 16 u/|chord| of itself; its roots by 16 u.
        let chord = (n - h).length();
        let off = (16.0 + 16.0 / chord.max(1e-3)) * U_F32 * t.max(1.0);
        let rounding = 8.0 * U_F32 * table.iter().map(|v| v.abs()).fold(0.0, f64::max);
        let bound = irradiance * ks * (entry + 1.5 * bend / 8.0 + off * steep + rounding)
            + 32.0 * U_F32 * truth.abs();
        c.add(f64::from(lit.first[0]), truth, bound, || format!("L1 of facet {i}"));
    }
    Ok(c)
}

fn huge_exponent(_: &mut Desk) -> Result<Found> {
    const N: f64 = 1e6;
    let mut c = Comparison::default();
    for i in 0..N_NODES {
        let w = node(i);
        // cos^n by the square of it, many times: another way to the same number.
        let mut power = 1.0;
        let (mut base, mut n) = (1.0 - w, N as u32);
        while n > 0 {
            power *= if n & 1 == 1 { base } else { 1.0 };
            base *= base;
            n >>= 1;
        }
        let truth = (N + 2.0) / std::f64::consts::TAU * power;
        // 1 - w is rounded once, and raised to n; each product rounds, and is squared with the
        // rest.
        let bound = 4.0 * N * 2f64.powi(-53) * truth + f64::MIN_POSITIVE;
        c.add(Brdf::lobe(N, w), truth, bound, || format!("lobe at node {i}"));
    }
    Ok(c.into())
}

fn one_exponent(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for ns in [0.0, 1.0, 50.0, 1e4] {
        let basis = Basis::new([ns, ns], 32, Sampling::Log);
        c.add(f64::from(basis.n_bases()), 2.0, 0.0, || format!("bases of n = {ns}"));
        c.add(basis.error(ns), 0.0, 1e-12, || format!("error of n = {ns}"));
    }
    Ok(c.into())
}

fn more_than_samples(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for range in [[1.0, 1.0 + 1e-9], [49.0, 51.0], [0.0, 1000.0]] {
        let basis = Basis::new(range, 4096, Sampling::Log);
        c.holds(basis.n_bases() >= 2 && basis.n_bases() < 4096, || {
            format!("some bases of {range:?}, found {}", basis.n_bases())
        });
        for (i, v) in basis.vectors().iter().enumerate() {
            for (j, w) in basis.vectors().iter().enumerate() {
                c.add(basis.product(v, w), f64::from(u8::from(i == j)), 1e-12, || {
                    format!("product of vectors {i} and {j} of {range:?}")
                });
            }
        }
        let odd = basis.vectors().iter().flatten().filter(|v| !v.is_finite()).count();
        c.add(odd as f64, 0.0, 0.0, || {
            format!("numbers of vectors that are not finite, {range:?}")
        });
        for ns in basis.spread(9) {
            // Every vector that differs is there: what is left is the sampling's.
            c.holds(basis.error(ns) < 1e-3, || format!("error of n = {ns}: {:e}", basis.error(ns)));
        }
    }
    Ok(c.into())
}

fn negative(desk: &mut Desk) -> Result<Found> {
    const NS: f64 = 300.0;
    let mut scene = floor(desk, [0.0, 0.2, NS])?;
    scene.lighting.mode = LightingMode::First;
    (scene.lighting.exponents, scene.lighting.bases) = ([1.0, 1000.0], 3);
    let table = Basis::new(scene.lighting.exponents, scene.lighting.bases, scene.lighting.sampling)
        .lobe(NS);
    let c = first_of(desk, &scene, [0.0, 0.2, NS], &table)?;
    let mut c = c;
    let n_negative = (0..N_NODES).filter(|i| table[*i] < 0.0).count();
    c.holds(n_negative > 0, || "that the lobe is negative somewhere".to_owned());
    Ok(c.remark(format!("{n_negative} of {N_NODES} nodes below 0")).into())
}

fn albedo(_: &mut Desk) -> Result<Found> {
    const N: u32 = 600;
    let n = DVec3::Z;
    let mut c = Comparison::default();
    for ns in [0.0, 1.0, 10.0, 100.0] {
        let brdf = Brdf { kd: DVec3::ZERO, ks: DVec3::ONE, ns };
        for theta in [0.0, 0.5, 1.0, 1.4f64] {
            let from = DVec3::new(theta.sin(), 0.0, theta.cos());
            let mut sum = 0.0;
            for i in 0..N {
                for j in 0..N {
                    // Midpoints over cos^2 and the turn: dw cos = d(cos^2)/2 dphi.
                    let (s, turn) =
                        ((f64::from(i) + 0.5) / f64::from(N), (f64::from(j) + 0.5) / f64::from(N));
                    let (cos, sin, phi) =
                        (s.sqrt(), (1.0 - s).sqrt(), turn * std::f64::consts::TAU);
                    sum += reflectance(
                        &brdf,
                        n,
                        from,
                        DVec3::new(sin * phi.cos(), sin * phi.sin(), cos),
                    )
                    .x;
                }
            }
            let albedo = sum * std::f64::consts::PI / f64::from(N * N);
            c.add((albedo - 4.0).max(0.0), 0.0, 4e-3, || {
                format!("albedo of n = {ns} at {theta} beyond 4")
            });
            if theta == 0.0 {
                // With x = cos gamma, cos = 2 x^2 - 1 and dw = 8 pi x dx from 1/sqrt 2 to 1.
                let part = |k: f64| (1.0 - 2f64.powf(-0.5 * k)) / k;
                let truth = 4.0 * (ns + 2.0) * (2.0 * part(ns + 4.0) - part(ns + 2.0));
                c.add(albedo, truth, 1e-3 * truth, || format!("albedo of n = {ns} from above"));
            }
        }
    }
    Ok(c.into())
}
