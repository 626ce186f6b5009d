//! Ground in pictures: its records, and the candidates of a pixel that a rasteriser and f32 may
//! choose from.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};
use nimbus::layout::facet::{FacetRecord, LitRecord, NO_LOBE, RegionRecord};
use nimbus::model::material::Brdf;
use nimbus::model::terrain::{HALVES, Terrain};
use nimbus::reference::surfaces::Hit;
use nimbus::reference::terrain::Triangle;
use nimbus::reference::view::View;

use crate::bounded::{Bounded, Random, U, dot, exact3};

/// Vulkan guarantees 4 subpixel bits for vertices; f32 adds the error of a position of some hundred
/// pixels.
const SNAP: f64 = 1.0 / 16.0 + 1e-3;

#[derive(Debug, Clone, Default)]
pub struct Relief {
    pub regions: Vec<RegionRecord>,
    pub points: Vec<FacetRecord>,
    pub lit: Vec<LitRecord>,
    /// Number of facets before those of the first ground.
    pub n_before: u32,
}

/// A candidate of a pixel: colour, near/z, and their errors.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    pub values: [f64; 5],
    pub bounds: [f64; 5],
}

const NOTHING: Candidate = Candidate { values: [0.0; 5], bounds: [0.0; 5] };

fn double(v: [f32; 3]) -> DVec3 {
    Vec3::from(v).as_dvec3()
}

impl Relief {
    /// Number of facets of other objects before the ground's.
    pub fn after(n_before: u32) -> Relief {
        let other = LitRecord { first: [77.0; 3], ..LitRecord::default() };
        Relief { n_before, lit: vec![other; n_before as usize], ..Relief::default() }
    }

    /// Returns ground of `n` points at distance `step`, x east and −z north, with a height and a
    /// radiance each.
    pub fn ground(
        mut self,
        origin: DVec3,
        n: [u32; 2],
        step: f64,
        height: impl Fn(f64, f64) -> f64,
    ) -> Relief {
        let mut random = Random(7 + self.lit.len() as u64);
        let place = |k: u32| {
            let middle = |i: u32, n: u32| step * (f64::from(i) - 0.5 * f64::from(n - 1));
            let (x, north) = (middle(k % n[0], n[0]), middle(k / n[0], n[1]));
            double(DVec3::new(x, height(x, north), -north).as_vec3().to_array())
        };
        let points = Arc::new((0..n[0] * n[1]).map(place).collect());
        let terrain = Terrain { origin, points, n, ..Terrain::default() };
        let brdf = Brdf { kd: DVec3::ONE, ks: DVec3::ZERO, ns: 1.0 };
        let (i_region, i_first) = (self.regions.len() as u32, self.lit.len() as u32);
        self.regions.push(RegionRecord::terrain(&terrain, DVec3::ZERO, &brdf, NO_LOBE, i_first));
        self.points.extend(terrain.facets().map(|f| FacetRecord::terrain(&f, i_region)));
        for _ in 0..terrain.n_facets() {
            let mut color =
                || [random.within(0.1, 4.0), random.within(0.1, 1.0), random.within(0.0, 0.01)];
            self.lit.push(LitRecord {
                first: color(),
                second: color(),
                direct: [9.0; 3],
                ..LitRecord::default()
            });
        }
        self
    }

    /// Both halves of all cells.
    fn halves(&self) -> Vec<Drawn> {
        let of_region = |r: &RegionRecord| {
            let first = (r.i_first_facet - self.n_before) as usize;
            let points = &self.points[first..][..r.n_facets as usize];
            let lit = &self.lit[r.i_first_facet as usize..][..r.n_facets as usize];
            let (n_u, n_v) = (r.n_u as usize, r.n_v as usize);
            let cells =
                (0..(n_u - 1) * (n_v - 1)).map(move |i| i / (n_u - 1) * n_u + i % (n_u - 1));
            let halves = cells.flat_map(move |low| {
                HALVES.map(|half| half.map(|k| [low, low + 1, low + n_u, low + n_u + 1][k]))
            });
            let of = |k: [usize; 3]| {
                let radiance = k.map(|k| double(lit[k].first) + double(lit[k].second));
                Drawn { center: r.center, points: k.map(|k| points[k].position), radiance }
            };
            halves.map(of).collect::<Vec<_>>()
        };
        self.regions.iter().flat_map(of_region).collect()
    }

