//! Shadows of rectangles on balls, and the rectangles that can matter: passes.md "second",
//! *Shadow edges*.

use std::f64::consts::SQRT_2;

use glam::DVec3;

use super::roundings::U;
use nimbus::reference::bounded::{Bounded, Decision};
use nimbus::reference::occlude::{IN_PLANE, Rectangle, Source};

/// Error of unit vectors, their products and quotients.
pub const OF_UNITS: f64 = 8.0 * U;
/// Least magnitude of a divisor.
const LEAST: f64 = 1e-30;

/// The ball about a facet or cluster.
#[derive(Debug, Clone, Copy)]
pub struct Ball {
    /// Centre.
    pub at: DVec3,
    /// Radius.
    pub radius: Bounded,
    /// Error of the centre's distance from a plane.
    pub slack: f64,
}

/// Position of a rectangle in the way to a ball.
#[derive(Debug, Clone, Copy)]
pub struct Shadow {
    /// Whether the ball's centre is hidden.
    pub hidden: Decision,
    /// Whether a shadow edge crosses the ball.
    pub crossed: Decision,
    /// h, the hidden share of the ball.
    pub share: Bounded,
}

/// Returns the possible signs of a plane's side at distance `raw`, known to `slack`; the exact one
/// first.
pub fn signs(raw: f64, tolerance: f64, slack: f64) -> Vec<f64> {
    let law = if raw.abs() > tolerance { raw.signum() } else { 0.0 };
    let possible = [
        (1.0, raw + slack > tolerance),
        (-1.0, raw - slack < -tolerance),
        (0.0, raw.abs() <= tolerance + slack),
    ];
    std::iter::once(law)
        .chain(possible.into_iter().filter(|(s, is)| *is && *s != law).map(|(s, _)| s))
        .collect()
}

/// Returns the signed distance of `p` from the plane, and its possible signs.
pub fn sides(r: &Rectangle, p: DVec3, slack: f64) -> (f64, Vec<f64>) {
    let o = p - r.center;
    let raw = r.normal.dot(o);
    (raw, signs(raw, IN_PLANE * o.abs().element_sum(), slack))
}

/// Returns the same for a source of light or sight.
pub fn sides_of(r: &Rectangle, source: Source, slack: f64) -> (f64, Vec<f64>) {
    match source {
        Source::At(p) => sides(r, p, slack),
        Source::Toward(w) => {
            let slope = r.normal.dot(w);
            (slope, signs(slope, 0.0, OF_UNITS))
        }
    }
}

/// Returns where the way to `q` meets the plane, the error of that point, and how much larger than
/// the ball its image is there.
fn foot(source: Source, q: DVec3, a: f64, b: f64, slack: f64) -> (DVec3, f64, Bounded) {
    match source {
        Source::At(p) => {
            let (d, length) = (q - p, q.distance(p));
            let apart = if (a - b).abs() < LEAST { LEAST } else { a - b };
            let (t, slant) = (a / apart, length / apart.abs());
            let t_error = slack * (a.abs() + b.abs()) / (apart * apart);
            let slant_error = (2.0 * slant + 1.0) * slack / apart.abs();
            let stretch = Bounded { value: slant.max(1.0), error: slant_error };
            (
                p + d * t,
                slack + length * t_error,
                Bounded { value: t.abs(), error: t_error }.times(stretch),
            )
        }
        Source::Toward(w) => {
            let slope = if a.abs() < LEAST { LEAST } else { a };
            let moved = slack + slack / slope.abs() + b.abs() * OF_UNITS / (slope * slope);
            let stretch = Bounded { value: 1.0 / slope.abs(), error: OF_UNITS / (slope * slope) };
            (q - w * (b / slope), moved, stretch)
        }
    }
}

