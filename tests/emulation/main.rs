//! The emulation of the pass `second` against values worked by hand, and integrals over the areas.

#[path = "cases/edges.rs"]
mod edges;
#[path = "mod.rs"]
mod emulation;
#[path = "cases/rooms.rs"]
mod rooms;
#[path = "cases/tree.rs"]
mod tree;

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec3, UVec3};

use emulation::roundings::U;
use emulation::{Exchange, Facet, Gathered, Region};
use nimbus::model::basis::N_NODES;
use nimbus::model::grid::GridSpec;
use nimbus::model::light::Light;
use nimbus::model::material::Brdf;
use nimbus::model::pairings::{Pairing, pairings};
use nimbus::model::scene::Pairs;
use nimbus::model::surface::Surface;
use nimbus::reference::area::{Accuracy, AreaScene, Receiver};
use nimbus::reference::occlude::Rectangle;

const SPEC: GridSpec = GridSpec { aspect: 1.0, n_cells: UVec3::ONE, cell: 1.0, low: DVec3::ZERO };
const PAIRS: Pairs = Pairs { size: 0.5, levels: 6, steps: 16 };
const GLOW: Light = Light::even_sky(DVec3::splat(PI), 1.0);

fn matte(kd: f64) -> Brdf {
    Brdf { kd: DVec3::splat(kd), ks: DVec3::ZERO, ns: 1.0 }
}

/// Facets, regions and pairings of an exchange.
struct Scene {
    facets: Vec<Facet>,
    regions: Vec<Region>,
    pairings: Vec<Vec<Pairing>>,
}

impl Scene {
    fn of_surfaces(surfaces: &[Surface], brdf: Brdf) -> Scene {
        let region =
            |s| Region { rectangle: Some(Rectangle::new(s, DVec3::ZERO)), brdf, lobe: None };
        let facets = surfaces.iter().enumerate().flat_map(|(i_region, s)| {
            let area = s.area() / s.n_facets() as f64;
            (0..s.n_facets() as u32)
                .map(move |i| disc(s.facet_center(i), s.normal(), area, i_region))
        });
        Scene {
            facets: facets.collect(),
            regions: surfaces.iter().map(region).collect(),
            pairings: pairings(surfaces, 0),
        }
    }

    /// Keeps the facets of the first `n` surfaces. The others only hide.
    fn with_facets_of(mut self, n: usize) -> Scene {
        self.facets.retain(|f| f.i_region < n);
        self
    }

    fn of_discs(facets: &[Facet]) -> Scene {
        let regions = facets
            .iter()
            .map(|_| Region { rectangle: None, brdf: matte(1.0), lobe: None })
            .collect();
        Scene { facets: facets.to_vec(), regions, pairings: pairings(&[], facets.len()) }
    }

    /// Returns the exchange, with `through` for both transmittances.
    fn exchange<'a>(&'a self, lights: &'a [Light], through: &'a [f64]) -> Exchange<'a> {
        Exchange {
            facets: &self.facets,
            regions: &self.regions,
            lights,
            transmittance: through,
            through,
            spec: &SPEC,
            cells: &[0.0],
            forward: 1.0,
            step: 1.0,
            pairs: PAIRS,
            eye: 5.0 * DVec3::Y,
            pairings: &self.pairings,
            reach: 4.0,
        }
    }

    fn gather(&self, lights: &[Light], through: f64, j: usize) -> Gathered {
        at(&self.exchange(lights, &vec![through; self.facets.len() * lights.len()]), j)
    }
}

fn at(exchange: &Exchange, j: usize) -> Gathered {
    exchange.gather(j, &exchange.senders())
}

fn disc(position: DVec3, normal: DVec3, area: f64, i_region: usize) -> Facet {
    Facet { position, normal, area, i_region, color: DVec3::ONE }
}

fn plane(center: DVec3, u: DVec3, v: DVec3, n: u32) -> Surface {
    Surface { center, u, v, i_material: 0, subdivide: [n, n] }
}

