//! The pass live against its f64 reference: whole buffers, every particle at its own bound.

use crate::bounded::Bounded;
use crate::harness::{Gpu, assert_within_and_say, check_within};
use glam::{DVec3, Vec3};
use nimbus::gpu::Compiler;
use nimbus::layout::disc::DiscRecord;
use nimbus::layout::particle::ParticleRecord;
use nimbus::model::cloud::{Cloud, CloudSource, Group};
use nimbus::model::disc::{Condensation, Dilution, Disc};
use nimbus::model::growth::Growth;
use nimbus::model::gust::Gust;
use nimbus::model::texture::Texture;
use nimbus::passes::live::Live;
use nimbus::reference::live::{LiveParticle, alive};
use nimbus::reference::rounding::{DIVISION_ERROR, U_F32};

/// A plume: everything varies, wind and all.
fn plume(n_particles: u32, dilution: Dilution) -> Disc {
    Disc {
        n_particles,
        radius: 2.5,
        period_s: 37.3,
        life_spread: 0.6,
        sigma: 0.3,
        sigma_spread: 0.5,
        optical_depth: 0.9,
        warmth: 1.3,
        warmth_spread: 0.7,
        core: 0.8,
        buoyancy: 0.6,
        cooling_s: 11.0,
        outflow: 0.15,
        entrainment: 0.2,
        dilution,
        fade_in: 0.15,
        fade_out: 0.35,
        condensation: Some(Condensation { base: 1.2, over: 0.7, lift: 0.4 }),
    }
}

/// Three clouds: a plume in the wind, one without a base that is diluted otherwise and far off, one
/// that does nothing but stand.
fn clouds() -> Vec<Cloud> {
    let cloud = |disc, wind, position| Cloud {
        facing: nimbus::model::cloud::Facing::Outward,
        source: CloudSource::Disc(disc),
        position,
        wind,
        gust: Gust::CALM,
        growth: Growth::NONE,
        texture: Texture::NONE,
        i_material: 0,
        seed: 7,
    };
    let plain = Disc { condensation: None, period_s: 0.013, ..plume(3000, Dilution::Mass) };
    let still = Disc {
        buoyancy: 0.0,
        outflow: 0.0,
        radius: 0.0,
        cooling_s: 1e-3,
        ..plume(70, Dilution::None)
    };
    vec![
        cloud(plume(20_000, Dilution::Depth), DVec3::new(0.7, -0.02, 0.3), DVec3::ZERO),
        cloud(plain, DVec3::new(-90.0, 0.0, 0.0), DVec3::splat(1e6)),
        cloud(still, DVec3::ZERO, DVec3::Y),
    ]
}

fn groups(clouds: &[Cloud]) -> Vec<Group> {
    let mut groups: Vec<Group> = vec![];
    for (i, cloud) in clouds.iter().enumerate() {
        let first = groups.last().map_or(0, |g| g.i_first + g.n_particles);
        groups.extend(cloud.groups(i, first));
    }
    groups
}

fn disc_of(cloud: &Cloud) -> &Disc {
    let CloudSource::Disc(disc) = &cloud.source else { panic!("no disc") };
    disc
}

fn run(gpu: &mut Gpu, compiler: &Compiler, clouds: &[Cloud], time_s: f64) -> Vec<ParticleRecord> {
    let pass = Live::new(&gpu.device, compiler).unwrap();
    let groups = groups(clouds);
    let of = |(c, g): (&Cloud, &Group)| {
        DiscRecord::new(disc_of(c), g, c.seed, c.wind, disc_of(c).cycle_at(time_s))
    };
    let records: Vec<DiscRecord> = clouds.iter().zip(&groups).map(of).collect();
    let n = groups.iter().map(|g| g.n_particles as usize).sum();
    let (discs, particles) = (gpu.upload(&records), gpu.buffer::<ParticleRecord>(n));
    gpu.run(|rec| {
        let mut each = (0..).zip(&groups);
        each.try_for_each(|(i, g)| pass.record(rec, [&discs, &particles], i, g.n_particles))
    });
    gpu.download(&particles, n)
}

