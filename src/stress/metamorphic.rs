//! Pairs of scenes with related results: scaled light, rotation, permutation, cut surfaces.

use glam::DVec3;

use super::case::{Case, Comparison};
use super::compositing::two_pictures_bound;
use super::context::{DeviceFrame, StressContext};
use super::scenes::{
    GREY, HEIGHT, LIT, PATHS, UNLIT, WIDTH, blob_cluster, blob_scene, change_camera, corner,
    render_blobs, surface_scene,
};
use crate::error::Result;
use crate::model::cloud::{CloudSource, Particle};
use crate::model::light::Light;
use crate::model::scene::{LightingMode, Scene};
use crate::model::surface::Surface;
use crate::reference::rounding::U_F32;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "metamorphic/double-light",
        what: "every lamp, sun and sky twice as bright: twice the radiance of every facet and \
            pixel",
        bound: "0",
        check: |ctx, c| brighter(ctx, c, 2.0),
    },
    Case {
        name: "metamorphic/little-light",
        what: "2^-40 of the light: 2^-40 of the radiance",
        bound: "0",
        check: |ctx, c| brighter(ctx, c, 2f64.powi(-40)),
    },
    Case {
        name: "metamorphic/no-light",
        what: "lights without energy: no radiance",
        bound: "0",
        check: |ctx, c| brighter(ctx, c, 0.0),
    },
    Case {
        name: "metamorphic/turned",
        what: "a corner rotated by a right angle about the vertical axis: the same light on \
            every facet",
        bound: "256 u of the greatest",
        check: turned,
    },
    Case {
        name: "metamorphic/permuted",
        what: "particles listed in another order: the same light of each, to the bit",
        bound: "0",
        check: permuted,
    },
    Case {
        name: "metamorphic/permuted-picture",
        what: "particles at different depths, listed in another order: the same picture, to the \
            byte",
        bound: "0",
        check: |ctx, c| {
            for path in PATHS {
                let scene = blob_scene(LIT, path, blob_cluster(120))?;
                let (one, other) = (ctx.render(&scene, 0)?, ctx.render(&permute(&scene), 0)?);
                c.same(&one.bytes, &other.bytes, format_args!("bytes, {path}"));
            }
            Ok(())
        },
    },
    Case {
        name: "metamorphic/split",
        what: "a floor cut in two, with the same facets: the same light on every facet",
        bound: "2 % of the greatest: each is within 1 % of the areas' integral",
        check: split,
    },
    Case {
        name: "metamorphic/mirrored",
        what: "a cloud mirrored left to right in front of a centred camera: the mirrored picture",
        bound: "64 u of an opacity, and 2^-22 a layer",
        check: mirrored,
    },
    Case {
        name: "metamorphic/no-particle-more",
        what: "as many particles again, of optical depth 0: the same picture, to the byte",
        bound: "0",
        check: |ctx, c| {
            for path in PATHS {
                let all = blob_cluster(80);
                // At the same places, so that the scene's bounds stay the same.
                let empty =
                    all.iter().map(|p| Particle { kappa: 0.0, color: DVec3::splat(1e6), ..*p });
                let both = all.iter().copied().chain(empty).collect();
                let one = render_blobs(ctx, UNLIT, path, all.clone())?;
                let other = render_blobs(ctx, UNLIT, path, both)?;
                c.same(&one.bytes, &other.bytes, format_args!("bytes, {path}"));
                let placed = &other.placed[..one.placed.len()];
                c.same(&one.placed, placed, format_args!("positions, {path}"));
            }
            Ok(())
        },
    },
];

/// Returns a corner of two walls and a floor, with a sun, a lamp and a sky.
fn lit_corner() -> Result<Scene> {
    let lights = "[[light]]\nkind = 'directional'\ndirection = [-0.5, -1, -0.75]\n\
        irradiance = [1, 0.75, 0.5]\n\
        [[light]]\nkind = 'point'\nposition = [0.25, 0.5, 0.5]\nintensity = [1, 1, 1]\n\
        radius = 0.0625\n\
        [[light]]\nkind = 'sky'\nirradiance = [0.25, 0.25, 0.5]\nconstant = 0.25\n";
    let material = format!("{GREY}ks = [0.125, 0.125, 0.125]\nns = 20.0\n");
    surface_scene("gather = 'exact'", lights, &material, corner(6))
}

fn lit_cloud() -> Result<Scene> {
    let text = LIT.replace("mode = 'first'", "mode = 'two-reflection'\ngather = 'exact'");
    blob_scene(&text, "", blob_cluster(120))
}

/// Returns L1 and L2 of every facet.
fn radiances(frame: &DeviceFrame) -> impl Iterator<Item = f64> + '_ {
    frame.lit.iter().flat_map(|l| l.first.into_iter().chain(l.second)).map(f64::from)
}

