//! The pass relief: every point of hills and every light against f64, where rounding decides
//! nothing; and the march, which leaves out what the pass has found.

use std::sync::Arc;

use glam::{DQuat, DVec3, UVec3};
use nimbus::gpu::Compiler;
use nimbus::layout::facet::{FacetRecord, NO_LOBE, RegionRecord};
use nimbus::layout::frame::GridRecord;
use nimbus::layout::relief::ReliefNodeRecord;
use nimbus::model::grid::GridSpec;
use nimbus::model::light::Light;
use nimbus::model::material::Brdf;
use nimbus::model::philox::philox4x32_10;
use nimbus::model::terrain::Terrain;
use nimbus::passes::relief::{Push, Relief, ReliefBuffers};
use nimbus::passes::transmit::{Arriving, MarchParams, Transmit, TransmitBuffers};
use nimbus::reference::relief::Ground;

use crate::harness::Gpu;
use crate::lights;
use crate::sums::PLAIN;

/// Facets of other things before the ground's, and a region of such a thing.
const N_BEFORE: u32 = 5;
const N_REGIONS_BEFORE: u32 = 1;

/// Points in rows about the origin, whose coordinates f32 has.
fn hills(n: [u32; 2], step: f64, origin: DVec3, height: impl Fn(f64, f64) -> f64) -> Terrain {
    let place = |k: u32| {
        let middle = |i: u32, n: u32| step * (f64::from(i) - 0.5 * f64::from(n - 1));
        let (x, north) = (middle(k % n[0], n[0]), middle(k / n[0], n[1]));
        DVec3::new(x, height(x, north), -north).as_vec3().as_dvec3()
    };
    let points = Arc::new((0..n[0] * n[1]).map(place).collect());
    Terrain { origin, points, n, ..Terrain::default() }
}

/// Returns a number from 0 to 1.
fn some(x: f64, y: f64) -> f64 {
    let [word, ..] =
        philox4x32_10([1, 2], [(x * 4.0) as i32 as u32, (y * 4.0) as i32 as u32, 0, 0]);
    f64::from(word) / f64::from(u32::MAX)
}

/// Rough hills, and beside them a smaller ground high above.
fn grounds() -> Vec<Terrain> {
    let rough = |x: f64, y: f64| {
        3.0 * (0.31 * x).sin() * (0.23 * y + 0.5).cos() + 0.8 * some(x, y) - 0.01 * x * x
    };
    vec![
        hills([41, 30], 1.0, DVec3::new(64.0, -8.0, 32.0), rough),
        hills([9, 7], 1.5, DVec3::new(56.0, 1.0, 40.0), |x, y| 0.5 * some(x, y)),
    ]
}

/// Returns a lamp just above a triangle.
fn close(terrain: &Terrain) -> Light {
    let [a, b, c, _] = terrain.corners(621).map(|k| terrain.points[k]);
    let position = terrain.origin + (a + b + c) / 3.0 + DVec3::Y * 0.02;
    let position = position.as_vec3().as_dvec3();
    Light::Point { position, intensity: DVec3::ONE, radius: 0.1 }
}

fn suns() -> Vec<Light> {
    let sun = |x: f64, y: f64, z: f64| {
        let direction = DVec3::new(x, y, z).normalize().as_vec3().as_dvec3();
        Light::Directional { direction, irradiance: DVec3::ONE }
    };
    let lamp = |x: f64, y: f64, z: f64| Light::Point {
        position: DVec3::new(x, y, z),
        intensity: DVec3::ONE,
        radius: 0.1,
    };
    vec![
        // Along a row, along a column, between, low, and nearly from above.
        sun(1.0, -0.2, 0.0),
        sun(0.0, -0.3, -1.0),
        sun(-0.7, -0.15, 0.6),
        sun(0.31, -0.02, 0.95),
        sun(0.1, -1.0, 0.05),
        // From below.
        sun(0.2, 0.4, 0.1),
        Light::even_sky(DVec3::ONE, 0.5),
        lamp(70.0, -4.0, 30.0),
        // Just above the middle of a triangle.
        close(&grounds()[0]),
        Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::ZERO },
    ]
}

