//! The density grid of model.md §8: cells over everything that attenuates light, relative to the
//! lighting origin. Cells of balls are cubes; others are at most as high as wide, unless
//! the number of layers is given (model.md §14).

use glam::{DVec3, UVec3};

/// Half width of a deposited blob along each axis, σ. Mass outside, 1 − erf(3/√2) = 0.27 % an axis,
/// is spread over the rest, so that mass is kept.
pub const DEPOSIT_CUT_SIGMA: f64 = 3.0;

/// Least σ along every axis, in cells, of a blob that is deposited on a grid of wider cells.
pub const LEVEL_SIGMA: f64 = 1.5;

/// Most grids that blobs are deposited on. The cells of the last are 32 times as wide as those of
/// the first. A blob that may lie on a next one would be wider than the greatest grid.
pub const MAX_LEVELS: u32 = 6;

/// Levels save time if the finest grid has at most so many cells for each blob. A wide blob saves
/// 19³ − 10³ cell updates and more, of 20 ns on llvmpipe. Spreading takes 130 ns a cell. So a wide
/// blob pays for 900 cells, and levels pay if more than two blobs in nine are wide.
pub const CELLS_PER_BLOB: u64 = 200;

/// Least σ along every axis, in cells, of a blob that is deposited narrower than it is, and
/// blurred. From there on, that changes its peak by less than the means over cells do.
pub const NARROW_SIGMA: f64 = 1.125;

/// Such blobs have σ below this, in cells.
pub const NARROW_BELOW: f64 = 3.0;

/// Blobs are balls in cells up to this share of σ.
pub const NARROW_ASPECT: f64 = 1e-3;

/// Least number of blurs that such a blob needs; see [`blurs`].
pub const FIRST_BLUR: u32 = 2;

/// Greatest number of blurs that such a blob needs.
pub const LAST_BLUR: u32 = 18;

/// Cell updates of such a blob: of 27 cells for each of two numbers of blurs.
pub const NARROW_UPDATES: f64 = 54.0;

/// Such a blob saves 400 updates and more, of 7 ns on llvmpipe. Blurs take 0.3 µs a cell at most.
/// With three blobs a cell they pay if one in 28 is such a one.
const BLOBS_PER_CELL: u64 = 3;

/// Most cells of a cube whose sums by number of blurs fit the storage buffer that any device can
/// bind, 2²⁷ bytes.
const MAX_NARROW_CELLS: u64 = (1 << 27) / (8 * (LAST_BLUR - FIRST_BLUR + 1) as u64);

/// Margin around the bounds, cells: trilinear sampling at the bounds never leaves the grid.
pub const MARGIN_CELLS: u32 = 2;

/// Greatest number of cells along an axis. It bounds the deposit kernel's shared memory: 3 axes of
/// this many weights are 6 KiB of the 16 KiB that every Vulkan device has.
pub const MAX_CELLS: u32 = 512;

/// Greatest number of steps of a march toward a light. A scene whose step is finer than its grid's
/// diagonal over this number is refused, so that no march is cut short.
pub const MAX_MARCH_STEPS: u32 = 4096;

/// Returns the finest march step, in cells, of a grid of `n` cells a side.
pub fn min_step(n: u32) -> f64 {
    3f64.sqrt() * f64::from(n) / f64::from(MAX_MARCH_STEPS)
}

/// Place and size of a density grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridSpec {
    /// Number of cells along each axis.
    pub n_cells: UVec3,
    /// Edge of the cells along x and z.
    pub cell: f64,
    /// Edge along y over the edge along x and z; 1 for cubes.
    pub aspect: f64,
    /// Low corner of cell (0, 0, 0).
    pub low: DVec3,
}

