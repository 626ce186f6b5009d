//! Rectangles under a picture's sprites: their records, the reference picture, and the candidates
//! of a pixel that f32 may choose from.

#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::DVec3;
use nimbus::layout::facet::{LitRecord, NO_LOBE, RegionRecord};
use nimbus::model::camera::Pose;
use nimbus::model::material::Brdf;
use nimbus::model::surface::Surface;
use nimbus::reference::composite::{OpaquePixel, Rounding};
use nimbus::reference::surfaces::{Hit, meet, radiance, render_at};
use nimbus::reference::view::View;

use crate::bounded::{Bounded, Random, U, dot, exact3};

#[derive(Debug, Clone, Default)]
pub struct Scenery {
    pub regions: Vec<RegionRecord>,
    /// Radiance of all facets, region after region.
    pub lit: Vec<LitRecord>,
}

/// The candidates of a pixel. Most pixels have one. Several occur if a ray passes within rounding
/// of an edge or of the near plane, or if two rectangles are equally near within rounding.
pub type Candidates = Vec<OpaquePixel>;

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

impl Scenery {
    /// Returns a rectangle whose facets have radiances of their own.
    pub fn rectangle(mut self, center: DVec3, u: DVec3, v: DVec3, subdivide: [u32; 2]) -> Scenery {
        let brdf = Brdf { kd: DVec3::ONE, ks: DVec3::ZERO, ns: 1.0 };
        let surface = Surface { center, u, v, i_material: 0, subdivide };
        let i_first = self.lit.len() as u32;
        let mut random = Random(1000 + u64::from(i_first));
        self.regions.push(RegionRecord::surface(&surface, DVec3::ZERO, &brdf, NO_LOBE, i_first));
        for _ in 0..surface.n_facets() {
            let mut color =
                || [random.within(0.1, 4.0), random.within(0.1, 1.0), random.within(0.0, 0.01)];
            let (first, second) = (color(), color());
            self.lit.push(LitRecord {
                first,
                second,
                direct: [9.0; 3],
                indirect: [9.0; 3],
                ..LitRecord::default()
            });
        }
        self
    }

    /// Returns the rectangles as in their records.
    pub fn surfaces(&self) -> Vec<Surface> {
        let of = |r: &RegionRecord| Surface {
            center: double(r.center),
            u: double(r.u),
            v: double(r.v),
            i_material: 0,
            subdivide: [r.n_u, r.n_v],
        };
        self.regions.iter().map(of).collect()
    }

    pub fn radiance(&self) -> Vec<DVec3> {
        self.lit.iter().map(|l| double(l.first) + double(l.second)).collect()
    }

    /// Lines along which a pixel may have several candidates: edges, and intersections of two
    /// rectangles.
    pub fn n_lines(&self) -> usize {
        let n = self.regions.len();
        4 * n + n * n.saturating_sub(1) / 2
    }

    /// Returns the candidates of every pixel, the reference first; `ray` is the shader's ray
    /// through pixel (i, j).
    pub fn candidates(
        &self,
        view: &View,
        ray: impl Fn(u32, u32) -> [Bounded; 2],
        rounding: &Rounding,
    ) -> Vec<Candidates> {
        let surfaces = self.surfaces();
        let all = self.radiance();
        let seen: Vec<Seen> = self.regions.iter().map(|r| Seen::new(r, &view.pose)).collect();
        let facets = |r: &RegionRecord| &all[r.i_first_facet as usize..][..r.n_facets as usize];
        let rows = (0..view.height).flat_map(|j| (0..view.width).map(move |i| (i, j)));
        let truths = render_at(view, &surfaces, &all, rows.clone().map(|(i, j)| [i, j]));
        let pixel = |((i, j), truth): ((u32, u32), &OpaquePixel)| {
            let (d, [x, y]) = (view.ray(i, j), ray(i, j));
            let met = surfaces.iter().zip(&self.regions).zip(&seen).filter_map(
                |((surface, region), seen)| {
                    let found = seen.meet([x, y, Bounded::exact(1.0)], view.near)?;
                    let hit = meet(surface, view.pose.position, d)
                        .expect("no candidate lies along its rectangle's plane");
                    Some(Met::new(found, &hit, surface, facets(region), region, rounding))
                },
            );
            let mut found = candidates(met.collect());
            let is_truth = |c: &OpaquePixel| c.color == truth.color && c.depth == truth.depth;
            let at = found.iter().position(is_truth).expect("the truth is among the candidates");
            found.swap(0, at);
            found
        };
        rows.zip(&truths).map(pixel).collect()
    }
}

