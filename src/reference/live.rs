//! Particles of clouds at a time, model.md §1 and §2, in f64. Discs have a life and animations have
//! keys; boxes and lists do not depend on the time.
//!
//! In: a cloud and a time. Out: its particles relative to their group's centre.

use glam::DVec3;

use super::generate::{self, Generated};
use crate::model::cloud::{Cloud, CloudSource, Particle, SIGMA_PER_RADIUS, Shape};
use crate::model::disc::{Dilution, Disc};
use crate::model::philox::{philox4x32_10, uniform};

/// Philox stream of discs.
const STREAM: u32 = u32::from_be_bytes(*b"disc");

/// Age of the particle in a slot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Age {
    /// Number of the particle in its slot.
    pub generation: u32,
    /// Share of the period since its birth.
    pub share: f64,
}

/// Returns the age in slot `i`: t/L in units of 2⁻³² with the slot's own phase added, whole periods
/// apart.
pub fn age(period_s: f64, time_s: f64, i: u32) -> Age {
    // The remainder of the division is exact; i128 holds both parts.
    let rest = time_s.rem_euclid(period_s);
    let whole = ((time_s - rest) / period_s).round() as i128;
    let ticks = (whole << 32) + (rest / period_s * 2f64.powi(32)).floor() as i128;
    // Bits of i in reverse, behind the point.
    let phase: u64 = (0..32).filter(|b| i >> b & 1 == 1).map(|b| 1 << (31 - b)).sum();
    let sum = ticks + i128::from(phase);
    Age { generation: (sum >> 32) as u32, share: (sum & 0xFFFF_FFFF) as f64 / 2f64.powi(32) }
}

/// A particle of a disc with its birth values, for the laws that tests check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveParticle {
    /// Age.
    pub age: Age,
    /// Random numbers u₁ … u₇.
    pub u: [f64; 7],
    /// Position at birth, relative to the disc's centre.
    pub birth: DVec3,
    /// Position, relative to the disc's centre.
    pub position: DVec3,
    /// σ at birth and now.
    pub sigmas: [f64; 2],
    /// Remaining excess temperature, K.
    pub warmth: f64,
    /// Share of its own lifetime that has passed.
    pub lived: f64,
    /// Peak extinction per unit length.
    pub kappa: f64,
}

/// Returns the particle in slot `i` of a disc whose cloud has `seed` and `wind`.
pub fn alive(disc: &Disc, seed: u32, wind: DVec3, i: u32, time_s: f64) -> LiveParticle {
    let age = age(disc.period_s, time_s, i);
    let words = |k| philox4x32_10([seed, STREAM], [i, age.generation, k, STREAM]).map(uniform);
    let ([u1, u2, u3, u4], [u5, u6, u7, _]) = (words(0), words(1));
    let turn = std::f64::consts::TAU;
    let lifetime = disc.period_s * (1.0 - disc.life_spread * u5);
    let a = (age.share * disc.period_s).min(lifetime);
    let birth = disc.radius * u1.sqrt() * DVec3::new((turn * u2).cos(), 0.0, (turn * u2).sin());
    let warmth_born =
        disc.warmth * (1.0 + disc.warmth_spread * (2.0 * u4 - 1.0)) * (1.0 - disc.core * u1);
    let speed = disc.outflow * u6.sqrt() * DVec3::new((turn * u7).cos(), 0.0, (turn * u7).sin())
        + disc.buoyancy * warmth_born * DVec3::Y;
    let t = disc.cooling_s;
    let way = -t * (-a / t).exp_m1();
    let position = birth + wind * a + speed * way;
    let born = disc.sigma * (1.0 + disc.sigma_spread * (2.0 * u3 - 1.0));
    let sigma = born + disc.entrainment * SIGMA_PER_RADIUS * speed.y * way;
    let warmth = warmth_born * (-a / t).exp();
    let lived = a / lifetime;
    let kappa_0 = disc.optical_depth / ((2.0 * std::f64::consts::PI).sqrt() * disc.sigma);
    let diluted = match disc.dilution {
        Dilution::Mass => (born / sigma).powi(3),
        Dilution::Depth => born / sigma,
        Dilution::None => 1.0,
    };
    let faded = smoothstep(lived / disc.fade_in) * smoothstep((1.0 - lived) / disc.fade_out);
    let condensed = match &disc.condensation {
        Some(c) => smoothstep((position.y - c.base - c.lift * warmth) / c.over),
        None => 1.0,
    };
    let kappa = kappa_0 * diluted * faded * condensed;
    LiveParticle {
        age,
        u: [u1, u2, u3, u4, u5, u6, u7],
        birth,
        position,
        sigmas: [born, sigma],
        warmth,
        lived,
        kappa,
    }
}

fn smoothstep(v: f64) -> f64 {
    if v <= 0.0 {
        0.0
    } else if v >= 1.0 {
        1.0
    } else {
        3.0 * v.powi(2) - 2.0 * v.powi(3)
    }
}

/// Returns all particles of a cloud at `time_s`, in the order of its groups. Only discs and
/// animations depend on the time. An animation that cannot be read has no particles; callers read
/// it before.
pub fn cloud(cloud: &Cloud, time_s: f64) -> Vec<Generated> {
    let center = cloud.groups(0, 0).first().map_or(DVec3::ZERO, |g| g.center);
    let given = |p: &Particle| Generated::given(p.position - center, p.sigma, p.shape, p.kappa);
    match &cloud.source {
        CloudSource::Boxes { boxes, law } => {
            let of = |(b, i): (_, u32)| generate::generate_box(b, i, cloud.seed, law);
            boxes.iter().zip(0..).flat_map(of).collect()
        }
        CloudSource::Particles(list) => list.iter().map(given).collect(),
        CloudSource::Animated(m) => {
            m.animation.at(time_s).unwrap_or_default().iter().map(given).collect()
        }
        CloudSource::Disc(disc) => {
            let of = |i| {
                let p = alive(disc, cloud.seed, cloud.wind, i, time_s);
                Generated::given(p.position - center, p.sigmas[1], Shape::BALL, p.kappa)
            };
            (0..disc.n_particles).map(of).collect()
        }
    }
}
