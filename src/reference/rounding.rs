//! Bounds on how far an f32 evaluation of P (1)–(11) may differ from the f64 one: a running error
//! analysis, each particle at its own values.
//!
//! The shader must keep these assumptions. +, −, × are correctly rounded (unit round-off u = 2⁻²⁴;
//! a fused multiply-add only rounds less). Multiplication by a power of two is exact. Constants and
//! extents are rounded to f32 once, and the uniforms are exact (24 bits). A sine's absolute error
//! is at most [`SINE_ERROR`] at an argument that reduction has moved by at most
//! [`REDUCTION_ERROR`]·u·|argument|. A division errs by at most [`DIVISION_ERROR`]·u. Underflow is
//! neglected: quotients are only floored, so it costs less than 2⁻¹²⁰.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::bounded::Bounded;
use super::generate::{is_inside, offset, uniforms};
use crate::model::boxes::{CloudBox, Form, MAX_ATTEMPTS, radius_factor};
use crate::model::sums::{Precision, Summation, Sums};

/// Unit round-off of f32.
pub const U_F32: f64 = 1.0 / 16_777_216.0;

/// Unit round-off of f64.
const U_F64: f64 = U_F32 / 536_870_912.0;

/// Greatest absolute error of the f32 sine at its reduced argument: 4 units of round-off at 1.
pub const SINE_ERROR: f64 = 4.0 * U_F32;

/// Absolute error of a reduced argument, in u·|argument|.
pub const REDUCTION_ERROR: f64 = 2.0;

/// Greatest relative error of an f32 division, in u: Vulkan's 2.5 ulp, an ulp being at most 2u.
pub const DIVISION_ERROR: f64 = 5.0;

/// Returns a bound on the error of erf at `x` by the formula 7.1.28 of Abramowitz and Stegun in
/// f32.
///
/// It adds the formula's own error and a running bound over Horner's scheme, four squarings (each
/// doubles a relative error), a division of 2.5 ulp = 5 u, and a subtraction.
pub fn erf_bound(x: f64) -> f64 {
    const FORMULA: f64 = 3e-7;
    const COEFFICIENTS: [f64; 6] =
        [0.0705230784, 0.0422820123, 0.0092705272, 0.0001520143, 0.0002765672, 0.0000430638];
    let (u, a) = (U_F32, x.abs());
    let (mut s, mut error) = (0.0, 0.0);
    for c in COEFFICIENTS.into_iter().rev() {
        // c + a·s: the product's rounding, the coefficient's, the sum's.
        let product = a * s;
        error = a * error + u * product + u * c;
        s = c + product;
        error += u * (s + error);
    }
    let d = 1.0 + a * s;
    let mut relative = (a * error + u * (a * s) + u * d) * (1.0 + 4.0 * u) / d;
    for _ in 0..4 {
        relative = (1.0 + relative).powi(2) * (1.0 + u) - 1.0;
    }
    let q = d.powi(-16);
    let quotient = q * ((1.0 + 5.0 * u) / (1.0 - relative) - 1.0);
    FORMULA + quotient + u * (1.0 - q + quotient)
}

/// Returns the sine: |sin(a + e) − sin a| ≤ |cos a||e| + e²/2, e the argument's own error and that
/// of its reduction.
fn sine(a: Bounded, u: f64) -> Bounded {
    let e = a.error + REDUCTION_ERROR * u * (a.value.abs() + a.error);
    // The sine of a small argument errs by 3.5 ulp of itself.
    let own = SINE_ERROR.min(7.0 * u * (a.value.sin().abs() + e));
    Bounded { value: a.value.sin(), error: a.value.cos().abs() * e + 0.5 * e * e + own }
}

