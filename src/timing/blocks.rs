//! What a bench measures: its frames, in blocks of each case in each of its loops.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::attachments::CasePicture;
use super::cases::{Case, Loop};
use super::check::{Check, DevicePicture, Stages};
use super::invocations::PassInvocations;
use super::precision::Reached;
use super::schedule::{Rounds, n_frames_of};
use super::state::{BenchState, BlockWatch, FrameMark, Judging};
use crate::frame::{Amounts, Counts, FrameTimes};
use crate::measure::blocked::N_BLOCKS_NEEDED;

/// How many frames a bench runs, and what it keeps of them.
#[derive(Debug, Clone, Copy)]
pub struct BenchPlan {
    /// Warm-up frames at the start of every block.
    pub n_warm_up: u32,
    /// How many blocks each case has in each of its loops, and in which order.
    pub rounds: Rounds,
    /// Whether every frame is read back and hashed, which adds to the time of the next one.
    pub hash_frames: bool,
    /// Whether the last frame of every case is read back, after all its blocks.
    pub pictures: bool,
    /// Returns the pixels [column, row] of a film whose numbers are kept of the last frame of every
    /// block, to be checked; none without a check.
    pub checked: Option<PixelsOf>,
    /// Bytes that the device writes before each pass, so that caches are cold.
    pub cold_bytes: Option<u64>,
    /// Whether one more frame of every case, after its blocks, counts what its passes invoke.
    pub counts_invocations: bool,
}

/// Returns pixels of a film of some width and height.
pub type PixelsOf = fn(u32, u32) -> Vec<[u32; 2]>;

/// One frame of one block.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Number of the case.
    pub i_case: usize,
    /// Loop that the frame ran in.
    pub of: Loop,
    /// Number of the block over the whole run.
    pub i_block: u32,
    /// Whether the frame belongs to the warm-up.
    pub warm_up: bool,
    /// Measured times.
    pub times: FrameTimes,
    /// SHA-256 of the image, if it was asked for.
    pub image_hash: Option<String>,
    /// What the state of the machine says about it.
    pub mark: FrameMark,
}

/// Consecutive frames of one case in one loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Number of the case.
    pub i_case: usize,
    /// Loop of its frames.
    pub of: Loop,
    /// SHA-256 of its last frame, as stored in the render target; none if Ctrl-C came first, or if
    /// that is not the case's last frame.
    pub image_hash: Option<String>,
}

/// The samples of a bench, complete or up to the point where it was interrupted or failed.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// All frames, in the order in which they ran.
    pub samples: Vec<Sample>,
    /// All blocks, in the order in which they ran.
    pub blocks: Vec<Block>,
    /// Warnings about the last frame of a case: its light, and whether anything can be seen.
    pub notes: Vec<String>,
    /// The settings that "auto" chose for drawing, with the reasons.
    pub chosen: Vec<String>,
    /// The last frames of the cases that ran to their end, if they were asked for.
    pub pictures: Vec<CasePicture>,
    /// Counts of odd values in the last frame of each case that ran to its end.
    pub counts: BTreeMap<usize, Counts>,
    /// Amounts of the last frame of each case that ran to its end.
    pub amounts: BTreeMap<usize, Amounts>,
    /// The last frames of the blocks, to be checked; one of several with the same bytes.
    pub drawn: Vec<DevicePicture>,
    /// The check of the device's stages, if it was asked for.
    pub stages: Option<Stages>,
    /// The checks of pictures, by case.
    pub checks: BTreeMap<usize, Check>,
    /// How narrow the intervals of each case are that has ended, if a precision was asked for.
    pub reached: BTreeMap<usize, Reached>,
    /// What the passes of each case invoked in a frame of their own, where that was counted.
    pub invocations: BTreeMap<usize, Vec<PassInvocations>>,
    /// Whether Ctrl-C came before the end.
    pub interrupted: bool,
    /// Is told which block runs, without waiting for it.
    pub watch: BlockWatch,
    /// The conditions by which frames are judged, if the state of the machine is read.
    pub judging: Option<Judging>,
    /// The state of the machine, once it was judged.
    pub state: Option<BenchState>,
}

/// Locks an outcome. A panic elsewhere leaves whole samples in it.
pub fn lock(outcome: &Mutex<Outcome>) -> MutexGuard<'_, Outcome> {
    outcome.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the number of frames that a bench has at least, warm-up included.
pub fn n_frames_at_least(cases: &[Case], plan: &BenchPlan) -> u64 {
    n_frames_of(cases, plan.rounds, n_rounds_at_least(plan.rounds), plan.n_warm_up)
}

/// Returns the number of rounds that a bench has at least.
pub fn n_rounds_at_least(rounds: Rounds) -> u32 {
    match rounds {
        Rounds::Fixed(n) => n,
        Rounds::Until(_) => N_BLOCKS_NEEDED as u32,
    }
}
