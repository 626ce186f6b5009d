//! Occlusion of a ray by rectangles as f32 decides it (shaders/include/occlude.glsl): a verdict
//! that holds for every rounding, or none near edges and planes.

use glam::DVec3;
use nimbus::model::light::Light;
use nimbus::model::surface::Surface;
use nimbus::reference::occlude::IN_PLANE;

use crate::bounded::{Bounded, dot};
use crate::lights::arrival;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    Clear,
    Hidden,
    Unsure,
}

type Point = [Bounded; 3];

/// Vectors that are f32 numbers.
fn exact(v: DVec3) -> Point {
    v.to_array().map(Bounded::exact)
}

fn plus(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|i| a[i].plus(b[i]))
}

fn minus(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|i| a[i].minus(b[i]))
}

fn times(a: Point, by: Bounded) -> Point {
    a.map(|a| a.times(by))
}

/// Returns whether a ≤ b, if that is certain.
fn at_most(a: Bounded, b: Bounded) -> Option<bool> {
    ((a.value - b.value).abs() > a.error + b.error).then_some(a.value <= b.value)
}

fn absolute(a: Bounded) -> Bounded {
    Bounded { value: a.value.abs(), error: a.error }
}

fn normal(s: &Surface) -> Point {
    s.normal().to_array().map(Bounded::once)
}

/// Returns the signed distance from the plane, or exactly 0 within it; None if that is uncertain.
fn side(s: &Surface, p: Point) -> Option<Bounded> {
    let o = minus(p, exact(s.center));
    let e = dot(normal(s), o);
    let [x, y, z] = o.map(absolute);
    let threshold = x.plus(y).plus(z).times(Bounded::exact(IN_PLANE));
    Some(if at_most(absolute(e), threshold)? { Bounded::exact(0.0) } else { e })
}

/// Returns whether the signs differ; None for a direction along the plane.
fn are_apart(a: Bounded, b: Bounded) -> Option<bool> {
    // A sum of exact zeros is 0, except for underflow.
    const NOTHING: f64 = 1e-30;
    let sign = |v: Bounded| match v {
        v if v.value == 0.0 && v.error < NOTHING => Some(0.0),
        v if v.value.abs() > v.error => Some(v.value.signum()),
        _ => None,
    };
    match (sign(a), sign(b)) {
        (Some(0.0), _) | (_, Some(0.0)) => Some(false),
        (Some(a), Some(b)) => Some(a != b),
        _ => None,
    }
}

fn holds(s: &Surface, x: Point) -> Option<bool> {
    let o = minus(x, exact(s.center));
    let within =
        |axis: DVec3| at_most(absolute(dot(o, exact(axis))), dot(exact(axis), exact(axis)));
    match (within(s.u), within(s.v)) {
        (Some(false), _) | (_, Some(false)) => Some(false),
        (Some(true), Some(true)) => Some(true),
        _ => None,
    }
}

fn hides(s: &Surface, p: Point, light: &Light) -> Option<bool> {
    let (a, b, along) = match *light {
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            let q = exact(position);
            (side(s, p)?, side(s, q)?, minus(q, p))
        }
        _ => {
            let d = arrival(light, [0.0; 3]).toward;
            (side(s, p)?, dot(normal(s), d), d)
        }
    };
    if !are_apart(a, b)? {
        return Some(false);
    }
    match light {
        Light::Point { .. } | Light::Spot { .. } => {
            holds(s, plus(p, times(along, a.over(a.minus(b)))))
        }
        _ => holds(s, minus(p, times(along, a.over(b)))),
    }
}

/// Returns whether any surface except `i_own` hides the light from `p`.
pub fn verdict(surfaces: &[Surface], i_own: u32, p: Point, light: &Light) -> Verdict {
    let others = surfaces.iter().zip(0u32..).filter(|(_, i)| *i != i_own);
    let all: Vec<Option<bool>> = others.map(|(s, _)| hides(s, p, light)).collect();
    match (all.contains(&Some(true)), all.contains(&None)) {
        (true, _) => Verdict::Hidden,
        (_, true) => Verdict::Unsure,
        _ => Verdict::Clear,
    }
}
