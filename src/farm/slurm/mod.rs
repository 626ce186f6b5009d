//! Slurm: job scripts, submission of a plan as an array of tasks, and the state of those tasks.

mod command;
mod jobs;
mod scripts;

pub use jobs::{Array, states, submit};
pub use scripts::{Job, Script};
