//! Shadows as polygons. The points that a rectangle hides from a source are the intersection of
//! five half-spaces, so that its shadow on another rectangle is a convex polygon. The lit and the
//! visible part of a rectangle are unions of convex polygons, exactly, and the integrand is smooth
//! within each.
//!
//! Polygons lie in (s, t), the rectangle's coordinates in half axes, [−1, 1]².

use glam::{DVec2, DVec3};

use super::visibility::AT_EDGE;
use crate::reference::occlude::{Rectangle, Source};

/// Corners in order.
pub type Polygon = Vec<DVec2>;

/// The whole rectangle.
pub const WHOLE: [DVec2; 4] =
    [DVec2::new(-1.0, -1.0), DVec2::new(1.0, -1.0), DVec2::new(1.0, 1.0), DVec2::new(-1.0, 1.0)];

/// Least area of a polygon. Smaller ones are slivers of a rounding's width and hold as little
/// light; the whole has area 4.
const LEAST_AREA: f64 = 1e-20;

/// The line g₀ + g₁ s + g₂ t = 0 in a rectangle's coordinates; its inside is where it is positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line(pub [f64; 3]);

impl Line {
    /// Returns the line where the plane through `point` with `normal` meets the plane of `rect`.
    pub fn of_plane(rect: &Rectangle, normal: DVec3, point: DVec3) -> Line {
        Line([normal.dot(rect.center - point), normal.dot(rect.u), normal.dot(rect.v)])
    }

    fn at(&self, x: DVec2) -> f64 {
        self.0[0] + self.0[1] * x.x + self.0[2] * x.y
    }

    fn greatest(&self) -> f64 {
        self.0.iter().map(|g| g.abs()).sum()
    }

    /// Returns whether no point of the whole rectangle is inside.
    fn excludes_all(&self) -> bool {
        self.0[0] + self.0[1].abs() + self.0[2].abs() <= 0.0
    }
}

/// Returns the part of `polygon` on the line's positive side (`sign` 1) or negative side (−1).
pub fn cut(polygon: &[DVec2], line: &Line, sign: f64) -> Polygon {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (ga, gb) = (sign * line.at(a), sign * line.at(b));
        if ga >= 0.0 {
            kept.push(a);
        }
        if (ga > 0.0 && gb < 0.0) || (ga < 0.0 && gb > 0.0) {
            kept.push(a + (b - a) * (ga / (ga - gb)));
        }
    }
    if area(&kept) > LEAST_AREA { kept } else { Vec::new() }
}

/// Returns the area of a convex polygon.
pub fn area(polygon: &[DVec2]) -> f64 {
    let fan = |i: usize| (polygon[i] - polygon[0]).perp_dot(polygon[i + 1] - polygon[0]);
    (1..polygon.len().saturating_sub(1)).map(fan).sum::<f64>().abs() * 0.5
}

/// Returns the lines that bound the shadow of `blocker` on `rect` from `source`; `None` if there is
/// no shadow.
pub fn shadow(rect: &Rectangle, blocker: &Rectangle, source: Source) -> Option<[Line; 5]> {
    let side = match source {
        Source::At(a) => blocker.side(a),
        Source::Toward(d) => blocker.normal.dot(d),
    };
    // A blocker does not hide a source in its plane, nor a rectangle in its plane.
    let far = |x: DVec2| blocker.side(rect.point(x.x, x.y)) * side < 0.0;
    if side == 0.0 || !WHOLE.iter().any(|&x| far(x)) {
        return None;
    }
    let edge = |out: DVec3, along: DVec3| {
        let middle = blocker.center + out;
        let toward = match source {
            Source::At(a) => a - middle,
            Source::Toward(d) => d,
        };
        let normal = along.cross(toward);
        // The blocker's centre is inside.
        let line =
            Line::of_plane(rect, if normal.dot(out) < 0.0 { normal } else { -normal }, middle);
        let reach = rect.center.distance(middle) + rect.u.length() + rect.v.length();
        // The rectangle lies in the plane of the shadow's side and touches it, as a wall touches
        // its ceiling's shadow of the sky.
        if line.greatest() <= AT_EDGE * reach * normal.length() {
            Line([1.0, 0.0, 0.0])
        } else {
            line
        }
    };
    let behind = Line::of_plane(rect, -side.signum() * blocker.normal, blocker.center);
    let (u, v) = (blocker.u, blocker.v);
    let lines = [behind, edge(u, v), edge(-u, v), edge(v, u), edge(-v, u)];
    (!lines.iter().any(Line::excludes_all)).then_some(lines)
}

