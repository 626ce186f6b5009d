//! What lies between two points, or between a point and a light: rectangles, which hide or do not,
//! and blobs, which let e^{−(1−g)τ} through (model.md §7, §8).

use glam::{DVec2, DVec3};

use crate::model::light::Light;
use crate::model::surface::Surface;
use crate::reference::Blob;
use crate::reference::grid::optical_depth_exact;

/// A point nearer to a rectangle's plane than this share of its distance |x|+|y|+|z| from the
/// centre lies in it, and what lies in it is not hidden by it: the model's rule, wide enough for
/// coordinates rounded to f32 (a few 2^-24).
pub const IN_PLANE: f64 = 1.0 / (1u32 << 20) as f64;

/// Its edges belong to a rectangle, whatever their rounding: so walls that meet let nothing
/// through. Some thousand f64 roundings of a coordinate.
pub const AT_EDGE: f64 = 1e-12;

/// A surface with what every test of it needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    pub center: DVec3,
    /// Half axes.
    pub u: DVec3,
    pub v: DVec3,
    pub normal: DVec3,
}

/// Where light or sight comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    At(DVec3),
    /// Infinitely far along this unit vector.
    Toward(DVec3),
}

impl Rect {
    pub fn of(s: &Surface) -> Rect {
        Rect { center: s.center, u: s.u, v: s.v, normal: s.normal() }
    }

    /// The point at `s` half axes along u and `t` along v.
    pub fn point(&self, s: f64, t: f64) -> DVec3 {
        self.center + s * self.u + t * self.v
    }

    /// Squared length of the step `d` in (s, t).
    pub fn length_squared(&self, d: DVec2) -> f64 {
        d.x * d.x * self.u.length_squared() + d.y * d.y * self.v.length_squared()
    }

    /// Signed distance of `p` from the plane; 0 within it.
    pub fn side_of(&self, p: DVec3) -> f64 {
        let o = p - self.center;
        let e = self.normal.dot(o);
        if e.abs() > IN_PLANE * o.abs().element_sum() { e } else { 0.0 }
    }

    /// The rectangle's point nearest to `p`.
    pub fn nearest(&self, p: DVec3) -> DVec3 {
        let along =
            |axis: DVec3| ((p - self.center).dot(axis) / axis.length_squared()).clamp(-1.0, 1.0);
        self.point(along(self.u), along(self.v))
    }

    fn holds(&self, x: DVec3) -> bool {
        let o = x - self.center;
        let within = |axis: DVec3| o.dot(axis).abs() <= (1.0 + AT_EDGE) * axis.length_squared();
        within(self.u) && within(self.v)
    }

    /// Where on the way from `p` (0) to `source` (1, or in lengths where it is infinitely far) the
    /// rectangle is met.
    pub fn met(&self, p: DVec3, source: Source) -> Option<f64> {
        let a = self.side_of(p);
        let (b, way) = match source {
            Source::At(q) => (self.side_of(q), q - p),
            Source::Toward(d) => (self.normal.dot(d), d),
        };
        if a * b >= 0.0 {
            return None;
        }
        let t = match source {
            Source::At(_) => a / (a - b),
            Source::Toward(_) => -a / b,
        };
        self.holds(p + t * way).then_some(t)
    }
}

/// Whether no rectangle lies between `p` and `source`.
pub fn is_open(rects: &[Rect], p: DVec3, source: Source) -> bool {
    rects.iter().all(|r| r.met(p, source).is_none())
}

/// Whether no surface lies between `p` and `q`.
pub fn visible(surfaces: &[Surface], p: DVec3, q: DVec3) -> bool {
    surfaces.iter().all(|s| Rect::of(s).met(p, Source::At(q)).is_none())
}

/// e^{−(1−g)τ}, g = `forward`, τ through all blobs between `p` and `source`, closed form.
pub fn transmittance(blobs: &[Blob], forward: f64, p: DVec3, source: Source) -> f64 {
    if blobs.is_empty() {
        return 1.0;
    }
    let (d, length) = match source {
        Source::At(q) => {
            let length = (q - p).length();
            if length == 0.0 {
                return 1.0;
            }
            ((q - p) / length, length)
        }
        Source::Toward(d) => (d, f64::INFINITY),
    };
    (-(1.0 - forward) * optical_depth_exact(blobs, p, d, length)).exp()
}

