//! The gusts' displacement d(x, t) = Σ a sin(k·x + ω t + φ) (model.md §12) for
//! [`LANES`] particles at once.
//!
//! The sine has no branch and no call, so that the compiler vectorises the loop over particles.
//! Multiplications and additions are never fused: every machine gives the same bytes.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

use super::gust::Mode;

/// Number of particles computed at once: two vectors of four, so that one hides the other's
/// latency.
pub const LANES: usize = 8;

/// One coordinate of [`LANES`] particles.
pub type Lanes = [f64; LANES];

/// Bound on |sine(x) − sin x| for |x| ≤ [`SINE_REACH`], u = 2⁻⁵³.
///
/// The reduction rounds once, at most u: k π₁ and x − k π₁ are exact and k π₂ is below 1.3e-4. The
/// series' first missing term is (π/2)²¹/21! = 2.6e-16. In r + (r s) p the product, at most 0.571,
/// has six roundings and the sum one: 4.5 u. Together that is 8.7e-16; the rest is `f64::sin`'s own
/// ulp.
pub const SINE_ERROR: f64 = 1e-15;

/// Greatest argument of [`sine`]: the reduction is exact for |k| ≤ 2²⁰ half turns, as π₁ has 33
/// bits.
pub const SINE_REACH: f64 = 2_097_152.0;

/// 1.5 · 2⁵²: adding it rounds to an integer whose parity is the sum's lowest bit.
const TO_INTEGER: f64 = 6_755_399_441_055_744.0;
/// First 33 bits of π, and the rest.
const PI_1: f64 = f64::from_bits(0x4009_21fb_5440_0000);
const PI_2: f64 = 1.215_420_101_301_238_5e-10;
/// Coefficients (−1)ⁿ/(2n + 1)!, n from 9 to 1.
const SERIES: [f64; 9] = [
    -1.0 / 121_645_100_408_832_000.0,
    1.0 / 355_687_428_096_000.0,
    -1.0 / 1_307_674_368_000.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 39_916_800.0,
    1.0 / 362_880.0,
    -1.0 / 5040.0,
    1.0 / 120.0,
    -1.0 / 6.0,
];

/// Returns sin x to [`SINE_ERROR`] for |x| ≤ [`SINE_REACH`]. Beyond, the result is arbitrary.
#[inline(always)]
pub fn sine(x: f64) -> f64 {
    let shifted = x * FRAC_1_PI + TO_INTEGER;
    let k = shifted - TO_INTEGER;
    let r = (x - k * PI_1) - k * PI_2;
    let s = r * r;
    let mut p = SERIES[0];
    for c in &SERIES[1..] {
        p = p * s + c;
    }
    let value = r + (r * s) * p;
    // Odd half turns change the sign.
    f64::from_bits(value.to_bits() ^ (shifted.to_bits() << 63))
}

/// A wave at one time.
#[derive(Debug, Clone, Copy)]
struct Wave {
    k: [f64; 3],
    /// ω t + φ in [0, 2π).
    phase: f64,
    a: [f64; 3],
}

/// A cloud's gusts at one time.
#[derive(Debug, Clone)]
pub struct Waves {
    waves: Vec<Wave>,
    /// Greatest |k|.
    k_max: f64,
}

impl Waves {
    /// Evaluates the phases of `modes` at `time_s`.
    pub fn at(modes: &[Mode], time_s: f64) -> Waves {
        let wave =
            |m: &Mode| Wave { k: m.k.to_array(), phase: m.phase_at(time_s), a: m.a.to_array() };
        Waves {
            waves: modes.iter().map(wave).collect(),
            k_max: modes.iter().map(|m| m.k.length()).fold(0.0, f64::max),
        }
    }

    /// Returns the displacements along x, y and z of particles at rest at `x`, relative to their
    /// cloud's origin.
    pub fn displace(&self, x: &[Lanes; 3]) -> [Lanes; 3] {
        if self.waves.is_empty() {
            return [[0.0; LANES]; 3];
        }
        let farthest =
            (0..LANES).map(|l| x[0][l].abs() + x[1][l].abs() + x[2][l].abs()).fold(0.0, f64::max);
        let is_number = x.iter().flatten().all(|v| v.is_finite());
        if is_number && self.k_max * farthest + TAU <= SINE_REACH {
            return in_reach(&self.waves, x);
        }
        let mut d = [[0.0; LANES]; 3];
        for l in 0..LANES {
            let one = self.displacement(DVec3::new(x[0][l], x[1][l], x[2][l]));
            (d[0][l], d[1][l], d[2][l]) = (one.x, one.y, one.z);
        }
        d
    }

    /// Returns the displacement of one particle anywhere.
    fn displacement(&self, x: DVec3) -> DVec3 {
        let of = |w: &Wave| DVec3::from(w.a) * libm::sin(DVec3::from(w.k).dot(x) + w.phase);
        self.waves.iter().map(of).sum()
    }
}

fn in_reach(waves: &[Wave], x: &[Lanes; 3]) -> [Lanes; 3] {
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has the instructions that the function was compiled for.
        return unsafe { sum_avx2(waves, x) };
    }
    sum(waves, x)
}

