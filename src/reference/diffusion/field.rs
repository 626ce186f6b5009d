//! Diffuse light of a frame, and what a blob scatters of it toward the eye.

use std::f64::consts::PI;

use glam::DVec3;

use super::faces::FaceLight;
use super::multigrid::Multigrid;
use super::sources::{DiffusionMedium, Sources};
use super::system::{System, before, next};
use crate::model::grid::GridSpec;
use crate::model::light::Light;
use crate::model::medium::ScatterLaw;
use crate::reference::transmit::Obstacles;

/// Fluence and flux of diffuse light in every cell.
#[derive(Debug, Clone)]
pub struct DiffuseLight {
    spec: GridSpec,
    /// φ, W m⁻², and F along each axis, W m⁻².
    pub cells: Vec<[DVec3; 4]>,
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
        let (grid, cells) = (obstacles.spec, obstacles.cells);
        let sources = Sources::new(of, obstacles, lights, of_solids.is_some());
        let system = System::new(of, grid, cells, &sources, lights, of_solids);
        let phi = Multigrid::new(system, grid.edges()).solve(n_cycles);
        DiffuseLight::of_fluence(of, grid, cells, &sources, &phi)
    }

    /// Returns φ with the flux F = q − D∇φ; at the faces of the box by one-sided differences.
    pub fn of_fluence(
        of: &DiffusionMedium,
        grid: &GridSpec,
        cells: &[f64],
        sources: &Sources,
        phi: &[DVec3],
    ) -> DiffuseLight {
        let (n, h) = (grid.n_cells.as_usizevec3(), grid.edges());
        let flux = |c: usize, axis: usize| {
            let (after, prior) = (next(n, c, axis), before(n, c, axis));
            let steps = f64::from(u8::from(after.is_some()) + u8::from(prior.is_some()));
            let rise = phi[after.unwrap_or(c)] - phi[prior.unwrap_or(c)];
            let slope = if steps > 0.0 { rise / (steps * h[axis]) } else { DVec3::ZERO };
            sources.carried[c][axis] - of.reach(cells[c]) * slope
        };
        let of_cell = |c: usize| [phi[c], flux(c, 0), flux(c, 1), flux(c, 2)];
        let (cells, direct) = ((0..cells.len()).map(of_cell).collect(), sources.direct.clone());
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
        let n = self.spec.n_cells.as_usizevec3();
        let at = (p - self.spec.low) / self.spec.edges() - DVec3::splat(0.5);
        let at = at.max(DVec3::ZERO).min((n - 1).as_dvec3());
        let (base, part) = (at.floor().as_usizevec3(), at - at.floor());
        let (mut sum, mut direct) = ([DVec3::ZERO; 4], 0.0);
        for corner in 0..8usize {
            let (mut c, mut weight, mut stride) = (0, 1.0, 1);
            for axis in 0..3 {
                let is_next = corner >> axis & 1;
                weight *= if is_next == 1 { part[axis] } else { 1.0 - part[axis] };
                c += stride * (base[axis] + is_next).min(n[axis] - 1);
                stride *= n[axis];
            }
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
