//! Weights by which cells get blobs: cells inside of a cloud, which nobody sees, get few (model.md
//! §15).

use super::grid::{Grid, Shape};

/// Vertical optical depth below which a cell hides nothing.
const CLEAR: f64 = 1e-2;
/// Least weight of an opaque cell deep inside of a cloud.
const LEAST_SEEN: f64 = 0.05;

/// Returns the weights by which cells get blobs: 1 − e^{−τ} of the greatest depth, `depths`, times
/// the share of light that the cells around let through. Of several moments, that counts in which
/// they hide a cell least.
pub fn weights(grid: &Grid, moments: &[&[f64]], depths: &[f64]) -> Vec<f64> {
    let mut around = vec![f64::INFINITY; depths.len()];
    for moment in moments {
        let depths: Vec<f64> =
            moment.iter().enumerate().map(|(i, beta)| beta * grid.thickness_m(i)).collect();
        let now = depths_around(grid, &depths);
        around.iter_mut().zip(now).for_each(|(least, now)| *least = least.min(now));
    }
    let seen = |around: f64| (-around).exp().max(LEAST_SEEN);
    depths.iter().zip(around).map(|(depth, around)| -(-depth).exp_m1() * seen(around)).collect()
}

/// Returns the least optical depth around every cell along the six directions of the axes. It ends
/// at a clear cell or at the end of the domain, and the cell's own depth does not count. `depths`:
/// vertical depths.
fn depths_around(grid: &Grid, depths: &[f64]) -> Vec<f64> {
    let Shape { nx, ny, nz } = grid.shape();
    let (n_columns, ground) = (grid.shape().n_columns(), &grid.ground);
    let mut around = vec![f64::INFINITY; depths.len()];
    // A line of `n` cells from `first` on, both ways. Where it is not upward, cells have `widths`.
    let mut along = |first: usize, stride: usize, n: usize, widths: Option<&[f64]>| {
        for is_back in [false, true] {
            let mut before = 0.0;
            for k in 0..n {
                let i = first + stride * if is_back { n - 1 - k } else { k };
                around[i] = around[i].min(before);
                let across =
                    widths.map_or(1.0, |widths| widths[i % n_columns] / grid.thickness_m(i));
                before = if depths[i] < CLEAR { 0.0 } else { before + depths[i] * across };
            }
        }
    };
    for column in 0..n_columns {
        along(column, n_columns, nz, None);
    }
    for level in (0..nz).map(|k| n_columns * k) {
        for y in 0..ny {
            along(level + nx * y, 1, nx, Some(&ground.dx_m));
        }
        for x in 0..nx {
            along(level + x, nx, ny, Some(&ground.dy_m));
        }
    }
    around
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::weather::grid::Ground;

    /// Five levels of 5 x 5 columns: cells of 100 x 100 x 50 m.
    fn cube() -> Grid {
        let shape = Shape { nx: 5, ny: 5, nz: 5 };
        let ones = vec![1.0; 25];
        let ground = Ground::new(shape, (100.0, 100.0), (&ones, &ones), false).unwrap();
        let heights = (0..150).map(|i| 50.0 * f64::from(i / 25)).collect();
        Grid::new(ground, heights).unwrap()
    }

    fn cell(x: usize, y: usize, k: usize) -> usize {
        x + 5 * y + 25 * k
    }

    #[test]
    fn hidden_cells_have_a_twentieth_of_the_weight() {
        let (grid, middle) = (cube(), cell(2, 2, 2));
        // Cells are 5 deep upward and 10 across. In one moment that beside the middle is clear.
        let all = vec![0.1; 125];
        let mut opened = all.clone();
        opened[cell(1, 2, 2)] = 0.0;
        let depths = vec![5.0; 125];
        let opaque = 1.0 - (-5f64).exp();
        let of = |moments: &[&[f64]]| weights(&grid, moments, &depths)[middle];
        assert!((of(&[&all]) - 0.05 * opaque).abs() < 1e-15);
        assert!((of(&[&all, &opened]) - opaque).abs() < 1e-15);
        // Thin cells hide as much as they are deep: two of 0.1 upward.
        let thin = vec![2e-3; 125];
        let found = weights(&grid, &[&thin], &[0.1; 125])[middle];
        assert!((found - (1.0 - (-0.1f64).exp()) * (-0.2f64).exp()).abs() < 1e-15, "{found}");
    }

    #[test]
    fn depths_end_at_clear_cells() {
        let grid = cube();
        // A depth of 2 upward is one of 4 across.
        let mut depths = vec![2.0; 125];
        let around = depths_around(&grid, &depths);
        assert_eq!([cell(2, 2, 4), cell(0, 2, 2)].map(|i| around[i]), [0.0; 2]);
        assert_eq!(
            [cell(2, 2, 3), cell(1, 1, 2), cell(2, 2, 2)].map(|i| around[i]),
            [2.0, 4.0, 4.0]
        );
        // A clear cell beside the middle one opens it, whatever lies beyond.
        depths[cell(3, 2, 2)] = 0.0;
        let around = depths_around(&grid, &depths);
        assert_eq!([cell(2, 2, 2), cell(4, 2, 2), cell(3, 2, 3)].map(|i| around[i]), [0.0; 3]);
        assert_eq!(around[cell(1, 2, 2)], 4.0);
    }
}
