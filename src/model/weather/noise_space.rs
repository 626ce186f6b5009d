//! The space in which the noise of invented detail lives (model.md §15).

use glam::DVec3;

use super::grid::Grid;
use super::particles::{Layout, Place};

/// Length of the first of the noise's octaves, cells; the last is about a quarter of one long.
const LONGEST: f64 = 2.0;
/// Most cells in height of one unit of the modulation, so that the detail of flat cells is not
/// flat, too.
const FLATTEST: f64 = 4.0;

/// The space of the noise: the first octave has the length 1 in it. Heights count by levels, so
/// that levels that rise and fall from step to step take their detail along.
pub struct NoiseSpace {
    /// Lengths of a unit, m.
    pub unit_m: DVec3,
    /// Levels of a unit.
    pub levels: f64,
}

impl NoiseSpace {
    /// Returns the space of a grid's mean cell.
    pub fn new(grid: &Grid) -> NoiseSpace {
        let cell = grid.mean_cell();
        let levels = (cell.x / cell.y).round().clamp(1.0, FLATTEST) * LONGEST;
        let unit_m = DVec3::new(LONGEST * cell.x, levels * cell.y, LONGEST * cell.z);
        NoiseSpace { unit_m, levels }
    }

    /// Returns the place of a blob, in units of the noise.
    pub fn of(&self, layout: &Layout, grid: &Grid, place: Place) -> DVec3 {
        let (ground, n_columns) = (&grid.ground, grid.shape().n_columns());
        let (column, level) =
            (place.i_cell as usize % n_columns, place.i_cell as usize / n_columns);
        let at = layout.place_in_cell(place);
        DVec3::new(
            (ground.east_m[column] + at.x * ground.dx_m[column]) / self.unit_m.x,
            (level as f64 + 0.5 + at.y) / self.levels,
            (ground.south_m[column] + at.z * ground.dy_m[column]) / self.unit_m.z,
        )
    }

    /// Returns a way in m, or a velocity in m/s, in units of the noise.
    pub fn in_units(&self, way: DVec3) -> DVec3 {
        way / self.unit_m
    }
}
