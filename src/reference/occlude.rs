//! Whether a surface's rectangle hides one point from another, or a light from a point: model.md
//! §11 "transmit".

use glam::DVec3;

use crate::model::light::Light;
use crate::model::surface::Surface;

/// A point nearer to a rectangle's plane than this share of its distance (the sum of the offset's
/// components) from the centre lies in it: 16 roundings of f32, in which such a point is given.
pub const IN_PLANE: f64 = 1.0 / 1_048_576.0;

/// A surface's rectangle, relative to the lighting origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    pub center: DVec3,
    pub u: DVec3,
    pub v: DVec3,
    pub normal: DVec3,
    /// Half axes of one of its facets.
    pub facet: (DVec3, DVec3),
}

impl Rectangle {
    /// `origin`: the lighting origin.
    pub fn new(surface: &Surface, origin: DVec3) -> Rectangle {
        let (u, v, normal) = (surface.u, surface.v, surface.normal());
        Rectangle { center: surface.center - origin, u, v, normal, facet: surface.facet_axes() }
    }

    /// Signed distance of `x` from the plane, 0 in it.
    pub fn side(&self, x: DVec3) -> f64 {
        let o = x - self.center;
        let e = self.normal.dot(o);
        if e.abs() > IN_PLANE * o.abs().element_sum() { e } else { 0.0 }
    }

    /// Whether it lies between `p` and `q`, from whichever side. What lies in its plane is not
    /// hidden.
    pub fn hides(&self, p: DVec3, q: DVec3) -> bool {
        let (a, b) = (self.side(p), self.side(q));
        a * b.signum() < 0.0 && b != 0.0 && self.holds(p + (q - p) * (a / (a - b)))
    }

    /// Whether it lies before `p` along `d` without end.
    pub fn shades(&self, p: DVec3, d: DVec3) -> bool {
        let (a, b) = (self.side(p), self.normal.dot(d));
        a * b.signum() < 0.0 && b != 0.0 && self.holds(p - d * (a / b))
    }

    /// Whether `x`, a point of its plane, is within its edges.
    fn holds(&self, x: DVec3) -> bool {
        let o = x - self.center;
        o.dot(self.u).abs() <= self.u.length_squared()
            && o.dot(self.v).abs() <= self.v.length_squared()
    }
}

/// Whether no rectangle but the `i_own`-th hides `light` from `p`.
pub fn is_clear(rectangles: &[Rectangle], i_own: u32, p: DVec3, light: &Light) -> bool {
    let hides = |r: &Rectangle| match light {
        Light::Point { position, .. } | Light::Spot { position, .. } => r.hides(p, *position),
        _ => r.shades(p, light.arrival(p).toward),
    };
    !rectangles.iter().zip(0u32..).any(|(r, i)| i != i_own && hides(r))
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn a_table_hides_what_is_above_it_from_what_is_below() {
        let t = table();
        let (below, above) = (DVec3::new(0.0, 0.0, 3.0), DVec3::new(2.0, 4.0, 3.0));
        assert!(t.hides(below, above) && t.hides(above, below));
        // Both above; ending below; past the edge at x = 3, of which the edge itself still hides.
        assert!(!t.hides(above + DVec3::Y, above) && !t.hides(below, DVec3::new(2.0, 1.9, 3.0)));
        let under = |x: f64| DVec3::new(x, 1.0, 3.0);
        assert!(
            t.hides(under(3.0), under(3.0) + 2.0 * DVec3::Y)
                && t.hides(under(2.0), DVec3::new(4.0, 3.0, 4.0))
        );
        assert!(!t.hides(under(3.0 + 1e-9), under(3.0 + 1e-9) + 2.0 * DVec3::Y));
    }

    #[test]
    fn a_table_shades_what_the_light_passes_through_it_to() {
        let t = table();
        let below = DVec3::new(1.0, -5.0, 3.0);
        assert!(
            t.shades(below, DVec3::Y)
                && !t.shades(below, DVec3::NEG_Y)
                && !t.shades(below, DVec3::X)
        );
        // 7 up and 2 aside is the edge, in exact numbers.
        assert!(
            t.shades(below, DVec3::new(2.0, 7.0, 0.0))
                && !t.shades(below, DVec3::new(2.0, 6.9, 0.0))
        );
        assert!(t.shades(below + 10.0 * DVec3::Y, DVec3::NEG_Y));
    }

    #[test]
    fn what_lies_in_the_plane_is_not_hidden() {
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
    fn the_facet_s_own_rectangle_does_not_count() {
        let lamp = Light::Point {
            position: DVec3::new(1.0, 9.0, 3.0),
            intensity: DVec3::ONE,
            radius: 1e-3,
        };
        let sky = Light::Sky { irradiance: DVec3::ONE, constant: 0.0 };
        let below = DVec3::new(1.0, 0.0, 3.0);
        for light in [lamp, sky] {
            assert!(
                !is_clear(&[table()], 1, below, &light) && is_clear(&[table()], 0, below, &light)
            );
            assert!(is_clear(&[], 0, below, &light));
        }
    }
}
