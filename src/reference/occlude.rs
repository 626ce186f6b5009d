//! Surfaces as rectangles, and whether they hide one point from another or a light from a point:
//! passes.md "transmit".

use glam::{DVec2, DVec3};

use crate::model::light::Light;
use crate::model::surface::Surface;

/// A point nearer to a rectangle's plane than this share of its distance |x|+|y|+|z| from the
/// centre lies in the plane, and is not hidden by it. 16 roundings of f32, in which devices hold
/// such points.
pub const IN_PLANE: f64 = 1.0 / 1_048_576.0;

/// The origin of light or sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// A point.
    At(DVec3),
    /// Infinitely far along this unit vector.
    Toward(DVec3),
}

/// Returns where `light` comes from, seen from anywhere. A sky's light comes from above.
pub fn source_of(light: &Light) -> Source {
    match *light {
        Light::Point { position, .. } | Light::Spot { position, .. } => Source::At(position),
        Light::Directional { .. } | Light::Sky { .. } => {
            Source::Toward(light.arrival(DVec3::ZERO).toward)
        }
    }
}

/// A surface's rectangle, relative to the lighting origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Centre.
    pub center: DVec3,
    /// Half axis along u.
    pub u: DVec3,
    /// Half axis along v, perpendicular to u.
    pub v: DVec3,
    /// Unit normal of the front.
    pub normal: DVec3,
    /// Half axes of one of its facets.
    pub facet: (DVec3, DVec3),
}

impl Rectangle {
    /// Returns the rectangle of `surface` relative to `origin`.
    pub fn new(surface: &Surface, origin: DVec3) -> Rectangle {
        let (u, v, normal) = (surface.u, surface.v, surface.normal());
        Rectangle { center: surface.center - origin, u, v, normal, facet: surface.facet_axes() }
    }

    /// Returns the point at `s` half axes along u and `t` along v.
    pub fn point(&self, s: f64, t: f64) -> DVec3 {
        self.center + s * self.u + t * self.v
    }

    /// Returns the squared length of the step `d` in (s, t).
    pub fn length_squared(&self, d: DVec2) -> f64 {
        d.x * d.x * self.u.length_squared() + d.y * d.y * self.v.length_squared()
    }

    /// Returns the signed distance of `x` from the plane, 0 in it ([`IN_PLANE`]).
    pub fn side(&self, x: DVec3) -> f64 {
        let o = x - self.center;
        let e = self.normal.dot(o);
        if e.abs() > IN_PLANE * o.abs().element_sum() { e } else { 0.0 }
    }

    /// Returns the rectangle's point nearest to `p`.
    pub fn nearest(&self, p: DVec3) -> DVec3 {
        let along =
            |axis: DVec3| ((p - self.center).dot(axis) / axis.length_squared()).clamp(-1.0, 1.0);
        self.point(along(self.u), along(self.v))
    }

    /// Returns where the way from `p` to `source` meets the rectangle, enlarged by the share
    /// `tolerance`: as a share of the way, or in lengths if the source is infinitely far.
    pub fn met(&self, p: DVec3, source: Source, tolerance: f64) -> Option<f64> {
        let a = self.side(p);
        let (b, way) = match source {
            Source::At(q) => (self.side(q), q - p),
            Source::Toward(d) => (self.normal.dot(d), d),
        };
        // Written so that a product that underflows does not count as 0.
        if b == 0.0 || a * b.signum() >= 0.0 {
            return None;
        }
        let t = match source {
            Source::At(_) => a / (a - b),
            Source::Toward(_) => -a / b,
        };
        let o = p + t * way - self.center;
        let holds = |axis: DVec3| o.dot(axis).abs() <= (1.0 + tolerance) * axis.length_squared();
        (holds(self.u) && holds(self.v)).then_some(t)
    }
}

