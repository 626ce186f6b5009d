//! Form factors and lobes: passes.md "second", *Form factor*.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::roundings::ROUNDINGS;
use super::rules::NEAR;
use nimbus::model::basis::evaluate;
use nimbus::reference::bounded::{Bounded, Decision};

/// Least length of a half vector's sum; that of opposite directions turns with any rounding.
const OPPOSITE: f64 = 1e-6;
/// Turn of the mean's bracket {…}·2/(3d²) per turn of the direction. For widths up to the distance
/// (|u|, |v| ≤ d/2) it is at most 2/3 · 2 · (6 + 2 + 1)/4 · 2.
const BENDING: f64 = 6.0;

/// Geometry of a receiver and an emitter.
#[derive(Debug, Clone, Copy)]
pub struct PairGeometry {
    /// Normal of the receiver.
    pub n_j: DVec3,
    /// Normal of the emitter.
    pub n_i: DVec3,
    /// Unit direction from receiver to emitter.
    pub way: DVec3,
    /// Squared distance.
    pub d2: f64,
    /// Error of the direction, radians.
    pub turn: f64,
}

impl PairGeometry {
    /// Returns (c_i ⁺)(c_j ⁺); the second errs by `bending` turns.
    fn product(&self, c_j: f64, bending: f64) -> Bounded {
        let c_i = -self.n_i.dot(self.way);
        let value = c_i.max(0.0) * c_j.max(0.0);
        let most = (c_i + self.turn).max(0.0) * (c_j + bending * self.turn).max(0.0);
        Bounded { value, error: most - value + ROUNDINGS * self.turn * value }
    }

    /// Returns cos cos/(d² + A/π).
    pub fn disc_form(&self, area: f64) -> Bounded {
        self.product(self.n_j.dot(self.way), 1.0).scaled(1.0 / (self.d2 + area * FRAC_1_PI))
    }

    /// Returns the form of a surface's facet or part; if it is wider than its distance, that of a
    /// disc.
    pub fn part_form(&self, u: DVec3, v: DVec3) -> Bounded {
        let b = 2.0 * u.length().max(v.length()) / self.d2.sqrt();
        let wide = Decision::above(b, NEAR, b * ROUNDINGS * self.turn);
        self.disc_form(4.0 * u.length() * v.length()).select(wide, self.rectangle_form(u, v))
    }

    /// Returns the mean of cos cos/d² over a rectangle of half axes `u`, `v`, to the second
    /// derivatives.
    fn rectangle_form(&self, u: DVec3, v: DVec3) -> Bounded {
        let PairGeometry { n_j, way, d2, .. } = *self;
        let c_j = n_j.dot(way);
        if c_j <= -self.turn {
            return Bounded::ZERO;
        }
        let along = |a: DVec3| {
            c_j * (6.0 * a.dot(way).powi(2) - a.length_squared()) - 2.0 * n_j.dot(a) * a.dot(way)
        };
        let form =
            self.product(c_j + 2.0 / (3.0 * d2) * (along(u) + along(v)), BENDING).scaled(1.0 / d2);
        if c_j > 0.0 {
            form.select(Bounded { value: c_j, error: self.turn }.is_positive(), Bounded::ZERO)
        } else {
            Bounded::ZERO.or(form)
        }
    }
}

/// Returns |n − h| between `n` and the half vector of two unit vectors, which err by `turn`
/// together.
pub fn half_angle(n: DVec3, a: DVec3, b: DVec3, turn: f64) -> Bounded {
    let sum = a + b;
    Bounded {
        value: (n - sum.normalize_or_zero()).length(),
        error: 2.0 * turn / sum.length().max(OPPOSITE),
    }
}

/// Returns the width of a lobe.
pub fn width(ns: f64) -> f64 {
    ns.max(1.0).powf(-0.5)
}

/// Returns the lobe at an angle.
pub fn lobe(table: &[f64], angle: Bounded) -> Bounded {
    let at = |a: f64| evaluate(table, 0.5 * a * a);
    let (value, low, high) = (
        at(angle.value),
        at((angle.value - angle.error).max(0.0)),
        at((angle.value + angle.error).min(2.0)),
    );
    Bounded { value, error: (value - low).abs().max((value - high).abs()) }
}
