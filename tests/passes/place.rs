//! The pass place against its f64 reference: one rounding of the offset, one of the sum.

use crate::harness::{Gpu, assert_within_and_say, check_within};
use glam::DVec3;
use nimbus::gpu::Compiler;
use nimbus::layout::particle::{GroupRecord, ModeRecord, ParticleRecord, PlacedRecord};
use nimbus::model::cloud::{Cloud, CloudSource, Group, Particle, Shape};
use nimbus::model::growth::Growth;
use nimbus::model::gust::Gust;
use nimbus::model::texture::Texture;
use nimbus::passes::place::{Place, PlaceBuffers};
use nimbus::reference::generate::uniforms;
use nimbus::reference::live;
use nimbus::reference::place::{add_gusts, cloud_centers, grown, offsets, place, placed_bound};
use nimbus::reference::rounding::{REDUCTION_ERROR, SINE_ERROR, U_F32};

const TIME_S: f64 = 3600.25;
const ORIGIN: DVec3 = DVec3::new(1_000_123.456, 2000.5, -3e5);

/// Lists of particles, one of them empty, one far from the others; the wind carries them for an
/// hour.
fn clouds(gust: Gust, growth: Growth) -> Vec<Cloud> {
    let particle = |i: u32, spread: f64| {
        let [a, b, c, d] = uniforms(0x91ace, 0, i, 0);
        let position = spread * (DVec3::new(a, b, c) - 0.5) + 1e4;
        Particle { shape: Shape::BALL, position, sigma: 0.1 + d, kappa: 1.0, color: DVec3::ONE }
    };
    let cloud = |n: u32, spread: f64, position, wind| Cloud {
        facing: nimbus::model::cloud::Facing::Outward,
        source: CloudSource::Particles((0..n).map(|i| particle(i, spread)).collect()),
        position,
        wind,
        gust,
        growth,
        texture: Texture::NONE,
        i_material: 0,
        seed: 5,
    };
    vec![
        cloud(1000, 30.0, ORIGIN - 1e4, DVec3::ZERO),
        cloud(0, 1.0, DVec3::ZERO, DVec3::ZERO),
        cloud(1, 5.0, ORIGIN, DVec3::X * 7.3),
        cloud(2500, 4000.0, DVec3::new(1e6, 0.0, -3e5), DVec3::new(-12.0, 0.0, 3.3)),
    ]
}

struct Scene {
    clouds: Vec<Cloud>,
    modes: Vec<ModeRecord>,
    positions: Vec<DVec3>,
    sigmas: Vec<f64>,
    particles: Vec<ParticleRecord>,
    i_group: Vec<u32>,
    groups: Vec<Group>,
    records: Vec<GroupRecord>,
    offsets: Vec<DVec3>,
}

fn scene(gust: Gust, growth: Growth) -> Scene {
    let clouds = clouds(gust, growth);
    let mut groups = vec![];
    for (i, cloud) in clouds.iter().enumerate() {
        let first = groups.last().map_or(0, |g: &Group| g.i_first + g.n_particles);
        groups.extend(cloud.groups(i, first));
    }
    let given: Vec<_> = clouds.iter().flat_map(|c| live::cloud(c, 0.0)).collect();
    let given = grown(&given, &groups, &clouds, TIME_S).into_iter();
    let (positions, sigmas): (Vec<DVec3>, Vec<f64>) = given.map(|g| (g.position, g.sigma)).unzip();
    let list = |c: &Cloud, g: &Group| match &c.source {
        CloudSource::Particles(list) => {
            list.iter().map(|p| ParticleRecord::new(p, g)).collect::<Vec<_>>()
        }
        CloudSource::Boxes { .. } | CloudSource::Disc(_) | CloudSource::Animated(_) => vec![],
    };
    let particles = clouds.iter().zip(&groups).flat_map(|(c, g)| list(c, g)).collect();
    let i_group = groups
        .iter()
        .zip(0..)
        .flat_map(|(g, i)| std::iter::repeat_n(i, g.n_particles as usize))
        .collect();
    let record = |g: &Group| {
        let cloud = &clouds[g.i_cloud];
        let n_modes = cloud.gust.modes(cloud.seed).len() as u32;
        let modes = (g.i_cloud as u32 * n_modes, n_modes);
        let grown = g.grown(cloud.growth.at(TIME_S));
        GroupRecord::new(&grown, g.i_cloud as u32, cloud.origin_at(TIME_S) - ORIGIN, modes)
    };
    let records = groups.iter().map(record).collect();
    let offsets = offsets(&groups, &clouds, TIME_S, ORIGIN);
    // The point that facets face away from has the same origin: the record's own rounding, once.
    let records: Vec<GroupRecord> = records;
    for (r, g) in records.iter().zip(&groups) {
        let center = cloud_centers(&clouds, TIME_S, ORIGIN)[g.i_cloud];
        let off = (glam::Vec3::from_array(r.cloud_center).as_dvec3() - center).abs();
        assert!(off.cmple(U_F32 * center.abs() * (1.0 + 1e-6)).all(), "{off}");
        assert_eq!(r.i_region, g.i_cloud as u32);
    }
    let waves = |c: &Cloud| {
        c.gust.modes(c.seed).iter().map(|m| ModeRecord::new(m, TIME_S)).collect::<Vec<_>>()
    };
    let modes = clouds.iter().flat_map(waves).collect();
    Scene { clouds, modes, positions, sigmas, particles, i_group, groups, records, offsets }
}