/// A small facet at the origin that faces up.
fn eye_on_the_floor() -> Surface {
    plane(DVec3::ZERO, 1e-3 * DVec3::Z, 1e-3 * DVec3::X, 1)
}

#[test]
fn two_discs_face_to_face() {
    // Area π one above the other: 1/(1 + 1), times L = 1 of a white disc under irradiance π, times
    // A = π.
    let facets = [disc(DVec3::ZERO, DVec3::Y, PI, 0), disc(DVec3::Y, DVec3::NEG_Y, PI, 1)];
    let sun = [Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::splat(PI) }];
    let scene = Scene::of_discs(&facets);
    let up = scene.gather(&sun, 1.0, 1);
    assert!((up.indirect.x - PI / 2.0).abs() < 1e-15 && (up.second.x - 0.5).abs() < 1e-15);
    // The other disc is lit from behind.
    assert_eq!(scene.gather(&sun, 1.0, 0).indirect, DVec3::ZERO);
    // Turned by 60° each about one axis, the cosines are ½.
    let tilted = DVec3::new(0.0, 0.5, 0.75f64.sqrt());
    let scene =
        Scene::of_discs(&[disc(DVec3::ZERO, tilted, 1e-6, 0), disc(DVec3::Y, -tilted, 1e-6, 1)]);
    let turned = scene.gather(&sun, 1.0, 1).indirect.x;
    assert!((turned / (0.5 * 1e-6 * 0.25) - 1.0).abs() < 1e-6);
}

/// Howell B-3: from an element to a unit square at unit distance opposite its centre, A = ½.
fn of_a_ceiling() -> f64 {
    let a = 0.5 / 1.25f64.sqrt();
    4.0 * FRAC_1_PI * a * a.atan()
}

#[test]
fn a_ceiling_has_its_form_factor_and_a_blocker_removes_its_share() {
    let ceiling = |n| plane(DVec3::Y, 0.5 * DVec3::X, 0.5 * DVec3::Z, n);
    let found = |surfaces: &[Surface]| {
        Scene::of_surfaces(surfaces, matte(1.0))
            .with_facets_of(2)
            .gather(&[GLOW], 0.0, 0)
            .indirect
            .x
    };
    // The ceiling faces down: it gets nothing from above and the constant share, so L = 1. Second
    // derivatives leave (1/8)^4.
    let open = found(&[eye_on_the_floor(), ceiling(8)]);
    assert!((open / (PI * of_a_ceiling()) - 1.0).abs() < 3e-4, "{open}");
    // One facet as wide as its distance is evaluated at 4 × 4 points. A disc neglects second
    // derivatives of 4 (u·w)²/d² along each axis, u·w = 3/8·1/8 for parts at the edge.
    let points = found(&[eye_on_the_floor(), ceiling(1)]);
    assert!((points / open - 1.0).abs() < 1e-2, "{points} {open}");
    // An edge through the axis, and one at x = 1/40, whose shadow at 1/20 crosses a part of a
    // facet. The edge's move removes the strip between, by values at the centres of parts: cos⁴ is
    // 1 − 2x² there, x = 1/8 of one facet.
    for n in [1, 8] {
        let all = found(&[eye_on_the_floor(), ceiling(n)]);
        let with = |x: f64| {
            let blocker = plane(DVec3::new(3.0 + x, 0.5, 0.0), 3.0 * DVec3::X, 9.0 * DVec3::Z, 1);
            found(&[eye_on_the_floor(), ceiling(n), blocker])
        };
        // Facets that an edge crosses are divided: discs of 1/32² replace the facet's mean.
        assert!((with(0.0) / all - 0.5).abs() < 1e-5, "{n}: {}", with(0.0) / all);
        let strip = plane(DVec3::new(0.025, 1.0, 0.0), 0.025 * DVec3::X, 0.5 * DVec3::Z, 16);
        let strip = found(&[eye_on_the_floor(), strip]);
        let off = (with(0.025) - with(0.0)) / strip - 1.0;
        assert!(off.abs() < 2.5 * (0.125 / f64::from(n)).powi(2) + 1e-3, "{n}: {off}");
    }
}