/// Returns the part of `polygon` inside all `lines`, and the rest in convex parts.
pub fn split(polygon: Polygon, lines: &[Line]) -> (Polygon, Vec<Polygon>) {
    let inside = lines.iter().fold(polygon.clone(), |p, line| cut(&p, line, 1.0));
    if inside.is_empty() {
        return (inside, vec![polygon]);
    }
    let (mut rest, mut outside) = (polygon, Vec::new());
    for line in lines {
        let part = cut(&rest, line, -1.0);
        if !part.is_empty() {
            outside.push(part);
            rest = cut(&rest, line, 1.0);
        }
    }
    (inside, outside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::area::visibility::met;

    fn rect(center: DVec3, u: DVec3, v: DVec3) -> Rectangle {
        Rectangle { center, u, v, normal: u.cross(v).normalize(), facet: (u, v) }
    }

    #[test]
    fn a_square_cut_by_lines() {
        // s > 1/2 keeps a quarter, s + t > 0 a half.
        let right = cut(&WHOLE, &Line([-0.5, 1.0, 0.0]), 1.0);
        assert_eq!((area(&WHOLE), area(&right), right.len()), (4.0, 1.0, 4));
        assert_eq!(area(&cut(&WHOLE, &Line([0.0, 1.0, 1.0]), -1.0)), 2.0);
        assert!(cut(&WHOLE, &Line([-1.5, 1.0, 0.0]), 1.0).is_empty());
        // Touching along an edge is not inside.
        assert!(cut(&WHOLE, &Line([-1.0, 1.0, 0.0]), 1.0).is_empty());
    }

    #[test]
    fn shadows_by_hand() {
        let floor = rect(DVec3::ZERO, 4.0 * DVec3::Z, 4.0 * DVec3::X);
        let blocker = rect(DVec3::Y, 0.5 * DVec3::Z, DVec3::X);
        let shadow_of = |r: &Rectangle, source| {
            shadow(&floor, r, source)
                .map_or(0.0, |lines| area(&split(WHOLE.to_vec(), &lines).0) * 16.0)
        };
        // From a lamp at twice its height the shadow has twice the edges; from the sun the edges of
        // the blocker.
        assert!((shadow_of(&blocker, Source::At(2.0 * DVec3::Y)) - 8.0).abs() < 1e-14);
        assert!(
            (shadow_of(&blocker, Source::Toward(DVec3::new(0.6, 0.8, 0.0))) - 2.0).abs() < 1e-14
        );
        // A lamp between blocker and floor, one in the blocker's plane, a sun from below.
        assert_eq!(shadow_of(&blocker, Source::At(0.5 * DVec3::Y)), 0.0);
        assert_eq!(shadow_of(&blocker, Source::At(DVec3::new(3.0, 1.0, 0.0))), 0.0);
        assert_eq!(shadow_of(&blocker, Source::Toward(DVec3::NEG_Y)), 0.0);
        // Half of it beyond the floor's edge.
        let edge = rect(DVec3::new(4.0, 1.0, 0.0), 0.5 * DVec3::Z, DVec3::X);
        assert!((shadow_of(&edge, Source::Toward(DVec3::Y)) - 1.0).abs() < 1e-14);
        // A wall across the floor hides from a lamp on the left the floor on its right, up to where
        // the ray over its edge lands: lamp at (−2, 2), edge at (0, 1): x = 2. In z the shadow
        // spreads from ±1 to ±2: a trapezium of 6.
        let wall = rect(DVec3::ZERO, DVec3::Y, DVec3::Z);
        assert!((shadow_of(&wall, Source::At(DVec3::new(-2.0, 2.0, 0.0))) - 6.0).abs() < 1e-13);
        // A blocker in the floor's plane shades nothing there.
        assert_eq!(
            shadow_of(&rect(DVec3::ZERO, DVec3::Z, DVec3::X), Source::Toward(DVec3::Y)),
            0.0
        );
    }

    #[test]
    fn shadow_polygons_agree_with_point_tests() {
        // A skew blocker and a skew floor: every point of a grid is in the shadow's polygon exactly
        // if `met` says so.
        let floor =
            rect(DVec3::ZERO, DVec3::new(2.0, 0.3, 0.0), DVec3::new(-0.45, 3.0, 0.0).rotate_y(0.4));
        let floor = Rectangle { v: floor.normal.cross(floor.u), ..floor };
        let blocker =
            rect(DVec3::new(0.2, 0.4, 0.7), DVec3::new(0.5, 0.1, 0.4), DVec3::new(-0.1, 0.5, 0.0));
        for source in [
            Source::At(DVec3::new(0.3, -0.2, 3.0)),
            Source::Toward(DVec3::new(0.2, 0.3, 0.9).normalize()),
        ] {
            let lines = shadow(&floor, &blocker, source).expect("there is a shadow");
            let (inside, outside) = split(WHOLE.to_vec(), &lines);
            assert!(
                (area(&inside) + outside.iter().map(|p| area(p)).sum::<f64>() - 4.0).abs() < 1e-14
            );
            let mut n_inside = 0;
            for i in 0..10_000u32 {
                let x = DVec2::new(f64::from(i % 100), f64::from(i / 100)) * 0.02 - 0.99;
                let hidden = met(&blocker, floor.point(x.x, x.y), source).is_some();
                assert_eq!(hidden, lines.iter().all(|l| l.at(x) > 0.0), "{x}");
                n_inside += u32::from(hidden);
            }
            assert!(n_inside > 500 && (f64::from(n_inside) * 4e-4 - area(&inside)).abs() < 0.02);
        }
    }
}
