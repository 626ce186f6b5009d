//! Ground under clouds: heights over columns, drawn as triangles between points and lit at the
//! points (model.md §16).

use std::sync::Arc;

use glam::DVec3;

use super::cover::Cover;
use super::material::Material;

/// Points in rows: u runs along a row, v from row to row, and u × v points up.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Terrain {
    /// Position of the origin in the scene.
    pub origin: DVec3,
    /// Points relative to the origin, row after row.
    pub points: Arc<Vec<DVec3>>,
    /// Number of points along u, and number of rows; each at least 2.
    pub n: [u32; 2],
    /// Index into the scene's materials.
    pub i_material: usize,
    /// Factor on the material's K_d by point; empty where it is 1 everywhere.
    pub colors: Arc<Vec<DVec3>>,
}

/// A point's facet in the light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TerrainFacet {
    /// Position relative to the terrain's origin.
    pub position: DVec3,
    /// Unit normal, upward.
    pub normal: DVec3,
    /// Area.
    pub area: f64,
    /// Factor on the material's K_d.
    pub color: DVec3,
}

/// Corners of the two triangles of a cell (0: low u, low v; 1: high u; 2: high v; 3: both). Each
/// lists a corner, its neighbour along u and its neighbour along v. The two first corners are
/// opposite, so that both triangles have the same front.
pub const HALVES: [[usize; 3]; 2] = [[0, 1, 2], [3, 2, 1]];

impl Terrain {
    /// Returns the number of facets, one a point.
    pub fn n_facets(&self) -> u64 {
        self.n.iter().map(|n| u64::from(*n)).product()
    }

    /// Returns the number of cells between four points each.
    pub fn n_cells(&self) -> u64 {
        self.n.iter().map(|n| u64::from(n.saturating_sub(1))).product()
    }

    /// Returns the indices of the points at the corners of cell `i`, in the order of [`HALVES`].
    pub fn corners(&self, i: u32) -> [usize; 4] {
        let n_u = self.n[0] as usize;
        let (row, column) = (i as usize / (n_u - 1), i as usize % (n_u - 1));
        let low = row * n_u + column;
        [low, low + 1, low + n_u, low + n_u + 1]
    }

    /// Returns the facet of point `i`. Normal and area follow from the differences to its
    /// neighbours on both sides, at the edges to the single one.
    pub fn facet(&self, i: u32) -> TerrainFacet {
        let [n_u, n_v] = self.n;
        let (column, row) = (i % n_u, i / n_u);
        let at = |column: u32, row: u32| self.points[(row * n_u + column) as usize];
        let along = |k: u32, n: u32| (k.saturating_sub(1), (k + 1).min(n - 1));
        let ((west, east), (south, north)) = (along(column, n_u), along(row, n_v));
        let u = 0.5 * (at(east, row) - at(west, row));
        let v = 0.5 * (at(column, north) - at(column, south));
        let across = u.cross(v);
        TerrainFacet {
            position: at(column, row),
            normal: across.normalize_or(DVec3::Y),
            area: across.length(),
            color: self.color(i as usize),
        }
    }

    /// Returns the factor on the material's K_d at point `i`.
    pub fn color(&self, i: usize) -> DVec3 {
        self.colors.get(i).copied().unwrap_or(DVec3::ONE)
    }

    /// Returns the ground with the colours of its material's cover.
    pub fn covered(self, materials: &[Material]) -> Terrain {
        let material = &materials[self.i_material];
        let Cover::Land(land) = material.cover else { return self };
        // Colours are those of the start; K_d that is edited keeps them.
        let kd = material.keys[0].brdf.kd;
        let color = |p: &DVec3| land.color_at(self.origin + *p, kd);
        let colors = Arc::new(self.points.iter().map(color).collect());
        Terrain { colors, ..self }
    }

    /// Returns the ground with `n` cells along each side of one, linear between its points.
    pub fn refined(self, n: u32) -> Terrain {
        if n <= 1 || self.n_cells() == 0 {
            return self;
        }
        let [n_u, n_v] = self.n;
        let new = [n_u, n_v].map(|k| (k - 1) * n + 1);
        let split = |i: u32, k: u32| {
            let low = (i / n).min(k - 2);
            (low, f64::from(i - low * n) / f64::from(n))
        };
        let at = |column: u32, row: u32| self.points[(row * n_u + column) as usize];
        let place = |i: u32| {
            let ((column, s), (row, t)) = (split(i % new[0], n_u), split(i / new[0], n_v));
            let of_row = |row: u32| at(column, row).lerp(at(column + 1, row), s);
            of_row(row).lerp(of_row(row + 1), t)
        };
        Terrain { points: Arc::new((0..new[0] * new[1]).map(place).collect()), n: new, ..self }
    }

