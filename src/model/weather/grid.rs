//! Places of WRF's cells: sizes on the ground from map factors, bottoms and tops from staggered
//! heights.

use glam::DVec3;

/// Number of cells west–east, south–north and upward.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Cells west–east.
    pub nx: usize,
    /// Cells south–north.
    pub ny: usize,
    /// Cells upward.
    pub nz: usize,
}

impl Shape {
    /// Returns the number of columns.
    pub fn n_columns(self) -> usize {
        self.nx * self.ny
    }

    /// Returns the number of cells.
    pub fn n_cells(self) -> usize {
        self.n_columns() * self.nz
    }

    /// Returns the index of the cell of column `i_column` at level `k`.
    pub fn cell(self, k: usize, i_column: usize) -> usize {
        k * self.n_columns() + i_column
    }
}

/// Columns of a grid on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Ground {
    /// Number of cells.
    pub shape: Shape,
    /// Size of the columns west–east, m: the file's spacing over the map factor.
    pub dx_m: Vec<f64>,
    /// Size of the columns south–north, m.
    pub dy_m: Vec<f64>,
    /// Centres of the columns, m east of the domain's centre. Sizes are summed along rows, so that
    /// every column has its own size, and rows are shifted as map factors differ.
    pub east_m: Vec<f64>,
    /// Centres of the columns, m south of the domain's centre, summed along columns.
    pub south_m: Vec<f64>,
}

impl Ground {
    /// Computes sizes and centres from the file's spacing and map factors, one a column. A factor
    /// of 0 counts as 1 if `is_idealised`: such a file has no map.
    ///
    /// # Errors
    /// A map factor is out of range.
    pub fn new(
        shape: Shape,
        spacing_m: (f64, f64),
        factors: (&[f64], &[f64]),
        is_idealised: bool,
    ) -> Result<Self, String> {
        let sizes = |spacing: f64, factors: &[f64]| -> Result<Vec<f64>, String> {
            factors.iter().map(|&factor| size(spacing, factor, is_idealised)).collect()
        };
        let (dx_m, dy_m) = (sizes(spacing_m.0, factors.0)?, sizes(spacing_m.1, factors.1)?);
        let mut east_m = vec![0.0; shape.n_columns()];
        let mut south_m = vec![0.0; shape.n_columns()];
        for j in 0..shape.ny {
            let row = j * shape.nx..(j + 1) * shape.nx;
            centres(dx_m[row.clone()].iter().copied(), |i, place| east_m[row.start + i] = place);
        }
        for i in 0..shape.nx {
            let column = (0..shape.ny).map(|j| dy_m[j * shape.nx + i]);
            // Rows run north, and z points south.
            centres(column, |j, place| south_m[j * shape.nx + i] = -place);
        }
        Ok(Ground { shape, dx_m, dy_m, east_m, south_m })
    }

    /// Returns the area of a column.
    pub fn area_m2(&self, i_column: usize) -> f64 {
        self.dx_m[i_column] * self.dy_m[i_column]
    }
}

/// Range of the map factors of WRF's projections.
const FACTORS: (f64, f64) = (0.05, 20.0);

fn size(spacing_m: f64, factor: f64, is_idealised: bool) -> Result<f64, String> {
    let factor = if is_idealised && factor == 0.0 { 1.0 } else { factor };
    if !(FACTORS.0..=FACTORS.1).contains(&factor) {
        return Err(format!(
            "a map factor is {factor}: expected one from {} to {}",
            FACTORS.0, FACTORS.1
        ));
    }
    Ok(spacing_m / factor)
}

/// Computes the centres of intervals laid end to end about their common middle.
fn centres(sizes: impl Iterator<Item = f64> + Clone, mut put: impl FnMut(usize, f64)) {
    let mut edge = -sizes.clone().sum::<f64>() / 2.0;
    for (i, size) in sizes.enumerate() {
        put(i, edge + size / 2.0);
        edge += size;
    }
}

/// A grid at one moment: the ground, and the bottom and top of every cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Columns on the ground.
    pub ground: Ground,
    /// Staggered heights, m above sea level. *Shape*: [nz + 1][column].
    pub heights_m: Vec<f64>,
}

