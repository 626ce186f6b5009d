//! Light between facets: at one place, touching, in one plane, back to back, tiny, huge and far
//! away; sums of a million terms; a closed box, in which no energy may come to be.

use std::f64::consts::PI;

use glam::DVec3;

use super::case::{Case, Comparison, Found};
use super::desk::{Desk, Played};
use super::scenes::{DULL, LIT, NOON, blob, plate, room, with_particles};
use crate::error::Result;
use crate::layout::sums::SumMacros;
use crate::model::scene::Scene;
use crate::model::sums::{Precision, Summation, Sums};
use crate::model::surface::Surface;
use crate::reference::picture::FrameReference;
use crate::reference::rounding::{U_F32, sum_error};

pub const CASES: &[Case] = &[
    Case {
        name: "transport/coincident",
        what: "two rectangles at one place, one upon the other: neither lights the other",
        bound: "0",
        run: coincident,
    },
    Case {
        name: "transport/coplanar",
        what: "rectangles beside each other in one plane: neither lights the other",
        bound: "0",
        run: coplanar,
    },
    Case {
        name: "transport/back-to-back",
        what: "rectangles whose fronts look away from each other: neither lights the other",
        bound: "0",
        run: back_to_back,
    },
    Case {
        name: "transport/touching",
        what: "a floor and a wall that share an edge, against the integral over their areas",
        bound: "1 % of the greatest L2 (docs/measured.md), and what is told to be unresolved",
        run: touching,
    },
    Case {
        name: "transport/crossing",
        what: "two rectangles through each other's middle: some light, finite, no more than all \
            that is sent",
        bound: "1e-3 of the brightest L1",
        run: crossing,
    },
    Case {
        name: "transport/tiny",
        what: "a room of areas of 1e-12: the same light as of the same room 2^20 times as large",
        bound: "0: powers of two change no digit",
        run: |desk| scaled(desk, -20),
    },
    Case {
        name: "transport/huge",
        what: "a room of areas of 1e12",
        bound: "0: powers of two change no digit",
        run: |desk| scaled(desk, 20),
    },
    Case {
        name: "transport/far",
        what: "a floor and a ceiling 1e9 apart: K_d L1 A/(pi d^2)",
        bound: "64 u, relative",
        run: far,
    },
    Case {
        name: "transport/touching-facets",
        what: "facets of a cloud at two points, to each other at distance 0, over a floor: finite, \
            lit by it, not negative",
        bound: "0",
        run: one_point,
    },
    Case {
        name: "transport/tree-one-point",
        what: "a tree of facets at two points and a floor, opened to its leaves: as gathered \
            from every pair",
        bound: "2 (n + 32) u of the greatest",
        run: tree_one_point,
    },
    Case {
        name: "transport/closed-box",
        what: "six white walls that close a box, a lamp in it: as much arrives as is sent",
        bound: "1 % of pairs (docs/measured.md); of the lamp 64 u of its facets' sum",
        run: closed_box,
    },
    Case {
        name: "transport/sum-plain",
        what: "a million terms of both signs and 40 binades, one after the other",
        bound: "gamma_(n-1) of the sum of magnitudes",
        run: |desk| sums(desk, Summation::Plain, Precision::F32),
    },
    Case {
        name: "transport/sum-kahan",
        what: "the same, compensated",
        bound: "2 u + O(n u^2) of the sum of magnitudes",
        run: |desk| sums(desk, Summation::Kahan, Precision::F32),
    },
    Case {
        name: "transport/sum-pairwise",
        what: "the same, pairwise",
        bound: "gamma of 8 + log2(n/4) + n/2^14 of the sum of magnitudes",
        run: |desk| sums(desk, Summation::Pairwise, Precision::F32),
    },
    Case {
        name: "transport/sum-double",
        what: "the same in f64, where the device has it",
        bound: "u of the sum, and gamma of f64",
        run: |desk| sums(desk, Summation::Plain, Precision::F64),
    },
];

/// Rectangles in the sun of noon.
fn noon(desk: &Desk, surfaces: Vec<Surface>) -> Result<Scene> {
    room(desk, "gather = 'exact'", NOON, DULL, surfaces)
}

/// The greatest channel of L2 and I_i, which must be no less than 0 and finite.
fn second(c: &mut Comparison, played: &Played) -> Vec<f64> {
    let of = |(i, lit): (usize, &crate::layout::facet::LitRecord)| {
        let all = lit.second.iter().chain(&lit.indirect).chain(&lit.first);
        c.holds(all.clone().all(|v| v.is_finite() && *v >= 0.0), || {
            format!("light of facet {i}, finite and not negative")
        });
        f64::from(lit.second.iter().copied().fold(0.0, f32::max))
    };
    played.lit.iter().enumerate().map(of).collect()
}