/// The shader's evaluation of a particle, operation by operation, each with its rounding: position
/// by axis, σ, κ.
fn bounds(cloud: &Cloud, group: &Group, p: &LiveParticle) -> ([Bounded; 3], Bounded, Bounded) {
    let (d, once, exact) = (disc_of(cloud), Bounded::once, Bounded::exact);
    let one = exact(1.0);
    // 2u − 1 of 24 bits is exact.
    let about_1 = |spread: f64, u: f64| one.plus(once(spread).times(exact(2.0 * u - 1.0)));
    let life = one.minus(once(d.life_spread).times(exact(p.u[4])));
    // Both numbers of 24 and 8 bits are exact, their sum rounds.
    let share = once(p.age.share);
    let spent = if p.lived < 1.0 { share } else { life };
    // The time is in units of 2⁻³² of the period in both; the lesser of the two errs by no more
    // than the worse.
    let spent = Bounded { value: spent.value, error: share.error.max(life.error) };
    let cooled = one_minus_exp(spent.times(once(d.period_s / d.cooling_s)));
    let warm = about_1(d.warmth_spread, p.u[3]).times(one.minus(once(d.core).times(exact(p.u[0]))));
    let rise = once(d.rise()).times(warm).times(cooled);
    let birth = on_disc(p.u[0], p.u[1]).map(|x| once(d.radius).times(x));
    let spread = once(d.outflow * d.cooling_s).times(cooled);
    let out = on_disc(p.u[5], p.u[6]).map(|x| spread.times(x));
    let drift = (cloud.wind * d.period_s).to_array().map(|w| spent.times(once(w)));
    let position = [
        drift[0].plus(birth[0].plus(out[0])),
        drift[1].plus(rise),
        drift[2].plus(birth[1].plus(out[1])),
    ];
    let relative = [0, 1, 2].map(|k| position[k].minus(once(group.center[k])));

    let born = once(d.sigma).times(about_1(d.sigma_spread, p.u[2]));
    let sigma = born.plus(once(d.growth()).times(rise));
    let thinner = born.over(sigma);
    let diluted = match d.dilution {
        Dilution::Mass => thinner.times(thinner).times(thinner),
        Dilution::Depth => thinner,
        Dilution::None => one,
    };
    let lived = spent.over(life);
    let (fade_in, fade_out) = (once(1.0 / d.fade_in), once(1.0 / d.fade_out));
    let faded = smooth(lived.times(fade_in)).times(smooth(one.minus(lived).times(fade_out)));
    let condensed = d.condensation.map_or(one, |c| {
        let lift = once(c.lift * d.warmth).times(warm).times(one.minus(cooled));
        smooth(position[1].minus(once(c.base)).minus(lift).times(once(1.0 / c.over)))
    });
    (relative, sigma, once(d.kappa()).times(diluted).times(faded).times(condensed))
}

/// functions.glsl: 1 − e^−t to a share of 3.5e-7, whose slope is e^−t ≤ 1.
fn one_minus_exp(t: Bounded) -> Bounded {
    let value = -(-t.value).exp_m1();
    let inherited = t.error * (-(t.value - t.error).max(0.0)).exp();
    Bounded { value, error: inherited + 3.5e-7 * (value + inherited) }
}

/// √u (cos, sin) 2πu': u · inversesqrt of 2 ulp, and functions.glsl's unit_at, each within 10 u.
fn on_disc(u: f64, turns: f64) -> [Bounded; 2] {
    let root = Bounded { value: u.sqrt(), error: 5.01 * U_F32 * u.sqrt() };
    let angle = std::f64::consts::TAU * turns;
    [angle.cos(), angle.sin()].map(|v| root.times(Bounded { value: v, error: 10.0 * U_F32 }))
}

/// w² (3 − 2w): the square's error is twice w's, as a share; 3 − 2w is rounded once.
fn smooth(v: Bounded) -> Bounded {
    let w = v.within_0_and_1();
    let value = w.value * w.value * (3.0 - 2.0 * w.value);
    // |6w(1 − w)| ≤ 3/2, and a parabola's curvature 6 with it: 6 e²/2 more.
    let inherited = 6.0 * w.value * (1.0 - w.value) * w.error + 3.0 * w.error * w.error;
    Bounded { value, error: inherited + 4.0 * U_F32 * (value + inherited) }
}

#[derive(Default)]
struct Compared {
    values: Vec<f64>,
    truths: Vec<f64>,
    bounds: Vec<f64>,
}

impl Compared {
    fn add(&mut self, value: f32, truth: f64, bounded: Bounded) {
        // The bound's own evaluation follows the shader's; that it is of the reference's number is
        // part of the test.
        assert!(
            (bounded.value - truth).abs() <= 1e-9 * (1.0 + truth.abs()),
            "{bounded:?} is not of {truth}"
        );
        self.values.push(f64::from(value));
        self.truths.push(truth);
        self.bounds.push(bounded.error);
    }
}

/// Position, σ and κ of all particles beside the reference's.
fn compare(clouds: &[Cloud], made: &[ParticleRecord], time_s: f64) -> [Compared; 3] {
    let mut compared = <[Compared; 3]>::default();
    for (cloud, group) in clouds.iter().zip(groups(clouds)) {
        for i in 0..group.n_particles {
            let truth = alive(disc_of(cloud), cloud.seed, cloud.wind, i, time_s);
            let (position, sigma, kappa) = bounds(cloud, &group, &truth);
            let record = &made[(group.i_first + i) as usize];
            assert_eq!(record.color, [1.0; 3]);
            for (axis, bounded) in position.into_iter().enumerate() {
                let exact = truth.position[axis] - group.center[axis];
                compared[0].add(record.position[axis], exact, bounded);
            }
            compared[1].add(record.sigma, truth.sigmas[1], sigma);
            compared[2].add(record.kappa, truth.kappa, kappa);
        }
    }
    compared
}

