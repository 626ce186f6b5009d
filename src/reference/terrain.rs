//! Ground, model.md §16: its facets, and its picture as opaque triangles between its points, the
//! nearest in every pixel, in f64.
//!
//! In: points and eye relative to O, radiance of every point (W m⁻² sr⁻¹, RGB). Out: colour and
//! view depth where it is seen.

use glam::{DVec2, DVec3};

use super::composite::OpaquePixel;
use super::facets::Facet;
use super::surfaces::{Hit, meet};
use super::view::View;
use crate::model::surface::Surface;
use crate::model::terrain::{HALVES, Terrain};

/// Returns the facets of `terrain`, relative to `origin`.
pub fn facets(terrain: &Terrain, origin: DVec3, region: u32) -> Vec<Facet> {
    let at = terrain.origin - origin;
    let of = |f: crate::model::terrain::TerrainFacet| Facet {
        position: at + f.position,
        normal: f.normal,
        area: f.area,
        region,
        sigma: 0.0,
        conditioning: 1.0,
    };
    terrain.facets().map(of).collect()
}

/// Half of a cell: the points corner + s u + t v with s, t ≥ 0 and s + t ≤ 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// The plane, by corner, u and v.
    plane: Surface,
    /// Radiance at the corner, at the end of u and at the end of v.
    radiance: [DVec3; 3],
}

impl Triangle {
    /// Returns the triangle of a corner, the end of u and the end of v, with their radiance.
    pub fn new(points: [DVec3; 3], radiance: [DVec3; 3]) -> Triangle {
        let [center, along, across] = points;
        let plane = Surface {
            center,
            u: along - center,
            v: across - center,
            i_material: 0,
            subdivide: [1, 1],
        };
        Triangle { plane, radiance }
    }

    /// Returns the triangles of `terrain`, with points relative to `terrain.origin` and `radiance`
    /// by point.
    pub fn of<'a>(
        terrain: &'a Terrain,
        radiance: &'a [DVec3],
    ) -> impl Iterator<Item = Triangle> + 'a {
        halves(terrain).map(|numbers| {
            let points = numbers.map(|k| terrain.origin + terrain.points[k]);
            Triangle::new(points, numbers.map(|k| radiance[k]))
        })
    }

    /// Returns the corner, the end of u and the end of v.
    pub fn points(&self) -> [DVec3; 3] {
        let Surface { center, u, v, .. } = self.plane;
        [center, center + u, center + v]
    }

    /// Returns where the line eye + z·ray meets the plane, whatever s and t; `None` if the line
    /// runs along it.
    pub fn meet(&self, eye: DVec3, ray: DVec3) -> Option<Hit> {
        meet(&self.plane, eye, ray)
    }

    /// Returns where the ray through a pixel meets the triangle, from the near plane on.
    pub fn hit(&self, view: &View, ray: DVec3) -> Option<Hit> {
        let hit = self.meet(view.pose.position, ray)?;
        (hit.depth >= view.near && hit.s >= 0.0 && hit.t >= 0.0 && hit.s + hit.t <= 1.0)
            .then_some(hit)
    }

    /// Returns the radiance at `hit`: linear between the points, black from below.
    pub fn radiance(&self, hit: &Hit) -> DVec3 {
        if !hit.is_front {
            return DVec3::ZERO;
        }
        self.radiance.iter().zip(shares(hit)).map(|(radiance, share)| *radiance * share).sum()
    }

    /// Returns the pixel that the ray sees of the triangle.
    pub fn seen(&self, view: &View, ray: DVec3) -> Option<OpaquePixel> {
        self.hit(view, ray).map(|hit| self.shown(&hit))
    }

    /// Returns the pixel that shows the triangle at `hit`.
    pub fn shown(&self, hit: &Hit) -> OpaquePixel {
        let color = self.radiance(hit).extend(1.0).to_array();
        OpaquePixel { color, depth: hit.depth, ..OpaquePixel::EMPTY }
    }

    /// Returns the columns and rows (first, end) of pixels that may see the triangle, enlarged by
    /// `margin` pixels on every side.
    pub fn pixels(&self, view: &View, margin: f64) -> [(u32, u32); 2] {
        let size = [view.width, view.height];
        let mut low = DVec2::INFINITY;
        let mut high = DVec2::NEG_INFINITY;
        for p in self.points() {
            let from_eye = p - view.pose.position;
            let z = from_eye.dot(view.pose.forward);
            if z < view.near {
                // A triangle that the near plane cuts may be anywhere.
                return size.map(|n| (0, n));
            }
            let half = DVec2::new(
                view.pixel() * 0.5 * f64::from(size[0]),
                view.pixel() * 0.5 * f64::from(size[1]),
            );
            let slope = DVec2::new(from_eye.dot(view.pose.right), -from_eye.dot(view.pose.up)) / z;
            let at = (slope + half) / view.pixel() - view.shift;
            (low, high) = (low.min(at), high.max(at));
        }
        let range = |low: f64, high: f64, n: u32| {
            let first = (low - 0.5 - margin).ceil().clamp(0.0, f64::from(n)) as u32;
            (
                first,
                ((high - 0.5 + margin).floor() + 1.0).clamp(f64::from(first), f64::from(n)) as u32,
            )
        };
        [range(low.x, high.x, size[0]), range(low.y, high.y, size[1])]
    }
}