#[test]
fn an_undivided_facet_is_hidden_by_the_share_of_its_ball() {
    // Half axes 1/100 at distance 2, seen past an edge half way. m = 1/500 in the blocker's plane,
    // where the ball's radius is √2/200: the hidden share is ½ − m·100 = 0.3. As wide as 1/100 of
    // the distance the facet is not divided.
    let facet = plane(2.0 * DVec3::Y, 0.01 * DVec3::X, 0.01 * DVec3::Z, 1);
    let found = |x: f64| {
        let blocker = plane(DVec3::new(1.0 + x, 1.0, 0.0), DVec3::X, DVec3::Z, 1);
        let scene =
            Scene::of_surfaces(&[eye_on_the_floor(), facet, blocker], matte(1.0)).with_facets_of(2);
        scene.gather(&[GLOW], 0.0, 0).indirect.x
    };
    let open = found(0.1);
    assert!(open > 0.0);
    for (x, seen) in [(0.002, 0.7), (0.0, 0.5), (-0.002, 0.3), (-0.0051, 0.0), (0.0051, 1.0)] {
        assert!((found(x) / open - seen).abs() < 1e-9, "{x}: {}", found(x) / open);
    }
}

#[test]
fn a_corner_agrees_with_the_area_reference() {
    let floor = plane(DVec3::ZERO, DVec3::Z, DVec3::X, 8);
    let wall = plane(DVec3::new(0.0, 1.0, -1.0), DVec3::X, DVec3::Y, 8);
    let sun =
        [Light::Directional { direction: DVec3::new(0.0, -0.8, -0.6), irradiance: DVec3::ONE }];
    let scene = Scene::of_surfaces(&[floor, wall], matte(0.5));
    let truth = AreaScene::new(&[floor, wall], &[matte(0.5); 2], &sun, &[], 0.0, &[]);
    for j in [0, 7, 27, 63, 64, 91, 120] {
        let at = Receiver::new(scene.facets[j].position, scene.facets[j].normal, matte(0.5));
        let e = truth.second(&at, at.normal, &Accuracy::relative(1e-7));
        // Undivided facets are at most half as wide as their distance: fourth order of ½·½, some 3
        // parts in a thousand. Parts, at most 3/8 and some nearer a half, are discs: 4 (u·w)²/d² =
        // 4/16² at their widest.
        let off = (scene.gather(&sun, 1.0, j).indirect.x / e.irradiance.x - 1.0).abs();
        assert!(off < 1.5e-2, "{j} {off}");
    }
}

#[test]
fn rectangles_in_a_plane_hide_nothing_of_it() {
    let ceiling = plane(DVec3::Y, 0.5 * DVec3::X, 0.5 * DVec3::Z, 2);
    let found = |more: &[Surface]| {
        let surfaces = [&[eye_on_the_floor(), ceiling], more].concat();
        Scene::of_surfaces(&surfaces, matte(1.0)).with_facets_of(2).gather(&[GLOW], 0.0, 0)
    };
    let alone = found(&[]);
    assert!(alone.indirect.x > 0.0);
    // A rectangle over half of the ceiling, in its plane and within f32's rounding of it; and one
    // in the receiver's plane.
    for off in [0.0, 1e-7, -1e-7] {
        let lies = plane(DVec3::new(0.5, 1.0 + off, 0.0), 0.5 * DVec3::X, DVec3::Z, 1);
        // The rectangle only causes the ceiling to be divided; undivided facets half as wide as
        // their distance are right to some 3 parts in a thousand.
        assert!((found(&[lies]).indirect.x / alone.indirect.x - 1.0).abs() < 3e-3, "{off}");
        let wall = plane(DVec3::new(off, 0.5, 0.0), DVec3::Y, DVec3::Z, 1);
        let clear = (found(&[wall]).indirect.x / alone.indirect.x - 1.0).abs();
        // A rectangle through the receiver has no side from which it could hide. Its shadow of the
        // sky causes the ceiling to be divided.
        assert!(clear < 3e-3, "{off}: {clear}");
    }
    // A thousandth before the ceiling the rectangle hides half, less the part seen past its edge: a
    // hundredth of the half width.
    let before = plane(DVec3::new(0.5, 0.999, 0.0), 0.5 * DVec3::X, DVec3::Z, 1);
    assert!((found(&[before]).indirect.x / alone.indirect.x - 0.5).abs() < 1e-3);
}

