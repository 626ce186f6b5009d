//! Times scenes and compares the results.
//!
//! A bench times [`cases`] (a scene in one phase, at one point of a [`sweep`]), each in several
//! loops (serial or parallel, with or without skipping), in interleaved [`blocks`] of frames. Its
//! samples become the [`records`] of `run.json` ([`outcome`], [`overlap`]) and the rows of
//! `frames.csv` ([`frame_rows`]), which [`results`] writes and reads with the files beside them
//! ([`attachments`]). [`still`] remarks on scenes in which nothing moves. [`compare`] decides which
//! of two results is faster; [`difference`] lists what else differs between them. [`parts`] joins a
//! bench that several nodes timed. [`invocations`] counts what passes invoke. [`trace`] writes the
//! frames as a time line. [`machine`], [`names`] and [`json`] serve all of them, and the studies
//! too.

pub mod attachments;
pub mod blocks;
pub mod cases;
pub mod check;
pub mod compare;
pub mod difference;
pub mod frame_rows;
mod intervals;
pub mod invocations;
pub mod json;
pub mod limits;
pub mod machine;
pub mod names;
pub mod outcome;
pub mod overlap;
pub mod parts;
pub mod records;
pub mod results;
pub mod still;
pub mod sweep;
pub mod trace;

pub use intervals::N_FRAMES_NEEDED;
