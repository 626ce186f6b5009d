//! Scenes that must look like each other: twice the light, turned about, listed in another order,
//! with surfaces cut in two.

use glam::DVec3;

use super::case::{Case, Comparison, Found};
use super::desk::{Desk, Played};
use super::scenes::{DULL, LIT, heap, plate, room, with_particles};
use crate::error::Result;
use crate::model::cloud::{CloudSource, Particle};
use crate::model::light::Light;
use crate::model::scene::Scene;
use crate::model::surface::Surface;
use crate::reference::rounding::U_F32;

pub const CASES: &[Case] = &[
    Case {
        name: "metamorphic/double-light",
        what: "twice the light of every lamp, sun and sky: twice the radiance of every \
            facet and pixel",
        bound: "0",
        run: |desk| brighter(desk, 2.0),
    },
    Case {
        name: "metamorphic/little-light",
        what: "2^-40 of the light: 2^-40 of the radiance",
        bound: "0",
        run: |desk| brighter(desk, 2f64.powi(-40)),
    },
    Case {
        name: "metamorphic/no-light",
        what: "lights without energy: no radiance at all",
        bound: "0",
        run: |desk| brighter(desk, 0.0),
    },
    Case {
        name: "metamorphic/turned",
        what: "all of a room turned by a right angle about what is up: the same light \
            on every facet",
        bound: "256 u of the greatest",
        run: turned,
    },
    Case {
        name: "metamorphic/permuted",
        what: "particles listed in another order: the same light of each, to the bit",
        bound: "0",
        run: permuted,
    },
    Case {
        name: "metamorphic/permuted-picture",
        what: "particles at depths that differ, listed in another order: the same \
            picture, to the byte",
        bound: "0",
        run: permuted_picture,
    },
    Case {
        name: "metamorphic/split",
        what: "a floor cut into two, facets where they were: the same light on every facet",
        bound: "2 % of the greatest: each is within 1 % of the areas' integral",
        run: split,
    },
    Case {
        name: "metamorphic/mirrored",
        what: "a cloud mirrored left to right before a camera in the middle: the mirrored picture",
        bound: "64 u of an opacity, and 2^-22 a layer",
        run: mirrored,
    },
    Case {
        name: "metamorphic/no-particle-more",
        what: "as many particles again, of no optical depth: the same picture, to the byte",
        bound: "0",
        run: nothing_more,
    },
];