impl GridSpec {
    /// Returns the grid that covers `low`..`high`. Its cells are `aspect` times as high as wide,
    /// and its longest axis has `n` of them, margin included. The numbers along the others are even
    /// or odd as `n` is.
    pub fn fit(low: DVec3, high: DVec3, n: u32, aspect: f64) -> GridSpec {
        // Bounds without extent still need a cell; there is no other length to take than 1 unit.
        let shape = DVec3::new(1.0, aspect, 1.0);
        let extent = (high - low).max(DVec3::ZERO) / shape;
        let longest = extent.max_element();
        let longest = if longest > 0.0 { longest } else { 1.0 };
        let inner = n.clamp(2 * MARGIN_CELLS + 1, MAX_CELLS) - 2 * MARGIN_CELLS;
        let cell = longest / f64::from(inner);
        // Layers come and go in pairs, one at each end, so that the others stay where they are
        // while the bounds move.
        let odd = inner % 2;
        let pairs = (0.5 * (extent / cell - f64::from(odd)) - 1e-9).ceil().max(DVec3::ZERO);
        let cells = 2 * pairs.as_uvec3() + UVec3::splat(odd);
        let cells = cells.clamp(UVec3::splat(2 - odd), UVec3::splat(inner));
        let n_cells = cells + UVec3::splat(2 * MARGIN_CELLS);
        let low = 0.5 * (low + high) - 0.5 * cell * shape * n_cells.as_dvec3();
        GridSpec { n_cells, cell, aspect, low }
    }

    /// Returns the grid of cells that are `edge` times as wide. The outermost ones may reach beyond
    /// the box.
    pub fn merged(&self, edge: u32) -> GridSpec {
        let before = self.n_cells.map(|n| cells_before(n, edge));
        let n_cells = (self.n_cells + before).map(|n| n.div_ceil(edge));
        let low = self.low - self.edges() * before.as_dvec3();
        GridSpec { n_cells, cell: self.cell * f64::from(edge), low, ..*self }
    }

    /// Returns the grid of cells that are 2^`level` times as wide, from the same corner on. The
    /// last ones may reach beyond the box.
    pub fn level(&self, level: u32) -> GridSpec {
        let n_cells = self.n_cells.map(|n| n.div_ceil(1 << level));
        GridSpec { n_cells, cell: self.cell * f64::from(1 << level), ..*self }
    }

    /// Returns the number of levels that `n_blobs` are deposited on.
    pub fn n_levels(&self, n_blobs: u64) -> u32 {
        if has_levels(n_blobs, self.n_cells.max_element()) { MAX_LEVELS } else { 1 }
    }

    /// Returns how many of these levels blobs of at most `widest` σ can be on, in f32, too.
    pub fn n_used_levels(&self, n_blobs: u64, widest: f64) -> u32 {
        1 + self.level_of(DVec3::splat(widest * (1.0 + 1e-5)), self.n_levels(n_blobs))
    }

    /// Returns whether some of `n_blobs` may be deposited narrower than they are, and blurred. All
    /// must be balls in cells. `aspects` are the least and the greatest; `None` if some are turned.
    pub fn has_narrow(&self, n_blobs: u64, aspects: Option<[f64; 2]>) -> bool {
        let is_ball = |aspect: f64| (aspect / self.aspect - 1.0).abs() <= NARROW_ASPECT;
        has_narrow(n_blobs, self.n_cells.max_element())
            && aspects.is_some_and(|aspects| aspects.into_iter().all(is_ball))
    }

    /// Returns the greatest number of blurs that some of `n_blobs` need, of at most `widest` σ
    /// along x, in f32, too; 0 if none is deposited narrower than it is ([`GridSpec::has_narrow`]).
    pub fn n_blurs(&self, n_blobs: u64, widest: f64, aspects: Option<[f64; 2]>) -> u32 {
        let across = widest * (1.0 + 1e-5) / self.cell;
        if !self.has_narrow(n_blobs, aspects) || across < NARROW_SIGMA {
            return 0;
        }
        blurs(across.min(NARROW_BELOW)) as u32 + 1
    }

    /// Returns the level, of `n_levels`, that a blob of `sigma` along each axis is deposited on:
    /// the widest cells of which it has [`LEVEL_SIGMA`] a σ.
    pub fn level_of(&self, sigma: DVec3, n_levels: u32) -> u32 {
        let cells = (sigma / self.edges()).min_element();
        (1..n_levels).take_while(|l| cells >= LEVEL_SIGMA * f64::from(1 << l)).count() as u32
    }