    /// Returns all facets.
    pub fn facets(&self) -> impl Iterator<Item = TerrainFacet> + '_ {
        (0..self.n[0] * self.n[1]).map(|i| self.facet(i))
    }

    /// Returns the low and high corner of its bounding box, in the scene.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let (low, high) = self.extent();
        (self.origin + low, self.origin + high)
    }

    /// Returns the greatest distance of its points from the origin along an axis.
    pub fn greatest_extent(&self) -> f64 {
        let (low, high) = self.extent();
        low.abs().max(high.abs()).max_element()
    }

    /// Returns the low and high corner of its bounding box, relative to the origin.
    pub fn extent(&self) -> (DVec3, DVec3) {
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.points.iter().fold(start, |(low, high), p| (low.min(*p), high.max(*p)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// u east, v north (−z), 3 by 4 points of height `h(x, north)`.
    fn terrain(h: impl Fn(f64, f64) -> f64) -> Terrain {
        let at = |k: u32| (f64::from(k % 3), 2.0 * f64::from(k / 3));
        let points = (0..12).map(at).map(|(x, north)| DVec3::new(x, h(x, north), -north)).collect();
        Terrain {
            origin: DVec3::new(10.0, 0.0, 0.0),
            points: Arc::new(points),
            n: [3, 4],
            ..Terrain::default()
        }
    }

    #[test]
    fn a_plane_has_one_normal_and_its_whole_area() {
        let flat = terrain(|_, _| 5.0);
        assert!(flat.facets().all(|f| f.normal == DVec3::Y && f.position.y == 5.0));
        // 2 by 6: middles 1 x 2, edges half of it, corners a quarter.
        assert_eq!(
            flat.facets().map(|f| f.area).collect::<Vec<_>>()[..6],
            [0.5, 1.0, 0.5, 1.0, 2.0, 1.0]
        );
        assert_eq!(flat.facets().map(|f| f.area).sum::<f64>(), 12.0);
        // Rising eastward by 3/4: normal (−3, 4, 0)/5, area times 5/4.
        let slope = terrain(|x, _| 0.75 * x);
        for (f, g) in slope.facets().zip(flat.facets()) {
            assert!(
                (f.normal - DVec3::new(-0.6, 0.8, 0.0)).length() < 1e-15
                    && (f.area - 1.25 * g.area).abs() < 1e-15
            );
        }
        // And northward by 1: (0, 1, 1)/√2.
        let north = terrain(|_, north| north);
        assert!(
            north.facets().all(|f| (f.normal - DVec3::new(0.0, 0.5f64.sqrt(), 0.5f64.sqrt()))
                .length()
                < 1e-15)
        );
        assert_eq!(slope.bounds(), (DVec3::new(10.0, 0.0, -6.0), DVec3::new(12.0, 1.5, 0.0)));
    }

    #[test]
    fn cells_have_two_halves_of_one_front() {
        let t = terrain(|x, north| x * north);
        assert_eq!((t.n_cells(), t.corners(0), t.corners(5)), (6, [0, 1, 3, 4], [7, 8, 10, 11]));
        for i in 0..6 {
            let p = t.corners(i).map(|k| t.points[k]);
            for [a, b, c] in HALVES {
                assert!((p[b] - p[a]).cross(p[c] - p[a]).y > 0.0);
            }
        }
    }

    #[test]
    fn finer_points_lie_between_the_columns() {
        let coarse = terrain(|x, north| x * north);
        let fine = coarse.clone().refined(3);
        assert_eq!(fine.n, [7, 10]);
        for row in 0..4 {
            for column in 0..3 {
                let (k, fine_k) = (row * 3 + column, 3 * row * 7 + 3 * column);
                assert!((fine.points[fine_k] - coarse.points[k]).length() < 1e-12);
            }
        }
        // A third of a cell east, and a third north, which is 2/3: height 2/9.
        let p = fine.points[1 + 7];
        assert!((p - DVec3::new(1.0 / 3.0, 2.0 / 9.0, -2.0 / 3.0)).length() < 1e-12, "{p}");
        assert_eq!(coarse.clone().refined(1), coarse);
    }

    #[test]
    fn degenerate_cells_have_no_area_and_no_nan() {
        // All points of a row at one place: no area, and no NaN.
        let t =
            Terrain { points: Arc::new(vec![DVec3::ZERO; 4]), n: [2, 2], ..terrain(|_, _| 0.0) };
        assert!(t.facets().all(|f| f.normal == DVec3::Y && f.area == 0.0));
    }
}
