//! Light between facets: coincident, touching, coplanar, back to back, tiny, huge and distant; a
//! closed box, which conserves energy.

use std::f64::consts::PI;

use glam::DVec3;

use super::case::{Case, Comparison};
use super::context::{DeviceFrame, StressContext};
use super::scenes::{
    GREY, LIT, SUN_ABOVE, blob, blob_scene, change_camera, corner, floor, rectangle, sun,
    surface_scene,
};
use crate::error::Result;
use crate::layout::facet::LitRecord;
use crate::model::scene::Scene;
use crate::model::surface::Surface;
use crate::reference::picture::FrameReference;
use crate::reference::rounding::U_F32;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "transport/coincident",
        what: "coincident rectangles with equal normals: neither lights the other",
        bound: "0",
        check: |ctx, c| {
            no_second(ctx, c, [floor([0.0; 3], 4), floor([0.0; 3], 4), floor([0.3, 0.0, 0.1], 5)])
        },
    },
    Case {
        name: "transport/coplanar",
        what: "rectangles side by side in one plane: neither lights the other",
        bound: "0",
        check: |ctx, c| {
            let others = [floor([2.0, 0.0, 0.0], 4), floor([0.0, 0.0, 2.5], 3)];
            no_second(ctx, c, [floor([0.0; 3], 4), others[0], others[1]])
        },
    },
    Case {
        name: "transport/back-to-back",
        what: "rectangles facing away from each other: neither lights the other",
        bound: "0",
        check: |ctx, c| no_second(ctx, c, [floor([0.0; 3], 4), ceiling([0.0, -0.5, 0.0], 4)]),
    },
    Case {
        name: "transport/touching",
        what: "a floor and a wall with a common edge, against the integral over their areas",
        bound: "1 % of the greatest L2 (docs/reference/measured.md), and the unresolved part",
        check: touching,
    },
    Case {
        name: "transport/crossing",
        what: "two rectangles through each other's middle: some light, finite, no more than the \
            emitted light",
        bound: "1e-3 of the brightest L1",
        check: crossing,
    },
    Case {
        name: "transport/tiny",
        what: "a room of areas of 1e-12: the same light as of the room 2^20 times as large",
        bound: "0: powers of two change no digit",
        check: |ctx, c| scaled(ctx, c, -20),
    },
    Case {
        name: "transport/huge",
        what: "a room of areas of 1e12: the same light as of the room 2^-20 times as large",
        bound: "0: powers of two change no digit",
        check: |ctx, c| scaled(ctx, c, 20),
    },
    Case {
        name: "transport/far",
        what: "a floor and a ceiling 1e9 apart: K_d L1 A/(pi d^2)",
        bound: "64 u, relative",
        check: far,
    },
    Case {
        name: "transport/touching-facets",
        what: "facets of a cloud at two points, many at distance 0, over a floor: finite light \
            from it, not negative",
        bound: "0",
        check: one_point,
    },
    Case {
        name: "transport/tree-one-point",
        what: "a tree of facets at two points and a floor, opened to its leaves: the same light \
            as from every pair",
        bound: "2 (n + 32) u of the greatest",
        check: tree_one_point,
    },
    Case {
        name: "transport/closed-box",
        what: "a closed box of six white walls with a lamp: as much light arrives as is emitted",
        bound: "1 % of pairs (docs/reference/measured.md); of the lamp 64 u of its facets' sum",
        check: closed_box,
    },
];

const EXACT: &str = "gather = 'exact'";

/// Returns a square of side 2 that faces down.
fn ceiling(center: [f64; 3], n: u32) -> Surface {
    rectangle(center, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], n)
}

/// Checks that the facets' light is finite and not negative, and returns the greatest channel of
/// every facet's L2.
fn second(c: &mut Comparison, frame: &DeviceFrame) -> Vec<f64> {
    let greatest = |(i, lit): (usize, &LitRecord)| {
        let mut all = lit.second.iter().chain(&lit.indirect).chain(&lit.first);
        let is_light = all.all(|v| v.is_finite() && *v >= 0.0);
        c.holds(is_light, format_args!("finite light of facet {i}, not negative"));
        f64::from(lit.second.iter().copied().fold(0.0, f32::max))
    };
    frame.lit.iter().enumerate().map(greatest).collect()
}

