//! Visibility between two points, or between a point and a light: rectangles hide entirely, blobs
//! transmit e^{−(1−g)τ} (model.md §7, §8).

use glam::DVec3;

use crate::reference::Blob;
use crate::reference::grid::optical_depth_exact;
use crate::reference::occlude::{Rectangle, Source};

/// Enlargement of rectangles, as a share, so that walls that meet let nothing through whatever
/// their edges' rounding: some thousand f64 roundings of a coordinate.
pub const AT_EDGE: f64 = 1e-12;

/// Returns where the way from `p` to `source` meets `rectangle`, edges included.
pub fn met(rectangle: &Rectangle, p: DVec3, source: Source) -> Option<f64> {
    rectangle.met(p, source, AT_EDGE)
}

/// Returns whether no rectangle lies between `p` and `source`.
pub fn is_open(rectangles: &[Rectangle], p: DVec3, source: Source) -> bool {
    rectangles.iter().all(|r| met(r, p, source).is_none())
}

/// Returns e^{−(1−g)τ}, τ through all blobs between `p` and `source` in closed form. `forward` is
/// g.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::cloud::Shape;
    use crate::model::light::Light;
    use crate::model::material::Brdf;
    use crate::model::surface::Surface;
    use crate::reference::area::AreaScene;
    use crate::reference::occlude::IN_PLANE;

    fn visible(surfaces: &[Surface], p: DVec3, q: DVec3) -> bool {
        let rectangles: Vec<_> = surfaces.iter().map(|s| Rectangle::new(s, DVec3::ZERO)).collect();
        is_open(&rectangles, p, Source::At(q))
    }

    fn floor(y: f64) -> Surface {
        let center = DVec3::new(0.0, y, 0.0);
        Surface { center, u: DVec3::Z, v: 2.0 * DVec3::X, i_material: 0, subdivide: [1, 1] }
    }

    #[test]
    fn a_rectangle_hides_from_both_sides_and_nothing_in_its_plane() {
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
        let rects = s.map(|s| Rectangle::new(&s, DVec3::ZERO));
        assert_eq!(met(&rects[0], DVec3::ZERO, Source::Toward(DVec3::Y)), Some(1.0));
        assert_eq!(met(&rects[0], DVec3::ZERO, Source::At(4.0 * DVec3::Y)), Some(0.25));
        assert!(is_open(&rects, DVec3::ZERO, Source::Toward(DVec3::NEG_Y)));
        // A lamp under the rectangle is seen, one above is not; the sun from above is not.
        let lamp =
            |y| Light::Point { position: at(0.0, y, 0.0), intensity: DVec3::ONE, radius: 0.0 };
        let black = Brdf { kd: DVec3::ZERO, ks: DVec3::ZERO, ns: 0.0 };
        let scene = AreaScene::new(&s, &[black], &[], &[], 0.0, &[]);
        let v = |light| scene.visibility(DVec3::ZERO, &light);
        let sun = Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::ONE };
        assert_eq!((v(lamp(0.9)), v(lamp(1.1)), v(sun)), (1.0, 0.0, 0.0));
    }

    #[test]
    fn blobs_by_hand() {
        let blob = Blob { shape: Shape::BALL, position: DVec3::ZERO, sigma: 2.0, kappa: 0.5 };
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
        // Forward scattering leaves a share of 1 − g.
        let v = transmittance(&[blob, blob], 0.85, far, Source::Toward(DVec3::X));
        assert!((v - (-0.3 * whole).exp()).abs() < 1e-14);
        assert_eq!(transmittance(&[blob], 0.0, far, Source::At(far)), 1.0);
    }
}