/// Adds that no facet has any L2.
fn nothing(desk: &mut Desk, surfaces: Vec<Surface>) -> Result<Found> {
    let scene = noon(desk, surfaces)?;
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    let lit = second(&mut c, &played);
    lit.iter().enumerate().for_each(|(i, l)| c.add(*l, 0.0, 0.0, || format!("L2 of facet {i}")));
    Ok(c.into())
}

const FLOOR: ([f64; 3], [f64; 3]) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);

fn floor(center: [f64; 3], n: u32) -> Surface {
    plate(center, FLOOR.0, FLOOR.1, n)
}

fn coincident(desk: &mut Desk) -> Result<Found> {
    nothing(desk, vec![floor([0.0; 3], 4), floor([0.0; 3], 4), floor([0.3, 0.0, 0.1], 5)])
}

fn coplanar(desk: &mut Desk) -> Result<Found> {
    nothing(desk, vec![floor([0.0; 3], 4), floor([2.0, 0.0, 0.0], 4), floor([0.0, 0.0, 2.5], 3)])
}

fn back_to_back(desk: &mut Desk) -> Result<Found> {
    // Fronts up and down.
    let down = plate([0.0, -0.5, 0.0], FLOOR.1, FLOOR.0, 4);
    nothing(desk, vec![floor([0.0; 3], 4), down])
}

