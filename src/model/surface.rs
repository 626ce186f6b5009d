//! Rectangles of a scene, each divided into a grid of facets (model.md §5).

use glam::DVec3;

/// A rectangle with a grid of facets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Centre.
    pub center: DVec3,
    /// Half axis along u, perpendicular to v. The front faces u × v.
    pub u: DVec3,
    /// Half axis along v.
    pub v: DVec3,
    /// Index into the scene's materials.
    pub i_material: usize,
    /// Number of facets along u and along v.
    pub subdivide: [u32; 2],
}

impl Surface {
    /// Returns the unit normal of the front.
    pub fn normal(&self) -> DVec3 {
        // Each axis is scaled first, since the product of two long or two short ones overflows or
        // underflows.
        let unit = |v: DVec3| (v / v.abs().max_element()).normalize();
        unit(self.u).cross(unit(self.v)).normalize()
    }

    /// Returns the area.
    pub fn area(&self) -> f64 {
        4.0 * self.u.length() * self.v.length()
    }

    /// Returns the number of facets.
    pub fn n_facets(&self) -> u64 {
        self.subdivide.iter().map(|n| u64::from(*n)).product()
    }

    /// Returns the half axes of a facet.
    pub fn facet_axes(&self) -> (DVec3, DVec3) {
        (self.u / f64::from(self.subdivide[0]), self.v / f64::from(self.subdivide[1]))
    }

    /// Returns the centre of facet `i`. Facets run along u first, row by row along v.
    pub fn facet_center(&self, i: u32) -> DVec3 {
        let [n_u, n_v] = self.subdivide;
        let at = |i: u32, n: u32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
        self.center + at(i % n_u, n_u) * self.u + at(i / n_u, n_v) * self.v
    }

    /// Returns the low and high corner of its bounding box.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let reach = self.u.abs() + self.v.abs();
        (self.center - reach, self.center + reach)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLOOR: Surface = Surface {
        center: DVec3::new(1.0, 2.0, 3.0),
        u: DVec3::new(0.0, 0.0, 3.0),
        v: DVec3::new(2.0, 0.0, 0.0),
        i_material: 0,
        subdivide: [3, 2],
    };

    #[test]
    fn facets_run_along_u_row_by_row() {
        assert_eq!((FLOOR.normal(), FLOOR.area(), FLOOR.n_facets()), (DVec3::Y, 24.0, 6));
        let centers: Vec<DVec3> = (0..6).map(|i| FLOOR.facet_center(i)).collect();
        assert!((centers[0] - DVec3::new(0.0, 2.0, 1.0)).length() < 1e-15);
        assert!((centers[2] - DVec3::new(0.0, 2.0, 5.0)).length() < 1e-15);
        assert!((centers[3] - DVec3::new(2.0, 2.0, 1.0)).length() < 1e-15);
        assert_eq!(FLOOR.facet_axes(), (DVec3::Z, DVec3::X));
        assert_eq!(FLOOR.bounds(), (DVec3::new(-1.0, 2.0, 0.0), DVec3::new(3.0, 2.0, 6.0)));
    }

    #[test]
    fn a_tiny_or_huge_surface_has_a_normal() {
        for scale in [1e-200, 1e200] {
            let s = Surface { u: FLOOR.u * scale, v: FLOOR.v * scale, ..FLOOR };
            assert!((s.normal() - DVec3::Y).length() < 1e-15);
        }
    }
}