    /// Returns σ along each axis of what is deposited on a level for a blob of `sigma`. Spreading
    /// it to the finest cells adds the rest of its variance (passes.md "grid").
    pub fn deposited(&self, sigma: DVec3, level: u32) -> DVec3 {
        if level == 0 {
            return sigma;
        }
        (sigma * sigma - self.spread_variance(level)).map(f64::sqrt)
    }

    /// Returns the variance along each axis that spreading from a level to the finest cells adds.
    pub fn spread_variance(&self, level: u32) -> DVec3 {
        0.5 * (f64::from(1 << level).powi(2) - 1.0) * self.edges() * self.edges()
    }

    /// Returns the number of cells.
    pub fn n_total(&self) -> u64 {
        u64::from(self.n_cells.x) * u64::from(self.n_cells.y) * u64::from(self.n_cells.z)
    }

    /// Returns the high corner of the last cell.
    pub fn high(&self) -> DVec3 {
        self.low + self.edges() * self.n_cells.as_dvec3()
    }

    /// Returns the edges of a cell along x, y and z.
    pub fn edges(&self) -> DVec3 {
        self.cell * DVec3::new(1.0, self.aspect, 1.0)
    }

    /// Returns the volume of a cell.
    pub fn cell_volume(&self) -> f64 {
        self.cell.powi(3) * self.aspect
    }

    /// Returns the centre of cell `c`.
    pub fn center(&self, c: usize) -> DVec3 {
        let n = self.n_cells.as_usizevec3();
        let at = DVec3::new((c % n.x) as f64, (c / n.x % n.y) as f64, (c / (n.x * n.y)) as f64);
        self.low + self.edges() * (at + 0.5)
    }

    /// Returns 1 over the mean chord 4V/A of the box.
    pub fn inverse_chord(&self) -> f64 {
        0.5 * (self.high() - self.low).recip().element_sum()
    }

    /// Returns how many cell widths a step of `d` passes: |d|/cell where cells are cubes.
    pub fn cells_along(&self, d: DVec3) -> f64 {
        (d / self.edges()).length()
    }
}

/// Returns whether `n_blobs` are deposited on several levels of a grid whose longest axis has
/// `side` cells. Few blobs take less time than spreading wide cells. A cube's cells count, so that
/// the answer stays as clouds move.
pub fn has_levels(n_blobs: u64, side: u32) -> bool {
    n_blobs * CELLS_PER_BLOB >= u64::from(side).pow(3)
}

/// Returns whether some of `n_blobs` are deposited narrower than they are, and blurred, in a grid
/// whose longest axis has `side` cells.
pub fn has_narrow(n_blobs: u64, side: u32) -> bool {
    let n_cells = u64::from(side).pow(3);
    n_blobs >= BLOBS_PER_CELL * n_cells && n_cells <= MAX_NARROW_CELLS
}

/// Returns how many blurs, each of a variance of ½, make the quadratic B-spline as wide as a blob
/// of `sigma` in its cells: of variances σ² + 1/12 and ¼. Lengths are in cells.
pub fn blurs(sigma: f64) -> f64 {
    2.0 * (sigma * sigma + 1.0 / 12.0 - 0.25)
}

/// Returns how many cells the first merged one reaches beyond the box, of `n` along an axis that
/// are merged by `edge`. A merged cell begins in the middle of the box, so that it stays when
/// layers of cells come and go at both ends.
pub fn cells_before(n: u32, edge: u32) -> u32 {
    (edge - n / 2 % edge) % edge
}

/// Sums of what the six finer cells next to a cell get of it, from the first on, in sixteenths.
const GIVEN_UP_TO: [f64; 6] = [1.0, 6.0, 16.0, 26.0, 31.0, 32.0];

/// Returns the weights that three cells of the next level have in cell `i` of `n` along an axis.
/// The second is the one that the cell lies in. The last cell of the box keeps the shares beyond
/// it.
pub fn given_by_coarser(i: u32, n: u32) -> [f64; 3] {
    let up_to = |k: i64| if k < 0 { 0.0 } else { GIVEN_UP_TO[k.min(5) as usize] / 16.0 };
    [-1, 0, 1].map(|k| {
        let (i, coarse) = (i64::from(i), i64::from(i / 2) + k);
        if coarse < 0 || coarse >= i64::from(n.div_ceil(2)) {
            return 0.0;
        }
        // The first of the six has the number 2c - 2.
        let first = if i == 0 { 0 } else { i - 2 * coarse + 2 };
        let last = if i == i64::from(n) - 1 { 5 } else { i - 2 * coarse + 2 };
        up_to(last) - up_to(first - 1)
    })
}