impl Grid {
    /// Combines ground and heights.
    ///
    /// # Errors
    /// The heights of a column do not rise.
    pub fn new(ground: Ground, heights_m: Vec<f64>) -> Result<Self, String> {
        let n = ground.shape.n_columns();
        let is_above = |(below, above): (&f64, &f64)| above > below;
        if let Some(i) =
            heights_m.iter().zip(heights_m.iter().skip(n)).position(|pair| !is_above(pair))
        {
            let (k, j, i_row) = (i / n, i % n / ground.shape.nx, i % ground.shape.nx);
            let (below, above) = (heights_m[i], heights_m[i + n]);
            return Err(format!(
                "heights do not rise: {above:.1} m above {below:.1} m at level {k}, row {j}, \
                 column {i_row}; expected every staggered level above the one before it"
            ));
        }
        Ok(Grid { ground, heights_m })
    }

    /// Returns the number of cells.
    pub fn shape(&self) -> Shape {
        self.ground.shape
    }

    /// Returns the mean size of the cells, m: east, up, south.
    pub fn mean_cell(&self) -> DVec3 {
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len().max(1) as f64;
        let Shape { nz, .. } = self.shape();
        let n = self.shape().n_columns();
        let whole = (0..n).map(|i| self.heights_m[nz * n + i] - self.heights_m[i]).sum::<f64>();
        let thickness = whole / (n * nz).max(1) as f64;
        DVec3::new(mean(&self.ground.dx_m), thickness, mean(&self.ground.dy_m))
    }

    /// Returns the height of a cell's bottom.
    pub fn bottom_m(&self, i_cell: usize) -> f64 {
        self.heights_m[i_cell]
    }

    /// Returns the height of a cell's top.
    pub fn top_m(&self, i_cell: usize) -> f64 {
        self.heights_m[i_cell + self.ground.shape.n_columns()]
    }

    /// Returns the thickness of a cell.
    pub fn thickness_m(&self, i_cell: usize) -> f64 {
        self.top_m(i_cell) - self.bottom_m(i_cell)
    }

    /// Returns the height of a cell's mass point: the mean of bottom and top, as WRF's tools
    /// destagger.
    pub fn middle_m(&self, i_cell: usize) -> f64 {
        0.5 * (self.bottom_m(i_cell) + self.top_m(i_cell))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: Shape = Shape { nx: 3, ny: 2, nz: 1 };

    #[test]
    fn cells_lie_end_to_end_about_the_middle() {
        let factors = [1.0, 2.0, 1.0, 1.0, 1.0, 1.0];
        let ground = Ground::new(SHAPE, (100.0, 50.0), (&factors, &[1.0; 6]), false).unwrap();
        assert_eq!(ground.dx_m, [100.0, 50.0, 100.0, 100.0, 100.0, 100.0]);
        assert_eq!(ground.east_m, [-75.0, 0.0, 75.0, -100.0, 0.0, 100.0]);
        // The first row is the southernmost.
        assert_eq!(ground.south_m, [25.0, 25.0, 25.0, -25.0, -25.0, -25.0]);
    }

    #[test]
    fn map_factors_of_zero_count_as_one_in_idealised_files() {
        let of = |factor: f64, is_idealised| {
            Ground::new(SHAPE, (9.0, 9.0), (&[factor; 6], &[1.0; 6]), is_idealised)
        };
        assert_eq!(of(0.0, true).unwrap().dx_m, [9.0; 6]);
        assert_eq!(of(0.0, false).unwrap_err(), "a map factor is 0: expected one from 0.05 to 20");
        assert!(of(f64::NAN, true).is_err() && of(-1.0, true).is_err() && of(1e30, false).is_err());
    }

    #[test]
    fn heights_that_do_not_rise_are_refused_with_their_place() {
        let ground = Ground::new(SHAPE, (9.0, 9.0), (&[1.0; 6], &[1.0; 6]), false).unwrap();
        let mut heights: Vec<f64> = (0..12).map(|i| if i < 6 { 10.0 } else { 60.0 }).collect();
        let grid = Grid::new(ground.clone(), heights.clone()).unwrap();
        assert_eq!((grid.thickness_m(4), grid.middle_m(4)), (50.0, 35.0));
        heights[10] = 10.0;
        let said = Grid::new(ground.clone(), heights.clone()).unwrap_err();
        assert!(
            said.starts_with(
                "heights do not rise: 10.0 m above 10.0 m at level 0, row 1, column 1; expected"
            ),
            "{said}"
        );
        heights[10] = f64::NAN;
        assert!(Grid::new(ground, heights).is_err());
    }
}
