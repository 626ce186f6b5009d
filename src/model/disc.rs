//! Particles from a disc, and their life: C §2.3, docs/model.md §2. A particle's state is a closed
//! form of (seed, slot, time), so that any frame can be computed alone.

use glam::DVec3;

use super::cloud::{Particle, SIGMA_PER_RADIUS, SQRT_TAU, mass};
use super::philox::{philox4x32_10, uniform};

/// Most that a size or a lifetime may vary: what is left of either is a tenth.
pub const MAX_SPREAD: f64 = 0.9;

/// Least share of a life that fading in or out takes: shorter, and particles would pop.
pub const MIN_FADE: f64 = 0.01;

/// Second word of the Philox key and last of the counter; boxes use their number and 0, gusts and
/// textures their own.
const STREAM: u32 = 0x6469_7363;

/// 2³²: steps of a period.
const STEPS: f64 = 4_294_967_296.0;

/// What becomes of a blob's extinction as it takes in air: κ ∝ σ^−k.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dilution {
    /// Its droplets are spread out: κ σ³ stays, and with it the mass.
    Mass,
    /// κ σ stays, and with it the optical depth through the centre.
    Depth,
    /// κ stays: as much condenses as air is taken in.
    None,
}

impl Dilution {
    pub const NAMES: [(&'static str, Dilution); 3] =
        [("mass", Dilution::Mass), ("depth", Dilution::Depth), ("none", Dilution::None)];

    /// k.
    pub fn exponent(self) -> u32 {
        match self {
            Dilution::Mass => 3,
            Dilution::Depth => 1,
            Dilution::None => 0,
        }
    }
}

/// Where particles begin to be seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condensation {
    /// Height over the disc, scene units.
    pub base: f64,
    /// Height over which a particle comes to its whole κ, scene units.
    pub over: f64,
    /// How much higher a particle condenses that is warmer by a kelvin, scene units.
    pub lift: f64,
}

/// The law of a cloud's particles. Lengths in scene units, times in s, temperatures as excess over
/// the air's in K.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// Slots: particles at a time.
    pub n_particles: u32,
    pub radius: f64,
    /// L: every slot's particle is born anew after so long.
    pub period_s: f64,
    /// Lifetimes lie between this share less of the period, and all of it.
    pub life_spread: f64,
    /// σ at birth, its mean, and the share that it varies by on either side.
    pub sigma: f64,
    pub sigma_spread: f64,
    /// Through the centre of a particle of mean σ at birth, when it has faded in and condensed.
    pub optical_depth: f64,
    /// At birth, its mean, and the share that it varies by on either side.
    pub warmth: f64,
    pub warmth_spread: f64,
    /// The share that the disc's rim is less warm than its centre.
    pub core: f64,
    /// Speed of rise, units/s by kelvin.
    pub buoyancy: f64,
    /// T: warmth and speeds decay in this time to 1/e.
    pub cooling_s: f64,
    /// Greatest horizontal speed at birth.
    pub outflow: f64,
    /// α: the radius grows by this share of the rise.
    pub entrainment: f64,
    pub dilution: Dilution,
    /// Shares of a life.
    pub fade_in: f64,
    pub fade_out: f64,
    pub condensation: Option<Condensation>,
}

/// A time by a disc's period: t = (generation + phase/2³²) L.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// Modulo 2³².
    pub generation: u32,
    pub phase: u32,
}

impl Disc {
    /// No steps of time are lost: the remainder of a division is exact in f64, however large the
    /// time.
    pub fn cycle_at(&self, time_s: f64) -> Cycle {
        let age = time_s.rem_euclid(self.period_s);
        let phase = (age / self.period_s * STEPS).floor();
        let n = ((time_s - age) / self.period_s).round();
        // A time just below a whole period may round to it.
        let (n, phase) = if phase < STEPS { (n, phase) } else { (n + 1.0, 0.0) };
        Cycle { generation: n.rem_euclid(STEPS) as u32, phase: phase as u32 }
    }

    /// κ₀, of a particle that is new, has faded in and condensed.
    pub fn kappa(&self) -> f64 {
        self.optical_depth / (SQRT_TAU * self.sigma)
    }

    /// D(a) = T (1 − e^{−a/T}): what a speed of 1 that decays has covered.
    fn covered(&self, age_s: f64) -> f64 {
        -self.cooling_s * libm::expm1(-age_s / self.cooling_s)
    }

    /// What a particle of mean warmth rises in the end, were it to live so long.
    pub fn rise(&self) -> f64 {
        self.buoyancy * self.warmth * self.cooling_s
    }

    /// No particle rises higher over where the wind alone would have it.
    fn rise_max(&self) -> f64 {
        self.buoyancy * self.warmth * (1.0 + self.warmth_spread) * self.covered(self.period_s)
    }

