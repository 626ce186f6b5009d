//! Times scenes and compares the results.
//!
//! A bench times [`cases`] (a scene in one phase, at one point of a [`sweep`]), each in several
//! loops (serial or parallel, with or without skipping), in interleaved [`blocks`] of frames. Its
//! samples become the [`records`] of `run.json` ([`outcome`], [`overlap`]) and the rows of
//! `frames.csv` ([`frame_rows`]), which [`results`] writes and reads with the files beside them
//! ([`attachments`]). [`still`] remarks on scenes in which nothing moves. [`compare`] decides which
//! of two results is faster; [`difference`] lists what else differs between them. [`parts`] joins a
//! bench that several nodes timed. [`roofs`] are what a device can do at most, [`caches`] the size
//! of its last cache level, and [`shares`] compares passes with both. [`trace`] writes the frames
//! as a time line. [`machine`], [`names`] and [`json`] serve all of them, and the studies too.

pub mod attachments;
pub mod blocks;
pub mod caches;
pub mod cases;
pub mod check;
pub mod compare;
pub mod difference;
pub mod frame_rows;
mod intervals;
pub mod json;
pub mod limits;
pub mod machine;
pub mod names;
pub mod outcome;
pub mod overlap;
pub mod parts;
pub mod records;
pub mod results;
pub mod roofs;
pub mod shares;
pub mod still;
pub mod sweep;
pub mod trace;

pub use intervals::N_FRAMES_NEEDED;