/// A corner of two walls and a floor, and a sun and a lamp.
fn corner(desk: &Desk) -> Result<Scene> {
    let lights = "[[light]]\nkind = 'directional'\ndirection = [-0.5, -1, -0.75]\nirradiance = [1, \
        0.75, 0.5]\n\
        [[light]]\nkind = 'point'\nposition = [0.25, 0.5, 0.5]\nintensity = [1, 1, 1]\nradius = \
        0.0625\n\
        [[light]]\nkind = 'sky'\nirradiance = [0.25, 0.25, 0.5]\nconstant = 0.25\n";
    let walls = vec![
        plate([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], 6),
        plate([0.0, 1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 6),
        plate([-1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], 6),
    ];
    room(
        desk,
        "gather = 'exact'",
        lights,
        &format!("{DULL}ks = [0.125, 0.125, 0.125]\nns = 20.0\n"),
        walls,
    )
}

fn cloud(desk: &Desk) -> Result<Scene> {
    let text = LIT.replace("mode = 'first'", "mode = 'two-reflection'\ngather = 'exact'");
    with_particles(desk, &text, heap(120))
}

fn with_light(scene: &Scene, factor: f64) -> Scene {
    let mut scene = scene.clone();
    for light in &mut scene.lights {
        match light {
            Light::Directional { irradiance: e, .. } | Light::Sky { irradiance: e, .. } => {
                *e *= factor
            }
            Light::Point { intensity: e, .. } | Light::Spot { intensity: e, .. } => *e *= factor,
        }
    }
    scene
}

fn brighter(desk: &mut Desk, factor: f64) -> Result<Found> {
    let mut c = Comparison::default();
    for (what, scene) in [("a corner", corner(desk)?), ("a cloud", cloud(desk)?)] {
        // The least bright of all is far above what f32 flushes.
        let (one, other) = (desk.play(&scene, 0)?, desk.play(&with_light(&scene, factor), 0)?);
        for (i, (a, b)) in one.lit.iter().zip(&other.lit).enumerate() {
            for (a, b) in a.first.iter().chain(&a.second).zip(b.first.iter().chain(&b.second)) {
                c.add(f64::from(*b), factor * f64::from(*a), 0.0, || {
                    format!("facet {i} of {what}")
                });
            }
        }
        for (i, (a, b)) in one.rgba.chunks_exact(4).zip(other.rgba.chunks_exact(4)).enumerate() {
            for k in 0..3 {
                c.add(f64::from(b[k]), factor * f64::from(a[k]), 0.0, || {
                    format!("pixel {i} of {what}")
                });
            }
        }
    }
    Ok(c.into())
}

/// By a right angle about y: exact.
fn turn(v: DVec3) -> DVec3 {
    DVec3::new(v.z, v.y, -v.x)
}

fn turned(desk: &mut Desk) -> Result<Found> {
    let scene = corner(desk)?;
    let mut other = scene.clone();
    other.surfaces = scene
        .surfaces
        .iter()
        .map(|s| Surface { center: turn(s.center), u: turn(s.u), v: turn(s.v), ..*s })
        .collect();
    for light in &mut other.lights {
        match light {
            Light::Directional { direction, .. } => *direction = turn(*direction),
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                *position = turn(*position)
            }
            Light::Sky { .. } => {}
        }
    }
    other
        .camera
        .keys
        .iter_mut()
        .for_each(|k| (k.position, k.target) = (turn(k.position), turn(k.target)));
    let (one, other) = (desk.play(&scene, 0)?, desk.play(&other, 0)?);
    let mut c = Comparison::default();
    let light = |p: &Played| {
        p.lit
            .iter()
            .flat_map(|l| l.first.into_iter().chain(l.second))
            .map(f64::from)
            .collect::<Vec<_>>()
    };
    let (one, other) = (light(&one), light(&other));
    let most = one.iter().copied().fold(0.0, f64::max);
    for (i, (a, b)) in one.iter().zip(&other).enumerate() {
        c.add(*b, *a, 256.0 * U_F32 * most, || format!("number {i} of facets' light"));
    }
    Ok(c.into())
}

/// Another order of `n`: a step that has no divisor in common with it.
fn order(n: usize) -> impl Iterator<Item = usize> {
    (0..n).map(move |i| (37 * i + 11) % n)
}

fn permute(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    if let CloudSource::Particles(list) = &mut scene.clouds[0].source {
        let before = list.clone();
        *list = order(before.len()).map(|i| before[i]).collect();
    }
    scene
}

fn permuted(desk: &mut Desk) -> Result<Found> {
    let mut scene = cloud(desk)?;
    scene.lighting.mode = crate::model::scene::LightingMode::First;
    let (one, other) = (desk.play(&scene, 0)?, desk.play(&permute(&scene), 0)?);
    let expected: Vec<_> =
        order(one.lit.len()).map(|i| (one.lit[i].first, one.lit[i].direct)).collect();
    let found: Vec<_> = other.lit.iter().map(|l| (l.first, l.direct)).collect();
    let mut c = Comparison::default();
    c.same(&found, &expected, "light of facets");
    Ok(c.into())
}

fn permuted_picture(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for path in ["sprites", "tiles"] {
        let scene = with_particles(desk, &format!("{LIT}[draw]\npath = '{path}'\n"), heap(120))?;
        let (one, other) = (desk.play(&scene, 0)?, desk.play(&permute(&scene), 0)?);
        c.same(&one.bytes, &other.bytes, &format!("bytes, {path}"));
    }
    Ok(c.into())
}