struct Uploaded {
    points: Vec<FacetRecord>,
    regions: Vec<RegionRecord>,
    nodes: Vec<ReliefNodeRecord>,
}

fn records(terrains: &[Terrain]) -> Uploaded {
    let brdf = Brdf { kd: DVec3::ONE, ks: DVec3::ZERO, ns: 1.0 };
    let mut regions = vec![RegionRecord::default(); N_REGIONS_BEFORE as usize];
    let mut points: Vec<FacetRecord> = vec![];
    for terrain in terrains {
        let i_region = regions.len() as u32;
        let i_first = N_BEFORE + points.len() as u32;
        regions.push(RegionRecord::terrain(terrain, DVec3::ZERO, &brdf, NO_LOBE, i_first));
        points.extend(terrain.facets().map(|f| FacetRecord::terrain(&f, i_region)));
    }
    Uploaded { points, regions, nodes: ReliefNodeRecord::of(terrains) }
}

fn run(
    gpu: &mut Gpu,
    compiler: Option<&Compiler>,
    terrains: &[Terrain],
    lights: &[Light],
) -> Vec<u32> {
    let pass = Relief::new(&gpu.device, compiler.unwrap_or(&gpu.compiler)).expect("relief");
    let Uploaded { points, regions, nodes } = records(terrains);
    let n_total = points.len() * lights.len();
    let push = Push {
        n_points: points.len() as u32,
        n_lights: lights.len() as u32,
        n_grounds: terrains.len() as u32,
        i_first_region: N_REGIONS_BEFORE,
        i_first_ground: N_BEFORE,
    };
    let (points, regions, nodes) = (gpu.upload(&points), gpu.upload(&regions), gpu.upload(&nodes));
    let lights = gpu.upload(&lights::records(lights));
    let hidden = gpu.upload(&vec![9u32; n_total]);
    let buffers = ReliefBuffers {
        ground: &points,
        lights: &lights,
        regions: &regions,
        nodes: &nodes,
        hidden: &hidden,
    };
    gpu.run(|rec| pass.record(rec, &buffers, &push));
    gpu.download(&hidden, n_total)
}

/// Share of a triangle's side within which f32 may decide. Places over an extent of some 20 cells
/// err by 3 · 2⁻²⁴, which is 4e-6 of a cell. The lowest suns lengthen that by 50, and `EDGE` adds
/// 2e-6 · 20.
const UNSURE: f64 = 3e-4;

/// Returns a sun turned a little to both sides: exactly along a row its ways lie between triangles,
/// where sides moved inward hide nothing.
fn turned(light: &Light) -> Vec<Light> {
    match *light {
        Light::Directional { direction, irradiance } => [-1e-3, 1e-3]
            .map(|angle| Light::Directional {
                direction: DQuat::from_rotation_y(angle) * direction,
                irradiance,
            })
            .to_vec(),
        other => vec![other],
    }
}

/// Returns by point and light whether it must be hidden, and whether it may be.
fn truth(terrains: &[Terrain], lights: &[Light]) -> Vec<[bool; 2]> {
    let ground = Ground::new(terrains, DVec3::ZERO);
    let points = terrains.iter().flat_map(|t| t.points.iter().map(|p| t.origin + *p));
    let of = |p: DVec3| {
        let of_light = |light: &Light| {
            let is_dark = light.energy() == DVec3::ZERO;
            let must = turned(light).iter().all(|light| ground.hides(p, light, -UNSURE));
            [must, ground.hides(p, light, UNSURE)].map(|is_hidden| is_hidden && !is_dark)
        };
        lights.iter().map(of_light).collect::<Vec<_>>()
    };
    points.flat_map(of).collect()
}