/// Outputs of the vertex shader.
struct Seen {
    n: [Bounded; 3],
    q: Bounded,
    m_s: [Bounded; 3],
    m_t: [Bounded; 3],
    lengths: [f64; 2],
}

/// A possible intersection of a ray with a rectangle in f32.
struct Found {
    /// Whether the intersection is certain.
    is_sure: bool,
    is_side_sure: bool,
    /// near/z.
    depth: Bounded,
    s: Bounded,
    t: Bounded,
}

fn cross(a: [Bounded; 3], b: [Bounded; 3]) -> [Bounded; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i].times(b[j]).minus(a[j].times(b[i])))
}

impl Seen {
    fn new(region: &RegionRecord, pose: &Pose) -> Seen {
        let once = |v: DVec3| v.to_array().map(Bounded::once);
        let (eye, center) = (once(pose.position), exact3(region.center));
        let axes = [pose.right, pose.up, pose.forward].map(once);
        let along_view = |v: [Bounded; 3]| axes.map(|axis| dot(axis, v));
        let length = |v: [f32; 3]| v.iter().fold(0f32, |a, b| a.max(b.abs()));
        let scaled = |v: [f32; 3]| exact3(v).map(|x| x.over(Bounded::exact(f64::from(length(v)))));
        let c = along_view([0, 1, 2].map(|k| center[k].minus(eye[k])));
        let (u, v) = (along_view(scaled(region.u)), along_view(scaled(region.v)));
        let n = cross(u, v);
        let lengths = [f64::from(length(region.u)), f64::from(length(region.v))];
        Seen { n, q: dot(c, n), m_s: cross(v, c), m_t: cross(c, u), lengths }
    }

    fn meet(&self, ray: [Bounded; 3], near: f64) -> Option<Found> {
        let (d, s, t) = (dot(ray, self.n), dot(ray, self.m_s), dot(ray, self.m_t));
        let sign = if d.value < 0.0 { -1.0 } else { 1.0 };
        let (size, q) = (d.scaled(sign), self.q.scaled(sign));
        let least = Bounded::once(near).times(size);
        let absolute = |x: Bounded| if x.value < 0.0 { x.scaled(-1.0) } else { x };
        // Numbers that are not negative for a hit, each a comparison of two computed numbers.
        let reach = |x: Bounded, length: f64| (Bounded::exact(length).times(size), absolute(x));
        let pairs = [
            (q, Bounded::exact(0.0)),
            (q, least),
            reach(s, self.lengths[0]),
            reach(t, self.lengths[1]),
        ];
        let is_never = pairs.iter().any(|(a, b)| a.value + a.error < b.value - b.error);
        let is_sure = pairs.iter().all(|(a, b)| a.value - a.error > b.value + b.error)
            && size.value > size.error;
        // If d may have either sign, so may q: only s and t far from both exclude a hit.
        let may_turn = size.value <= size.error;
        let is_far = pairs[2..].iter().any(|(a, b)| a.value + a.error < b.value - b.error);
        if is_far || (is_never && !may_turn) {
            return None;
        }
        let along = |x: Bounded, length: f64| x.over(Bounded::exact(length).times(d));
        let (s, t) = (along(s, self.lengths[0]), along(t, self.lengths[1]));
        let is_side_sure = self.q.value.abs() > self.q.error;
        Some(Found { is_sure: is_sure && is_side_sure, is_side_sure, depth: least.over(q), s, t })
    }
}

