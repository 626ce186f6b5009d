//! Clouds of a weather model as plain arrays: from pressure, temperature and mixing ratios on WRF's
//! grid to extinction in m⁻¹, and from extinction to blobs (model.md §15). No
//! files: `io::weather` reads them.
//!
//! Arrays are ordered as in the files: level by level from the ground, each level row by row from
//! the south, each row from the west.

pub mod agreement;
pub mod air;
pub mod detail;
pub mod diagnosed;
pub mod extinction;
pub mod flow;
pub mod grid;
mod hidden;
pub mod interval;
mod noise_space;
mod opaque;
pub mod particles;
pub mod places;
pub mod profile;
pub mod statistics;
pub mod steps;
pub mod sun;