/// [`sum`] with vectors of four instead of two. The operations, and so the bytes, are the same.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn sum_avx2(waves: &[Wave], x: &[Lanes; 3]) -> [Lanes; 3] {
    sum(waves, x)
}

#[inline(always)]
fn sum(waves: &[Wave], x: &[Lanes; 3]) -> [Lanes; 3] {
    let mut d = [[0.0; LANES]; 3];
    for w in waves {
        let mut sines = [0.0; LANES];
        for (l, value) in sines.iter_mut().enumerate() {
            *value = sine(w.k[0] * x[0][l] + w.k[1] * x[1][l] + w.k[2] * x[2][l] + w.phase);
        }
        for (along, a) in d.iter_mut().zip(w.a) {
            for (along, value) in along.iter_mut().zip(&sines) {
                *along += a * value;
            }
        }
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::gust::Gust;

    /// Greatest |sine(x) − sin x| over arguments evenly spaced from `low` to `high`, and around
    /// half turns.
    fn worst(low: f64, high: f64, n: u32) -> f64 {
        let at = |i: u32| low + (high - low) * f64::from(i) / f64::from(n);
        let half_turn = |i: u32| (at(i) / std::f64::consts::PI).round() * std::f64::consts::PI;
        let quarter = 0.5 * std::f64::consts::PI;
        let around = |i: u32| [at(i), half_turn(i), half_turn(i).next_up(), half_turn(i) + quarter];
        let xs = (0..=n).flat_map(around);
        xs.filter(|x| x.abs() <= SINE_REACH).map(|x| (sine(x) - x.sin()).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn the_sine_is_within_its_bound_all_over_its_reach() {
        let ranges =
            [(-4.0, 4.0), (-100.0, 100.0), (1e3, 2e3), (1e5, 1.001e5), (-SINE_REACH, SINE_REACH)];
        for (low, high) in ranges.into_iter().chain([(0.9999 * SINE_REACH, SINE_REACH)]) {
            let error = worst(low, high, 400_000);
            assert!(error <= SINE_ERROR, "{low} to {high}: {error:e}");
            println!("{low} to {high}: {error:e}");
        }
        assert_eq!((sine(0.0), sine(1e-300)), (0.0, 1e-300));
        // The bound is tight: a missing term of the series or part of π would be noticed.
        assert!(worst(-SINE_REACH, SINE_REACH, 400_000) > 0.1 * SINE_ERROR);
    }

    /// Returns some particles about `center`.
    fn lanes(center: f64, spread: f64, seed: usize) -> [Lanes; 3] {
        let of = |axis: usize| {
            std::array::from_fn(|l| {
                center + spread * ((seed * 24 + axis * 8 + l) as f64 * 0.618_034).fract()
            })
        };
        [of(0), of(1), of(2)]
    }

    #[test]
    fn displacements_are_the_closed_form_wherever_particles_are() {
        for n_waves in [1, 16, 2048] {
            let gust = Gust { amplitude: 0.3, length: 4.0, period_s: 5.0, n_waves };
            let modes = gust.modes(7);
            let waves = Waves::at(&modes, 1234.5);
            // Centres within the vectors' reach, across its end, and far beyond.
            for (i, center) in [0.0, -50.0, 1e4, 1.6e5, 1e9].into_iter().enumerate() {
                let x = lanes(center, 2e4, i);
                let d = waves.displace(&x);
                for l in 0..LANES {
                    let p = DVec3::new(x[0][l], x[1][l], x[2][l]);
                    let of = |m: &Mode| m.a * (m.k.dot(p) + m.phase_at(1234.5)).sin();
                    let exact: DVec3 = modes.iter().map(of).sum();
                    // The sine's bound for every wave, and the rounding of n sums.
                    let bound = gust.reach() * (SINE_ERROR + f64::from(n_waves) * 2f64.powi(-53));
                    let off = (DVec3::new(d[0][l], d[1][l], d[2][l]) - exact).abs().max_element();
                    assert!(off <= bound, "{n_waves} waves, {p}: {off:e} > {bound:e}");
                }
            }
        }
        assert_eq!(Waves::at(&[], 0.0).displace(&lanes(0.0, 1.0, 0)), [[0.0; LANES]; 3]);
    }

    #[test]
    fn wide_vectors_give_the_same_bytes() {
        let gust = Gust { amplitude: 0.3, length: 0.4, period_s: 5.0, n_waves: 100 };
        let waves = Waves::at(&gust.modes(3), 7.0);
        for i in 0..500 {
            let x = lanes(-10.0, 20.0, i);
            let bits = |d: [Lanes; 3]| d.map(|v| v.map(f64::to_bits));
            assert_eq!(bits(in_reach(&waves.waves, &x)), bits(sum(&waves.waves, &x)));
        }
    }

    #[test]
    fn nan_affects_no_other_lane() {
        let gust = Gust { amplitude: 0.3, length: 4.0, period_s: 5.0, n_waves: 16 };
        let waves = Waves::at(&gust.modes(3), 7.0);
        let mut x = lanes(0.0, 1.0, 1);
        x[1][3] = f64::NAN;
        let d = waves.displace(&x);
        assert!(d[0][3].is_nan() && (0..LANES).all(|l| l == 3 || d[0][l].is_finite()));
    }
}