/// Returns a bound, axis by axis, on |f32 − f64| of the offset P (1)–(7) proposed by the uniforms
/// `u123`. `u` is the unit round-off ([`U_F32`]).
pub fn position_bound(extent: DVec3, form: Form, u123: [f64; 3], u: f64) -> DVec3 {
    // P (1)–(3). 2u₁ − 1 is a multiple of 2⁻²³ in [−1, 1): exact. L carries its own rounding, the
    // product one more: δX = 2u|X|.
    let spread = |v: f64, length: f64| {
        let share = match form {
            Form::Printed => v,
            Form::Centred => 2.0 * v - 1.0,
        };
        Bounded::exact(share).times(Bounded::once(length, u)).rounded(u)
    };
    let (x, y, z) =
        (spread(u123[0], extent.x), spread(u123[1], extent.y), spread(u123[2], extent.z));
    let (pi, half_pi) = (Bounded::once(PI, u), Bounded::once(FRAC_PI_2, u));
    // P (4): δP = π/2 δsin + 2u|P|, δsin = |cos(Y/2)|(δY/2 + 2u|Y/2|) + SINE_ERROR.
    let phase = |v: Bounded| half_pi.times(sine(v.scaled(0.5), u)).rounded(u);
    let (p_x, p_y, p_z) = (phase(y), phase(x), phase(z));
    // P (5): the argument t = P_x Z/2 has δt = |Z/2|δP_x + |P_x/2|δZ + u|t|, and P_x' = P_x + π sin
    // t has δP_x' = δP_x + πδsin t + 2u|π sin t| + u|P_x'|. The second line starts from δP_x'.
    let swirl = |p: Bounded| pi.times(sine(p.times(z).rounded(u).scaled(0.5), u)).rounded(u);
    let p_x = p_x.plus(swirl(p_x)).rounded(u);
    let p_y = p_y.plus(swirl(p_x)).rounded(u);
    // P (6)–(7): one rounded sum, one exact halving.
    let v = [x.plus(p_x), y.plus(p_y), z.plus(p_z)].map(|v| v.rounded(u).scaled(0.5).error);
    match form {
        Form::Printed => DVec3::new(v[0], v[2], v[2]),
        Form::Centred => DVec3::from_array(v),
    }
}

/// Returns a bound on |f32 − f64| of the radius P (8)–(11) at `u4`. The factor of the centred form
/// is rounded to f32 once.
pub fn radius_bound(form: Form, radius_max: f64, u4: f64, u: f64) -> f64 {
    // δR = 2u|R| as for X above; R' = R + π/2 sin R; factor·R'.
    let r = Bounded::exact(u4).times(Bounded::once(radius_max, u)).rounded(u);
    let r = r.plus(Bounded::once(FRAC_PI_2, u).times(sine(r, u)).rounded(u)).rounded(u);
    match form {
        // Without a factor there is no rounding.
        Form::Printed => r.error,
        Form::Centred => {
            Bounded::once(radius_factor(form, radius_max), u).times(r).rounded(u).error
        }
    }
}

/// Returns a bound on the folded offset of an offset `v` with error `error`. w is evaluated as a −
/// 4h·floor(a/4h), a = v + h, and the result is clamped to [−h, h].
fn fold_bound(v: f64, half: f64, error: f64, u: f64) -> f64 {
    if half <= 0.0 {
        return 0.0;
    }
    let k = ((v + half) / (4.0 * half)).floor().abs();
    // The result is v − 4kh or 2h − v + 4kh, so it inherits δv and (2 + 4k)δh, δh = uh. Roundings:
    // a; the product 4hk; the difference, below 4h; the last one, below 2h.
    let roundings = (v.abs() + half) + 4.0 * half * k + 4.0 * half + 2.0 * half;
    // A quotient off by DIVISION_ERROR errs in its floor only that near to a multiple of 4h. There
    // w leaves [0, 4h) by as much and the result is clamped to the face; the true one lies as far
    // inside.
    let roundings = roundings + DIVISION_ERROR * (k + 1.0) * 4.0 * half;
    // The computed a and k may lie one error further out: (1 + 4u) on every term covers it.
    (error + u * ((2.0 + 4.0 * k) * half + roundings)) * (1.0 + 4.0 * u)
}

/// Bounds on an f32 evaluation of one particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParticleBound {
    /// Bound on the position.
    pub position: DVec3,
    /// Bound on the radius before `radius_scale`.
    pub radius: f64,
    /// Whether the f32 evaluation must accept and reject the same attempts. If false, the attempts
    /// may differ and the other bounds do not hold.
    pub decided: bool,
}