/// Checks that no facet of rectangles under a sun receives light from another.
fn no_second<const N: usize>(
    ctx: &mut StressContext,
    c: &mut Comparison,
    surfaces: [Surface; N],
) -> Result<()> {
    let frame = ctx.render(&surface_scene(EXACT, SUN_ABOVE, GREY, surfaces)?, 0)?;
    for (i, l) in second(c, &frame).into_iter().enumerate() {
        c.exact(l, 0.0, format_args!("L2 of facet {i}"));
    }
    Ok(())
}

fn touching(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let [floor, wall, _] = corner(7);
    let scene = surface_scene(EXACT, &sun("[0.2, -1, -0.7]"), GREY, [floor, wall])?;
    let frame = ctx.render(&scene, 0)?;
    let truth = FrameReference::new(&scene, 0.0)?;
    second(c, &frame);
    let most = truth.second.iter().map(|l| l.max_element()).fold(0.0, f64::max);
    for (i, (lit, truth)) in frame.lit.iter().zip(&truth.second).enumerate() {
        let unresolved = f64::from(lit.unresolved);
        let at = format_args!("facet {i} resolved but for {unresolved:e}");
        c.holds(unresolved < 0.01 * most, at);
        let bound = 0.01 * most + unresolved;
        c.add(lit.second[0], truth.x, bound, format_args!("L2 of facet {i}"));
    }
    c.holds(most > 0.0, "some second reflection");
    Ok(())
}

fn crossing(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let tilted = rectangle([0.0; 3], [0.0, 0.0, 1.0], [0.8, 0.6, 0.0], 6);
    let scene = surface_scene(EXACT, SUN_ABOVE, GREY, [floor([0.0; 3], 6), tilted])?;
    let frame = ctx.render(&scene, 0)?;
    // A hemisphere of the brightest L1 gives an irradiance of pi of it.
    let brightest = frame.lit.iter().map(|l| f64::from(l.first[0])).fold(0.0, f64::max);
    let second = second(c, &frame);
    c.holds(second.iter().any(|l| *l > 0.01 * brightest), "some second reflection");
    for (i, l) in second.into_iter().enumerate() {
        let beyond = (l - 0.5 * brightest).max(0.0);
        let at = format_args!("L2 of facet {i} above K_d of the brightest L1");
        c.add(beyond, 0.0, 1e-3 * brightest, at);
    }
    Ok(())
}

/// Returns a corner of a floor and two walls, scaled by 2^k.
fn scaled_corner(k: i32) -> Result<Scene> {
    let s = 2f64.powi(k);
    let surfaces = corner(5).map(|p| Surface { center: s * p.center, u: s * p.u, v: s * p.v, ..p });
    let mut scene = surface_scene(EXACT, &sun("[-0.5, -1, -0.7]"), GREY, surfaces)?;
    change_camera(&mut scene, |p| s * p);
    scene.camera.near *= s;
    Ok(scene)
}

fn scaled(ctx: &mut StressContext, c: &mut Comparison, k: i32) -> Result<()> {
    let one = ctx.render(&scaled_corner(0)?, 0)?;
    let other = ctx.render(&scaled_corner(k)?, 0)?;
    let light = |frame: &DeviceFrame| -> Vec<_> {
        frame.lit.iter().map(|l| (l.first, l.second, l.indirect)).collect()
    };
    c.same(&light(&one), &light(&other), "light of facets");
    let is_lit = second(c, &one).into_iter().any(|l| l > 0.0);
    c.holds(is_lit, "some second reflection");
    Ok(())
}