fn touching(desk: &mut Desk) -> Result<Found> {
    let wall = plate([0.0, 1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 7);
    let lights =
        "[[light]]\nkind = 'directional'\ndirection = [0.2, -1, -0.7]\nirradiance = [1, 1, 1]\n";
    let scene = room(desk, "gather = 'exact'", lights, DULL, vec![floor([0.0; 3], 7), wall])?;
    let played = desk.play(&scene, 0)?;
    let truth = FrameReference::new(&scene, 0.0)?;
    let mut c = Comparison::default();
    second(&mut c, &played);
    let most = truth.second.iter().map(|l| l.max_element()).fold(0.0, f64::max);
    for (i, (lit, truth)) in played.lit.iter().zip(&truth.second).enumerate() {
        c.holds(f64::from(lit.unresolved) < 0.01 * most, || {
            format!("facet {i}, resolved but for {:e}", lit.unresolved)
        });
        let bound = 0.01 * most + f64::from(lit.unresolved);
        c.add(f64::from(lit.second[0]), truth.x, bound, || format!("L2 of facet {i}"));
    }
    c.holds(most > 0.0, || "that there is some".to_owned());
    Ok(c.into())
}

fn crossing(desk: &mut Desk) -> Result<Found> {
    let tilted = plate([0.0; 3], [0.0, 0.0, 1.0], [0.8, 0.6, 0.0], 6);
    let scene = noon(desk, vec![floor([0.0; 3], 6), tilted])?;
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    // Of a hemisphere of the brightest L1 a facet receives pi of it.
    let brightest = played.lit.iter().map(|l| f64::from(l.first[0])).fold(0.0, f64::max);
    let lit = second(&mut c, &played);
    c.holds(lit.iter().any(|l| *l > 0.01 * brightest), || {
        "that there is a second reflection".to_owned()
    });
    for (i, l) in lit.into_iter().enumerate() {
        c.add((l - 0.5 * brightest).max(0.0), 0.0, 1e-3 * brightest, || {
            format!("L2 of facet {i} beyond K_d of the brightest")
        });
    }
    Ok(c.into())
}

/// A corner of three walls, lit askew, as large as 2^k.
fn corner(desk: &Desk, k: i32) -> Result<Scene> {
    let s = 2f64.powi(k);
    let surfaces = [
        plate([0.0; 3], FLOOR.0, FLOOR.1, 5),
        plate([0.0, 1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 5),
        plate([-1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], 5),
    ];
    let scaled = surfaces.map(|p| Surface { center: s * p.center, u: s * p.u, v: s * p.v, ..p });
    let lights =
        "[[light]]\nkind = 'directional'\ndirection = [-0.5, -1, -0.7]\nirradiance = [1, 1, 1]\n";
    let mut scene = room(desk, "gather = 'exact'", lights, DULL, scaled.to_vec())?;
    scene
        .camera
        .keys
        .iter_mut()
        .for_each(|key| (key.position, key.target) = (s * key.position, s * key.target));
    scene.camera.near *= s;
    Ok(scene)
}

fn scaled(desk: &mut Desk, k: i32) -> Result<Found> {
    let (one, other) = (corner(desk, 0)?, corner(desk, k)?);
    let (one, other) = (desk.play(&one, 0)?, desk.play(&other, 0)?);
    let mut c = Comparison::default();
    let light =
        |p: &Played| p.lit.iter().map(|l| (l.first, l.second, l.indirect)).collect::<Vec<_>>();
    c.same(&light(&one), &light(&other), "light of facets");
    let lit = second(&mut c, &one);
    c.holds(lit.iter().any(|l| *l > 0.0), || "that there is a second reflection".to_owned());
    Ok(c.into())
}

fn far(desk: &mut Desk) -> Result<Found> {
    const D: f64 = 1e9;
    // Fronts toward each other; the sun comes from beside the ceiling and meets the floor alone.
    let ceiling = plate([0.0, D, 0.0], FLOOR.1, FLOOR.0, 1);
    let lights =
        "[[light]]\nkind = 'directional'\ndirection = [0.6, -0.8, 0]\nirradiance = [1, 1, 1]\n";
    let scene = room(desk, "gather = 'exact'", lights, DULL, vec![floor([0.0; 3], 1), ceiling])?;
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    let lit = second(&mut c, &played);
    // L1 = K_d E cos/pi of the floor, A = 4; L2 = K_d/pi L1 A/d^2.
    let truth = 0.5 / PI * (0.5 * 0.8 / PI) * 4.0 / (D * D);
    c.add(lit[1], truth, 64.0 * U_F32 * truth, || "L2 of the ceiling".to_owned());
    c.add(lit[0], 0.0, 0.0, || "L2 of the floor".to_owned());
    Ok(c.into())
}

/// Blobs at one point.
fn heaped(desk: &Desk, gather: &str, n: u32) -> Result<Scene> {
    let text = LIT.replace(
        "mode = 'first'",
        &format!("mode = 'two-reflection'\ngather = '{gather}'\ntheta = 0.0"),
    );
    // Two points, so that the cloud's facets look away from each other, over a floor that all of
    // them see.
    let at = |i: u32| [if i.is_multiple_of(2) { 1.0 } else { -1.0 }, 0.0, 0.0];
    let mut scene = with_particles(desk, &text, (0..n).map(|i| blob(at(i), 0.2, 0.5)).collect())?;
    scene.surfaces.push(plate([0.0, -2.0, 0.0], [0.0, 0.0, 5.0], [5.0, 0.0, 0.0], 6));
    Ok(scene)
}

fn one_point(desk: &mut Desk) -> Result<Found> {
    let scene = heaped(desk, "exact", 100)?;
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    let lit = second(&mut c, &played);
    // Surfaces' facets come first.
    c.holds(lit[36..].iter().all(|l| *l > 0.0), || "that the floor lights all of them".to_owned());
    c.add(played.n_odd() as f64, 0.0, 0.0, || {
        "numbers of the picture that are not finite".to_owned()
    });
    Ok(c.into())
}

fn tree_one_point(desk: &mut Desk) -> Result<Found> {
    const N: u32 = 150;
    let (exact, tree) = (heaped(desk, "exact", N)?, heaped(desk, "tree", N)?);
    let (exact, tree) = (desk.play(&exact, 0)?, desk.play(&tree, 0)?);
    let mut c = Comparison::default();
    let (exact, tree) = (second(&mut c, &exact), second(&mut c, &tree));
    let most = exact.iter().copied().fold(0.0, f64::max);
    c.holds(most > 0.0, || "that there is a second reflection".to_owned());
    for (i, (a, b)) in exact.iter().zip(&tree).enumerate() {
        c.add(*b, *a, 2.0 * (f64::from(N) + 32.0) * U_F32 * most, || format!("L2 of facet {i}"));
    }
    Ok(c.into())
}

fn closed_box(desk: &mut Desk) -> Result<Found> {
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let walls = [
        ([0.0, -1.0, 0.0], z, x),
        ([0.0, 1.0, 0.0], x, z),
        ([-1.0, 0.0, 0.0], y, z),
        ([1.0, 0.0, 0.0], z, y),
        ([0.0, 0.0, -1.0], x, y),
        ([0.0, 0.0, 1.0], y, x),
    ];
    let lamp = "[[light]]\nkind = 'point'\nposition = [0.1, 0.2, -0.1]\nintensity = [1, 1, \
        1]\nradius = 0.05\n";
    let surfaces = walls.map(|(at, u, v)| plate(at, u, v, 6)).to_vec();
    let scene = room(desk, "gather = 'exact'", lamp, "kd = [1, 1, 1]\n", surfaces)?;
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    second(&mut c, &played);
    let flux = |of: fn(&crate::layout::facet::LitRecord) -> f32| -> f64 {
        played
            .facets
            .iter()
            .zip(&played.lit)
            .map(|(f, l)| f64::from(f.area) * f64::from(of(l)))
            .sum()
    };
    let (sent, received) = (flux(|l| l.direct[0]), flux(|l| l.indirect[0]));
    c.add(received, sent, 0.01 * sent, || {
        "all that is received of the second reflection, by what was sent".to_owned()
    });
    // Of the lamp what its facets' centres receive, and that is its power but for the midpoint
    // rule.
    let lamp = DVec3::new(0.1, 0.2, -0.1);
    let at = |s: &Surface, i: u32| {
        let way = lamp - s.facet_center(i);
        s.area() / s.n_facets() as f64 * s.normal().dot(way) / way.length().powi(3)
    };
    let truth: f64 =
        scene.surfaces.iter().flat_map(|s| (0..s.n_facets() as u32).map(move |i| at(s, i))).sum();
    c.add(sent, truth, 64.0 * U_F32 * truth, || "all that is received of the lamp".to_owned());
    c.add(sent, 4.0 * PI, 0.02 * 4.0 * PI, || "the lamp's power".to_owned());
    Ok(c.into())
}

/// One invocation sums a million terms, sixteen a turn of its loop.
const SUM: &str = r#"#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
layout(local_size_x = 1) in;
layout(std430, binding = 0) readonly buffer Terms { float terms[]; };
layout(std430, binding = 1) writeonly buffer Totals { float total; };
#include "sum.glsl"
// By hand: what an optimiser unrolls may lose `precise`, and with it the compensation.
#define FOUR(i) ADD(sum, terms[i]); ADD(sum, terms[i + 1u]); ADD(sum, terms[i + 2u]); ADD(sum, terms[i + 3u])
void main() {
    SUM1 sum = EMPTY1;
    for (uint i = 0u; i < terms.length(); i += 16u) {
        FOUR(i);
        FOUR(i + 4u);
        FOUR(i + 8u);
        FOUR(i + 12u);
    }
    total = float(TOTAL(sum));
}
"#;

const N_TERMS: u32 = 1_000_000;

/// Of both signs, over 40 binades; and one beside which each of the others by itself is rounded
/// away.
fn terms() -> [Vec<f32>; 2] {
    let share = |i: u32, k: f64| (f64::from(i) * k).fract();
    let wide = |i: u32| {
        let magnitude = (40.0 * share(i, 0.754_877_666_246_693) - 30.0).exp2();
        ((2.0 * share(i, 0.618_033_988_749_895) - 1.0) * magnitude) as f32
    };
    let dust = |i: u32| if i == 0 { 1.0 } else { 0.4 / 16_777_216.0 };
    [(0..N_TERMS).map(wide).collect(), (0..N_TERMS).map(dust).collect()]
}

fn sums(desk: &mut Desk, summation: Summation, precision: Precision) -> Result<Found> {
    if precision == Precision::F64 && !desk.device().limits().has_float64 {
        return Ok(Found::NotHere("the device has no f64 in shaders".to_owned()));
    }
    let sums = Sums { summation, precision };
    let kernel = desk.kernel("sum", SUM, &[], SumMacros::from(sums).list())?;
    let mut c = Comparison::default();
    for (what, terms) in ["wide", "dust"].into_iter().zip(terms()) {
        let (x, y) = (desk.upload(&terms)?, desk.buffer::<f32>(1)?);
        desk.run(|rec| rec.dispatch_groups(&kernel, &[&x, &y], &(), 1))?;
        let found = desk.download::<f32>(&y, 1)?[0];
        // Exact: f64 beside what its roundings lose.
        let (mut sum, mut lost, mut magnitude) = (0.0f64, 0.0, 0.0);
        for x in terms.iter().map(|x| f64::from(*x)) {
            let next = sum + x;
            let added = next - sum;
            lost += (sum - (next - added)) + (x - added);
            (sum, magnitude) = (next, magnitude + x.abs());
        }
        let bound = sum_error(sums, u64::from(N_TERMS)) * magnitude;
        c.add(f64::from(found), sum + lost, bound, || format!("the sum of {what} terms"));
    }
    Ok(c.into())
}
