//! Run time against error over the knobs of a scene.

pub mod records;
