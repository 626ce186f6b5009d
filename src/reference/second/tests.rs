//! Numbers worked by hand, and the integrals over the areas.

use glam::UVec3;

use super::*;
use crate::model::surface::Surface;
use crate::reference::area::{Accuracy, Receiver, Scenery};

const SPEC: GridSpec = GridSpec { n_cells: UVec3::ONE, cell: 1.0, low: DVec3::ZERO };
static NO_PAIRINGS: [Vec<Pairing>; 3] = [vec![], vec![], vec![]];
const PAIRS: Pairs = Pairs { size: 0.5, levels: 6, steps: 16 };
const GLOW: Light = Light::Sky { irradiance: DVec3::splat(PI), constant: 1.0 };

fn matte(kd: f64) -> Brdf {
    Brdf { kd: DVec3::splat(kd), ks: DVec3::ZERO, ns: 1.0 }
}

fn exchange<'a>(
    facets: &'a [Facet],
    regions: &'a [Region],
    lights: &'a [Light],
    shares: &'a [[f64; 2]],
) -> Exchange<'a> {
    Exchange {
        facets,
        regions,
        lights,
        shares,
        spec: &SPEC,
        cells: &[0.0],
        forward: 1.0,
        step: 1.0,
        pairs: PAIRS,
        eye: 5.0 * DVec3::Y,
        pairings: &NO_PAIRINGS,
        reach: 4.0,
    }
}

fn disc(position: DVec3, normal: DVec3, area: f64, i_region: usize) -> Facet {
    Facet { position, normal, area, i_region, color: DVec3::ONE }
}

#[test]
fn two_discs_face_to_face() {
    // Area π one above the other: 1/(1 + 1), times L = 1 of a white one under irradiance π, times A = π.
    let facets = [disc(DVec3::ZERO, DVec3::Y, PI, 0), disc(DVec3::Y, DVec3::NEG_Y, PI, 1)];
    let region = || Region { rectangle: None, brdf: matte(1.0), lobe: None };
    let sun = [Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::splat(PI) }];
    let regions = [region(), region()];
    let x = exchange(&facets, &regions, &sun, &[[1.0; 2]; 2]);
    let up = x.gather(1);
    assert!((up.indirect.x - PI / 2.0).abs() < 1e-15 && (up.second.x - 0.5).abs() < 1e-15);
    // The other one is lit from behind.
    assert_eq!(x.gather(0).indirect, DVec3::ZERO);
    // Turned by 60° each about one axis the cosines are ½.
    let tilted = DVec3::new(0.0, 0.5, 0.75f64.sqrt());
    let facets = [disc(DVec3::ZERO, tilted, 1e-6, 0), disc(DVec3::Y, -tilted, 1e-6, 1)];
    let x = exchange(&facets, &regions, &sun, &[[1.0; 2]; 2]);
    assert!((x.gather(1).indirect.x / (0.5 * 1e-6 * 0.25) - 1.0).abs() < 1e-6);
}

fn plane(center: DVec3, u: DVec3, v: DVec3, n: u32) -> Surface {
    Surface { center, u, v, i_material: 0, subdivide: [n, n] }
}

fn of_surfaces(surfaces: &[Surface], brdf: Brdf) -> (Vec<Facet>, Vec<Region>) {
    let regions = surfaces.iter().map(|s| Region { rectangle: Some(Rectangle::new(s, DVec3::ZERO)), brdf, lobe: None });
    let facets = surfaces.iter().enumerate().flat_map(|(i_region, s)| {
        let area = s.area() / s.n_facets() as f64;
        (0..s.n_facets() as u32).map(move |i| disc(s.facet_center(i), s.normal(), area, i_region))
    });
    (facets.collect(), regions.collect())
}

#[test]
fn a_ceiling_has_its_form_factor_and_a_blocker_takes_half() {
    // Howell B-3: from an element to a unit square at unit distance opposite its centre 4/π·A/√(1+A²)·atan(A/√(1+A²)), A = ½.
    let floor = plane(DVec3::ZERO, 1e-3 * DVec3::Z, 1e-3 * DVec3::X, 1);
    let ceiling = plane(DVec3::Y, 0.5 * DVec3::X, 0.5 * DVec3::Z, 8);
    let a = 0.5 / 1.25f64.sqrt();
    let factor = 4.0 * FRAC_1_PI * a * a.atan();
    let (facets, regions) = of_surfaces(&[floor, ceiling], matte(1.0));
    let shares = vec![[0.0, 1.0]; facets.len()];
    let found = exchange(&facets, &regions, &[GLOW], &shares).gather(0);
    // The ceiling faces down: half of nothing above, and the constant share: L = 1. Second derivatives leave (1/8)^4.
    assert!((found.indirect.x / (PI * factor) - 1.0).abs() < 3e-4, "{found:?} {}", PI * factor);
    // Its edge through the axis; cells at the rim are quartered to 1/16 of their distance.
    let blocker = plane(DVec3::new(3.0, 0.5, 0.0), 3.0 * DVec3::X, 9.0 * DVec3::Z, 1);
    let (mut facets, regions) = of_surfaces(&[floor, ceiling, blocker], matte(1.0));
    facets.truncate(65);
    let shares = vec![[0.0, 1.0]; facets.len()];
    let between = [vec![Pairing { i_emitter: 1, occluders: vec![2] }], vec![], vec![]];
    let half = Exchange { pairings: &between, ..exchange(&facets, &regions, &[GLOW], &shares) }.gather(0);
    assert!((half.indirect.x / found.indirect.x - 0.5).abs() < 1e-3, "{half:?}");
}

#[test]
fn a_corner_is_that_of_the_areas() {
    let floor = plane(DVec3::ZERO, DVec3::Z, DVec3::X, 8);
    let wall = plane(DVec3::new(0.0, 1.0, -1.0), DVec3::X, DVec3::Y, 8);
    let sun = [Light::Directional { direction: DVec3::new(0.0, -0.8, -0.6), irradiance: DVec3::ONE }];
    let (facets, regions) = of_surfaces(&[floor, wall], matte(0.5));
    let shares = vec![[1.0; 2]; facets.len()];
    let x = exchange(&facets, &regions, &sun, &shares);
    let truth = Scenery::new(&[floor, wall], &[matte(0.5); 2], &sun, &[], 0.0, &[]);
    for j in [0, 7, 27, 63, 64, 91, 120] {
        let at = Receiver::new(facets[j].position, facets[j].normal, matte(0.5));
        let e = truth.second(&at, at.normal, &Accuracy::relative(1e-7));
        // Nearest cells are at half their distance: fourth order of ½·½, some 3 parts in a thousand.
        let off = (x.gather(j).indirect.x / e.irradiance.x - 1.0).abs();
        assert!(off < 4e-3, "{j} {off}");
    }
}