/// Returns the bounds of particle `i_particle` as `generate::generate_particle` makes it.
pub fn particle_bound(
    b: &CloudBox,
    i_box: u32,
    seed: u32,
    form: Form,
    i_particle: u32,
    u: f64,
) -> ParticleBound {
    let half = 0.5 * b.extent;
    let mut decided = true;
    for attempt in 0..MAX_ATTEMPTS {
        let [u1, u2, u3, u4] = uniforms(seed, i_box, i_particle, attempt);
        let v = offset(b.extent, form, [u1, u2, u3]);
        let error = position_bound(b.extent, form, [u1, u2, u3], u);
        // The face is rounded, too; the comparison is exact.
        let reach = error + u * half;
        let radius = radius_bound(form, b.radius_max, u4, u);
        if is_inside(v, half) {
            decided &= is_inside(v.abs() + reach, half);
            return ParticleBound { position: error, radius, decided };
        }
        // One axis that surely exceeds its face suffices.
        decided &= !is_inside(v.abs() - reach, half);
        if attempt + 1 == MAX_ATTEMPTS {
            let fold = |i: usize| fold_bound(v[i], half[i], error[i], u);
            return ParticleBound {
                position: DVec3::new(fold(0), fold(1), fold(2)),
                radius,
                decided,
            };
        }
    }
    unreachable!("MAX_ATTEMPTS is not 0")
}

/// Terms of a block of a pairwise sum, and number of the last partial sum, which takes all further
/// blocks.
const BLOCK: u64 = 8;
const LAST_PART: u32 = 11;

/// Returns a bound on the error of a sum of `n` f32 numbers, formed as `sums` says and rounded to
/// f32, as a share of the sum of their magnitudes (passes.md "sums").
pub fn sum_error(sums: Sums, n: u64) -> f64 {
    let of = |u: f64| match sums.summation {
        Summation::Plain => roundings(n.saturating_sub(1), u),
        Summation::Kahan => {
            // y_k = (x_k + c_{k-1})(1 + η_k), and s_k + c_k = s_{k-1} + y_k exactly. With
            // |c_k| ≤ uM, M the greatest |s_k + c_k|: M ≤ (1 + u) S + n u² M. So s_n is off by
            // |c_n| + Σ|η_k|(|x_k| + |c_{k-1}|) ≤ uM + uS + n u² M.
            let lost = n as f64 * u * u;
            u + (u + lost) * (1.0 + u) / (1.0 - lost)
        }
        Summation::Pairwise => roundings(pairwise_depth(n), u),
    };
    match sums.precision {
        Precision::F32 => of(U_F32),
        // The f64 sum is rounded to f32 once.
        Precision::F64 => U_F32 + (1.0 + U_F32) * of(U_F64),
    }
}

/// Returns the relative change by `n` successive roundings.
fn roundings(n: u64, u: f64) -> f64 {
    let nu = n as f64 * u;
    if nu < 1.0 { nu / (1.0 - nu) } else { f64::INFINITY }
}

/// Returns the greatest number of rounded additions that a term of a pairwise sum passes.
fn pairwise_depth(n: u64) -> u64 {
    // A block's first term is added to 0. Then follow as many additions as the number of blocks has
    // bits: k to get into part k, and the rest when all parts are summed, the least first.
    let n_blocks = n / BLOCK;
    let n_last = n_blocks >> LAST_PART;
    let n_bits = u64::from(u64::BITS - n_blocks.leading_zeros());
    let depth = BLOCK - 1 + if n_last == 0 { n_bits } else { u64::from(LAST_PART) + n_last };
    // A tree of n terms is not deeper.
    depth.min(n.saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_err_as_the_law_says() {
        let of = |summation, precision, n| sum_error(Sums { summation, precision }, n) / U_F32;
        for summation in [Summation::Plain, Summation::Pairwise] {
            assert_eq!([0, 1].map(|n| of(summation, Precision::F32, n)), [0.0; 2]);
        }
        assert!((of(Summation::Plain, Precision::F32, 4096) / 4095.0 - 1.0).abs() < 1e-3);
        assert!((of(Summation::Kahan, Precision::F32, 4096) - 2.0).abs() < 1e-3);
        // 512 blocks: a number of 10 bits.
        assert!((of(Summation::Pairwise, Precision::F32, 4096) - 17.0).abs() < 1e-3);
        assert_eq!(
            [3, 8, 16, 4096, 8 * 2047, 8 * 2048, 8 * 6000].map(pairwise_depth),
            [2, 7, 9, 17, 18, 19, 20]
        );
        for summation in [Summation::Plain, Summation::Kahan, Summation::Pairwise] {
            assert!((of(summation, Precision::F64, 4096) - 1.0).abs() < 1e-4);
        }
    }
}