/// Returns the points of every triangle: corner, end of u and end of v.
fn halves(terrain: &Terrain) -> impl Iterator<Item = [usize; 3]> + '_ {
    let of_cell = |i: u64| {
        let corners = terrain.corners(i as u32);
        HALVES.map(|half| half.map(|k| corners[k]))
    };
    (0..terrain.n_cells()).flat_map(of_cell)
}

/// Returns the triangles of `terrain`, in the scene: corner, end of u and end of v. The front faces
/// upward.
pub fn triangles(terrain: &Terrain) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    halves(terrain).map(|numbers| numbers.map(|k| terrain.origin + terrain.points[k]))
}

/// Returns the mean factor on K_d of each triangle.
pub fn colors(terrain: &Terrain) -> impl Iterator<Item = DVec3> + '_ {
    halves(terrain).map(|numbers| numbers.iter().map(|k| terrain.color(*k)).sum::<DVec3>() / 3.0)
}

/// Shares of the radiance at corner, end of u and end of v in that at `hit`.
fn shares(hit: &Hit) -> [f64; 3] {
    [1.0 - hit.s - hit.t, hit.s, hit.t]
}

/// The rounding of a corner's place must not leave a pixel out; the hit decides.
const MARGIN: f64 = 1e-6;

/// The triangles of a ground by the rows of a picture that may show them.
pub struct ByRow<'a> {
    terrain: &'a Terrain,
    view: &'a View,
    /// Triangles of each row, in order of their cells.
    rows: Vec<Vec<InRow>>,
}

/// A triangle in a row of pixels.
#[derive(Debug, Clone, Copy)]
struct InRow {
    /// Points: corner, end of u and end of v.
    numbers: [usize; 3],
    /// First and end of the columns that may show it.
    columns: (u32, u32),
}

impl<'a> ByRow<'a> {
    /// Finds the triangles of the rows for which `is_drawn`.
    pub fn new(terrain: &'a Terrain, view: &'a View, is_drawn: impl Fn(u32) -> bool) -> ByRow<'a> {
        let drawn: Vec<bool> = (0..view.height).map(is_drawn).collect();
        let mut rows = vec![vec![]; drawn.len()];
        for numbers in halves(terrain) {
            let [columns, (top, bottom)] = half(terrain, numbers).pixels(view, MARGIN);
            for j in (top as usize..bottom as usize).filter(|j| drawn[*j]) {
                rows[j].push(InRow { numbers, columns });
            }
        }
        ByRow { terrain, view, rows }
    }

    /// Returns the depth at which the pixel in column `i` and row `j` sees the ground. Also returns
    /// the share of each point's radiance in that of the place; all are 0 from below.
    pub fn weights(&self, [i, j]: [u32; 2]) -> Option<(f64, [(usize, f64); 3])> {
        let ray = self.view.ray(i, j);
        let hits = self.rows[j as usize].iter().filter_map(|&InRow { numbers, columns }| {
            let may_hit = (columns.0..columns.1).contains(&i);
            let hit = || half(self.terrain, numbers).hit(self.view, ray);
            Some((numbers, may_hit.then(hit)??))
        });
        let nearest = hits.reduce(|a, b| if b.1.depth <= a.1.depth { b } else { a });
        let (numbers, hit) = nearest?;
        let shown = if hit.is_front { 1.0 } else { 0.0 };
        let shares = shares(&hit).map(|share| shown * share);
        Some((hit.depth, [0, 1, 2].map(|k| (numbers[k], shares[k]))))
    }
}

