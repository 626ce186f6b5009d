//! relief: which lights ground hides from its own points, in f64 (model.md §16).
//!
//! In: grounds and lights relative to O. Out: whether a triangle lies on the way from a point to a
//! light.

use glam::DVec3;

use super::occlude::{Source, source_of};
use super::terrain::triangles;
use crate::model::light::Light;
use crate::model::relief::{ReliefNode, nodes};
use crate::model::terrain::Terrain;

/// A way from a point along a unit vector.
struct Way {
    from: DVec3,
    toward: DVec3,
    distance: f64,
}

impl Way {
    fn new(from: DVec3, light: &Light) -> Way {
        match source_of(light) {
            Source::Toward(toward) => Way { from, toward, distance: f64::INFINITY },
            Source::At(to) => {
                let distance = (to - from).length();
                Way { from, toward: (to - from) / distance, distance }
            }
        }
    }

    fn meets_box(&self, low: DVec3, high: DVec3) -> bool {
        let (mut enter, mut leave) = (0f64, self.distance);
        for axis in 0..3 {
            let (from, along) = (self.from[axis], self.toward[axis]);
            if along != 0.0 {
                let [a, b] = [low, high].map(|corner| (corner[axis] - from) / along);
                (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
            } else if !(low[axis]..=high[axis]).contains(&from) {
                return false;
            }
        }
        enter <= leave
    }

    /// Returns whether it meets a triangle whose sides are moved outward by `slack` of their
    /// length; inward if that is negative.
    fn meets(&self, [c, b, d]: [DVec3; 3], slack: f64) -> bool {
        let (u, v) = (b - c, d - c);
        let volume = u.dot(self.toward.cross(v));
        if volume == 0.0 {
            return false;
        }
        let from = self.from - c;
        let s = from.dot(self.toward.cross(v)) / volume;
        let across = from.cross(u);
        let [t, z] = [self.toward, v].map(|w| w.dot(across) / volume);
        s >= -slack && t >= -slack && s + t <= 1.0 + slack && z > 0.0 && z < self.distance
    }

    /// Returns whether it leads below a triangle from the corner where its sides `u` and `v` meet.
    /// Directions beside the triangle within `slack` of its sides count, too.
    fn dives(&self, u: DVec3, v: DVec3, slack: f64) -> bool {
        let d = self.toward;
        let area = u.x * v.z - u.z * v.x;
        let (s, t) = ((d.x * v.z - d.z * v.x) / area, (u.x * d.z - u.z * d.x) / area);
        let least = -slack / u.abs().max(v.abs()).max_element();
        s >= least && t >= least && d.y < s * u.y + t * v.y
    }

    /// Returns whether a triangle lies on the way, or is dived below from one of its corners.
    fn is_barred_by(&self, t: [DVec3; 3], slack: f64) -> bool {
        match t.iter().position(|corner| *corner == self.from) {
            Some(k) => self.dives(t[(k + 1) % 3] - t[k], t[(k + 2) % 3] - t[k], slack),
            None => self.meets(t, slack),
        }
    }
}

/// Grounds that hide light.
#[derive(Debug, Clone)]
pub struct Ground {
    of: Vec<Shadowing>,
}

#[derive(Debug, Clone)]
struct Shadowing {
    /// By cell, its halves.
    halves: Vec<[[DVec3; 3]; 2]>,
    nodes: Vec<ReliefNode>,
}

impl Ground {
    /// Returns grounds, relative to `origin`.
    pub fn new(terrains: &[Terrain], origin: DVec3) -> Ground {
        let of = |terrain: &Terrain| {
            let at = terrain.origin - origin;
            let placed = Terrain { origin: at, ..terrain.clone() };
            let all: Vec<[DVec3; 3]> = triangles(&placed).collect();
            // Wider than what adding the origin rounds off.
            let margin = DVec3::splat(1e-12 * (at.abs().max_element() + terrain.greatest_extent()));
            let moved = |node: ReliefNode| ReliefNode {
                low: at + node.low - margin,
                high: at + node.high + margin,
                ..node
            };
            Shadowing {
                halves: all.chunks(2).map(|halves| [halves[0], halves[1]]).collect(),
                nodes: nodes(terrain).into_iter().map(moved).collect(),
            }
        };
        Ground { of: terrains.iter().map(of).collect() }
    }

