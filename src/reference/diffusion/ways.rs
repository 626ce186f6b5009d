//! Straight ways through the cells of a grid.

use glam::DVec3;

use super::faces::{FaceLight, Skies};
use crate::model::grid::GridSpec;
use crate::model::light::Light;

/// Cells through which light goes straight, and what comes in at the box.
pub(super) struct Ways<'a> {
    grid: &'a GridSpec,
    /// s σ by cell, 1/length.
    weakened: Vec<DVec3>,
    skies: Skies,
    of_solids: Option<&'a FaceLight>,
}

impl<'a> Ways<'a> {
    /// Returns the ways through cells that weaken light by `weakened` per length.
    pub fn new(
        grid: &'a GridSpec,
        weakened: Vec<DVec3>,
        lights: &[Light],
        of_solids: Option<&'a FaceLight>,
    ) -> Ways<'a> {
        Ways { grid, weakened, skies: Skies::new(lights), of_solids }
    }

    /// Returns 4π times the radiance that comes to the middle of cell `c` from the direction
    /// `toward`, where cells send out `sent` along the way, times 4π. The share `above` of it comes
    /// from above the horizon. Of the sky, `outside` is taken. `solids` is π times the radiance of
    /// surfaces and ground at a place of a face.
    pub fn radiance(
        &self,
        c: usize,
        (toward, above): (DVec3, f64),
        outside: impl Fn(DVec3) -> DVec3,
        solids: impl Fn(&FaceLight, (usize, usize), DVec3) -> DVec3,
        sent: impl Fn(usize) -> DVec3,
    ) -> DVec3 {
        let (n, edges) = (self.grid.n_cells.as_usizevec3(), self.grid.edges());
        let mut at = [c % n.x, c / n.x % n.y, c / (n.x * n.y)];
        let across = [0, 1, 2].map(|k| edges[k] / toward[k].abs().max(1e-6));
        let mut face = across.map(|a| 0.5 * a);
        let (mut sum, mut passed, mut done) = (DVec3::ZERO, DVec3::ONE, 0.0);
        let (mut c, axis) = (c, 0..3);
        loop {
            let least = |i: &usize, j: &usize| face[*i].total_cmp(&face[*j]);
            let k = axis.clone().min_by(least).unwrap_or_default();
            let kept = (-self.weakened[c] * (face[k] - done)).exp();
            sum += passed * (1.0 - kept) * sent(c);
            passed *= kept;
            done = face[k];
            face[k] += across[k];
            let side = usize::from(toward[k] > 0.0);
            if at[k] == [0, n[k] - 1][side] {
                let part = (DVec3::from(at.map(|i| i as f64)) + 0.5) / n.as_dvec3();
                let of_solids = self.of_solids.map_or(DVec3::ZERO, |f| solids(f, (k, side), part));
                let of_sky = outside(self.skies.along(toward, above));
                return sum + 4.0 * passed * (of_solids + of_sky);
            }
            let stride = [1, n.x, n.x * n.y][k];
            (at[k], c) = match side {
                1 => (at[k] + 1, c + stride),
                _ => (at[k] - 1, c - stride),
            };
        }
    }
}
