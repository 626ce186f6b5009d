//! Times scenes: cases and the blocks of frames that they are run in, the machine that they run on,
//! the records of what came out, and the comparison of two runs.

pub mod bench;
pub mod cases;
pub mod companions;
pub mod compare;
pub mod difference;
pub mod machine;
pub mod outcome;
pub mod overlap;
pub mod parts;
pub mod recorded;
pub mod records;
pub mod rows;
pub mod trace;