fn run(gpu: &mut Gpu, compiler: &Compiler, scene: &Scene) -> Vec<PlacedRecord> {
    let pass = Place::new(&gpu.device, compiler).unwrap();
    let n = scene.particles.len();
    let (particles, i_group) = (gpu.upload(&scene.particles), gpu.upload(&scene.i_group));
    // A buffer holds at least one record, also where there is no wind.
    let modes =
        if scene.modes.is_empty() { gpu.buffer::<ModeRecord>(1) } else { gpu.upload(&scene.modes) };
    let (groups, placed) = (gpu.upload(&scene.records), gpu.buffer::<PlacedRecord>(n));
    let buffers = PlaceBuffers {
        particles: &particles,
        i_group: &i_group,
        groups: &groups,
        modes: &modes,
        placed: &placed,
    };
    gpu.run(|rec| pass.record(rec, &buffers, n as u32));
    gpu.download(&placed, n)
}

fn flat(v: impl Iterator<Item = DVec3>) -> Vec<f64> {
    v.flat_map(|v| v.to_array()).collect()
}

#[test]
fn placed_positions_are_within_one_rounding_of_offset_and_sum() {
    let mut gpu = Gpu::new();
    let scene = scene(Gust::CALM, Growth::NONE);
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
    let values = |placed: &[PlacedRecord]| {
        flat(placed.iter().map(|p| glam::Vec3::from_array(p.position).as_dvec3()))
    };
    assert_within_and_say("placed", &values(&placed), &truths, &bounds);
    // σ times 1.
    assert!(placed.iter().zip(&scene.sigmas).all(|(p, s)| p.sigma == *s as f32));
    assert_eq!(run(&mut gpu, &compiler, &scene), placed);

    for (from, to) in [
        ("+ group.offset", "- group.offset"),
        ("groups[i_group[i]]", "groups[0]"),
        (".offset", ".cloud_center"),
    ] {
        let wrong = Gpu::wrong_compiler("place.comp", from, to);
        let placed = run(&mut gpu, &wrong, &scene);
        assert!(
            check_within("wrong", &values(&placed), &truths, &bounds).is_err(),
            "{to} was not noticed"
        );
    }
}

