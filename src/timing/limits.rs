//! Limits of a bench and of a study, checked before anything is allocated for it.

use super::blocks::{BenchPlan, n_frames_at_least, n_rounds_at_least};
use super::cases::Case;
use crate::error::{Error, Result};
use crate::io::memory;
use crate::io::text_file::RECORD_LIMIT;
use crate::model::cloud::{CloudSource, Particle};
use crate::model::harmonics::Coefficients;
use crate::model::scene::Scene;

/// Most frames of a bench, warm-up included. A frame's record, its row and its text take about
/// 3 KiB together.
pub const MOST_FRAMES: u64 = 500_000;
/// Most blocks of a bench. `run.json` lists each of them in about 100 bytes.
pub const MOST_BLOCKS: u64 = 100_000;
/// Most cases of a sweep, and most configurations of a study: each is loaded before the first runs.
pub const MOST_CASES: u64 = 4096;
/// Most timed frames of a study. Each has a line of about 150 bytes in `times.csv`, all of which
/// must fit into `TABLE_LIMIT`.
pub const MOST_STUDY_FRAMES: u64 = 1_000_000;
/// Most bytes of the pictures that a run keeps, and of the particles that all its scenes hold where
/// memory is short.
pub const MOST_BYTES: u64 = 512 << 20;

/// Bytes of a loop in `run.json`, as measured: the times of all passes.
const LOOP_BYTES: u64 = 12 << 10;
/// Bytes of a block in `run.json`.
const BLOCK_BYTES: u64 = 100;
/// Bytes of a particle of a list.
const PARTICLE_BYTES: u64 = size_of::<Particle>() as u64;
/// Bytes of a particle's harmonics.
const HARMONICS_BYTES: u64 = size_of::<Coefficients>() as u64;

/// Returns an error unless a sweep or a study has few enough cases. `flag` names the argument that
/// multiplies them.
///
/// # Errors
/// Fails if the numbers of values in `axes` multiply to more than [`MOST_CASES`].
pub fn check_cases(flag: &str, axes: impl Iterator<Item = usize>) -> Result<()> {
    let n = axes.fold(1u64, |n, values| n.saturating_mul(values as u64));
    if n > MOST_CASES {
        return Err(Error::limit(format!(
            "{flag}: {n} combinations, expected at most {MOST_CASES}; run them in parts"
        )));
    }
    Ok(())
}

/// Checks that the times of a study fit in memory.
///
/// # Errors
/// Fails if its configurations have too many timed frames together.
pub fn check_study(n_configurations: u64, n_rounds: u32, n_frames: u32) -> Result<()> {
    let n = n_configurations.saturating_mul(u64::from(n_rounds) * u64::from(n_frames));
    if n > MOST_STUDY_FRAMES {
        return Err(Error::limit(format!(
            "{n} timed frames of {n_configurations} configurations, expected at most \
             {MOST_STUDY_FRAMES}, whose times fit in memory; reduce --rounds or --frames"
        )));
    }
    Ok(())
}

/// Sums what the scenes of a run hold in memory.
#[derive(Debug)]
pub struct SceneMemory {
    used: u64,
    most: u64,
}

impl SceneMemory {
    /// Returns the memory of no scene, which may grow to half of what is free.
    pub fn of_machine() -> SceneMemory {
        SceneMemory { used: 0, most: MOST_BYTES.max(memory::available() / 2) }
    }

    /// Adds a scene.
    ///
    /// # Errors
    /// Fails if all scenes together hold too much.
    pub fn add(&mut self, scene: &Scene) -> Result<()> {
        let of_list = |source: &CloudSource| match source {
            CloudSource::Particles(list) => {
                let of_harmonics = list.harmonics().map_or(0, |_| HARMONICS_BYTES);
                list.len() as u64 * (PARTICLE_BYTES + of_harmonics)
            }
            _ => 0,
        };
        self.used += scene.clouds.iter().map(|cloud| of_list(&cloud.source)).sum::<u64>();
        if self.used > self.most {
            return Err(Error::limit(format!(
                "the particle lists of all cases take more than {} MiB; run the cases in parts",
                self.most >> 20
            )));
        }
        Ok(())
    }
}

/// Checks that the frames, blocks and pictures of a bench fit in memory.
///
/// # Errors
/// Fails if there are too many; the error says how many there may be.
pub fn check_bench(cases: &[Case], plan: &BenchPlan) -> Result<()> {
    let n_frames = n_frames_at_least(cases, plan);
    let n_loops: u64 = cases.iter().map(|case| case.loops.len() as u64).sum();
    let n_blocks = n_loops.saturating_mul(u64::from(n_rounds_at_least(plan.rounds)));
    if n_frames > MOST_FRAMES || n_blocks > MOST_BLOCKS {
        return Err(Error::limit(format!(
            "{n_frames} frames in {n_blocks} blocks: the records of {MOST_FRAMES} frames, warm-up \
             included, and of {MOST_BLOCKS} blocks fit in memory; reduce --repeat, \
             --frames, --warmup or --sweep"
        )));
    }
    if n_loops.saturating_mul(LOOP_BYTES) + n_blocks * BLOCK_BYTES > RECORD_LIMIT {
        return Err(Error::limit(format!(
            "{} cases of {n_loops} loops: run.json would be too large to be read again; run the \
             cases in parts, or fewer loops of each",
            cases.len()
        )));
    }
    let pixels =
        |case: &Case| 3 * u64::from(case.scene.film.width) * u64::from(case.scene.film.height);
    let bytes: u64 = cases.iter().map(pixels).sum();
    if plan.pictures && bytes > MOST_BYTES {
        return Err(Error::limit(format!(
            "the last pictures of {} cases take {} MiB, the limit is {} MiB; run the cases in \
             parts or without --out",
            cases.len(),
            bytes >> 20,
            MOST_BYTES >> 20
        )));
    }
    Ok(())
}