fn brighter(ctx: &mut StressContext, c: &mut Comparison, factor: f64) -> Result<()> {
    for (what, scene) in [("a corner", lit_corner()?), ("a cloud", lit_cloud()?)] {
        let mut other = scene.clone();
        for light in &mut other.lights {
            match light {
                Light::Directional { irradiance: e, .. }
                | Light::Sky { irradiance: e, .. }
                | Light::Point { intensity: e, .. }
                | Light::Spot { intensity: e, .. } => *e *= factor,
            }
        }
        // Even the smallest radiance is far above the range that f32 flushes to 0.
        let (one, other) = (ctx.render(&scene, 0)?, ctx.render(&other, 0)?);
        let truth = radiances(&one).map(|v| factor * v);
        c.each(radiances(&other), truth, |_| 0.0, format_args!("radiance of facets, {what}"));
        for (i, (a, b)) in one.rgba.chunks_exact(4).zip(other.rgba.chunks_exact(4)).enumerate() {
            let truth = a[..3].iter().map(|v| factor * f64::from(*v));
            c.each(b[..3].iter().copied(), truth, |_| 0.0, format_args!("pixel {i} of {what}"));
        }
    }
    Ok(())
}

fn turned(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    // A right angle about y is exact.
    let turn = |v: DVec3| DVec3::new(v.z, v.y, -v.x);
    let scene = lit_corner()?;
    let mut other = scene.clone();
    for s in &mut other.surfaces {
        *s = Surface { center: turn(s.center), u: turn(s.u), v: turn(s.v), ..*s };
    }
    for light in &mut other.lights {
        match light {
            Light::Directional { direction: v, .. }
            | Light::Point { position: v, .. }
            | Light::Spot { position: v, .. } => *v = turn(*v),
            Light::Sky { .. } => {}
        }
    }
    change_camera(&mut other, turn);
    let (one, other) = (ctx.render(&scene, 0)?, ctx.render(&other, 0)?);
    let most = radiances(&one).fold(0.0, f64::max);
    let bound = |_| 256.0 * U_F32 * most;
    c.each(radiances(&other), radiances(&one), bound, "radiance of facets");
    Ok(())
}

/// Returns a permutation of 0 to n − 1 for every n that 37 does not divide.
fn permutation(n: usize) -> impl Iterator<Item = usize> {
    (0..n).map(move |i| (37 * i + 11) % n)
}

fn permute(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    if let CloudSource::Particles(list) = &mut scene.clouds[0].source {
        *list = permutation(list.len()).map(|i| list[i]).collect();
    }
    scene
}

fn permuted(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let mut scene = lit_cloud()?;
    scene.lighting.mode = LightingMode::First;
    let (one, other) = (ctx.render(&scene, 0)?, ctx.render(&permute(&scene), 0)?);
    let light = |f: &DeviceFrame, i: usize| (f.lit[i].first, f.lit[i].direct);
    let n = one.lit.len();
    let expected: Vec<_> = permutation(n).map(|i| light(&one, i)).collect();
    let found: Vec<_> = (0..other.lit.len()).map(|i| light(&other, i)).collect();
    c.same(&found, &expected, "light of facets");
    Ok(())
}

fn split(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let scene = lit_corner()?;
    let mut other = scene.clone();
    let floor = scene.surfaces[0];
    // Along v: halves of 6 × 3 facets.
    let half = |s: f64| Surface {
        center: floor.center + s * 0.5 * floor.v,
        v: 0.5 * floor.v,
        subdivide: [6, 3],
        ..floor
    };
    other.surfaces.splice(..1, [half(-1.0), half(1.0)]);
    let (one, other) = (ctx.render(&scene, 0)?, ctx.render(&other, 0)?);
    // The cut adds an edge, and edges decide which pairs of facets are refined.
    let bound = 0.02 * f64::from(one.lit.iter().map(|l| l.second[0]).fold(0.0, f32::max));
    for (f, l) in one.facets.iter().zip(&one.lit) {
        let found = other.facets.iter().position(|g| {
            g.normal == f.normal && (0..3).all(|k| (g.position[k] - f.position[k]).abs() < 1e-5)
        });
        c.holds(found.is_some(), format_args!("a facet at {:?}", f.position));
        if let Some(i) = found {
            let at = format_args!("L2 of the facet at {:?}", f.position);
            c.each(other.lit[i].second, l.second, |_| bound, at);
        }
    }
    Ok(())
}

fn mirrored(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const N: u32 = 150;
    let mirror =
        |p: &Particle| Particle { position: p.position * DVec3::new(-1.0, 1.0, 1.0), ..*p };
    for path in PATHS {
        // At 8 sigma the discontinuity at a sprite's edge vanishes.
        let draw = format!("{path}\ncutoff = 8");
        let all = blob_cluster(N);
        let other = render_blobs(ctx, UNLIT, &draw, all.iter().map(mirror).collect())?;
        let one = render_blobs(ctx, UNLIT, &draw, all)?;
        for (j, i) in (0..HEIGHT).flat_map(|j| (0..WIDTH).map(move |i| (j, i))) {
            let (a, b) = (j * WIDTH + i, j * WIDTH + WIDTH - 1 - i);
            let bound = two_pictures_bound(one.channel(a, 3), N);
            for k in 0..4 {
                let at = format_args!("{path}, pixel {i}, {j}");
                c.add(other.channel(b, k), one.channel(a, k), bound, at);
            }
        }
    }
    Ok(())
}
