//! Frames of a scene, timed: each case in each of its loops, in interleaved blocks.

use std::sync::atomic::{AtomicBool, Ordering};

use sha2::{Digest, Sha256};

use super::cases::{Case, Loop};
use super::stage::Stage;
use crate::error::{Error, Result};
use crate::frame::FrameTimes;
use crate::frame::render::Renderer;
use crate::gpu::shader::hex;

/// How long and how often.
#[derive(Debug, Clone, Copy)]
pub struct BenchPlan {
    /// Untimed frames at the start of every block.
    pub n_warm_up: u32,
    /// Blocks of each case in each of its loops.
    pub n_rounds: u32,
    /// Read back and hash every frame, which adds to the next one's time.
    pub hash_frames: bool,
}

/// One frame of one block.
#[derive(Debug, Clone)]
pub struct Sample {
    pub i_case: usize,
    pub of: Loop,
    /// Counts over the whole run.
    pub i_block: u32,
    pub warm_up: bool,
    pub times: FrameTimes,
    pub image_hash: Option<String>,
}

/// A run of frames of one case in one loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    pub i_case: usize,
    pub of: Loop,
    /// SHA-256 of its last frame, as it lies in the target; none where Ctrl-C came before it.
    pub image_hash: Option<String>,
}

/// What a bench came to. Kept whole also when it was interrupted.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    pub samples: Vec<Sample>,
    /// In the order they ran.
    pub blocks: Vec<Block>,
    pub interrupted: bool,
}

/// Cases and loops in the order A B, B A, A B, …: whatever drifts over the run (heat, neighbours) falls on all alike.
pub fn block_order(cases: &[Case], n_rounds: u32) -> Vec<(usize, Loop)> {
    let in_order: Vec<(usize, Loop)> =
        cases.iter().enumerate().flat_map(|(i, c)| c.loops.iter().map(move |of| (i, *of))).collect();
    let of_round = |i: u32| {
        let mut order = in_order.clone();
        if i % 2 == 1 {
            order.reverse();
        }
        order
    };
    (0..n_rounds).flat_map(of_round).collect()
}

/// Frames of all blocks together, warm-up included.
pub fn n_frames_total(cases: &[Case], plan: &BenchPlan) -> u64 {
    let of = |c: &Case| c.loops.len() as u64 * (u64::from(c.n_frames) + u64::from(plan.n_warm_up));
    u64::from(plan.n_rounds) * cases.iter().map(of).sum::<u64>()
}

/// Runs the plan on `stage`, which holds the first case, and gives back the stage of the last; `tick` is called after every
/// frame, for progress. Ends early, and cleanly, once `stop` is set.
pub fn run(
    mut stage: Stage,
    cases: &[Case],
    plan: &BenchPlan,
    stop: &AtomicBool,
    tick: &mut dyn FnMut(),
) -> Result<(Stage, Outcome)> {
    let mut outcome = Outcome::default();
    let mut i_staged = 0;
    for (i_block, (i_case, of)) in (0..).zip(block_order(cases, plan.n_rounds)) {
        let case = &cases[i_case];
        let n = plan.n_warm_up.checked_add(case.n_frames).and_then(|n| case.i_first.checked_add(n));
        let end = n.ok_or_else(|| Error::usage("the frames of a block, warm-up included, exceed 32 bits"))?;
        if std::mem::replace(&mut i_staged, i_case) != i_case {
            stage = stage.again(case.scene.clone(), of.skip)?;
        }
        stage.set_skip(of.skip);
        let samples = &mut outcome.samples;
        let on_frame = &mut |times: FrameTimes, renderer: &mut Renderer| {
            let image_hash = if plan.hash_frames { Some(image_hash(renderer)?) } else { None };
            let warm_up = times.i_frame - case.i_first < plan.n_warm_up;
            samples.push(Sample { i_case, of, i_block, warm_up, times, image_hash });
            tick();
            Ok(!stop.load(Ordering::Relaxed))
        };
        stage.run(of.threading, case.i_first..end, on_frame)?;
        let is_cut = stop.load(Ordering::Relaxed);
        let image_hash = if is_cut { None } else { Some(image_hash(&mut stage.renderer)?) };
        outcome.blocks.push(Block { i_case, of, image_hash });
        if is_cut {
            outcome.interrupted = true;
            break;
        }
    }
    Ok((stage, outcome))
}

/// SHA-256 of the last frame, as it lies in the target.
fn image_hash(renderer: &mut Renderer) -> Result<String> {
    Ok(hex(&Sha256::digest(renderer.image_bytes()?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::scene::Threading::{Parallel, Serial};
    use crate::study::cases::cases;

    #[test]
    fn rounds_alternate_their_order() {
        let loaded = |n: u32| {
            let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
            let loaded = crate::io::scene_file::load(&path, &[], None).unwrap();
            cases(loaded, &[], &[Serial, Parallel], Some(n), [true, n > 5])
        };
        let names = |cases: &[Case], n| -> String {
            let of = |(i, of): (usize, Loop)| format!("{i}{} ", of.name());
            block_order(cases, n).into_iter().map(of).collect()
        };
        assert_eq!(names(&loaded(5), 3), "0serial 0parallel 0parallel 0serial 0serial 0parallel ");
        let two = [loaded(6), loaded(5)].concat();
        let there = ["0serial", "0parallel", "0serial no-skip", "1serial", "1parallel"];
        let back = there.iter().rev();
        assert_eq!(names(&two, 2).trim_end(), there.iter().chain(back).copied().collect::<Vec<_>>().join(" "));
        let plan = BenchPlan { n_warm_up: 2, n_rounds: 2, hash_frames: false };
        assert_eq!(n_frames_total(&two, &plan), 2 * (3 * 8 + 2 * 7));
    }
}