fn n_wrong(found: &[u32], truth: &[[bool; 2]]) -> usize {
    let is_right = |(found, [must, may]): (&u32, &[bool; 2])| match found {
        0 => !must,
        1 => *may,
        _ => false,
    };
    found.iter().zip(truth).filter(|both| !is_right(*both)).count()
}

#[test]
fn hills_hide_what_they_hide_in_f64() {
    let mut gpu = Gpu::new();
    let (terrains, lights) = (grounds(), suns());
    let (found, truth) = (run(&mut gpu, None, &terrains, &lights), truth(&terrains, &lights));
    assert_eq!(n_wrong(&found, &truth), 0);
    // By light: some is hidden and some is not, except from a sky and a dark light.
    for (l, light) in lights.iter().enumerate() {
        let n = found.iter().skip(l).step_by(lights.len()).filter(|v| **v == 1).count();
        let all = found.len() / lights.len();
        let unsure = truth.iter().skip(l).step_by(lights.len()).filter(|[must, may]| must != may);
        let n_unsure = unsure.count();
        println!("{light:?}: {n} of {all} hidden, {n_unsure} within rounding");
        // Exactly along a row the edges of shadows lie on ways.
        assert!(n_unsure * 20 < all, "{light:?}: {n_unsure}");
        match l {
            6 | 9 => assert_eq!(n, 0),
            // From below: all but edges that the way leaves at once.
            5 => assert!(n * 10 > all * 9, "{n}"),
            _ => assert!(n > 20 && n < all, "{light:?}: {n}"),
        }
    }
    // The small ground shades the large one.
    let alone = run(&mut gpu, None, &terrains[..1], &lights);
    assert!(alone.iter().zip(&found).any(|(a, b)| a < b));
    assert!(alone.iter().zip(&found).all(|(a, b)| a <= b));
}

/// The drawn edge of a shadow, where the interpolation between points is ½, lies within half a
/// column of the true one.
#[test]
fn edges_lie_within_half_a_column() {
    let mut gpu = Gpu::new();
    // A bank 4 high across the rows; the sun in the west with a slope of 0.3 throws a shadow 13.3
    // long, whose end rises with the ground behind.
    let bank = |x: f64, y: f64| {
        4.0 * (-(x + 12.0) * (x + 12.0) / 4.0).exp() + 0.05 * x + 0.4 * (0.5 * y).sin()
    };
    let terrain = hills([49, 21], 1.0, DVec3::ZERO, bank);
    let sun = Light::Directional {
        direction: DVec3::new(1.0, -0.3, 0.0).normalize(),
        irradiance: DVec3::ONE,
    };
    let found = run(&mut gpu, None, std::slice::from_ref(&terrain), &[sun]);
    let ground = Ground::new(std::slice::from_ref(&terrain), DVec3::ZERO);
    let [n_u, n_v] = terrain.n.map(|n| n as usize);
    for row in 0..n_v {
        let points = &terrain.points[row * n_u..][..n_u];
        // East of the bank the shadow ends once.
        let east = (0..n_u).filter(|k| points[*k].x > -10.0);
        let last = east.clone().filter(|k| found[row * n_u + k] == 1).max().expect("a shadow");
        let drawn = 0.5 * (points[last].x + points[last + 1].x);
        // f64 rays from points of the row a hundredth of a column apart.
        let at = |i: i32| {
            let (x, first) = (points[last].x - 2.0 + 0.01 * f64::from(i), last - 2);
            let k = first + (i as usize) / 100;
            points[k].lerp(points[k + 1], x - points[k].x)
        };
        let is_dark = |i: &i32| ground.hides(at(*i) + DVec3::Y * 1e-9, &sun, 0.0);
        let edge = at((1..399).filter(is_dark).max().expect("dark")).x;
        assert!((drawn - edge).abs() <= 0.5 + 0.01, "row {row}: {drawn} for {edge}");
    }
}

