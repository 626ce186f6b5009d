//! Records of the grids on which light diffuses, and the numbers of the medium there.

use glam::{DVec3, UVec3};

use crate::layout::frame::GridRecord;
use crate::layout::record;
use crate::model::grid::{GridSpec, PATCHES, coarser};
use crate::model::medium::MeanMedium;

record! {
    /// One of the grids of the diffusion solver.
    pub struct LevelRecord {
        /// Cells along each axis.
        n_cells: [u32; 3],
        /// Place of its first cell in the buffers of all grids.
        i_first: u32,
    }
}

impl LevelRecord {
    /// Returns the number of cells.
    pub fn n_total(&self) -> u32 {
        self.n_cells.iter().product()
    }
}

/// A level and how it is merged to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelStep {
    /// The level.
    pub level: LevelRecord,
    /// 1 along the axes that are halved.
    pub halved: [u32; 3],
}

/// Number of patches of the box's faces.
pub const N_PATCHES: u32 = 6 * PATCHES * PATCHES;

/// All levels together have at most this many times the cells of the finest one: a level has at
/// most two thirds of the cells of the one before.
pub const LEVELS_ROOM: u64 = 3;

/// Returns all levels, the finest first, and the number of their cells.
pub fn levels(grid: &GridRecord) -> (Vec<LevelStep>, u32) {
    let (mut steps, mut i_first) = (Vec::new(), 0);
    let mut n = UVec3::from(grid.n_cells);
    let mut edges = DVec3::new(1.0, f64::from(grid.aspect), 1.0);
    loop {
        let level = LevelRecord { n_cells: n.to_array(), i_first };
        i_first += level.n_total();
        let next = coarser(n, edges);
        let halved = next.map_or([false; 3], |(_, halved)| halved).map(u32::from);
        steps.push(LevelStep { level, halved });
        let Some((coarse, _)) = next else { return (steps, i_first) };
        n = coarse;
        edges *= UVec3::from(halved).as_dvec3() + 1.0;
    }
}

/// Numbers of the medium, rounded once. They change with materials and the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiffusionParams {
    /// ϖ.
    pub albedo: [f32; 3],
    /// 1 − ϖ.
    pub absorbed: [f32; 3],
    /// 1 − ϖg.
    pub kept: [f32; 3],
    /// g.
    pub g: f32,
    /// f.
    pub straight: f32,
    /// c, 1/length.
    pub inverse_chord: f32,
    /// s = 1 − ϖf.
    pub weakened: [f32; 3],
    /// ϖ' = ϖ(1 − f)/s.
    pub even: [f32; 3],
    /// 3ϖ'g' = 3ϖ(g − f)/s.
    pub forward: [f32; 3],
    /// g' = (g − f)/(1 − f).
    pub scattered_g: f32,
    /// Factor of the second order in what is scattered, over ϖ'.
    pub second: f32,
    /// Extinction beyond which a cell counts as no denser, 1/length.
    pub densest: f32,
}

impl DiffusionParams {
    /// Returns the numbers of a medium on a grid.
    pub fn new(mean: &MeanMedium, grid: &GridSpec) -> DiffusionParams {
        let f32s = |v: DVec3| v.as_vec3().to_array();
        let [even, forward] = mean.scattered();
        DiffusionParams {
            albedo: f32s(mean.albedo),
            absorbed: f32s(DVec3::ONE - mean.albedo),
            kept: f32s(DVec3::ONE - mean.albedo * mean.g),
            g: mean.g as f32,
            straight: mean.straight as f32,
            inverse_chord: grid.inverse_chord() as f32,
            weakened: f32s(mean.weakened()),
            even: f32s(even),
            forward: f32s(forward),
            scattered_g: mean.scattered_g() as f32,
            second: mean.second as f32,
            densest: mean.densest(grid) as f32,
        }
    }

    /// Returns ϖ(1 − f).
    pub fn scattered(&self) -> [f32; 3] {
        self.albedo.map(|albedo| albedo * (1.0 - self.straight))
    }

    /// Returns s: the mean over the channels of 1 − ϖf.
    pub fn mean_weakened(&self) -> f64 {
        let straight = self.albedo.map(|albedo| f64::from(albedo) * f64::from(self.straight));
        1.0 - straight.iter().sum::<f64>() / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merged_cells_of_a_record_are_those_of_its_grid() {
        let (n_cells, low) = (UVec3::new(24, 17, 13), DVec3::new(-1.0, 2.0, 0.5));
        let spec = GridSpec { n_cells, cell: 0.25, aspect: 0.5, low };
        for edge in [1, 2, 3, 8] {
            let merged = spec.merged(edge);
            assert!(merged.high().cmpge(spec.high()).all());
            assert!(merged.low.cmple(spec.low).all());
            let (found, expected) = (GridRecord::from(&spec).merged(edge), (&merged).into());
            let GridRecord { n_cells, cell, aspect, low, .. } = expected;
            assert_eq!((found.n_cells, found.cell, found.aspect), (n_cells, cell, aspect));
            assert!(found.low == low && (found.inv_cell * cell - 1.0).abs() < 2.0 * f32::EPSILON);
        }
        // In the middle of 13 cells, after 6 of them, a merged one begins.
        assert_eq!(spec.merged(2).n_cells, UVec3::new(12, 9, 7));
        let three = spec.merged(3);
        assert_eq!(three.n_cells, UVec3::new(8, 6, 5));
        assert_eq!((three.low - spec.low) / spec.edges(), DVec3::new(0.0, -1.0, 0.0));
    }

    #[test]
    fn levels_follow_one_another_and_have_room() {
        for (n, aspect) in
            [([32, 20, 14], 1.0), ([3, 3, 300], 1.0), ([5, 5, 5], 0.1), ([1; 3], 1.0)]
        {
            let grid = GridRecord { n_cells: n, aspect, ..GridRecord::default() };
            let (steps, n_all) = levels(&grid);
            let mut expected = 0;
            for step in &steps {
                assert_eq!(step.level.i_first, expected);
                expected += step.level.n_total();
            }
            assert_eq!(expected, n_all);
            let n_finest = u64::from(steps[0].level.n_total());
            assert!(u64::from(n_all) <= LEVELS_ROOM * n_finest);
            assert!(steps[steps.len() - 1].level.n_total() <= 64);
        }
    }
}
