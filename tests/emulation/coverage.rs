//! Coverage of a cell's parts by a rectangle: passes.md "second", *Edges at a point*. Five
//! functions, linear over the cell, are positive behind the rectangle and within its edges; each
//! acts as a ramp over a part.

use glam::{DVec2, DVec3};

use super::occluder::{OF_UNITS, sides_of};
use nimbus::reference::bounded::Bounded;
use nimbus::reference::occlude::{IN_PLANE, Rectangle, Source};

/// Half a part's side, in the cell's half axes.
const HALF_PART: f64 = 0.25;

/// A cell as a rectangle.
#[derive(Debug, Clone, Copy)]
pub struct Patch {
    /// Centre.
    pub q: DVec3,
    /// Half axis along u.
    pub u: DVec3,
    /// Half axis along v.
    pub v: DVec3,
}

impl Patch {
    /// Returns the point at (s, t).
    pub fn point(&self, at: DVec2) -> DVec3 {
        self.q + at.x * self.u + at.y * self.v
    }

    /// Returns (s, t) of the parts' centres.
    pub fn middles() -> impl Iterator<Item = DVec2> {
        let at = |i: u32| 0.5 * f64::from(i) - 0.75;
        (0..16u32).map(move |i| DVec2::new(at(i % 4), at(i / 4)))
    }

    /// Returns the quarter of the cell that a part lies in.
    pub fn quarter_of(at: DVec2) -> usize {
        usize::from(at.x > 0.0) + 2 * usize::from(at.y > 0.0)
    }

    /// Returns the quarters' centres.
    pub fn quarters(&self) -> [DVec3; 4] {
        [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)].map(|at| self.point(at.into()))
    }
}

/// A function linear over a cell, with a bound on its error.
#[derive(Debug, Clone, Copy)]
struct Linear {
    at_q: f64,
    gain: DVec2,
    slack: f64,
}

impl Linear {
    /// Returns the share of the part about `at` where the function plus `off` is positive.
    fn share(&self, at: DVec2, off: f64) -> f64 {
        let (f, half) = (self.at_q + self.gain.dot(at) + off, HALF_PART * self.gain.length());
        if half > 0.0 {
            (0.5 + f / (2.0 * half)).clamp(0.0, 1.0)
        } else {
            f64::from(u8::from(f > 0.0))
        }
    }
}

/// The plane, and two pairs of opposite edges.
type Five = [Linear; 5];

/// The part of a cell that a rectangle hides: the exact side first, then the sides that rounding
/// may select. `None` stands for a source in the rectangle's plane, which hides nothing.
#[derive(Debug, Clone)]
pub struct Coverage(Vec<Option<Five>>);

impl Coverage {
    /// Computes the coverage of `patch` seen from `source`. `slack` bounds the error of a point's
    /// distance from a plane.
    pub fn new(r: &Rectangle, source: Source, patch: &Patch, slack: f64) -> Coverage {
        let (side, signs) = sides_of(r, source, slack);
        let of =
            |sign: &f64| (*sign != 0.0).then(|| five(r, source, patch, side.abs(), *sign, slack));
        Coverage(signs.iter().map(of).collect())
    }

    /// Returns whether no part is hidden.
    pub fn is_zero(&self) -> bool {
        Patch::middles().all(|at| self.hidden(at).is_zero())
    }

    /// Returns h, the hidden share of the part about `at`.
    pub fn hidden(&self, at: DVec2) -> Bounded {
        let by =
            |five: &Option<Five>, off: f64| five.as_ref().map_or(0.0, |five| share(five, at, off));
        let value = by(&self.0[0], 0.0);
        let least = self.0.iter().map(|f| by(f, -1.0)).fold(value, f64::min);
        let most = self.0.iter().map(|f| by(f, 1.0)).fold(value, f64::max);
        Bounded::between(least, value, most)
    }
}

/// Returns the hidden share with `off` times the error added to each function.
fn share(five: &Five, at: DVec2, off: f64) -> f64 {
    let of = |k: usize| five[k].share(at, off * five[k].slack);
    let pair = |k: usize| (of(k) + of(k + 1) - 1.0).max(0.0);
    of(0) * pair(1) * pair(3)
}

/// Computes the five functions; `side` is |a| and `sign` that of a, the source's distance from the
/// plane.
fn five(r: &Rectangle, source: Source, patch: &Patch, side: f64, sign: f64, slack: f64) -> Five {
    let to_q = patch.q - r.center;
    let (from, is_near) = match source {
        Source::At(p) => (p - r.center, 1.0),
        Source::Toward(w) => (w, 0.0),
    };
    let tolerance = IN_PLANE * to_q.abs().element_sum();
    let depth = |x: DVec3| -sign * r.normal.dot(x);
    // D |w|² ± X. D's constant |a| counts if `x` is a place, not a step.
    let edge = |w: DVec3, turn: f64, x: DVec3, place: f64| {
        let e = depth(x);
        (place * side + is_near * e) * w.length_squared()
            + turn * (side * w.dot(x) + e * w.dot(from))
    };
    let linear = |f: &dyn Fn(DVec3, f64) -> f64, slack: f64| {
        let gain = DVec2::new(f(patch.u, 0.0), f(patch.v, 0.0));
        Linear { at_q: f(to_q, 1.0), gain, slack }
    };
    // Sides and lengths along w err by `slack`, unit directions and their slopes by a few
    // roundings. Half of the gains' error goes into the ramp.
    let size = patch.u.length() + patch.v.length();
    let reach = to_q.length() + 2.0 * size;
    let of_edge = |w: DVec3| {
        let (side_slack, of_source) =
            if is_near > 0.0 { (slack, slack) } else { (OF_UNITS, OF_UNITS) };
        let of_depth = slack * (from.length() + is_near * w.length());
        w.length()
            * (side_slack * (w.length() + reach) + side * slack + of_depth + reach * of_source)
    };
    let of = |w: DVec3, turn: f64| linear(&|x, place| edge(w, turn, x, place), of_edge(w));
    let plane = linear(&|x, place| depth(x) - place * tolerance, slack + OF_UNITS * size);
    [plane, of(r.u, 1.0), of(r.u, -1.0), of(r.v, 1.0), of(r.v, -1.0)]
}
