//! The equations of the cells: what flows through their faces, what is absorbed, and what comes in.

use glam::{DVec3, USizeVec3};

use super::faces::{FaceLight, Skies};
use super::sources::{DiffusionMedium, Sources};
use crate::model::grid::GridSpec;
use crate::model::light::Light;

/// The equations of the cells of a grid for each channel:
/// Σ_n w (φ − φ_n) + sink φ = source.
#[derive(Debug, Clone)]
pub struct System {
    /// Number of cells along each axis.
    pub n_cells: USizeVec3,
    /// w between each cell and the next one along each axis; 0 on the last.
    pub next: Vec<[DVec3; 3]>,
    /// Absorption, and what leaves the box, by φ.
    pub sink: Vec<DVec3>,
    /// Source of each cell.
    pub source: Vec<DVec3>,
}

/// q at the face between two cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtFaces {
    /// Their mean.
    Mean,
    /// D times the mean of q/D, with the D of the way from centre to centre.
    InSeries,
}

impl AtFaces {
    /// Returns q at the face between two cells of which q and D are given.
    pub(super) fn q(self, [a, b]: [DVec3; 2], [reach_a, reach_b]: [DVec3; 2]) -> DVec3 {
        match self {
            AtFaces::Mean => 0.5 * (a + b),
            AtFaces::InSeries => (reach_b * a + reach_a * b) / (reach_a + reach_b),
        }
    }
}

/// Returns the index of the next cell along an axis, if there is one.
pub(super) fn next(n: USizeVec3, c: usize, axis: usize) -> Option<usize> {
    let stride = [1, n.x, n.x * n.y][axis];
    (c / stride % n[axis] + 1 < n[axis]).then_some(c + stride)
}

/// Returns the index of the cell before along an axis, if there is one.
pub(super) fn before(n: USizeVec3, c: usize, axis: usize) -> Option<usize> {
    let stride = [1, n.x, n.x * n.y][axis];
    let is_first = (c / stride).is_multiple_of(n[axis]);
    (!is_first).then(|| c - stride)
}

impl System {
    /// Returns the equations of the cells of `grid`, in which extinction is `cells`.
    pub fn new(
        of: &DiffusionMedium,
        grid: &GridSpec,
        cells: &[f64],
        sources: &Sources,
        lights: &[Light],
        of_solids: Option<&FaceLight>,
        at_faces: AtFaces,
    ) -> System {
        let n = grid.n_cells.as_usizevec3();
        let reach: Vec<DVec3> = cells.iter().map(|sigma| of.reach(*sigma)).collect();
        let h = grid.edges();
        let mut system = System {
            n_cells: n,
            next: vec![[DVec3::ZERO; 3]; cells.len()],
            sink: cells.iter().map(|sigma| sigma * (DVec3::ONE - of.mean.albedo)).collect(),
            source: sources.scattered.clone(),
        };
        let extent = grid.high() - grid.low;
        let skies = Skies::new(lights);
        // Light that arrives at the face of the box at cell c: `side` is 0 for the lower and 1 for
        // the upper face of an axis.
        let arriving = |c: usize, axis: usize, side: usize| {
            let solids =
                |light: &FaceLight| light.at(axis, side, (grid.center(c) - grid.low) / extent);
            let of_solids = of_solids.map_or(DVec3::ZERO, solids);
            let outward = if side == 1 { DVec3::AXES[axis] } else { -DVec3::AXES[axis] };
            (skies.on(outward) + of_solids).max(DVec3::ZERO)
        };
        for c in 0..cells.len() {
            for axis in 0..3 {
                let h = h[axis];
                let carried = |c: usize| sources.carried[c][axis];
                let at_face = |other: usize| {
                    at_faces.q([carried(c), carried(other)], [reach[c], reach[other]])
                };
                match next(n, c, axis) {
                    Some(after) => {
                        let (a, b) = (reach[c], reach[after]);
                        system.next[c][axis] = 2.0 * a * b / (a + b) / (h * h);
                        system.source[c] -= at_face(after) / h;
                    }
                    None => system.add_face(c, (reach[c], h), arriving(c, axis, 1), carried(c)),
                }
                match before(n, c, axis) {
                    Some(prior) => system.source[c] += at_face(prior) / h,
                    None => system.add_face(c, (reach[c], h), arriving(c, axis, 0), -carried(c)),
                }
            }
        }
        system
    }

    /// Adds a face of the box: Marshak's condition φ/4 + F/2 = J with what flows in, F, over half a
    /// cell. `carried` is q outward.
    fn add_face(&mut self, c: usize, (reach, h): (DVec3, f64), arriving: DVec3, carried: DVec3) {
        let half = 0.5 * h / reach;
        let through = (2.0 + half).recip() / h;
        self.sink[c] += through;
        self.source[c] += through * (4.0 * arriving - half * carried);
    }

    /// Returns Σ w (φ − φ_n) + sink φ in cell `c`.
    pub fn applied(&self, phi: &[DVec3], c: usize) -> DVec3 {
        let of_axis = |axis: usize| {
            let mut sum = DVec3::ZERO;
            if let Some(after) = next(self.n_cells, c, axis) {
                sum += self.next[c][axis] * (phi[c] - phi[after]);
            }
            if let Some(prior) = before(self.n_cells, c, axis) {
                sum += self.next[prior][axis] * (phi[c] - phi[prior]);
            }
            sum
        };
        self.sink[c] * phi[c] + (0..3).map(of_axis).sum::<DVec3>()
    }

    /// Returns the sum of the factors of φ in cell `c`.
    pub fn diagonal(&self, c: usize) -> DVec3 {
        let of_axis = |axis: usize| {
            let after = next(self.n_cells, c, axis).map(|_| self.next[c][axis]);
            let prior = before(self.n_cells, c, axis).map(|p| self.next[p][axis]);
            after.unwrap_or_default() + prior.unwrap_or_default()
        };
        self.sink[c] + (0..3).map(of_axis).sum::<DVec3>()
    }
}