fn split(desk: &mut Desk) -> Result<Found> {
    let scene = corner(desk)?;
    let mut other = scene.clone();
    let floor = scene.surfaces[0];
    // Along v: halves of 6 x 3 facets.
    let half = |s: f64| Surface {
        center: floor.center + s * 0.5 * floor.v,
        v: 0.5 * floor.v,
        subdivide: [6, 3],
        ..floor
    };
    other.surfaces =
        [half(-1.0), half(1.0)].into_iter().chain(scene.surfaces[1..].iter().copied()).collect();
    let (one, other) = (desk.play(&scene, 0)?, desk.play(&other, 0)?);
    let mut c = Comparison::default();
    let most = one.lit.iter().map(|l| l.second[0]).fold(0.0, f32::max);
    // Which pairs are looked at closely goes by the surfaces' rims, and the cut is one more.
    let bound = 0.02 * f64::from(most);
    for (f, l) in one.facets.iter().zip(&one.lit) {
        let same = |g: &crate::layout::facet::FacetRecord| {
            g.normal == f.normal && (0..3).all(|k| (g.position[k] - f.position[k]).abs() < 1e-5)
        };
        let found = other.facets.iter().position(same);
        c.holds(found.is_some(), || format!("a facet at {:?}", f.position));
        for (a, b) in found.iter().flat_map(|&i| l.second.iter().zip(&other.lit[i].second)) {
            c.add(f64::from(*b), f64::from(*a), bound, || {
                format!("L2 of the facet at {:?}", f.position)
            });
        }
    }
    Ok(c.into())
}

fn mirrored(desk: &mut Desk) -> Result<Found> {
    const N: u32 = 150;
    let mirror = |p: Particle| Particle { position: p.position * DVec3::new(-1.0, 1.0, 1.0), ..p };
    let plain = super::scenes::PLAIN;
    let mut c = Comparison::default();
    for path in ["sprites", "tiles"] {
        // At 8 sigma the step at a sprite's rim is nothing.
        let text = format!("{plain}[draw]\npath = '{path}'\ncutoff = 8\n");
        let one = with_particles(desk, &text, heap(N))?;
        let other = with_particles(desk, &text, heap(N).into_iter().map(mirror).collect())?;
        let (one, other) = (desk.play(&one, 0)?, desk.play(&other, 0)?);
        let (width, height) = (65, 49);
        for j in 0..height {
            for i in 0..width {
                let a = &one.rgba[4 * (j * width + i)..][..4];
                let b = &other.rgba[4 * (j * width + width - 1 - i)..][..4];
                let tau = -(1.0 - f64::from(a[3])).max(1e-7).ln();
                let bound = f64::from(N) * 2f64.powi(-22) + (2e-6 + 64.0 * U_F32) * tau;
                for (a, b) in a.iter().zip(b) {
                    c.add(f64::from(*b), f64::from(*a), bound, || {
                        format!("{path}, pixel {i}, {j}")
                    });
                }
            }
        }
    }
    Ok(c.into())
}

fn nothing_more(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for path in ["sprites", "tiles"] {
        let text = format!("{}[draw]\npath = '{path}'\n", super::scenes::PLAIN);
        // Where others are, so that the scene's bounds stay what they are.
        let all = heap(80);
        let empty = all.iter().map(|p| Particle { kappa: 0.0, color: DVec3::splat(1e6), ..*p });
        let one = with_particles(desk, &text, all.clone())?;
        let other = with_particles(desk, &text, all.iter().copied().chain(empty).collect())?;
        let (one, other) = (desk.play(&one, 0)?, desk.play(&other, 0)?);
        c.same(&one.bytes, &other.bytes, &format!("bytes, {path}"));
        c.same(&one.placed, &other.placed[..one.placed.len()], &format!("places, {path}"));
    }
    Ok(c.into())
}
