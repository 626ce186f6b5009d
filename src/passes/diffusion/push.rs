//! Push constants of the kernels that solve for φ.

use crate::layout::diffusion::{LevelRecord, LevelStep};
use crate::layout::frame::GridRecord;
use crate::layout::record;

record! {
    /// Push constants of `diffusion_sources.comp`.
    pub struct SourcesPush {
        /// The density grid.
        grid: GridRecord,
        /// ϖ.
        albedo: [f32; 3],
        /// c, 1/length.
        inverse_chord: f32,
        /// g.
        g: f32,
        /// f.
        straight: f32,
        /// Number of lights.
        n_lights: u32,
        /// Number of surfaces that may hide a light.
        n_surfaces: u32,
        /// Length of a step of the march.
        step_length: f32,
        /// The most steps of a march.
        max_steps: u32,
        /// Extinction beyond which a cell counts as no denser, 1/length.
        densest: f32,
    }
}

record! {
    /// Push constants of `diffusion_system.comp`.
    pub struct SystemPush {
        /// The density grid.
        grid: GridRecord,
        /// 1 − ϖ.
        absorbed: [f32; 3],
        /// c, 1/length.
        inverse_chord: f32,
        /// 1 − ϖg.
        kept: [f32; 3],
        /// Number of lights.
        n_lights: u32,
        /// Cells of all levels.
        n_all: u32,
        /// Extinction beyond which a cell counts as no denser, 1/length.
        densest: f32,
    }
}

record! {
    /// Push constants of `diffusion_coarsen.comp` and `diffusion_restrict.comp`.
    pub struct PairPush {
        /// The finer level.
        fine: LevelRecord,
        /// The coarser level.
        coarse: LevelRecord,
        /// 1 along the axes that are halved.
        halved: [u32; 3],
        /// Cells of all levels.
        n_all: u32,
    }
}

record! {
    /// Push constants of `diffusion_sweep.comp`.
    pub struct SweepPush {
        /// The level.
        level: LevelRecord,
        /// The coarser level, where its φ is added.
        coarse: LevelRecord,
        /// 1 along the axes that are halved.
        halved: [u32; 3],
        /// Cells of all levels.
        n_all: u32,
        /// 1: the long step of a pair of sweeps, else the short one.
        is_long: u32,
    }
}

record! {
    /// Push constants of `diffusion_cycle.comp`.
    pub struct CyclePush {
        /// The finest of the levels.
        level: LevelRecord,
        /// From level to level, three bits that are 1 where an axis is halved; the finest lowest.
        halvings: u32,
        /// Number of levels.
        n_levels: u32,
        /// Cells of all levels.
        n_all: u32,
        /// Sweeps of the coarsest level.
        n_sweeps: u32,
        /// 1: operators of the coarser levels are to be made.
        is_new: u32,
        /// 1: φ is after the first sweep, from φ = 0.
        is_first: u32,
    }
}

impl CyclePush {
    /// Returns those of a cycle through some levels, the finest first: ten at most.
    pub fn new(
        steps: &[LevelStep],
        n_all: u32,
        n_sweeps: u32,
        [is_first, is_new]: [bool; 2],
    ) -> CyclePush {
        let bits = |step: &LevelStep| (0..3).map(|axis| step.halved[axis] << axis).sum::<u32>();
        CyclePush {
            level: steps[0].level,
            halvings: steps.iter().rev().fold(0, |all, step| all << 3 | bits(step)),
            n_levels: steps.len() as u32,
            n_all,
            n_sweeps,
            is_new: u32::from(is_new),
            is_first: u32::from(is_first),
        }
    }
}

record! {
    /// Push constants of `diffusion_flux.comp`.
    pub struct FluxPush {
        /// The density grid.
        grid: GridRecord,
        /// 1 − ϖg.
        kept: [f32; 3],
        /// c, 1/length.
        inverse_chord: f32,
        /// ϖ'.
        even: [f32; 3],
        /// Extinction beyond which a cell counts as no denser, 1/length.
        densest: f32,
        /// 3ϖ'g'.
        forward: [f32; 3],
        /// g'.
        g: f32,
    }
}
