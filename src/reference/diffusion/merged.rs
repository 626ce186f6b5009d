//! Merged cells, between which bounces lead.

use glam::DVec3;

use super::moments::corners;
use super::sources::{DiffusionMedium, Moments, Sources};
use crate::model::grid::GridSpec;

/// Means over the volume of a merged cell.
#[derive(Clone, Default)]
struct Sums {
    extinction: f64,
    /// Q0.
    scattered: DVec3,
    /// q/D along each axis.
    momentum: [DVec3; 3],
    /// Extinction times what is scattered of the light of suns and lamps.
    sent: Moments,
}

/// Returns the merged cell that cell `c` is in.
fn place_in(grid: &GridSpec, few: &GridSpec, c: usize) -> usize {
    let m = few.n_cells.as_usizevec3();
    let [x, y, z] = ((grid.center(c) - few.low) / few.edges()).to_array().map(|at| at as usize);
    x + m.x * (y + m.y * z)
}

/// Cells of a grid, merged.
pub(super) struct Merged {
    /// The merged cells.
    pub grid: GridSpec,
    /// The medium, with the densest of these cells.
    pub of: DiffusionMedium,
    /// Extinction by cell.
    pub cells: Vec<f64>,
    /// Q0 and q.
    pub sources: Sources,
    /// Light of suns and lamps that each cell scatters: ϖ'U, and ϖ'W along each axis.
    pub arrived: Vec<Moments>,
}

impl Merged {
    /// Merges cells `edge` by `edge` by `edge`. Their extinction is `cells`.
    pub fn new(
        of: &DiffusionMedium,
        (grid, cells): (&GridSpec, &[f64]),
        sources: &Sources,
        arrived: &[Moments],
        edge: u32,
    ) -> Merged {
        let few = grid.merged(edge);
        let of_few = DiffusionMedium { densest: of.densest / f64::from(edge), ..*of };
        let mut sums = vec![Sums::default(); few.n_total() as usize];
        let share = 1.0 / f64::from(edge.pow(3));
        for (c, sigma) in cells.iter().enumerate() {
            let sum = &mut sums[place_in(grid, &few, c)];
            sum.extinction += share * sigma;
            sum.scattered += share * sources.scattered[c];
            for axis in 0..3 {
                sum.momentum[axis] += share * sources.carried[c][axis] / of.reach(*sigma);
            }
            for (sum, sent) in sum.sent.iter_mut().zip(arrived[c]) {
                *sum += share * *sigma * sent;
            }
        }
        let counted = |sum: &Sums| sum.extinction.min(of_few.densest);
        // A merged cell sends out all that its cells do, also where less extinction counts.
        let sent = |sum: &Sums| {
            let sigma = counted(sum);
            if sigma > 0.0 { sum.sent.map(|sent| sent / sigma) } else { Moments::default() }
        };
        let carried = |sum: &Sums| sum.momentum.map(|q| of_few.reach(sum.extinction) * q);
        Merged {
            grid: few,
            of: of_few,
            cells: sums.iter().map(counted).collect(),
            sources: Sources {
                scattered: sums.iter().map(|sum| sum.scattered).collect(),
                carried: sums.iter().map(carried).collect(),
                ..Sources::default()
            },
            arrived: sums.iter().map(sent).collect(),
        }
    }

    /// Adds the rise from `before` to `after` in the merged cells to the light of the cells of
    /// `grid`: trilinear between the merged cells' centres.
    pub fn spread(&self, grid: &GridSpec, light: &mut [Moments], [before, after]: [&[Moments]; 2]) {
        for (c, light) in light.iter_mut().enumerate() {
            for (from, weight) in corners(&self.grid, grid.center(c)) {
                for (k, light) in light.iter_mut().enumerate() {
                    *light += weight * (after[from][k] - before[from][k]);
                }
            }
        }
    }
}
