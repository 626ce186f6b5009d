//! Opaque rectangles and ground.

use glam::DVec3;

use super::bvh::{Bounds, Bvh};
use super::ray::Ray;
use crate::model::material::Brdf;

/// The points corner + s u + t v with s and t in [0, 1], of a triangle with s + t ≤ 1.
#[derive(Debug, Clone, Copy)]
struct Flat {
    corner: DVec3,
    u: DVec3,
    v: DVec3,
    /// Unit normal of the front, along u × v.
    normal: DVec3,
    is_triangle: bool,
    i_brdf: u32,
}

/// Where a ray meets something opaque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolidHit {
    /// Distance along the ray.
    pub distance: f64,
    /// Unit normal of the front.
    pub normal: DVec3,
    /// Whether the ray meets the front; the back is black.
    pub is_front: bool,
    /// Material of the front.
    pub brdf: Brdf,
}

/// Rectangles and triangles.
#[derive(Debug, Clone, Default)]
pub struct Solids {
    /// In the order of the tree's leaves.
    flats: Vec<Flat>,
    brdfs: Vec<Brdf>,
    bvh: Bvh,
}

/// Share of a thing's size within which a ray that leaves it does not meet it again.
const OFFSET: f64 = 1e-9;

impl Solids {
    /// Returns rectangles, by corner and sides, and triangles, by corner and sides, each with the
    /// index of its material. The front faces u × v.
    pub fn new(
        rectangles: &[([DVec3; 3], u32)],
        triangles: &[([DVec3; 3], u32)],
        brdfs: Vec<Brdf>,
    ) -> Solids {
        let flat = |&([corner, u, v], i_brdf): &([DVec3; 3], u32), is_triangle: bool| {
            let unit = |v: DVec3| v / v.abs().max_element();
            let normal = unit(u).cross(unit(v)).normalize_or_zero();
            Flat { corner, u, v, normal, is_triangle, i_brdf }
        };
        let all: Vec<Flat> = rectangles
            .iter()
            .map(|r| flat(r, false))
            .chain(triangles.iter().map(|t| flat(t, true)))
            .filter(|f| f.normal != DVec3::ZERO)
            .collect();
        let bounds = |f: &Flat| {
            let ends = [f.corner + f.u, f.corner + f.v, f.corner + f.u + f.v];
            let ends = &ends[..if f.is_triangle { 2 } else { 3 }];
            let low = ends.iter().fold(f.corner, |a, b| a.min(*b));
            let high = ends.iter().fold(f.corner, |a, b| a.max(*b));
            // A flat box is as thick as rounding.
            let thick = DVec3::splat(1e-12 * low.abs().max(high.abs()).max_element());
            Bounds { low: low - thick, high: high + thick }
        };
        let bvh = Bvh::new(&all.iter().map(bounds).collect::<Vec<_>>());
        let flats = bvh.order.iter().map(|&i| all[i as usize]).collect();
        Solids { flats, brdfs, bvh }
    }

    /// Returns whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.flats.is_empty()
    }

    /// Returns the first thing that `ray` meets before `end`.
    pub fn nearest(&self, ray: &Ray, end: f64) -> Option<SolidHit> {
        let mut found = None;
        self.bvh.visit(ray, end, |k, end| match self.flats[k].meet(ray) {
            Some(distance) if distance < end => {
                found = Some((distance, k));
                distance
            }
            _ => end,
        });
        found.map(|(distance, k)| {
            let flat = &self.flats[k];
            SolidHit {
                distance,
                normal: flat.normal,
                is_front: flat.normal.dot(ray.direction) < 0.0,
                brdf: self.brdfs[flat.i_brdf as usize],
            }
        })
    }

    /// Returns whether `ray` meets anything before `end`.
    pub fn hides(&self, ray: &Ray, end: f64) -> bool {
        let mut is_hidden = false;
        self.bvh.visit(ray, end, |k, end| {
            is_hidden |= self.flats[k].meet(ray).is_some_and(|distance| distance < end);
            // Nothing is nearer than nothing.
            if is_hidden { f64::NEG_INFINITY } else { end }
        });
        is_hidden
    }
}

impl Flat {
    fn meet(&self, ray: &Ray) -> Option<f64> {
        let from = self.corner - ray.origin;
        let distance = self.normal.dot(from) / self.normal.dot(ray.direction);
        let least = OFFSET * self.u.abs().max(self.v.abs()).max_element();
        if !distance.is_finite() || distance <= least {
            return None;
        }
        let p = distance * ray.direction - from;
        let area = self.u.cross(self.v).dot(self.normal);
        let s = p.cross(self.v).dot(self.normal) / area;
        let t = self.u.cross(p).dot(self.normal) / area;
        let inside = if self.is_triangle { s + t <= 1.0 } else { s <= 1.0 && t <= 1.0 };
        (s >= 0.0 && t >= 0.0 && inside).then_some(distance)
    }
}
