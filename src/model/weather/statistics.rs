//! Statistics of the clouds of a step.

use super::grid::Grid;

/// Extinction below which a cell holds no visible cloud, m⁻¹: through 10 km of it 99 % of the light
/// pass.
pub const FAINT: f64 = 1e-6;

/// Statistics of the clouds of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudStatistics {
    /// Number of cells above [`FAINT`].
    pub n_cells: usize,
    /// Number of columns with such a cell.
    pub n_columns: usize,
    /// Greatest extinction, m⁻¹.
    pub greatest_extinction: f64,
    /// Greatest vertical optical depth of a column.
    pub greatest_depth: f64,
    /// Mean over the columns of 1 − e^{−τ}.
    pub mean_opacity: f64,
    /// Lowest bottom and highest top of such a cell, m above sea level.
    pub base_and_top_m: Option<(f64, f64)>,
    /// Number of columns whose highest cell is such a cell. With more than one level, clouds may
    /// continue above the file's top.
    pub n_columns_to_the_top: usize,
    /// ∫ β dV over the domain, m².
    pub mass_m2: f64,
}

/// Returns the vertical optical depth of each column, Σ β Δh.
pub fn column_depths(grid: &Grid, extinction: &[f64]) -> Vec<f64> {
    let n_columns = grid.shape().n_columns();
    let mut depths = vec![0.0; n_columns];
    for (i, beta) in extinction.iter().enumerate() {
        depths[i % n_columns] += beta * grid.thickness_m(i);
    }
    depths
}

/// Computes the statistics of an extinction field, m⁻¹.
pub fn of(grid: &Grid, extinction: &[f64]) -> CloudStatistics {
    let shape = grid.shape();
    let n = shape.n_columns();
    let depths = column_depths(grid, extinction);
    let mut has_cloud = vec![false; n];
    let mut base_and_top_m: Option<(f64, f64)> = None;
    let mut n_cells = 0;
    for i in extinction.iter().enumerate().filter(|(_, beta)| **beta > FAINT).map(|(i, _)| i) {
        n_cells += 1;
        has_cloud[i % n] = true;
        let (base, top) = base_and_top_m.unwrap_or((f64::INFINITY, f64::NEG_INFINITY));
        base_and_top_m = Some((base.min(grid.bottom_m(i)), top.max(grid.top_m(i))));
    }
    CloudStatistics {
        n_cells,
        n_columns: has_cloud.iter().filter(|has| **has).count(),
        greatest_extinction: extinction.iter().copied().fold(0.0, f64::max),
        greatest_depth: depths.iter().copied().fold(0.0, f64::max),
        mean_opacity: depths.iter().map(|depth| -(-depth).exp_m1()).sum::<f64>() / n as f64,
        base_and_top_m,
        n_columns_to_the_top: if shape.nz > 1 {
            (0..n).filter(|&k| extinction[shape.cell(shape.nz - 1, k)] > FAINT).count()
        } else {
            0
        },
        mass_m2: depths.iter().enumerate().map(|(i, depth)| depth * grid.ground.area_m2(i)).sum(),
    }
}
