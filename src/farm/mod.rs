//! Work that is spread over machines with a shared folder.
//!
//! A [`Plan`] cuts work into shards, and [`run()`] does one of them. A run may be killed, started
//! twice or cut off from the others at any time. A result appears in the shared folder as a whole,
//! and is verified by its hashes. [`merge()`] puts all results together. [`Status`] tells what is
//! done. [`gc()`] removes what killed runs have left behind.
//!
//! Runs are started by a [`Pool`] of processes on one machine or by [`slurm`]. The kinds of work
//! implement [`Work`]; a new kind is a file under `work/`. [`cost`] predicts how long
//! work takes, by a model that [`calibrate()`] fits to timed runs.

mod attempts;
mod calibrate;
mod calibration;
mod cost;
mod cut;
mod cut_reference;
mod gc;
mod journal;
mod manifest;
mod merge;
mod node;
mod plan;
mod pool;
pub(crate) mod process;
mod ranges;
mod run;
mod scene_source;
pub(crate) mod slurm;
mod status;
mod store;
mod transient;
mod work;
mod workplace;

pub(crate) use calibrate::{calibrate, calibrate_by_farms, n_frames};
pub(crate) use calibration::FileModel;
pub(crate) use cost::{
    Estimate, Rate, StudyTurns, Workload, bench_workload, frames_workload, study_workload,
};
pub(crate) use cut::{Cut, CutOptions, MOST_ITEMS, ShardSize};
pub(crate) use cut_reference::ReferenceDivision;
pub(crate) use gc::{GcOptions, gc};
pub(crate) use merge::{MergeOptions, merge};
pub(crate) use plan::{Plan, PlanRequest};
pub(crate) use pool::{Ended, Pool};
pub(crate) use ranges::ranges;
pub(crate) use run::{Outcome, RunOptions, UnfinishedRun, give_up_after, run};
pub(crate) use status::{ShardStatus, State, Status};
pub(crate) use work::{AnyWork, Frames, Merged, Study, Sweep};
