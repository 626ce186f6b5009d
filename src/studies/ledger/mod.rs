//! What every approximation is off by, each against the one below it (model.md §10).

pub mod records;
pub mod run;
mod steps;