/// A rectangle that a pixel may show.
struct Met {
    found: Found,
    /// The exact geometry: equal rectangles are equally near, and the last one is visible.
    geometry: [[f32; 3]; 3],
    sides: Vec<OpaquePixel>,
}

impl Met {
    fn new(
        found: Found,
        hit: &Hit,
        surface: &Surface,
        facets: &[DVec3],
        region: &RegionRecord,
        rounding: &Rounding,
    ) -> Met {
        let depth_bound = hit.depth * found.depth.error / found.depth.value;
        let shown = |is_front: bool| {
            let color = radiance(surface, facets, &Hit { is_front, ..*hit });
            let off = if is_front { radiance_bound(surface, facets, &found) } else { DVec3::ZERO };
            let (color, off) = (color.extend(1.0).to_array(), off.extend(0.0).to_array());
            // Correct rounding errs by u_t, faithful rounding by 2 u_t, of the written number.
            let stored = |k: usize| {
                2.0 * rounding.unit * (color[k].abs() + off[k]).max(rounding.least_normal)
            };
            let bound = [0, 1, 2, 3].map(|k| off[k] + stored(k));
            OpaquePixel { color, bound, depth: hit.depth, depth_bound }
        };
        let mut sides = vec![shown(hit.is_front)];
        if !found.is_side_sure {
            sides.push(shown(!hit.is_front));
        }
        Met { found, geometry: [region.center, region.u, region.v], sides }
    }

    /// Returns whether it is certainly in front of `other`, which comes earlier if `is_later`.
    fn hides(&self, other: &Met, is_later: bool) -> bool {
        let (a, b) = (self.found.depth, other.found.depth);
        (is_later && self.geometry == other.geometry) || a.value - a.error > b.value + b.error
    }
}

/// Returns the error of the interpolation in f32.
fn radiance_bound(surface: &Surface, facets: &[DVec3], found: &Found) -> DVec3 {
    let [n_u, n_v] = surface.subdivide.map(|n| n as usize);
    let step = |from: usize, to: usize| (facets[from] - facets[to]).abs();
    let greatest = |steps: &mut dyn Iterator<Item = DVec3>| steps.fold(DVec3::ZERO, DVec3::max);
    let cells = || (0..n_u * n_v).map(|k| (k % n_u, k / n_u, k));
    let along_u = greatest(&mut cells().filter(|(i, _, _)| *i > 0).map(|(_, _, k)| step(k, k - 1)));
    let along_v =
        greatest(&mut cells().filter(|(_, j, _)| *j > 0).map(|(_, _, k)| step(k, k - n_u)));
    let (least, most) =
        facets.iter().fold((facets[0], facets[0]), |(a, b), f| (a.min(*f), b.max(*f)));
    // ((s/2 + 1/2) n − 1/2): one rounding of at most 1, two of at most n.
    let place = |x: Bounded, n: usize| (0.5 * x.error + 3.0 * U) * n as f64;
    let moved = place(found.s, n_u) * along_u + place(found.t, n_v) * along_v;
    // L1 + L2 is one rounding; each of two interpolations has three (1 − a, product, sum) of at
    // most the greatest radiance.
    moved.min(most - least) + 8.0 * U * most
}

/// All candidates.
fn candidates(met: Vec<Met>) -> Candidates {
    let is_hidden = |i: usize| {
        (0..met.len()).any(|k| k != i && met[k].found.is_sure && met[k].hides(&met[i], k > i))
    };
    let open: Vec<usize> = (0..met.len()).filter(|i| !is_hidden(*i)).collect();
    let mut found: Candidates = open.iter().flat_map(|i| met[*i].sides.clone()).collect();
    if !open.iter().any(|i| met[*i].found.is_sure) {
        found.push(OpaquePixel::EMPTY);
    }
    found
}