/// From before the beginning to two weeks after it.
const TIMES: [f64; 5] = [-1234.5, 0.0, 12.34, 1e6, 1e6 + 17.7];

#[test]
fn particles_live_as_the_reference_says_at_any_time() {
    // The reference and Bounded count a division alike.
    assert_eq!(DIVISION_ERROR, 5.0);
    let mut gpu = Gpu::new();
    let compiler = Compiler::new(nimbus::passes::sources(), None).unwrap();
    let clouds = clouds();
    for time_s in TIMES {
        let made = run(&mut gpu, &compiler, &clouds, time_s);
        for (what, c) in ["position", "sigma", "kappa"].iter().zip(compare(&clouds, &made, time_s))
        {
            assert_within_and_say(
                &format!("{what} at {time_s} s"),
                &c.values,
                &c.truths,
                &c.bounds,
            );
        }
        // The same again is the same bytes.
        assert_eq!(run(&mut gpu, &compiler, &clouds, time_s), made);
    }
}

#[test]
fn the_bounds_at_a_million_seconds_are_those_at_the_start() {
    let clouds = clouds();
    let widest = |time_s: f64| {
        let mut widest = [0.0f64; 3];
        for (cloud, group) in clouds.iter().zip(groups(&clouds)) {
            for i in 0..group.n_particles {
                let (position, sigma, kappa) = bounds(
                    cloud,
                    &group,
                    &alive(disc_of(cloud), cloud.seed, cloud.wind, i, time_s),
                );
                let position = position.iter().map(|p| p.error).fold(0.0, f64::max);
                widest = [
                    widest[0].max(position),
                    widest[1].max(sigma.error),
                    widest[2].max(kappa.error),
                ];
            }
        }
        widest
    };
    let (start, late) = (widest(0.0), widest(1e6));
    for (a, b) in start.iter().zip(late) {
        assert!(b < 1.25 * a && *a < 1.25 * b, "{start:?} {late:?}");
    }
    println!("greatest bounds of position, sigma, kappa: {start:?} at 0 s, {late:?} at 1e6 s");
}

#[test]
fn wrong_lives_are_noticed() {
    let mut gpu = Gpu::new();
    let (clouds, time_s) = (clouds(), 1e6);
    let variants = [
        ("bitfieldReverse(slot)", "slot"),
        ("(phase < d.phase ? 1u : 0u)", "0u"),
        ("1.0 - d.core * u.x", "1.0"),
        ("d.outflow * cooled", "d.outflow * spent"),
        ("spent * d.drift", "vec3(0.0)"),
        ("d.growth * rise", "d.growth"),
        ("thinner * thinner * thinner", "thinner * thinner"),
        ("smooth_rise((1.0 - lived)", "smooth_rise((1.001 - lived)"),
        ("d.lift * warm * (1.0 - cooled)", "d.lift * warm"),
        (", life);", ", 1.0);"),
        ("- d.center", ""),
        ("generation, k, STREAM)", "0, k, STREAM)"),
    ];
    for (from, to) in variants {
        let made = run(&mut gpu, &Gpu::wrong_compiler("live.comp", from, to), &clouds, time_s);
        let mut compared = compare(&clouds, &made, time_s).into_iter();
        let wrong = compared.any(|c| check_within("", &c.values, &c.truths, &c.bounds).is_err());
        assert!(wrong, "{from} as {to} was not noticed");
    }
}

#[test]
fn all_particles_lie_within_their_groups_bounds() {
    let mut gpu = Gpu::new();
    let compiler = Compiler::new(nimbus::passes::sources(), None).unwrap();
    let clouds = clouds();
    let groups = groups(&clouds);
    for time_s in [0.0, 7.7, 33.0, 1e6] {
        let made = run(&mut gpu, &compiler, &clouds, time_s);
        for g in &groups {
            for p in &made[g.i_first as usize..(g.i_first + g.n_particles) as usize] {
                let place = Vec3::from(p.position).as_dvec3().abs();
                // f32's own rounding of what lies on the bound.
                let room = 8.0 * U_F32;
                assert!(
                    place.cmple(g.half_extent + room * (g.half_extent + g.center.abs())).all(),
                    "{place} {g:?}"
                );
                assert!(f64::from(p.sigma) <= g.sigma_max * (1.0 + room) && p.sigma > 0.0);
                assert!(f64::from(p.kappa) <= g.kappa_max * (1.0 + room) && p.kappa >= 0.0);
                let mass = nimbus::model::cloud::mass(f64::from(p.kappa), f64::from(p.sigma));
                assert!(mass <= g.mass_max * (1.0 + 8.0 * room));
            }
        }
    }
}