/// Returns the triangle of the points with `numbers`, without radiance.
fn half(terrain: &Terrain, numbers: [usize; 3]) -> Triangle {
    Triangle::new(numbers.map(|k| terrain.origin + terrain.points[k]), [DVec3::ZERO; 3])
}

/// Columns and rows (first, end) of a part of a picture.
pub type Window = [(u32, u32); 2];

/// Draws `terrain` over `picture`, the pixels of `window` row by row, where it is nearer.
/// `radiance` is by point.
pub fn render_over(
    (picture, window): (&mut [OpaquePixel], Window),
    view: &View,
    terrain: &Terrain,
    radiance: &[DVec3],
) {
    let [(first_column, end_column), (first_row, end_row)] = window;
    for half in Triangle::of(terrain, radiance) {
        let [(left, right), (top, bottom)] = half.pixels(view, MARGIN);
        for j in top.max(first_row)..bottom.min(end_row) {
            for i in left.max(first_column)..right.min(end_column) {
                let place = (j - first_row) * (end_column - first_column) + i - first_column;
                let pixel = &mut picture[place as usize];
                if let Some(seen) =
                    half.seen(view, view.ray(i, j)).filter(|seen| seen.depth <= pixel.depth)
                {
                    *pixel = seen;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::model::camera::Pose;
    use crate::model::edge::Edge;

    /// From a height of 2, straight down; north is up in the picture: 3 by 3 pixels of 90 degrees,
    /// slopes −2/3, 0, 2/3.
    fn from_above() -> View {
        View {
            width: 3,
            height: 3,
            pose: Pose {
                position: DVec3::new(0.0, 2.0, 0.0),
                right: DVec3::X,
                up: DVec3::NEG_Z,
                forward: DVec3::NEG_Y,
            },
            fov_y_rad: std::f64::consts::FRAC_PI_2,
            near: 0.5,
            edge: Edge::at(3.0),
            smallest: 0.0,
            slice: 0.0,
            n_parts: 4,
            shift: DVec2::ZERO,
        }
    }

    /// 2 by 2 cells from −2 to 2, heights of the nine points from the south-west on.
    fn terrain(heights: [f64; 9]) -> Terrain {
        let at = |k: usize| {
            DVec3::new(2.0 * (k % 3) as f64 - 2.0, heights[k], 2.0 - 2.0 * (k / 3) as f64)
        };
        Terrain {
            origin: DVec3::ZERO,
            points: Arc::new((0..9).map(at).collect()),
            n: [3, 3],
            ..Terrain::default()
        }
    }

    fn picture(view: &View, terrain: &Terrain, radiance: &[DVec3]) -> Vec<OpaquePixel> {
        let mut picture = vec![OpaquePixel::EMPTY; 9];
        render_over((&mut picture, [(0, view.width), (0, view.height)]), view, terrain, radiance);
        picture
    }

    #[test]
    fn a_plain_is_seen_where_it_lies() {
        // At depth 2 the rays reach x, north = −4/3, 0, 4/3; radiance there: r = x, g = north, both
        // + 2.
        let flat = terrain([0.0; 9]);
        let radiance: Vec<DVec3> = (0..9)
            .map(|k| DVec3::new(2.0 * f64::from(k % 3), 2.0 * f64::from(k / 3), 1.0))
            .collect();
        let seen = picture(&from_above(), &flat, &radiance);
        for (k, pixel) in seen.iter().enumerate() {
            let (x, north) =
                (4.0 / 3.0 * (k % 3) as f64 - 4.0 / 3.0, 4.0 / 3.0 - 4.0 / 3.0 * (k / 3) as f64);
            let [r, g, b, a] = pixel.color;
            assert!((r - 2.0 - x).abs() < 1e-13 && (g - 2.0 - north).abs() < 1e-13, "{k}: {r} {g}");
            assert!((b - 1.0).abs() < 1e-15 && a == 1.0 && (pixel.depth - 2.0).abs() < 1e-14);
        }
    }

    #[test]
    fn a_hill_is_nearer_and_hides() {
        // The middle raised by 1: the middle ray meets it at depth 1; that through (2/3, 0) meets
        // the triangle of height 1 − x/2 at z with 2 − z = 1 − z/3: z = 3/2.
        let mut heights = [0.0; 9];
        heights[4] = 1.0;
        let hill = terrain(heights);
        let mut radiance = vec![DVec3::ZERO; 9];
        radiance[4] = DVec3::new(4.0, 0.0, 0.0);
        let seen = picture(&from_above(), &hill, &radiance);
        assert!(
            (seen[4].depth - 1.0).abs() < 1e-14 && (seen[5].depth - 1.5).abs() < 1e-14,
            "{:?}",
            seen[5]
        );
        // At x = 1 half of the middle's radiance.
        assert!((seen[4].color[0] - 4.0).abs() < 1e-13 && (seen[5].color[0] - 2.0).abs() < 1e-13);
        // A nearer background stays, a farther one is covered.
        let before = |depth: f64| OpaquePixel { color: [9.0; 4], depth, ..OpaquePixel::EMPTY };
        let mut over = vec![before(1.25); 9];
        render_over((&mut over, [(0, 3), (0, 3)]), &from_above(), &hill, &radiance);
        assert!(over[4].depth < 1.25 && over[5].color == [9.0; 4]);
    }

    /// Both ways find the same places in the same light.
    #[test]
    fn shares_of_points_are_those_of_the_picture() {
        let heights = [0.0, 0.3, -0.2, 0.5, 1.0, 0.1, -0.4, 0.2, 0.6];
        let shift = DVec2::new(0.05, 0.03);
        let (hill, view) = (terrain(heights), View { shift, ..from_above() });
        let radiance: Vec<DVec3> = (0..9).map(|k| DVec3::splat(1.0 + f64::from(k))).collect();
        let by_row = ByRow::new(&hill, &view, |j| j != 2);
        for (k, pixel) in picture(&view, &hill, &radiance).iter().enumerate() {
            let found = by_row.weights([k as u32 % 3, k as u32 / 3]);
            let Some((depth, weights)) = found else {
                assert!(k >= 6, "{k}: only the last row is left out");
                continue;
            };
            let light: f64 = weights.iter().map(|(k, share)| radiance[*k].x * share).sum();
            assert!(k < 6 && depth == pixel.depth && (light - pixel.color[0]).abs() < 1e-14);
        }
    }

    #[test]
    fn the_underside_is_black_and_the_near_plane_cuts() {
        let flat = terrain([0.0; 9]);
        let bright = vec![DVec3::ONE; 9];
        let mut below = from_above();
        (below.pose.position.y, below.pose.forward, below.pose.right) =
            (-2.0, DVec3::Y, DVec3::NEG_X);
        assert!(picture(&below, &flat, &bright).iter().all(|p| p.color == [0.0, 0.0, 0.0, 1.0]));
        let near = View { near: 2.5, ..from_above() };
        assert!(picture(&near, &flat, &bright).iter().all(|p| p.color == [0.0; 4]));
    }

    #[test]
    fn facets_lie_where_the_origin_puts_them() {
        let moved = Terrain { origin: DVec3::new(5.0, 1.0, 0.0), ..terrain([3.0; 9]) };
        let found = facets(&moved, DVec3::new(1.0, 0.0, 0.0), 7);
        assert!(found.iter().all(|f| f.normal == DVec3::Y && f.region == 7));
        assert_eq!(found[4].position, DVec3::new(4.0, 4.0, 0.0));
        assert_eq!(found.iter().map(|f| f.area).sum::<f64>(), 16.0);
    }
}
