//! Drawing of surfaces, model.md §9 and passes.md "surfaces": opaque rectangles, the nearest in
//! every pixel, in f64.
//!
//! In: rectangles and eye relative to O, radiance of every facet (W m⁻² sr⁻¹, RGB). Out:
//! [row][column] of colour and view depth, row 0 at the top.

use glam::DVec3;

use super::composite::OpaquePixel;
use super::view::View;
use crate::model::surface::Surface;

/// Intersection of a ray with a rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// View depth; that of the ray itself is 1.
    pub depth: f64,
    /// s in [−1, 1]: the point is centre + s u + t v.
    pub s: f64,
    /// t in [−1, 1].
    pub t: f64,
    /// Whether the front side is seen.
    pub is_front: bool,
}

/// Returns where the line eye + z·ray meets the plane of `surface`, whatever s and t; `None` if the
/// line runs along the plane.
pub fn meet(surface: &Surface, eye: DVec3, ray: DVec3) -> Option<Hit> {
    let normal = surface.normal();
    let (from_eye, slope) = (surface.center - eye, normal.dot(ray));
    let depth = normal.dot(from_eye) / slope;
    if !depth.is_finite() {
        return None;
    }
    let p = depth * ray - from_eye;
    // Axes typed with a few digits are not quite perpendicular, so s and t solve s u + t v = p.
    let (s, t) = (p.cross(surface.v).dot(normal), surface.u.cross(p).dot(normal));
    let area = surface.u.cross(surface.v).dot(normal);
    Some(Hit { depth, s: s / area, t: t / area, is_front: slope < 0.0 })
}

/// Returns where the ray through a pixel meets `surface` itself, from the near plane on.
pub fn hit(surface: &Surface, view: &View, ray: DVec3) -> Option<Hit> {
    let hit = meet(surface, view.pose.position, ray)?;
    (hit.depth >= view.near && hit.s.abs() <= 1.0 && hit.t.abs() <= 1.0).then_some(hit)
}

/// Returns the radiance at `hit` of a surface whose facets have `facets`: bilinear between their
/// centres, constant beyond the outermost, and black on the back.
pub fn radiance(surface: &Surface, facets: &[DVec3], hit: &Hit) -> DVec3 {
    weights(surface, hit).map(|(i, weight)| weight * facets[i]).into_iter().sum()
}

/// Returns four facets and the share of each one's radiance in that at `hit`, as [`radiance`] has
/// them: all 0 on the back.
pub fn weights(surface: &Surface, hit: &Hit) -> [(usize, f64); 4] {
    let along = |x: f64, n: u32| {
        let at = (0.5 * (x + 1.0) * f64::from(n) - 0.5).clamp(0.0, f64::from(n - 1));
        let low = (at.floor() as usize).min(n as usize - 1);
        (low, (low + 1).min(n as usize - 1), at - at.floor())
    };
    let [n_u, n_v] = surface.subdivide;
    let (i0, i1, a) = along(hit.s, n_u);
    let (j0, j1, b) = along(hit.t, n_v);
    let facet = |i: usize, j: usize| j * n_u as usize + i;
    let shown = if hit.is_front { 1.0 } else { 0.0 };
    [
        (facet(i0, j0), shown * (1.0 - a) * (1.0 - b)),
        (facet(i1, j0), shown * a * (1.0 - b)),
        (facet(i0, j1), shown * (1.0 - a) * b),
        (facet(i1, j1), shown * a * b),
    ]
}

/// Returns the picture of `surfaces` at some pixels, [column, row]. `facets` is the radiance of all
/// their facets, surface after surface.
pub fn render_at(
    view: &View,
    surfaces: &[Surface],
    facets: &[DVec3],
    at: impl Iterator<Item = [u32; 2]>,
) -> Vec<OpaquePixel> {
    at.map(|[i, j]| pixel(view, surfaces, facets, view.ray(i, j))).collect()
}

/// Returns the surface seen along `ray` and the place: the nearest hit, and the last of equally
/// near ones.
pub fn seen(view: &View, surfaces: &[Surface], ray: DVec3) -> Option<(usize, Hit)> {
    let hits =
        surfaces.iter().enumerate().filter_map(|(i, s)| hit(s, view, ray).map(|hit| (i, hit)));
    hits.reduce(|nearest, next| if next.1.depth <= nearest.1.depth { next } else { nearest })
}