    /// Returns the candidates of each pixel; `ray` is the shader's ray through pixel (i, j).
    pub fn candidates(
        &self,
        view: &View,
        ray: impl Fn(u32, u32) -> [Bounded; 2],
    ) -> Vec<Vec<Candidate>> {
        let drawn = self.halves();
        let halves: Vec<Triangle> = drawn.iter().map(Drawn::half).collect();
        let seen: Vec<Seen> = drawn.iter().map(|d| Seen::new(d, view)).collect();
        let shapes: Vec<Vec<DVec2>> = halves.iter().map(|h| shape(h, view)).collect();
        let mut near_by: Vec<Vec<usize>> = vec![vec![]; (view.width * view.height) as usize];
        for (k, half) in halves.iter().enumerate() {
            let [(left, right), (top, bottom)] = half.pixels(view, 1.0);
            for (i, j) in (top..bottom).flat_map(|j| (left..right).map(move |i| (i, j))) {
                near_by[(j * view.width + i) as usize].push(k);
            }
        }
        let pixel = |(p, near_by): (usize, &Vec<usize>)| {
            let (i, j) = (p as u32 % view.width, p as u32 / view.width);
            let farthest = farthest(view, near_by.iter().map(|k| &halves[*k]), i, j);
            let center = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5);
            let [x, y] = ray(i, j);
            let may_show = |k: &&usize| is_within(&shapes[**k], center);
            let shown = near_by.iter().filter(may_show).flat_map(|k| {
                let given = given(&halves[*k], view, view.ray(i, j));
                given.map_or(vec![], |hit| {
                    seen[*k].candidates(&hit, [x, y, Bounded::exact(1.0)], &halves[*k], &drawn[*k])
                })
            });
            let least = view.near / farthest;
            let mut found: Vec<Candidate> =
                shown.filter(|c| c.values[4] + c.bounds[4] >= least * (1.0 - 1e-9)).collect();
            if farthest == f64::INFINITY {
                found.push(NOTHING);
            }
            found
        };
        near_by.iter().enumerate().map(pixel).collect()
    }
}

/// Returns the place shown in a pixel that the rasteriser gives to the triangle although the ray
/// may pass it: where the ray meets the plane, clamped to the triangle's extent.
fn given(half: &Triangle, view: &View, ray: DVec3) -> Option<Hit> {
    let hit = half.meet(view.pose.position, ray)?;
    let depths =
        half.points().map(|p| (p - view.pose.position).dot(view.pose.forward).max(view.near));
    let least = depths.into_iter().fold(f64::INFINITY, f64::min);
    let depth = hit.depth.clamp(least, depths.into_iter().fold(least, f64::max));
    let s = hit.s.clamp(0.0, 1.0);
    Some(Hit { depth, s, t: hit.t.clamp(0.0, 1.0 - s), ..hit })
}

/// Returns the greatest depth that a pixel may show, with all vertices moved by their error in any
/// direction; infinite if it may show nothing.
///
/// The moved triangles decide which of them cover the pixel. Each has the depth of its plane on the
/// ray through the pixel's own centre, and the nearest of these is shown. Behind an edge this depth
/// can be greater than that of any visible place: SwiftShader, which has the 4 subpixel bits that
/// Vulkan guarantees, draws pixels there, and lavapipe with its 8 bits seldom does.
fn farthest<'a>(
    view: &View,
    halves: impl Iterator<Item = &'a Triangle> + Clone,
    i: u32,
    j: u32,
) -> f64 {
    let offsets = [-SNAP, 0.0, SNAP];
    let (right, down) = (view.pixel() * view.pose.right, -view.pixel() * view.pose.up);
    let rays = offsets
        .iter()
        .flat_map(|x| offsets.iter().map(move |y| view.ray(i, j) + *x * right + *y * down));
    let own = view.ray(i, j);
    let nearest = |ray: DVec3| {
        let depth = |half: &Triangle| {
            half.hit(view, ray).map(|hit| given(half, view, own).unwrap_or(hit).depth)
        };
        halves.clone().filter_map(depth).fold(f64::INFINITY, f64::min)
    };
    rays.map(nearest).fold(0.0, f64::max)
}

/// Returns the part in front of the eye, in pixels.
fn shape(half: &Triangle, view: &View) -> Vec<DVec2> {
    let pose = &view.pose;
    let at_eye = half.points().map(|p| {
        let d = p - pose.position;
        DVec3::new(d.dot(pose.right), -d.dot(pose.up), d.dot(pose.forward))
    });
    let mut cut = vec![];
    for k in 0..3 {
        let (a, b) = (at_eye[k], at_eye[(k + 1) % 3]);
        if a.z >= view.near {
            cut.push(a);
        }
        if (a.z >= view.near) != (b.z >= view.near) {
            cut.push(a.lerp(b, (view.near - a.z) / (b.z - a.z)));
        }
    }
    let half = 0.5 * DVec2::new(f64::from(view.width), f64::from(view.height));
    cut.into_iter().map(|p| p.truncate() / p.z / view.pixel() + half).collect()
}

