//! Particles from a disc, and their life: C §2.3, model.md §2. A particle's state
//! is a closed form of (seed, slot, time), so that any frame can be computed alone.

use glam::DVec3;

use super::named::named;
use super::particle::{Particle, SIGMA_PER_RADIUS, SQRT_TAU, mass};
use super::philox::{philox4x32_10, uniform};
use crate::model::shape::Shape;

/// Greatest spread of a size or a lifetime; a tenth of either is left.
pub const MAX_SPREAD: f64 = 0.9;

/// Least share of a life that fading in or out takes. With less, particles would pop.
pub const MIN_FADE: f64 = 0.01;

/// Second word of the Philox key and last word of the counter. Boxes use their index and 0, gusts
/// and textures words of their own.
const STREAM: u32 = 0x6469_7363;

/// Time steps of a period: 2³².
const STEPS: f64 = 4_294_967_296.0;

named! {
    /// Change of a blob's extinction as it entrains air: κ ∝ σ^−k.
    pub enum Dilution {
        /// Droplets are spread out: κ σ³, and with it the mass, is constant.
        Mass = "mass",
        /// κ σ, and with it the optical depth through the centre, is constant.
        Depth = "depth",
        /// κ is constant: as much water condenses as air is entrained.
        None = "none",
    }
}

impl Dilution {
    /// Returns k.
    pub fn exponent(self) -> u32 {
        match self {
            Dilution::Mass => 3,
            Dilution::Depth => 1,
            Dilution::None => 0,
        }
    }
}

/// Heights at which particles become visible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condensation {
    /// Height of the condensation level over the disc, scene units.
    pub base: f64,
    /// Height over which a particle's κ rises from 0 to its full value, scene units.
    pub over: f64,
    /// Rise of a particle's condensation level per kelvin of excess temperature, scene units.
    pub lift: f64,
}

/// Law of a disc's particles. *Units*: lengths in scene units, times in s, temperatures as excess
/// over the air's in K.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// Number of slots: particles at a time.
    pub n_particles: u32,
    /// Radius of the disc.
    pub radius: f64,
    /// L: period after which every slot's particle is replaced.
    pub period_s: f64,
    /// Lifetimes lie between this share less than the period, and the period.
    pub life_spread: f64,
    /// Mean σ at birth.
    pub sigma: f64,
    /// Share that σ at birth varies by on either side.
    pub sigma_spread: f64,
    /// Optical depth through the centre of a particle of mean σ at birth, after it has faded in and
    /// condensed.
    pub optical_depth: f64,
    /// Mean excess temperature at birth.
    pub warmth: f64,
    /// Share that the excess temperature varies by on either side.
    pub warmth_spread: f64,
    /// Share by which the disc's rim is less warm than its centre.
    pub core: f64,
    /// Speed of rise per kelvin, units/(s K).
    pub buoyancy: f64,
    /// T: time in which warmth and speeds decay to 1/e.
    pub cooling_s: f64,
    /// Greatest horizontal speed at birth.
    pub outflow: f64,
    /// α: growth of the radius as a share of the rise.
    pub entrainment: f64,
    /// Change of κ with size.
    pub dilution: Dilution,
    /// Share of a life that fading in takes.
    pub fade_in: f64,
    /// Share of a life that fading out takes.
    pub fade_out: f64,
    /// Condensation level; `None` if particles are visible from birth.
    pub condensation: Option<Condensation>,
}

/// Time in units of a disc's period: t = (generation + phase/2³²) L.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// Whole periods, modulo 2³².
    pub generation: u32,
    /// Fraction of a period, in steps of 2⁻³².
    pub phase: u32,
}

impl Disc {
    /// Returns `time_s` in periods. No step is lost at large times, since the remainder of a
    /// division is exact in f64.
    pub fn cycle_at(&self, time_s: f64) -> Cycle {
        let age = time_s.rem_euclid(self.period_s);
        let phase = (age / self.period_s * STEPS).floor();
        let n = ((time_s - age) / self.period_s).round();
        // A time just below a whole period may round to the period.
        let (n, phase) = if phase < STEPS { (n, phase) } else { (n + 1.0, 0.0) };
        Cycle { generation: n.rem_euclid(STEPS) as u32, phase: phase as u32 }
    }