#[test]
fn wrong_shaders_are_noticed() {
    let mut gpu = Gpu::new();
    let (terrains, lights) = (grounds(), suns());
    let truth = truth(&terrains, &lights);
    for (from, to) in [
        ("s + t <= 1.0 + slack", "s <= 1.0 + slack && t <= 1.0 + slack"),
        (" && z < way.distance", ""),
        ("leave = is_level ? (is_beside ? -1.0 : leave)", "leave = is_level ? -1.0"),
        ("min(leave, max(a, b))", "min(leave, min(a, b))"),
        ("is_met ? node + 1u : box.end", "node + 2u"),
        ("(i_cell / n + (k >> 1))", "(i_cell / n)"),
        ("d.y < s * u.y + t * v.y", "d.y < 0.0"),
        ("EDGE = 2e-6", "EDGE = -1e-3"),
        ("s >= -slack && t >= -slack && d.y", "s >= -slack && d.y"),
        ("return dives(d, a - c, b - c)", "return false"),
        ("i.wzy, i_own, d, c, b", "i.wyz, i_own, d, c, b"),
        ("light.kind != LIGHT_SKY && any", "any"),
        ("(center - region.center)", "0.0"),
        ("is_lamp ? distance * inverse_extent : distance", "3.4e38"),
        ("light.position - center - own.position", "light.position - own.position"),
    ] {
        let compiler = Gpu::wrong_compiler("relief.comp", from, to);
        let found = run(&mut gpu, Some(&compiler), &terrains, &lights);
        assert!(n_wrong(&found, &truth) > 0, "{to} was not noticed");
    }
}

/// The march leaves out what ground hides, for the ground's points alone.
#[test]
fn the_march_ends_at_ground() {
    let mut gpu = Gpu::new();
    let sun = Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::ONE };
    let sky = Light::even_sky(DVec3::ONE, 0.0);
    let lights = gpu.upload(&lights::records(&[sun, sky]));
    let facets = gpu.upload(&[FacetRecord { i_region: 7, ..Default::default() }; 4]);
    let regions = gpu.upload(&[RegionRecord::default()]);
    let spec = GridSpec { aspect: 1.0, n_cells: UVec3::splat(2), cell: 1.0, low: DVec3::ZERO };
    let density = gpu.upload(&[0.0f32; 8]);
    // Facets 1 and 2 are ground; the sun is hidden from the first of them, the sky from none.
    let hidden = gpu.upload(&[1u32, 0, 0, 0]);
    let march = MarchParams {
        n_facets: 4,
        n_lights: 2,
        n_surfaces: 0,
        step_cells: 1.0,
        forward: 0.0,
        n_under_sky: 4,
        i_first_ground: 1,
        n_ground: 2,
    };
    for (arriving, has_relief, expected) in [
        (Arriving::Share, true, [1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0]),
        (Arriving::ShareAndClouds, true, [1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0]),
        (Arriving::Depth, true, [0.0, 0.0, 1e30, 0.0, 0.0, 0.0, 0.0, 0.0]),
        (Arriving::Share, false, [1.0; 8]),
    ] {
        let pass = Transmit::new(&gpu.device, &gpu.compiler, arriving, &PLAIN.into(), has_relief)
            .expect("transmit");
        let [out, through] = [gpu.buffer::<f32>(8), gpu.buffer::<f32>(8)];
        let buffers = TransmitBuffers {
            facets: &facets,
            lights: &lights,
            regions: &regions,
            density: &density,
            transmittance: &out,
            through: &through,
            hidden: &hidden,
        };
        gpu.run(|rec| pass.record(rec, &buffers, &GridRecord::from(&spec), &march));
        assert_eq!(gpu.download::<f32>(&out, 8), expected, "{arriving:?}");
        if arriving == Arriving::ShareAndClouds {
            assert_eq!(gpu.download::<f32>(&through, 8), expected);
        }
    }
}