    /// Bounds (low, high) of all particles' positions over the whole of their lives, relative to
    /// the disc's centre.
    pub fn bounds(&self, wind: DVec3) -> (DVec3, DVec3) {
        let drift = wind * self.period_s;
        let reach = self.radius + self.outflow * self.covered(self.period_s);
        let (low, high) = (drift.min(DVec3::ZERO), drift.max(DVec3::ZERO));
        (low - DVec3::new(reach, 0.0, reach), high + DVec3::new(reach, self.rise_max(), reach))
    }

    /// Where a particle of mean warmth from the disc's centre is at half the mean lifetime,
    /// relative to that centre.
    pub fn center(&self, wind: DVec3) -> DVec3 {
        let age = 0.5 * self.mean_life_s();
        wind * age + DVec3::Y * (self.buoyancy * self.warmth * self.covered(age))
    }

    fn mean_life_s(&self) -> f64 {
        self.period_s * (1.0 - 0.5 * self.life_spread)
    }

    /// How σ grows as a particle rises by 1: R = 3σ.
    pub fn growth(&self) -> f64 {
        self.entrainment * SIGMA_PER_RADIUS
    }

    pub fn sigma_max(&self) -> f64 {
        self.sigma * (1.0 + self.sigma_spread) + self.growth() * self.rise_max()
    }

    /// Of a particle of mean size and warmth from the disc's centre, over the mean lifetime.
    pub fn sigma_mean(&self) -> f64 {
        let life = self.mean_life_s();
        let covered = self.cooling_s * (1.0 - self.covered(life) / life);
        self.sigma + self.growth() * self.buoyancy * self.warmth * covered
    }

    /// Bounds κ (2π)^{3/2} σ³: κ₀ σ₀^k σ^{3−k} is greatest where both are.
    pub fn mass_max(&self) -> f64 {
        let (born, grown) = (self.sigma * (1.0 + self.sigma_spread), self.sigma_max());
        mass(self.kappa(), grown) * (born / grown).powi(self.dilution.exponent() as i32)
    }

    /// The particle in `slot` of a cloud of `seed` in `wind`, relative to the disc's centre.
    pub fn particle(&self, seed: u32, wind: DVec3, slot: u32, turn: Cycle) -> Particle {
        // The places of a van der Corput sequence: any first slots are spread evenly over all ages.
        let (phase, is_next) = turn.phase.overflowing_add(slot.reverse_bits());
        let generation = turn.generation.wrapping_add(u32::from(is_next));
        let words =
            |k: u32| philox4x32_10([seed, STREAM], [slot, generation, k, STREAM]).map(uniform);
        let ([u1, u2, u3, u4], [u5, u6, u7, _]) = (words(0), words(1));

        let share = 1.0 - self.life_spread * u5;
        let spent = (f64::from(phase) / STEPS).min(share);
        let age = spent * self.period_s;
        let covered = self.covered(age);
        let warm =
            self.warmth * (1.0 + self.warmth_spread * (2.0 * u4 - 1.0)) * (1.0 - self.core * u1);
        let rise = self.buoyancy * warm * covered;
        let position = on_disc(self.radius, u1, u2)
            + wind * age
            + DVec3::Y * rise
            + on_disc(self.outflow, u6, u7) * covered;
        let born = self.sigma * (1.0 + self.sigma_spread * (2.0 * u3 - 1.0));
        let sigma = born + self.growth() * rise;
        let fades =
            smooth(spent / share / self.fade_in) * smooth((1.0 - spent / share) / self.fade_out);
        let condensed = self.condensation.map_or(1.0, |c| {
            let warmth_left = warm * (1.0 - covered / self.cooling_s);
            smooth((position.y - c.base - c.lift * warmth_left) / c.over)
        });
        let diluted = (born / sigma).powi(self.dilution.exponent() as i32);
        Particle {
            aspect: 1.0,
            position,
            sigma,
            kappa: self.kappa() * diluted * fades * condensed,
            color: DVec3::ONE,
        }
    }
}

/// A place on a disc of `radius` about 0, uniform over its area, or a velocity.
fn on_disc(radius: f64, u: f64, turns: f64) -> DVec3 {
    let (r, angle) = (radius * u.sqrt(), std::f64::consts::TAU * turns);
    DVec3::new(r * libm::cos(angle), 0.0, r * libm::sin(angle))
}

