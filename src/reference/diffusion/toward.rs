//! Light that cells scatter toward the eye.

use std::f64::consts::PI;

use glam::DVec3;

use super::moments::corners;
use super::second_order::{self, Orders, Second};
use super::sources::{DiffusionMedium, Moments};
use crate::model::grid::GridSpec;
use crate::model::light::UP;
use crate::model::medium::MeanMedium;
use crate::model::phase::Phase;

/// Light that each cell of a grid sends out toward an eye, times 4π over s σ.
pub(super) struct Toward {
    pub cells: Vec<DVec3>,
}

/// Returns the direction from the middle of a cell to the eye; up where the eye is.
pub(super) fn direction(grid: &GridSpec, c: usize, eye: DVec3) -> DVec3 {
    (eye - grid.center(c)).try_normalize().unwrap_or(UP)
}

impl Toward {
    /// Returns what cells send out: `light` is φ and F, `arrived` what suns and lamps make them
    /// send out. `second` is the second order of the cells that bounces lead between.
    pub fn new(
        of: &DiffusionMedium,
        grid: &GridSpec,
        (light, arrived): (&[Moments], &[Orders]),
        (bounce_grid, second): (&GridSpec, &[Second]),
        eye: DVec3,
    ) -> Toward {
        let MeanMedium { g, straight: f, .. } = of.mean;
        let [even, forward] = of.mean.scattered();
        let phase = Phase::HenyeyGreenstein { g };
        let mean = |v: DVec3| v.element_sum() / 3.0;
        let sent = |c: usize| {
            let w = direction(grid, c, eye);
            let along = |m: &Moments| m[1] * w.x + m[2] * w.y + m[3] * w.z;
            let (own, suns) = (&light[c], &arrived[c].low);
            let of_second: DVec3 = corners(bounce_grid, grid.center(c))
                .into_iter()
                .map(|(from, weight)| weight * second_order::along(&second[from], w))
                .sum();
            let diffuse = even * own[0] + forward * along(own) + of_second;
            let flux = DVec3::new(mean(suns[1]), mean(suns[2]), mean(suns[3]));
            let fluence = mean(forward) * mean(suns[0]);
            let of_flux = if fluence > 0.0 { flux.length() * mean(even) / fluence } else { 0.0 };
            let directed = of_flux.min(1.0);
            let cosine = flux.normalize_or_zero().dot(w);
            let peak = 4.0 * PI * phase.at(cosine) / (1.0 - f).max(f64::MIN_POSITIVE);
            diffuse.max(DVec3::ZERO) + suns[0] * (1.0 - directed + directed * peak)
        };
        Toward { cells: (0..light.len()).map(sent).collect() }
    }
}