/// Number of patches along each edge of the box's faces, through which light passes between the
/// cells and surfaces or ground.
pub const PATCHES: u32 = 8;

/// Number of cells at which a grid is coarse enough to be solved by sweeps alone.
pub const COARSEST_CELLS: u32 = 64;

/// Returns the next coarser grid of `n` cells with the given edges, and the axes along which pairs
/// of its cells are merged: those along which cells are short. `None` for the coarsest.
pub fn coarser(n: UVec3, edges: DVec3) -> Option<(UVec3, [bool; 3])> {
    if n.element_product() <= COARSEST_CELLS {
        return None;
    }
    let long = |axis: usize| n[axis] > 1;
    let least = (0..3).filter(|a| long(*a)).map(|a| edges[a]).fold(f64::INFINITY, f64::min);
    let halved = [0, 1, 2].map(|axis| long(axis) && edges[axis] < 1.5 * least);
    let of = |axis: usize| if halved[axis] { n[axis].div_ceil(2) } else { n[axis] };
    Some((UVec3::new(of(0), of(1), of(2)), halved))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_cells_are_merged_across_first() {
        let n = UVec3::new(16, 9, 16);
        let (halved, axes) = coarser(n, DVec3::new(1.0, 0.2, 1.0)).expect("more than 64 cells");
        assert_eq!((halved, axes), (UVec3::new(16, 5, 16), [false, true, false]));
        let (next, axes) = coarser(halved, DVec3::new(1.0, 0.8, 1.0)).expect("more than 64");
        assert_eq!((next, axes), (UVec3::new(8, 3, 8), [true; 3]));
        // Along an axis of one cell nothing is merged, however short the cell is.
        let (next, _) = coarser(UVec3::new(65, 1, 1), DVec3::new(1.0, 0.1, 0.1)).expect("65");
        assert_eq!(next, UVec3::new(33, 1, 1));
        assert_eq!(coarser(UVec3::new(4, 4, 4), DVec3::ONE), None);
    }

    #[test]
    fn the_mean_chord_of_a_cube_is_two_thirds_of_its_edge() {
        let cube = GridSpec { n_cells: UVec3::splat(3), cell: 2.0, aspect: 1.0, low: DVec3::ZERO };
        assert!((cube.inverse_chord() - 0.25).abs() < 1e-15);
        assert_eq!(cube.center(1 + 3 * (2 + 3)), DVec3::new(3.0, 5.0, 3.0));
    }

    #[test]
    fn the_grid_covers_its_bounds_with_the_margin() {
        let (low, high) = (DVec3::new(-3.0, 0.0, 1.0), DVec3::new(5.0, 2.0, 1.5));
        let grid = GridSpec::fit(low, high, 64, 1.0);
        assert_eq!(grid.n_cells, UVec3::new(64, 20, 8));
        let margin = f64::from(MARGIN_CELLS) * grid.cell - 1e-9;
        assert!(
            (low - grid.low).min_element() >= margin
                && (grid.high() - high).min_element() >= margin
        );
    }

    #[test]
    fn cells_stay_where_they_are_when_others_come() {
        for n in [24, 25] {
            let fit = |y: f64| GridSpec::fit(DVec3::new(-3.0, -y, 0.0), DVec3::splat(5.0), n, 1.0);
            let mut before = fit(0.0);
            for i in 1..100 {
                let now = fit(0.03 * f64::from(i));
                let moved = (now.low - before.low) / now.cell;
                // The bounds' middle moves by half of what they grow; with them the grid.
                let with_bounds = -0.015 / now.cell;
                let layers = (now.n_cells.y - before.n_cells.y) / 2;
                assert_eq!(now.n_cells.y, before.n_cells.y + 2 * layers);
                assert!((moved.y - with_bounds + f64::from(layers)).abs() < 1e-9, "{moved}");
                before = now;
            }
        }
    }

    #[test]
    fn wide_blobs_are_deposited_on_wide_cells() {
        let n_cells = UVec3::new(20, 5, 1);
        let grid = GridSpec { n_cells, cell: 0.5, aspect: 0.5, low: DVec3::ZERO };
        let of = |x: f64, y: f64| grid.level_of(DVec3::new(x, y, x), MAX_LEVELS);
        assert_eq!((grid.n_levels(39), grid.n_levels(40)), (1, MAX_LEVELS));
        assert_eq!(grid.level_of(DVec3::splat(50.0), 1), 0);
        assert_eq!(
            [(39, 50.0), (40, 1.4999), (40, 1.5)].map(|(n, w)| grid.n_used_levels(n, w)),
            [1, 1, 2]
        );
        assert_eq!([of(1.49, 9.0), of(1.5, 9.0), of(2.99, 9.0), of(3.0, 9.0)], [0, 1, 1, 2]);
        // Along y cells are half as wide.
        assert_eq!([of(50.0, 0.74), of(50.0, 0.75), of(1e9, 1e9)], [0, 1, 5]);
        let coarse = grid.level(3);
        assert_eq!((coarse.n_cells, coarse.cell), (UVec3::new(3, 1, 1), 4.0));
        // By hand: 16 - 3/2 of the squared edges, 1/4 and 1/16.
        let sigma = grid.deposited(DVec3::splat(4.0), 1);
        assert!((sigma.x.powi(2) - 15.625).abs() < 1e-6);
        assert!((sigma.y.powi(2) - 15.906_25).abs() < 1e-6);
    }

    #[test]
    fn blurs_by_hand() {
        // 2 · (1.265625 - 1/6), and 2 · (9 - 1/6).
        assert!((blurs(NARROW_SIGMA) - (2.53125 - 1.0 / 3.0)).abs() < 1e-14);
        assert_eq!(blurs(NARROW_SIGMA) as u32, FIRST_BLUR);
        assert_eq!(blurs(NARROW_BELOW) as u32 + 1, LAST_BLUR);
        // 99³ · 136 bytes are 131,960,664, and 2²⁷ are 134,217,728.
        assert!(has_narrow(3 * 99 * 99 * 99, 99) && !has_narrow(u64::MAX, 100));
        assert!(!has_narrow(2999, 10) && has_narrow(3000, 10));
        let grid =
            GridSpec { n_cells: UVec3::new(10, 5, 5), cell: 0.5, aspect: 1.0, low: DVec3::ZERO };
        let of = |sigma: f64| grid.n_blurs(3000, sigma, Some([1.0; 2]));
        assert_eq!([of(0.56), of(0.5625), of(1.0), of(1.5), of(9.0)], [0, 3, 8, 18, 18]);
        assert_eq!(grid.n_blurs(2999, 1.0, Some([1.0; 2])), 0);
        let with = |aspects| grid.n_blurs(3000, 1.0, aspects);
        assert_eq!([Some([0.9995, 1.0005]), Some([0.99, 1.0]), None].map(with), [8, 0, 0]);
    }

    #[test]
    fn coarse_cells_give_all_that_they_have() {
        for n in 1_u32..40 {
            let mut given = vec![0.0; n.div_ceil(2) as usize + 2];
            for i in 0..n {
                for (k, weight) in given_by_coarser(i, n).into_iter().enumerate() {
                    given[i as usize / 2 + k] += weight;
                }
            }
            let [before, inside @ .., after] = &given[..] else { unreachable!() };
            assert_eq!([*before, *after], [0.0; 2], "{n}");
            assert!(inside.iter().all(|sum| *sum == 2.0), "{n}: {given:?}");
        }
        // In the middle: 5, 10 and 1 sixteenths, or the same from the other side.
        assert_eq!(given_by_coarser(8, 20).map(|w| 16.0 * w), [5.0, 10.0, 1.0]);
        assert_eq!(given_by_coarser(9, 20).map(|w| 16.0 * w), [1.0, 10.0, 5.0]);
    }

    #[test]
    fn bounds_without_extent_still_have_cells() {
        let grid = GridSpec::fit(DVec3::ONE, DVec3::ONE, 16, 1.0);
        assert!(grid.cell > 0.0 && grid.n_total() > 0 && grid.low.is_finite());
    }
}
