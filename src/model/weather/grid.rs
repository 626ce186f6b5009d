//! Where WRF's cells are: their sizes on the ground from the map factors, their bottoms and tops
//! from staggered heights.

/// Cells along west–east, south–north and upward.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    pub nx: usize,
    pub ny: usize,
    pub nz: usize,
}

impl Shape {
    pub fn n_columns(self) -> usize {
        self.nx * self.ny
    }

    pub fn n_cells(self) -> usize {
        self.n_columns() * self.nz
    }

    /// Number of a cell of column `i_column` at level `k`.
    pub fn cell(self, k: usize, i_column: usize) -> usize {
        k * self.n_columns() + i_column
    }
}

/// What the ground under a grid is divided into.
#[derive(Debug, Clone, PartialEq)]
pub struct Ground {
    pub shape: Shape,
    /// Sizes of the columns, m: the file's spacing over the map factor there.
    pub dx_m: Vec<f64>,
    pub dy_m: Vec<f64>,
    /// Their centres, m east and m south of the domain's centre: sizes added up along rows and
    /// columns, so that every column has its own size; rows are then shifted against each other by
    /// what map factors differ.
    pub east_m: Vec<f64>,
    pub south_m: Vec<f64>,
}

impl Ground {
    /// From the file's spacing and its map factors, a column each; a factor of 0 is that of an
    /// idealised file, which has no map, if `is_idealised`.
    ///
    /// # Errors
    /// What a spacing or a factor should be.
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
            // Rows go north, and z goes south.
            centres(column, |j, place| south_m[j * shape.nx + i] = -place);
        }
        Ok(Ground { shape, dx_m, dy_m, east_m, south_m })
    }

    pub fn area_m2(&self, i_column: usize) -> f64 {
        self.dx_m[i_column] * self.dy_m[i_column]
    }

    /// Greatest distance of a column's edge from the centre, m.
    pub fn extent_m(&self) -> (f64, f64) {
        let greatest = |places: &[f64], sizes: &[f64]| {
            places
                .iter()
                .zip(sizes)
                .map(|(place, size)| place.abs() + size / 2.0)
                .fold(0.0, f64::max)
        };
        (greatest(&self.east_m, &self.dx_m), greatest(&self.south_m, &self.dy_m))
    }
}

/// Map factors of any projection where WRF runs.
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

/// Centres of intervals laid end to end, around the middle of all.
fn centres(sizes: impl Iterator<Item = f64> + Clone, mut put: impl FnMut(usize, f64)) {
    let mut edge = -sizes.clone().sum::<f64>() / 2.0;
    for (i, size) in sizes.enumerate() {
        put(i, edge + size / 2.0);
        edge += size;
    }
}

/// A grid at one moment: the ground, and the height of every cell's bottom and top.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pub ground: Ground,
    /// Staggered, m above sea level: nz + 1 levels.
    pub heights_m: Vec<f64>,
}

impl Grid {
    /// # Errors
    /// Where heights do not rise.
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

    pub fn shape(&self) -> Shape {
        self.ground.shape
    }

    pub fn bottom_m(&self, i_cell: usize) -> f64 {
        self.heights_m[i_cell]
    }

    pub fn top_m(&self, i_cell: usize) -> f64 {
        self.heights_m[i_cell + self.ground.shape.n_columns()]
    }

    pub fn thickness_m(&self, i_cell: usize) -> f64 {
        self.top_m(i_cell) - self.bottom_m(i_cell)
    }

    /// Height of a cell's mass point: the mean of its bottom and top, as WRF's tools destagger.
    pub fn middle_m(&self, i_cell: usize) -> f64 {
        0.5 * (self.bottom_m(i_cell) + self.top_m(i_cell))
    }

    /// The grid `weight` of the way to another moment's.
    pub fn toward(&self, other: &Grid, weight: f64) -> Grid {
        let mix = |(a, b): (&f64, &f64)| a + weight * (b - a);
        let heights_m = self.heights_m.iter().zip(&other.heights_m).map(mix).collect();
        Grid { ground: self.ground.clone(), heights_m }
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
        // The first row is the southern one.
        assert_eq!(ground.south_m, [25.0, 25.0, 25.0, -25.0, -25.0, -25.0]);
        assert_eq!(ground.extent_m(), (150.0, 50.0));
    }

    #[test]
    fn factors_of_nothing_are_one_without_a_map() {
        let of = |factor: f64, is_idealised| {
            Ground::new(SHAPE, (9.0, 9.0), (&[factor; 6], &[1.0; 6]), is_idealised)
        };
        assert_eq!(of(0.0, true).unwrap().dx_m, [9.0; 6]);
        assert_eq!(of(0.0, false).unwrap_err(), "a map factor is 0: expected one from 0.05 to 20");
        assert!(of(f64::NAN, true).is_err() && of(-1.0, true).is_err() && of(1e30, false).is_err());
    }

    #[test]
    fn heights_rise_or_say_where_not() {
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