/// Bound on the f32 error of the gusts' displacement of particle `i`, alike on every axis. A wave's
/// argument k·x + phase: x is the rounded position plus the rounded centre, rounded; k rounds once
/// and the scalar product five times; the phase rounds once, the sum once. Then the reduction and
/// the sine, the product with a rounded a, and a running sum of 16.
fn gust_bound(scene: &Scene, i: usize) -> f64 {
    let group = &scene.groups[scene.i_group[i] as usize];
    let cloud = &scene.clouds[group.i_cloud];
    let center = group.grown(cloud.growth.at(TIME_S)).center;
    let x = scene.positions[i] + center;
    let dx = rest_bound(scene, i) + U_F32 * (center.abs() + x.abs());
    let wave = |m: &nimbus::model::gust::Mode| {
        let (k, phase) = (m.k.abs(), m.phase_at(TIME_S));
        let kx = k.dot(x.abs());
        let argument = k.dot(dx) + 6.0 * U_F32 * kx + U_F32 * phase + U_F32 * (kx + phase);
        let sine = SINE_ERROR + argument + REDUCTION_ERROR * U_F32 * (kx + phase);
        m.a.length() * (sine + 2.0 * U_F32)
    };
    let modes = cloud.gust.modes(cloud.seed);
    let sum: f64 = modes.iter().map(|m| m.a.length()).sum();
    (modes.iter().map(wave).sum::<f64>() + modes.len() as f64 * U_F32 * sum) * (1.0 + 1e-4)
}

#[test]
fn gusts_move_particles_as_their_closed_form_says() {
    let mut gpu = Gpu::new();
    // After an hour the second has grown to 2.9975.
    for growth in [Growth::NONE, Growth { to: 3.0, time_s: 540.0 }] {
        gusts(&mut gpu, growth);
    }
}

fn gusts(gpu: &mut Gpu, growth: Growth) {
    let scene = scene(Gust { amplitude: 0.4, length: 3.0, period_s: 7.0, n_waves: 16 }, growth);
    let compiler = Compiler::new(nimbus::passes::sources(), None).unwrap();
    let mut exact = place(&scene.positions, &scene.groups, &scene.offsets);
    let still = exact.clone();
    add_gusts(&mut exact, &scene.positions, &scene.groups, &scene.clouds, TIME_S);
    assert!(
        exact.iter().zip(&still).filter(|(a, b)| a.distance(**b) > 0.05).count() > exact.len() / 2
    );
    let bound = |i: usize| {
        let inherited = placed_bound(
            rest_bound(&scene, i),
            scene.offsets[scene.i_group[i] as usize],
            still[i],
            U_F32,
        );
        // One more sum, rounded.
        inherited + gust_bound(&scene, i) + U_F32 * (exact[i].abs() + 1.0)
    };
    let bounds = flat((0..exact.len()).map(bound));
    let truths = flat(exact.iter().copied());
    let values = |placed: &[PlacedRecord]| {
        flat(placed.iter().map(|p| glam::Vec3::from_array(p.position).as_dvec3()))
    };
    let placed = run(gpu, &compiler, &scene);
    assert_within_and_say("gusts", &values(&placed), &truths, &bounds);
    let sigmas: Vec<f64> = placed.iter().map(|p| f64::from(p.sigma)).collect();
    // Rounded itself, as its factor and as their product.
    let of_sigmas: Vec<f64> = scene.sigmas.iter().map(|s| 3.01 * U_F32 * s).collect();
    assert_within_and_say("sigma", &sigmas, &scene.sigmas, &of_sigmas);
    // At 10⁴ units from its origin a particle's own f32 rounding decides much of its phase; nearer
    // it does not.
    let mut wrong = vec![("+ modes[m].phase", "- modes[m].phase")];
    if !growth.is_none() {
        wrong.push(("particle.position * group.scale", "particle.position"));
        wrong.push(("particle.sigma * group.scale", "particle.sigma"));
    }
    for (from, to) in wrong {
        let placed = run(gpu, &Gpu::wrong_compiler("place.comp", from, to), &scene);
        let sigmas: Vec<f64> = placed.iter().map(|p| f64::from(p.sigma)).collect();
        let off = check_within("wrong", &values(&placed), &truths, &bounds).is_err()
            || check_within("wrong", &sigmas, &scene.sigmas, &of_sigmas).is_err();
        assert!(off, "{to} was not noticed");
    }
}

/// Bound on the error of a position relative to its group: the record's rounding, and where the
/// cloud has grown that of the scale and of the product.
fn rest_bound(scene: &Scene, i: usize) -> DVec3 {
    let grows = !scene.clouds[scene.groups[scene.i_group[i] as usize].i_cloud].growth.is_none();
    (if grows { 3.01 } else { 1.0 }) * U_F32 * scene.positions[i].abs()
}
