//! Prediction of how long work takes, division of work into shards of suitable lengths, and the
//! price (docs/explanation/farm.md).
//!
//! [`workload`] counts what takes time in scenes, [`model`] fits a duration to each such count and
//! predicts with it, [`split`] and [`pack`] divide the work.

mod amounts;
mod cell_visits;
mod layers;
mod least_squares;
mod model;
mod pack;
mod pieces;
mod split;
mod workload;

pub use amounts::Amounts;
pub use model::{ErrorSummary, Fit, TimedRun, fit};
pub use pack::{Estimate, Rate};
pub use pieces::PieceAmounts;
pub use split::split;
pub use workload::{StudyTurns, Workload, bench_workload, frames_workload, study_workload};