fn pixel(view: &View, surfaces: &[Surface], facets: &[DVec3], ray: DVec3) -> OpaquePixel {
    let Some((i, hit)) = seen(view, surfaces, ray) else { return OpaquePixel::EMPTY };
    let i_first: usize = surfaces[..i].iter().map(|s| s.n_facets() as usize).sum();
    let of = &facets[i_first..][..surfaces[i].n_facets() as usize];
    let color = radiance(&surfaces[i], of, &hit).extend(1.0).to_array();
    OpaquePixel { color, depth: hit.depth, ..OpaquePixel::EMPTY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::camera::Pose;
    use crate::model::edge::Edge;

    /// Eye at the origin, looking along −z; three by three pixels of 90 degrees: slopes −2/3, 0,
    /// 2/3.
    const VIEW: View = View {
        width: 3,
        height: 3,
        pose: Pose { position: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z },
        fov_y_rad: std::f64::consts::FRAC_PI_2,
        near: 0.5,
        edge: Edge::at(3.0),
        smallest: 0.0,
        slice: 0.0,
        n_parts: 4,
        shift: glam::DVec2::ZERO,
    };

    /// At depth `z`, facing the eye: u right, v up, 2 wide and high.
    fn wall(z: f64, subdivide: [u32; 2]) -> Surface {
        Surface { center: DVec3::NEG_Z * z, u: DVec3::X, v: DVec3::Y, i_material: 0, subdivide }
    }

    fn render(surfaces: &[Surface], facets: &[DVec3]) -> Vec<OpaquePixel> {
        let rows = (0..VIEW.height).flat_map(|j| (0..VIEW.width).map(move |i| [i, j]));
        render_at(&VIEW, surfaces, facets, rows)
    }

    #[test]
    fn a_ray_meets_a_wall_where_it_must() {
        let ray = DVec3::new(0.25, -0.125, -1.0);
        let found = hit(&wall(2.0, [1, 1]), &VIEW, ray).unwrap();
        assert_eq!(found, Hit { depth: 2.0, s: 0.5, t: -0.25, is_front: true });
        // Turned: the axes swapped, the same place seen from behind.
        let turned = Surface { u: DVec3::Y, v: DVec3::X, ..wall(2.0, [1, 1]) };
        assert_eq!(
            hit(&turned, &VIEW, ray),
            Some(Hit { depth: 2.0, s: -0.25, t: 0.5, is_front: false })
        );
        // A floor 1 below the eye, from 1 behind it to 3 before it: the ray reaches it at depth 8.
        let floor = Surface {
            center: DVec3::new(0.0, -1.0, -1.0),
            v: 2.0 * DVec3::NEG_Z,
            ..wall(0.0, [1, 1])
        };
        let beside = meet(&floor, DVec3::ZERO, ray).unwrap();
        assert!(
            beside.depth == 8.0
                && beside.s == 2.0
                && beside.is_front
                && hit(&floor, &VIEW, ray).is_none()
        );
        let steep = hit(&floor, &VIEW, DVec3::new(0.25, -0.5, -1.0)).unwrap();
        assert_eq!((steep.depth, steep.s, steep.t), (2.0, 0.5, 0.5));
        // Beyond the edge, before the near plane, behind the eye, along the plane.
        assert_eq!(hit(&wall(2.0, [1, 1]), &VIEW, DVec3::new(0.6, 0.0, -1.0)), None);
        assert_eq!(hit(&wall(0.49, [1, 1]), &VIEW, ray), None);
        assert_eq!(hit(&wall(-2.0, [1, 1]), &VIEW, ray), None);
        assert_eq!(meet(&floor, DVec3::ZERO, DVec3::NEG_Z), None);
    }

    #[test]
    fn radiance_is_bilinear_between_centres_and_constant_beyond() {
        let surface = wall(1.0, [3, 2]);
        // Centres at s = −2/3, 0, 2/3 and t = ∓1/2.
        let facets: Vec<DVec3> =
            (0..6).map(|i| DVec3::new(f64::from(i), f64::from(i * i), 1.0)).collect();
        let at =
            |s: f64, t: f64| radiance(&surface, &facets, &Hit { depth: 1.0, s, t, is_front: true });
        let is = |a: DVec3, b: [f64; 3]| (a - DVec3::from(b)).length() < 1e-13;
        assert!(is(at(0.0, -0.5), [1.0, 1.0, 1.0]) && is(at(2.0 / 3.0, 0.5), [5.0, 25.0, 1.0]));
        // A quarter from facet 1 to facet 2; half way up: between 1 and 4; the middle of 0, 1, 3,
        // 4.
        assert!(is(at(1.0 / 6.0, -0.5), [1.25, 1.75, 1.0]));
        assert!(is(at(0.0, 0.0), [2.5, 8.5, 1.0]));
        assert!(is(at(-1.0 / 3.0, 0.0), [2.0, 6.5, 1.0]));
        for (s, t, i) in
            [(-1.0, -1.0, 0), (-0.8, -0.6, 0), (1.0, -0.7, 2), (1.0, 1.0, 5), (-1.0, 0.5, 3)]
        {
            assert!(is(at(s, t), facets[i].to_array()), "{s} {t}");
        }
        let back = Hit { depth: 1.0, s: 0.0, t: 0.0, is_front: false };
        assert_eq!(radiance(&surface, &facets, &back), DVec3::ZERO);
        assert_eq!(
            radiance(&wall(1.0, [1, 1]), &facets[4..5], &Hit { is_front: true, ..back }),
            facets[4]
        );
    }

    #[test]
    fn the_nearest_is_seen_and_of_equals_the_last() {
        // At depth 1.2 a wall reaches slopes up to 1/1.2 = 0.83: all pixels. At depth 2: 0.5, the
        // middle one only.
        let colors = [DVec3::X, DVec3::Y, DVec3::Z];
        let see = |walls: &[Surface]| -> Vec<[f64; 4]> {
            render(walls, &colors[..walls.len()]).iter().map(|p| p.color).collect()
        };
        let (red, green, blue) = ([1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]);
        let (near, far) = (wall(1.2, [1, 1]), wall(2.0, [1, 1]));
        assert_eq!(see(&[near, far]), [red; 9]);
        assert_eq!(see(&[far, near]), [green; 9]);
        assert_eq!(see(&[near, far, near]), [blue; 9]);
        let middle = see(&[far]);
        assert!(middle[4] == red && middle.iter().filter(|p| **p == [0.0; 4]).count() == 8);
        let depths: Vec<f64> = render(&[far], &colors).iter().map(|p| p.depth).collect();
        assert!(depths[4] == 2.0 && depths[0] == f64::INFINITY);
        // The back is black, and it hides.
        let back = Surface { u: DVec3::NEG_X, ..near };
        assert_eq!(see(&[far, back]), [[0.0, 0.0, 0.0, 1.0]; 9]);
    }
}
