//! The pass place against its f64 reference: one rounding of the offset, one of the sum.

mod harness;

use glam::DVec3;
use harness::{Gpu, assert_within_and_say, check_within};
use nimbus::gpu::Compiler;
use nimbus::layout::particle::{GroupRecord, ParticleRecord, PlacedRecord};
use nimbus::model::cloud::{Cloud, CloudSource, Group, Particle};
use nimbus::passes::place::Place;
use nimbus::reference::generate::{cloud as generated, uniforms};
use nimbus::reference::place::{cloud_centers, offsets, place, placed_bound};
use nimbus::reference::rounding::U_F32;

const TIME_S: f64 = 3600.25;
const ORIGIN: DVec3 = DVec3::new(1_000_123.456, 2000.5, -3e5);

/// Lists of particles, one of them empty, one far from the others; the wind carries them for an hour.
fn clouds() -> Vec<Cloud> {
    let particle = |i: u32, spread: f64| {
        let [a, b, c, d] = uniforms(0x91ace, 0, i, 0);
        let position = spread * (DVec3::new(a, b, c) - 0.5) + 1e4;
        Particle { position, sigma: 0.1 + d, kappa: 1.0, color: DVec3::ONE }
    };
    let cloud = |n: u32, spread: f64, position, wind| Cloud {
        source: CloudSource::Particles((0..n).map(|i| particle(i, spread)).collect()),
        position,
        wind,
        i_material: 0,
        seed: 0,
    };
    vec![
        cloud(1000, 30.0, ORIGIN - 1e4, DVec3::ZERO),
        cloud(0, 1.0, DVec3::ZERO, DVec3::ZERO),
        cloud(1, 5.0, ORIGIN, DVec3::X * 7.3),
        cloud(2500, 4000.0, DVec3::new(1e6, 0.0, -3e5), DVec3::new(-12.0, 0.0, 3.3)),
    ]
}

struct Scene {
    positions: Vec<DVec3>,
    sigmas: Vec<f64>,
    particles: Vec<ParticleRecord>,
    i_group: Vec<u32>,
    groups: Vec<Group>,
    records: Vec<GroupRecord>,
    offsets: Vec<DVec3>,
}

fn scene() -> Scene {
    let clouds = clouds();
    let mut groups = vec![];
    for (i, cloud) in clouds.iter().enumerate() {
        let first = groups.last().map_or(0, |g: &Group| g.i_first + g.n_particles);
        groups.extend(cloud.groups(i, first));
    }
    let given = clouds.iter().flat_map(generated);
    let (positions, sigmas): (Vec<DVec3>, Vec<f64>) = given.map(|g| (g.position, g.sigma)).unzip();
    let list = |c: &Cloud, g: &Group| match &c.source {
        CloudSource::Particles(list) => list.iter().map(|p| ParticleRecord::new(p, g)).collect::<Vec<_>>(),
        CloudSource::Boxes { .. } => vec![],
    };
    let particles = clouds.iter().zip(&groups).flat_map(|(c, g)| list(c, g)).collect();
    let i_group = groups.iter().zip(0..).flat_map(|(g, i)| std::iter::repeat_n(i, g.n_particles as usize)).collect();
    let record = |g: &Group| {
        let cloud = &clouds[g.i_cloud];
        GroupRecord::new(g, cloud.origin_at(TIME_S) - ORIGIN, cloud.center(), DVec3::ONE)
    };
    let records = groups.iter().map(record).collect();
    let offsets = offsets(&groups, &clouds, TIME_S, ORIGIN);
    // What the facets point away from comes from the same origin: the record's own rounding, once.
    let records: Vec<GroupRecord> = records;
    for (r, g) in records.iter().zip(&groups) {
        let center = cloud_centers(&clouds, TIME_S, ORIGIN)[g.i_cloud];
        let off = (glam::Vec3::from_array(r.cloud_center).as_dvec3() - center).abs();
        assert!(off.cmple(U_F32 * center.abs() * (1.0 + 1e-6)).all(), "{off}");
        assert_eq!(r.i_region, g.i_cloud as u32);
    }
    Scene { positions, sigmas, particles, i_group, groups, records, offsets }
}

fn run(gpu: &mut Gpu, compiler: &Compiler, scene: &Scene) -> Vec<PlacedRecord> {
    let pass = Place::new(&gpu.device, compiler).unwrap();
    let n = scene.particles.len();
    let (particles, i_group) = (gpu.upload(&scene.particles), gpu.upload(&scene.i_group));
    let (groups, placed) = (gpu.upload(&scene.records), gpu.buffer::<PlacedRecord>(n));
    gpu.run(|rec| pass.record(rec, [&particles, &i_group, &groups, &placed], n as u32));
    gpu.download(&placed, n)
}

fn flat(v: impl Iterator<Item = DVec3>) -> Vec<f64> {
    v.flat_map(|v| v.to_array()).collect()
}

#[test]
fn placed_positions_are_within_one_rounding_of_offset_and_sum() {
    let mut gpu = Gpu::new();
    let scene = scene();
    let compiler = Compiler::new(nimbus::passes::sources(), None).unwrap();
    let placed = run(&mut gpu, &compiler, &scene);
    let exact = place(&scene.positions, &scene.groups, &scene.offsets);
    let truths = flat(exact.iter().copied());
    // The record rounds a relative position once: u|position|.
    let bound = |i: usize| {
        let own = U_F32 * scene.positions[i].abs();
        placed_bound(own, scene.offsets[scene.i_group[i] as usize], exact[i], U_F32)
    };
    let bounds = flat((0..exact.len()).map(bound));
    let values = |placed: &[PlacedRecord]| flat(placed.iter().map(|p| glam::Vec3::from_array(p.position).as_dvec3()));
    assert_within_and_say("placed", &values(&placed), &truths, &bounds);
    // σ is copied.
    assert!(placed.iter().zip(&scene.sigmas).all(|(p, s)| p.sigma == *s as f32));
    assert_eq!(run(&mut gpu, &compiler, &scene), placed);

    for (from, to) in [("+ groups", "- groups"), ("groups[i_group[i]]", "groups[0]"), (".offset", ".cloud_center")] {
        let wrong = Gpu::wrong_compiler("place.comp", from, to);
        let placed = run(&mut gpu, &wrong, &scene);
        assert!(check_within("wrong", &values(&placed), &truths, &bounds).is_err(), "{to} was not noticed");
    }
}
