//! Weights by which cells get blobs: cells inside of a cloud, which nobody sees, get few (model.md
//! §15).

use super::grid::{Grid, Shape};

/// Vertical optical depth below which a cell hides nothing.
const CLEAR: f64 = 1e-2;
/// Least weight of an opaque cell deep inside of a cloud.
const LEAST_SEEN: f64 = 0.05;

/// Returns the weight of every cell by which it gets blobs: 1 − e^{−τ} of its greatest depth
/// `depths`, times the share of light that the cells around let through in the moment in which they
/// hide it least.
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

/// Returns the optical depth of cloud around every cell of vertical depths `depths`: the least of
/// the six directions of the axes, up to a clear cell or the end of the domain. The cell's own does
/// not count.
fn depths_around(grid: &Grid, depths: &[f64]) -> Vec<f64> {
    let Shape { nx, ny, nz } = grid.shape();
    let (n_columns, ground) = (grid.shape().n_columns(), &grid.ground);
    let mut around = vec![f64::INFINITY; depths.len()];
    let mut along = |cells: &mut dyn Iterator<Item = usize>, widths: Option<&[f64]>| {
        let mut before = 0.0;
        for i in cells {
            around[i] = around[i].min(before);
            let across = widths.map_or(1.0, |widths| widths[i % n_columns] / grid.thickness_m(i));
            before = if depths[i] < CLEAR { 0.0 } else { before + depths[i] * across };
        }
    };
    for column in 0..n_columns {
        along(&mut (0..nz).map(|k| column + n_columns * k), None);
        along(&mut (0..nz).rev().map(|k| column + n_columns * k), None);
    }
    for k in 0..nz {
        let level = n_columns * k;
        for y in 0..ny {
            along(&mut (0..nx).map(|x| level + nx * y + x), Some(&ground.dx_m));
            along(&mut (0..nx).rev().map(|x| level + nx * y + x), Some(&ground.dx_m));
        }
        for x in 0..nx {
            along(&mut (0..ny).map(|y| level + nx * y + x), Some(&ground.dy_m));
            along(&mut (0..ny).rev().map(|y| level + nx * y + x), Some(&ground.dy_m));
        }
    }
    around
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::weather::grid::Ground;

    #[test]
    fn hidden_cells_have_a_twentieth_of_the_weight() {
        // A row of three cells of 100 x 100 x 50 m, five rows wide and five levels high.
        let shape = Shape { nx: 3, ny: 5, nz: 5 };
        let ones = vec![1.0; 15];
        let ground = Ground::new(shape, (100.0, 100.0), (&ones, &ones), false).unwrap();
        let heights = (0..90).map(|i| 50.0 * f64::from(i / 15)).collect();
        let grid = Grid::new(ground, heights).unwrap();
        // Depths of 5 upward and 10 across, but in one moment the cell west of the middle is clear.
        let (middle, west) = (1 + 3 * 2 + 15 * 2, 3 * 2 + 15 * 2);
        let all = vec![0.1; 75];
        let mut opened = all.clone();
        opened[west] = 0.0;
        let depths = vec![5.0; 75];
        let opaque = 1.0 - (-5f64).exp();
        let of = |moments: &[&[f64]]| weights(&grid, moments, &depths)[middle];
        assert!((of(&[&all]) - 0.05 * opaque).abs() < 1e-15);
        assert!((of(&[&all, &opened]) - opaque).abs() < 1e-15);
        // Thin cells hide as much as they are deep: 0.2 across.
        let thin = vec![2e-3; 75];
        let found = weights(&grid, &[&thin], &[0.1; 75])[middle];
        assert!((found - (1.0 - (-0.1f64).exp()) * (-0.2f64).exp()).abs() < 1e-15, "{found}");
    }

    #[test]
    fn depths_end_at_clear_cells() {
        // Cells of 100 x 100 x 50 m: five levels of 5 x 5 columns.
        let shape = Shape { nx: 5, ny: 5, nz: 5 };
        let ones = vec![1.0; 25];
        let ground = Ground::new(shape, (100.0, 100.0), (&ones, &ones), false).unwrap();
        let heights = (0..150).map(|i| 50.0 * f64::from(i / 25)).collect();
        let grid = Grid::new(ground, heights).unwrap();
        let cell = |x: usize, y: usize, k: usize| x + 5 * y + 25 * k;
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