fn far(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const D: f64 = 1e9;
    // The sun comes from beside the ceiling and lights the floor alone.
    let surfaces = [floor([0.0; 3], 1), ceiling([0.0, D, 0.0], 1)];
    let frame = ctx.render(&surface_scene(EXACT, &sun("[0.6, -0.8, 0]"), GREY, surfaces)?, 0)?;
    let second = second(c, &frame);
    // L1 = K_d E cos/pi of the floor, A = 4; L2 = K_d/pi L1 A/d².
    let truth = 0.5 / PI * (0.5 * 0.8 / PI) * 4.0 / (D * D);
    c.add(second[1], truth, 64.0 * U_F32 * truth, "L2 of the ceiling");
    c.exact(second[0], 0.0, "L2 of the floor");
    Ok(())
}

/// Renders `n` blobs at two points over a floor. The facets of either point face away from the
/// other point, and all face the floor.
fn two_points(ctx: &mut StressContext, gather: &str, n: u32) -> Result<DeviceFrame> {
    let mode = format!("mode = 'two-reflection'\ngather = '{gather}'\ntheta = 0.0");
    let text = LIT.replace("mode = 'first'", &mode);
    let at = |i: u32| [if i.is_multiple_of(2) { 1.0 } else { -1.0 }, 0.0, 0.0];
    let blobs = (0..n).map(|i| blob(at(i), 0.2, 0.5)).collect();
    let mut scene = blob_scene(&text, "", blobs)?;
    scene.surfaces.push(rectangle([0.0, -2.0, 0.0], [0.0, 0.0, 5.0], [5.0, 0.0, 0.0], 6));
    ctx.render(&scene, 0)
}

fn one_point(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let frame = two_points(ctx, "exact", 100)?;
    let second = second(c, &frame);
    // The first 36 facets are the floor's.
    c.holds(second[36..].iter().all(|l| *l > 0.0), "the floor lights every facet");
    c.finite(&frame.rgba, "picture");
    Ok(())
}

fn tree_one_point(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const N: u32 = 150;
    let [exact, tree] = ["exact", "tree"].map(|gather| two_points(ctx, gather, N));
    let (exact, tree) = (second(c, &exact?), second(c, &tree?));
    let most = exact.iter().copied().fold(0.0, f64::max);
    c.holds(most > 0.0, "some second reflection");
    c.each(tree, exact, |_| 2.0 * (f64::from(N) + 32.0) * U_F32 * most, "L2 of facets");
    Ok(())
}

fn closed_box(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let walls = [
        ([0.0, -1.0, 0.0], z, x),
        ([0.0, 1.0, 0.0], x, z),
        ([-1.0, 0.0, 0.0], y, z),
        ([1.0, 0.0, 0.0], z, y),
        ([0.0, 0.0, -1.0], x, y),
        ([0.0, 0.0, 1.0], y, x),
    ];
    let lamp = "[[light]]\nkind = 'point'\nposition = [0.1, 0.2, -0.1]\nintensity = [1, 1, 1]\n\
        radius = 0.05\n";
    let surfaces = walls.map(|(at, u, v)| rectangle(at, u, v, 6));
    let scene = surface_scene(EXACT, lamp, "kd = [1, 1, 1]\n", surfaces)?;
    let frame = ctx.render(&scene, 0)?;
    second(c, &frame);
    let flux = |irradiance: fn(&LitRecord) -> f32| -> f64 {
        let facets = frame.facets.iter().zip(&frame.lit);
        facets.map(|(f, l)| f64::from(f.area) * f64::from(irradiance(l))).sum()
    };
    let (emitted, received) = (flux(|l| l.direct[0]), flux(|l| l.indirect[0]));
    c.add(received, emitted, 0.01 * emitted, "received of the emitted second reflection");
    // The irradiance at the facets' centres: the lamp's power but for the midpoint rule.
    let lamp = DVec3::new(0.1, 0.2, -0.1);
    let at = |s: &Surface, i: u32| {
        let way = lamp - s.facet_center(i);
        s.area() / s.n_facets() as f64 * s.normal().dot(way) / way.length().powi(3)
    };
    let truth: f64 =
        scene.surfaces.iter().flat_map(|s| (0..s.n_facets() as u32).map(move |i| at(s, i))).sum();
    c.add(emitted, truth, 64.0 * U_F32 * truth, "received of the lamp");
    c.add(emitted, 4.0 * PI, 0.02 * 4.0 * PI, "the lamp's power");
    Ok(())
}
