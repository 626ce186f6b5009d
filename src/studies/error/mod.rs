//! Run time against error over the knobs of a scene: every configuration is drawn once and compared
//! with a reference, and all are timed in turn with the scene as it stands.
//!
//! [`knobs`] say what is varied, [`design`] which configurations that makes, [`errors`] and
//! [`turns`] measure each, [`front`] says which are worth having, [`run`] does all of it and
//! [`files`] keeps it.

pub mod design;
pub mod errors;
pub mod files;
pub mod front;
pub mod knobs;
pub mod parts;
pub mod players;
pub mod records;
pub mod run;
pub mod turns;
