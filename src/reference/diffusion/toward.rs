//! Light that cells scatter toward the eye.

use glam::DVec3;

use super::moments::corners;
use super::of_suns::OfSuns;
use super::second_order::{self, Second};
use super::sources::{DiffusionMedium, Moments};
use crate::model::grid::GridSpec;
use crate::model::light::UP;
use crate::model::medium::MeanMedium;

/// Light that each cell of a grid sends out toward an eye, times 4π over s σ.
pub(super) struct Toward {
    pub cells: Vec<DVec3>,
}

/// Returns the direction from the middle of a cell to the eye; up where the eye is.
pub(super) fn direction(grid: &GridSpec, c: usize, eye: DVec3) -> DVec3 {
    (eye - grid.center(c)).try_normalize().unwrap_or(UP)
}

impl Toward {
    /// Returns what cells send out: `light` is φ and F, `arrived` what they scatter of the light of
    /// suns and lamps. `second` is the second order of the cells that bounces lead between.
    pub fn new(
        of: &DiffusionMedium,
        grid: &GridSpec,
        (light, arrived): (&[Moments], &[Moments]),
        (bounce_grid, second): (&GridSpec, &[Second]),
        eye: DVec3,
    ) -> Toward {
        let MeanMedium { g, straight: f, .. } = of.mean;
        let [even, forward] = of.mean.scattered();
        let sent = |c: usize| {
            let w = direction(grid, c, eye);
            let along = |m: &Moments| m[1] * w.x + m[2] * w.y + m[3] * w.z;
            let own = &light[c];
            let of_second: DVec3 = corners(bounce_grid, grid.center(c))
                .into_iter()
                .map(|(from, weight)| weight * second_order::along(&second[from], w))
                .sum();
            let diffuse = even * own[0] + forward * along(own) + of_second;
            diffuse.max(DVec3::ZERO) + OfSuns::new(&arrived[c]).toward(w, g, f)
        };
        Toward { cells: (0..light.len()).map(sent).collect() }
    }
}