/// 0 up to 0, 1 from 1 on, and without a bend.
fn smooth(v: f64) -> f64 {
    let w = v.clamp(0.0, 1.0);
    w * w * (3.0 - 2.0 * w)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DISC: Disc = Disc {
        n_particles: 8,
        radius: 2.0,
        period_s: 10.0,
        life_spread: 0.0,
        sigma: 0.5,
        sigma_spread: 0.0,
        optical_depth: 1.0,
        warmth: 2.0,
        warmth_spread: 0.0,
        core: 0.0,
        buoyancy: 0.75,
        cooling_s: 4.0,
        outflow: 0.0,
        entrainment: 0.3,
        dilution: Dilution::Mass,
        fade_in: 0.25,
        fade_out: 0.25,
        condensation: None,
    };
    const WIND: DVec3 = DVec3::new(0.5, 0.0, -1.0);

    #[test]
    fn time_turns_forward_and_backward_alike() {
        let turn = |t| DISC.cycle_at(t);
        assert_eq!(turn(0.0), Cycle { generation: 0, phase: 0 });
        assert_eq!(turn(25.0), Cycle { generation: 2, phase: 1 << 31 });
        assert_eq!(turn(-2.5), Cycle { generation: u32::MAX, phase: 3 << 30 });
        // Just below a whole period, nearer to it than a step.
        assert_eq!(turn(-1e-30), Cycle { generation: 0, phase: 0 });
        // A period later everything is the same but the generation, at any time.
        for t in [-1e6, -3.3, 0.1, 1e6 + 0.1] {
            let (a, b) = (turn(t), turn(t + 10.0));
            assert_eq!(b.generation, a.generation.wrapping_add(1), "{t}");
            assert!(a.phase.abs_diff(b.phase) < 2, "{t}");
        }
        assert_eq!(turn(10.0 * STEPS).generation, 0);
    }

    #[test]
    fn a_life_by_hand() {
        // Slot 1 of phase ½ is 7 s old at 2 s, in its first generation.
        let p = DISC.particle(3, WIND, 1, DISC.cycle_at(2.0));
        let covered = 4.0 * (1.0 - (-7.0f64 / 4.0).exp());
        // A step of time is 2 ns.
        assert!((p.position.y - 0.75 * 2.0 * covered).abs() < 1e-8);
        let sigma = 0.5 + 0.1 * p.position.y;
        assert!((p.sigma - sigma).abs() < 1e-12);
        // 0.3 of its life are left: it has not begun to fade. The mass stays.
        assert!((mass(p.kappa, p.sigma) / mass(DISC.kappa(), 0.5) - 1.0).abs() < 1e-12);
        let birth = p.position - WIND * 7.0;
        assert!((birth.x.powi(2) + birth.z.powi(2)).sqrt() <= 2.0);
        // An eighth of its life before its end it is at half, whatever is diluted.
        let disc = Disc { dilution: Dilution::Depth, ..DISC };
        let p = disc.particle(3, WIND, 0, disc.cycle_at(8.75));
        assert!((p.kappa * p.sigma / (disc.kappa() * 0.5) - 0.5).abs() < 1e-9);
        let none = Disc { dilution: Dilution::None, ..DISC };
        assert!((none.particle(3, WIND, 0, none.cycle_at(5.0)).kappa - DISC.kappa()).abs() < 1e-15);
    }

    #[test]
    fn who_is_warmer_condenses_higher() {
        let at = |lift, base| {
            let disc = Disc { condensation: Some(Condensation { base, over: 2.0, lift }), ..DISC };
            disc.particle(3, WIND, 0, disc.cycle_at(5.0)).kappa
        };
        let p = DISC.particle(3, WIND, 0, DISC.cycle_at(5.0));
        let left = 2.0 * (-5.0f64 / 4.0).exp();
        assert_eq!((at(0.0, p.position.y), at(0.0, p.position.y - 2.0)), (0.0, p.kappa));
        // Half way up: S(½) = ½.
        assert!((at(0.0, p.position.y - 1.0) / p.kappa - 0.5).abs() < 1e-12);
        assert!((at(3.0, p.position.y - 1.0 - 3.0 * left) / p.kappa - 0.5).abs() < 1e-12);
    }

    #[test]
    fn bounds_hold_all_of_many_lives() {
        let disc = Disc {
            life_spread: 0.5,
            sigma_spread: 0.4,
            warmth_spread: 1.0,
            core: 0.5,
            outflow: 0.3,
            ..DISC
        };
        let (low, high) = disc.bounds(WIND);
        let (mut least, mut greatest) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for i in 0..40_000u32 {
            let p = disc.particle(9, WIND, i % 64, disc.cycle_at(f64::from(i) * 0.37 - 200.0));
            assert!(p.position.cmpge(low).all() && p.position.cmple(high).all(), "{}", p.position);
            assert!(p.sigma <= disc.sigma_max() && p.kappa <= disc.kappa());
            assert!(mass(p.kappa, p.sigma) <= disc.mass_max() * (1.0 + 1e-12));
            (least, greatest) = (least.min(p.position), greatest.max(p.position));
        }
        // And are no wider than they must: nearly all of them is used.
        assert!(
            (greatest - least).cmpge(0.8 * (high - low)).all(),
            "{least} {greatest} {low} {high}"
        );
    }
}