/// Returns the shadow of `r` on a ball.
pub fn shadow(r: &Rectangle, source: Source, ball: &Ball) -> Shadow {
    let Ball { at: q, radius, slack } = *ball;
    let ((a, of_a), (b, of_b)) = (sides_of(r, source, slack), sides(r, q, slack));
    let (foot, moved, stretch) = foot(source, q, a, b, slack);
    let o = foot - r.center;
    let beyond = |axis: DVec3| o.dot(axis).abs() / axis.length() - axis.length();
    let m = Bounded { value: beyond(r.u).max(beyond(r.v)), error: moved };
    let reach = stretch.times(radius);
    let apart = Decision::of(of_a.iter().flat_map(|x| of_b.iter().map(move |y| x * y < 0.0)));
    // A rectangle hides nothing from a source in its plane.
    let parts = Decision::of(of_a.iter().map(|x| *x != 0.0));
    let near = Decision::above(radius.value, b.abs(), slack + radius.error);
    let across = Bounded { value: m.value.abs(), ..m };
    let crossed = parts
        .and(apart.and(Decision::greater(reach, across)).or(near.and(Decision::greater(reach, m))));
    let half = (SQRT_2 * reach.value).max(f64::MIN_POSITIVE);
    let ramp = |m: f64| (0.5 - m / half).clamp(0.0, 1.0);
    let off = m.error + reach.error / SQRT_2;
    let share = Bounded::between(ramp(m.value + off), ramp(m.value), ramp(m.value - off));
    Shadow {
        hidden: apart.and(Decision::greater(m, Bounded::ZERO).negated()),
        crossed,
        share: share.select(apart, Bounded::ZERO),
    }
}

fn corners(r: &Rectangle) -> [DVec3; 4] {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| r.center + x * r.u + y * r.v)
}

/// Returns the inward normal of face k of the pyramid over `rim`, and the lengths of its edges.
fn face(rim: &[DVec3; 4], k: usize, middle: DVec3) -> (DVec3, [f64; 2]) {
    let (a, b) = (rim[k], rim[(k + 1) % 4]);
    let plane = a.cross(b);
    (plane * plane.dot(middle).signum(), [a.length(), b.length()])
}

/// Returns whether the pyramid from `p` over `r` may hold a point of `e` behind `r`: neither a face
/// nor `r`'s plane has all of `e`'s corners outside.
pub fn meets(r: &Rectangle, e: &Rectangle, p: DVec3, slack: f64) -> Decision {
    let (rim, far) = (corners(r).map(|c| c - p), corners(e).map(|c| c - p));
    // All of `far` lies below 0 of a plane through `p`; corners and normal err as their products
    // do.
    let outside = |k: usize| {
        let (inward, [a, b]) = face(&rim, k, r.center - p);
        let below = |c: &DVec3| {
            Decision::above(0.0, inward.dot(*c), 2.0 * slack * (a * b + (a + b) * c.length()))
        };
        far.iter().map(below).fold(Decision::YES, Decision::and)
    };
    let (_, of_p) = sides(r, p, slack);
    let behind = |c: &DVec3| {
        let side = r.normal.dot(*c + p - r.center);
        Decision::of(
            of_p.iter().flat_map(|s| [side, side + slack, side - slack].map(|x| x * s < 0.0)),
        )
    };
    let out = (0..4).map(outside).fold(Decision::NO, Decision::or);
    out.negated().and(far.iter().map(behind).fold(Decision::NO, Decision::or))
}

/// Margin of a plane through a point, as a share of the lengths that make it up.
const TRUST: f64 = 1e-5;

/// Returns whether `r` alone hides all of `e` from `p`: its corners are within the pyramid from `p`
/// over `r`, and beyond `r`.
pub fn hides_all(r: &Rectangle, e: &Rectangle, p: DVec3, slack: f64) -> Decision {
    let (rim, far) = (corners(r).map(|c| c - p), corners(e).map(|c| c - p));
    let inside = |k: usize| {
        let (inward, [a, b]) = face(&rim, k, r.center - p);
        let within = |c: &DVec3| {
            let off = 2.0 * slack * (a * b + (a + b) * c.length());
            Decision::above(inward.dot(*c), TRUST * a * b * c.length(), off)
        };
        far.iter().map(within).fold(Decision::YES, Decision::and)
    };
    let (_, of_p) = sides(r, p, slack);
    let beyond = |c: &DVec3| {
        let o = *c + p - r.center;
        let depth = r.normal.dot(o);
        Decision::of(of_p.iter().flat_map(|s| {
            [0.0, slack, -slack].map(|off| -s * (depth + off) > TRUST * o.abs().element_sum())
        }))
    };
    (0..4).map(inside).chain(far.iter().map(beyond)).fold(Decision::YES, Decision::and)
}