/// Returns whether a point is in a convex polygon, or within [`SNAP`] of its sides.
fn is_within(shape: &[DVec2], place: DVec2) -> bool {
    let n = shape.len();
    let area: f64 = (0..n).map(|k| shape[k].perp_dot(shape[(k + 1) % n])).sum();
    let side = |k: usize| {
        let (a, b) = (shape[k], shape[(k + 1) % n]);
        // Moved by SNAP along both axes.
        let reach = SNAP * (b - a).abs().element_sum();
        area.signum() * (b - a).perp_dot(place - a) >= -reach
    };
    n >= 3 && (0..n).all(side)
}

/// A half cell as in its records.
struct Drawn {
    center: [f32; 3],
    points: [[f32; 3]; 3],
    radiance: [DVec3; 3],
}

impl Drawn {
    fn half(&self) -> Triangle {
        Triangle::new(self.points.map(|p| double(self.center) + double(p)), self.radiance)
    }
}

/// Outputs of the vertex shader.
struct Seen {
    n: [Bounded; 3],
    q: Bounded,
    m_s: [Bounded; 3],
    m_t: [Bounded; 3],
    lengths: [Bounded; 2],
    depths: [Bounded; 3],
    near: f64,
}

fn cross(a: [Bounded; 3], b: [Bounded; 3]) -> [Bounded; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i].times(b[j]).minus(a[j].times(b[i])))
}

impl Seen {
    fn new(drawn: &Drawn, view: &View) -> Seen {
        let once = |v: DVec3| v.to_array().map(Bounded::once);
        let pose = &view.pose;
        let (eye, center) = (once(pose.position), exact3(drawn.center));
        let axes = [pose.right, pose.up, pose.forward].map(once);
        let along_view = |v: [Bounded; 3]| axes.map(|axis| dot(axis, v));
        let [p, b, d] = drawn.points;
        let from_eye = [0, 1, 2].map(|k| center[k].minus(eye[k]));
        let c = along_view([0, 1, 2].map(|k| Bounded::exact(f64::from(p[k])).plus(from_eye[k])));
        // The subtraction is correctly rounded: the shader's length equals this one.
        let length = |to: [f32; 3]| {
            f64::from([0, 1, 2].map(|k| (to[k] - p[k]).abs()).into_iter().fold(0f32, f32::max))
        };
        let lengths = [length(b), length(d)].map(Bounded::exact);
        let side = |to: [f32; 3], length: Bounded| {
            let [to, p] = [to, p].map(exact3);
            along_view([0, 1, 2].map(|k| to[k].minus(p[k]).over(length)))
        };
        let (u, v) = (side(b, lengths[0]), side(d, lengths[1]));
        let n = cross(u, v);
        let depths = [c[2], c[2].plus(u[2].times(lengths[0])), c[2].plus(v[2].times(lengths[1]))];
        Seen {
            n,
            q: dot(c, n),
            m_s: cross(v, c),
            m_t: cross(c, u),
            lengths,
            depths,
            near: view.near,
        }
    }

    /// Returns the visible colour at `hit`, from one side, or from both if f32 may choose either.
    fn candidates(
        &self,
        hit: &Hit,
        ray: [Bounded; 3],
        half: &Triangle,
        drawn: &Drawn,
    ) -> Vec<Candidate> {
        let inverse = Bounded::exact(1.0).over(dot(ray, self.n));
        // Clamped to its range, so the error is at most the range.
        let reach = |f: fn(f64, f64) -> f64, from: f64| {
            self.depths.iter().map(|d| d.value.max(self.near)).fold(from, f)
        };
        let (nearest, farthest) = (reach(f64::min, f64::INFINITY), reach(f64::max, 0.0));
        let of_corners = self.depths.iter().map(|d| d.error).fold(0.0, f64::max);
        let off_depth = self.q.times(inverse).error.min(farthest - nearest) + of_corners;
        let z = Bounded { value: hit.depth, error: off_depth.min(0.5 * hit.depth) };
        let depth = Bounded::once(self.near).over(z);
        let along = |m: [Bounded; 3], length: Bounded| {
            dot(ray, m).times(inverse).over(length).error.min(1.0)
        };
        let off_s = along(self.m_s, self.lengths[0]);
        let off_t = (along(self.m_t, self.lengths[1]) + off_s).min(1.0);
        let [corner, b, d] = drawn.radiance;
        let most = corner.abs().max(b.abs()).max(d.abs());
        let shown = |is_front: bool| {
            let color = half.radiance(&Hit { is_front, ..*hit });
            let moved = off_s * (b - corner).abs() + off_t * (d - corner).abs() + 8.0 * U * most;
            let moved = if is_front { moved } else { DVec3::ZERO };
            Candidate {
                values: [color.x, color.y, color.z, 1.0, depth.value.min(1.0)],
                bounds: [moved.x, moved.y, moved.z, 0.0, depth.error],
            }
        };
        let mut sides = vec![shown(hit.is_front)];
        if self.q.value.abs() <= self.q.error {
            sides.push(shown(!hit.is_front));
        }
        sides
    }
}