/// Returns whether no rectangle but the `i_own`-th hides `light` from `p`.
pub fn is_clear(rectangles: &[Rectangle], i_own: u32, p: DVec3, light: &Light) -> bool {
    let source = source_of(light);
    let others = rectangles.iter().zip(0u32..).filter(|(_, i)| *i != i_own);
    !others.into_iter().any(|(r, _)| r.met(p, source, 0.0).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Rectangle {
        fn hides(&self, p: DVec3, q: DVec3) -> bool {
            self.met(p, Source::At(q), 0.0).is_some()
        }

        fn shades(&self, p: DVec3, d: DVec3) -> bool {
            self.met(p, Source::Toward(d), 0.0).is_some()
        }
    }

    /// 4 × 2 about (1, 2, 3), facing up.
    fn table() -> Rectangle {
        let surface = Surface {
            center: DVec3::new(1.0, 2.0, 3.0),
            u: DVec3::Z,
            v: 2.0 * DVec3::X,
            i_material: 0,
            subdivide: [1, 1],
        };
        Rectangle::new(&surface, DVec3::ZERO)
    }

    #[test]
    fn a_table_hides_points_above_from_points_below() {
        let t = table();
        let (below, above) = (DVec3::new(0.0, 0.0, 3.0), DVec3::new(2.0, 4.0, 3.0));
        assert!(t.hides(below, above) && t.hides(above, below));
        // Both above; ending below; past the edge at x = 3, where the edge itself still hides.
        assert!(!t.hides(above + DVec3::Y, above) && !t.hides(below, DVec3::new(2.0, 1.9, 3.0)));
        let under = |x: f64| DVec3::new(x, 1.0, 3.0);
        assert!(
            t.hides(under(3.0), under(3.0) + 2.0 * DVec3::Y)
                && t.hides(under(2.0), DVec3::new(4.0, 3.0, 4.0))
        );
        assert!(!t.hides(under(3.0 + 1e-9), under(3.0 + 1e-9) + 2.0 * DVec3::Y));
    }

    #[test]
    fn a_table_shades_points_behind_it() {
        let t = table();
        let below = DVec3::new(1.0, -5.0, 3.0);
        assert!(
            t.shades(below, DVec3::Y)
                && !t.shades(below, DVec3::NEG_Y)
                && !t.shades(below, DVec3::X)
        );
        // 7 up and 2 aside meets the edge in exact numbers.
        assert!(
            t.shades(below, DVec3::new(2.0, 7.0, 0.0))
                && !t.shades(below, DVec3::new(2.0, 6.9, 0.0))
        );
        assert!(t.shades(below + 10.0 * DVec3::Y, DVec3::NEG_Y));
    }

    #[test]
    fn points_in_the_plane_are_not_hidden() {
        let t = table();
        // f32's own rounding of such a point, at a distance of a thousand: 3e-5.
        for off in [0.0, 3e-5, -3e-5] {
            let p = DVec3::new(1000.0, 2.0 + off, 3.0);
            assert_eq!(t.side(p), 0.0);
            assert!(!t.hides(p, DVec3::new(1.0, 2.0, 3.0)) && !t.shades(p, DVec3::NEG_X));
        }
        let near = DVec3::new(1.5, 2.0 - 1e-6, 3.0);
        assert!(t.side(near) < 0.0 && t.shades(near, DVec3::Y));
    }

    #[test]
    fn a_facets_own_rectangle_does_not_hide() {
        let lamp = Light::Point {
            position: DVec3::new(1.0, 9.0, 3.0),
            intensity: DVec3::ONE,
            radius: 1e-3,
        };
        let sky = Light::even_sky(DVec3::ONE, 0.0);
        let below = DVec3::new(1.0, 0.0, 3.0);
        for light in [lamp, sky] {
            assert!(
                !is_clear(&[table()], 1, below, &light) && is_clear(&[table()], 0, below, &light)
            );
            assert!(is_clear(&[], 0, below, &light));
        }
    }
}
