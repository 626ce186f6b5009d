//! Light that cells scatter toward the eye, and what of it a blob shows.

use std::f64::consts::PI;

use glam::DVec3;

use super::faces::FaceLight;
use super::moments::corners;
use super::sources::DiffusionMedium;
use super::toward::{Toward, direction};
use super::ways::Ways;
use crate::model::grid::GridSpec;
use crate::model::parallel::parallel_map;

/// Places on a way to the eye on which a blob is seen, and their distance, σ.
const N_PLACES: u32 = 4;
const APART: f64 = 1.2;
/// Half the distance of the four ways, σ: a Gaussian's means up to its third power are those of
/// these places.
const ASIDE: f64 = 1.0;

/// Radiance that the cells of a grid scatter toward an eye.
#[derive(Debug, Clone)]
pub struct SeenCells {
    grid: GridSpec,
    /// Radiance, W m⁻² sr⁻¹, and extinction, 1/length.
    cells: Vec<(DVec3, f64)>,
}

/// The light of a blob as an eye sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenBlob {
    /// Radiance of the mean medium.
    pub radiance: DVec3,
    /// Relative change across the view, 1/length.
    pub across: DVec3,
}

fn mean(v: DVec3) -> f64 {
    v.element_sum() / 3.0
}

impl SeenCells {
    /// Returns the light of cells toward `eye`, where they send out `toward`. Their extinction is
    /// `extinction`.
    pub(super) fn new(
        of: &DiffusionMedium,
        (grid, extinction): (&GridSpec, &[f64]),
        toward: &Toward,
        ways: &Ways<'_>,
        eye: DVec3,
    ) -> SeenCells {
        let weakened = of.mean.weakened();
        let cells = parallel_map(extinction.len(), |c| {
            let (w, up) = (direction(grid, c, eye), (eye - grid.center(c)).y);
            let above = (0.5 - up / grid.edges().y).clamp(0.0, 1.0);
            let sky = |l: DVec3| l.max(DVec3::ZERO);
            let solids =
                |of: &FaceLight, (axis, side), part| of.between(axis, side, part, -w, above);
            let behind = ways.radiance(c, (-w, above), sky, solids, |k| toward.cells[k]);
            let all = weakened * toward.cells[c] + (DVec3::ONE - weakened) * behind;
            (all / (4.0 * PI), extinction[c])
        });
        SeenCells { grid: *grid, cells }
    }

    /// Returns cells of the given radiance and extinction.
    pub fn of_cells(grid: GridSpec, cells: Vec<(DVec3, f64)>) -> SeenCells {
        SeenCells { grid, cells }
    }

    /// Returns radiance and extinction at `p`: trilinear between the cells' centres, and beyond the
    /// outermost as on them.
    pub fn at(&self, p: DVec3) -> (DVec3, f64) {
        let corners = corners(&self.grid, p);
        let add = |(l, s): (DVec3, f64), (c, weight): (usize, f64)| {
            (l + weight * self.cells[c].0, s + weight * self.cells[c].1)
        };
        corners.into_iter().fold((DVec3::ZERO, 0.0), add)
    }

    /// Returns the mean over the channels of the radiance at `p`.
    pub fn mean_at(&self, p: DVec3) -> f64 {
        mean(self.at(p).0)
    }

    /// Returns the greatest mean over the channels in the cells about `p`.
    pub fn greatest_about(&self, p: DVec3) -> f64 {
        let of = |(c, _): (usize, f64)| mean(self.cells[c].0);
        corners(&self.grid, p).map(of).into_iter().fold(0.0, f64::max)
    }

    /// Returns the greatest mean over the channels in any cell.
    pub fn greatest(&self) -> f64 {
        self.cells.iter().map(|(l, _)| mean(*l)).fold(0.0, f64::max)
    }

    /// Returns the shortest edge of a cell.
    pub fn edge(&self) -> f64 {
        self.grid.edges().min_element()
    }

    /// Returns the light of a blob of size σ at `p`: the mean over places on four ways `toward` the
    /// eye. They count by the blob's mass there, and by what the cells before them let through.
    pub fn of_blob(&self, p: DVec3, sigma: f64, toward: DVec3) -> SeenBlob {
        let (mut weight, mut at, mut sum) = (0.0, 0.0, DVec3::ZERO);
        let other = if toward.y.abs() < 0.9 { DVec3::Y } else { DVec3::X };
        let u = toward.cross(other).normalize_or_zero();
        let v = u.cross(toward);
        for aside in [u + v, v - u, u - v, -u - v] {
            let mut passed = 1.0;
            for i in 0..N_PLACES {
                let z = APART * (0.5 * f64::from(N_PLACES - 1) - f64::from(i));
                let (radiance, extinction) = self.at(p + sigma * (z * toward + ASIDE * aside));
                let depth = extinction * APART * sigma;
                let through = if depth > 0.0 { -libm::expm1(-depth) / depth } else { 1.0 };
                let w = (-0.5 * z * z).exp() * passed * through;
                passed *= (-depth).exp();
                weight += w;
                at += w * z;
                sum += w * radiance;
            }
        }
        let (radiance, p) = (sum / weight, p + sigma * at / weight * toward);
        let edges = self.grid.edges();
        let along = |axis: usize| {
            let half = 0.5 * edges[axis] * DVec3::AXES[axis];
            (self.mean_at(p + half) - self.mean_at(p - half)) / edges[axis]
        };
        let all = mean(radiance);
        let slope = match all > 0.0 {
            true => DVec3::from([0, 1, 2].map(along)) / all,
            false => DVec3::ZERO,
        };
        SeenBlob { radiance, across: slope - slope.dot(toward) * toward }
    }
}

#[cfg(test)]
mod tests {
    use glam::UVec3;

    use super::*;

    const GRID: GridSpec =
        GridSpec { n_cells: UVec3::new(8, 6, 40), cell: 0.5, aspect: 1.0, low: DVec3::ZERO };

    /// Light 1 + z toward an eye far along z, in cells of one extinction.
    fn rising(extinction: f64) -> SeenCells {
        let cell = |c: usize| (DVec3::splat(1.0 + GRID.center(c).z), extinction);
        SeenCells::of_cells(GRID, (0..GRID.n_total() as usize).map(cell).collect())
    }

    #[test]
    fn a_blob_is_seen_where_its_light_comes_from() {
        let at = DVec3::new(2.0, 1.5, 10.0);
        // Without extinction at its middle, with much at its front.
        let thin = rising(0.0).of_blob(at, 0.5, DVec3::Z);
        assert!((thin.radiance.x - 11.0).abs() < 1e-12 && thin.across.length() < 1e-12);
        let thick = rising(1e3).of_blob(at, 0.5, DVec3::Z);
        assert!((thick.radiance.x - 11.0 - 0.5 * 1.8).abs() < 0.05, "{thick:?}");
        // Where light passes e^{−z}, a Gaussian of σ = ½ is seen as one whose middle is σ² nearer.
        let between = rising(1.0).of_blob(at, 0.5, DVec3::Z);
        assert!((between.radiance.x - 11.25).abs() < 0.03, "{between:?}");
        // Across the view the light changes by 1 a length.
        let across = rising(0.0).of_blob(at, 0.5, DVec3::X);
        assert!((across.across - DVec3::Z / 11.0).length() < 1e-12, "{across:?}");
    }
}
