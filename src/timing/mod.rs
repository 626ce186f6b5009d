//! Times scenes and compares the results.
//!
//! A bench times [`cases`] (a scene in one phase, at one point of a [`sweep`]), each in several
//! loops (serial or parallel, with or without skipping), in interleaved [`blocks`] of frames.
//! [`schedule`] orders them, [`running`] runs them, and [`precision`] decides when they are
//! enough. The samples become the [`records`] of `run.json` ([`outcome`], [`overlap`]) and the
//! rows of `frames.csv` ([`frame_rows`]), which [`results`] writes and reads with the files
//! beside them ([`attachments`]). [`still`] remarks on scenes in which nothing moves.
//! [`compare`] compares results and gives each measure a [`verdict`]; [`difference`] lists what
//! else differs between them. [`history`] finds changes in a series of results. [`parts`] joins
//! a bench that several nodes timed, and [`starts`] one that several processes ran. [`trace`]
//! writes the frames as a time line. [`state`] reads the clocks and the load of the machine
//! beside the frames, and [`bench_state`] judges the frames by them. [`roofs`] are what a
//! device can do at most, [`caches`] the size of its last cache level, and [`shares`] compares
//! passes with both. [`invocations`] counts what passes invoke. [`machine`], [`names`] and
//! [`json`] serve all of them, and the studies too.

pub mod attachments;
pub mod bench_state;
pub mod blocks;
pub mod caches;
pub mod cases;
pub mod check;
pub mod compare;
pub mod difference;
pub mod frame_rows;
pub mod history;
mod intervals;
pub mod invocations;
pub mod json;
pub mod limits;
pub mod machine;
pub mod names;
pub mod outcome;
pub mod overlap;
pub mod parts;
pub mod precision;
pub mod records;
pub mod results;
pub mod roofs;
pub mod running;
pub mod schedule;
pub mod shares;
pub mod starts;
pub mod state;
pub mod still;
pub mod sweep;
mod timed_rows;
pub mod trace;
pub mod verdict;

pub use intervals::N_FRAMES_NEEDED;