    /// Returns κ₀, of a particle that is new, has faded in and condensed.
    pub fn kappa(&self) -> f64 {
        self.optical_depth / (SQRT_TAU * self.sigma)
    }

    /// Returns D(a) = T (1 − e^{−a/T}): the distance that a decaying speed of 1 covers.
    fn covered(&self, age_s: f64) -> f64 {
        -self.cooling_s * libm::expm1(-age_s / self.cooling_s)
    }

    /// Returns the final rise of a particle of mean warmth if it lived forever.
    pub fn rise(&self) -> f64 {
        self.buoyancy * self.warmth * self.cooling_s
    }

    /// Returns a bound on how far a particle rises above where the wind alone would carry it.
    fn rise_max(&self) -> f64 {
        self.buoyancy * self.warmth * (1.0 + self.warmth_spread) * self.covered(self.period_s)
    }

    /// Returns bounds (low, high) of all particles' positions over their whole life, relative to
    /// the disc's centre.
    pub fn bounds(&self, wind: DVec3) -> (DVec3, DVec3) {
        let drift = wind * self.period_s;
        let reach = self.radius + self.outflow * self.covered(self.period_s);
        let (low, high) = (drift.min(DVec3::ZERO), drift.max(DVec3::ZERO));
        (low - DVec3::new(reach, 0.0, reach), high + DVec3::new(reach, self.rise_max(), reach))
    }

    /// Returns the place of a particle of mean warmth from the disc's centre at half the mean
    /// lifetime, relative to that centre.
    pub fn center(&self, wind: DVec3) -> DVec3 {
        let age = 0.5 * self.mean_life_s();
        wind * age + DVec3::Y * (self.buoyancy * self.warmth * self.covered(age))
    }

    fn mean_life_s(&self) -> f64 {
        self.period_s * (1.0 - 0.5 * self.life_spread)
    }

    /// Returns the growth of σ per unit of rise; R = 3σ.
    pub fn growth(&self) -> f64 {
        self.entrainment * SIGMA_PER_RADIUS
    }

    /// Returns a bound on σ.
    pub fn sigma_max(&self) -> f64 {
        self.sigma * (1.0 + self.sigma_spread) + self.growth() * self.rise_max()
    }

    /// Returns σ of a particle of mean size and warmth from the disc's centre, averaged over the
    /// mean lifetime.
    pub fn sigma_mean(&self) -> f64 {
        let life = self.mean_life_s();
        let covered = self.cooling_s * (1.0 - self.covered(life) / life);
        self.sigma + self.growth() * self.buoyancy * self.warmth * covered
    }

    /// Returns a bound on κ (2π)^{3/2} σ³. κ₀ σ₀^k σ^{3−k} is greatest where both σ are.
    pub fn mass_max(&self) -> f64 {
        let (born, grown) = (self.sigma * (1.0 + self.sigma_spread), self.sigma_max());
        mass(self.kappa(), grown) * (born / grown).powi(self.dilution.exponent() as i32)
    }

    /// Returns the particle in `slot` of a cloud of `seed` in `wind`, relative to the disc's
    /// centre.
    pub fn particle(&self, seed: u32, wind: DVec3, slot: u32, turn: Cycle) -> Particle {
        // Slots' phases form a van der Corput sequence, so that any first slots are spread evenly
        // over all ages.
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
            shape: Shape::BALL,
            position,
            sigma,
            kappa: self.kappa() * diluted * fades * condensed,
            color: DVec3::ONE,
        }
    }
}

/// Returns a place on a disc of `radius` about 0, uniform over its area.
fn on_disc(radius: f64, u: f64, turns: f64) -> DVec3 {
    let (r, angle) = (radius * u.sqrt(), std::f64::consts::TAU * turns);
    DVec3::new(r * libm::cos(angle), 0.0, r * libm::sin(angle))
}

/// Returns the smooth step from 0 at 0 to 1 at 1.
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
    fn cycles_count_forward_and_backward_alike() {
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
    fn a_particle_matches_values_worked_by_hand() {
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
    fn warmer_particles_condense_higher() {
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
    fn bounds_hold_many_lives_and_are_tight() {
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