/// Where `light` stands as seen from anywhere; the sky's light comes from above.
pub fn source_of(light: &Light) -> Source {
    match *light {
        Light::Point { position, .. } | Light::Spot { position, .. } => Source::At(position),
        Light::Directional { .. } | Light::Sky { .. } => {
            Source::Toward(light.arrival(DVec3::ZERO).toward)
        }
    }
}

/// V of `light` at `p`: 0 behind a rectangle, else what the blobs let through.
pub fn in_light(rects: &[Rect], blobs: &[Blob], forward: f64, p: DVec3, light: &Light) -> f64 {
    let source = source_of(light);
    if is_open(rects, p, source) { transmittance(blobs, forward, p, source) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn floor(y: f64) -> Surface {
        let center = DVec3::new(0.0, y, 0.0);
        Surface { center, u: DVec3::Z, v: 2.0 * DVec3::X, i_material: 0, subdivide: [1, 1] }
    }

    #[test]
    fn a_rectangle_hides_what_is_behind_it_from_both_sides_and_nothing_in_its_plane() {
        let s = [floor(1.0)];
        let at = |x, y, z| DVec3::new(x, y, z);
        assert!(
            !visible(&s, at(0.0, 0.0, 0.0), at(0.0, 2.0, 0.0))
                && !visible(&s, at(0.0, 2.0, 0.0), DVec3::ZERO)
        );
        // Half way up the ray from x = 0 to x = 3.9 passes at 1.95, to x = 4.1 at 2.05, outside.
        assert!(
            !visible(&s, DVec3::ZERO, at(3.9, 2.0, 0.0))
                && visible(&s, DVec3::ZERO, at(4.1, 2.0, 0.0))
        );
        assert!(
            visible(&s, DVec3::ZERO, at(0.0, 0.99, 0.0))
                && visible(&s, DVec3::ZERO, at(0.0, 1.0, 0.0))
        );
        // Off the plane by less than 2^-20 of the distance, then by more.
        assert!(visible(&s, DVec3::ZERO, at(1.0, 1.0 + 0.9 * IN_PLANE, 0.0)));
        assert!(!visible(&s, DVec3::ZERO, at(1.0, 1.0 + 1.1 * IN_PLANE, 0.0)));
        let rects = s.map(|s| Rect::of(&s));
        assert_eq!(rects[0].met(DVec3::ZERO, Source::Toward(DVec3::Y)), Some(1.0));
        assert_eq!(rects[0].met(DVec3::ZERO, Source::At(4.0 * DVec3::Y)), Some(0.25));
        assert!(is_open(&rects, DVec3::ZERO, Source::Toward(DVec3::NEG_Y)));
        // A lamp under the rectangle is seen, one above is not; the sun from above is not.
        let lamp =
            |y| Light::Point { position: at(0.0, y, 0.0), intensity: DVec3::ONE, radius: 0.0 };
        let v = |light| in_light(&rects, &[], 0.0, DVec3::ZERO, &light);
        let sun = Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::ONE };
        assert_eq!((v(lamp(0.9)), v(lamp(1.1)), v(sun)), (1.0, 0.0, 0.0));
    }

    #[test]
    fn blobs_by_hand() {
        let blob = Blob { aspect: 1.0, position: DVec3::ZERO, sigma: 2.0, kappa: 0.5 };
        let depth = |p: DVec3, s| -transmittance(&[blob], 0.0, p, s).ln();
        // Through the centre √(2π)κσ = √(2π); from the centre on half of it.
        let whole = 2.506_628_274_631_000_5;
        let far = DVec3::new(-100.0, 0.0, 0.0);
        assert!((depth(far, Source::Toward(DVec3::X)) - whole).abs() < 1e-14);
        assert!((depth(DVec3::ZERO, Source::Toward(DVec3::Y)) - whole / 2.0).abs() < 1e-14);
        // Within ±σ: erf(1/√2) = 0.6826894921370859; passing at b = σ: e^{−1/2} =
        // 0.6065306597126334 of it.
        let passing = depth(DVec3::new(-2.0, 2.0, 0.0), Source::At(DVec3::new(2.0, 2.0, 0.0)));
        assert!(
            (passing - whole * 0.682_689_492_137_085_9 * 0.606_530_659_712_633_4).abs() < 1e-14
        );
        // Droplets that scatter forward count for 1 − g.
        let v = transmittance(&[blob, blob], 0.85, far, Source::Toward(DVec3::X));
        assert!((v - (-0.3 * whole).exp()).abs() < 1e-14);
        assert_eq!(transmittance(&[blob], 0.0, far, Source::At(far)), 1.0);
    }
}