#[test]
fn cells_too_wide_at_the_last_level_are_counted() {
    // A receiver 1/50 below a ceiling of width 1 is 50 times too near; quartered it is 4 × 25.
    let ceiling = plane(0.02 * DVec3::Y, 0.5 * DVec3::X, 0.5 * DVec3::Z, 1);
    let scene = Scene::of_surfaces(&[eye_on_the_floor(), ceiling], matte(1.0));
    let found = |levels| {
        let pairs = Pairs { levels, ..PAIRS };
        at(&Exchange { pairs, ..scene.exchange(&[GLOW], &[0.0; 2]) }, 0)
    };
    // Quarters' centres are at 0.354: half a width over that is 1.41, below 1.5 for all four.
    assert_eq!([0, 1].map(|l| found(l).n_unresolved), [1.0, 0.0]);
    assert_eq!(found(6).n_doubted, 0.0);
    // At pair_size 1/8 quarters are divided again. Of 16 the innermost four at 0.177 are 1.41 wide,
    // those at the edges' middle (1/8, 3/8) 0.63 and the corners 0.47, all more than 3/8.
    let pairs = Pairs { size: 0.125, levels: 2, ..PAIRS };
    let fine = at(&Exchange { pairs, ..scene.exchange(&[GLOW], &[0.0; 2]) }, 0);
    assert_eq!(fine.n_unresolved, 16.0);
}

#[test]
fn lobes_within_reach_divide_wide_cells() {
    // 0.3 wide at distance 1, with the receiver's half vector `alpha` off its normal; or the
    // emitter's, by a sun.
    let ceiling = plane(DVec3::Y, 0.15 * DVec3::X, 0.15 * DVec3::Z, 1);
    let count = |i_glossy: usize, ns: f64, alpha: f64| {
        let mut scene = Scene::of_surfaces(&[eye_on_the_floor(), ceiling], matte(1.0));
        scene.regions[i_glossy].brdf = Brdf { kd: DVec3::ZERO, ks: DVec3::ONE, ns };
        scene.regions[i_glossy].lobe = Some(vec![1.0; N_NODES]);
        let toward = DVec3::new((2.0 * alpha).sin(), (2.0 * alpha).cos(), 0.0);
        let direction = if i_glossy == 1 { DVec3::new(toward.x, toward.y, 0.0) } else { DVec3::Y };
        let sun = [Light::Directional { direction, irradiance: DVec3::ONE }];
        let (eye, pairs) = (9.0 * toward, Pairs { levels: 0, ..PAIRS });
        at(&Exchange { eye, pairs, ..scene.exchange(&sun, &[1.0; 2]) }, 0).n_unresolved
    };
    for i in [0, 1] {
        // 4.5·½/√56.25 is 0.3, so that cells are divided from there on. A lobe is met nearer than
        // 0.75·0.3 + 4/√100 = 0.625, a chord of 0.6357.
        assert_eq!([56.0, 56.5].map(|ns| count(i, ns, 0.0)), [0.0, 1.0], "{i}");
        assert_eq!([0.63, 0.64].map(|alpha| count(i, 100.0, alpha)), [1.0, 0.0], "{i}");
    }
}