    /// Returns whether ground hides `light` from `p`, one of its points. A way that passes a
    /// triangle's side within `slack` of that side's length counts as meeting it.
    pub fn hides(&self, p: DVec3, light: &Light, slack: f64) -> bool {
        if light.is_sky() {
            return false;
        }
        let way = Way::new(p, light);
        self.of.iter().any(|of| of.hides(&way, slack))
    }
}

impl Shadowing {
    fn hides(&self, way: &Way, slack: f64) -> bool {
        let wide = |node: &ReliefNode| slack.max(0.0) * (node.high - node.low);
        let mut i = 0;
        while let Some(node) = self.nodes.get(i) {
            if !way.meets_box(node.low - wide(node), node.high + wide(node)) {
                i = node.end as usize;
                continue;
            }
            let halves = node.i_cell.map_or(&[][..], |i_cell| &self.halves[i_cell as usize]);
            if halves.iter().any(|t| way.is_barred_by(*t, slack)) {
                return true;
            }
            i += 1;
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    /// 9 x 3 points, a unit apart, with a ridge of height 2 along column 4.
    fn ridge() -> Terrain {
        let height = |i: u32| if i % 9 == 4 { 2.0 } else { 0.0 };
        let at = |i: u32| DVec3::new((i % 9).into(), height(i), -f64::from(i / 9));
        Terrain { points: Arc::new((0..27).map(at).collect()), n: [9, 3], ..Terrain::default() }
    }

    const NONE: [u32; 0] = [];

    fn sun(direction: DVec3) -> Light {
        Light::Directional { direction: direction.normalize(), irradiance: DVec3::ONE }
    }

    fn hidden(light: Light, of: impl Iterator<Item = u32>) -> Vec<u32> {
        let (terrain, origin) = (ridge(), DVec3::new(5.0, -3.0, 0.5));
        let ground = Ground::new(std::slice::from_ref(&terrain), origin);
        let at = |i: &u32| terrain.origin - origin + terrain.points[*i as usize];
        of.filter(|i| ground.hides(at(i), &light.relative_to(origin), 0.0)).collect()
    }

    #[test]
    fn a_ridge_throws_its_shadow_by_hand() {
        // The sun stands in the west with a slope of 0.8: the shadow of height 2 is 2.5 long, and
        // ends between columns 6 and 7. The slope of the ridge is 2, so that its own foot, column
        // 5, is in it, and its top is not.
        let row = |k: u32| 9 * k..9 * (k + 1);
        let light = sun(DVec3::new(1.0, -0.8, 0.0));
        assert_eq!(hidden(light, row(1)), [14, 15]);
        assert_eq!(hidden(light, row(0)), [5, 6]);
        // From the other side, and from above.
        assert_eq!(hidden(sun(DVec3::new(-1.0, -0.8, 0.0)), row(1)), [11, 12]);
        assert_eq!(hidden(sun(DVec3::new(1.0, -3.0, 0.0)), 0..27), NONE);
        // From below all of the ground is dark, but for edges that the way leaves at once.
        let dark = hidden(sun(DVec3::new(-0.1, 1.0, 0.1)), 0..27);
        assert!(row(1).filter(|i| i % 9 < 8).all(|i| dark.contains(&i)), "{dark:?}");
        // Along the ridge no column hides another.
        assert_eq!(hidden(sun(DVec3::new(0.0, -0.1, 1.0)), row(1)), NONE);
    }

    #[test]
    fn lamps_are_hidden_as_far_as_they_are() {
        let lamp = |x: f64, y: f64| Light::Point {
            position: DVec3::new(x, y, -1.0),
            intensity: DVec3::ONE,
            radius: 0.1,
        };
        // Behind the ridge, one unit high; before it; and above its top.
        assert_eq!(hidden(lamp(2.0, 1.0), 9..18), [14, 15, 16, 17]);
        assert_eq!(hidden(lamp(6.5, 1.0), 14..18), NONE);
        assert_eq!(hidden(lamp(4.0, 9.0), 9..18), NONE);
        assert_eq!(hidden(Light::even_sky(DVec3::ONE, 0.0), 0..27), NONE);
    }

    /// Boxes decide nothing: with all triangles looked at, the same is hidden.
    #[test]
    fn boxes_lose_no_triangle() {
        let height = |i: u32| 2.0 * (f64::from(i * 7919 % 101) / 101.0);
        let at = |i: u32| DVec3::new((i % 12).into(), height(i), -f64::from(i / 12));
        let terrain = Terrain {
            points: Arc::new((0..120).map(at).collect()),
            n: [12, 10],
            ..Terrain::default()
        };
        let ground = Ground::new(std::slice::from_ref(&terrain), DVec3::ZERO);
        let all: Vec<[DVec3; 3]> = triangles(&terrain).collect();
        let mut n_hidden = 0;
        for k in 0..16 {
            let (sin, cos) = f64::from(k).sin_cos();
            let light = sun(DVec3::new(sin, -0.05 * f64::from(k + 1), cos));
            for p in terrain.points.iter() {
                let way = Way::new(*p, &light);
                let is_hidden = all.iter().any(|t| way.is_barred_by(*t, 0.0));
                assert_eq!(ground.hides(*p, &light, 0.0), is_hidden);
                n_hidden += u32::from(is_hidden);
            }
        }
        assert!((300..1600).contains(&n_hidden), "{n_hidden}");
    }
}
