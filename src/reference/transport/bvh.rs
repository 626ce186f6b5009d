//! A tree of boxes over things in space, for rays.

use glam::DVec3;

use super::ray::Ray;

/// Least number of things in a node that is divided.
const DIVIDED: usize = 4;
/// Bins along an axis in the search for the best division.
const N_BINS: usize = 16;
/// Cost of a node's box as a share of that of a thing.
const BOX_COST: f64 = 0.5;
/// Height from which on nodes are divided into halves, so that no tree is higher than 64.
const HALVED: usize = 28;

/// Low and high corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub low: DVec3,
    pub high: DVec3,
}

impl Bounds {
    const NOTHING: Bounds = Bounds { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    fn with(self, other: Bounds) -> Bounds {
        Bounds { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Half of the surface.
    fn area(&self) -> f64 {
        let d = (self.high - self.low).max(DVec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    fn middle(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    /// Returns where the ray enters, or infinity if it misses the box before `end`.
    fn enter(&self, origin: DVec3, inverse: DVec3, end: f64) -> f64 {
        let (a, b) = ((self.low - origin) * inverse, (self.high - origin) * inverse);
        // 0 · ∞ at a face that the ray runs in is NaN, which min and max leave out.
        let near = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z)).max(0.0);
        let far = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z)).min(end);
        if near <= far { near } else { f64::INFINITY }
    }
}

#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Bounds,
    /// The first thing of a leaf, else the second child; the first child is the next node.
    at: u32,
    /// Number of things; 0 of a node that is divided.
    n: u32,
}

/// Boxes in a tree; things are numbered as given.
#[derive(Debug, Clone, Default)]
pub(super) struct Bvh {
    nodes: Vec<Node>,
    /// Things in the order of leaves.
    pub order: Vec<u32>,
}

impl Bvh {
    pub fn new(boxes: &[Bounds]) -> Bvh {
        let mut bvh = Bvh { nodes: Vec::new(), order: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            bvh.divide(boxes, 0, boxes.len(), 0);
        }
        bvh
    }

    fn divide(&mut self, boxes: &[Bounds], first: usize, end: usize, height: usize) {
        let of = &self.order[first..end];
        let bounds = of.iter().fold(Bounds::NOTHING, |all, &i| all.with(boxes[i as usize]));
        let i_node = self.nodes.len();
        self.nodes.push(Node { bounds, at: first as u32, n: (end - first) as u32 });
        let middle = match height {
            HALVED.. if end - first > DIVIDED => Some(first + (end - first) / 2),
            _ => self.split(boxes, &bounds, first, end),
        };
        let Some(middle) = middle else { return };
        self.divide(boxes, first, middle, height + 1);
        let second = self.nodes.len() as u32;
        self.divide(boxes, middle, end, height + 1);
        (self.nodes[i_node].at, self.nodes[i_node].n) = (second, 0);
    }

    /// Orders the things so that those of the first child come first, and returns the first of the
    /// second child; `None` if the node is better not divided. The cost of a division is the number
    /// of boxes and things that a ray through the node meets (surface area heuristic).
    fn split(&mut self, boxes: &[Bounds], all: &Bounds, first: usize, end: usize) -> Option<usize> {
        if end - first <= DIVIDED {
            return None;
        }
        let of = &mut self.order[first..end];
        let middles = of.iter().fold(Bounds::NOTHING, |found, &i| {
            let middle = boxes[i as usize].middle();
            found.with(Bounds { low: middle, high: middle })
        });
        let mut best = (of.len() as f64 * all.area(), 0, 0);
        let bin_of = |axis: usize, i: u32| {
            let (low, high) = (middles.low[axis], middles.high[axis]);
            let share = (boxes[i as usize].middle()[axis] - low) / (high - low);
            ((share * N_BINS as f64) as usize).min(N_BINS - 1)
        };
        for axis in 0..3 {
            if middles.high[axis] <= middles.low[axis] {
                continue;
            }
            let mut bins = [(Bounds::NOTHING, 0usize); N_BINS];
            for &i in of.iter() {
                let bin = &mut bins[bin_of(axis, i)];
                *bin = (bin.0.with(boxes[i as usize]), bin.1 + 1);
            }
            let add = |a: (Bounds, usize), b: (Bounds, usize)| (a.0.with(b.0), a.1 + b.1);
            for k in 1..N_BINS {
                let left = bins[..k].iter().copied().fold((Bounds::NOTHING, 0), add);
                let right = bins[k..].iter().copied().fold((Bounds::NOTHING, 0), add);
                if left.1 == 0 || right.1 == 0 {
                    continue;
                }
                let cost = left.0.area() * left.1 as f64
                    + right.0.area() * right.1 as f64
                    + 2.0 * BOX_COST * all.area();
                if cost < best.0 {
                    best = (cost, axis, k);
                }
            }
        }
        let (_, axis, k) = best;
        if k == 0 {
            return None;
        }
        // A stable division: the tree does not depend on anything but the boxes.
        let (left, right): (Vec<u32>, Vec<u32>) = of.iter().partition(|&&i| bin_of(axis, i) < k);
        let middle = first + left.len();
        for (place, i) in of.iter_mut().zip(left.into_iter().chain(right)) {
            *place = i;
        }
        Some(middle)
    }

    /// Calls `visit` with the places in [`Bvh::order`] of things whose boxes' leaf the ray meets
    /// before `end`, nearer leaves mostly first. `visit` returns the new end.
    pub fn visit(&self, ray: &Ray, mut end: f64, mut visit: impl FnMut(usize, f64) -> f64) {
        let inverse = ray.direction.recip();
        let enter = |i: usize, end: f64| self.nodes[i].bounds.enter(ray.origin, inverse, end);
        if self.nodes.is_empty() || enter(0, end) == f64::INFINITY {
            return;
        }
        let mut stack = [(0u32, 0f64); 64];
        let mut n_open = 0;
        let mut i = 0;
        loop {
            let node = &self.nodes[i];
            if node.n > 0 {
                for k in node.at..node.at + node.n {
                    end = visit(k as usize, end);
                }
            } else {
                let (a, b) = (i + 1, node.at as usize);
                let (to_a, to_b) = (enter(a, end), enter(b, end));
                let (near, far) =
                    if to_b < to_a { ((b, to_b), (a, to_a)) } else { ((a, to_a), (b, to_b)) };
                if far.1 < f64::INFINITY {
                    stack[n_open] = (far.0 as u32, far.1);
                    n_open += 1;
                }
                if near.1 < f64::INFINITY {
                    i = near.0;
                    continue;
                }
            }
            loop {
                if n_open == 0 {
                    return;
                }
                n_open -= 1;
                let (next, to) = stack[n_open];
                if to <= end {
                    i = next as usize;
                    break;
                }
            }
        }
    }
}
