//! Form factors, lobes and the shadows of rectangles on balls: model.md §11 "second".

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::model::basis::evaluate;
use crate::reference::occlude::Rectangle;

/// How something lies in the way to a ball: whether its middle is hidden, whether a rim runs through it, and whether
/// rounding can turn either.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Shadow {
    pub hidden: bool,
    pub torn: bool,
    pub unsure_hidden: bool,
    pub unsure_torn: bool,
}

impl Shadow {
    pub fn over(self, b: Shadow) -> Shadow {
        Shadow {
            hidden: self.hidden || b.hidden,
            torn: self.torn || b.torn,
            unsure_hidden: self.unsure_hidden || b.unsure_hidden,
            unsure_torn: self.unsure_torn || b.unsure_torn,
        }
    }
}

/// The shadow of `r` on the ball about `q`; `from`: the point it is seen from, or the way to it without end.
pub fn shadow(r: &Rectangle, from: Result<DVec3, DVec3>, q: DVec3, radius: f64, slack: f64) -> Shadow {
    let b = r.side(q);
    // Sides, foot of the way in the plane, size of the ball there.
    let (apart, foot, stretch, a) = match from {
        Ok(p) => {
            let (a, d) = (r.side(p), q - p);
            let across = (a - b).abs().max(1e-30);
            (a * b < 0.0, p + d * (a / (a - b)), (a / (a - b)).abs() * (d.length() / across).max(1.0), a)
        }
        Err(d) => {
            let slope = r.normal.dot(d);
            (b * slope < 0.0, q - d * (b / slope), 1.0 / slope.abs().max(1e-30), slope)
        }
    };
    let o = foot - r.center;
    let (u, v) = (r.u.length(), r.v.length());
    let most = (o.dot(r.u).abs() / u - u).max(o.dot(r.v).abs() / v - v);
    let reach = radius * stretch;
    let near = b.abs() < radius;
    let torn = a != 0.0 && if near { most < reach } else { apart && most.abs() < reach };
    // A side's rounding moves the foot by the way's slant.
    let moved = slack * (1.0 + stretch + o.length() / b.abs().max(slack));
    let edge = |x: f64| x.abs() <= moved;
    let sides = b.abs() < 4.0 * slack || a.abs() < 4.0 * slack;
    let unsure_hidden = (apart || sides) && (edge(most) || (sides && most < moved));
    let unsure_torn = radius > 0.0
        && ((b.abs() - radius).abs() < 4.0 * slack || edge(most.abs() - reach) || edge(most - reach) || sides);
    Shadow { hidden: apart && most <= 0.0, torn, unsure_hidden, unsure_torn }
}

/// cos cos/(d² + A/π).
pub fn disc_form(n_j: DVec3, n_i: DVec3, way: DVec3, d2: f64, area: f64) -> f64 {
    (-n_i.dot(way)).max(0.0) * n_j.dot(way).max(0.0) / (d2 + area * FRAC_1_PI)
}

/// The mean of cos cos/d² over a rectangle of half axes `u`, `v`, to the second derivatives.
pub fn rectangle_form(n_j: DVec3, n_i: DVec3, way: DVec3, d2: f64, u: DVec3, v: DVec3) -> f64 {
    let (c_i, c_j) = (-n_i.dot(way), n_j.dot(way));
    if c_i <= 0.0 || c_j <= 0.0 {
        return 0.0;
    }
    let along = |a: DVec3| c_j * (6.0 * a.dot(way).powi(2) - a.length_squared()) - 2.0 * n_j.dot(a) * a.dot(way);
    c_i * (c_j + 2.0 / (3.0 * d2) * (along(u) + along(v))).max(0.0) / d2
}

/// 1 − cos γ between `n` and the half vector of two unit vectors.
pub fn half_gap(n: DVec3, a: DVec3, b: DVec3) -> f64 {
    0.5 * (n - (a + b).normalize_or_zero()).length_squared()
}

pub fn width(ns: f64) -> f64 {
    ns.max(1.0).powf(-0.5)
}

/// The lobe at `gap` and how far it turns within `turn` of its half vector.
pub fn lobe_and_slope(table: &[f64], gap: f64, turn: f64) -> (f64, f64) {
    let angle = (2.0 * gap).sqrt();
    let at = |a: f64| evaluate(table, 0.5 * a * a);
    let (value, low, high) = (at(angle), at((angle - turn).max(0.0)), at(angle + turn));
    (value, (value - low).abs().max((value - high).abs()))
}

fn corners(r: &Rectangle) -> [DVec3; 4] {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| r.center + x * r.u + y * r.v)
}

/// Whether the pyramid from `p` over `r` may hold a point of `e` behind `r`: no face of it, nor `r`'s plane, has all of
/// `e`'s corners outside.
pub fn meets(r: &Rectangle, e: &Rectangle, p: DVec3) -> bool {
    let (rim, far) = (corners(r), corners(e));
    let outside = |k: usize| {
        let plane = (rim[k] - p).cross(rim[(k + 1) % 4] - p);
        let inward = plane * plane.dot(r.center - p).signum();
        far.iter().all(|c| inward.dot(*c - p) < 0.0)
    };
    let side = r.side(p);
    side != 0.0 && !(0..4).any(outside) && far.iter().any(|c| r.normal.dot(*c - r.center) * side < 0.0)
}
