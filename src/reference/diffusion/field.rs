//! Diffuse light of a frame, and what a blob scatters of it toward the eye.

use std::f64::consts::PI;

use glam::DVec3;

use super::bounce::Bounces;
use super::faces::FaceLight;
use super::merged::Merged;
use super::moments::{corners, flux_of, flux_through_faces};
use super::multigrid::Multigrid;
use super::seen::SeenCells;
use super::sources::{DiffusionMedium, Moments, Sources};
use super::system::{AtFaces, System};
use super::toward::Toward;
use super::ways::Ways;
use crate::model::grid::GridSpec;
use crate::model::light::Light;
use crate::model::medium::ScatterLaw;
use crate::reference::transmit::Obstacles;

/// Fluence and flux of diffuse light in every cell.
#[derive(Debug, Clone)]
pub struct DiffuseLight {
    spec: GridSpec,
    /// φ, W m⁻², and F along each axis, W m⁻².
    pub cells: Vec<Moments>,
    /// U: fluence of suns and lamps, mean over the channels, W m⁻².
    pub direct: Vec<f64>,
}

impl DiffuseLight {
    /// Computes the light in the cells of `obstacles` by `n_cycles` cycles. `of_solids` is that of
    /// surfaces and ground, where a scene has them.
    pub fn new(
        of: &DiffusionMedium,
        obstacles: &Obstacles<'_>,
        lights: &[Light],
        of_solids: Option<&FaceLight>,
        n_cycles: u32,
    ) -> DiffuseLight {
        DiffuseLight::with_bounces(of, obstacles, lights, of_solids, (n_cycles, 0, 1), DVec3::ZERO)
            .0
    }

    /// Computes the light after a number of bounces, and with any the light of the cells toward
    /// `eye`. Bounces lead between cells that are `edge` cells wide.
    pub fn with_bounces(
        of: &DiffusionMedium,
        obstacles: &Obstacles<'_>,
        lights: &[Light],
        of_solids: Option<&FaceLight>,
        (n_cycles, n_bounces, edge): (u32, u32, u32),
        eye: DVec3,
    ) -> (DiffuseLight, Option<SeenCells>) {
        let grid = obstacles.spec;
        let counted: Vec<f64> = obstacles.cells.iter().map(|c| c.min(of.densest)).collect();
        let cells = &counted[..];
        let sources = Sources::new(of, obstacles, lights, of_solids.is_some());
        let solved = |of, grid: &GridSpec, cells: &[f64], sources: &Sources| {
            let mean = AtFaces::Mean;
            let system = System::new(of, grid, cells, sources, lights, of_solids, mean);
            let phi = Multigrid::new(system, grid.edges()).solve(n_cycles);
            match n_bounces {
                0 => flux_of(of, grid, cells, sources, &phi),
                _ => flux_through_faces(of, grid, cells, (sources, mean), &phi),
            }
        };
        let mut light = solved(of, grid, cells, &sources);
        let direct = sources.direct.clone();
        if n_bounces == 0 {
            return (DiffuseLight { spec: *grid, cells: light, direct }, None);
        }
        let weakened = of.mean.weakened();
        let depths = |cells: &[f64]| cells.iter().map(|sigma| weakened * *sigma).collect();
        let ways = Ways::new(grid, depths(cells), lights, of_solids);
        let bounces = Bounces { of, grid, cells };
        let (arrived, mut bounce_grid) = (bounces.arrived(&sources), *grid);
        let second;
        if edge == 1 {
            (light, second) = bounces.after(n_bounces, &ways, &arrived, light);
        } else {
            let few = Merged::new(of, (grid, cells), &sources, &arrived, edge);
            let before = solved(&few.of, &few.grid, &few.cells, &few.sources);
            let ways = Ways::new(&few.grid, depths(&few.cells), lights, of_solids);
            let bounces = Bounces { of: &few.of, grid: &few.grid, cells: &few.cells };
            let after;
            (after, second) = bounces.after(n_bounces, &ways, &few.arrived, before.clone());
            few.spread(grid, &mut light, [&before, &after]);
            bounce_grid = few.grid;
        }
        let second = (&bounce_grid, &second[..]);
        let toward = Toward::new(of, grid, (&light, &arrived), second, eye);
        let seen = SeenCells::new(of, (grid, cells), &toward, &ways, eye);
        (DiffuseLight { spec: *grid, cells: light, direct }, Some(seen))
    }

    /// Returns φ with the flux F = q − D∇φ; at the faces of the box by one-sided differences.
    pub fn of_fluence(
        of: &DiffusionMedium,
        grid: &GridSpec,
        cells: &[f64],
        sources: &Sources,
        phi: &[DVec3],
    ) -> DiffuseLight {
        let (cells, direct) = (flux_of(of, grid, cells, sources, phi), sources.direct.clone());
        DiffuseLight { spec: *grid, cells, direct }
    }

    /// Returns light with the given φ and F of each cell, and no suns or lamps.
    #[cfg(test)]
    pub(super) fn of_cells(spec: &GridSpec, cells: Vec<[DVec3; 4]>) -> DiffuseLight {
        let direct = vec![0.0; cells.len()];
        DiffuseLight { spec: *spec, cells, direct }
    }

    /// Returns φ and F at `p`, and U: trilinear between the cells' centres, and beyond the
    /// outermost ones as on them.
    pub fn at(&self, p: DVec3) -> ([DVec3; 4], f64) {
        let (mut sum, mut direct) = ([DVec3::ZERO; 4], 0.0);
        for (c, weight) in corners(&self.spec, p) {
            for (sum, value) in sum.iter_mut().zip(self.cells[c]) {
                *sum += weight * value;
            }
            direct += weight * self.direct[c];
        }
        (sum, direct)
    }

    /// Returns the radiance that a blob at `p` scatters of the diffuse light along `outgoing`:
    /// ϖ'(φ + 3g' F·ω)/4π, at least 0.
    pub fn scattered(&self, law: &ScatterLaw, p: DVec3, outgoing: DVec3) -> DVec3 {
        let ([phi, x, y, z], _) = self.at(p);
        let along = x * outgoing.x + y * outgoing.y + z * outgoing.z;
        let g = law.phase.mean_cosine();
        law.albedo * (phi + 3.0 * g * along).max(DVec3::ZERO) / (4.0 * PI)
    }

    /// Returns the relative change of the radiance toward `outgoing` at `p`, 1/length: by
    /// differences over a cell, of U for the radiance `once` of light that is scattered once.
    pub fn slope(&self, law: &ScatterLaw, p: DVec3, outgoing: DVec3, once: DVec3) -> DVec3 {
        let mean = |v: DVec3| v.element_sum() / 3.0;
        let (first, more) = (mean(once), mean(self.scattered(law, p, outgoing)));
        let edges = self.spec.edges();
        let rise = |axis: usize| {
            let half = 0.5 * edges[axis] * DVec3::AXES[axis];
            let [after, prior] = [p + half, p - half]
                .map(|q| (mean(self.scattered(law, q, outgoing)), self.at(q).1));
            let both = after.1 + prior.1;
            let of_first = if both > 0.0 { 2.0 * (after.1 - prior.1) / both } else { 0.0 };
            (first * of_first + after.0 - prior.0) / edges[axis]
        };
        let all = first + more;
        if all > 0.0 { DVec3::from([0, 1, 2].map(rise)) / all } else { DVec3::ZERO }
    }
}
